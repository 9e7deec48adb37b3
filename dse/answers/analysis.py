"""The analysis of one design, as tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain
from typing import TYPE_CHECKING, Any

from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.diagnosis.remarks import design_remarks
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency.contributors import flow_rows
from dse.analysis.latency.offset_advice import Boundary, boundaries
from dse.analysis.latency.rows import Row
from dse.analysis.limits import Verdict
from dse.analysis.measures import loaded_buses
from dse.analysis.osate.findings import CURRENT, Finding, flow_findings, specified_rows
from dse.analysis.osate.load import Budget, bus_budget
from dse.analysis.osate.quirks import quirks
from dse.analysis.osate.resources import ResourceUse, resource_uses
from dse.analysis.scheduling.overheads import stated_overheads
from dse.analysis.scheduling.scheduling import Response, processor_responses
from dse.analysis.terms import PPM, Term
from dse.analysis.usage import busy_terms, load_terms, payload_terms, utilisation_terms
from dse.analysis.views import View
from dse.answers.base import Answer, With
from dse.answers.contention_verdicts import Contended
from dse.answers.result import decisions_of
from dse.answers.tables.frames import unit_frame
from dse.space.architecture.frames import frame_at
from dse.space.model.flows import Flow
from dse.space.model.space import EMPTY, Design, Processor, Slot, Space
from dse.space.model.trees import at
from dse.space.question.metrics import busy_obstacle
from dse.support.errors import UsageError
from dse.support.timelimit import in_time
from dse.support.units import Exact, whole

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class FlowTable:
    """The contributor table of a flow, in ns, with its totals; `findings` are what OSATE says of it (`osate-2.19`)."""

    name: str
    rows: tuple[Row, ...]
    findings: tuple[Finding, ...] = ()

    @property
    def min_ns(self) -> Exact:
        """The minimum latency: the sum of the column."""
        return whole(sum((row.min_ns for row in self.rows), Fraction(0)))

    @property
    def max_ns(self) -> Exact:
        """The maximum latency: the sum of the column."""
        return whole(sum((row.max_ns for row in self.rows), Fraction(0)))

    @property
    def specified_ns(self) -> tuple[Exact, Exact] | None:
        """OSATE's specified totals; None where rows do not tell what is specified."""
        given = [row.specified_ns for row in self.rows]
        if None in given:
            return None
        ends = [sum((item[end] for item in given if item is not None), Fraction(0)) for end in (0, 1)]
        return whole(ends[0]), whole(ends[1])

    @property
    def jitter_ns(self) -> Exact:
        """Maximum minus minimum latency."""
        return whole(self.max_ns - self.min_ns)


@dataclass(frozen=True)
class Usage:
    """How much of a processor (ppm of one core) or bus (B/s) is used, by whom, and what it has (None: not stated).

    `busy` has the busy time of a physical bus by connection, in ppm; None where it is not computable, which
    `no_busy` explains, and for what has none.
    `cores` has the core, from 1, of each of those who use a processor with several. `payload` has what each connection
    carries over a bus with frames without these, in B/s (what OSATE counts), where `shares` are those of the wire.
    `budget` are OSATE's budgets of a bus, under its current rules and where any is stated.
    """

    name: str
    type: str
    shares: Mapping[str, Fraction]
    capacity: Fraction | None
    busy: Mapping[str, Fraction] | None = None
    no_busy: str = ""
    cores: Mapping[str, int] = field(default_factory=dict)
    payload: Mapping[str, Fraction] | None = None
    unit: str = "ppm"
    budget: Budget | None = None

    @property
    def total(self) -> Fraction:
        """The sum of the shares."""
        return sum(self.shares.values(), Fraction(0))

    @property
    def busy_total(self) -> Fraction | None:
        """The share of the time, in ppm, that a physical bus is busy; None where that is not computable."""
        return None if self.busy is None else sum(self.busy.values(), Fraction(0))

    @property
    def busy_use(self) -> Mapping[str, Any]:
        """The share of the time that a bus is busy, by connection; or why it is not known."""
        if self.busy is None:
            return {"total": None, "reason": self.no_busy or None}
        return {"unit": "ppm", "shares": self.busy, "total": self.busy_total}


