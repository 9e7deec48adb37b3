"""The response time of one task where it runs, as the releases of all that shares its core are known.

Under fixed priorities (`dse.analysis.scheduling.response_time`), in an executor or on an accelerator
(`dse.analysis.scheduling.servers.executors`), and as a piece of a thread with segments
(`dse.analysis.scheduling.servers.segments`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

from dse.analysis.scheduling.releases import job_of
from dse.analysis.scheduling.response_time import PLAIN, Task, is_plain, response_time_ns
from dse.analysis.scheduling.servers.executors import Fellow, executor_response_ns
from dse.analysis.scheduling.servers.queues import queued_ns
from dse.analysis.scheduling.servers.reservations import blocking_ns
from dse.analysis.scheduling.servers.segments import single
from dse.analysis.scheduling.servers.succession import Succession, longest_of_each
from dse.analysis.scheduling.turns import Turn
from dse.analysis.views import View
from dse.space.model.space import ExecutorKind, Space
from dse.space.model.trees import at
from dse.support.units import Exact


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


def respond(
    task: Task | None, rivals: Sequence[Task | None], blocked_ns: Exact, *, are_plain: bool = False
) -> Exact | None:
    """The response time of a task under those that may delay it; `are_plain` where all their times are mere numbers."""
    if task is not None and not task.worst_ns:
        return 0
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
    succession: Succession,
) -> tuple[ExecutorKind, dict[int, Fellow], list[Task], bool] | None:
    """The kind of an executor, what it runs beside a task, by number, and what preempts that; None without a bound.

    At last whether the task is in a line (`executor_response_ns`). Of a less urgent callback of its group one job may
    have begun before a task, however often it comes.
    """
    assert turn.executor is not None
    view = succession.view
    kind: ExecutorKind = at(space.executors[turn.executor].kind, view)
    beside: dict[int, Task] = {}
    higher = [item for item in before if item is not None]
    if len(higher) < len(before):
        return None
    for position in turn.rivals(turns):
        found, other = tasks[position], turns[position]
        if found is None and counts_once(space, turn, other, view):
            found = job_of(space, other.key, (), None, view)
        if found is None:
            return None
        if other.executor == turn.executor:
            beside[position] = found
        else:
            higher.append(found)
    chains = succession.chains(turn.executor)
    working = [*(position for position, item in beside.items() if item.worst_ns), turns.index(turn)]
    sections = [space.components[turns[position].key[0]].section_ns for position in working]
    # in lines: no earlier job of its own waits, and no section that is over has held up what preempts it
    is_in_line = kind == "fifo" and chains.line(turn) is not None and (not higher or not any(sections))
    fellows = {}
    for position, task in beside.items():
        other = turns[position]
        line = chains.line(other) if is_in_line else None
        fellows[position] = Fellow(task, turn.goes_first_inside(other), chains.never_meet(turn, other), line)
    return kind, fellows, higher, is_in_line


def counts_once(space: Space, turn: Turn, other: Turn, view: View) -> bool:
    """Whether one job of another task may have begun before a task, and no more of them matter."""
    if turn.executor is None or other.executor != turn.executor or turn.goes_first_inside(other):
        return False
    kind: ExecutorKind = at(space.executors[turn.executor].kind, view)
    return kind == "callback_group"


def respond_in(
    space: Space,
    turns: Sequence[Turn],
    tasks: Sequence[Task | None],
    before: Sequence[Task | None],
    turn: Turn,
    succession: Succession,
    since_ns: Mapping[int, Exact],
) -> Exact | None:
    """The response time of a task in an executor; each piece of its thread has ended so long `since_ns` before it."""
    task = tasks[turns.index(turn)]
    if task is None:
        return None
    if not task.worst_ns and not turn.pieces:
        return 0
    found = around(space, turns, tasks, before, turn, succession)
    if found is None:
        return None
    kind, beside, higher, is_in_line = found
    blocked = blocking_ns(turn)
    if not turn.pieces:
        return _respond_to(kind, task, list(beside.values()), higher, blocked, is_in_line=is_in_line)
    siblings = [tasks[position] for position in turn.siblings(turns)]
    own = [item for item in siblings if item is not None]
    if len(own) < len(siblings):
        return None
    if kind == "fifo" and not higher:
        waiting = longest_of_each([(item.task, item.line) for item in beside.values()])
        if waiting is not None:
            return task.worst_ns + turn.blocked_ns + sum(item.worst_ns for item in waiting)
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
    kind: ExecutorKind,
    task: Task,
    fellows: Sequence[Fellow],
    higher: Sequence[Task],
    blocked: Exact,
    *,
    is_in_line: bool = False,
) -> Exact | None:
    if type(blocked) in PLAIN and all(map(is_plain, (task, *higher, *(item.task for item in fellows)))):
        return _respond_in_alone(kind, task, tuple(fellows), tuple(higher), blocked, is_in_line)
    return executor_response_ns(kind, task, fellows, higher, blocked, is_in_line=is_in_line)


@lru_cache(16384)
def _respond_in_alone(
    kind: ExecutorKind,
    task: Task,
    fellows: tuple[Fellow, ...],
    higher: tuple[Task, ...],
    blocked_ns: Exact,
    is_in_line: bool,
) -> Exact | None:
    return executor_response_ns(kind, task, fellows, higher, blocked_ns, is_in_line=is_in_line)


@lru_cache(16384)
def _respond_alone(task: Task, rivals: tuple[Task, ...], blocked_ns: Exact) -> Exact | None:
    """`response_time_ns`, remembered: from round to round, and from design to design, most tasks meet the same."""
    return response_time_ns(task, rivals, blocked_ns)
