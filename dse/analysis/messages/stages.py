"""Messages as stages on buses: which bus a message waits for, what releases it, and in which order messages go.

A message is released when its sender's data leave, later by whatever wraps it (middleware); it then waits for its bus
and takes its time there. Only buses count of which everything that decides the waiting is stated
(`dse.space.architecture.arbitration`), under the profile `dse`. (docs/semantics.md, section 5.4)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import accumulate
from math import ceil
from typing import TypeAlias, cast

from dse.analysis.binding import (
    bus_figure,
    bus_stack,
    carrying_ns,
    frame_numbers,
    message_sizes,
    sent_as,
    travels_whole,
)
from dse.analysis.memo import Recall
from dse.analysis.messages.assignment import Candidate, assigned
from dse.analysis.rates import NS_PER_S, rate_hz
from dse.analysis.scheduling.busy_window import Stream, Task, TaskKey
from dse.analysis.scheduling.model import NO_PROCESSOR, Entry, Release, Resource, Stage, Wire
from dse.analysis.scheduling.policies.faults import faults_of_wire, with_frame
from dse.analysis.views import View
from dse.space.architecture.arbitration import is_one_message
from dse.space.architecture.carriers import carriers
from dse.space.architecture.frames import frame_at, last_frame_ns
from dse.space.model.space import EMPTY, Bus, Connection, Space, at_home
from dse.space.model.trees import at, leaves
from dse.spec.kinds import Arbitration
from dse.spec.schema.fields import ANY_IDENTIFIER
from dse.support.units import Exact, picked


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

    The first counted bus on the way of the message; in an empty slot there is none.
    """
    counted = may_wait_for(space, number)
    if not counted:
        return None
    found = (bus for bus in bus_stack(space, space.connections[number], view) if bus in counted)
    return next((bus for bus in found if _is_there(space.buses[bus], view)), None)


def _is_there(slot: Bus, view: View) -> bool:
    return EMPTY not in slot.types or at(slot.arbitration, view) is not None


def message_key(space: Space, number: int, view: View) -> TaskKey:
    """The stage of a connection's message on its bus: that of the head of its frame; if broadcast, of its port.

    Those of a port are one message where both are bound to the bus itself, at one rate, of one size and identifier.
    """
    connection = space.connections[number]
    bus = bus_of(space, number, view)
    assert bus is not None
    head = sent_as(space, number, bus, view)
    if head != number:
        return head, "message"
    if connection.from_port is None or not at(space.buses[bus].broadcast, view) or at(connection.bus, view) != bus:
        return number, "message"
    keys = ("size_bytes", "priority" if at(space.buses[bus].arbitration, view) == "classes" else "identifier")
    for other, item in enumerate(space.connections[:number]):
        if is_one_message(item, connection) and bus_of(space, other, view) == bus == at(item.bus, view):
            pairs = [(getattr(item, key), getattr(connection, key)) for key in keys]
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


Released: TypeAlias = Callable[[Sequence[TaskKey]], Mapping[TaskKey, Task | None]]
"""Messages as jobs whose releases have the jitter that they have where nothing waits."""


def carried_by(space: Space, bus: int, view: View) -> list[int]:
    """The messages that wait for a bus in a design, by their connections, in the order of the file."""
    return [
        number
        for number in range(len(space.connections))
        if bus in may_wait_for(space, number)
        and bus_of(space, number, view) == bus
        and message_key(space, number, view)[0] == number
    ]


def bus_resource(space: Space, bus: int, view: View, released: Released) -> Resource:
    """A bus with the messages that wait for it in a design, in the order of their identifiers where these decide.

    A `Resource` with one entry for each message; connections that leave one port are one message.
    """
    arbitration = at(space.buses[bus].arbitration, view)
    carried = carried_by(space, bus, view)
    if arbitration == "priority":
        identifiers = [at(space.connections[number].identifier, view) for number in carried]
        if ANY_IDENTIFIER in identifiers:
            found = candidates_of(space, bus, view, released)
            faults, rule = faults_on(space, bus, view), space.buses[bus].assignment
            made = assigned(found, *identifier_range(space, bus, view), faults=faults, rule=rule)
            order = [carried[place] for place in made.order]
            return in_order(space, bus, order, view, made.identifiers)
        pairs = sorted(zip(identifiers, carried, strict=True))
        return in_order(space, bus, [number for _, number in pairs], view, [number for number, _ in pairs])
    if arbitration == "classes":
        classes = {number: at(space.connections[number].priority, view) for number in carried}
        return in_order(space, bus, sorted(carried, key=lambda number: -classes[number]), view, classes=classes)
    senders = [_sender(space, number) for number in carried]
    is_apart = arbitration in ("none", "round_robin")
    alike = [_alike(carried, senders, one) if is_apart else set(carried) for one in senders]
    entries, turns = [], []
    for position, number in enumerate(carried):
        rivals = tuple(at for at, other in enumerate(carried) if other in alike[position] and other != number)
        others = dict.fromkeys(one for one in senders if arbitration == "round_robin" and one != senders[position])
        longest = [_longest(space, bus, _alike(carried, senders, one), view) for one in others]
        entries.append(Entry((number, "message"), 0, rivals))
        turns.append(tuple(longest))
    wholes = tuple(_time_ns(space, space.connections[number], bus, view)[1] for number in carried)
    return Resource(NO_PROCESSOR, bus, tuple(entries), wire=Wire(arbitration, 0, wholes, tuple(turns)))


