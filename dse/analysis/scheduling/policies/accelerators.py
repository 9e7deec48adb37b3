"""The pieces of threads on an accelerator, which serves them as they come or by priority (docs/semantics.md, 4.7).

The pieces of one thread never wait for each other; other jobs of an accelerator are those of an executor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from heapq import merge
from operator import attrgetter
from typing import TypeAlias

from dse.analysis.scheduling.busy_window import Task, TaskKey, densest_releases_ns, is_late, load
from dse.analysis.scheduling.model import Resource
from dse.analysis.scheduling.parts import Parts, counted
from dse.analysis.scheduling.policies.executor_work import EndlessError, Work, jobs_by, until_end
from dse.analysis.scheduling.policies.executors import Fellow, Queued, beside
from dse.analysis.scheduling.policies.successions import Succession, longest_of_each
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class OneOfEach:
    """A piece that waits for one job of each of these, and for less urgent work that has begun.

    Pieces of threads whose jobs end before their next release come once at most.
    """

    task: Task
    others: tuple[Task, ...]
    blocked_ns: Exact

    def response_ns(self) -> Exact | None:
        """The longest time from its release to its end, in ns.

        The sum of one job of each other piece, the blocking and its own time.
        """
        return self.task.worst_ns + self.blocked_ns + sum(item.worst_ns for item in self.others)

    def parts(self) -> Parts | None:
        """The parts of the response time that the piece spends waiting.

        One job of each other piece, and the blocking.
        """
        return Parts(counted((item, 1) for item in self.others), blocked_ns=self.blocked_ns)


@dataclass(frozen=True, slots=True)
class AsTheyCome:
    """A piece that waits for all that came before it, less what its own thread took of that time (`_queued_job`).

    First come, first served (docs/semantics.md, section 4.7).
    """

    task: Task
    own: tuple[Task, ...]
    others: tuple[Task, ...]
    blocked_ns: Exact

    def response_ns(self) -> Exact | None:
        """The longest time from its release to its end, in ns; None where it has no bound.

        The wait behind others, the blocking and its own time.
        """
        found = _queued_job(self.task, self.own, self.others)
        return None if found is None else found.waited_ns + self.task.worst_ns + self.blocked_ns

    def parts(self) -> Parts | None:
        """The parts of the response time that the piece spends waiting; None where it has no bound.

        Jobs of the others that come until the release, less what ran meanwhile.
        """
        found = _queued_job(self.task, self.own, self.others)
        if found is None:
            return None
        jobs = counted((item, jobs_by(item, found.until_ns)) for item in self.others)
        return Parts(jobs, blocked_ns=self.blocked_ns, over_ns=found.ran_ns)


@dataclass(frozen=True, slots=True)
class ByPriority:
    """A piece on an accelerator that serves by priority.

    Something less urgent may have begun before all that is more urgent came, or an earlier piece of its own thread:
    that has ended some time before the piece is released, and kept it from nothing, but what came since goes first.
    `ran` are these pieces, each with how long before it has ended.
    """

    first: Queued
    ran: tuple[tuple[Task, Exact], ...]

    def _ways(self) -> list[tuple[Queued, Task | None, Exact]]:
        urgent = tuple(item for item in self.first.fellows if item.goes_first)
        own = self.ran if urgent else ()
        behind = [(replace(self.first, fellows=urgent, blocked_ns=item.worst_ns), item, time) for item, time in own]
        return [(self.first, None, 0), *behind]

    def response_ns(self) -> Exact | None:
        """The longest time from its release to its end, in ns; None where it has no bound.

        The greatest over the ways in which an earlier job of its own may have begun.
        """
        longest: Exact | None = None
        for window, item, time in self._ways():
            found = window.response_ns()
            if found is None:
                return None
            if item is not None:
                found = found - item.worst_ns - time
            longest = found if longest is None else max(longest, found)
        return longest

    def parts(self) -> Parts | None:
        """The parts of the response time that the piece spends waiting; None where it has no bound.

        Those of the way with the longest wait.
        """
        ways: list[Parts] = []
        for window, item, time in self._ways():
            found = window.parts()
            if found is None:
                return None
            if item is not None:
                over = item.worst_ns + time
                found = replace(found, earlier_jobs=1, earlier_ns=item.worst_ns, blocked_ns=0, over_ns=over)
            ways.append(found)
        return max(ways, key=attrgetter("waited_ns"))


Served: TypeAlias = Queued | OneOfEach | AsTheyCome | ByPriority


def window_of(
    resource: Resource,
    position: int,
    tasks: Sequence[Task | None],
    succession: Succession,
    since_ns: Mapping[TaskKey, Exact],
) -> Served | None:
    """The window that decides the time of a piece from its own release to its end; None where it has no bound.

    Each piece of its thread has ended so long `since_ns` before its release.
    """
    entry, task = resource.entries[position], tasks[position]
    if task is None:
        return None
    found = beside(resource, position, tasks, succession)
    siblings = [tasks[item] for item in entry.siblings]
    own = tuple(item for item in siblings if item is not None)
    if found is None or len(own) < len(siblings):
        return None
    if found.kind == "fifo" and not found.higher:
        waiting = longest_of_each([(item.task, item.line) for item in found.fellows])
        if waiting is not None:
            return OneOfEach(task, tuple(waiting), entry.blocked_ns)
        return AsTheyCome(task, own, tuple(item.task for item in found.fellows), entry.blocked_ns)
    if found.kind != "callback_group" or found.higher or entry.shares_turn:
        return replace(found, fellows=(*found.fellows, *(Fellow(item, True) for item in own)), is_in_line=False)
    job = replace(found, task=task.single(), higher=(), is_in_line=False)
    ran = ((tasks[at], since_ns[item.key]) for at, item in enumerate(resource.entries) if item.key in since_ns)
    return ByPriority(job, tuple((item, time) for item, time in ran if item is not None))


@dataclass(frozen=True, slots=True)
class QueuedJob:
    """The job that waits longest: for `waited_ns` behind others that came `until_ns`, which ran for `ran_ns`."""

    waited_ns: Exact = 0
    until_ns: Exact = 0
    ran_ns: Exact = 0


def _queued_job(task: Task, own: Sequence[Task], fellows: Sequence[Task]) -> QueuedJob | None:
    """The job that waits longest where jobs run as they come, and all `own` before it have ended; None: no bound.

    It comes a after the executor was idle last. What the `fellows` released until then has run for a, less what its
    `own` jobs took of that, and these are not before it: they have ended.

    Examples
    --------
    While a piece of 8 runs, three jobs of 2 every 4 come, before the next piece of 2; strangers would take 8 + 2 + 2.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> found = _queued_job(periodic("last", 2, 40), [periodic("first", 8, 40)], [periodic("other", 2, 4)])
    >>> found.waited_ns + 2
    8
    """
    inside = [item for item in (*own, *fellows) if item.worst_ns]
    used = load((task, *inside))
    if used > 1 or (used == 1 and any(map(is_late, (task, *inside)))):
        return None
    work = Work(task, inside, (), 0)
    longest = QueuedJob(-1)
    try:
        busy = work.busy_ns(repeats=False)
        for arrival in until_end(merge(*map(densest_releases_ns, (task, *inside))), busy):
            work.step()
            came = sum(jobs_by(item, arrival) * item.worst_ns for item in fellows)
            ended = sum(jobs_by(item, arrival) * item.worst_ns for item in (task, *own)) - task.worst_ns
            ran = max(0, arrival - ended)
            if came - ran > longest.waited_ns:
                longest = QueuedJob(came - ran, arrival, ran)
    except EndlessError:
        return None
    return longest
