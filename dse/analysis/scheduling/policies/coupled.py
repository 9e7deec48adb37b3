"""Threads that others on their core release: how often they come in a busy window of some priority.

From the beginning of a busy window until its end the core runs what is at least as urgent, and nothing else. A thread
whose predecessor there is less urgent than that comes once at most in the window: its predecessor ends no job
meanwhile. One that is released at once by a predecessor as urgent comes no more often than that: what this had released
before has ended (docs/semantics.md, section 4.9).

That is counted where the file states cores and priorities. Where they are decisions a thread that joins a core would
make bounds less, and what is learnt of few threads would not hold of more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from dse.analysis.scheduling.busy_window import Task
from dse.analysis.scheduling.event_models import EventModels, once
from dse.analysis.scheduling.model import Resource, Stage
from dse.analysis.scheduling.tasks import TaskKey


def has_coupled(stages: Mapping[TaskKey, Stage], resource: Resource) -> bool:
    """Whether a thread of a resource is released by another one on the same stated core."""
    return any(before_on_core(stages, stages[entry.key]) is not None for entry in resource.entries)


def in_window(
    events: EventModels, resource: Resource, level: TaskKey, tasks: Sequence[Task | None]
) -> Sequence[Task | None]:
    """The stages of a resource as they come in a busy window of the priority of one of them.

    `tasks` are they as they come at any time; None is one that comes without a bound.
    """
    stated = events.stages[level].stated
    if stated is None:
        return tasks
    found: list[Task | None] = []
    for entry, task in zip(resource.entries, tasks, strict=True):
        stage = events.stages[entry.key]
        head = _head_of(events.stages, stage, stated.priority)
        if head is None:
            found.append(once(stage))
        else:
            found.append(task if head is stage else events.released_as(stage.key, head.key))
    return found


def _head_of(stages: Mapping[TaskKey, Stage], stage: Stage, priority: int) -> Stage | None:
    """The stage of whose releases one comes no more often than in windows of a priority; None of one that comes once.

    What a less urgent one has sent when the window begins is one message at most where that takes less than any job of
    it, and none of its work has begun that nothing interrupts.
    """
    passed = [stage]
    while (before := before_on_core(stages, passed[-1])) is not None and before not in passed:
        link, other = passed[-1].follows, before.stated
        assert link is not None
        assert other is not None
        if other.priority < priority:
            return None if is_soon(passed[-1], before) else passed[-1]
        if link.most_ns:
            break
        passed.append(before)
    return passed[-1]


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