def identifier_range(space: Space, bus: int, view: View) -> tuple[int, int]:
    """The time of a bit, in ns, and the greatest identifier on a bus."""
    slot = space.buses[bus]
    frame = frame_at(slot.fixed_ns, view)
    bits = 29 if frame is None else frame.identifier_bits
    return _number(Fraction(NS_PER_S) / at(slot.bandwidth_bps, view)), (1 << bits) - 1


def faults_on(space: Space, bus: int, view: View) -> Task | None:
    """The faults of a wire as a task, without the frames that are sent again; None where none are counted.

    Times in ns, of the interval, the burst and the bandwidth that a design has.
    """
    slot = space.buses[bus]
    interval = at(slot.fault_interval_ns, view)
    if interval is None:
        return None
    burst = at(slot.fault_burst, view)
    return faults_of_wire(interval, 1 if burst is None else burst, identifier_range(space, bus, view)[0])


def candidates_of(space: Space, bus: int, view: View, released: Released) -> list[Candidate]:
    """The messages of a bus in search of their places, in the order of `carried_by`."""
    carried = carried_by(space, bus, view)
    tasks = released([(number, "message") for number in carried])
    sharing: dict[int, list[int]] = {number: [] for number in carried}
    for number in range(len(space.connections)):
        if bus in may_wait_for(space, number) and bus_of(space, number, view) == bus:
            sharing[message_key(space, number, view)[0]].append(number)
    found = []
    for number in carried:
        made = candidate_of(space, bus, number, view, tasks[number, "message"])
        limits = [limit_ns(space, bus, one, view) for one in sharing[number]]
        latest = min((limit for limit in limits if limit is not None), default=None)
        has_flow = any(is_on_flow(space, one) for one in sharing[number])
        identifier = at(space.connections[number].identifier, view)
        found.append(
            replace(
                made,
                limit_ns=latest,
                identifier=None if identifier == ANY_IDENTIFIER else identifier,
                is_on_flow=has_flow,
            )
        )
    return found


def candidate_of(space: Space, bus: int, number: int, view: View, task: Task | None) -> Candidate:
    """The message of one connection in search of its place, with any identifier; `task` is it as a job.

    Its limit is the least of all connections in its frame.
    """
    last, section = _frames_ns(space, bus, number, view)
    connection = space.connections[number]
    sharing = (
        frame_numbers(space, connection, view) if connection.carried_in is not None or connection.riders else [number]
    )
    limits = [limit for one in sharing if (limit := limit_ns(space, bus, one, view)) is not None]
    return Candidate(task, last, section, min(limits, default=None), None, is_on_flow(space, number))


def is_on_flow(space: Space, number: int) -> bool:
    """Whether a connection is a part of a flow."""
    return any(step.kind == "connection" and step.index == number for flow in space.flows for step in flow.steps)


def limit_ns(space: Space, bus: int, number: int, view: View) -> Exact | None:
    """The longest that the message of a connection may take on a bus by its own deadline; None without one.

    In ns: the deadline less what else carries the message takes at most.
    """
    deadline = at(space.connections[number].deadline_ns, view)
    return None if deadline is None else deadline - wrapping_ns(space, number, bus, view)[1]


