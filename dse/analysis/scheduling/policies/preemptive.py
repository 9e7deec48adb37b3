"""Fixed priorities on a core: what is more urgent preempts (`dse.analysis.scheduling.busy_window`)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from dse.analysis.scheduling.busy_window import (
    PLAIN,
    Kin,
    Task,
    in_window_of,
    is_plain,
    most_jobs,
    response_time_ns,
    worst_job_ns,
)
from dse.analysis.scheduling.model import Entry, Resource
from dse.analysis.scheduling.parts import Parts, before_job
from dse.analysis.scheduling.policies.coupled import NOT_THERE
from dse.analysis.scheduling.policies.reservations import gaps_and_servers
from dse.analysis.scheduling.policies.successions import Succession
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class Preempted:
    """A task, the rivals that preempt it, and for how long less urgent work may have kept the core before, in ns.

    Examples
    --------
    Of 26 every 70 and 62 every 100 the fifth job of the second responds last: released at 400, it ends at 518.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> window = Preempted(periodic("b", 62, 100), (periodic("a", 26, 70),))
    >>> window.response_ns()
    118
    >>> window.parts().delays(), window.parts().earlier_jobs, window.parts().over_ns
    ((Delay(name='a', jobs=8, work_ns=208),), 4, 400)
    """

    task: Task
    rivals: tuple[Task, ...]
    blocked_ns: Exact = 0
    kin: Kin | None = None
    source: Task | None = None
    others: tuple[Preempted, ...] = ()
    """The windows of other cases, which take no longer."""

    def counted_from(self, source: Task) -> Preempted:
        """The window with the time counted from the latest release that there can be of a source: the longest case."""
        cases = [replace(one, source=source, others=()) for one in (self, *self.others)]
        found = longest(cases)
        assert found is not None
        return found

    def response_ns(self) -> Exact | None:
        """The longest time from the release of a job to its end, in ns; None where it has no bound.

        Joseph and Pandya 1986 for one job, Lehoczky 1990 for all jobs of the busy period (docs/semantics.md, section
        4.3).
        """
        task, rivals, blocked = self.task, self.rivals, self.blocked_ns
        if not task.worst_ns:
            return 0
        tasks = (task, *rivals) if self.source is None else (task, *rivals, self.source)
        under_way_ns = 0 if self.kin is None else self.kin.under_way_ns
        if type(blocked) in PLAIN and type(under_way_ns) in PLAIN and all(map(is_plain, tasks)):
            return _remembered(task, rivals, blocked, self.kin, self.source)
        return response_time_ns(task, rivals, blocked, self.kin, self.source)

    def parts(self) -> Parts | None:
        """The parts of the wait of the job with the longest response time; None where it has no bound.

        With the task's own time they add up to the response time. What never waits while the job does is no part of it
        as far as it is over when the job is released.
        """
        if not self.task.worst_ns:
            return Parts()
        found = worst_job_ns(self.task, self.rivals, self.blocked_ns, self.kin, self.source)
        if found is None:
            return None
        over, end, earlier, released = found
        there = in_window_of(self.rivals, earlier, released)
        jobs = [(item, most_jobs(one, end)) for item, one in zip(self.rivals, there, strict=True)]
        kin = set(map(id, () if self.kin is None else self.kin.rivals))  # tasks of other threads may be equal
        taken = sum(number * item.worst_ns for item, number in jobs if id(item) in kin)
        if taken and taken <= over:
            jobs = [(item, number) for item, number in jobs if id(item) not in kin]
            over, end = over - taken, end - taken
        return before_job(self.task, jobs, self.blocked_ns, over, end)


def longest(cases: Sequence[Preempted | None]) -> Preempted | None:
    """The window, of several of which one is the case, that takes the longest; None where one is None."""
    if len(cases) == 1:
        return cases[0]
    windows: list[Preempted] = []
    times: list[Exact] = []
    for case in cases:
        for window in () if case is None else (replace(case, others=()), *case.others):
            time = window.response_ns()
            if time is None:
                return window
            windows.append(window)
            times.append(time)
        if case is None:
            return None
    place = max(range(len(times)), key=times.__getitem__)
    return replace(windows[place], others=(*windows[:place], *windows[place + 1 :]))


@lru_cache(16384)
def _remembered(
    task: Task, rivals: tuple[Task, ...], blocked_ns: Exact, kin: Kin | None, source: Task | None
) -> Exact | None:
    """`response_time_ns`: from round to round, and from design to design, most tasks meet the same."""
    return response_time_ns(task, rivals, blocked_ns, kin, source)


def window_of(
    resource: Resource, position: int, tasks: Sequence[Task | None], succession: Succession
) -> Preempted | None:
    """The busy window that decides the response time of a stage that no executor runs; None where it has no bound.

    Of several cases in which the stages of the resource may come the longest one.
    """
    entry = resource.entries[position]
    over = succession.over_before((position,), entry.rivals)
    cases = succession.cases(entry.key, (position, position), tasks)
    return longest([_window_of(resource, position, case, over) for case in cases])


def _window_of(
    resource: Resource, position: int, tasks: Sequence[Task | None], over: frozenset[int]
) -> Preempted | None:
    """The busy window of a stage where the stages of its resource come as `tasks`.

    Of a piece of a thread it is the time from its own release: one job, for those before it have ended. Where it
    shares its turn with others these have waited for the pieces before it, which count as they do. The rivals at the
    positions `over` are of the chain of the stage, and never wait while it does.
    """
    entry, task = resource.entries[position], tasks[position]
    if task is None:
        return None
    if not task.worst_ns:
        return Preempted(task, ())
    rivals = rivals_of(resource, entry, tasks, siblings=entry.shares_turn)
    job = task.single() if entry.is_piece and not entry.shares_turn else task
    if rivals is None:
        return None
    kin = present(tasks, over)
    return Preempted(job, rivals, entry.blocking_ns, Kin(kin) if kin else None)


def present(tasks: Sequence[Task | None], positions: Iterable[int]) -> tuple[Task, ...]:
    """The stages at some positions that come in a window, as tasks in their order."""
    return tuple(item for position in positions if (item := tasks[position]) is not None and item is not NOT_THERE)


def rivals_of(
    resource: Resource, entry: Entry, tasks: Sequence[Task | None], *, siblings: bool = False
) -> tuple[Task, ...] | None:
    """All that goes before a stage, with the other pieces of its thread if asked; None where some has no bound.

    Tasks of higher or equal priority, interrupts and reservations.
    """
    positions = (*entry.rivals, *entry.siblings) if siblings else entry.rivals
    found = [*gaps_and_servers(resource, entry, tasks), *(tasks[item] for item in positions)]
    if None in found:
        return None
    return tuple(item for item in found if item is not None and item is not NOT_THERE)
