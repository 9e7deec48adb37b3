"""The messages of a design's CAN bus as a database (DBC), with chosen identifiers; written by cantools."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import accumulate
from math import ceil

from dse.analysis.binding import bus_stack, frame_of, message_sizes, sent_as
from dse.analysis.messages.waits import chosen_identifiers
from dse.analysis.rates import rate_hz
from dse.analysis.views import View
from dse.space.architecture.arbitration import is_one_message
from dse.space.architecture.frames import MOST_BYTES, Frame, frame_at
from dse.space.model.space import EMPTY, Design, Space
from dse.space.model.trees import at
from dse.support.errors import UsageError
from dse.support.extras import needed_for
from dse.support.units import shown

LONGEST_NAME = 32
MS_PER_S = 1000


@dataclass(frozen=True)
class _Row:
    name: str
    sender: str | None
    identifier: int
    length: int
    cycle_ms: int | None
    parts: tuple[tuple[str, int], ...]
    """The connections of a frame of several, each with its data in bytes."""


def can_database(space: Space, design: Design, title: str) -> str:
    """The database: the bit rate, and each message with its identifier, length, sender and cycle time.

    Connections that are one message on a broadcast bus stand once. The data of a frame of several connections are a
    signal for each of them, one after the other from the first byte on; other messages have none. Cycle times are whole
    milliseconds, rounded down, so that no message comes less often than in the design.

    Raises
    ------
    UsageError
        when the design has no bus with frames of CAN, or several, or a message there without an identifier or a size,
        in several frames, or more often than every millisecond; or cantools is not installed.
    """
    view = View(design)
    bus, frame = _bus(space, view)
    rows = list(_rows(space, bus, frame, view))
    with needed_for("A CAN database", "can"):
        from cantools.database.can import Bus, Database, Message, Node, Signal
    nodes, names = _names(row.sender for row in rows if row.sender), _names(row.name for row in rows)
    messages = [
        Message(
            row.identifier,
            names[row.name],
            row.length,
            [
                Signal(name, 8 * start, 8 * size)
                for (name, size), start in zip(_signals(row), _starts(row), strict=True)
                if size
            ],
            senders=[nodes[row.sender]] if row.sender else [],
            cycle_time=row.cycle_ms,
            is_extended_frame=frame.identifier_bits == 29,
            comment=row.name if names[row.name] != row.name else None,
        )
        for row in rows
    ]
    wires = [Bus(_plain(space.buses[bus].name), baudrate=int(at(space.buses[bus].bandwidth_bps, view)))]
    node_list = [Node(name) for name in nodes.values()]
    database = Database(messages=messages, nodes=node_list, version=_plain(title), buses=wires)
    return str(database.as_dbc_string())


def _bus(space: Space, view: View) -> tuple[int, Frame]:
    """The only bus of a design with frames of CAN."""
    candidates = []
    for number, slot in enumerate(space.buses):
        frame = None if slot.types[view[slot.type_decision]] == EMPTY else frame_at(slot.fixed_ns, view)
        if frame is not None and frame.protocol in MOST_BYTES:
            candidates.append((number, frame))
    if len(candidates) != 1:
        named = ", ".join(space.buses[number].name for number, _ in candidates)
        raise UsageError(f"a DBC file is of one bus with frames of CAN; this design has {named or 'none'}")
    if candidates[0][1].protocol == "can_fd":
        raise UsageError(
            f"{space.buses[candidates[0][0]].name} has frames of CAN FD, which are not written to DBC files"
        )
    return candidates[0]


def _rows(space: Space, bus: int, frame: Frame, view: View) -> Iterator[_Row]:
    chosen = chosen_identifiers(space, view)
    seen: dict[int, int] = {}
    for number, wire in enumerate(space.connections):
        if bus not in bus_stack(space, wire, view):
            continue
        stated = chosen.get(number, at(wire.identifier, view))
        sizes = message_sizes(space, wire, bus, view)
        if not isinstance(stated, int) or len(sizes) != 1 or at(wire.size_bytes, view) is None:
            missing = "`data_size`" if isinstance(stated, int) else "`identifier`"
            raise UsageError(f"{shown(wire.name)} has no {missing}: a DBC file needs it")
        if sent_as(space, number, bus, view) != number:
            continue
        other = seen.setdefault(stated, number)
        if other != number and is_one_message(space.connections[other], wire):
            continue
        length = ceil(sizes[0])
        if length > MOST_BYTES[frame.protocol]:
            raise UsageError(f"{shown(wire.name)} has {length} B: it goes in several frames, which no DBC file says")
        rate = rate_hz(space, ("delivery", number), view)
        cycle = int(MS_PER_S / rate) if rate else None
        if cycle == 0:
            raise UsageError(f"{shown(wire.name)} comes more often than every millisecond, which no DBC file says")
        sender = None if wire.source is None else space.components[wire.source].stated_as
        frame_parts = frame_of(space, wire, view)
        parts = [(item.name, int(at(item.size_bytes, view))) for item in frame_parts if len(frame_parts) > 1]
        yield _Row(wire.name, sender, stated, length, cycle, tuple(parts))


def _signals(row: _Row) -> list[tuple[str, int]]:
    """The names of the signals of a message, each with its data in bytes."""
    names = _names(name for name, _ in row.parts)
    return [(names[name], size) for name, size in row.parts]


def _starts(row: _Row) -> list[int]:
    """Where each of them begins, in bytes."""
    return list(accumulate((size for _, size in row.parts[:-1]), initial=0))[: len(row.parts)]


def _names(names: Iterable[str]) -> dict[str, str]:
    """For each name one that a DBC file may have: letters, digits and underscores, at most 32, each its own.

    >>> _names(["ekf.main", "ekf main", "2nd"])
    {'ekf.main': 'ekf_main', 'ekf main': 'ekf_main_2', '2nd': '_2nd'}
    """
    name_of: dict[str, str] = {}
    for name in dict.fromkeys(names):
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        plain = (f"_{plain}" if plain[:1].isdigit() or not plain else plain)[:LONGEST_NAME]
        made, count = plain, 2
        while made in name_of.values():
            made, count = f"{plain[: LONGEST_NAME - len(str(count)) - 1]}_{count}", count + 1
        name_of[name] = made
    return name_of


def _plain(text: str) -> str:
    return "".join(char if char.isprintable() and char not in '"\\' else " " for char in text)
