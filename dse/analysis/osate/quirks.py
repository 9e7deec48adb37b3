"""Where OSATE's own quirks act (osate.md, A9), each with the figure without it where it changes a total.

They are copied under the OSATE profiles, so that the figures agree; an engineer should know where.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from dse.analysis.latency.rows import in_flow
from dse.analysis.osate.components import EXECUTING, OLD, is_sampling
from dse.analysis.osate.latency import (
    FlowPosition,
    crossed,
    is_rounded_to_bus,
    place_rows,
    place_step,
    places_of,
    rivals,
    waiting_for_ns,
)
from dse.analysis.osate.media import media
from dse.analysis.views import View
from dse.space.model.flows import Flow
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import Exact, format_duration


def quirks(space: Space, view: View) -> Iterator[str]:
    """Every place of every flow where a quirk acts, in words.

    Sentences; none under the profile *dse*. Each has the total without the quirk, where that differs.
    """
    if space.profile == "dse":
        return
    for flow in space.flows:
        yield from _unlinked(space, flow, view)
        yield from _waits_elsewhere(space, flow, view)
        for place in places_of(space, flow):
            yield from _early_deadline(space, flow, place, view)
            yield from _partition(space, flow, place, view)
            yield from _bus_period(space, flow, place, view)
            yield from _shared_data(space, flow, place, view)


def _total_ns(space: Space, flow: Flow, view: View) -> tuple[Exact, Exact]:
    """The least and most of a flow."""
    rows = [row for place in places_of(space, flow) for row in place_rows(space, place, view)]
    return sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)


def _instead(space: Space, flow: Flow, view: View) -> str:
    least, most = _total_ns(space, flow, view)
    return f"{format_duration(least)} .. {format_duration(most)}"


def _with_flow(space: Space, flow: Flow, *, last: bool = False) -> Space:
    """The problem with another form of a flow, behind all others where it is to be the last."""
    others = [item if item.name != flow.name else flow for item in space.flows]
    if last:
        others = [item for item in others if item is not flow] + [flow]
    return replace(space, flows=tuple(others))


def _unlinked(space: Space, flow: Flow, view: View) -> Iterator[str]:
    """Q1: in a flow of flows the connection before an element is lost, and with it sampling and queues."""
    if not any(step.unlinked for step in flow.steps):
        return
    linked = replace(flow, steps=tuple(replace(step, unlinked=False) for step in flow.steps))
    there = _with_flow(space, linked)
    if _total_ns(there, linked, view) != _total_ns(space, flow, view):
        figures = _instead(there, linked, view)
        lost = f"{flow.name} is composed of other flows, where OSATE counts no sampling and no queues"
        yield f"{lost}: with them it takes {figures}"


def _waits_elsewhere(space: Space, flow: Flow, view: View) -> Iterator[str]:
    """Q2: a connection of several flows waits for its bus in the last of them only."""
    other = _with_flow(space, flow, last=True)
    here = _total_ns(space, flow, view)
    if _total_ns(other, flow, view) == here:
        return
    wires = []
    for place in places_of(other, flow):
        step = place_step(other, place)
        waits = step.kind == "connection" and any(
            waiting_for_ns(other, place, rival, view) for rival in rivals(other, place)
        )
        if waits and not rivals(space, FlowPosition(space.flows.index(flow), place.position)):
            wires.append(space.connections[step.index].name)
    figures = _instead(other, flow, view)
    lost = f"OSATE counts the bus queue of {_listed(wires)} in the last flow over it alone"
    yield f"{lost}: with it {flow.name} takes {figures}"


def _early_deadline(space: Space, flow: Flow, place: FlowPosition, view: View) -> Iterator[str]:
    """Q6: a deadline below the execution time stands for it."""
    step = place_step(space, place)
    if step.kind != "component" or space.worst_case != "deadline":
        return
    component = space.components[step.index]
    component = in_flow(space, component, step, is_periodic=is_sampling(space, component, view))
    row, execution = place_rows(space, place, view)[-1], at(component.execution_ns, view)
    if component.category in EXECUTING and row.max_method == "deadline" and execution and execution[1] > row.max_ns:
        worst, deadline = format_duration(execution[1]), format_duration(row.max_ns)
        most = format_duration(_total_ns(space, flow, view)[1] + execution[1] - row.max_ns)
        said = f"{component.name} takes up to {worst}, OSATE counts its deadline of {deadline}"
        yield f"{said}: with the execution time {flow.name} takes up to {most}, as far as nothing behind it rounds up"


def _partition(space: Space, flow: Flow, place: FlowPosition, view: View) -> Iterator[str]:
    """Q4, Q5: what starts in a partition, and the period of a task behind its partition's."""
    step = place_step(space, place)
    if step.kind != "component":
        return
    component = space.components[step.index]
    if component.partition is None or not is_sampling(space, component, view):
        return
    if not place.position and space.profile != OLD:
        yield (
            f"{flow.name} starts with {component.name}, which is periodic: OSATE does not take its partition "
            f"{component.partition.name} for the beginning"
        )
    row = place_rows(space, place, view)[0]
    before = FlowPosition(place.flow, place.position - 1)
    entered = crossed(space, place_step(space, before))[1] if place.position else None
    if entered is not None and row.min_ns and row.min_method.endswith("sampling"):
        least = format_duration(_total_ns(space, flow, view)[0] - row.min_ns)
        said = (
            f"{component.name} samples behind its partition {entered.name}: OSATE adds {format_duration(row.min_ns)} to"
        )
        yield f"{said} the minimum of {flow.name} as well, which is {least} without it"


def _bus_period(space: Space, flow: Flow, place: FlowPosition, view: View) -> Iterator[str]:
    """Q7: in a synchronous system the period of a bus is added whole, at both ends."""
    step = place_step(space, place)
    if step.kind != "connection" or not is_rounded_to_bus(space, place, view):
        return
    wire = space.connections[step.index]
    periods = [at(space.buses[item.bus].period_ns, view) or 0 for item in media(space, wire, view)]
    period = sum(periods)
    if period:
        what = "period" if sum(map(bool, periods)) == 1 else "periods, in all"
        least = format_duration(_total_ns(space, flow, view)[0] - period)
        said = f"OSATE adds the {what} {format_duration(period)} of what carries {wire.name} to the minimum as well"
        yield f"{said}, for it takes the system for synchronous: without it {flow.name} takes at least {least}"


def _shared_data(space: Space, flow: Flow, place: FlowPosition, view: View) -> Iterator[str]:
    """Q10: what a periodic component reads of shared data waits for its timer, of which nothing is counted."""
    step = place_step(space, place)
    if step.kind != "component" or step.via is None or space.profile == OLD:
        return
    wire, reader = space.connections[step.via], space.components[step.index]
    if wire.port != "data_access" or not is_sampling(space, reader, view):
        return
    wires = [replace(item, port="data") if item is wire else item for item in space.connections]
    figures = _instead(replace(space, connections=tuple(wires)), flow, view)
    lost = f"OSATE counts no sampling of data that {reader.name} has access to"
    yield f"{lost}: with it, as of a data port, {flow.name} takes {figures}"


def _listed(names: Sequence[str]) -> str:
    names = list(dict.fromkeys(names))
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)
