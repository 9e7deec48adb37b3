"""What threads of one executor wait for at least: rows of the jobs that go before theirs, or may have begun.

Whatever the kind of an executor, a job waits for one job of another thread there at least, if that is of another chain:
in the order of arrival for the longest of each chain, else for those that go first and one more
(`dse.analysis.scheduling.policies.executors`). Threads of one chain are left out, though their jobs may wait for each
other all the same. So these rows are necessary conditions, which say at once who cannot share an executor; what they
leave open is learnt (`dse.encode.scheduling.contention`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

from ortools.sat.python import cp_model

from dse.encode.linear import Board
from dse.encode.scheduling.combined import Combined
from dse.encode.scheduling.threads import Places, Thread
from dse.space.model.space import Component, Space
from dse.space.model.trees import Tree, at, leaves

MOST_ROWS = 512
"""A thread that would have more rows than this has none: they would cost more than they save."""


class Waiting(Protocol):
    """The interface of the waiting times of a model that these rows use (`dse.encode.scheduling.waiting.WaitRows`)."""

    places: Places
    combined: Combined
    scale: int

    @property
    def model(self) -> cp_model.CpModel:
        """The model that the rows are in."""

    def waiting(self, number: int) -> cp_model.IntVar:
        """The variable of a thread's waiting."""

    def work(self, thread: Thread) -> Any:
        """The longest time of a thread's job in the model's unit."""

    def executes(self, number: int) -> bool:
        """Whether a thread executes something in every design."""


def add_hosted_rows(board: Board, waiting: Waiting, number: int) -> None:
    """The rows of a thread, whose waiting is a variable."""
    threads, components = waiting.places.threads, board.space.components
    fellows = [threads[other] for other in _fellows(board.space, number) if other in threads]
    if not fellows or not waiting.executes(number) or not all(worst for _, worst in threads[number].worst):
        return
    own = _by_value(board, components[number].executor)
    kinds = {home: _by_value(board, board.space.executors[home].kind) for home in own}
    if len(fellows) * sum(1 + len(found) for found in kinds.values()) > MOST_ROWS:
        return
    places = {item.number: _by_value(board, components[item.number].executor) for item in fellows}

    def at_least(work: Any, *literals: int) -> None:
        held = [waiting.combined.literal(one) for one in literals]
        waiting.model.add(waiting.waiting(number) >= work).only_enforce_if(held)

    for home, here in own.items():
        beside = [(item, places[item.number][home]) for item in fellows if home in places[item.number]]
        for item, there in beside:
            at_least(waiting.work(item), here, there)
        for kind, literal in kinds[home].items():
            first = [
                pair for pair in beside if kind in ("wait_set", "polling") or _goes_first(pair[0], threads[number])
            ]
            if kind == "fifo" or not first:
                continue
            shares = sum(_share(waiting, item, there) for item, there in first)
            at_least(shares, here, literal)
            for begun, there in (pair for pair in beside if pair not in first):
                at_least(shares + waiting.work(begun), here, literal, there)


def _share(waiting: Waiting, item: Thread, there: int) -> cp_model.IntVar:
    """The work of a job of a thread where it is in an executor, and nothing elsewhere."""
    share = waiting.model.new_int_var(0, waiting.scale * max(worst for _, worst in item.worst), "")
    waiting.model.add(share >= waiting.work(item)).only_enforce_if(waiting.combined.literal(there))
    return share


def _by_value(board: Board, tree: Tree) -> dict[Any, int]:
    """What a tree may be, each with a literal of its being so."""
    found: dict[Any, list[Any]] = {}
    for literal, value in board.table(lambda view: at(tree, view)):
        found.setdefault(value, []).append(literal)
    return {value: board.any_of(literals).index for value, literals in found.items()}


def _fellows(space: Space, number: int) -> Iterator[int]:
    """The threads that may be in an executor with a thread, and are of other chains in every design."""
    own = space.components[number]
    if not _is_whole(own):
        return
    homes, before = set(leaves(own.executor)), _sources(space, number)
    for other, component in enumerate(space.components):
        if other == number or other in before or not _is_whole(component):
            continue
        if homes & set(leaves(component.executor)) and number not in _sources(space, other):
            yield other


def _is_whole(component: Component) -> bool:
    """Whether it is a thread without segments that is in an executor in every design."""
    return component.pieces is None and component.executor is not None and None not in leaves(component.executor)


def _sources(space: Space, number: int) -> set[int]:
    """Whatever may release a component, directly or by way of others."""
    found: set[int] = set()
    todo = [number]
    while todo:
        for wire in space.components[todo.pop()].triggers:
            sender = space.connections[wire].sender
            if sender is not None and sender not in found:
                found.add(sender)
                todo.append(sender)
    return found


def _goes_first(other: Thread, own: Thread) -> bool:
    """Whether another thread goes first in a callback group in every design, by priorities that are stated."""
    if other.priority is None or other.numbers or own.numbers:
        return False
    return own.priority is None or other.priority >= own.priority
