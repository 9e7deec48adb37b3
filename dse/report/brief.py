"""The answer on one screen: what was proved, what differs, what to choose and why; the rest is a page of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from dse.report.contention import broken_choice_words, contention_words, waiting_words
from dse.report.document import Document
from dse.report.insisting import insisting_section
from dse.report.page import Block, Page, Section, labelled, texts
from dse.report.plain import basis_words
from dse.report.solve import TOP, further_blocks
from dse.report.words import (
    SAME,
    effort_words,
    exclusion_words,
    extrapolated_words,
    figures_words,
    rounding_words,
    short_name,
    unused_words,
)
from dse.results.display import counted
from dse.results.points import Point
from dse.results.solve import Result
from dse.results.variants import varying
from dse.units.text import count_words

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
    yield replace(table, headings=tuple(table.headings[at] for at in kept), rows=rows)
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
