"""Frames of several connections in the rows of a bus: what each connection that may be carried adds to a message.

A frame is known by its head, the connection whose message it is. Where all bytes take as long as any other (CAN) each
connection that is carried adds its own part, so that a row has a literal for each pair of a head and another connection
instead of one for each combination; in other frames (CAN FD fills up) what is carried adds nothing in rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from dse.analysis.messages.stages import candidate_of, limit_ns
from dse.analysis.scheduling.resolve import released_undelayed
from dse.analysis.usage import ADDITIVE
from dse.analysis.views import Case, PartialView, View, tabulate
from dse.encode.linear import Board
from dse.space.architecture.frames import MOST_BYTES, frame_at, wire_ns
from dse.space.model.space import Space
from dse.space.model.trees import Choice, at
from dse.support.units import Exact

MOST_CASES = 16
"""A connection with more combinations of options than this adds nothing in rows."""


@dataclass(frozen=True)
class Rider:
    """A connection in the message of another one where a literal is true: when it is due, and what it adds, in ns."""

    number: int
    literal: Any
    extra_ns: Exact
    limit_ns: Exact | None


def apart(space: Space, number: int, given: Mapping[int, int]) -> dict[int, int]:
    """The options `given` and those with which the message of a connection has its own data alone.

    Decisions by number, with their options; what is always carried in it stays.
    """
    found = dict(given)
    own = space.connections[number].carried_in
    if isinstance(own, Choice):
        found[own.decision] = own.branches.index(None)
    for rider in space.connections[number].riders:
        tree = space.connections[rider].carried_in
        if isinstance(tree, Choice) and tree.decision not in space.fixed:
            others = [option for option, head in enumerate(tree.branches) if head != number]
            found[tree.decision] = next((item for item in others if tree.branches[item] is None), others[0])
    return found


def has_own_message(space: Space, number: int) -> bool:
    """Whether a connection has a message of its own in some design, as far as the options that are fixed say."""
    tree = space.connections[number].carried_in
    if isinstance(tree, Choice) and tree.decision in space.fixed:
        tree = tree.branches[space.fixed[tree.decision]]
    return None in tree.branches if isinstance(tree, Choice) else tree is None


def own_literal(board: Board, number: int) -> Any:
    """The literal of a connection's having a message of its own."""
    tree = board.space.connections[number].carried_in
    return board.options[tree.decision][tree.branches.index(None)] if isinstance(tree, Choice) else board.true


def riders_of(board: Board, bus: int, number: int, alone: Mapping[int, int]) -> list[Rider]:
    """What may be carried in the message of a connection on a bus, with the literals of where it is.

    `alone` are options with which nothing is (`apart`).
    """
    space = board.space
    found: list[Rider] = []
    for rider in space.connections[number].riders:
        tree = space.connections[rider].carried_in
        if not isinstance(tree, Choice) or tree.decision not in alone:
            continue
        for case in _added(space, bus, number, rider, alone) or ():
            option = tree.branches.index(number)
            held = [board.options[tree.decision][option], *(board.options[one][item] for one, item in case.conditions)]
            found.append(Rider(rider, board.all_of(held), *case.value))
    return found


def _added(
    space: Space, bus: int, number: int, rider: int, alone: Mapping[int, int]
) -> list[Case[tuple[Exact, Exact | None]]] | None:
    """What a connection adds to a message, and how long it may take."""
    tree = space.connections[rider].carried_in
    together = {**alone, tree.decision: tree.branches.index(number)}

    def formula(view: View) -> tuple[Exact, Exact | None]:
        limit = limit_ns(space, bus, rider, view)
        frame = frame_at(space.buses[bus].fixed_ns, view)
        if frame is not None and frame.protocol not in ADDITIVE:
            return 0, limit
        without = PartialView({**view.design, tree.decision: alone[tree.decision]})
        return _longest(space, bus, number, view) - _longest(space, bus, number, without), limit

    return tabulate(space, formula, MOST_CASES, together)


def _longest(space: Space, bus: int, number: int, view: View) -> Exact:
    (task,) = released_undelayed(space, view, [(number, "message")]).values()
    return candidate_of(space, bus, number, view, task).last_ns


def longest_frame_ns(space: Space, bus: int, view: View) -> Exact | None:
    """The time of a frame with all the data that it can have; None where there is no such limit."""
    frame = frame_at(space.buses[bus].fixed_ns, view)
    if frame is None or frame.protocol not in MOST_BYTES:
        return None
    return wire_ns(frame, MOST_BYTES[frame.protocol], at(space.buses[bus].bandwidth_bps, view))[1]


def due_riders(riders: list[Rider], time: Exact, limited: Mapping[int, int | None]) -> Iterator[Rider]:
    """The connections that are carried in a message and due by a time, of those with a limit."""
    for item in riders:
        if item.number in limited and item.limit_ns is not None and item.limit_ns <= time:
            yield item