def _frames_ns(space: Space, bus: int, number: int, view: View) -> tuple[int, int]:
    """The longest times of the last and of the longest frame of a message."""
    connection = space.connections[number]
    frame, bandwidth = frame_at(space.buses[bus].fixed_ns, view), at(space.buses[bus].bandwidth_bps, view)
    (size,) = message_sizes(space, connection, bus, view)
    if frame is None:
        whole = _time_ns(space, connection, bus, view)[1]
        return whole, whole
    final, longest = last_frame_ns(frame, ceil(size), bandwidth)
    return _number(final), _number(longest)


def in_order(
    space: Space,
    bus: int,
    carried: Sequence[int],
    view: View,
    identifiers: Sequence[int] = (),
    classes: Mapping[int, int] | None = None,
) -> Resource:
    """A bus with its messages in this order, the most urgent first, as if they had such identifiers.

    A `Resource`; `carried` are the messages by their connections. With `classes`, their priorities, those of one class
    go as they come.
    """
    frames = [_frames_ns(space, bus, number, view) for number in carried]
    last, sections = [one for one, _ in frames], [longest for _, longest in frames]
    if classes is None:
        lines = _lines([transmit_queue(space, number, view) for number in carried])
    else:
        lines = _lines([str(classes[number]) for number in carried])
    longest_later: list[tuple[tuple[TaskKey, int], ...]] = [()]  # the message with the longest frame behind each place
    for position in reversed(range(len(carried))):
        before = longest_later[-1]
        blocked = before[0][1] if before else 0
        if not before or space.is_traced or sections[position] >= blocked:  # traced figures need no name of a blocker
            before = (((carried[position], "message"), picked("max", sections[position], blocked)),)
        longest_later.append(before)
    longest_later.reverse()
    entries: list[Entry] = []
    faults, hits = faults_on(space, bus, view), []
    longest = list(accumulate(sections, partial(picked, "max")))
    for position, number in enumerate(carried):
        end = lines[position][-1] if lines and lines[position] else position
        blockers = longest_later[end + 1]
        rivals = tuple(other for other in range(end + 1) if other != position)
        blocked = blockers[0][1] if blockers else 0
        entries.append(Entry((number, "message"), position, rivals, blockers, blocked))
        hits.append(with_frame(faults, longest[end]))
    kind: Arbitration = "priority" if classes is None else "classes"
    bit = identifier_range(space, bus, view)[0] if classes is None else 0
    counted = tuple(item for item in hits if item is not None)
    wire = Wire(kind, bit, tuple(last), ((),) * len(carried), tuple(identifiers), lines, counted)
    return Resource(NO_PROCESSOR, bus, tuple(entries), wire=wire)


def _lines(queues: Sequence[str]) -> tuple[tuple[int, ...], ...]:
    """For each message, by its queue, the positions of those in the same one; none where each is alone."""
    places: dict[str, list[int]] = {}
    for position, queue in enumerate(queues):
        if queue:
            places.setdefault(queue, []).append(position)
    found = [tuple(places[queue]) if queue and len(places[queue]) > 1 else () for queue in queues]
    return tuple(found) if any(found) else ()


def transmit_queue(space: Space, number: int, view: View) -> str:
    """The name of the processor, thread or device that queues a message as it comes; empty where nothing does.

    A thread or device queues its own messages where it states `transmit_queue`, else its processor does, with those of
    all its threads.
    """
    source = space.connections[number].source
    if source is None:
        return ""
    component = space.components[source]
    own = at(component.transmit_queue, view)
    if own is not None:
        return str(component.stated_as) if own == "fifo" else ""
    slot = at(at_home(space.components, source).processor, view)
    processor = None if slot is None else space.processors[slot]
    is_queue = processor is not None and at(processor.transmit_queue, view) == "fifo"
    return processor.name if processor is not None and is_queue else ""


def is_each_alone(space: Space) -> bool:
    """Whether in every design each message competes by its own identifier, for one connection.

    So it is not where senders queue messages as they come, or a frame has several connections.
    """
    return not may_queue(space) and all(item.carried_in is None for item in space.connections)


def is_comparable(space: Space) -> bool:
    """Whether in every design each message competes by its own identifier, for connections that all are on its bus.

    Frames of several connections are then busier with each connection more, whoever else is in them.
    """
    shared = [number for number, item in enumerate(space.connections) if item.carried_in is not None]
    return not may_queue(space) and all(travels_whole(space, number) for number in shared)


def may_queue(space: Space) -> bool:
    """Whether some sender queues messages as they come in some design (`transmit_queue`)."""
    trees = [item.transmit_queue for item in space.processors] + [item.transmit_queue for item in space.components]
    return any("fifo" in set(leaves(tree)) for tree in trees if tree is not None)


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
