"""What a report says, as plain texts: the same for HTML and Markdown, which only set it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from platform import python_version
from typing import Any

from dse.analysis.binding import bus_stack, message_bytes
from dse.analysis.rates import rate_hz
from dse.analysis.views import View
from dse.report.amounts import amount_words, slack_words
from dse.report.bars import usage_records, waterfall_records
from dse.report.charts import front_records
from dse.report.contention import (
    asks_for_responses,
    contention_words,
    overhead_words,
    processing_words,
    scale_words,
)
from dse.report.explain import conflict_words
from dse.report.missing import TITLE, missing_words
from dse.report.plain import basis_words
from dse.report.words import (
    EMPTY_SLOT,
    GAPS,
    REDUCED,
    Sentence,
    baseline_words,
    changes_words,
    dominated_words,
    exclusion_words,
    figures_words,
    others_words,
    proof_words,
    rank_text,
    sentences,
    tie_words,
    unused_words,
)
from dse.results.analyse import Analysis, FlowTable, Usage
from dse.results.changes import changes_between
from dse.results.display import counted, display_unit, readable
from dse.results.points import Point
from dse.results.reasons import Reasoner
from dse.results.solve import Result, decisions_of
from dse.space.types import Space
from dse.timelimit import look_at_the_clock
from dse.units import is_unbounded
from dse.units.text import count_words
from dse.version import __version__

NOTHING = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True)
class Table:
    """A table: `numbers` are the columns that align right, `total` marks the last row as a sum."""

    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    total: bool = False


@dataclass(frozen=True)
class FlowPart:
    """A flow of an alternative: its table and the records of its waterfall."""

    name: str
    table: Table
    source: FlowTable
    records: Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class OthersPart:
    """Further designs of a point."""

    words: str
    designs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Alternative:
    """Everything that is shown about one point of the front."""

    point: Point
    rank: str
    figures: tuple[tuple[str, str], ...]
    sentences: tuple[Sentence, ...]
    flows: tuple[FlowPart, ...]
    usage: Sequence[Mapping[str, Any]]
    usage_tables: tuple[Table, ...]
    bindings: Table
    requirements: Table
    decisions: Table
    metrics: Table
    others: tuple[OthersPart, ...]
    warnings: tuple[str, ...]


class Document:
    """A result, ready to be set: built once, asked by the writers."""

    def __init__(self, result: Result) -> None:
        self.result = result
        self.space: Space = result.space
        self.reasoner = Reasoner(result)

    @property
    def title(self) -> str:
        """The problem's name."""
        return self.result.problem.name

    @cached_property
    def records(self) -> list[dict[str, Any]]:
        """The points as data of the plots."""
        return front_records(self.result)

    @cached_property
    def baseline_record(self) -> dict[str, Any] | None:
        """Today's design as a record of the scatter plot."""
        if self.reasoner.baseline is None:
            return None
        found: dict[str, Any] = {"id": "baseline"}
        for axis, info in enumerate(self.result.objectives):
            value = self.reasoner.baseline[1][info.name]
            factor, _ = display_unit(info.unit, self.space.currency)
            found[f"o{axis}"] = None if is_unbounded(value) else float(value / factor)
            found[f"t{axis}"] = counted(value, info.unit, self.space.currency)
        return found

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Every point of the front, in the order of rank."""
        return tuple(map(self._alternative, range(len(self.result.front))))

    @property
    def leading(self) -> list[Alternative]:
        """The alternatives that are no variants of better-ranked ones, in the order of rank."""
        return [item for item in self.alternatives if item.point.id not in self.result.variants]

    @property
    def summary(self) -> list[str]:
        """What was asked and what was found, in sentences."""
        found = [proof_words(self.result)]
        if missing := missing_words(self.result):
            found.append(f"{TITLE}: {'; '.join(missing)}.")
        if self.result.front:
            first = self.result.front[0]
            shared = [point.id for point in self.result.front if point.rank == first.rank]
            who = f"#{first.id}" if len(shared) == 1 else " and ".join(f"#{number}" for number in shared) + ", a tie"
            figures = figures_words(self.result, first.objectives)
            found.append(f"First by {self.result.ranking_words}: {who} ({figures}).")
        found += [text for text in (tie_words(self.result), contention_words(self.result), self.baseline_words) if text]
        return found

    @property
    def baseline_words(self) -> str:
        """Today's design: its figures, and the requirements that it breaks."""
        return baseline_words(self.reasoner)

    @property
    def conflicts(self) -> list[tuple[str, tuple[str, ...]]]:
        """Why there is no design, if that was proved: sentences, each with what it speaks of."""
        return list(conflict_words(self.result)) if self.result.status == "infeasible" else []

    @cached_property
    def front_table(self) -> Table:
        """Every point with its objectives and the decisions in which the front differs."""
        infos, variants = self.result.objectives, self.result.variants
        varying = self.varying
        headings = (
            "rank",
            "#",
            *(["like"] if variants else []),
            *(("max " if i.sense == "maximise" else "") + i.name for i in infos),
            "score",
            *varying,
        )
        rows: list[tuple[str, ...]] = []
        for point in self.result.front:
            values = [value for _, value in self._figures(point.objectives)]
            chosen = [point.decisions.get(name, NOTHING) for name in varying]
            like = [f"#{variants[point.id]}" if point.id in variants else ""] if variants else []
            rows.append((rank_text(self.result, point.rank), str(point.id), *like, *values, point.score, *chosen))
        numbers = tuple(range(3 + len(infos) + bool(variants)))
        return Table(f"The front, ranked by {self.result.ranking_words}", headings, tuple(rows), numbers)

    @cached_property
    def varying(self) -> list[str]:
        """The open decisions in which the points of the front differ."""
        front = self.result.front
        return [name for name in self.result.open_decisions if len({p.decisions.get(name) for p in front}) > 1]

    @property
    def common(self) -> list[tuple[str, str]]:
        """The open decisions that all points share."""
        if not self.result.front:
            return []
        shared = self.result.front[0].decisions
        return [
            (name, shared[name]) for name in self.result.open_decisions if name in shared and name not in self.varying
        ]

    @property
    def provenance(self) -> list[tuple[str, str]]:
        """Where the figures come from: question, proof, versions, seed."""
        result, search, asked = self.result, self.result.search, self.result.problem.effective
        carried = "; it was not there, and this is what the result carries of it" if result.problem.is_carried else ""
        found = [
            ("Latency rules", basis_words(asked)),
            ("Objectives", "; ".join(asked["objectives"])),
            ("Requirements", "; ".join(asked["requirements"]) or "none"),
            ("Rules", "; ".join(asked["rules"]) or "none"),
            (
                "Fixed by the caller",
                "; ".join(f"{name} = {value}" for name, value in asked["fixed"].items()) or "nothing",
            ),
            ("Proved", proof_words(result)),
            ("Referee", "every point was recomputed by the analysis, without the solver"),
            ("Space", f"at most {count_words(search.space_size, 'design')}, by their options alone"),
            ("Search", f"{search.solver}, {search.solver_calls} calls, {search.workers} workers, seed {search.seed}"),
            ("Versions", f"dse {__version__}, Python {python_version()}"),
            ("Problem file", f"{result.problem.file.rpartition('/')[2]}, SHA-256 {result.problem.sha256}{carried}"),
        ]
        return found + [("Included file", f"{file}, SHA-256 {digest}") for file, digest in result.problem.includes]

    @property
    def gaps(self) -> tuple[str, ...]:
        """What the model does not see."""
        counted = overhead_words(self.space) if asks_for_responses(self.space) else ""
        found = filter(None, (scale_words(self.space), counted, unused_words(self.result), exclusion_words(self.space)))
        return (REDUCED, processing_words(self.result.problem.effective), *found, *GAPS)

    # --- one alternative ------------------------------------------------------------------------------------------

    def _figures(self, values: Mapping[str, int]) -> list[tuple[str, str]]:
        return [
            (info.name, counted(values[info.name], info.unit, self.space.currency)) for info in self.result.objectives
        ]

    def _alternative(self, number: int) -> Alternative:
        look_at_the_clock()
        reasons = self.reasoner.reasons(number)
        analysis = reasons.analysis
        usages = [*analysis.processors, *analysis.buses]
        return Alternative(
            point=reasons.point,
            rank=rank_text(self.result, reasons.point.rank),
            figures=tuple(self._figures(reasons.point.objectives)),
            sentences=tuple(sentences(self.result, reasons)),
            flows=tuple(FlowPart(t.name, _flow_table(t), t, waterfall_records(t)) for t in analysis.flows),
            usage=usage_records(analysis.processors, analysis.buses, self._limits(analysis)),
            usage_tables=tuple(_usage_table(usage, usage in analysis.processors) for usage in usages if usage.shares),
            bindings=self._bindings(reasons.point),
            requirements=self._requirements(analysis),
            decisions=self._decisions(reasons.point),
            metrics=self._metrics(analysis),
            others=tuple(self._others(reasons.point)),
            warnings=analysis.warnings,
        )

    def _limits(self, analysis: Analysis) -> dict[str, Fraction]:
        """The smallest upper limit of each processor and bus, as a share of its capacity."""
        slots = {"utilisation": analysis.processors, "load": analysis.buses}
        found: dict[str, Fraction] = {}
        for verdict in analysis.verdicts:
            metric = verdict.requirement.metric
            if metric.kind in slots and verdict.requirement.operator in ("<=", "<") and metric.index is not None:
                usage = slots[metric.kind][metric.index]
                if usage.capacity:
                    share = verdict.limit / usage.capacity
                    found[usage.name] = min(found.get(usage.name, share), share)
        return found

    def _bindings(self, point: Point) -> Table:
        """What carries each connection, how much and how often."""
        view = View(point.design)
        rows: list[tuple[str, ...]] = []
        for number, item in enumerate(self.space.connections):
            stack = bus_stack(self.space, item, view)
            ends = [
                self.space.components[end].name if end is not None else "outside" for end in (item.source, item.target)
            ]
            size = message_bytes(self.space, item, stack, view)
            rate = float(rate_hz(self.space, ("delivery", number), view))
            path = " over ".join(self.space.buses[bus].name for bus in stack) or "no bus"
            rows.append(
                (item.name, *ends, path, f"{size} B" if size else NOTHING, f"{rate:.6g} Hz" if rate else NOTHING)
            )
        return Table(
            "Connections and what carries them",
            ("connection", "from", "to", "bus", "bytes", "rate"),
            tuple(rows),
            (4, 5),
        )

    def _requirements(self, analysis: Analysis) -> Table:
        rows: list[tuple[str, ...]] = []
        for verdict in analysis.verdicts:
            if analysis.limits_empty_slot(verdict):
                rows.append((verdict.requirement.shown, NOTHING, NOTHING, NOTHING, EMPTY_SLOT))
                continue
            figures = (verdict.value, verdict.limit)
            values = [readable(value, verdict.unit, self.space.currency, 6) for value in figures]
            values.append(slack_words(verdict.slack, verdict.unit, self.space.currency))
            rows.append((verdict.requirement.shown, *values, "holds" if verdict.holds else "BROKEN"))
        return Table("Requirements", ("requirement", "value", "limit", "slack", "verdict"), tuple(rows), (1, 2, 3))

    def _decisions(self, point: Point) -> Table:
        """Every open decision, today's beside this one's; what differs is marked."""
        today = decisions_of(self.space, self.result.baseline) if self.result.baseline is not None else None
        rows: list[tuple[str, ...]] = []
        for name in self.result.open_decisions:
            here = point.decisions.get(name, NOTHING)
            if today is None:
                rows.append((name, here))
            else:
                before = today.get(name, NOTHING)
                rows.append((name, before, here, "changes" if before != here else ""))
        headings = ("decision", f"#{point.id}") if today is None else ("decision", "baseline", f"#{point.id}", "")
        return Table("Decisions", headings, tuple(rows))

    def _metrics(self, analysis: Analysis) -> Table:
        """Every metric, today's beside this one's, with the difference."""
        base = self.reasoner.baseline[0] if self.reasoner.baseline is not None else None
        rows: list[tuple[str, ...]] = []
        for name, value in analysis.metrics.items():
            unit = analysis.metric_units[name]
            here = readable(value, unit, self.space.currency)
            if base is None:
                rows.append((name, here))
                continue
            change = value - base.metrics[name]
            if is_unbounded(change):
                rows.append((name, readable(base.metrics[name], unit, self.space.currency), here, NOTHING))
                continue
            sign = "+" if change > 0 else MINUS if change < 0 else "±"
            said = f"{sign}{amount_words(abs(change), unit, self.space.currency)}"
            rows.append((name, readable(base.metrics[name], unit, self.space.currency), here, said))
        headings = ("metric", "value") if base is None else ("metric", "baseline", "here", "difference")
        return Table("Metrics", headings, tuple(rows), tuple(range(1, len(headings))))

    def _others(self, point: Point) -> list[OthersPart]:
        parts = []
        for others in self.result.others:
            if others.of != point.id:
                continue
            designs = []
            for sibling in others.designs:
                changes = changes_words(changes_between(self.space, point.design, sibling.design))
                figures = figures_words(self.result, sibling.objectives)
                designs.append((sibling.id, f"{changes}: {figures}{dominated_words(sibling, self.result)}."))
            parts.append(OthersPart(others_words(others), tuple(designs)))
        return parts


