"""Which threads of an executor never wait at the same time: those of one chain, where each job ends before the next.

A thread that only the end of another releases has a job after each of that one's. Where the job of a thread's last
successor always ends before the thread is released again, a job of the chain is never released while an earlier one
waits: the jobs of the chain do not delay each other. (Of all jobs that end later than their bounds one would be first:
until then what the others' bounds rest on has held, and so its own; docs/semantics.md, section 4.6.)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from dse.analysis.scheduling.busy_window import Task
from dse.analysis.scheduling.event_models import EventModels
from dse.analysis.scheduling.model import Resource, Stage
from dse.analysis.scheduling.policies.segments import apart_ns
from dse.analysis.scheduling.tasks import TaskKey
from dse.support.units import Exact


class Chains:
    """Which stages of an executor never wait at the same time, as response times are known when it is made.

    `keys` are the whole threads that it runs, but for callbacks of hybrid ones.
    """

    def __init__(self, events: EventModels, keys: Sequence[TaskKey]) -> None:
        self.events, self.keys = events, keys
        self._apart: dict[TaskKey, Exact | None] = {}
        """The least time between two releases of a stage; None of one release, or of any lateness."""
        self._first: dict[TaskKey, TaskKey] = {}
        """The first of each stage's chain in the executor."""
        self._pairs: set[tuple[TaskKey, TaskKey]] = set()
        """Of each pair the one that comes before, or the same."""
        there = set(keys)
        for key in keys:
            ways = list(self._spans_to(key))
            is_over = [self._is_apart(first, span) for first, span in ways]
            for position, (first, _) in enumerate(ways):
                if first in there:
                    self._first[key] = first
                    if any(is_over[position:]):
                        self._pairs.add((first, key))

    def _response_ns(self, key: TaskKey) -> Exact | None:
        """The longest time of a job from its release to its end."""
        alone = self.events.stages[key].worst_ns
        found = self.events.ends.get(key, alone)
        return None if found is None else max(found, alone)

    def _spans_to(self, key: TaskKey) -> Iterator[tuple[TaskKey, Exact]]:
        """A stage and all before it in its chain, with the longest time from the release of that to its own end."""
        span, last, seen = self._response_ns(key), key, {key}
        while span is not None:
            yield last, span
            link = self.events.stages[last].follows
            if link is None or link.after is None or link.after in seen:
                return
            response = self._response_ns(link.after)
            if response is None:
                return
            span, last = span + link.most_ns + response, link.after
            seen.add(last)

    def _is_apart(self, key: TaskKey, span: Exact) -> bool:
        """Whether so long a time is over when a stage is released again."""
        if key not in self._apart:
            streams = self.events.streams(key)
            self._apart[key] = None if streams is None else apart_ns(streams, self.events.stages[key].separation_ns)
        apart = self._apart[key]
        return apart is not None and span <= apart

    def never_meet(self, one: Stage, other: Stage) -> bool:
        """Whether two stages are of one chain, and never wait at the same time; one alone with its next job.

        Judged by the response times that are known when the object is made.
        """
        return _is_whole(one) and _is_whole(other) and self._follow(one.key, other.key)

    def _follow(self, one: TaskKey, other: TaskKey) -> bool:
        return (one, other) in self._pairs or (other, one) in self._pairs

    def line(self, stage: Stage) -> TaskKey | None:
        """A line of stages of which at most one job waits at a time; None of one that may wait twice.

        It has all that follow its first stage in the executor, or one stage, or the pieces of one thread.
        """
        if stage.pieces:
            return stage.first
        return self._lines.get(stage.key) if _is_whole(stage) else None

    @cached_property
    def _lines(self) -> Mapping[TaskKey, TaskKey]:
        members: dict[TaskKey, list[TaskKey]] = {}
        for key, first in self._first.items():
            members.setdefault(first, []).append(key)
        found: dict[TaskKey, TaskKey] = {}
        for first, line in members.items():
            is_one = all(self._follow(one, other) for index, one in enumerate(line) for other in line[index:])
            found |= {key: first if is_one else key for key in line if self._follow(key, key)}
        return found


class Succession:
    """The chains in the executors of a resource, as response times are known when one is first asked about.

    Chains depend on response times, so that there is one object for each round of the fixed point.
    """

    def __init__(self, events: EventModels, resource: Resource) -> None:
        self.events, self.resource = events, resource
        self._chains: dict[int, Chains] = {}

    def chains(self, executor: int) -> Chains:
        """The chains of one executor.

        Made on the first call for an executor; `executor` is its number.
        """
        if executor not in self._chains:
            stages = self.events.stages
            inside = (item.key for item in self.resource.entries if item.executor == executor)
            self._chains[executor] = Chains(self.events, [key for key in inside if _is_whole(stages[key])])
        return self._chains[executor]


def _is_whole(stage: Stage) -> bool:
    """Whether a stage is all of a thread, but for a hybrid one's callback."""
    return stage.key[1] == "thread" and not stage.pieces


def longest_of_each(tasks: Sequence[tuple[Task, TaskKey | None]]) -> list[Task] | None:
    """The task of each line that takes longest, the first of several; None where one that takes time is in no line.

    Of each line at most one job waits at a time (docs/semantics.md, section 4.6).
    """
    longest: dict[TaskKey, Task] = {}
    for task, line in tasks:
        if not task.worst_ns:
            continue
        if line is None:
            return None
        if line not in longest or task.worst_ns > longest[line].worst_ns:
            longest[line] = task
    return list(longest.values())
