"""The analysis of one design, as tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Any

from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.diagnosis.remarks import design_remarks
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency.contributors import flow_rows
from dse.analysis.latency.offset_advice import Boundary, boundaries
from dse.analysis.latency.rows import Row
from dse.analysis.limits import Verdict
from dse.analysis.measures import loaded_buses
from dse.analysis.messages.stages import counted_buses
from dse.analysis.messages.waits import MessageResponse, message_responses
from dse.analysis.osate.findings import CURRENT, Finding, flow_findings, specified_rows
from dse.analysis.osate.load import BusBudget, bus_budget
from dse.analysis.osate.quirks import quirks
from dse.analysis.osate.resources import ResourceUse, resource_uses
from dse.analysis.scheduling.overheads import stated_overheads
from dse.analysis.scheduling.responses import Response, processor_responses
from dse.analysis.terms import PPM, Term
from dse.analysis.usage import busy_terms, load_terms, payload_terms, utilisation_terms
from dse.analysis.views import View
from dse.answers.base import Answer
from dse.answers.contention_verdicts import Contended
from dse.answers.designs import numbered_texts
from dse.answers.question_data import OF_SPACE
from dse.answers.result import decisions_of
from dse.answers.tables.frames import unit_frame
from dse.space.architecture.frames import frame_at
from dse.space.model.flows import Flow, UnreadFlow
from dse.space.model.space import EMPTY, Design, Processor, Slot, Space
from dse.space.model.trees import at
from dse.space.question.metrics import busy_obstacle
from dse.support.errors import UsageError
from dse.support.json_fields import BY_NAME, NULL, Data, Json, Of, Unit
from dse.support.timelimit import in_time
from dse.support.units import Exact, whole

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class FlowTable:
    """The contributor table of one flow: its latency as the sum of rows, in ns.

    Rows stand in the order of the flow, from source to sink, with minimum and maximum and the rule that gives each.
    `jitter_ns` is the maximum less the minimum. Under the profiles `osate-2.2` and `osate-2.19` rows are those of
    OSATE.
    """

    JSON_NAME = "Flow"
    WRITTEN = ("rows", "min_ns", "max_ns", "jitter_ns", "specified_ns", "findings")

    name: str
    rows: Annotated[tuple[Row, ...], "The contributors, from the source to the end of the flow."]
    findings: Annotated[
        tuple[Finding, ...], "Under `osate-2.19`: the errors and warnings of OSATE about it.", Json(default=[])
    ] = ()

    @property
    def min_ns(self) -> Exact:
        """The minimum latency.

        The exact sum of the rows' minima in ns (docs/semantics.md, section 3); a `Fraction` only where it is no whole
        number.
        """
        return whole(sum((row.min_ns for row in self.rows), Fraction(0)))

    @property
    def max_ns(self) -> Annotated[Exact, NULL]:
        """The maximum latency; null where it is unbounded.

        The exact sum of the rows' maxima in ns; an `Unbounded` number when a row has no bound.
        """
        return whole(sum((row.max_ns for row in self.rows), Fraction(0)))

    @property
    def specified_ns(self) -> Annotated[tuple[Exact, Exact] | None, Json(default=None, kind=tuple[Exact, ...] | None)]:
        """Under the `osate` profiles: the totals of what is specified, minimum and maximum.

        In ns, from the flow specifications of the AADL model alone; None where a row has no specification.
        """
        ranges = [row.specified_ns for row in self.rows]
        if None in ranges:
            return None
        ends = [sum((item[end] for item in ranges if item is not None), Fraction(0)) for end in (0, 1)]
        return whole(ends[0]), whole(ends[1])

    @property
    def jitter_ns(self) -> Annotated[Exact, NULL]:
        """The maximum minus the minimum; null where it is unbounded.

        In ns, exact: the difference of `max_ns` and `min_ns`.
        """
        return whole(self.max_ns - self.min_ns)


class Busy(Data):
    """The share of the time that a bus is busy."""

    unit: Annotated[Unit, "`ppm`, where the busy time is known.", Json(default="")]
    shares: Annotated[Mapping[str, Fraction], "Share of the time that each connection takes.", Json(default=None)]
    total: Annotated[Fraction | None, "The sum; null where it cannot be computed."]
    reason: Annotated[
        str | None, "Reason why the busy time cannot be computed; empty where it can.", Json(default=None)
    ]


@dataclass(frozen=True)
class Usage:
    """The use of a processor or bus, by thread or connection.

    `busy` has the busy time of a physical bus by connection, in ppm; None where it is not computable, which
    `no_busy` explains, and for what has none.
    """

    name: str
    type: Annotated[str, "The chosen type; `none` where the slot is left empty."]
    shares: Annotated[Mapping[str, Fraction], "Use by each thread or connection."]
    capacity: Annotated[Fraction | None, "Capacity; null where the problem does not state it."]
    busy: Mapping[str, Fraction] | None = None
    no_busy: str = ""
    cores: Annotated[
        Mapping[str, int], "Core of each thread, from 1, on a processor with several cores.", Json(default={})
    ] = field(default_factory=dict)
    payload: Annotated[
        Mapping[str, Fraction] | None,
        "For a bus with frames: the load of each connection without frames, as OSATE counts; `shares` count frames.",
        Json(default=None, kind=Mapping[str, Fraction]),
    ] = None
    unit: Annotated[Unit, "Unit of the figures: `ppm` of one core, or `B/s`."] = "ppm"
    budget: Annotated[
        BusBudget | None, "Under `osate-2.19`, where budgets are stated: those of the bus.", Json(default=None)
    ] = None

    @property
    def total(self) -> Fraction:
        """The sum of the shares.

        In the unit of the shares: ppm of one core for a processor, B/s for a bus.
        """
        return sum(self.shares.values(), Fraction(0))

    @property
    def core_loads(self) -> Mapping[int, Fraction]:
        """The load of each core in ppm, by number; of a processor with several cores on which threads run."""
        loads: dict[int, Fraction] = {}
        for who, core in self.cores.items():
            loads[core] = loads.get(core, Fraction(0)) + self.shares[who]
        return loads

    @property
    def busy_total(self) -> Fraction | None:
        """The share of the time, in ppm, that a physical bus is busy; None where that is not computable.

        The sum over the connections on the bus, exact.
        """
        return None if self.busy is None else sum(self.busy.values(), Fraction(0))

    @property
    def busy_use(self) -> Annotated[Mapping[str, Any], Json(kind=Busy)]:
        """The share of the time that it is busy.

        A mapping with ``unit``, ``shares`` and ``total``, or with ``total`` None and the ``reason``, in the form of
        JSON.
        """
        if self.busy is None:
            return {"total": None, "reason": self.no_busy or None}
        return {"unit": "ppm", "shares": self.busy, "total": self.busy_total}


class ProcessorUse(Data):
    """The use of a processor, by thread."""

    OF = Usage
    WRITTEN = ("type", "unit", "shares", "total", "capacity", "cores")


class BusUse(Data):
    """The use of a bus, by connection, and its busy time."""

    OF = Usage
    WRITTEN = ("type", "unit", "shares", "total", "capacity", "payload", Of("busy_use", key="busy"), "budget")


class MetricValue(Data):
    """A metric of a design."""

    JSON_NAME = "Metric"

    value: Annotated[Fraction, NULL, "Exact value of the metric; null where it is unbounded."]
    unit: Annotated[Unit, "Unit of the value."]


@dataclass(frozen=True, repr=False)
class Analysis(Answer):
    """The outcome of `dse analyse`: everything that is computed of one design.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> found = dse.analyse("pump.yaml", best.decisions)
    >>> [(item.requirement.text, item.holds) for item in found.verdicts][:1]
    [('jitter of sensor_to_valve <= 30 ms', True)]
    """

    FORMAT = "analysis"
    WRITTEN = (
        Of("space.name", "The name of the problem.", key="problem"),
        *OF_SPACE,
        *(
            Of("is_feasible", key="feasible"),
            "unread",
            "breaches",
            "decisions",
            "flows",
            "processors",
            "buses",
            "resources",
        ),
        *(Of("metric_values", key="metrics"), "verdicts", "contended", "boundaries", "warnings", "overheads"),
        "responses",
        "messages",
    )

    space: Space
    design: Design
    decisions: Annotated[Mapping[str, str], "The chosen option of each open decision that matters in it."]
    flows: Annotated[tuple[FlowTable, ...], BY_NAME, "The contributors to the latency of each flow."]
    processors: Annotated[
        tuple[Usage, ...],
        "The utilisation of each processor.",
        Json(kind=Annotated[tuple[ProcessorUse, ...], BY_NAME]),
    ]
    buses: Annotated[tuple[Usage, ...], "The load of each bus.", Json(kind=Annotated[tuple[BusUse, ...], BY_NAME])]
    metrics: Mapping[str, Fraction]
    metric_units: Mapping[str, str]
    verdicts: Annotated[tuple[Verdict, ...], "Verdict and slack for each requirement.", Json("requirements")]
    warnings: Annotated[tuple[str, ...], "Warnings about the design that no requirement covers."] = ()
    breaches: Annotated[tuple[str, ...], "Reasons why the design is not valid; then the tables are empty."] = ()
    responses: Annotated[
        Mapping[str, tuple[Response, ...]],
        "The threads of each processor, where these were asked for.",
        Json("response_times"),
    ] = field(default_factory=dict)
    messages: Annotated[
        Mapping[str, tuple[MessageResponse, ...]],
        "The messages of each bus for which they wait.",
        Json(default={}),
    ] = field(default_factory=dict)
    resources: Annotated[
        tuple[ResourceUse, ...],
        "Under `osate-2.19`, where any is stated: the resource budgets of processors, partitions, memories and of all.",
        Json(default=[]),
    ] = ()
    boundaries: Annotated[
        tuple[Boundary, ...],
        "Every reader on the clock of the timer before it, where flows have some.",
        Json(default=[]),
    ] = ()
    contended: Annotated[
        Contended | None,
        "Verdict on the design with response times, where the question leaves them out.",
        Json("contention", default=None, kind=Contended),
    ] = None

    @property
    def metric_values(self) -> Annotated[Mapping[str, Any], Json(kind=Mapping[str, MetricValue])]:
        """The value and the unit of every metric.

        Names of metrics to mappings with ``value`` (exact) and ``unit``, in the form of JSON.
        """
        return {name: {"value": value, "unit": self.metric_units[name]} for name, value in self.metrics.items()}

    @property
    def numbered_decisions(self) -> Mapping[str, str]:
        """The decisions for readers, ``any (0xff)`` where a message takes any free identifier."""
        return self.decisions if self.breaches else numbered_texts(self.space, self.decisions, self.design)

    @property
    def overheads(self) -> Mapping[str, Sequence[str]]:
        """The overheads that response times count, with the threads or processors for which each is stated.

        Keys are *blocking*, *context switches*, *interrupts* and *throttling*; names are in the order of the file,
        empty where the problem states none.
        """
        return stated_overheads(self.space, self.design)

    @property
    def unread(self) -> Annotated[tuple[UnreadFlow, ...], Json(default=[])]:
        """The flows of the model that its import could not follow: a requirement on one is not known to hold."""
        return self.space.unread

    @property
    def is_feasible(self) -> bool:
        """Whether the design is valid and meets every requirement, those on flows that could not be read included.

        A requirement on something that the import could not follow counts as violated, because it is not known to hold.
        """
        return not self.breaches and not self.space.unchecked and all(verdict.holds for verdict in self.verdicts)

    def limits_empty_slot(self, verdict: Verdict) -> bool:
        """Whether a requirement holds because what it limits is left empty, or of a type without such a limit.

        Such a requirement holds without saying anything, and tables do not call it the tightest.
        """
        metric = verdict.requirement.metric
        slots = {"utilisation": self.processors, "load": self.buses, "busy": self.buses}.get(metric.kind)
        if slots is None or not verdict.holds:
            return False
        usage = slots[metric.index or 0]
        return usage.type == EMPTY or self.is_of_other_type(verdict)

    def is_of_other_type(self, verdict: Verdict) -> bool:
        """Whether a limit is implied by other types of a bus than the chosen one, which has none.

        True only for implied limits on load or busy time: the chosen type of the bus has no bandwidth, or is not
        exclusive.
        """
        metric, number = verdict.requirement.metric, verdict.requirement.metric.index or 0
        if not verdict.requirement.implied or metric.kind not in ("load", "busy") or self.buses[number].type == EMPTY:
            return False
        if metric.kind == "busy":
            return not at(self.space.buses[number].exclusive, View(self.design))
        return self.buses[number].capacity is None

    def _verdict(self) -> str:
        """Whether it is a valid design, and how many requirements it violates."""
        if self.breaches:
            return "not a valid design"
        violated = sum(not verdict.holds for verdict in self.verdicts)
        return f"violates {violated} of {len(self.verdicts)} requirements" if violated else "meets every requirement"

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The design as a frame of one row, with the columns of `Result.frame`.

        Columns: each metric as ``NAME [UNIT]``, each decision by name (text); `units` as for `Result.frame`.
        """
        columns = [*self.metrics, *self.decisions]
        row = {**{name: whole(value) for name, value in self.metrics.items()}, **self.decisions}
        return unit_frame(columns, [row] if self.metrics else [], self.metric_units, units, self.space.currency)

    def flow_frame(self, name: str, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A flow's contributor table, in order.

        Columns: ``category``, ``contributor``, ``min [ms]``, ``min_method``, ``max [ms]``, ``max_method``; `units` as
        for `Result.frame`.

        Raises
        ------
        UsageError
            when there is no such flow, or no such unit.
        """
        from dse.answers.forms.codec import written

        table = next((table for table in self.flows if table.name == name), None)
        if table is None:
            raise UsageError(f"no flow is called {name!r}: there are {', '.join(flow.name for flow in self.flows)}")
        names = {"min_ns": "min", "max_ns": "max"}
        rows = (written(Row, row) for row in table.rows)
        named = [{names.get(column, column): value for column, value in row.items()} for row in rows]
        return unit_frame([*dict.fromkeys(chain(*named))], named, {"min": "ns", "max": "ns"}, units)


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
        messages={
            space.buses[number].name: tuple(message_responses(space, number, view))
            for number in counted_buses(space)
            if space.buses[number].types[view[space.buses[number].type_decision]] != EMPTY
        },
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
    """The usage of a processor, with the core of each thread that runs on it."""
    threads = {term.label: term.component for term in terms}
    placed = {label: cores[threads[label]] for label in usage.shares if threads[label] in cores}
    return replace(usage, cores=placed)


def _warnings(
    space: Space, flows: Sequence[FlowTable], processors: Sequence[Usage], buses: Sequence[Usage]
) -> list[str]:
    """Warnings about the design that no requirement covers."""
    warnings = []
    for flow, table in zip(space.flows, flows, strict=True):
        if flow.required_ns is not None and table.min_ns < flow.required_ns[0]:
            warnings.append(f"{flow.name}: the minimum latency is below the required minimum")
    for usage in (*processors, *buses):
        if usage.capacity is not None and usage.total > usage.capacity:
            warnings.append(f"{usage.name} is overloaded: it has less capacity than it would use")
    return warnings
