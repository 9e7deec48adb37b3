"""Frames of several connections in the rows of a bus: a literal for each pair of a head and what it may carry."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from dse.analysis.messages.frames import added
from dse.encode.linear import Board
from dse.space.model.trees import Choice
from dse.support.units import Exact


@dataclass(frozen=True)
class Rider:
    """A connection in the message of another one where a literal is true: when it is due, and what it adds, in ns."""

    number: int
    literal: Any
    extra_ns: Exact
    limit_ns: Exact | None


def own_literal(board: Board, number: int) -> Any:
    """The literal of a connection's having a message of its own."""
    tree = board.space.connections[number].carried_in
    return board.options[tree.decision][tree.branches.index(None)] if isinstance(tree, Choice) else board.true


def riders_of(board: Board, bus: int, number: int, alone: Mapping[int, int]) -> list[Rider]:
    """The connections that may be carried in the message of another one on a bus, with the literals of where they are.

    `alone` are options with which none is (`dse.analysis.messages.frames.apart`).
    """
    return [
        Rider(
            rider,
            board.all_of(board.options[decision][option] for decision, option in case.conditions),
            case.value.extra_ns,
            case.value.limit_ns,
        )
        for rider in board.space.connections[number].riders
        for case in added(board.space, bus, number, rider, alone)
    ]


def due_riders(riders: Iterable[Rider], time: Exact, limited: Mapping[int, int | None]) -> Iterator[Rider]:
    """The connections that are carried in a message and due by a time, of those with a limit."""
    for item in riders:
        if item.number in limited and item.limit_ns is not None and item.limit_ns <= time:
            yield item
