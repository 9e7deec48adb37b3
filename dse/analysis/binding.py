"""Who runs what and what carries what in a design."""

from __future__ import annotations

from fractions import Fraction
from math import floor
from typing import Any

from dse.analysis.views import View
from dse.space.frames import Frame, bit_units, wire_ns
from dse.space.trees import FROM_BANDWIDTH, NotOffered, PerProcessorType, Tree, at, graft, leaves
from dse.space.types import EMPTY, Bus, Connection, Space
from dse.units import NS_PER_S, Exact


def bus_stack(space: Space, connection: Connection, view: View) -> tuple[int, ...]:
    """The bus that the connection is bound to and whatever carries that; empty when unbound or inside one process."""
    return carriers_from(space, at(connection.bus, view), view)


def carriers_from(space: Space, bus: int | None, view: View) -> tuple[int, ...]:
    """A bus and whatever carries it, in this order."""
    stack = []
    while bus is not None:
        stack.append(bus)
        bus = at(space.buses[bus].carrier, view)
    return tuple(stack)


def own_core(space: Space, number: int, view: View, count: Exact) -> int | None:
    """The core, from 1, that a thread has whatever the others do; None where it has none.

    Where a study moves the number of cores, a core that is not there is the last one.
    """
    core = at(space.components[number].core, view) if count > 1 else 1
    return None if core is None else min(int(core), max(1, floor(count)))


def machine_type(space: Space, connection: Connection, view: View) -> str:
    """The type of the processor that runs the connection's middleware: the sending thread's, else the receiver's."""
    for end in (connection.source, connection.target):
        processor = at(space.components[end].processor, view) if end is not None else None
        if processor is not None:
            slot = space.processors[processor]
            name: str = slot.types[view[slot.type_decision]]
            if name == EMPTY:
                raise NotOffered
            return name
    raise NotOffered


def bus_figure(space: Space, tree: Tree, connection: Connection, view: View) -> Any:
    """A bus's figure for one connection: per processor type it is that of the machine which runs it."""
    leaf = at(tree, view)
    if isinstance(leaf, PerProcessorType):
        return at(leaf.by_type[machine_type(space, connection, view)], view)
    return leaf


def message_bytes(space: Space, connection: Connection, stack: tuple[int, ...], view: View) -> int:
    """Data size plus the protocol overhead of every bus and virtual bus that carries it, in bytes."""
    size: int = at(connection.size_bytes, view) or 0
    overhead: int = sum(at(space.buses[bus].overhead_bytes, view) for bus in stack)
    return size + overhead


def is_local(space: Space, connection: Connection, view: View) -> bool:
    """Whether both ends are in one process: the connection costs nothing and binds to nothing."""
    if connection.source is None or connection.target is None:
        return False
    one, other = (at(space.components[end].process, view) for end in (connection.source, connection.target))
    return one is not None and bool(one == other)


def carrying_ns(
    space: Space, bus: Bus, connection: Connection, size_bytes: int, view: View
) -> tuple[Exact, Exact] | None:
    """Least and most time that one carrier takes for a message: fixed + per byte * size; None where it states none.

    Where the bus asks for that, size / bandwidth; where it has frames, what they take (`dse.space.frames`).
    """
    fixed = bus_figure(space, bus.fixed_ns, connection, view)
    if fixed is None:
        return None
    if isinstance(fixed, Frame):
        return wire_ns(fixed, size_bytes, at(bus.bandwidth_bps, view))
    if fixed is FROM_BANDWIDTH:
        time: Exact = 8 * NS_PER_S * Fraction(1) * size_bytes / at(bus.bandwidth_bps, view)
        return time, time
    per_byte = bus_figure(space, bus.per_byte_ns, connection, view)
    return fixed[0] + per_byte[0] * size_bytes, fixed[1] + per_byte[1] * size_bytes


def bit_times_ns(bus: Bus) -> set[Fraction]:
    """Of what all transmission times of a bus with frames are multiples; nothing for others."""
    return {unit * NS_PER_S / bandwidth for unit, bandwidth in bit_units(bus.fixed_ns, bus.bandwidth_bps)}


def byte_times_ns(bus: Bus) -> set[Fraction]:
    """What a byte may take on a bus whose transmission time follows from its bandwidth; nothing for others."""
    tree = graft(bus.fixed_ns, lambda leaf: bus.bandwidth_bps if leaf is FROM_BANDWIDTH else None)
    return {8 * NS_PER_S / Fraction(leaf) for leaf in leaves(tree) if leaf is not None}


def transmission_ns(space: Space, connection: Connection, view: View) -> tuple[Exact, Exact, str]:
    """Least and most time of the connection, and the method: ``transmission time``, ``specified``, ``no latency``.

    Over every carrier, fixed + per byte * size (Transmission_Time); a bus's latency only without one, which a time that
    follows from the bandwidth is for OSATE; the connection's
    own latency only where nothing that carries it gives one (docs/semantics.md, section 3.3). Exact: nothing
    is rounded, however little a byte takes.
    """
    stack = bus_stack(space, connection, view)
    size = message_bytes(space, connection, stack, view)
    least: Exact = 0
    most: Exact = 0
    given = False
    for bus in (space.buses[index] for index in stack):
        times = None
        if space.profile == "dse" or bus_figure(space, bus.fixed_ns, connection, view) is not FROM_BANDWIDTH:
            times = carrying_ns(space, bus, connection, size, view)
        if times is None:
            times = bus_figure(space, bus.latency_ns, connection, view)
        if times is not None:
            least, most, given = least + times[0], most + times[1], True
    own = at(connection.latency_ns, view)
    if given:
        return least, most, "transmission time"
    if own is not None and not is_local(space, connection, view):
        return own[0], own[1], "specified"
    return 0, 0, "no latency"
