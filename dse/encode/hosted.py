"""What threads of one executor wait for at least: rows of the jobs that go before theirs, or may have begun.

Whatever the kind of an executor, a job waits for one job of another thread there at least, if that is of another chain:
in the order of arrival for the longest of each chain, else for those that go first and one more
(`dse.analysis.executors`). Threads of one chain are left out, though their jobs may wait for each other all the same.
So these rows are necessary conditions, which say at once who cannot share an executor; what they leave open is learnt
(`dse.encode.contention`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.combined import Combined
from dse.encode.linear import Board
from dse.encode.places import Places, Thread
from dse.space.trees import at, leaves
from dse.space.types import Component, Space

MOST_ROWS = 4096
"""With more rows than this of a model none are added: they would cost more than they save."""


def add_hosted_rows(
    board: Board, places: Places, combined: Combined, number: int, scale: int, waiting: Callable[[int], cp_model.IntVar]
) -> None:
    """The rows of a thread, whose waiting is a variable in units of 1 / `scale` ns."""
    space: Space = board.space
    own = places.threads.get(number)
    fellows = [places.threads[other] for other in _fellows(space, number) if other in places.threads]
    if own is None or not fellows or not _always_works(space, own):
        return
    homes = {item.number: dict(_homes(board, item.number)) for item in (own, *fellows)}
    kinds = {home: _kinds(board, home) for home in homes[number]}
    if sum(len(homes[number]) * len(fellows) * len(kinds[home]) for home in kinds) > MOST_ROWS:
        return
    model = combined.model

    def work(thread: Thread) -> Any:
        literals = [combined.literal(index) for index, _ in thread.worst]
        return cp_model.LinearExpr.weighted_sum(literals, [scale * worst for _, worst in thread.worst])

    for home, here in homes[number].items():
        beside = [(item, homes[item.number][home]) for item in fellows if home in homes[item.number]]
        for item, there in beside:
            both = [combined.literal(here), combined.literal(there)]
            model.add(waiting(number) >= work(item)).only_enforce_if(both)
        for kind, literal in kinds[home]:
            first = [(item, there) for item, there in beside if kind == "wait_set" or _goes_first(item, own)]
            if kind == "fifo" or not first:
                continue
            shares = [_share(model, combined, work(item), item, there, scale) for item, there in first]
            less = [pair for pair in beside if pair not in first]
            for begun in (None, *less):
                total = sum(shares) + (0 if begun is None else work(begun[0]))
                held = [here, literal, *([] if begun is None else [begun[1]])]
                model.add(waiting(number) >= total).only_enforce_if([combined.literal(one) for one in held])


def _share(
    model: cp_model.CpModel, combined: Combined, work: Any, item: Thread, there: int, scale: int
) -> cp_model.IntVar:
    """The work of a job of a thread where it is in an executor, and nothing elsewhere."""
    share = model.new_int_var(0, scale * max(worst for _, worst in item.worst), "")
    model.add(share >= work).only_enforce_if(combined.literal(there))
    return share


def _fellows(space: Space, number: int) -> Iterator[int]:
    """The threads that may be in an executor with a thread, and are of other chains in every design."""
    own = space.components[number]
    homes = _possible(own)
    before = _before(space, number)
    for other, component in enumerate(space.components):
        if other == number or not homes & _possible(component) or not _is_whole(component):
            continue
        if number not in _before(space, other) and other not in before and _is_whole(own):
            yield other


def _is_whole(component: Component) -> bool:
    """Whether it is a thread without segments that is in an executor in every design."""
    return component.pieces is None and component.executor is not None and None not in leaves(component.executor)


def _possible(component: Component) -> set[int]:
    return set() if component.executor is None else {leaf for leaf in leaves(component.executor) if leaf is not None}


def _before(space: Space, number: int) -> set[int]:
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


def _always_works(space: Space, thread: Thread) -> bool:
    """Whether each job takes some time: one without work ends at its release."""
    component = space.components[thread.number]
    executes = all(leaf is not None for leaf in leaves(component.execution_ns))
    return executes and all(worst for _, worst in thread.worst)


def _homes(board: Board, number: int) -> Iterator[tuple[int, int]]:
    """The executors of a thread, each with a literal of its being in there."""
    found: dict[int, list[Any]] = {}
    tree = board.space.components[number].executor
    for literal, home in board.table(lambda view: at(tree, view)):
        found.setdefault(home, []).append(literal)
    for home, literals in found.items():
        yield home, board.any_of(literals).index


def _kinds(board: Board, home: int) -> list[tuple[str, int]]:
    """The kinds that an executor may have, each with a literal."""
    tree = board.space.executors[home].kind
    found: dict[str, list[Any]] = {}
    for literal, kind in board.table(lambda view: at(tree, view)):
        found.setdefault(kind, []).append(literal)
    return [(kind, board.any_of(literals).index) for kind, literals in found.items()]


def _goes_first(other: Thread, own: Thread) -> bool:
    """Whether another thread goes first in a callback group in every design, by priorities that are stated."""
    if other.priority is None or other.numbers or own.numbers:
        return False
    return own.priority is None or other.priority >= own.priority
