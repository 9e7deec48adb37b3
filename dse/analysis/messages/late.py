"""Why a message is late: what goes before it, and the identifier or priority with which it would be in time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from dse.analysis.limits import Verdict
from dse.analysis.messages.assignment import Candidate, is_in_time
from dse.analysis.messages.stages import (
    bus_of,
    candidates_of,
    carried_by,
    faults_on,
    in_order,
    message_key,
    wrapping_ns,
)
from dse.analysis.messages.waits import MessageResponse, message_responses
from dse.analysis.scheduling.model import NO_PROCESSOR
from dse.analysis.scheduling.policies import buses
from dse.analysis.scheduling.policies.buses import Arbitrated
from dse.analysis.scheduling.policies.successions import sources_in
from dse.analysis.scheduling.responses import UNBOUNDED_NS, message_waits_ns, messages_of
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.spec.schema.fields import MOST_CLASS
from dse.support.json_fields import Json
from dse.support.units import Exact


@dataclass(frozen=True)
class LateMessage:
    """A message that ends too late, or waits in a flow that does, and the identifier or priority that would do."""

    WRITTEN = ("bus", "message", "flow", "limit_ns", "late_ns", "before", "identifier", "priority", "makes_late")

    bus: Annotated[str, "Its bus."]
    message: Annotated[MessageResponse, "How long it takes at most, and what it waits for."]
    limit_ns: Annotated[
        Fraction, "The limit that it misses; in a flow the response time with which that would keep its limit."
    ]
    late_ns: Annotated[Exact | None, "How long after its limit it ends; null where it has no bound."]
    before: Annotated[
        str | None,
        "The message right before which it would be in time, the others in their order; null where none is, or "
        "identifiers do not decide.",
    ] = None
    identifier: Annotated[int | None, "A free identifier for that; null where there is none between the others."] = None
    makes_late: Annotated[tuple[str, ...], "The messages that would be late then and are not now."] = ()
    priority: Annotated[
        int | None,
        "On Ethernet the least priority with which it would be in time; missing elsewhere.",
        Json(default=None),
    ] = None
    flow: Annotated[str, "The limit of the flow in which it waits; empty where it misses one of its own."] = ""


OF_FLOWS = ("latency", "jitter", "reaction time", "data age")
"""Metrics of a flow that are so much less as one of its messages waits less."""


def late_messages(space: Space, verdicts: Sequence[Verdict], view: View) -> Iterator[LateMessage]:
    """The messages of a whole design that miss upper limits on their response times, or wait in flows that miss limits.

    Of a flow each message that waits, with the time by which the flow misses its limit.
    """
    for verdict in verdicts:
        requirement, number = verdict.requirement, verdict.requirement.metric.index or 0
        if verdict.holds or not requirement.is_upper:
            continue
        if requirement.metric.kind == "message response":
            bus = bus_of(space, number, view)
            if bus is not None:
                rest = verdict.limit - wrapping_ns(space, number, bus, view)[1]
                yield _late(space, number, view, rest, verdict.limit)
        elif requirement.metric.kind in OF_FLOWS and verdict.value < UNBOUNDED_NS:
            excess = verdict.value - verdict.limit
            for step in space.flows[number].steps:
                found = _found(space, step.index, view) if step.kind == "connection" else None
                response = None if found is None else found[1].response_ns
                if found is not None and response is not None and response > found[1].transmission_ns[1]:
                    waits_ns = message_waits_ns(space, step.index, view, has_source=step.has_source)
                    rest = found[1].transmission_ns[1] + waits_ns - excess
                    yield _late(space, step.index, view, rest, rest, requirement.shown, has_source=step.has_source)


def _found(space: Space, number: int, view: View) -> tuple[int, MessageResponse] | None:
    """The bus for which the message of a connection waits in a design, and what it waits for; None where none is."""
    bus = bus_of(space, number, view)
    if bus is None:
        return None
    name = space.connections[message_key(space, number, view)[0]].name
    return bus, next(item for item in message_responses(space, bus, view) if item.name == name)


def _late(
    space: Space,
    number: int,
    view: View,
    rest: Exact,
    limit: Exact,
    flow: str = "",
    *,
    has_source: bool = False,
) -> LateMessage:
    """A message whose response time on its bus, or lag where it `has_source`, is more than what is left for it.

    `limit` is that of all that carries it; `flow` the limit of a flow that it is in.
    """
    found = _found(space, number, view)
    assert found is not None
    bus, message = found
    first, late = message_key(space, number, view)[0], None
    if message.response_ns is not None:
        waits_ns = message_waits_ns(space, number, view, has_source=has_source)
        late = message.transmission_ns[1] + waits_ns - rest
    name = space.buses[bus].name
    if message.priority is not None:
        priority, makes_late = _priority_for(space, bus, first, rest, view)
        return LateMessage(name, message, Fraction(limit), late, makes_late=makes_late, priority=priority, flow=flow)
    before, identifier, makes_late = _place_for(space, bus, first, rest, view, has_source=has_source)
    return LateMessage(name, message, Fraction(limit), late, before, identifier, makes_late, flow=flow)


def _priority_for(space: Space, bus: int, number: int, limit: Exact, view: View) -> tuple[int | None, tuple[str, ...]]:
    """The least higher priority with which a message is in time, and what is late then; None where none is."""
    solution = messages_of(space, view)
    resource = next(item for item in solution.system.resources if (item.processor, item.core) == (NO_PROCESSOR, bus))
    tasks = {entry.key: solution.windows.events.task(entry.key) for entry in resource.entries}
    carried = carried_by(space, bus, view)
    classes = {one: at(space.connections[one].priority, view) for one in carried}
    known = dict(zip(carried, candidates_of(space, bus, view, lambda _: tasks), strict=True))

    def late_with(priority: int) -> set[int]:
        """The messages that miss their limits where this one has a priority."""
        given = {**classes, number: priority}
        order = sorted(carried, key=lambda one: -given[one])
        changed = in_order(space, bus, order, view, classes=given)
        jobs = [tasks[one, "message"] for one in order]
        found = set()
        for place, one in enumerate(order):
            window = buses.window_of(changed, place, jobs)
            response = None if window is None else window.response_ns()
            most = limit if one == number else known[one].limit_ns
            if most is not None and (response is None or response > most):
                found.add(one)
        return found

    before = late_with(classes[number])
    for priority in range(classes[number] + 1, MOST_CLASS + 1):
        after = late_with(priority)
        if number not in after:
            return priority, tuple(space.connections[one].name for one in sorted(after - before))
    return None, ()


def _place_for(
    space: Space, bus: int, number: int, limit: Exact, view: View, *, has_source: bool
) -> tuple[str | None, int | None, tuple[str, ...]]:
    """The message right before which another is in time, a free identifier there, and what is late then."""
    solution = messages_of(space, view)
    resource = next(item for item in solution.system.resources if (item.processor, item.core) == (NO_PROCESSOR, bus))
    wire = resource.wire
    if wire is None or not wire.identifiers:
        return None, None, ()
    tasks = {entry.key: solution.windows.events.task(entry.key) for entry in resource.entries}
    known = dict(zip(carried_by(space, bus, view), candidates_of(space, bus, view, lambda _: tasks), strict=True))
    order = [entry.key[0] for entry in resource.entries]
    own, faults = order.index(number), faults_on(space, bus, view)
    first = sources_in(solution.system).get((number, "message")) if has_source else None
    source = None if first is None else solution.windows.events.source_task(first)

    def is_kept(message: int, order: Sequence[int], limit_ns: Exact | None) -> bool:
        place = order.index(message)
        if wire.lines:  # of a queue each message counts where the last one is
            jobs = [tasks[one, "message"] for one in order]
            window = buses.window_of(in_order(space, bus, order, view), place, jobs)
            response = None if window is None else window.response_ns()
            return limit_ns is None or (response is not None and response <= limit_ns)
        mine, behind = known[message], max((known[other].section_ns for other in order[place + 1 :]), default=0)
        if message == number and source is not None:
            window = buses.window_of(in_order(space, bus, order, view), place, [tasks[one, "message"] for one in order])
            assert window is None or isinstance(window, Arbitrated)
            lag = None if window is None else window.counted_from(source).response_ns()
            return limit_ns is None or (lag is not None and lag <= limit_ns)
        made = Candidate(mine.task, mine.last_ns, mine.section_ns, limit_ns, None, mine.is_on_flow)
        return is_in_time(made, [known[other] for other in order[:place]], behind, wire.bit_ns, faults)

    for place in reversed(range(own)):
        moved = [*order[:place], number, *order[place:own], *order[own + 1 :]]
        if not is_kept(number, moved, limit):
            continue
        others = order[place:own] if not wire.lines else [other for other in order if other != number]
        late = [
            other
            for other in others
            if is_kept(other, order, known[other].limit_ns) and not is_kept(other, moved, known[other].limit_ns)
        ]
        least = wire.identifiers[place - 1] + 1 if place else 0
        free = wire.identifiers[place] - 1
        names = tuple(space.connections[other].name for other in late)
        return space.connections[order[place]].name, free if free >= least else None, names
    return None, None, ()
