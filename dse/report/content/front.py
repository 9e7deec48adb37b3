"""The answer on one screen: what was proved, what differs, what to choose and why; the rest is a page of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

from dse.answers.designs import Point
from dse.answers.ranking.changes import counted_changes
from dse.answers.ranking.kinds import Kind, kinds_of
from dse.answers.result import Result
from dse.answers.tables.display import column, titled
from dse.report.content.decide import insisting_section
from dse.report.content.document import Alternative, Document, OthersPart
from dse.report.page import NOTHING, Block, Page, Section, Table, Text, labelled, listing, texts
from dse.report.text_table import basis_words, scale_of, scale_words
from dse.report.words.choice import (
    MOST_MINOR,
    Names,
    cost_words,
    minor_words,
    near_scores,
    nearest_words,
    recommended_words,
    short_metrics,
    tie_words,
)
from dse.report.words.contention import (
    asks_for_responses,
    bound_words,
    overhead_words,
    processing_words,
    waiting_words,
)
from dse.report.words.headline import (
    Waiting,
    counted_words,
    found_words,
    overload_words,
    title_words,
    unbounded_words,
)
from dse.report.words.missing import outlook_table
from dse.report.words.reasons import (
    REDUCED,
    baseline_words,
    effort_words,
    exclusion_words,
    extrapolated_words,
    figures_words,
    hidden_words,
    rounding_words,
    unused_words,
)
from dse.report.words.reasons import counted_words as changes_counted_words
from dse.support.units.text import count_words

TOP = 10
MOST_ROWS = 8
"""The greatest number of kinds of designs that are rows of the first screen."""
FEW_DESIGNS = 5
"""A front of one kind has its first designs as rows."""
MOST_DECISIONS = 3
"""The greatest number of decisions that are columns where designs are of one kind."""
MOST_SAME = 3
"""The greatest number of options that are told of those that all designs share."""
MOST_STEPS = 3
HANG = 9
"""Where the text begins behind ``WARNING``, ``Front`` and ``Counted``."""


def first_page(
    document: Document, top: int | None = TOP, further: Sequence[Section] = (), *, has_time: bool = True
) -> Page:
    """The answer on one screen: warnings, proof, a row for each kind of design, the recommendation, what to do next.

    `top` other than `TOP` is the number of designs that are rows; None lists all of them. Sections of studies stand
    before what the search took. Without time nothing is computed for the page, and it says so.
    """
    result = document.result
    screen = _Screen(document, has_time=has_time)
    blocks = [*screen.head(), *document.conflicts]
    if result.front:
        shown = list(result.front if top is None else result.front[:top]) if top != TOP else []
        blocks += screen.designs(shown) if shown else screen.table()
        blocks += screen.choice()
        for point in shown or [kind.point for kind in screen.shown]:
            blocks += further_blocks(point, document.others_of(point))
    sections = [Section("answer", "Answer", tuple(blocks))]
    if result.insisting is not None:
        sections.append(insisting_section(result, top))
    sections += [*further, Section("notes", "Notes", tuple(screen.notes(all_listed=top is None)))]
    return Page(document.title, title_words(result), tuple(section for section in sections if section.blocks))


class _Screen:
    """The parts of the first screen of a result."""

    def __init__(self, document: Document, *, has_time: bool = True) -> None:
        self.document, self.result, self.has_time = document, document.result, has_time
        self.kinds = kinds_of(self.result)
        self.names = Names(self.result, self.kinds)
        self.waiting = Waiting(self.result)
        self.currency = self.result.space.currency
        self.is_one_kind = len(self.kinds.kinds) == 1
        every = self.kinds.kinds
        if self.is_one_kind:
            every = tuple(Kind(point, (point,)) for point in self.result.front)
        most = FEW_DESIGNS if self.is_one_kind and len(every) > FEW_DESIGNS + 1 else MOST_ROWS
        kept = every if len(every) <= most else _with_the_best(self.result, every, most)
        self.shown = tuple(kind for kind in every if kind in kept)
        self.hidden = len(every) - len(self.shown)

    def head(self) -> Iterator[Block]:
        """What changes the decision, what was found, what is counted."""
        yield from _warnings(self)
        word, text, tone = found_words(self.result, self.kinds)
        yield Text(f"{word:<{HANG - 1}} {text}" if len(word) < HANG else f"{word}  {text}", tone, hang=HANG)
        if self.result.front:
            counted, profile = counted_words(self.result)
            said = " ".join(filter(None, (counted, self.waiting.note(), profile)))
            if counted:
                yield Text(f"Counted  {said}", "doubtful" if " Not " in said else "plain", hang=HANG)

    @cached_property
    def warnings(self) -> list[str]:
        """What is wrong with the first design, or with all of them."""
        if not self.result.front:
            return []
        space = self.result.space
        some = any(item.overload for item in space.processors) or any(item.overload for item in space.buses)
        is_allowed = some or space.overload == "allowed"
        found = [self.waiting.warning]
        if is_allowed and self.has_time:
            found += overload_words(self.document.alternative(self.result.front[0]).analysis)
        return [text for text in (*found, *unbounded_words(self.result)) if text]

    def table(self) -> Iterator[Block]:
        """A row for each kind of design, and below it what the headings leave out."""
        points = [kind.point for kind in self.shown]
        if len(self.result.front) == 1:
            yield from outlook_table(self.result)
            return
        infos = self.result.objectives
        short = short_metrics(info.name for info in infos)
        headings, columns, captions = ["#"], [[f"#{point.id}" for point in points]], []
        has_cores = bool(scale_words(self.result.space))
        for info in infos:
            unit, cells = column([point.objectives[info.name] for point in points], info.unit, self.currency)
            name = titled(short[info.name], unit)
            headings.append(f"max {name}" if info.sense == "maximise" else name)
            columns.append(cells)
            scale = ": 100 % is one core" if has_cores and scale_of([info.name]) else ""
            captions += [f"{info.name}{scale}"] if scale or short[info.name] != info.name else []
        numbers = tuple(range(1, len(headings)))
        minor = sorted(self.kinds.minor, key=lambda name: not name.endswith(".type"))
        minor = minor[: MOST_DECISIONS if self.is_one_kind else MOST_MINOR]
        spare: list[int] = []
        for name in (*self.kinds.naming, *minor):
            spare += [len(headings)] if name in minor else []
            headings.append(self.names.short[name])
            columns.append([point.decisions.get(name, NOTHING) for point in points])
        if not self.is_one_kind and len(self.kinds.kinds) < len(self.result.front):
            numbers = (*numbers, len(headings))
            spare = [len(headings), *reversed(spare)]
            headings.append("designs")
            columns.append([str(len(kind.points)) for kind in self.shown])
        rows = tuple(zip(*columns, strict=True))
        strong = (0,) if self.recommends else ()
        yield Table("", tuple(headings), rows, numbers, spare=tuple(spare), strong=strong)
        if self.hidden:
            what = "design" if self.is_one_kind else "kind"
            yield from texts(f"and {count_words(self.hidden, f'more {what}')} (--all)")
        yield from texts(f"{'; '.join(captions)}." if captions else "")
        more = len(self.kinds.minor) - len(minor) if self.is_one_kind else 0
        yield from texts(f"They differ in {count_words(more, 'further decision')} (--all)." if more else "")
        yield from texts(*(() if self.is_one_kind else minor_words(self.result, self.kinds, self.names)), self.same)
        yield from outlook_table(self.result)

    def designs(self, shown: Sequence[Point]) -> Iterator[Block]:
        """Designs in the order of rank with every decision that differs."""
        yield self.document.table_of(shown)
        hidden = len(self.result.front) - len(shown)
        yield from texts(f"{count_words(hidden, 'more design')}, ranked lower (--all)." if hidden else "", self.same)
        yield from outlook_table(self.result)

    @property
    def same(self) -> str:
        """Options that all designs share, computers first, and how many more there are."""
        if len(self.result.front) == 1:
            return ""
        shared = self.result.front[0].decisions
        differing = set(self.document.varying)
        names = [name for name in self.result.open_decisions if name in shared and name not in differing]
        names.sort(key=lambda name: name not in self.names.types)
        told = [self.names.option(name, shared[name]) for name in names[:MOST_SAME]]
        more = len(names) - len(told)
        rest = f" and {more} more (--explain)" if more else ""
        return f"Same in every design: {', '.join(told)}{rest}." if told else ""

    @property
    def recommends(self) -> bool:
        """Whether one design is recommended."""
        is_proved = self.result.status == "complete" and len(self.result.front) > 1
        return is_proved and not self.warnings and len(near_scores(self.ranked)) == 1

    @property
    def ranked(self) -> tuple[Kind, ...]:
        """The kinds by the rank of their best design."""
        return self.kinds.kinds

    def choice(self, *, with_baseline: bool = True) -> Iterator[Block]:
        """The recommendation, or why there is none."""
        if not self.result.front:
            return
        result, first = self.result, self.result.front[0]
        kind = next(kind for kind in self.ranked if first in kind.points)
        tied = near_scores(self.ranked)
        nearest = [kind.point]
        if len(result.front) == 1:
            label = "The only design" if result.status == "complete" else "Best found"
            yield Text(f"{label} (#{first.id}): {figures_words(result, first.objectives)}", "strong", hang=2)
            if decided := self.decided(first):
                yield Text(f"  {decided}", hang=2)
        elif self.warnings:
            kept = self.waiting.kept
            why = "no design of this front meets every limit with waiting" if self.waiting.checked and not kept else ""
            why = why or f"#{first.id} is ranked first, but see the warning"
            yield Text(f"No recommendation: {why}.", "strong", hang=2)
            nearest = []
        elif result.status != "complete":
            yield Text(recommended_words(result, kind, self.names, "Best found"), "strong", hang=2)
        elif len(tied) > 1:
            head, *rest = tie_words(result, tied, self.names)
            yield Text(head, "strong", hang=2)
            yield from (Text(text, hang=2) for text in rest)
            nearest = [item.point for item in tied[:2]]
        else:
            yield Text(recommended_words(result, kind, self.names, "Recommended"), "strong", hang=2)
            yield Text(f"  Cost     {cost_words(result, kind.point)}", hang=HANG + 2)
        changed = counted_changes(result.space, nearest[0].design) if len(nearest) == 1 else None
        if changed:
            yield Text(f"  Changes  {changes_counted_words(changed)}.", hang=HANG + 2)
        if self.has_time:
            yield from self.limits(nearest, with_baseline=with_baseline)
        else:
            yield from texts("  Nearest limit not computed: the time limit came first (`dse report` tells it).")

    def decided(self, point: Point) -> str:
        """The open decisions of the only design, as far as there is room."""
        names = [name for name in self.result.open_decisions if name in point.decisions]
        names.sort(key=lambda name: name not in self.names.types)
        told = [self.names.option(name, point.decisions[name]) for name in names[: 2 * MOST_SAME]]
        more = len(names) - len(told)
        return ", ".join(told) + (f" and {more} more (--explain)" if more else "")

    def limits(self, points: Sequence[Point], *, with_baseline: bool) -> Iterator[Block]:
        """The nearest limits of designs, and what today's design is."""
        reasoner = self.document.reasoner
        said = [(point, nearest_words(reasoner.margins(point), self.currency)) for point in points]
        for at, (point, text) in enumerate(said):
            who = f"#{point.id} " if len(points) > 1 else ""
            yield from [Text(f"  {'' if at else 'Nearest limit':<13}  {who}{text}", hang=17)] if text else []
        if self.result.baseline is not None and with_baseline:
            yield Text(baseline_words(reasoner).replace("Baseline: ", "Baseline ", 1), hang=HANG)

    def notes(self, *, all_listed: bool) -> Iterator[Block]:
        """What designs leave out or round, what to do next, and what the search took."""
        result = self.result
        told = (unused_words(result), extrapolated_words(result), rounding_words(result))
        yield from texts(*told, exclusion_words(result.space) if result.front else "")
        for at, (option, meaning) in enumerate(list(self.next_steps(all_listed=all_listed))[:MOST_STEPS]):
            yield Text(f"{'Next' if not at else '':<4}  {option:<28}  {meaning}", hang=36)
        code = f"; exit code {result.exit_code}" if result.exit_code else ""
        yield Text(f"{effort_words(result)}{code}", "quiet")

    def next_steps(self, *, all_listed: bool) -> Iterator[tuple[str, str]]:
        """Options to add to the command, each with what it does."""
        result = self.result
        if not result.front:
            return
        if result.status == "incomplete":
            yield "--json r.json", "keeps what was found; `--resume r.json` goes on from it"
        if result.leaves_out_contention and len(self.waiting.kept) < len(result.front) and self.waiting.checked:
            yield "--processing response-time", "counts waiting for the CPU, chooses cores"
        yield "--explain", "why each design is there"
        if len(result.front) > 1 and not all_listed:
            yield "--all", f"all {len(result.front)} designs"
        yield "--report page.html", "a page to compare designs and decide with"


