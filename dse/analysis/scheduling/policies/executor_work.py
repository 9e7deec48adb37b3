"""The busy period of an OS thread that runs one job at a time: all that it runs, and what preempts it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from dse.analysis.scheduling.busy_window import (
    MOST_STEPS,
    STEPS_A_LOOK,
    Task,
    is_plain,
    last_to_look_at_ns,
    most_jobs,
)
from dse.support.timelimit import look_at_the_clock
from dse.support.units import Exact

STEPS_BEFORE_REPETITION = 16
"""Most busy periods take fewer steps; from there on it is worth knowing when jobs repeat."""


class EndlessError(Exception):
    """A busy period takes more steps than `MOST_STEPS`.

    The response time is then taken for unbounded, which is safe.
    """


@dataclass
class Work:
    """The task, the others of its executor, and what preempts them.

    Times in ns; `fellows` are run by the same OS thread, `outside` preempts it, `blocked_ns` is the longest that may
    have begun before.
    """

    task: Task
    fellows: Sequence[Task]
    outside: Sequence[Task]
    blocked_ns: Exact
    steps: int = 0

    def step(self) -> None:
        """Count a step of the way to a fixed point.

        Raises `EndlessError` after `MOST_STEPS` steps, `OutOfTime` at the time limit.
        """
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise EndlessError
        if not self.steps % STEPS_A_LOOK:
            look_at_the_clock()

    def least(self, begin: Exact, demand: Callable[[Exact], Exact]) -> Exact:
        """The least time, no sooner than `begin`, by which all that is demanded until then is done.

        The least fixed point of ``time = demand(time)`` above `begin`, by iteration; in ns.
        """
        time = begin
        while (needed := demand(time)) > time:
            self.step()
            time = needed
        return time

    @property
    def comes_late(self) -> bool:
        """Whether what comes as a job starts comes too late: something has begun before, however little.

        Jobs that are released in the very moment of a start count then only up to that moment.
        """
        return bool(self.blocked_ns > 0)

    def start(self, before: Exact, since: Exact = 0) -> Exact:
        """The start of a job that waits for `before` of work and for all arrivals until it starts; at least `since`.

        In ns from the beginning of the busy period.
        """
        fellows, outside = self.before_start, self._outside_by
        return self.least(max(before, since), lambda time: before + fellows(time) + outside(time))

    @cached_property
    def before_start(self) -> Callable[[Exact], Exact]:
        """The work of the fellows that go before a job that starts then.

        A function from a time to the work, both in ns.
        """
        return demand_of(self.fellows, until=not self.comes_late)

    @cached_property
    def _outside_by(self) -> Callable[[Exact], Exact]:
        """The work of what preempts the executor, until a time."""
        return demand_of(self.outside, until=not self.comes_late)

    def end(self, work: Exact, since: Exact = 0) -> Exact:
        """The time when `work` of the executor and all preemption until then are done; at least `since`.

        In ns from the beginning of the busy period.
        """
        return self.least(max(work, since), lambda time: work + self.preempting(time))

    @cached_property
    def preempting(self) -> Callable[[Exact], Exact]:
        """The work of what preempts the executor in a window.

        A function from the length of a window to the work in it, both in ns.
        """
        return demand_of(self.outside)

    def busy_ns(self, *, repeats: bool = True) -> Exact:
        """The longest busy period of the executor and all that goes before it.

        Where all jobs later than some release respond no later than earlier ones, as what `repeats` with the
        hyperperiod does (`last_to_look_at_ns`), it may end after that release.
        """
        inside = (self.task, *self.fellows)
        own, preempting = demand_of(inside), self.preempting

        def demand(window: Exact) -> Exact:
            return self.blocked_ns + own(window) + preempting(window)

        time, last = self.blocked_ns + self.task.worst_ns, None
        while (needed := demand(time)) > time:
            self.step()
            time = needed
            if repeats and self.steps == STEPS_BEFORE_REPETITION:
                last = last_to_look_at_ns((*inside, *self.outside))
            if last is not None and time > last:
                break
        return time


def jobs_by(task: Task, time_ns: Exact) -> int:
    """The most jobs of a busy period that are released until a time, that time included.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> [jobs_by(periodic("a", 1, 10, 3), time) for time in (0, 6, 7)]
    [1, 1, 2]
    """
    if not task.streams:
        return 1
    jobs = sum((time_ns + stream.jitter_ns) // stream.period_ns + 1 for stream in task.streams)
    return jobs if task.separation_ns is None else min(jobs, time_ns // task.separation_ns + 1)


def demand_of(tasks: Sequence[Task], *, until: bool = False) -> Callable[[Exact], Exact]:
    """How much work tasks may release in a window of some length, or `until` a time, that time included.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> tasks = [periodic("a", 1, 10, 3), periodic("b", 2, 5)]
    >>> [demand_of(tasks)(time) for time in (1, 10)], [demand_of(tasks, until=True)(time) for time in (0, 7, 10)]
    ([3, 6], [3, 6, 8])
    """
    if not all(map(is_plain, tasks)):
        return partial(_demanded, tasks, jobs_by if until else most_jobs)
    once = sum(item.worst_ns for item in tasks if not item.streams)
    apart = [item for item in tasks if item.streams and item.separation_ns is not None]
    streams = [
        (stream.period_ns, stream.jitter_ns, item.worst_ns)
        for item in tasks
        for stream in (item.streams if item.separation_ns is None else ())
    ]
    further = partial(_demanded, apart, jobs_by if until else most_jobs)
    if until:
        once += sum(worst for *_, worst in streams)

    def demand(time: Exact) -> Exact:
        work: Exact = once
        if until:
            for period, jitter, worst in streams:
                work += (time + jitter) // period * worst
        else:
            for period, jitter, worst in streams:
                work -= -(time + jitter) // period * worst
        return work + further(time) if apart else work

    return demand


def _demanded(tasks: Sequence[Task], jobs: Callable[[Task, Exact], int], time: Exact) -> Exact:
    return sum(jobs(item, time) * item.worst_ns for item in tasks)


def until_end(releases: Iterator[Exact], end: Exact) -> Iterator[Exact]:
    """The releases before an end, the first in any case.

    In ns, ascending.
    """
    for count, release in enumerate(releases):
        if count and release >= end:
            return
        yield release
