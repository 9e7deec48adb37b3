"""Messages as stages on buses: which bus a message waits for, what releases it, and in which order messages go.

A message is released when its sender's data leave, later by whatever wraps it (middleware); it then waits for its bus
and takes its time there. Only buses count of which everything that decides the waiting is stated
(`dse.space.architecture.arbitration`), under the profile `dse`. (docs/semantics.md, section 5.4)
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import ceil
from typing import cast

from dse.analysis.binding import bus_figure, bus_stack, carrying_ns, message_sizes
from dse.analysis.memo import Recall
from dse.analysis.rates import NS_PER_S, rate_hz
from dse.analysis.scheduling.busy_window import Stream, Task
from dse.analysis.scheduling.model import NO_PROCESSOR, Entry, Release, Resource, Stage, Wire
from dse.analysis.scheduling.tasks import TaskKey
from dse.analysis.terms import picked
from dse.analysis.views import View
from dse.space.architecture.arbitration import is_one_message
from dse.space.architecture.carriers import carriers
from dse.space.architecture.frames import frame_at, last_frame_ns
from dse.space.model.space import Connection, Space
from dse.space.model.trees import at
from dse.support.units import Exact


def counted_buses(space: Space) -> tuple[int, ...]:
    """The buses, by number, for which messages wait: none under OSATE's profiles, which have queues of their own.

    Indices, ascending; a bus counts where a type of it states an `arbitration` (docs/semantics.md, section 5.4).
    """
    if space.profile != "dse" or space.bus_queuing != "counted":
        return ()
    return tuple(number for number, bus in enumerate(space.buses) if bus.arbitration is not None)


_REACHED: Recall[tuple[frozenset[int], ...]] = Recall()


def _may_wait(space: Space, _: object, __: View) -> tuple[frozenset[int], ...]:
    counted = frozenset(counted_buses(space))
    return tuple(carriers(space.buses, item) & counted if counted else frozenset() for item in space.connections)


def may_wait_for(space: Space, number: int) -> frozenset[int]:
    """The counted buses that may carry a connection.

    Indices of buses, over all options of the connection; remembered for each space.
    """
    if not counted_buses(space):
        return frozenset()
    return _REACHED.recall(space, "counted", View(()), _may_wait)[number]


def bus_of(space: Space, number: int, view: View) -> int | None:
    """The bus that the message of a connection waits for in a design; None where it waits for none.

    The first counted bus on the way of the message.
    """
    counted = may_wait_for(space, number)
    if not counted:
        return None
    return next((bus for bus in bus_stack(space, space.connections[number], view) if bus in counted), None)


def message_key(space: Space, number: int, view: View) -> TaskKey:
    """The stage of a connection's message on its bus: on a broadcast bus that of the first one from its port.

    Such connections are one message where both are bound to the bus itself, at one rate, of one size and identifier.
    """
    connection = space.connections[number]
    bus = bus_of(space, number, view)
    assert bus is not None
    if connection.from_port is None or not at(space.buses[bus].broadcast, view) or at(connection.bus, view) != bus:
        return number, "message"
    for other, item in enumerate(space.connections[:number]):
        if is_one_message(item, connection) and bus_of(space, other, view) == bus == at(item.bus, view):
            pairs = (item.size_bytes, connection.size_bytes), (item.identifier, connection.identifier)
            alike = all(at(one, view) == at(another, view) for one, another in pairs)
            if alike and not item.states_rate and not connection.states_rate:
                return other, "message"
    return number, "message"


def message_stage(space: Space, number: int, view: View) -> Stage:
    """The message of a connection as a stage on its bus.

    A `Stage` with the shortest and longest transmission time in ns and the releases of its sender.
    """
    connection = space.connections[number]
    bus = bus_of(space, number, view)
    assert bus is not None
    best, worst = _time_ns(space, connection, bus, view)
    key: TaskKey = (number, "message")
    releases = tuple(_releases_of(space, number, bus, view))
    return Stage(key, connection.name, best, worst, worst, releases, elapsed_ns=(best, worst))


def _time_ns(space: Space, connection: Connection, bus: int, view: View) -> tuple[int, int]:
    (size,) = message_sizes(space, connection, bus, view)
    times = carrying_ns(space, space.buses[bus], connection, size, view)
    assert times is not None
    return _number(times[0]), _number(times[1])


def _number(time: Exact) -> int:
    """A time as an integer where it is one: busy windows of integers are found much faster. It passes for one."""
    return cast(int, time.numerator if type(time) is Fraction and time.denominator == 1 else time)


def wrapping_ns(space: Space, number: int, bus: int, view: View) -> tuple[Exact, Exact]:
    """The least and most time of a message in whatever carries it beside the bus that it waits for.

    A pair in ns, exact: transmission times, or latencies, of the virtual buses and other buses on the way.
    """
    connection = space.connections[number]
    least: Exact = 0
    most: Exact = 0
    for other in bus_stack(space, connection, view):
        if other == bus:
            continue
        for size in message_sizes(space, connection, other, view):
            times = carrying_ns(space, space.buses[other], connection, size, view)
            times = times or bus_figure(space, space.buses[other].latency_ns, connection, view)
            if times is not None:
                least, most = least + times[0], most + times[1]
    return least, most


def _releases_of(space: Space, number: int, bus: int, view: View) -> list[Release]:
    connection = space.connections[number]
    least, most = wrapping_ns(space, number, bus, view)
    if connection.sender is not None:
        return [Release(None, (connection.sender, "thread"), least, most)]
    rate = rate_hz(space, ("delivery", number), view)
    return [Release(Stream(max(1, NS_PER_S // rate), most - least))] if rate else []


def bus_resource(space: Space, bus: int, view: View) -> Resource:
    """A bus with the messages that wait for it in a design, in the order of their identifiers where these decide.

    A `Resource` with one entry for each message; connections that leave one port are one message.
    """
    arbitration = at(space.buses[bus].arbitration, view)
    carried = [
        number
        for number in range(len(space.connections))
        if bus in may_wait_for(space, number)
        and bus_of(space, number, view) == bus
        and message_key(space, number, view)[0] == number
    ]
    if arbitration == "priority":
        carried.sort(key=lambda number: (at(space.connections[number].identifier, view), number))
        return _by_identifier(space, bus, carried, view)
    senders = [_sender(space, number) for number in carried]
    alike = [set(carried) if arbitration == "fifo" else _alike(carried, senders, one) for one in senders]
    entries, turns = [], []
    for position, number in enumerate(carried):
        rivals = tuple(at for at, other in enumerate(carried) if other in alike[position] and other != number)
        others = dict.fromkeys(one for one in senders if arbitration == "round_robin" and one != senders[position])
        longest = [_longest(space, bus, _alike(carried, senders, one), view) for one in others]
        entries.append(Entry((number, "message"), 0, rivals))
        turns.append(tuple(longest))
    wholes = tuple(_time_ns(space, space.connections[number], bus, view)[1] for number in carried)
    return Resource(NO_PROCESSOR, bus, tuple(entries), wire=Wire(arbitration, 0, wholes, tuple(turns)))


def _by_identifier(space: Space, bus: int, carried: Sequence[int], view: View) -> Resource:
    slot = space.buses[bus]
    frame, bandwidth = frame_at(slot.fixed_ns, view), at(slot.bandwidth_bps, view)
    last: list[int] = []
    sections: list[int] = []
    for number in carried:
        connection = space.connections[number]
        whole = _time_ns(space, connection, bus, view)[1]
        (size,) = message_sizes(space, connection, bus, view)
        final, longest = (whole, whole) if frame is None else last_frame_ns(frame, ceil(size), bandwidth)
        last.append(_number(final))
        sections.append(_number(longest))
    entries: list[Entry] = []
    longest_later: list[tuple[TaskKey, int]] = []  # of the less urgent ones the message with the longest frame
    for position in reversed(range(len(carried))):
        key: TaskKey = (carried[position], "message")
        blocked = longest_later[0][1] if longest_later else 0
        entries.append(Entry(key, position, tuple(range(position)), tuple(longest_later), blocked))
        if not longest_later or sections[position] >= blocked:
            longest_later = [(key, picked("max", sections[position], blocked))]
    entries.reverse()
    bit = _number(Fraction(NS_PER_S) / bandwidth)
    return Resource(NO_PROCESSOR, bus, tuple(entries), wire=Wire("priority", bit, tuple(last), ((),) * len(carried)))


def _sender(space: Space, number: int) -> int:
    """What sends a message: a component, or what is outside of the system, for each connection another one."""
    source = space.connections[number].source
    return -1 - number if source is None else source


def _alike(carried: Sequence[int], senders: Sequence[int], sender: int) -> set[int]:
    return {number for number, one in zip(carried, senders, strict=True) if one == sender}


def _longest(space: Space, bus: int, numbers: set[int], view: View) -> Task:
    """One job of the longest message of a sender."""
    times = {number: _time_ns(space, space.connections[number], bus, view)[1] for number in sorted(numbers)}
    number = max(times, key=lambda one: times[one])
    return Task(space.connections[number].name, times[number], (), None, (number, "message"))
