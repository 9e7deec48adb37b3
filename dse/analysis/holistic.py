"""Response times and the jitter that they pass on, as one fixed point.

Event-triggered threads inherit the streams of what triggers them, with the jitter that processing and transmission add
on the way (K. Tindell and J. Clark, "Holistic schedulability analysis for distributed hard real-time systems",
Microprocessing and Microprogramming 40, 1994).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

from dse.analysis.executors import Fellow, executor_response_ns, queued_ns
from dse.analysis.memo import Answering, Recall, knowing
from dse.analysis.overheads import interrupting
from dse.analysis.rates import NS_PER_S
from dse.analysis.releases import Streams, bounded_task, has_no_bound, is_lone, job_of, releases_of
from dse.analysis.reservations import before_task, blocking_ns
from dse.analysis.response_time import PLAIN, Stream, Task, is_plain, response_time_ns
from dse.analysis.segments import Segments, most_waiting_ns, single
from dse.analysis.tasks import TaskKey, alone_ns
from dse.analysis.turns import Turn
from dse.analysis.views import View
from dse.records import dataclass
from dse.space.hosts import ExecutorKind
from dse.space.trees import at, leaves
from dse.space.types import Component, Space
from dse.timelimit import look_at_the_clock
from dse.units import Exact

MOST_ROUNDS = 64
SHARED = 256
"""The number of tasks that designs share, for each thread: as many as its releases have jitter."""
KEPT_CORES = 4096
"""The number of cores whose response times are remembered."""


def fixed_point(space: Space, cores: Sequence[Sequence[Turn]], view: View) -> dict[TaskKey, Exact | None]:
    """Response times and inherited jitter, raised together until both stand still; what keeps growing has no bound."""
    known: dict[TaskKey, Exact | None] = {
        turn.key: alone_ns(space.components[turn.key[0]], turn.key[1], view)[1] for turns in cores for turn in turns
    }
    segments = Segments(space, cores, view)
    known |= {turn.key: segments.alone_ns(turn.key[0]) for turns in cores for turn in turns if turn.pieces}
    interrupts = [interrupting(space, [turn.key[0] for turn in turns[:1]], view) for turns in cores]
    rounds, changed, horizon = 0, True, _horizon_ns(space)
    asked = _answering(view, known)
    lone = _lone(space, cores, known, view, asked)
    before_that: list[list[Task | None]] = [[] for _ in cores]
    while changed:
        rounds, changed = rounds + 1, False
        look_at_the_clock()
        for place, (turns, before) in enumerate(zip(cores, interrupts, strict=True)):
            tasks = [
                None if has_no_bound(space, turn.key[0], known)
                else lone[turn.key] if turn.key in lone else _task(space, turn.key, known, view, asked)
                for turn in turns
            ]  # fmt: skip
            if rounds > 1 and all(map(_is_same, tasks, before_that[place])) and not any(turn.pieces for turn in turns):
                continue  # as in the round before
            before_that[place] = tasks
            together = None if asked is None or before else _on_core(turns, tasks)
            for number, turn in enumerate(turns):
                key = turn.key
                if together is not None:
                    found = together[number]
                else:
                    first = before_task(space, turns, turn, tasks, before, view)
                    rivals = [*first, *(tasks[position] for position in turn.rivals(turns))]
                    released = _thread_releases(space, turn.pieces[0], known, view) if turn.pieces else ((), None)
                    if turn.executor is None:
                        found = respond(*beside_piece(turn, turns, tasks, rivals), blocking_ns(turn))
                    else:
                        since = segments.since_ns(turn, known, *released) if turn.pieces else {}
                        found = _respond_in(space, turns, tasks, first, turn, view, since)
                    if turn.pieces:
                        again = ((released[0] or ()), released[1]) if turn.shares_turn(turns) else ((), None)
                        found = segments.end_ns(turn, found, known, *released, partial(_beside, rivals, again))
                if found is not None and rounds > 1 and (found > horizon or rounds > MOST_ROUNDS):
                    found = found if found == known[key] else None
                if known[key] is not None and found != known[key]:
                    known[key], changed = found, True
                    asked = asked if type(found) in PLAIN else None
    return known


def _beside(
    rivals: Sequence[Task | None], released: tuple[tuple[Stream, ...], int | None], worst_ns: int, blocked_ns: Exact
) -> Exact | None:
    return respond(Task("", worst_ns, *released), rivals, blocked_ns)


def beside_piece(
    turn: Turn, turns: Sequence[Turn], tasks: Sequence[Task | None], rivals: Sequence[Task | None]
) -> tuple[Task | None, Sequence[Task | None]]:
    """A task of a core, and what may delay it: a piece of a thread is one job, those before it have ended.

    Where it shares its turn with others these have waited for the pieces before it, which count as they do.
    """
    task = tasks[turns.index(turn)]
    if not turn.pieces or task is None:
        return task, rivals
    if turn.shares_turn(turns):
        return task, [*rivals, *(tasks[position] for position in turn.siblings(turns))]
    return single(task), rivals


def _thread_releases(
    space: Space, first: int, known: Mapping[TaskKey, Exact | None], view: View
) -> tuple[Streams, int | None]:
    """What releases a thread with segments, whose first piece is given, and the least time between two releases."""
    component = space.components[first]
    separation = at(component.period_ns, view) if at(component.protocol, view) == "sporadic" else None
    return releases_of(space, first, "thread", known, view), separation


def _answering(view: View, known: Mapping[TaskKey, Exact | None]) -> Answering | None:
    """A whole design that answers what is known; None where figures carry more than a number (`is_plain`)."""
    if type(view) is View and all(type(found) in PLAIN for found in known.values()):
        return Answering(view, known)
    return None


@dataclass(frozen=True)
class _Shared:
    """A task that designs share, and whether its releases depend on no other task."""

    task: Task | None
    is_lone: bool


_TASKS: Recall[_Shared] = Recall(SHARED)


def _shared(space: Space, key: TaskKey, view: View) -> _Shared:
    known: Any = knowing(view)
    return _Shared(bounded_task(space, key, known, view), is_lone(space, key, view))


def _task(
    space: Space, key: TaskKey, known: Mapping[TaskKey, Exact | None], view: View, asked: Answering | None
) -> Task | None:
    """A task as its releases are known; where the design answers, the same object wherever the answers are the same."""
    return bounded_task(space, key, known, view) if asked is None else _TASKS.recall(space, key, asked, _shared).task


def _lone(
    space: Space,
    cores: Sequence[Sequence[Turn]],
    known: Mapping[TaskKey, Exact | None],
    view: View,
    asked: Answering | None,
) -> dict[TaskKey, Task | None]:
    """The tasks whose releases depend on no other task: they stay as they are."""
    keys = [turn.key for turns in cores for turn in turns]
    if asked is None:
        return {key: bounded_task(space, key, known, view) for key in keys if is_lone(space, key, view)}
    # who chooses cores asks hundreds of times of a design; with the space, so that its id stays its own
    _, memory = view.memo.setdefault(("lone", id(space)), (space, {}))
    for key in keys:
        if key not in memory:
            memory[key] = _TASKS.recall(space, key, asked, _shared)
    return {key: memory[key].task for key in keys if memory[key].is_lone}


_CORES: dict[tuple[int, ...], tuple[Any, Any, list[Exact | None]]] = {}


def _on_core(turns: Sequence[Turn], tasks: Sequence[Task | None]) -> list[Exact | None] | None:
    """The response times of the tasks of a core that nothing else goes before, remembered by what shares it.

    None where an executor, a reservation or segments have a part in them.
    """
    key = (id(turns), *map(id, tasks))
    if (kept := _CORES.get(key)) is not None:  # once: another thread may empty it
        return kept[2]
    if any(turn.executor is not None or turn.pieces or turn.reservation is not None for turn in turns):
        return None
    are_plain = all(task is None or is_plain(task) for task in tasks)
    found = [
        respond(task, [tasks[position] for position in turn.rivals(turns)], blocking_ns(turn), are_plain=are_plain)
        for turn, task in zip(turns, tasks, strict=True)
    ]
    if len(_CORES) >= KEPT_CORES:
        _CORES.clear()
    _CORES[key] = turns, tasks, found  # which keeps alive whatever the key names
    return found


def _is_same(one: Task | None, other: Task | None) -> bool:
    """Whether two tasks have the same response time for sure."""
    if one is other:
        return True
    return one is not None and other is not None and is_plain(one) and is_plain(other) and one == other


def _horizon_ns(space: Space) -> int:
    """Ten times the longest period: response times that grow beyond it by their own jitter have no bound."""
    for components, known in _HORIZON:
        if components is space.components:
            return known
    periods = [leaf for item in space.components for leaf in leaves(item.period_ns) if leaf is not None]
    found: int = 10 * max(periods, default=NS_PER_S)
    _HORIZON[:] = [(space.components, found)]
    return found


_HORIZON: list[tuple[tuple[Component, ...], int]] = []
"""That of the components that were asked about last."""


def respond(
    task: Task | None, rivals: Sequence[Task | None], blocked_ns: Exact, *, are_plain: bool = False
) -> Exact | None:
    """The response time of a task under those that may delay it; `are_plain` where all their times are mere numbers."""
    given = [rival for rival in rivals if rival is not None]
    if task is None or len(given) < len(rivals):
        return None
    if type(blocked_ns) in PLAIN and (are_plain or all(map(is_plain, (task, *given)))):
        return _respond_alone(task, tuple(given), blocked_ns)
    return response_time_ns(task, given, blocked_ns)


def around(
    space: Space,
    turns: Sequence[Turn],
    tasks: Sequence[Task | None],
    before: Sequence[Task | None],
    turn: Turn,
    view: View,
) -> tuple[ExecutorKind, dict[int, Fellow], list[Task]] | None:
    """The kind of an executor, what it runs beside a task, by number, and what preempts that; None without a bound.

    Of a less urgent callback of its group one job may have begun before a task, however often it comes.
    """
    assert turn.executor is not None
    kind: ExecutorKind = at(space.executors[turn.executor].kind, view)
    fellows: dict[int, Fellow] = {}
    higher = [item for item in before if item is not None]
    if len(higher) < len(before):
        return None
    for position in turn.rivals(turns):
        found, other = tasks[position], turns[position]
        is_inside, goes_first = other.executor == turn.executor, other.level <= turn.level
        if found is None and counts_once(space, turn, other, view):
            found = job_of(space, other.key, (), None, view)
        if found is None:
            return None
        if is_inside:
            fellows[position] = Fellow(found, goes_first)
        else:
            higher.append(found)
    return kind, fellows, higher


def counts_once(space: Space, turn: Turn, other: Turn, view: View) -> bool:
    """Whether one job of another task may have begun before a task, and no more of them matter."""
    if turn.executor is None or other.executor != turn.executor or other.level <= turn.level:
        return False
    kind: ExecutorKind = at(space.executors[turn.executor].kind, view)
    return kind == "callback_group"


def _respond_in(
    space: Space,
    turns: Sequence[Turn],
    tasks: Sequence[Task | None],
    before: Sequence[Task | None],
    turn: Turn,
    view: View,
    since_ns: Mapping[int, Exact],
) -> Exact | None:
    """The response time of a task in an executor; each piece of its thread has ended so long `since_ns` before it."""
    found, task = around(space, turns, tasks, before, turn, view), tasks[turns.index(turn)]
    if found is None or task is None:
        return None
    kind, beside, higher = found
    blocked = blocking_ns(turn)
    if not turn.pieces:
        return _respond_to(kind, task, list(beside.values()), higher, blocked)
    siblings = [tasks[position] for position in turn.siblings(turns)]
    own = [item for item in siblings if item is not None]
    if len(own) < len(siblings):
        return None
    if kind == "fifo" and not higher:
        waiting = most_waiting_ns(space, {turns[position].key[0]: item.task for position, item in beside.items()})
        if waiting is not None:
            return task.worst_ns + turn.blocked_ns + waiting
        found_ns = queued_ns(task, own, [item.task for item in beside.values()])
        return None if found_ns is None else found_ns + turn.blocked_ns
    if kind != "callback_group" or higher or turn.shares_turn(turns):
        fellows = [*beside.values(), *(Fellow(item, True) for item in own)]
        return _respond_to(kind, task, fellows, higher, blocked)
    ran = [(tasks[at], since_ns[one.key[0]]) for at, one in enumerate(turns) if one.key[0] in since_ns]
    return _behind_own(task, [(one, time) for one, time in ran if one is not None], list(beside.values()), blocked)


def _behind_own(
    task: Task, own: Sequence[tuple[Task, Exact]], fellows: Sequence[Fellow], blocked_ns: Exact
) -> Exact | None:
    """The response time of a piece on an accelerator that serves by priority.

    Something less urgent may have begun before all that is more urgent came, or an earlier piece of its `own` thread:
    that has ended some time before the piece is released, and kept it from nothing, but what came since goes first.
    """
    job = single(task)
    longest = _respond_to("callback_group", job, fellows, [], blocked_ns)
    urgent = [item for item in fellows if item.goes_first]
    for item, time in own if urgent else ():
        found = _respond_to("callback_group", job, urgent, [], item.worst_ns)
        if found is None or longest is None:
            return None
        longest = max(longest, found - item.worst_ns - time)
    return longest


def _respond_to(
    kind: ExecutorKind, task: Task, fellows: Sequence[Fellow], higher: Sequence[Task], blocked: Exact
) -> Exact | None:
    if type(blocked) in PLAIN and all(map(is_plain, (task, *higher, *(item.task for item in fellows)))):
        return _respond_in_alone(kind, task, tuple(fellows), tuple(higher), blocked)
    return executor_response_ns(kind, task, fellows, higher, blocked)


@lru_cache(16384)
def _respond_in_alone(
    kind: ExecutorKind, task: Task, fellows: tuple[Fellow, ...], higher: tuple[Task, ...], blocked_ns: Exact
) -> Exact | None:
    return executor_response_ns(kind, task, fellows, higher, blocked_ns)


@lru_cache(16384)
def _respond_alone(task: Task, rivals: tuple[Task, ...], blocked_ns: Exact) -> Exact | None:
    """`response_time_ns`, remembered: from round to round, and from design to design, most tasks meet the same."""
    return response_time_ns(task, rivals, blocked_ns)
