"""How long a message waits for its bus at least, in the search's model: a row of each, and what goes first there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from math import floor
from typing import Any

from dse.analysis.messages.frames import apart, has_own_message
from dse.analysis.messages.stages import counted_buses, is_comparable, is_each_alone
from dse.analysis.scheduling.busy_window import most_jobs
from dse.analysis.scheduling.policies.faults import ERROR_BITS
from dse.analysis.views import allowed_options
from dse.encode.linear import EXACT_LIMIT, Board
from dse.encode.messages.rows import BusRows, Sent, section_ns
from dse.space.architecture.arbitration import may_be_any
from dse.space.model.space import EMPTY
from dse.space.model.trees import leaves


def add_waiting_rows(board: Board, number: int, least: Any, variable: Any, scale: Fraction) -> dict[int, int]:
    """Rows that say how long a message waits at least, of a figure that is `least` without waiting.

    A ns of waiting adds `scale` to the figure, be it counted from when the message is queued, or from the latest time
    at which it may be: its first job in a busy period waits for no other one of its own.

    Each message with a lower number goes before it with each job that comes until it begins: one at least, and as many
    as come while all that surely go before it are sent. The longest of the others has begun, or goes first, too; where
    frames have several connections that alone is said. Faults of the wire come until all that surely go before it, and
    its own last frame, are sent. Returns literals by connection, of messages of which numbers do not tell whether they
    go before it: each counts where its literal is true, and may be false unless numbers tell.
    """
    space = board.space
    wire = space.connections[number]
    buses = set(leaves(wire.bus))
    if len(buses) != 1 or not is_comparable(space):
        return {}
    (bus,) = buses
    if bus not in counted_buses(space) or set(leaves(space.buses[bus].broadcast)) != {False}:
        return {}
    slot = space.buses[bus]
    for option in allowed_options(space, slot.type_decision):
        given = {slot.type_decision: option}
        if slot.types[option] != EMPTY and "priority" in set(leaves(slot.arbitration)):
            on_bus = BusRows(board, bus, given, {})
            if is_each_alone(space):
                _add_waiting(on_bus, number, least, variable, scale)
            else:
                _add_blocking(on_bus, number, least, variable, scale)
    return {first: literal.index for (first, second), literal in board.before.items() if second == number}


def _add_waiting(rows: BusRows, number: int, least: Any, variable: Any, scale: Fraction) -> None:
    """Add the row of one message for this type of the bus."""
    board, space = rows.board, rows.board.space
    ((decision, option),) = rows.given.items()
    bit = rows.bit_ns()
    if bit is None:
        return
    found = [made for one in range(len(space.connections)) if (made := rows.message(one)) is not None]
    own = rows.numbered(number, apart(space, number, rows.given)) if has_own_message(space, number) else []
    mine = [message for message in found if message.number == number]
    found = [message for message in found if message.number != number]
    before: dict[int, Any] = {}
    for message in found:
        goes_first = _goes_first(rows, message, own)
        if goes_first is not board.true and any(
            may_be_any(rows.board.space.connections[one]) for one in (number, message.number)
        ):
            known, goes_first = goes_first, before_literal(board, message.number, number)
            if known is not None:
                board.model.add_implication(known, goes_first)
        if goes_first is not None:
            before[message.number] = goes_first
    sure = [one for one in found if before.get(one.number) is board.true]
    window = sum(min(item.task.worst_ns for _, item in one.cases if item.task is not None) for one in sure) + bit
    parts = []
    for message in found:
        goes_first = before.get(message.number)
        if goes_first is None:
            continue
        for case, item in message.cases:
            assert item.task is not None
            work = floor(most_jobs(item.task, window) * item.task.worst_ns * scale)
            parts.append((work, board.all_of([goes_first, case])))
    if mine and rows.faults:
        until = window - bit + min(item.last_ns for _, item in mine[0].cases)
        hits = min(most_jobs(faults, until) for faults in rows.faults)
        parts.append((floor(hits * (ERROR_BITS * bit + max(map(section_ns, [*mine, *sure]))) * scale), board.true))
    if sum(work for work, _ in parts) >= EXACT_LIMIT:
        return
    parts += _begun(rows, found, before, scale)
    form = sum(work * literal for work, literal in parts)
    board.model.add(variable >= least + form).only_enforce_if(board.options[decision][option])


def before_literal(board: Board, first: int, second: int) -> Any:
    """The literal of one message's going before another one, of messages that are both on a bus in any design.

    One of two goes before the other, and what goes before the first of these before the second, too.
    """
    known = board.before
    if (first, second) not in known:
        reverse = known.get((second, first))
        literal = board.model.new_bool_var("") if reverse is None else reverse.negated()
        known[first, second] = literal
        for third in {one for pair in known for one in pair}:
            _add_order(board, first, second, third)
            _add_order(board, third, first, second)
            _add_order(board, first, third, second)
    return known[first, second]


def _add_order(board: Board, first: int, second: int, third: int) -> None:
    """Say that the first of three messages is before the third where it is before the second, and that the third."""
    if {(first, second), (second, third), (first, third)} <= board.before.keys():
        one, other, both = board.before[first, second], board.before[second, third], board.before[first, third]
        board.model.add_bool_or([one.negated(), other.negated(), both])


def _begun(rows: BusRows, found: Sequence[Sent], before: Mapping[int, Any], scale: Fraction) -> list[tuple[int, Any]]:
    """The longest frame of the messages that are not before one, as a sum: what it takes more than shorter ones."""
    maybe = [one for one in found if before.get(one.number) is not rows.board.true]
    lengths = sorted({floor(section_ns(one) * scale) for one in maybe}, reverse=True)
    parts = []
    for length, shorter in pairwise([*lengths, 0]):
        long = [one for one in maybe if floor(section_ns(one) * scale) >= length]
        ways = [before[one.number].negated() for one in long if one.number in before]
        parts.append((length - shorter, rows.board.any_of(ways) if len(ways) == len(long) else rows.board.true))
    return parts


def _add_blocking(rows: BusRows, number: int, least: Any, variable: Any, scale: Fraction) -> None:
    """Add rows for this type of the bus that the longest other frame has begun, or goes first."""
    board = rows.board
    where = [board.options[decision][option] for decision, option in rows.given.items()]
    bits = rows.bits_ns()
    if bits is None or None in bits:
        return
    for other in range(len(board.space.connections)):
        message = rows.message(other) if other != number else None
        if message is None:
            continue
        apart_from = [rider.literal.negated() for rider in message.riders if rider.number == number]
        riders = [rider for rider in message.riders if rider.number != number]
        form = floor(section_ns(message) * scale) + sum(floor(one.extra_ns * scale) * one.literal for one in riders)
        board.model.add(variable >= least + form).only_enforce_if([*where, message.own, *apart_from])


def _goes_first(rows: BusRows, other: Sent, own: Sequence[tuple[Any, int]]) -> Any:
    """A literal that is true only where the number of another message is lower than that of one; None: never.

    `own` are the numbers of that one, each with a literal.
    """
    board = rows.board
    pairs = [(literal, mine) for literal, number in other.numbers for mine, value in own if number < value]
    if len(pairs) == 1 and all(literal.index == board.true.index for literal in pairs[0]):
        return board.true
    return board.any_of(board.all_of(pair) for pair in pairs) if pairs else None
