"""Messages that go before another one in every order in which all of a bus meet their deadlines.

A message has any identifier, or messages beside it have; all must meet their deadlines. From the last place up others
are placed behind it as long as one of them is in time there (N. C. Audsley's argument, docs/semantics.md, section 5.5).
Those that are left go before it in every such order: none of them can be the last in time. That is told as a
`Conflict` with a `last` message, which is looked at again in other designs without a search for an order.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from dse.analysis.memo import Recall
from dse.analysis.messages.assignment import assigned
from dse.analysis.messages.conflicts import NEVER, Conflict, candidates_on
from dse.analysis.messages.stages import (
    bus_of,
    faults_on,
    identifier_range,
    is_comparable,
    is_each_alone,
    is_on_flow,
    message_key,
)
from dse.analysis.scheduling.busy_window import Task
from dse.analysis.scheduling.policies.buses import Arbitrated
from dse.analysis.scheduling.policies.faults import with_frame
from dse.analysis.scheduling.resolve import source_undelayed
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import leaves
from dse.support.units import Exact

_SOURCES: Recall[Task | None] = Recall()


def soonest(space: Space, number: int, view: View, kept: Collection[int] = ()) -> Conflict | None:
    """The messages that go before another one in the most urgent place that it has where all meet their deadlines.

    Of the orders that have the messages of the connections in `kept` before it. In the order that is chosen
    (`dse.analysis.messages.assignment`) no fewer go before it, where that has those of `kept` there; nor do where its
    bus is busier. None where there is no such order, or messages queue as they come.
    """
    bus = _comparable_bus(space, number, view)
    if bus is None:
        return None
    carried, candidates = candidates_on(space, bus, view)
    bit, most = identifier_range(space, bus, view)
    own = carried.index(message_key(space, number, view)[0])
    kept_places = {place for place, one in enumerate(carried) if one in kept}
    made = assigned(candidates, bit, most, own, faults_on(space, bus, view), before=kept_places)
    urgent = made.order[: made.order.index(own)]
    if made.stuck or not kept_places.issubset(urgent):
        return None
    return _ahead(space, number, view, [carried[place] for place in urgent], kept)


def _ahead(space: Space, number: int, view: View, before: Collection[int], kept: Collection[int]) -> Conflict:
    """The messages `before` another one, as a set of which none but that one and those in `kept` can be the last."""
    bus = bus_of(space, number, view)
    assert bus is not None, "it is on no bus"
    carried, candidates = candidates_on(space, bus, view)
    known = dict(zip(carried, candidates, strict=True))
    own = message_key(space, number, view)[0]
    group = sorted(before, key=lambda one: (NEVER if (limit := known[one].limit_ns) is None else limit, one))
    beside = [one for one in carried if one != own and one not in before]
    numbers = {one: value for one in (*group, own) if (value := known[one].identifier) is not None}
    blocker = max(beside, key=lambda one: known[one].section_ns, default=None)
    return Conflict(bus, tuple(group), (), blocker, numbers, own, frozenset(kept))


def nested(space: Space, view: View, whole: Conflict) -> Iterator[Conflict]:
    """Sets of messages that go before another one, within the `whole` of these: of those due by some time each.

    Beside these there are those with a lower number than one of them. The fewer messages a set has, the more designs it
    is one of. The smallest comes first, the whole last.
    """
    known = whole.candidates(space, view)
    assert known is not None and whole.last is not None, "all are on the bus"
    limits = {one: known[one].limit_ns for one in whole.group}
    for limit in sorted({time for time in limits.values() if time is not None}):
        due = {one for one in whole.group if (time := limits[one]) is not None and time <= limit}
        highest = max((whole.numbers.get(one, -1) for one in due), default=-1)
        due |= {one for one in whole.group if one in whole.kept or whole.numbers.get(one, highest) < highest}
        if len(due) == len(whole.group):
            break
        fewer = _ahead(space, whole.last, view, due, whole.kept)
        if fewer.is_late(space, view):
            yield fewer
    yield whole


def waits_behind_ns(conflict: Conflict, space: Space, view: View, *, has_source: bool) -> Exact | None:
    """How long the last message of a conflict waits at least where all others go before it, in ns.

    From when it is queued, or (`has_source`) from the latest time at which it may be. It waits no less where the bus is
    busier. None where that has no bound, and of a design in which one of the messages is not on the bus.
    """
    known = conflict.candidates(space, view)
    if known is None or conflict.last is None:
        return None
    own, urgent = known[conflict.last], [known[one] for one in conflict.group]
    tasks = tuple(item.task for item in urgent if item.task is not None)
    if own.task is None or len(tasks) < len(urgent):
        return None
    bit, faults = identifier_range(space, conflict.bus, view)[0], faults_on(space, conflict.bus, view)
    behind = 0 if conflict.blocker is None else known[conflict.blocker].section_ns
    longest = max(item.section_ns for item in (own, *urgent))
    window = Arbitrated(own.task, tasks, behind, own.last_ns, bit, with_frame(faults, longest))
    response = window.response_ns()
    if response is None:
        return None
    source = _SOURCES.recall(space, conflict.last, view, source_undelayed) if has_source else None
    lag = None if source is None else window.counted_from(source).response_ns()
    return (response if lag is None else min(lag, response)) - own.task.worst_ns


def _comparable_bus(space: Space, number: int, view: View) -> int | None:
    """The bus of a message where its place decides what it waits; None where messages queue as they come."""
    bus = bus_of(space, number, view)
    if bus is None or set(leaves(space.buses[bus].broadcast)) != {False} or not is_comparable(space):
        return None
    return bus


def earlier_on_flows(space: Space, number: int, view: View) -> frozenset[int]:
    """The messages of flows with any identifier that the rule `audsley` has before another one of a flow, for sure.

    By their connections: of one with any identifier those before it in the file, of one with a stated number all, where
    it has the last place of these and itself as soon as no message that has its turn sooner can have it. They are
    before it, too, in each design in which nothing is busier, no message has a number that may have any here, and those
    of flows have numbers or none as here (`is_idler_alike`): whatever is placed behind it here can be so there, and has
    its turn sooner; then it is in time. None where it is on no flow, frames have several connections, or low numbers
    run short.
    """
    bus = _comparable_bus(space, number, view)
    if bus is None or space.buses[bus].assignment != "audsley" or not is_each_alone(space):
        return frozenset()
    carried, candidates = candidates_on(space, bus, view)
    bit, most = identifier_range(space, bus, view)
    made = assigned(candidates, bit, most, faults=faults_on(space, bus, view))
    own = carried.index(message_key(space, number, view)[0])
    free = [place for place, item in enumerate(candidates) if item.is_on_flow and item.identifier is None]
    sooner = {place for place in free if place < own or candidates[own].identifier is not None}
    place = made.order.index(own)
    if made.stuck or not candidates[own].is_on_flow or not sooner <= {*made.order[:place]}:
        return frozenset()
    if any(item.identifier is not None and item.identifier < len(carried) for item in candidates):
        return frozenset()
    return frozenset(carried[one] for one in sooner)


def is_idler_alike(space: Space, index: int) -> bool:
    """Whether messages stay before others (`earlier_on_flows`) with a less busy option of a decision.

    Not of the identifiers of messages of flows: one with any identifier has its turn later than one with a number.
    """
    decision = space.decisions[index]
    if decision.field != "identifier":
        return True
    wires = enumerate(space.connections)
    return not any(item.name == decision.component and is_on_flow(space, number) for number, item in wires)
