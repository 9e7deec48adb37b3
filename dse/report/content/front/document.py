"""The contents of a report as plain texts, which HTML and Markdown only set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from platform import python_version
from typing import TYPE_CHECKING, Any

from dse.analysis.binding import bus_stack, message_sizes
from dse.analysis.rates import rate_hz
from dse.analysis.views import View
from dse.answers.analysis import Analysis, FlowTable
from dse.answers.designs import Point
from dse.answers.ranking.changes import changes_between
from dse.answers.ranking.reasons import Margin, Reasoner
from dse.answers.ranking.variants import varying
from dse.answers.result import Result, decisions_of
from dse.answers.tables.display import counted
from dse.report.content.analyse import flow_table, metric_table, tightest_limits, usage_tables, verdict_table
from dse.report.content.explain import conflict_blocks
from dse.report.content.front.filters import insisting_section
from dse.report.page import NOTHING, Block, Section, Table
from dse.report.plots.deadlines import deadline_records
from dse.report.plots.design import usage_records, waterfall_records
from dse.report.plots.front import drawn_figures, front_records
from dse.report.words.basis import basis_words, scale_words
from dse.report.words.choice import shown_decisions
from dse.report.words.clocks import boundary_table, by_flow, timeline_records
from dse.report.words.contention import (
    asks_for_responses,
    broken_choice_words,
    bus_words,
    contention_words,
    processing_words,
    response_time_words,
    uncounted_words,
)
from dse.report.words.messages import bus_timelines, message_tables
from dse.report.words.missing import TITLE, missing_words
from dse.report.words.reasons import (
    GAPS,
    REDUCED,
    Sentence,
    baseline_words,
    changes_words,
    dominated_words,
    exclusion_words,
    extrapolated_words,
    figures_words,
    others_words,
    proof_words,
    rank_text,
    sentences,
    short_name,
    tie_words,
    unused_words,
)
from dse.report.words.scheduling import busy_timelines, response_tables
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.timelimit import TimeLimit, in_force, look_at_the_clock
from dse.support.units.text import count_words
from dse.support.version import __version__

if TYPE_CHECKING:
    from dse.questions.beyond_limit import Beyond
    from dse.questions.verbs.feasible_designs import Feasible

BEYOND_S = 5.0
"""Seconds for the nearest design beyond a limit; without an answer by then none is told."""


@dataclass(frozen=True)
class FlowPart:
    """A flow of an alternative: its table and the records of its waterfall."""

    name: str
    table: Table
    source: FlowTable
    records: Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class ClockPart:
    """The timers on one clock along a flow of an alternative: their table and the records of their timeline."""

    name: str
    table: Table
    records: Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class OthersPart:
    """Further designs of a point."""

    words: str
    designs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class AlternativePage:
    """Everything that is shown about one point of the front."""

    point: Point
    analysis: Analysis
    rank: str
    figures: tuple[tuple[str, str], ...]
    sentences: tuple[Sentence, ...]
    flows: tuple[FlowPart, ...]
    clocks: tuple[ClockPart, ...]
    usage: Sequence[Mapping[str, Any]]
    usage_tables: tuple[Table, ...]
    deadlines: Sequence[Mapping[str, Any]]
    responses: tuple[Block, ...]
    bindings: Table
    requirements: Table
    decisions: Table
    metrics: Table
    others: tuple[OthersPart, ...]
    warnings: tuple[str, ...]
    margins: tuple[Margin, ...]


class Document:
    """A result, ready to be set: built once, asked by the writers.

    Parts are computed when they are first asked for and kept; `AlternativePage` objects are shared by the HTML page,
    Markdown and the terminal.
    """

    def __init__(self, result: Result) -> None:
        self.result = result
        self.space: Space = result.space
        self.reasoner = Reasoner(result)
        self._known: dict[int, AlternativePage] = {}

    @property
    def title(self) -> str:
        """The problem's name."""
        return self.result.problem.name

    @cached_property
    def records(self) -> list[dict[str, Any]]:
        """The points as data of the plots.

        One mapping for each point with an axis value ``oN``, a text ``tN`` and a normalised value ``nN`` for each
        objective.
        """
        return front_records(self.result)

    @cached_property
    def baseline_record(self) -> dict[str, Any] | None:
        """Today's design as a record of the scatter plot.

        The keys ``oN`` and ``tN`` of each objective, for the mark of today's design; None where there is no valid
        baseline.
        """
        if self.reasoner.baseline is None:
            return None
        return {"id": "baseline", **drawn_figures(self.result, self.reasoner.baseline[1])}

    @cached_property
    def beyond(self) -> Beyond | None:
        """The nearest design beyond a limit, found by a search of its own within `BEYOND_S`.

        None where there is none, or where it was not proved in time.
        """
        from dse.questions.beyond_limit import beyond  # the solver, which a page without a front does not need

        seconds = min(BEYOND_S, in_force().left_s / 2)
        return beyond(self.result, TimeLimit.after(seconds)) if seconds > 0 else None

    @cached_property
    def feasible(self) -> Feasible | None:
        """All feasible designs, where they are few enough to look at each.

        A `Feasible` with count and objective vectors; None for larger problems. Drawn as grey points behind the front.
        """
        from dse.questions.verbs.feasible_designs import (
            feasible_designs,  # with the second proof, which takes a while to import
        )

        return feasible_designs(self.result)

    @cached_property
    def alternatives(self) -> tuple[AlternativePage, ...]:
        """Every point of the front, in the order of rank."""
        return tuple(map(self.alternative, self.result.front))

    def alternative(self, point: Point) -> AlternativePage:
        """Everything that is said about a point of the front.

        Computed on the first call for a point: one analysis of the design, its reasons, tables and warnings.
        """
        if point.id not in self._known:
            self._known[point.id] = self._alternative(self.result.front.index(point))
        return self._known[point.id]

    @property
    def summary(self) -> list[str]:
        """The question and the findings in sentences, compared with today's design.

        Sentences in the order of a report: proof, first design, ties, waiting, baseline.
        """
        return [*self.findings, *filter(None, [self.baseline_words])]

    @property
    def findings(self) -> list[str]:
        """The question and the findings in sentences that need no further computation.

        Sentences; no design is analysed for them, so that they are there at once.
        """
        sentences = [proof_words(self.result)]
        if missing := missing_words(self.result):
            sentences.append(f"{TITLE}: {'; '.join(missing)}.")
        if self.result.front:
            first = self.result.front[0]
            shared = [point.id for point in self.result.front if point.rank == first.rank]
            who = f"#{first.id}" if len(shared) == 1 else " and ".join(f"#{number}" for number in shared) + ", a tie"
            figures = figures_words(self.result, first.objectives)
            broken = broken_choice_words(self.result, first)
            sentences.append(f"First by {self.result.ranking_words}: {who} ({figures}). {broken}".rstrip())
            sentences += [text for text in (uncounted_words(self.space),) if text]
        sentences += [text for text in (tie_words(self.result), contention_words(self.result)) if text]
        return sentences

    @property
    def baseline_words(self) -> str:
        """Today's design: its figures, and the requirements that it breaks."""
        return baseline_words(self.reasoner)

    @property
    def conflicts(self) -> list[Block]:
        """The conflicts of a problem that is proved infeasible."""
        return list(conflict_blocks(self.result)) if self.result.status == "infeasible" else []

    def table_of(self, points: Sequence[Point]) -> Table:
        """Points with their objectives and the decisions in which the front differs.

        Columns: rank, id, the point that it resembles (where there are variants), objectives, score, and decisions that
        differ.
        """
        infos = self.result.objectives
        variants = self.result.variants if any(point.id in self.result.variants for point in points) else {}
        has_score = any(point.score for point in points)
        headings = (
            "rank",
            "#",
            *(["like"] if variants else []),
            *(("max " if i.sense == "maximise" else "") + i.name for i in infos),
            *(["score"] if has_score else []),
        )
        rows: list[tuple[str, ...]] = []
        for point in points:
            values = [value for _, value in self._figures(point.objectives)]
            decisions = self.chosen_in(point)
            chosen = [decisions.get(name, NOTHING) for name in self.varying]
            like = [f"#{variants[point.id]}" if point.id in variants else ""] if variants else []
            score = [point.score] if has_score else []
            rows.append((rank_text(self.result, point.rank), str(point.id), *like, *values, *score, *chosen))
        wide = len(headings) if self.varying else None
        caption = f"The front, ranked by {self.result.ranking_words}"
        numbers = tuple(at for at, name in enumerate(headings) if name != "like")
        return Table(caption, (*headings, *self.varying), tuple(rows), numbers, wide=wide, label=1)

    def chosen_in(self, point: Point) -> Mapping[str, str]:
        """The decisions of a point as tables show them."""
        return shown_decisions(self.result, point)

    @cached_property
    def front_table(self) -> Table:
        """Every point with its objectives and the decisions in which the front differs.

        One row for each point, in the order of rank.
        """
        return self.table_of(self.result.front)

    @cached_property
    def varying(self) -> list[str]:
        """The open decisions in which the points of the front differ.

        Names of decisions in the order of the problem; empty for a front of one point.
        """
        front = self.result.front
        return varying([point.decisions for point in front], self.result.open_decisions) if len(front) > 1 else []

    @property
    def shared(self) -> dict[str, str]:
        """The decisions of the first point, with the number of an identifier ``any`` where all points have that one.

        Names of decisions to texts; of interest for decisions in which the points do not differ. Empty without points.
        """
        front = self.result.front
        if not front or "any" not in front[0].decisions.values():
            return dict(front[0].decisions) if front else {}
        first, *others = map(self.chosen_in, front)
        stated = front[0].decisions
        return {
            name: text if all(other.get(name) == text for other in others) else stated[name]
            for name, text in first.items()
        }

    @property
    def common_words(self) -> str:
        """The open decisions that all points share; "" where there is none."""
        front = self.result.front
        shared = self.shared
        names = [name for name in self.result.open_decisions if name in shared and name not in self.varying]
        said = ", ".join(f"{short_name(name)} {shared[name]}" for name in names)
        return f"{'Same in every design' if len(front) > 1 else 'Its decisions'}: {said}." if said else ""

    @property
    def further_sections(self) -> list[Section]:
        """The sections on further questions: the price of insisting."""
        return [insisting_section(self.result)] if self.result.insisting is not None else []

    @property
    def provenance(self) -> list[tuple[str, str]]:
        """The provenance of the figures: question, proof, versions, seed.

        Pairs of a heading and a text, for the last section of a report: what is needed to reproduce the result.
        """
        result, search, question = self.result, self.result.search, self.result.problem.effective
        carried = (
            "; it, or a file that it names, was not there, and this is what the result carries"
            if result.problem.is_carried
            else ""
        )
        entries = [
            ("Latency rules", basis_words(question)),
            ("Objectives", "; ".join(question["objectives"])),
            ("Requirements", "; ".join(question["requirements"]) or "none"),
            ("Rules", "; ".join(question["rules"]) or "none"),
            (
                "Fixed by the caller",
                "; ".join(f"{name} = {value}" for name, value in question["fixed"].items()) or "nothing",
            ),
            ("Proved", proof_words(result)),
            ("Referee", "every point was recomputed by the analysis, without the solver"),
            ("Space", f"at most {count_words(search.space_size, 'design')}, by their options alone"),
            (
                "Search",
                (
                    f"{search.solver}, {count_words(search.solver_calls, 'call')}, "
                    f"{count_words(search.workers, 'worker')}, seed {search.seed}"
                ),
            ),
            ("Versions", f"dse {__version__}, Python {python_version()}"),
            ("Problem file", f"{result.problem.file.rpartition('/')[2]}, SHA-256 {result.problem.sha256}{carried}"),
        ]
        return entries + [("Included file", f"{file}, SHA-256 {digest}") for file, digest in result.problem.includes]

    @property
    def gaps(self) -> tuple[str, ...]:
        """The effects that the model leaves out.

        Sentences; some depend on the problem (buses without arbitration, overheads that are not stated), the others
        hold for every result.
        """
        counted = response_time_words(self.space) if asks_for_responses(self.space) else ""
        said = (
            bus_words(self.space),
            scale_words(self.space),
            counted,
            unused_words(self.result),
            extrapolated_words(self.result),
        )
        sentences = filter(None, (*said, exclusion_words(self.space)))
        return (REDUCED, processing_words(self.result.problem.effective), *sentences, *GAPS)

    # --- one alternative ------------------------------------------------------------------------------------------

    def _figures(self, values: Mapping[str, int]) -> list[tuple[str, str]]:
        return [
            (info.name, counted(values[info.name], info.unit, self.space.currency)) for info in self.result.objectives
        ]

    def _alternative(self, number: int) -> AlternativePage:
        look_at_the_clock()
        reasons = self.reasoner.reasons(number)
        analysis = reasons.analysis
        return AlternativePage(
            point=reasons.point,
            analysis=analysis,
            rank=rank_text(self.result, reasons.point.rank),
            figures=tuple(self._figures(reasons.point.objectives)),
            sentences=tuple(sentences(self.result, reasons)),
            flows=tuple(FlowPart(t.name, flow_table(t), t, waterfall_records(t)) for t in analysis.flows),
            clocks=tuple(
                ClockPart(flow, boundary_table(flow, here), timeline_records(here))
                for flow, here in by_flow(analysis.boundaries).items()
            ),
            usage=usage_records(analysis.processors, analysis.buses, tightest_limits(analysis)),
            usage_tables=tuple(usage_tables(analysis)),
            deadlines=deadline_records(analysis.responses, analysis.messages),
            responses=(
                *response_tables(analysis.responses),
                *message_tables(analysis.messages),
                *busy_timelines(analysis.responses),
                *bus_timelines(analysis.messages),
            ),
            bindings=self._bindings(reasons.point),
            requirements=verdict_table(analysis),
            decisions=self._decisions(reasons.point),
            metrics=metric_table(analysis, self.reasoner.baseline[0] if self.reasoner.baseline is not None else None),
            others=tuple(self.others_of(reasons.point)),
            warnings=analysis.warnings,
            margins=reasons.margins,
        )

    def _bindings(self, point: Point) -> Table:
        """The connections: buses, sizes and rates."""
        view = View(point.design)
        rows: list[tuple[str, ...]] = []
        for number, item in enumerate(self.space.connections):
            stack = bus_stack(self.space, item, view)
            ends = [
                self.space.components[end].name if end is not None else "outside" for end in (item.source, item.target)
            ]
            carried = [size for bus in stack for size in message_sizes(self.space, item, bus, view)]
            sizes = carried or [at(item.size_bytes, view) or 0]
            size = max(sizes)
            size_text = f"{int(size)} B" if size == int(size) else f"{float(size):.6g} B"  # OSATE's rules count bits
            rate = float(rate_hz(self.space, ("delivery", number), view))
            path = " over ".join(self.space.buses[bus].name for bus in stack) or "no bus"
            rows.append(
                (
                    item.name,
                    *ends,
                    path,
                    size_text if size else NOTHING,
                    f"{rate:.6g} Hz" if rate else NOTHING,
                )
            )
        return Table(
            "Connections and what carries them",
            ("connection", "from", "to", "bus", "bytes", "rate"),
            tuple(rows),
            (4, 5),
        )

    def _decisions(self, point: Point) -> Table:
        """Every open decision, today's beside this one's; what differs is marked."""
        today = decisions_of(self.space, self.result.baseline) if self.result.baseline is not None else None
        rows: list[tuple[str, ...]] = []
        shown = self.chosen_in(point)
        for name in self.result.open_decisions:
            here = point.decisions.get(name, NOTHING)
            if today is None:
                rows.append((name, shown.get(name, NOTHING)))
            else:
                before = today.get(name, NOTHING)
                rows.append((name, before, shown.get(name, NOTHING), "changes" if before != here else ""))
        headings = ("decision", f"#{point.id}") if today is None else ("decision", "baseline", f"#{point.id}", "")
        return Table("Decisions", headings, tuple(rows))

    def others_of(self, point: Point) -> list[OthersPart]:
        """The further designs of a point.

        One `OthersPart` for each request, with the changes of each further design against the point.
        """
        parts = []
        for others in self.result.others:
            if others.of != point.id:
                continue
            designs = []
            for sibling in others.designs:
                changes = changes_words(changes_between(self.space, point.design, sibling.design, like_before=True))
                figures = f"{figures_words(self.result, sibling.objectives)}; " if others.within else ""
                designs.append((sibling.id, f"{figures}{changes}{dominated_words(sibling, self.result)}."))
            parts.append(OthersPart(others_words(others), tuple(designs)))
        return parts
