"""Remarks of `check` on threads that several inputs dispatch, and on threads that drop what comes.

docs/semantics.md, section 3.8.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor

from dse.analysis.latency.contributors import flow_rows
from dse.analysis.latency.joined_inputs import may_wait_for_inputs
from dse.analysis.latency.processing import processing_row
from dse.analysis.latency.rows import JOIN_METHOD, has_no_bound
from dse.analysis.rates import NS_PER_S, arrivals, dispatch, is_joined, is_periodic, kept_jobs, may_poll, polls, rate_hz
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.views import View
from dse.space.architecture.activation import may_be_event_triggered
from dse.space.architecture.joins import ALL, LATEST, may_join
from dse.space.model.flows import Flow
from dse.space.model.space import Component, Space
from dse.space.model.trees import at, leaves
from dse.support.units import format_duration, format_rate, shown
from dse.support.units.text import first_of

SHOWN = 3
"""The greatest number of threads, and of inputs of a thread, that are named."""


def unsaid_joins(space: Space) -> Iterator[str]:
    """Threads that several inputs dispatch, of which the file does not say whether a job needs all of them.

    At most one sentence, which names every such thread with its inputs; only under the profile *dse*.
    """
    joins = [
        f"{item.stated_as} ({first_of([space.connections[wire].name for wire in item.triggers], SHOWN)})"
        for item in space.components
        if item.section == "threads" and len(item.triggers) > 1 and item.join is None and may_be_event_triggered(item)
    ]
    if joins and space.profile == "dse":
        yield (
            f"each message of any of several inputs is a job of {first_of(joins, SHOWN)}: state `join: all` where "
            "a job needs one of each, else `join: any`"
        )


def drifting_joins(space: Space) -> Iterator[str]:
    """Joins of all in which all messages wait, in order, of timers that may drift apart or have unknown offsets.

    One sentence for each such join, with what to state.
    """
    for component in space.components:
        if not may_join(component) or set(leaves(component.pairing)) == {LATEST} or _has_room(space, component):
            continue
        timers = [space.components[number] for number in sorted(_timers(space, component))]
        clocks = {_clock(item) or item.name for item in timers}
        names = first_of([item.stated_as for item in timers], SHOWN)
        if len(clocks) > 1:
            yield (
                f"{component.stated_as} pairs messages in the order of arrival, and {names} run on clocks of their "
                "own: where these drift apart the queue of the faster one grows; state a `queue_size`, or `pairing: "
                "latest`, for a bound that needs no equal rates"
            )
        elif len(timers) > 1 and not all(_has_offset(item) for item in timers):
            yield (
                f"{component.stated_as} pairs messages in the order of arrival, and {names} run on one clock with "
                "unknown offsets; stating each `offset` may shorten the wait for inputs"
            )


def unread_rooms(space: Space) -> Iterator[str]:
    """Hybrid joins of all that state which messages they pair, or how many wait, which their timer does not look at.

    One sentence for each thread that is hybrid in every design, with the fields.
    """
    for component in space.components:
        if set(leaves(component.join)) != {ALL} or set(leaves(component.protocol)) != {"hybrid"}:
            continue
        wires = [space.connections[wire] for wire in component.triggers]
        sizes = {f"{wire.name}.queue_size": wire.queue_size for wire in wires}
        sizes[f"{component.stated_as}.queue_size"] = component.queue_size
        fields = [name for name, size in sizes.items() if set(leaves(size)) != {None}]
        fields += [f"{component.stated_as}.pairing"] if set(leaves(component.pairing)) - {None, LATEST} else []
        if fields:
            yield (
                f"{first_of(fields, SHOWN)}: not counted, for the timer of the hybrid thread {component.stated_as} "
                "takes all messages that have come since it published last"
            )


def endless_waits(space: Space, view: View) -> Iterator[str]:
    """The reasons why a message of a flow may wait for other inputs without a bound, in a design.

    One sentence for each cause, over all flows.
    """
    yield from dict.fromkeys(text for flow in space.flows for text in _endless(space, flow, view))


def dropping(space: Space, view: View) -> Iterator[str]:
    """Sporadic threads of a design to which messages come more often than they may take them.

    One sentence for each thread, with both rates in Hz.
    """
    for number, component in enumerate(space.components):
        rule = dispatch(component, view)
        if rule.most is None or not rule.by_inputs or rule.own or not arrivals(component, view).is_separated:
            continue
        coming = rate_hz(space, (rule.arriving, number), view)
        if space.profile == "dse" and coming > rule.most:
            rate, most = format_rate(coming), format_rate(rule.most)
            yield f"{component.stated_as} drops messages: they come at {rate}, and it is sporadic, at most {most}"


def skipping(space: Space, view: View) -> Iterator[str]:
    """Timers of a design that skip releases in executors that poll, how often at most, and topics that drop messages.

    Response times tell for how long a job waits: of a design in which these are not counted nothing is known.
    """
    for number, component in enumerate(space.components):
        if not may_poll(space, component) or not polls(space, component, view):
            continue
        home = space.executors[at(component.executor, view)].name
        room = kept_jobs(space, component, "thread", view)
        execution = at(component.execution_ns, view)
        if room is None or execution is None:
            continue
        waits = processing_row(space, component, view).max_ns - execution[1]
        if waits >= UNBOUNDED_NS:
            continue
        rate = rate_hz(space, ("activation", number), view)
        most = floor(waits * rate / NS_PER_S)
        if is_periodic(component, view) and most:
            yield (
                f"{component.stated_as} may skip {most} of {most + 1} releases: a job of it waits for up to "
                f"{format_duration(ceil(waits))} in {shown(home)}, and a release that comes meanwhile is skipped"
            )
        elif most >= room:
            kept = "the last" if room == 1 else f"the last {room}"
            yield (
                f"{component.stated_as} may drop messages: a job of it waits for up to {format_duration(ceil(waits))} "
                f"in {shown(home)}, they come at {format_rate(rate)}, and its queue keeps {kept}"
            )


def _endless(space: Space, flow: Flow, view: View) -> Iterator[str]:
    unbounded = {
        row.contributor
        for row in flow_rows(space, flow, view)
        if row.max_method.startswith(JOIN_METHOD) and has_no_bound(row)
    }
    for step in flow.steps:
        if not may_wait_for_inputs(space, step):
            continue
        component = space.components[step.index]
        if component.name not in unbounded or not is_joined(component, view):
            continue
        rates = {wire: rate_hz(space, ("delivery", wire), view) for wire in component.triggers}
        slowest = min(component.triggers, key=lambda wire: rates[wire])
        own = step.via
        assert own is not None
        begin = f"messages of {space.connections[own].name} wait at {component.stated_as} without a bound"
        if rates[own] > rates[slowest]:
            fast, slow = format_rate(rates[own]), format_rate(rates[slowest])
            yield (
                f"{begin}: they come at {fast}, those of {space.connections[slowest].name} at {slow}, and none is "
                "dropped; state a `queue_size`, or `pairing: latest`"
            )
        else:
            yield (
                f"{begin}: not every input comes from timers one by one, without losses on the way; state a "
                "`queue_size`, or `pairing: latest`"
            )


def _has_room(space: Space, component: Component) -> bool:
    """Whether the room of each input is stated in every design, or its timer takes all that has come."""
    if set(leaves(component.protocol)) == {"hybrid"}:
        return True
    sizes = [space.connections[wire].queue_size for wire in component.triggers]
    return None not in set(leaves(component.queue_size)) or all(None not in set(leaves(size)) for size in sizes)


def _timers(space: Space, component: Component) -> set[int]:
    """The timers that messages of its triggers may come from, by number."""
    timers: set[int] = set()
    seen: set[int] = set()
    todo = [space.connections[wire].sender for wire in component.triggers]
    while todo:
        number = todo.pop()
        if number is None or number in seen:
            continue
        seen.add(number)
        sender = space.components[number]
        if may_be_event_triggered(sender) and sender.triggers:
            todo += [space.connections[wire].sender for wire in sender.triggers]
        else:
            timers.add(number)
    return timers


def _clock(component: Component) -> str:
    """The clock on which a component always runs, with any offset; "" where there is none, or not one for all."""
    readings = set(leaves(component.clock))
    if None in readings:
        return ""
    names = {reading.name or reading.member for reading in readings}
    return names.pop() if len(names) == 1 else ""


def _has_offset(component: Component) -> bool:
    """Whether the first release of a component on its clock is known in every design."""
    return component.offset_ns is not None and None not in set(leaves(component.offset_ns))
