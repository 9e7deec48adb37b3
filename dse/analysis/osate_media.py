"""What OSATE counts for a message on one of the media that carry it (docs/semantics.md, section 3.7)."""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.binding import bus_figure, carriers_from, carrying_ns
from dse.analysis.osate_components import OLD
from dse.analysis.views import View
from dse.space.trees import FROM_BANDWIDTH, at
from dse.space.types import Connection, Space
from dse.units import Exact


def media(space: Space, wire: Connection, view: View) -> tuple[int, ...]:
    """The buses that a connection is bound to, and whatever carries these; also inside one process."""
    return carriers_from(space, at(wire.stated_bus, view), view)


def medium_ns(space: Space, wire: Connection, stack: Sequence[int], depth: int, view: View) -> tuple[Exact, Exact]:
    """What one medium takes for a message with the overheads so far; its latency where that is no time, at each end."""
    bus = space.buses[stack[depth]]
    size: int = at(wire.size_bytes, view) or 0
    if space.profile != OLD:
        size += sum(at(space.buses[number].overhead_bytes, view) for number in stack[: depth + 1])
    from_bandwidth = bus_figure(space, bus.fixed_ns, wire, view) is FROM_BANDWIDTH  # which OSATE does not know
    times = None if from_bandwidth else carrying_ns(space, bus, wire, size, view)
    latency = bus_figure(space, bus.latency_ns, wire, view) or (0, 0)
    if space.profile == OLD:
        return latency if times is None else times
    least, most = times or (0, 0)
    return (least if least > 0 else latency[0]), (most if most > 0 else latency[1])