@dataclass(frozen=True, repr=False)
class Analysis(Answer):
    """Everything that can be said of one design; `breaches` says why it is not valid, then the tables are empty.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> found = dse.analyse("pump.yaml", best.decisions)
    >>> [(item.requirement.text, item.holds) for item in found.verdicts][:1]
    [('jitter of sensor_to_valve <= 30 ms', True)]
    """

    FORM = "design.AnalysisForm"

    space: Space
    design: Design
    decisions: Mapping[str, str]
    flows: tuple[FlowTable, ...]
    processors: tuple[Usage, ...]
    buses: tuple[Usage, ...]
    metrics: Mapping[str, Fraction]
    metric_units: Mapping[str, str]
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...] = ()
    breaches: tuple[str, ...] = ()
    responses: Mapping[str, tuple[Response, ...]] = field(default_factory=dict)
    """By processor, where response times were asked for."""
    resources: tuple[ResourceUse, ...] = ()
    """OSATE's resource budgets, under its current rules and where anything is stated."""
    boundaries: tuple[Boundary, ...] = ()
    """Every reader on the clock of the timer before it, flow by flow."""
    contended: Contended | None = None
    """What the design keeps when response times count, where the question leaves that out."""

    @property
    def is_feasible(self) -> bool:
        """Valid, and every requirement holds."""
        return not self.breaches and all(verdict.holds for verdict in self.verdicts)

    def limits_empty_slot(self, verdict: Verdict) -> bool:
        """Whether a requirement holds because what it limits is left empty, or of a type without such a limit."""
        metric = verdict.requirement.metric
        slots = {"utilisation": self.processors, "load": self.buses, "busy": self.buses}.get(metric.kind)
        if slots is None or not verdict.holds:
            return False
        usage = slots[metric.index or 0]
        return usage.type == EMPTY or self.is_of_other_type(verdict)

    def is_of_other_type(self, verdict: Verdict) -> bool:
        """Whether a limit is implied by other types of a bus than the chosen one, which has none."""
        metric, number = verdict.requirement.metric, verdict.requirement.metric.index or 0
        if not verdict.requirement.implied or metric.kind not in ("load", "busy") or self.buses[number].type == EMPTY:
            return False
        if metric.kind == "busy":
            return not at(self.space.buses[number].exclusive, View(self.design))
        return self.buses[number].capacity is None

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The design as a frame of one row, with the columns of `Result.frame`.

        Columns: each metric as ``NAME [UNIT]`` (exact), each decision by name (text); `units` as for `Result.frame`.
        """
        columns = [*self.metrics, *self.decisions]
        row = {**{name: whole(value) for name, value in self.metrics.items()}, **self.decisions}
        return unit_frame(columns, [row] if self.metrics else [], self.metric_units, units, self.space.currency)

    def flow_frame(self, name: str, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A flow's contributor table, in order.

        Columns: ``category``, ``contributor``, ``min_ns``, ``min_method``, ``max_ns``, ``max_method``; with `units` (as
        for `Result.frame`) the times are called ``min [ms]`` and ``max [ms]``.

        Raises
        ------
        UsageError
            when there is no such flow, or no such unit.
        """
        import pandas

        from dse.answers.forms.design import Row as RowForm
        from dse.answers.forms.writing import written

        table = next((table for table in self.flows if table.name == name), None)
        if table is None:
            raise UsageError(f"no flow is called {name!r}: there are {', '.join(flow.name for flow in self.flows)}")
        rows = [written(RowForm, row) for row in table.rows]
        if units is None:
            return pandas.DataFrame(rows)
        names = {"min_ns": "min", "max_ns": "max"}
        named = [{names.get(column, column): value for column, value in row.items()} for row in rows]
        return unit_frame([*dict.fromkeys(chain(*named))], named, {"min": "ns", "max": "ns"}, units)

    def _told(self) -> Mapping[str, Any]:
        return {
            "metrics": {name: (value, self.metric_units[name]) for name, value in self.metrics.items()},
            "overheads": stated_overheads(self.space, self.design),
            "response_times": {name: [_response(item) for item in found] for name, found in self.responses.items()},
        }


def _response(response: Response) -> With:
    return With(
        response,
        {
            "execution_ns": (response.best_ns, response.worst_ns),
            "switching_ns": response.task.worst_ns - response.worst_ns,
        },
    )


# Every figure of one design: contributor tables, processor and bus shares, metrics, verdicts.


