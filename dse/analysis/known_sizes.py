"""Messages of sizes for which the stated transmission times are not known to hold.

A line through what was measured says nothing beyond the sizes that were (docs/measurements.md): the times of such
messages are counted all the same, and remarked.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import partial
from typing import NamedTuple

from dse.analysis.binding import bus_figure, bus_stack, message_bytes
from dse.analysis.resources import reachable_buses
from dse.analysis.views import View, tabulate
from dse.space.trees import at
from dse.space.types import Connection, Space
from dse.units import SizeRange, format_size, format_size_range

SHOWN = 4
"""Messages are named up to so many."""


class Outside(NamedTuple):
    """A message on a bus whose transmission time holds for other sizes; `size_bytes` with protocol overheads."""

    connection: str
    size_bytes: int
    bus: str
    sizes: SizeRange

    @property
    def text(self) -> str:
        """``scan (10 KB; ros_ipc: 1 B .. 3 KB)``."""
        return f"{self.connection} ({format_size(self.size_bytes)}; {self.bus}: {format_size_range(self.sizes)})"


def outside_sizes(space: Space, view: View) -> Iterator[Outside]:
    """Every message of a design that is smaller or larger than what its transmission times hold for."""
    if any(bus.sizes_bytes is not None for bus in space.buses):
        for item in space.connections:
            yield from _outside(space, item, view)


def possibly_outside(space: Space, limit: int) -> dict[Outside, None]:
    """The same of all designs; a connection with more than `limit` cases is not looked at."""
    found: dict[Outside, None] = {}
    for item in space.connections:
        if any(space.buses[number].sizes_bytes is not None for number in reachable_buses(space, item)):
            cases = tabulate(space, partial(_outside, space, item), limit) or ()
            found |= dict.fromkeys(one for case in cases for one in case.value)
    return found


def _outside(space: Space, item: Connection, view: View) -> tuple[Outside, ...]:
    if at(item.size_bytes, view) is None:
        return ()
    found = []
    for number in bus_stack(space, item, view):
        bus = space.buses[number]
        sizes = _sizes(space, number, item, view)
        size = message_bytes(space, item, number, view)
        if sizes is not None and not sizes.min_bytes <= size <= sizes.max_bytes:
            found.append(Outside(item.name, size, bus.name, sizes))
    return tuple(found)


def _sizes(space: Space, bus: int, item: Connection, view: View) -> SizeRange | None:
    found: SizeRange | None = bus_figure(space, space.buses[bus].sizes_bytes, item, view)
    return found


def outside_words(found: Collection[Outside]) -> Iterator[str]:
    """What is to be said of them, in one sentence; nothing where there are none."""
    if found:
        more = f", and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
        named = ", ".join(item.text for item in list(found)[:SHOWN])
        yield f"transmission times are extrapolated to sizes of messages that they are not stated for: {named}{more}"
