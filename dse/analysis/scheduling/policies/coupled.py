"""Threads that others on their core release: how often they come in a busy window of some priority.

From the beginning of a busy window until its end the core runs what is at least as urgent, and nothing else. A thread
whose predecessor there is less urgent than that comes once at most in the window: its predecessor ends no job
meanwhile. One that is released at once by a predecessor as urgent comes no more often than that: what this had released
before has ended. When the window begins one less urgent thread at most has just ended, or has a section that nothing
interrupts: what others of these release at once does not come. In that case what comes before that thread in its chain
comes later than it may come otherwise (docs/semantics.md, section 4.9).

That is counted where the file states cores and priorities. Where they are decisions a thread that joins a core would
make bounds less, and what is learnt of few threads would not hold of more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from dse.analysis.scheduling.busy_window import Stream, Task, TaskKey
from dse.analysis.scheduling.event_models import EventModels, once
from dse.analysis.scheduling.model import Resource, Stage
from dse.support.units import Exact, picked

NOT_THERE = Task("", 0, ())
"""In place of a stage that does not come in a window."""


def has_coupled(stages: Mapping[TaskKey, Stage], resource: Resource) -> bool:
    """Whether a thread of a resource is released by another one on the same stated core."""
    return any(before_on_core(stages, stages[entry.key]) is not None for entry in resource.entries)


def cases_in_window(
    events: EventModels,
    resource: Resource,
    level: TaskKey,
    first: int,
    tasks: Sequence[Task | None],
    pieces: int | None = 1,
) -> list[Sequence[Task | None]]:
    """The stages of a resource as they come in a busy window of the priority of one of them, in each case there is.

    `tasks` are they as they come at any time; None is one that comes without a bound, `NOT_THERE` one that does not
    come. The window is that of the stage at the position `first`, or of a chain that begins with it and is under way
    between so many `pieces` (None: as many as come). Each of these may begin behind another less urgent thread.
    """
    stated = events.stages[level].stated
    if stated is None:
        return [tasks]
    found: list[Task | None] = []
    behind: dict[TaskKey, list[int]] = {}
    for position, (entry, task) in enumerate(zip(resource.entries, tasks, strict=True)):
        stage = events.stages[entry.key]
        head, less_urgent = _head_of(events.stages, stage, stated.priority)
        comes = task if head is stage else events.released_as(stage.key, head.key)
        is_own = pieces != 1 and position == first
        if less_urgent is None or not is_soon(head, less_urgent) or is_own or pieces is None:
            found.append(comes)
        elif pieces > 1:
            found.append(replace(once(stage) if comes is None else comes, most=pieces))
        else:
            found.append(once(stage))
            if not _sent_ns(head):
                behind.setdefault(less_urgent.key, []).append(position)
    if not behind:
        return [found]
    grouped = {position for members in behind.values() for position in members}
    own = next((key for key, members in behind.items() if first in members), None)
    ended: list[TaskKey | None] = [None, *behind] if own is None else [own]
    cases: list[Sequence[Task | None]] = []
    for less_urgent_key in ended:
        there = set() if less_urgent_key is None else behind[less_urgent_key]
        case = [
            NOT_THERE if position in grouped and position not in there else task for position, task in enumerate(found)
        ]
        if less_urgent_key is not None:
            _delay(events, resource, less_urgent_key, first, case)
        cases.append(case)
    return cases


def _head_of(stages: Mapping[TaskKey, Stage], stage: Stage, priority: int) -> tuple[Stage, Stage | None]:
    """The stage of whose releases one comes no more often than in windows of a priority.

    With it the less urgent stage that releases that one, if such a one does.
    """
    passed = [stage]
    while (before := before_on_core(stages, passed[-1])) is not None and before not in passed:
        assert before.stated is not None
        if before.stated.priority < priority:
            return passed[-1], before
        if _sent_ns(passed[-1]):
            break
        passed.append(before)
    return passed[-1], None


def _sent_ns(stage: Stage) -> Exact:
    """How long a message takes at most that releases a stage behind another one."""
    assert stage.follows is not None
    return stage.follows.most_ns


def _delay(events: EventModels, resource: Resource, key: TaskKey, first: int, case: list[Task | None]) -> None:
    """Let what comes before a stage in its chain come as late as it does where that stage has just ended.

    The next job of the chain begins a period after that one, which ends no later than its bound. The stage at the
    position `first`, whose window it is, comes as before: else a bound would fall when another stage joins the core.
    """
    passed_on = events.leaving(key)
    way = list(_way_up(events.stages, key))
    if passed_on is None or len(passed_on) != 1 or not way or events.stages[way[-1][0]].separation_ns is not None:
        return
    (last,), shortest = passed_on, dict(way)
    for position, entry in enumerate(resource.entries):
        task = case[position]
        if position == first or entry.key not in shortest or task is None:
            continue
        if task.separation_ns is not None or len(task.streams) != 1:
            continue
        (stream,) = task.streams
        if stream.period_ns == last.period_ns:
            later = last.jitter_ns + shortest[entry.key] - last.period_ns
            case[position] = replace(task, streams=(Stream(stream.period_ns, picked("min", stream.jitter_ns, later)),))


def _way_up(stages: Mapping[TaskKey, Stage], key: TaskKey) -> Iterator[tuple[TaskKey, Exact]]:
    """The stages before one in its chain, the nearest first, each with the least time from its release to that end."""
    least: Exact = stages[key].best_ns
    passed = {key}
    while (link := stages[key].follows) is not None and link.after is not None and link.after not in passed:
        key = link.after
        if stages[key].pieces:
            return
        passed.add(key)
        least += link.least_ns + stages[key].best_ns
        yield key, least


def is_soon(stage: Stage, before: Stage) -> bool:
    """Whether a message takes less from the stage before than any job of that, so that one at most is on its way.

    That depends on the shortest execution time: where it is longer, busy windows may hold less.
    """
    link = stage.follows
    assert link is not None
    return bool(not link.most_ns or (link.most_ns < before.best_ns and not before.has_section))


def before_on_core(stages: Mapping[TaskKey, Stage], stage: Stage) -> Stage | None:
    """The stage whose end releases one, where both are on one stated core with stated priorities, and take time."""
    link = stage.follows
    if stage.stated is None or link is None or link.after is None:
        return None
    before = stages[link.after]
    is_there = before.stated is not None and before.stated.shares_core(stage.stated) and before.cost_ns != 0
    return before if is_there else None
