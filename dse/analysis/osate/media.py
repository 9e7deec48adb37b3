"""What OSATE counts for a message on each of the media that carry it (docs/semantics.md, section 3.7)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from dse.analysis.binding import bus_figure, carriers_of, carrying_ns
from dse.analysis.osate.components import OLD
from dse.analysis.views import View
from dse.space.model.space import Connection, Space
from dse.space.model.trees import FROM_BANDWIDTH, at
from dse.support.units import Exact, unrounded


@dataclass(frozen=True, slots=True)
class Medium:
    """A bus or virtual bus (by index) and the bytes of a message there, with the overheads of what wraps it so far.

    OSATE counts sizes in bits as they are, and of the sending port the size of its data type.

    One that is only required (`is_bound` is false) makes nobody wait; without any binding it takes no time (`is_timed`
    is false), but samples.
    """

    bus: int
    size_bytes: Exact
    is_bound: bool = True
    is_timed: bool = True


def media(space: Space, wire: Connection, view: View) -> tuple[Medium, ...]:
    """The buses and protocols that carry a connection, in OSATE's order; also inside one process.

    One `Medium` for each bus and protocol, with the size of the message there in bytes.
    """
    bus = at(wire.stated_bus, view)
    bound = () if bus is None else (bus, *wire.further)
    stated: int | None = at(wire.size_bytes if wire.type_bytes is None else wire.type_bytes, view)
    return tuple(_carried(space, bound, wire.protocols, unrounded(stated or 0), view))


def _carried(space: Space, bound: Sequence[int], required: Sequence[int], size: Exact, view: View) -> Iterator[Medium]:
    """Required protocols, which count where no virtual bus is bound; then what is bound, and what carries that."""
    if not any(space.buses[number].virtual for number in bound):
        yield from _required(space, required, size, view, is_timed=bool(bound))
        size += _overheads(space, required, view)
    for number in bound:
        inner = size + _overhead(space, number, view)
        yield Medium(number, inner)
        if space.buses[number].virtual:
            below = carriers_of(space, number, view)
            yield from _carried(space, below, at(space.buses[number].protocols, view), inner, view)


def _required(space: Space, required: Sequence[int], size: Exact, view: View, *, is_timed: bool) -> Iterator[Medium]:
    """Required protocols, each with those that it requires; protocols side by side wrap the same message."""
    for number in required:
        inner = size + _overhead(space, number, view)
        yield Medium(number, inner, is_bound=False, is_timed=is_timed)
        yield from _required(space, at(space.buses[number].protocols, view), inner, view, is_timed=is_timed)


def _overheads(space: Space, required: Sequence[int], view: View) -> Exact:
    """The bytes that required protocols add, with the protocols that these require."""
    return sum(
        _overhead(space, number, view) + _overheads(space, at(space.buses[number].protocols, view), view)
        for number in required
    )


def _overhead(space: Space, number: int, view: View) -> Exact:
    """The bytes that a carrier adds to a message; none under profile `osate-2.2`."""
    return 0 if space.profile == OLD else unrounded(at(space.buses[number].overhead_bytes, view))


def medium_ns(space: Space, wire: Connection, medium: Medium, view: View) -> tuple[Exact, Exact]:
    """The least and the greatest time of a message on one medium: its transmission time, else the medium's latency.

    A pair (least, most) in ns, exact.
    """
    (least, _), (most, _) = medium_ends(space, wire, medium, view)
    return least, most


def medium_ends(
    space: Space, wire: Connection, medium: Medium, view: View
) -> tuple[tuple[Exact, bool], tuple[Exact, bool]]:
    """The least and the most that one medium takes, each with whether it is a transmission time, else a latency.

    Pairs of a time in ns and a flag. *osate-2.2* uses the latency where there is no transmission time at all,
    *osate-2.19* at each end by itself.
    """
    if not medium.is_timed:
        return (0, True), (0, True)
    bus = space.buses[medium.bus]
    from_bandwidth = bus_figure(space, bus.fixed_ns, wire, view) is FROM_BANDWIDTH  # which OSATE does not know
    times = None if from_bandwidth else carrying_ns(space, bus, wire, medium.size_bytes, view)
    latency = bus_figure(space, bus.latency_ns, wire, view) or (0, 0)
    if space.profile == OLD:
        ends = latency if times is None else times
        return (ends[0], times is not None), (ends[1], times is not None)
    least, most = times or (0, 0)
    return (
        (least, True) if least > 0 or not latency[0] else (latency[0], False),
        (most, True) if most > 0 or not latency[1] else (latency[1], False),
    )