def analyse_design(evaluator: Evaluator, design: Design, *, response_times: bool = False) -> Analysis:
    """The analysis of a complete design; one that is not valid has no tables, only `breaches`.

    Response times are there when asked for, or when the problem counts or limits them, or states a priority or core.
    """
    space = evaluator.space
    evaluation = evaluator.evaluate(design)
    if evaluation.breaches:
        shown = decisions_of(space, design)
        return Analysis(space, design, shown, (), (), (), {}, {}, (), breaches=evaluation.breaches)
    view = View(evaluation.design)
    flows = tuple(_flow_table(space, flow, view) for flow in in_time(space.flows))
    cores = {space.components[thread].name: core for thread, core in cores_of(space, evaluation.design).items()}
    processors = tuple(
        _placed(_usage(slot, terms, view, PPM * Fraction(at(slot.cores, view))), terms, cores)
        for slot, terms in _users(space)
    )
    buses = tuple(_bus_usage(space, number, view) for number in in_time(loaded_buses(space)))
    return Analysis(
        space=space,
        design=evaluation.design,
        decisions=decisions_of(space, evaluation.design),
        flows=flows,
        processors=processors,
        buses=buses,
        metrics={measure.metric.name: measure.value(view) for measure in in_time(evaluator.metrics)},
        metric_units={measure.metric.name: measure.unit for measure in evaluator.metrics},
        verdicts=evaluation.verdicts,
        warnings=(*_warnings(space, flows, processors, buses), *design_remarks(space, view), *quirks(space, view)),
        boundaries=boundaries(space, view),
        resources=resource_uses(space, view) if space.profile == CURRENT else (),
        responses=_responses(space, view) if response_times or _is_scheduled(space) else {},
    )


def _users(space: Space) -> Iterator[tuple[Processor, tuple[Term, ...]]]:
    """The processors with what uses each."""
    for number, slot in enumerate(in_time(space.processors)):
        yield slot, utilisation_terms(space, number)


def _flow_table(space: Space, flow: Flow, view: View) -> FlowTable:
    """The rows of a flow; under OSATE's rules with what is specified, of today's with what OSATE says of it."""
    if space.profile == "dse":
        return FlowTable(flow.name, flow_rows(space, flow, view))
    rows = specified_rows(space, flow, view)
    if space.profile != CURRENT:
        return FlowTable(flow.name, rows)
    return FlowTable(flow.name, rows, tuple(flow_findings(space, flow, rows, view)))


def _is_scheduled(space: Space) -> bool:
    stated = any(item.priority is not None or item.core is not None for item in space.components)
    limited = any(item.metric.kind == "response time" for item in space.requirements)
    return stated or limited or space.processing == "response_time"


def _responses(space: Space, view: View) -> dict[str, tuple[Response, ...]]:
    return {
        slot.name: processor_responses(space, number, view)
        for number, slot in enumerate(space.processors)
        if slot.types[view[slot.type_decision]] != EMPTY
    }


def _bytes_per_s(bandwidth_bps: int | None) -> Fraction | None:
    return None if bandwidth_bps is None else Fraction(bandwidth_bps, 8)


def _usage(slot: Slot, terms: tuple[Term, ...], view: View, capacity: Fraction | None) -> Usage:
    """The shares of those that really use the slot."""
    shares = {term.label: term.value(view) for term in terms}
    used = {label: value for label, value in shares.items() if value}
    chosen = slot.types[view[slot.type_decision]]
    return Usage(slot.name, chosen, used, None if chosen == EMPTY else capacity)


def _bus_usage(space: Space, number: int, view: View) -> Usage:
    """Load and busy time of a bus by connection."""
    bus = space.buses[number]
    usage = _usage(bus, load_terms(space, number), view, _bytes_per_s(at(bus.bandwidth_bps, view)))
    usage = replace(usage, unit="B/s")
    if usage.type != EMPTY and frame_at(bus.fixed_ns, view) is not None:
        plain = {term.label: term.value(view) for term in payload_terms(space, number)}
        usage = replace(usage, payload={label: plain[label] for label in usage.shares})
    if space.profile == CURRENT:
        usage = replace(usage, budget=bus_budget(space, number, dict(usage.shares), usage.capacity, view))
    obstacle = busy_obstacle(space, number)
    if obstacle or usage.type == EMPTY:
        return replace(usage, no_busy=obstacle)
    times = {term.label: term.value(view) for term in busy_terms(space, number)}
    return replace(usage, busy={label: value for label, value in times.items() if value})


def _placed(usage: Usage, terms: tuple[Term, ...], cores: Mapping[str, int]) -> Usage:
    """With the core of each of those who use the processor."""
    threads = {term.label: term.component for term in terms}
    placed = {label: cores[threads[label]] for label in usage.shares if threads[label] in cores}
    return replace(usage, cores=placed)


def _warnings(
    space: Space, flows: Sequence[FlowTable], processors: Sequence[Usage], buses: Sequence[Usage]
) -> list[str]:
    """What no requirement forbids but an engineer should know."""
    found = []
    for flow, table in zip(space.flows, flows, strict=True):
        if flow.required_ns is not None and table.min_ns < flow.required_ns[0]:
            found.append(f"{flow.name}: the minimum latency is below the required minimum")
    for usage in (*processors, *buses):
        if usage.capacity is not None and usage.total > usage.capacity:
            found.append(f"{usage.name} is overloaded: it has less capacity than it would use")
    return found
