"""Inputs that must all be there: a message waits for those of the other triggers (docs/semantics.md, section 3.8).

A job of a component that joins all its triggers takes a message of each. There are two bounds of how long one waits:

* *In order*: where no message is lost, and each input comes from timers of its own, the k-th job takes the k-th message
  of each. What came of the k-th releases is there at the latest of the latest times after these.
* *By its queue*: an input with room for q messages, of which the oldest make place for new ones, is served after q jobs
  at most, and a job comes no later than the longest time between two messages of the slowest other input.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import reduce
from typing import NamedTuple, TypeAlias

from dse.analysis.latency.deliveries import delivery_ns
from dse.analysis.latency.processing import callback_ns, skipped_ns
from dse.analysis.latency.rows import JOIN_METHOD, UNBOUNDED_JOIN, Row, counts_responses
from dse.analysis.latency.stored_inputs import message_gap_ns, pieces_until, processing_ns, senders
from dse.analysis.rates import NS_PER_S, arrivals, input_room, is_joined, is_periodic, passes_rates_on, rate_hz
from dse.analysis.scheduling.responses import NO_BOUND, UNBOUNDED_NS
from dse.analysis.views import View
from dse.space.architecture.joins import may_join
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.units import Exact, picked


class Origin(NamedTuple):
    """A timer, or a connection from outside, whose k-th release makes the k-th event of something.

    `kind` is ``component`` or ``connection``, `number` which one. The event comes no sooner than `least_ns` after that
    release, and no later than `most_ns` after that of the latest of its origins.
    """

    kind: str
    number: int
    period_ns: Exact
    least_ns: Exact = 0
    most_ns: Exact = 0

    def later(self, least_ns: Exact, most_ns: Exact) -> Origin:
        """The origin of what comes so much later.

        A new origin; both times are in ns and added to its range.
        """
        return self._replace(least_ns=self.least_ns + least_ns, most_ns=self.most_ns + most_ns)


Origins: TypeAlias = "tuple[Origin, ...] | None"
"""All origins of an event; None where events may be lost, or are not those of the releases one by one."""


def may_wait_for_inputs(space: Space, step: Step) -> bool:
    """Whether an element of a flow is a component that waits for its other inputs, in some design.

    Only under the profile *dse*, for ``join: all``.
    """
    if step.kind != "component" or step.via is None or space.profile != "dse":
        return False
    component = space.components[step.index]
    return may_join(component) and step.via in component.triggers


def joined_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """The row of the wait for other inputs, of a component that needs all of them; else None.

    Times in ns; `UNBOUNDED_NS` where a message may wait for ever (docs/semantics.md, section 3.8).
    """
    if not may_wait_for_inputs(space, step) or not is_joined(component, view):
        return None
    if not passes_rates_on(component, view):
        return None
    join = Join(space, step.index, view)
    most, last, _ = join.longest_wait(step)
    least = join._shortest_wait(step)
    method = f"{JOIN_METHOD}{join._name_of(last)}"
    if most >= UNBOUNDED_NS:
        return Row(component.category, component.name, least, method, NO_BOUND, method + UNBOUNDED_JOIN)
    return Row(component.category, component.name, least, method, most, method)


def is_paired(space: Space, step: Step, component: Component, view: View) -> bool:
    """Whether a flow comes to the latest release of a component that takes messages of all its inputs in order.

    What its job takes counts from there, where response times count (docs/semantics.md, section 3.8).
    """
    if not counts_responses(space) or step.figures is not None or not may_wait_for_inputs(space, step):
        return False
    if not is_joined(component, view) or not arrivals(component, view).by_inputs:
        return False
    return Join(space, step.index, view).longest_wait(step)[2]


class Join:
    """The inputs of a component that needs all of them, in a design.

    `wires` are its trigger connections; rooms and gaps of queues give the longest wait.
    """

    def __init__(self, space: Space, number: int, view: View) -> None:
        self.space, self.number, self.view = space, number, view
        self.component = space.components[number]
        self.wires = self.component.triggers

    def _name_of(self, wire: int) -> str:
        """The sender of the messages of an input: a component, or the connection where they come from outside."""
        connection = self.space.connections[wire]
        return connection.name if connection.source is None else self.space.components[connection.source].stated_as

    def room(self, wire: int) -> int | None:
        """The greatest number of messages of an input that wait; None where the queue has no limit.

        The queue size of the input in messages.
        """
        return input_room(self.space, self.component, wire, self.view)

    # --- bounds of a wait ---------------------------------------------------------------------------------------

    def longest_wait(self, step: Step) -> tuple[Exact, int, bool]:
        """The longest wait of a message of the input of a step, the input that it waits for, and whether in order.

        A time in ns, a connection's index, and whether of two bounds that by the order of arrival is no more than that
        by queues: then the flow has come to the latest release of the component's job.
        """
        own = step.via
        assert own is not None
        others = [wire for wire in self.wires if wire != own]
        longest: tuple[Exact, int] = NO_BOUND, others[0]
        size = self.room(own)
        if size is not None:
            gaps = [(self._gap_ns(wire), wire) for wire in others]
            slowest = _first_of(gaps)
            longest = (NO_BOUND if slowest[0] >= UNBOUNDED_NS else size * slowest[0]), slowest[1]
        ways = _origins_of(self.space, self.number, self.view)
        if ways is None or not self._is_in_order(ways):
            return *longest, False
        in_order = self._in_order(step, ways)
        is_paired = in_order[0] <= longest[0] and in_order[0] < UNBOUNDED_NS
        return *(in_order if in_order[0] < longest[0] or size is None else longest), is_paired

    def _shortest_wait(self, step: Step) -> Exact:
        """How long a message of the input of a step waits at least: more than 0 where it always comes before others.

        It is known where every input comes from a timer at once, so that nothing on the way may lose messages, and no
        input makes place for new ones: it depends on no response time.
        """
        if any(self.room(wire) is not None for wire in self.wires) or any(map(self._comes_by_others, self.wires)):
            return 0
        start = _start_of(self.space, step, self.view)
        ways = None if start.is_late or start.has_figures else _origins_of(self.space, self.number, self.view)
        if ways is None or step.via is None:
            return 0
        own, together = ways[step.via], [origin for way in ways.values() for origin in way]
        return self._soonest_ns(own[0], together) - self._soonest_ns(own[0], own)

    def _comes_by_others(self, wire: int) -> bool:
        """Whether the sender of an input works at the rate of inputs of its own."""
        source = self.space.connections[wire].source
        return source is not None and passes_rates_on(self.space.components[source], self.view)

    def _gap_ns(self, wire: int) -> Exact:
        gap = message_gap_ns(self.space, wire, self.view)
        least, most = callback_ns(self.space, self.component, self.view)
        return gap if gap >= UNBOUNDED_NS else gap + most - least

    def _is_in_order(self, ways: dict[int, tuple[Origin, ...]]) -> bool:
        """Whether no input ever has to make place for new messages before a job takes the old ones."""
        together = [origin for way in ways.values() for origin in way]
        if not arrivals(self.component, self.view).by_inputs:
            return False
        for wire, way in ways.items():
            size = self.room(wire)
            if size is not None and not any(
                (latest := self._latest_ns(origin, together)) is not None
                and latest - origin.least_ns < size * origin.period_ns
                for origin in way
            ):
                return False
        return True

    def _in_order(self, step: Step, ways: dict[int, tuple[Origin, ...]]) -> tuple[Exact, int]:
        """The wait of the k-th message for the k-th ones of the others."""
        assert step.via is not None
        own, together = ways[step.via], [origin for way in ways.values() for origin in way]
        start = _start_of(self.space, step, self.view)
        longest: tuple[Exact, int] = NO_BOUND, next(wire for wire in self.wires if wire != step.via)
        for origin in own:
            if not start.is_late and (origin.kind, origin.number) != start.origin:
                continue
            spread = start.spread_ns(self, origin)
            latest, there = self._latest_ns(origin, together), self._latest_ns(origin, own)
            if latest is None or there is None or spread is None:
                continue
            if latest >= UNBOUNDED_NS:
                continue
            there = self._soonest_ns(origin, own) if start.has_figures else there
            waits = latest - there + spread
            if waits < longest[0]:
                ends = [(self._latest_ns(origin, way) or 0, wire) for wire, way in ways.items() if wire != step.via]
                longest = waits, _first_of(ends)[1]
        return longest

    def _latest_ns(self, origin: Origin, origins: Iterable[Origin]) -> Exact | None:
        """How long after a release of an origin the event of these is there at the latest; None: no bound."""
        return latest_ns(self.space, origin, origins, self.view)

    def _soonest_ns(self, origin: Origin, origins: Iterable[Origin]) -> Exact:
        """How long after a release of an origin the event of these is there at the soonest."""
        return soonest_ns(self.space, origin, origins, self.view)


def latest_ns(space: Space, origin: Origin, origins: Iterable[Origin], view: View) -> Exact | None:
    """The longest time from the k-th release of an origin to the k-th event of `origins`, in ns; None: no bound."""
    times_ns: list[Exact] = []
    for other in origins:
        phase = _phase_ns(space, origin, other, view)[1]
        if phase is None:
            return None
        times_ns.append(phase + other.most_ns)
    return reduce(lambda one, two: picked("max", one, two), times_ns)


def soonest_ns(space: Space, origin: Origin, origins: Iterable[Origin], view: View) -> Exact:
    """The shortest time from the k-th release of an origin to the k-th event of `origins`, in ns."""
    times_ns: list[Exact] = [0]
    for other in origins:
        phase = _phase_ns(space, origin, other, view)[0]
        if phase is not None:
            times_ns.append(phase + other.least_ns)
    return reduce(lambda one, two: picked("max", one, two), times_ns)


def _first_of(candidates: Sequence[tuple[Exact, int]]) -> tuple[Exact, int]:
    """The longest time with what it is of, the first of equal ones."""
    best = candidates[0]
    for item in candidates[1:]:
        if item[0] > best[0]:
            best = item
    return best


# --- where a flow begins ----------------------------------------------------------------------------------------------


class Start(NamedTuple):
    """Where on its way to a join the time of a flow begins: at the release of an origin, or `is_late`.

    Then it does at the release of a component behind the timers, or where a message leaves; `releases` are its origins.
    """

    origin: tuple[str, int] | None
    is_late: bool = False
    releases: Origins = None
    has_figures: bool = False

    def spread_ns(self, join: Join, origin: Origin) -> Exact | None:
        """The difference between the latest and the soonest begin, from the release of an origin, in ns."""
        if not self.is_late:
            return 0
        if self.releases is None:
            return None
        if all((item.kind, item.number) != (origin.kind, origin.number) for item in self.releases):
            return None
        latest = latest_ns(join.space, origin, self.releases, join.view)
        return None if latest is None else latest - soonest_ns(join.space, origin, self.releases, join.view)


def _start_of(space: Space, step: Step, view: View) -> Start:
    """Where the way of a flow to a join begins: at the last timer before it, or behind that."""
    has_figures = any(item.figures is not None for item in step.before)
    for item in reversed(step.before):
        if item.kind != "component":
            continue
        component = space.components[item.index]
        if is_periodic(component, view):
            return Start(("component", item.index), has_figures=has_figures)
        if item.via is None or item.via not in component.triggers:
            return Start(None, True, _origins_at(space, item.index, view), has_figures)
    wire = step.before[0].index
    source = space.connections[wire].source
    if source is None:
        return Start(("connection", wire), has_figures=has_figures)
    return Start(None, True, _leaving(space, source, _origins_at(space, pieces_until(space, source)[0], view), view))


# --- what events come of ----------------------------------------------------------------------------------------------


def _phase_ns(space: Space, one: Origin, other: Origin, view: View) -> tuple[Exact | None, Exact | None]:
    """How much later than the k-th release of `one` the k-th of `other` is: at least and at most; None: no bound.

    All begin within a period of their own. Those of one clock with known offsets begin together.
    """
    if (one.kind, one.number) == (other.kind, other.number):
        return 0, 0
    least, most = _first_ns(space, one, other, view)
    if other.period_ns < one.period_ns:
        return None, most
    return least, (None if other.period_ns > one.period_ns else most)


def _first_ns(space: Space, one: Origin, other: Origin, view: View) -> tuple[Exact, Exact]:
    """The least and greatest time from the first release of `one` to the first release of `other`, in ns."""
    anyhow = -one.period_ns, other.period_ns
    if one.kind != "component" or other.kind != "component":
        return anyhow
    here, there = space.components[one.number], space.components[other.number]
    first = at(here.offset_ns, view)
    second = None if first is None else at(there.offset_ns, view)
    if first is None or second is None:
        return anyhow
    clocks = at(here.clock, view), at(there.clock, view)
    if clocks[0] is None or clocks[1] is None:
        return anyhow
    if clocks[0].member == clocks[1].member:
        error = 0
    elif clocks[0].name and clocks[0].name == clocks[1].name:
        error = clocks[0].error_ns
    else:
        return anyhow
    return second - first - error, second - first + error


def _origins_of(space: Space, number: int, view: View) -> dict[int, tuple[Origin, ...]] | None:
    """The origins of each input of a component; None where those of some are not known."""
    releases = _releases(space, number, view)
    ways = {wire: _delivered(space, wire, releases, view) for wire in space.components[number].triggers}
    return None if any(way is None for way in ways.values()) else {wire: way or () for wire, way in ways.items()}


def _origins_at(space: Space, number: int, view: View) -> Origins:
    """The origins of the releases of a component."""
    releases = _releases(space, number, view)
    return _released(space, number, releases, view)


def _releases(space: Space, number: int, view: View) -> dict[int, Origins]:
    """The origins of the releases of all components before one, by number."""
    origins: dict[int, Origins] = {}
    todo, begun = senders(space, number, view), {number}
    while todo:
        top = todo[-1]
        missing = [item for item in senders(space, top, view) if item not in origins] if top not in origins else []
        if not missing:
            if top not in origins:
                origins[top] = _released(space, top, origins, view)
            todo.pop()
        elif top in begun:
            origins[top] = None
        else:
            begun.add(top)
            todo += missing
    return origins


def _released(space: Space, number: int, origins_of: dict[int, Origins], view: View) -> Origins:
    """The origins of the releases of a component, from those of the components before it."""
    component = space.components[number]
    if not passes_rates_on(component, view):
        is_whole = not skipped_ns(space, number, view)
        return (Origin("component", number, at(component.period_ns, view)),) if is_whole else None
    if is_periodic(component, view):
        return None  # a release goes on where all have come
    joins = is_joined(component, view)
    if not joins and len(component.triggers) != 1:
        return None
    ways = {wire: _delivered(space, wire, origins_of, view) for wire in component.triggers}
    if any(way is None for way in ways.values()):
        return None
    if joins and not Join(space, number, view)._is_in_order({wire: way or () for wire, way in ways.items()}):
        return None
    merged: dict[tuple[str, int], Origin] = {}
    for origin in (origin for way in ways.values() for origin in way or ()):
        key = origin.kind, origin.number
        known = merged.get(key, origin)
        least, most = picked("max", known.least_ns, origin.least_ns), picked("max", known.most_ns, origin.most_ns)
        merged[key] = origin._replace(least_ns=least, most_ns=most)
    origins = tuple(merged.values())
    return None if _may_lose(space, number, origins, view) else origins


def _may_lose(space: Space, number: int, origins: Sequence[Origin], view: View) -> bool:
    """Whether messages come so closely that a component may lose some: while it runs, or sooner than its separation."""
    component = space.components[number]
    apart: Exact = at(component.period_ns, view) if arrivals(component, view).is_separated else 0
    pieces = component.pieces.members if component.pieces is not None else (number,)
    lost = picked("max", processing_ns(space, pieces, view)[1], apart)
    for origin in origins:
        latest = latest_ns(space, origin, origins, view)
        if latest is not None and origin.period_ns - (latest - soonest_ns(space, origin, origins, view)) >= lost:
            return False
    return bool(lost)


def _leaving(space: Space, number: int, releases: Origins, view: View) -> Origins:
    """The origins of what a component sends."""
    if releases is None:
        return None
    least, most = processing_ns(space, pieces_until(space, number), view)
    return tuple(origin.later(least, most) for origin in releases)


def _delivered(space: Space, wire: int, origins: dict[int, Origins], view: View) -> Origins:
    """The origins of the messages of a connection, when they have come."""
    connection = space.connections[wire]
    least, most = delivery_ns(space, wire, view)
    if connection.source is None:
        rate = rate_hz(space, ("delivery", wire), view)
        return (Origin("connection", wire, NS_PER_S / rate, least, most),) if rate else None
    if connection.states_rate:
        return None  # what comes sooner is lost
    leaving = _leaving(space, connection.source, origins.get(pieces_until(space, connection.source)[0]), view)
    return None if leaving is None else tuple(origin.later(least, most) for origin in leaving)
