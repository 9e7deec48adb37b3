"""The answer on one screen: what was proved, what differs, what to choose and why; the rest is a page of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

from dse.answers.designs import Point
from dse.answers.ranking.changes import counted_changes
from dse.answers.ranking.kinds import Kind, kinds_of
from dse.answers.result import Result
from dse.answers.tables.display import column, titled
from dse.report.content.front.document import Document, OthersPart
from dse.report.content.front.filters import insisting_section
from dse.report.page import NOTHING, Block, Page, Section, Table, Text, labelled, texts
from dse.report.words.basis import scale_of, scale_words
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
from dse.report.words.contention import waits_in_flows
from dse.report.words.headline import (
    WaitingNotes,
    counted_words,
    found_words,
    overload_words,
    title_words,
    unbounded_words,
)
from dse.report.words.messages import identifier_words
from dse.report.words.missing import outlook_table
from dse.report.words.reasons import (
    baseline_words,
    effort_words,
    exclusion_words,
    extrapolated_words,
    figures_words,
    rounding_words,
    unused_words,
)
from dse.report.words.reasons import counted_words as changes_counted_words
from dse.support.units.text import count_words, first_of

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
    screen = Screen(document, has_time=has_time)
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


class Screen:
    """The parts of the first screen of a result.

    Methods yield blocks in the order of the screen: head, table, choice, notes. The full report is `Document`'s.
    """

    def __init__(self, document: Document, *, has_time: bool = True) -> None:
        self.document, self.result, self.has_time = document, document.result, has_time
        self.kinds = kinds_of(self.result)
        self.names = Names(self.result, self.kinds)
        self.waiting = WaitingNotes(self.result)
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
        """The first lines of the summary: warnings that change the decision, the finding, and what latencies count.

        Warnings, then one line of status and one line of what latencies count and leave out.
        """
        yield from self.warning_blocks()
        word, text, tone = found_words(self.result, self.kinds)
        yield Text(f"{word:<{HANG - 1}} {text}" if len(word) < HANG else f"{word}  {text}", tone, hang=HANG)
        if self.result.front:
            counted, profile = counted_words(self.result)
            said = " ".join(filter(None, (counted, self.waiting.note(), profile)))
            if counted:
                yield Text(f"Counted  {said}", "doubtful" if "not counted: " in said else "plain", hang=HANG)

    @cached_property
    def warnings(self) -> list[str]:
        """The warnings about the first design, or about all designs.

        Sentences; any of them takes the place of a recommendation.
        """
        if not self.result.front:
            return []
        space = self.result.space
        some = any(item.overload for item in space.processors) or any(item.overload for item in space.buses)
        is_allowed = some or space.overload == "allowed"
        texts = [self.waiting.warning]
        if is_allowed and self.has_time:
            texts += overload_words(self.document.alternative(self.result.front[0]).analysis)
        return [text for text in (*texts, *unbounded_words(self.result)) if text]

    def warning_blocks(self) -> Iterator[Block]:
        """The warnings as paragraphs."""
        for text in self.warnings:
            yield Text(f"WARNING  {text}", "wrong", hang=HANG)

    def table(self) -> Iterator[Block]:
        """A row for each kind of design, and below it what the headings leave out.

        One row for each kind of design, its best objectives in one unit for each column; a front of one design shows
        its bounds instead.
        """
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
        chosen = [self.document.chosen_in(point) for point in points]
        for name in (*self.kinds.naming, *minor):
            spare += [len(headings)] if name in minor else []
            headings.append(self.names.short[name])
            columns.append([decisions.get(name, NOTHING) for decisions in chosen])
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
        """Designs in the order of rank with every decision that differs.

        `shown` are the points to list; the number of the others is said below.
        """
        yield self.document.table_of(shown)
        hidden = len(self.result.front) - len(shown)
        yield from texts(f"{count_words(hidden, 'more design')}, ranked lower (--all)." if hidden else "", self.same)
        yield from outlook_table(self.result)

    @property
    def same(self) -> str:
        """Options that all designs share, computers first, and how many more there are.

        One sentence with at most `MOST_SAME` options; empty for a front of one design or where nothing is shared.
        """
        if len(self.result.front) == 1:
            return ""
        shared = self.document.shared
        differing = set(self.document.varying)
        names = [name for name in self.result.open_decisions if name in shared and name not in differing]
        names.sort(key=lambda name: name not in self.names.types)
        options = [self.names.option(name, shared[name]) for name in names]
        return f"Same in every design: {first_of(options, MOST_SAME, ' (--explain)')}." if options else ""

    @property
    def recommends(self) -> bool:
        """Whether one design is recommended.

        Only a complete front of several designs without warning and without a tie has a recommendation.
        """
        is_proved = self.result.status == "complete" and len(self.result.front) > 1
        return is_proved and not self.warnings and len(near_scores(self.ranked)) == 1

    @property
    def ranked(self) -> tuple[Kind, ...]:
        """The kinds by the rank of their best design."""
        return self.kinds.kinds

    def choice(self, *, with_baseline: bool = True) -> Iterator[Block]:
        """The recommendation, or why there is none.

        With a recommendation: what the design is, what it costs against the best of each objective, and its nearest
        limits. `with_baseline` adds today's design.
        """
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
            if self.warnings and not self.waiting.warning:
                yield Text("No recommendation: see the warning.", "strong", hang=2)
                nearest = []
        elif self.warnings:
            kept = self.waiting.kept
            why = "no design of this front meets every limit with waiting" if self.waiting.known and not kept else ""
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
        numbered = identifier_words(result.space, nearest[0].design) if len(nearest) == 1 else []
        if numbered:
            yield Text(f"  Identifiers  {first_of(numbered, 2 * MOST_SAME, ' (--explain)')}", hang=15)
        changed = counted_changes(result.space, nearest[0].design) if len(nearest) == 1 else None
        if changed:
            yield Text(f"  Changes  {changes_counted_words(changed)}.", hang=HANG + 2)
        if self.has_time:
            yield from self.limits(nearest, with_baseline=with_baseline)
        else:
            yield from texts("  Nearest limit not computed: the time limit came first (`dse report` tells it).")

    def decided(self, point: Point) -> str:
        """The open decisions of the only design, as far as there is room.

        Options with the computers first, such as ``Spectra, can_125k``; empty where nothing is open.
        """
        names = [name for name in self.result.open_decisions if name in point.decisions]
        names.sort(key=lambda name: name not in self.names.types)
        chosen = self.names.chosen(point)
        options = [self.names.option(name, chosen[name]) for name in names]
        return first_of(options, 2 * MOST_SAME, " (--explain)")

    def limits(self, points: Sequence[Point], *, with_baseline: bool) -> Iterator[Block]:
        """The nearest limits of designs, and what today's design is.

        The limits of each of `points`, the one with the least slack first.
        """
        reasoner = self.document.reasoner
        said = [(point, nearest_words(reasoner.margins(point), self.currency)) for point in points]
        for at, (point, text) in enumerate(said):
            who = f"#{point.id} " if len(points) > 1 else ""
            yield from [Text(f"  {'' if at else 'Nearest limit':<13}  {who}{text}", hang=17)] if text else []
        if self.result.baseline is not None and with_baseline:
            yield Text(baseline_words(reasoner).replace("Baseline: ", "Baseline ", 1), hang=HANG)

    def notes(self, *, all_listed: bool) -> Iterator[Block]:
        """The last lines of the summary: omissions and rounding, next commands, and the effort of the search.

        The first `MOST_STEPS` further commands are suggested; the last line has effort and, where it is not 0, the exit
        code.
        """
        result = self.result
        remarks = (unused_words(result), extrapolated_words(result), rounding_words(result))
        yield from texts(*remarks, exclusion_words(result.space) if result.front else "")
        for at, (option, meaning) in enumerate(list(self._next_steps(all_listed=all_listed))[:MOST_STEPS]):
            yield Text(f"{'Next' if not at else '':<4}  {option:<28}  {meaning}", hang=36)
        code = f"; exit code {result.exit_code}" if result.exit_code else ""
        yield Text(f"{effort_words(result)}{code}", "quiet")

    def changing_steps(self) -> Iterator[tuple[str, str]]:
        """Options that would change the answer, each with what it does.

        Pairs of an option and its meaning; nothing where the answer is complete and counts waiting.
        """
        result = self.result
        if result.status == "incomplete":
            if result.front:
                yield "--json r.json", "keeps what was found; `--resume r.json` goes on from it"
            if waits_in_flows(result.space):
                yield "--processing execution-time", "a quick front without waiting, then judged with it"
            if not result.front:
                yield "--time-limit 10min", "more time to find a first design"
        if result.front and self.waiting.is_asked and len(self.waiting.kept) < len(result.front):
            yield "--processing response-time", "counts waiting for the CPU, chooses cores"

    def _next_steps(self, *, all_listed: bool) -> Iterator[tuple[str, str]]:
        """Options to add to the command, each with what it does."""
        result = self.result
        yield from self.changing_steps()
        if not result.front:
            return
        yield "--explain", "why each design is there"
        if len(result.front) > 1 and not all_listed:
            is_whole = len(self.shown) == len(result.front)
            yield "--all", "every decision that differs" if is_whole else f"all {len(result.front)} designs"
        yield "--report page.html", "a page to compare designs and decide with"


def _with_the_best(result: Result, kinds: Sequence[Kind], most: int) -> list[Kind]:
    """`most` of the kinds: that with the best value of each objective, and else the best ranked ones."""
    signs = {info.name: 1 if info.sense == "minimise" else -1 for info in result.objectives}
    wanted = [
        min(kinds, key=lambda kind: min(sign * point.objectives[name] for point in kind.points))
        for name, sign in signs.items()
    ]
    return list({id(kind): kind for kind in (kinds[0], *wanted, *kinds)}.values())[:most]


def further_blocks(point: Point, parts: Sequence[OthersPart]) -> Iterator[Block]:
    """Designs beside a point.

    `parts` are the further designs of one point, as `Document.others_of` gives them.
    """
    for part in parts:
        yield from texts(f"#{point.id}: {part.words}")
        yield from labelled(part.designs)
