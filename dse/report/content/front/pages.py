"""A front as a page, for a terminal with `--explain` and for Markdown: the table, reasons, and what it rests on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from dse.answers.designs import Point
from dse.answers.result import Result
from dse.report.content.front.document import AlternativePage, Document
from dse.report.content.front.filters import insisting_section
from dse.report.content.front.first_screen import TOP, Screen, further_blocks
from dse.report.page import Block, Page, Section, Text, labelled, listing, texts
from dse.report.words.basis import basis_words, scale_words
from dse.report.words.choice import beyond_words
from dse.report.words.contention import (
    asks_for_responses,
    processing_words,
    response_time_words,
    waiting_words,
)
from dse.report.words.reasons import (
    REDUCED,
    effort_words,
    exclusion_words,
    extrapolated_words,
    hidden_words,
    rounding_words,
    unused_words,
)

EXPLAINED = 3
"""Maximum number of alternatives that are explained one by one; near-identical ones do not count among them."""


def printed_page(document: Document, top: int | None = TOP, studies: Sequence[Section] = ()) -> Page:
    """The page for a terminal: `top` alternatives (None: all), and the verdict at the end, where the cursor is.

    Sections: warnings, front, reasons, price of insisting, studies, summary.
    """
    insisting = [insisting_section(document.result, top)] if document.result.insisting is not None else []
    screen = Screen(document)
    first = Section("warnings", "Warnings", tuple(screen.warning_blocks()))
    fronts = _front_sections(document, top, is_file=False)
    sections = [first, *fronts, *insisting, *studies, _printed_summary(document, screen)]
    return Page(document.title, _lead(document.result), tuple(section for section in sections if section.blocks))


def written_page(document: Document, top: int | None = None, studies: Sequence[Section] = ()) -> Page:
    """The page for a Markdown file: verdict, whole table, reasons for at most `top` alternatives, question and proof.

    Sections: summary, front, reasons, price of insisting, studies, and the question with its proof.
    """
    fronts = _front_sections(document, top, is_file=True)
    sections = [_summary(document, Screen(document)), *fronts, *document.further_sections, *studies, _basis(document)]
    return Page(document.title, _lead(document.result), tuple(section for section in sections if section.blocks))


def listed_points(result: Result, top: int | None) -> tuple[Point, ...]:
    """The whole front where it has `top` points at most; else the first of those that are no variants.

    Points in the order of rank.
    """
    return result.front if top is None or len(result.front) <= top else result.leaders[:top]


def _lead(result: Result) -> str:
    return f"{result.problem.name} ({basis_words(result.problem.effective)})"


def _summary(document: Document, screen: Screen, *, is_file: bool = True) -> Section:
    """Warnings, status and recommendation; the conflicts where there is no design."""
    proof, *more = document.summary
    result = document.result
    said = (
        unused_words(result),
        extrapolated_words(result),
        rounding_words(result),
        exclusion_words(document.space),
    )
    verdict = _verdict_blocks(screen) if is_file else list(screen.choice(with_baseline=False))
    blocks = [*texts(proof, tone="strong"), *document.conflicts, *verdict, *texts(*more)]
    blocks += texts(*_beyond(document, screen), *said) if not document.conflicts else []
    return Section("summary", "Decision summary", tuple(blocks))


def _beyond(document: Document, screen: Screen) -> Iterator[str]:
    """The nearest design beyond a limit, as a sentence; none where a warning stands in place of the recommendation."""
    if not screen.warnings and document.beyond is not None:
        saved, excess = beyond_words(document.result, document.beyond)
        who = screen.names.design(document.beyond)
        yield f"Beyond the limit: {saved} with {who}; {excess}, the least that saves a tenth."


def _verdict_blocks(screen: Screen) -> list[Block]:
    """Warnings and the recommendation, for files."""
    return [*screen.warning_blocks(), *screen.choice(with_baseline=False)]


def _printed_summary(document: Document, screen: Screen) -> Section:
    """The summary for a terminal: what the search took stands behind the verdict, at the end how the figures count."""
    result, summary = document.result, _summary(document, screen, is_file=False)
    effort = texts(effort_words(result))
    rules: list[Block] = []
    if result.front and not result.leaves_out_contention:
        counted = response_time_words(result.space) if asks_for_responses(result.space) else ""
        rules += texts(processing_words(result.problem.effective), counted)
    if result.front:
        rules += texts(waiting_words(result.space))
    if result.status != "infeasible":
        rules += texts(REDUCED, scale_words(result.space))
    proof, *more = summary.blocks
    return replace(summary, blocks=(proof, *effort, *more, *rules))


def _front_sections(document: Document, top: int | None, *, is_file: bool) -> Iterator[Section]:
    result = document.result
    if not result.front:
        return
    points = result.front if is_file else listed_points(result, top)
    blocks: list[Block] = [document.table_of(points), *texts(*(hidden_words(result, points)))]
    blocks += texts(document.common_words)
    yield Section("front", "Alternatives", tuple(blocks))
    explained = [point for point in points if point.id not in result.variants][: min(top or EXPLAINED, EXPLAINED)]
    for point in points:
        if point in explained:
            item = document.alternative(point)
            yield _alternative(item)
            if is_file:
                yield _details(item)
        elif further := tuple(further_blocks(point, document.others_of(point))):
            yield Section(f"further-{point.id}", f"Further designs of #{point.id}", further)
    hidden = len(result.front) - len(explained)
    if is_file and hidden > 0:
        said = f"The other {hidden} alternatives are in the table above, and in full in the HTML report."
        yield Section("others", "Further alternatives", tuple(texts(said)))


def _alternative(item: AlternativePage) -> Section:
    """Why an alternative is there, and designs beside it."""
    figures = ", ".join(f"{name} {value}" for name, value in item.figures)
    reasons = labelled((sentence.label, sentence.text) for sentence in item.sentences)
    blocks = (Text(f"#{item.point.id}: {figures}", "strong"), *reasons, *further_blocks(item.point, item.others))
    title = f"Alternative #{item.point.id}, rank {item.rank}"
    return Section(f"alternative-{item.point.id}", title, blocks)


def _details(item: AlternativePage) -> Section:
    """The tables of an alternative."""
    tables = (*(flow.table for flow in item.flows), *item.usage_tables, *item.responses)
    blocks = (item.decisions, item.requirements, *listing(item.warnings, "warning"), *tables)
    return Section(f"details-{item.point.id}", f"Figures of #{item.point.id}", blocks, is_for_files=True)


def _basis(document: Document) -> Section:
    """Where the figures come from, and what the model does not see."""
    blocks = [*labelled(document.provenance)]
    for title, lines in (
        ("Assumptions of the problem", document.space.assumptions),
        ("Known gaps of the model", document.gaps),
    ):
        if lines:
            blocks += [*texts(title, tone="strong"), *listing(lines)]
    return Section("basis", "What this rests on", tuple(blocks), is_for_files=True)
