"""Every figure of one design: contributor tables, processor and bus shares, metrics, verdicts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from dse.analysis.boundaries import boundaries
from dse.analysis.contention import cores_of
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency import flow_rows
from dse.analysis.measures import loaded_buses
from dse.analysis.osate_findings import CURRENT, flow_findings, specified_rows
from dse.analysis.osate_load import bus_budget
from dse.analysis.osate_quirks import quirks
from dse.analysis.osate_resources import resource_uses
from dse.analysis.remarks import design_remarks
from dse.analysis.resources import busy_terms, load_terms, payload_terms, utilisation_terms
from dse.analysis.scheduling import Response, processor_responses
from dse.analysis.terms import PPM, Term
from dse.analysis.views import View
from dse.results.analyse import Analysis, FlowTable, Usage
from dse.results.solve import decisions_of
from dse.space.frames import frame_at
from dse.space.metrics import busy_obstacle
from dse.space.steps import Flow
from dse.space.trees import at
from dse.space.types import EMPTY, Design, Processor, Slot, Space
from dse.timelimit import in_time


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