def _flow_table(table: FlowTable) -> Table:
    rows = [
        (
            f"{r.category} {r.contributor}",
            counted(r.min_ns, "ns", digits=6),
            r.min_method,
            counted(r.max_ns, "ns", digits=6),
            r.max_method,
        )
        for r in table.rows
    ]
    jitter = f"jitter {counted(table.jitter_ns, 'ns', digits=6)}"
    rows.append(("total", counted(table.min_ns, "ns", digits=6), "", counted(table.max_ns, "ns", digits=6), jitter))
    headings = ("contributor", "minimum", "method", "maximum", "method")
    return Table(f"Latency of {table.name}, contribution by contribution", headings, tuple(rows), (1, 3), total=True)


def _usage_table(usage: Usage, processor: bool) -> Table:
    unit, what = ("ppm", "thread") if processor else ("B/s", "connection")
    of = f"of {readable(usage.capacity, unit)}" if usage.capacity else ""
    rows = [
        (who, readable(share, unit, digits=4), *([] if processor else [_share(share, usage)]), *_core(usage, who))
        for who, share in usage.shares.items()
    ]
    total = (f"total {of}".strip(), readable(usage.total, unit, digits=4))
    rows.append((*total, *([] if processor else [_share(usage.total, usage)]), *_core(usage, "")))
    caption = f"{'Processor' if processor else 'Bus'} {usage.name} ({usage.type})"
    figures = ("of one core",) if processor else ("load", "of the bandwidth")
    headings = (what, *figures, *(("core",) if usage.cores else ()))
    if usage.busy is not None and usage.busy_total is not None:
        busy = [usage.busy.get(who, Fraction(0)) for who in usage.shares]
        rows = [(*row, readable(time, "ppm")) for row, time in zip(rows, [*busy, usage.busy_total], strict=True)]
        headings = (*headings, "busy")
    if usage.payload is not None:
        plain = [usage.payload[who] for who in usage.shares]
        rows = [(*row, readable(each, unit)) for row, each in zip(rows, [*plain, sum(plain)], strict=True)]
        headings = (*headings, "payload, without frames")
    return Table(caption, headings, tuple(rows), (1, 2, 3, 4)[: len(headings) - 1], total=True)


def _core(usage: Usage, who: str) -> tuple[str, ...]:
    """The cell of a thread's core, where there is such a column."""
    return (str(usage.cores.get(who, "")),) if usage.cores else ()


def _share(share: Fraction, usage: Usage) -> str:
    return readable(share / usage.capacity * 10**6, "ppm", digits=2) if usage.capacity else NOTHING
