"""The latency of a connection: the transmission of a message, and its waiting for the bus.

docs/semantics.md, sections 3.3 and 5.4.
"""

from __future__ import annotations

from dse.analysis.binding import transmission_ns
from dse.analysis.latency.rows import BUS_METHOD, UNBOUNDED_BUS, Row
from dse.analysis.messages.stages import bus_of
from dse.analysis.scheduling.responses import UNBOUNDED_NS, message_waits_ns
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.support.units import Exact


def delivery_rows(space: Space, number: int, view: View, *, has_source: bool = False) -> tuple[Row, ...]:
    """The rows of a connection: its transmission, and its waiting where it may wait for a bus.

    Times in ns; waiting has a minimum of 0. Where a flow `has_source` it counts from the latest time at which the
    message may be queued (docs/semantics.md, section 5.4).
    """
    connection = space.connections[number]
    least, most, method = transmission_ns(space, connection, view)
    row = Row("connection", connection.name, least, method, most, method)
    bus = bus_of(space, number, view)
    if bus is None:
        return (row,)
    waits = message_waits_ns(space, number, view, has_source=has_source)
    method = BUS_METHOD if waits < UNBOUNDED_NS else UNBOUNDED_BUS
    return row, Row("connection", connection.name, 0, BUS_METHOD, waits, method, space.buses[bus].name)


def delivery_ns(space: Space, number: int, view: View) -> tuple[Exact, Exact]:
    """The least and the most time from when a message is sent until it is there, in ns.

    A pair, exact; `UNBOUNDED_NS` stands for waiting without a bound.
    """
    rows = delivery_rows(space, number, view)
    return sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)
