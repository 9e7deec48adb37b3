"""The answer on one screen: what was proved, what differs, what to choose and why; the rest is a page of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from dse.answers.designs import Point
from dse.answers.ranking.variants import varying
from dse.answers.result import Result
from dse.answers.tables.display import counted
from dse.report.content.decide import insisting_section
from dse.report.content.document import Alternative, Document, OthersPart
from dse.report.page import Block, Page, Section, Text, labelled, listing, texts
from dse.report.text_table import basis_words, scale_of, scale_words
from dse.report.words.contention import (
    asks_for_responses,
    bound_words,
    broken_choice_words,
    contention_words,
    overhead_words,
    processing_words,
    waiting_words,
)
from dse.report.words.reasons import (
    REDUCED,
    SAME,
    effort_words,
    exclusion_words,
    extrapolated_words,
    figures_words,
    hidden_words,
    rounding_words,
    short_name,
    unused_words,
)
from dse.support.units.text import count_words

TOP = 10
SCREEN = 5
"""The number of alternatives that leave room on a screen of 40 lines for all that is said of them."""
DECISIONS = 3
"""The greatest number of decisions that are told of each."""
ROOM = 280
"""Letters of a sentence that is said in full: three lines."""
SHARED = 98
"""Letters of what all alternatives share: a line."""
REASONS = 2
"""The number of sentences that say why the first alternative is first: what stands out, and the nearest comparison."""


def fitting_page(
    document: Document, top: int | None, fits: Callable[[Page], bool], further: Sequence[Section] = ()
) -> Page:
    """The same with as many alternatives as fit on a screen, where nobody says how many: two to `SCREEN`.

    Where not even two do, with what is told beside them, there is less of why the first is, then that one alone.
    """
    most = min(SCREEN, len(document.result.leaders))
    sizes = [(shown, REASONS) for shown in range(most, min(most, 2) - 1, -1)]
    sizes += [(sizes[-1][0], 1), (min(most, 1), 1)]
    for shown, reasons in sizes[:-1] if top == TOP else ():
        page = brief_page(document, top, shown, further, reasons=reasons)
        if fits(page):
            return page
    shown, reasons = sizes[-1] if top == TOP else (SCREEN, REASONS)
    return brief_page(document, top, shown, further, reasons=reasons)


def brief_page(
    document: Document,
    top: int | None = TOP,
    screen: int = SCREEN,
    further: Sequence[Section] = (),
    *,
    reasons: int | None = REASONS,
) -> Page:
    """The proof, the table of the alternatives that differ, near-identical ones in a line each, and the choice.

    `top` is how many alternatives are shown; None is all of them, near-identical ones too; where nobody says how many
    it is `screen`. Sections of studies stand before the notes. Without `reasons` nothing is computed for the page, and
    it says that there was no time.
    """
    result = document.result
    proof, *more = document.summary if reasons is not None else document.findings
    blocks: list[Block] = [*texts(proof, tone="strong"), *document.conflicts]
    if result.front:
        shown = result.front if top is None else result.leaders[: screen if top == TOP else top]
        blocks += [*_table(document, shown), *texts(*_neighbours(document, shown), _common(document))]
        blocks += _choice(document, reasons)
        for point in shown:
            blocks += further_blocks(point, document.others_of(point))
    else:
        blocks += texts(*more)
    sections = [Section("answer", "Answer", tuple(blocks))]
    if result.insisting is not None:
        sections.append(insisting_section(result, top))
    sections += further
    notes = _notes(document, more, screen if top == TOP else top)
    sections.append(Section("notes", "Notes", tuple(texts(*notes))))
    lead = f"{result.problem.name} ({basis_words(result.problem.effective)})"
    return Page(document.title, lead, tuple(section for section in sections if section.blocks))


def _table(document: Document, shown: Sequence[Point]) -> Iterator[Block]:
    """The table with the first few of the decisions in which these alternatives differ; how many others there are."""
    table, names = document.table_of(shown), document.varying
    told = varying([point.decisions for point in shown], names) if len(shown) > 1 else names
    first = len(table.headings) - len(names)
    kept = [*range(first), *(first + names.index(name) for name in told[:DECISIONS])]
    rows = tuple(tuple(row[at] for at in kept) for row in table.rows)
    is_scaled = scale_of(info.name for info in document.result.objectives) and scale_words(document.space)
    caption = f"{table.caption}; utilisation in % of one core" if is_scaled else table.caption
    yield replace(table, caption=caption, headings=tuple(table.headings[at] for at in kept), rows=rows)
    if len(told) > DECISIONS:
        yield from texts(
            f"They differ in {count_words(len(told) - DECISIONS, 'further decision')}: --explain tells them."
        )


def _neighbours(document: Document, shown: Sequence[Point]) -> Iterator[str]:
    """A line for each alternative that stands for others: what they change, and between which figures they lie."""
    result, there = document.result, {point.id for point in shown}
    for leader in shown:
        like = [point for point in result.front if result.variants.get(point.id) == leader.id and point.id not in there]
        if like:
            like = _in_order(result, leader, like)
            numbers = ", ".join(f"#{point.id}" for point in like)
            yield f"#{leader.id} with {_changes(result, leader, like)}: {_ranges(result, like)} ({numbers})"
    told = sum(result.variants.get(point.id) in there for point in result.front if point.id not in there)
    hidden = len(result.front) - len(there) - told
    if hidden:
        yield f"{count_words(hidden, 'more alternative')}, ranked lower."


def _in_order(result: Result, leader: Point, like: list[Point]) -> list[Point]:
    """Near-identical designs in the order of the options that they change, where that is one decision."""
    names = varying([point.decisions for point in (leader, *like)], result.open_decisions)
    options = {decision.name: decision.options for decision in result.space.decisions}[names[0]]
    if len(names) > 1:
        return like
    return sorted(
        like, key=lambda point: options.index(point.decisions[names[0]]) if names[0] in point.decisions else -1
    )


def _changes(result: Result, leader: Point, like: Sequence[Point]) -> str:
    """``canbus0 can_250k … can_1m``: what near-identical designs change."""
    names = varying([point.decisions for point in (leader, *like)], result.open_decisions)
    order = {decision.name: decision.options for decision in result.space.decisions}
    said = []
    for name in names:
        there = {point.decisions.get(name) for point in like}
        options = [option for option in order[name] if option in there]
        ends = " … ".join(dict.fromkeys([options[0], options[-1]])) if options else ""
        said.append(f"{short_name(name)} {ends}".rstrip())
    return ", ".join(said[:3]) + (f" and {len(said) - 3} more decisions" if len(said) > 3 else "")


def _ranges(result: Result, like: Sequence[Point]) -> str:
    """The figures of some points, the first to the last, where they differ."""
    found = []
    for info in result.objectives:
        values = [point.objectives[info.name] for point in like]
        ends = [counted(value, info.unit, result.space.currency) for value in (values[0], values[-1])]
        unit = ends[0].rpartition(" ")[2]
        if ends[0] == ends[1]:
            found.append(ends[0])
        elif ends[1].endswith(f" {unit}"):
            found.append(f"{ends[0].removesuffix(f' {unit}')} … {ends[1]}")
        else:
            found.append(" … ".join(ends))
    return ", ".join(found)


def _common(document: Document) -> str:
    """What all alternatives share, as far as there is room; how much more there is."""
    words = document.common_words
    if len(words) <= SHARED:
        return words
    every = words.split(", ")
    told = len(words[: SHARED - len(" and 99 more (--explain).")].split(", ")) - 1 or 1
    return f"{', '.join(every[:told])} and {len(every) - told} more (--explain)."


def _choice(document: Document, most: int | None) -> Iterator[Block]:
    """What to look at first, and why, in three lines or so."""
    result = document.result
    first = result.front[0]
    ranked = "nearest to the best of everything" if result.ranking == "ideal" else f"first by {result.ranking_words}"
    broken = broken_choice_words(result, first)
    figures = figures_words(result, first.objectives)
    yield from texts(f"Choose #{first.id}, {ranked}: {figures}. {broken}".rstrip(), tone="strong")
    if most is None:
        yield from texts("Why it is first was not looked at: the time limit came. `dse report` tells it of a result.")
        return
    reasons = document.alternative(first).sentences
    wanted = [item for item in reasons if item.label.startswith(("Stands out", "Against"))][:most]
    same = [item for item in reasons if item.label == SAME]
    wanted += same[:1]
    yield from labelled(
        (item.label, item.text if len(item.text) <= ROOM else item.brief or item.text) for item in wanted
    )
    if len(same) > 1 and not broken:
        yield from texts(f"{count_words(len(same) - 1, 'more change')} to the same end: --explain.")


def _notes(document: Document, more: Sequence[str], top: int | None) -> Iterator[str]:
    """What may not go unsaid, what the search took, and where the rest is."""
    result = document.result
    if result.front:
        contention, waiting = contention_words(result), waiting_words(result.space)
        said = [text for text in more if not text.startswith("First by")]
        yield from (f"{text} {waiting}".rstrip() if text == contention else text for text in said)
        yield "" if contention in said else waiting
    told = (unused_words(result), extrapolated_words(result), rounding_words(result), exclusion_words(result.space))
    yield from filter(None, told)
    yield effort_words(result)
    if result.front:
        is_whole = top is None or len(result.front) <= len(result.leaders[:top])
        rest = "" if is_whole else f", --all lists all {len(result.front)}"
        yield f"--explain says why each is there{rest}, --report PAGE.html is a page to decide with."


# A front as a page for a terminal and for Markdown; HTML shows the parts of the same document, to choose among.


EXPLAINED = 3
"""Maximum number of alternatives that are explained one by one; near-identical ones do not count among them."""


def printed_page(document: Document, top: int | None = TOP, studies: Sequence[Section] = ()) -> Page:
    """What is printed: `top` alternatives (None: all), and at the end the verdict, where the eye is."""
    insisting = [insisting_section(document.result, top)] if document.result.insisting is not None else []
    sections = [*_front_sections(document, top, is_file=False), *insisting, *studies, _printed_summary(document)]
    return Page(document.title, _lead(document.result), tuple(section for section in sections if section.blocks))


def written_page(document: Document, top: int | None = None, studies: Sequence[Section] = ()) -> Page:
    """What is written as Markdown: the verdict first, the whole table, reasons of at most `top`, the foundations."""
    fronts = _front_sections(document, top, is_file=True)
    sections = [_summary(document), *fronts, *document.further_sections, *studies, _basis(document)]
    return Page(document.title, _lead(document.result), tuple(section for section in sections if section.blocks))


def listed_points(result: Result, top: int | None) -> tuple[Point, ...]:
    """The whole front where it has `top` points at most; else the first of those that are no variants."""
    return result.front if top is None or len(result.front) <= top else result.leaders[:top]


def _lead(result: Result) -> str:
    return f"{result.problem.name} ({basis_words(result.problem.effective)})"


def _summary(document: Document) -> Section:
    """What was found and proved; why there is no design, where there is none."""
    proof, *more = document.summary
    found = document.result
    said = (unused_words(found), extrapolated_words(found), rounding_words(found), exclusion_words(document.space))
    blocks = [*texts(proof, tone="strong"), *document.conflicts, *texts(*more)]
    blocks += texts(*said) if not document.conflicts else []
    return Section("summary", "Decision summary", tuple(blocks))


def _printed_summary(document: Document) -> Section:
    """The same with what the search took, behind the verdict, and how the figures count."""
    result, summary = document.result, _summary(document)
    effort = texts(effort_words(result))
    rules: list[Block] = []
    if result.front and not result.leaves_out_contention:
        asks = asks_for_responses(result.space)
        counted = f"{overhead_words(result.space)} {bound_words(result.space)}".rstrip() if asks else ""
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
    told = [point for point in points if point.id not in result.variants][: min(top or EXPLAINED, EXPLAINED)]
    for point in points:
        if point in told:
            item = document.alternative(point)
            yield _alternative(item)
            if is_file:
                yield _details(item)
        elif further := tuple(further_blocks(point, document.others_of(point))):
            yield Section(f"further-{point.id}", f"Designs beside #{point.id}", further)
    hidden = len(result.front) - len(told)
    if is_file and hidden > 0:
        said = f"The other {hidden} alternatives are in the table above, and in full in the HTML report."
        yield Section("others", "Further alternatives", tuple(texts(said)))


def _alternative(item: Alternative) -> Section:
    """Why an alternative is there, and designs beside it."""
    figures = ", ".join(f"{name} {value}" for name, value in item.figures)
    reasons = labelled((sentence.label, sentence.text) for sentence in item.sentences)
    blocks = (Text(f"#{item.point.id}: {figures}", "strong"), *reasons, *further_blocks(item.point, item.others))
    title = f"Alternative #{item.point.id}, rank {item.rank}"
    return Section(f"alternative-{item.point.id}", title, blocks)


def further_blocks(point: Point, parts: Sequence[OthersPart]) -> Iterator[Block]:
    """Designs beside a point."""
    for part in parts:
        yield from texts(f"#{point.id}: {part.words}")
        yield from labelled(part.designs)


def _details(item: Alternative) -> Section:
    """The tables of an alternative."""
    tables = (*(flow.table for flow in item.flows), *item.usage_tables, *item.responses)
    blocks = (item.decisions, item.requirements, *listing(item.warnings, "warning"), *tables)
    return Section(f"details-{item.point.id}", f"Figures of #{item.point.id}", blocks, is_for_files=True)


def _basis(document: Document) -> Section:
    """Where the figures come from, and what the model does not see."""
    blocks = [*labelled(document.provenance)]
    for title, found in (
        ("Assumptions of the problem", document.space.assumptions),
        ("Known gaps of the model", document.gaps),
    ):
        if found:
            blocks += [*texts(title, tone="strong"), *listing(found)]
    return Section("basis", "What this rests on", tuple(blocks), is_for_files=True)