def _warnings(screen: _Screen) -> Iterator[Block]:
    """What changes the decision."""
    for text in screen.warnings:
        yield Text(f"WARNING  {text}", "wrong", hang=HANG)


def _with_the_best(result: Result, kinds: Sequence[Kind], most: int) -> list[Kind]:
    """`most` of the kinds: that with the best value of each objective, and else the best ranked ones."""
    signs = {info.name: 1 if info.sense == "minimise" else -1 for info in result.objectives}
    wanted = [
        min(kinds, key=lambda kind: min(sign * point.objectives[name] for point in kind.points))
        for name, sign in signs.items()
    ]
    return list({id(kind): kind for kind in (kinds[0], *wanted, *kinds)}.values())[:most]


# A front as a page for a terminal and for Markdown; HTML shows the parts of the same document, to choose among.


EXPLAINED = 3
"""Maximum number of alternatives that are explained one by one; near-identical ones do not count among them."""


def printed_page(document: Document, top: int | None = TOP, studies: Sequence[Section] = ()) -> Page:
    """What is printed: `top` alternatives (None: all), and at the end the verdict, where the eye is."""
    insisting = [insisting_section(document.result, top)] if document.result.insisting is not None else []
    first = Section("warnings", "Warnings", tuple(_warnings(_Screen(document))))
    sections = [first, *_front_sections(document, top, is_file=False), *insisting, *studies, _printed_summary(document)]
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


def _summary(document: Document, *, is_file: bool = True) -> Section:
    """What changes the decision, what was found and proved, the recommendation; why there is no design, if so."""
    proof, *more = document.summary
    found, screen = document.result, _Screen(document)
    said = (unused_words(found), extrapolated_words(found), rounding_words(found), exclusion_words(document.space))
    verdict = verdict_blocks(document, screen) if is_file else list(screen.choice(with_baseline=False))
    blocks = [*texts(proof, tone="strong"), *document.conflicts, *verdict, *texts(*more)]
    blocks += texts(*said) if not document.conflicts else []
    return Section("summary", "Decision summary", tuple(blocks))


def verdict_blocks(document: Document, screen: _Screen | None = None) -> list[Block]:
    """What changes the decision, and the recommendation, for files."""
    screen = screen or _Screen(document)
    return [*_warnings(screen), *screen.choice(with_baseline=False)]


def _printed_summary(document: Document) -> Section:
    """The same with what the search took, behind the verdict, and how the figures count."""
    result, summary = document.result, _summary(document, is_file=False)
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
