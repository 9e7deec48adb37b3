"""The processors of components and the buses of connections in a design."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import ceil, floor
from typing import Any

from dse.analysis.memo import Recall
from dse.analysis.views import View
from dse.space.architecture.frames import Frame, bit_units, wire_ns
from dse.space.model.space import EMPTY, Bus, Connection, Space, at_home
from dse.space.model.trees import FROM_BANDWIDTH, NotOffered, PerProcessorType, Tree, at, graft, leaves
from dse.support.units import NS_PER_S, Exact, unrounded


def bus_stack(space: Space, connection: Connection, view: View) -> tuple[int, ...]:
    """The buses that carry the connection and whatever carries these; empty when unbound or inside one process.

    Indices of buses; further buses that carry at once are included.
    """
    bus = at(connection.bus, view)
    stack: list[int] = []
    for start in () if bus is None else (bus, *connection.further):
        _climb(space, start, view, stack)
    return tuple(stack)


def _climb(space: Space, bus: int | None, view: View, stack: list[int]) -> None:
    """A bus and whatever carries it, each once, in this order."""
    while bus is not None and bus not in stack:
        stack.append(bus)
        slot = space.buses[bus]
        bus = at(slot.carrier, view)
        if slot.further and bus is not None:
            for one in (bus, *slot.further):
                _climb(space, one, view, stack)
            return


def carriers_of(space: Space, bus: int, view: View) -> tuple[int, ...]:
    """The bus that carries a virtual bus directly.

    Indices of buses, empty where the virtual bus is not carried by another one.
    """
    slot = space.buses[bus]
    carrier = at(slot.carrier, view)
    return () if carrier is None else (carrier, *slot.further)


def ways_over(space: Space, connection: Connection, bus: int, view: View) -> tuple[tuple[int, ...], ...]:
    """The ways on which a bus carries a connection, each of the buses from the one that it is bound to down.

    There are several where it is bound to several at once that this bus carries: it then carries the message for each.
    """
    if not connection.further and not any(item.further for item in space.buses):
        stack = bus_stack(space, connection, view)
        return (stack,) if bus in stack else ()
    first = at(connection.bus, view)
    ways: dict[tuple[int, ...], tuple[int, ...]] = {}
    for start in () if first is None else (first, *connection.further):
        for chain in _chains(space, start, view):
            if bus in chain:
                ways.setdefault(chain[: chain.index(bus) + 1], chain)
    return tuple(ways.values())


def _chains(space: Space, bus: int, view: View) -> Iterator[tuple[int, ...]]:
    below = carriers_of(space, bus, view)
    for one in below:
        yield from ((bus, *chain) for chain in _chains(space, one, view))
    if not below:
        yield (bus,)


def own_core(space: Space, number: int, view: View, count: Exact) -> int | None:
    """The core, from 1, that a thread has whatever the others do; None where it has none.

    Where a study moves the number of cores, a core that is not there is the last one.
    """
    core = at(space.components[number].core, view) if count > 1 else 1
    return None if core is None else min(int(core), max(1, floor(count)))


def machine_type(space: Space, connection: Connection, view: View) -> str:
    """The type of the processor that runs the connection's middleware: the sending thread's, else the receiver's.

    The name of a type. Raises `NotOffered` where the slot is empty or neither end runs on a processor.
    """
    for end in (connection.source, connection.target):
        processor = at(at_home(space.components, end).processor, view) if end is not None else None
        if processor is not None:
            slot = space.processors[processor]
            name: str = slot.types[view[slot.type_decision]]
            if name == EMPTY:
                raise NotOffered
            return name
    raise NotOffered


def bus_figure(space: Space, tree: Tree, connection: Connection, view: View) -> Any:
    """A bus's figure for one connection: per processor type it is that of the machine which runs it.

    A leaf of `tree` in the base unit of the field. Raises `NotOffered` where the chosen type has no such figure.
    """
    leaf = at(tree, view)
    if isinstance(leaf, PerProcessorType):
        return at(leaf.by_type[machine_type(space, connection, view)], view)
    return leaf


def message_sizes(space: Space, connection: Connection, bus: int, view: View) -> tuple[Exact, ...]:
    """The size in bytes of a connection's message on a bus, once for each way: data and overheads of all its buses.

    In bytes, with the overheads of every bus on the way (docs/semantics.md, section 3.3); several entries where a
    message crosses the bus more than once.
    """
    return tuple(way_bytes(space, connection, way, view) for way in ways_over(space, connection, bus, view))


def way_bytes(space: Space, connection: Connection, way: Sequence[int], view: View) -> Exact:
    """The data size of the frame of a connection plus the overhead of every bus on a way, in bytes.

    Each is a whole number of bytes, but under OSATE's profiles, where sizes in bits count as they are.
    """
    data = [at(item.size_bytes, view) or 0 for item in frame_of(space, connection, view)]
    parts = [*data, *(at(space.buses[number].overhead_bytes, view) for number in way)]
    total: Exact = sum(parts if space.profile == "dse" else map(unrounded, parts))
    return total


def overhead_bytes(space: Space, way: Sequence[int], view: View) -> Exact:
    """The bytes that the buses on a way add to a message, whatever its data, as whole bytes.

    Exact; each is a figure of a bus type (docs/semantics.md, section 3.3).
    """
    total: Exact = sum(at(space.buses[number].overhead_bytes, view) for number in way)
    return total


def frame_of(space: Space, connection: Connection, view: View) -> list[Connection]:
    """The connections whose data go in one message in a design, in the order of the file; mostly the connection alone.

    Whether they travel or not: a frame has one layout (docs/semantics.md, section 5.6).
    """
    if connection.carried_in is None and not connection.riders:
        return [connection]
    return [space.connections[number] for number in frame_numbers(space, connection, view)]


def frame_numbers(space: Space, connection: Connection, view: View) -> list[int]:
    """The connections of the frame of a connection by number, ascending; that of the connection itself is among them.

    No decision of others than those that may be in the frame is looked at.
    """
    head = at(connection.carried_in, view)
    if head is None:
        head = next(number for number, item in enumerate(space.connections) if item.name == connection.name)
    riders = space.connections[head].riders
    return sorted([head, *(one for one in riders if at(space.connections[one].carried_in, view) == head)])


def sent_as(space: Space, number: int, bus: int, view: View) -> int:
    """The connection by which the message of a connection is known on a bus that carries it.

    The one whose message it is where that is on the bus, else the first of its frame that is; mostly itself.
    """
    connection = space.connections[number]
    if connection.carried_in is None and not connection.riders:
        return number
    head = _head_of(space, number, view)
    numbers = [head, *frame_numbers(space, space.connections[head], view)]
    return next((one for one in numbers if bus in bus_stack(space, space.connections[one], view)), number)


def _head_of(space: Space, number: int, view: View) -> int:
    """The connection that has the message; in a design that lets them carry each other in a circle one of these."""
    passed = [number]
    while (head := at(space.connections[passed[-1]].carried_in, view)) is not None:
        if head in passed:
            return min(passed[passed.index(head) :])
        passed.append(head)
    return passed[-1]


_WHOLE: Recall[bool] = Recall()


def travels_whole(space: Space, number: int) -> bool:
    """Whether all that may share a frame with a connection are sent over a bus in every design, as it is itself.

    Where some of them may stay on a processor or in a process, who is on the bus decides which one counts.
    """

    def found(space: Space, number: int, _: View) -> bool:
        own = space.connections[number]
        heads = {number, *(head for head in leaves(own.carried_in) if head is not None)}
        family = heads.union(*(space.connections[head].riders for head in heads))
        return all(type(space.connections[one].bus) is int for one in family)

    return _WHOLE.recall(space, number, View(()), found)


def _is_local(space: Space, connection: Connection, view: View) -> bool:
    """Whether both ends are in one process: the connection costs nothing and binds to nothing."""
    if connection.source is None or connection.target is None:
        return False
    one, other = (at(at_home(space.components, end).process, view) for end in (connection.source, connection.target))
    return one is not None and bool(one == other)


def carrying_ns(
    space: Space, bus: Bus, connection: Connection, size_bytes: Exact, view: View
) -> tuple[Exact, Exact] | None:
    """Least and most time that one carrier takes for a message: fixed + per byte * size; None where it states none.

    Where the bus asks for that, size / bandwidth; where it has frames, what they take
    (`dse.space.architecture.frames`).
    """
    fixed = bus_figure(space, bus.fixed_ns, connection, view)
    if fixed is None:
        return None
    if isinstance(fixed, Frame):
        return wire_ns(fixed, ceil(size_bytes), at(bus.bandwidth_bps, view))
    if fixed is FROM_BANDWIDTH:
        time: Exact = 8 * NS_PER_S * Fraction(1) * size_bytes / at(bus.bandwidth_bps, view)
        return time, time
    per_byte = bus_figure(space, bus.per_byte_ns, connection, view)
    return fixed[0] + per_byte[0] * size_bytes, fixed[1] + per_byte[1] * size_bytes


def bit_times_ns(bus: Bus) -> set[Fraction]:
    """Times of which all transmission times of a bus with frames are multiples, such as a bit time; else empty.

    Times in ns, over all types of the bus and all their bandwidths; used to find a common time scale.
    """
    return {unit * NS_PER_S / bandwidth for unit, bandwidth in bit_units(bus.fixed_ns, bus.bandwidth_bps)}


def byte_times_ns(bus: Bus) -> set[Fraction]:
    """The byte times of a bus whose transmission time follows from its bandwidth; empty for other buses.

    Times in ns: eight bits over each bandwidth that the bus may have.
    """
    tree = graft(bus.fixed_ns, lambda leaf: bus.bandwidth_bps if leaf is FROM_BANDWIDTH else None)
    return {8 * NS_PER_S / Fraction(leaf) for leaf in leaves(tree) if leaf is not None}


def transmission_ns(space: Space, connection: Connection, view: View) -> tuple[Exact, Exact, str]:
    """Least and most time of the connection, and the method: ``transmission time``, ``specified``, ``no latency``.

    Over every carrier, fixed + per byte * size (Transmission_Time); a bus's latency only without one, which a time that
    follows from the bandwidth is for OSATE; the connection's
    own latency only where nothing that carries it gives one (docs/semantics.md, section 3.3). Exact: nothing
    is rounded, however little a byte takes.
    """
    least: Exact = 0
    most: Exact = 0
    is_stated = False
    for number in bus_stack(space, connection, view):
        bus = space.buses[number]
        for size in message_sizes(space, connection, number, view):
            times = None
            if space.profile == "dse" or bus_figure(space, bus.fixed_ns, connection, view) is not FROM_BANDWIDTH:
                times = carrying_ns(space, bus, connection, size, view)
            if times is None:
                times = bus_figure(space, bus.latency_ns, connection, view)
            if times is not None:
                least, most, is_stated = least + times[0], most + times[1], True
    own = at(connection.latency_ns, view)
    if is_stated:
        return least, most, "transmission time"
    if own is not None and not _is_local(space, connection, view):
        return own[0], own[1], "specified"
    return 0, 0, "no latency"
