"""Response times of threads that one OS thread runs, one job at a time: executors under preemptive fixed priorities.

No job of an executor preempts another of it; what goes before the OS thread on its core preempts all of them.

* ``fifo``: jobs run as they come. A job that comes a after the beginning of a busy period of the executor waits for all
  that came no later: its end is the least w with w = blocking + work that came in [0, a] + work of the more urgent in
  [0, w), and its response w - a. Of a only those count at which a job may come (K. Bedarkar, M. Vardishvili, S. Bozhko,
  M. Maida and B. B. Brandenburg, "From intuition to Coq: a case study in verified response-time analysis of FIFO
  scheduling", RTSS 2022).
* ``callback_group``: of those that wait the most urgent runs next; one less urgent may have begun before. A job's start
  counts what comes until then, its end only what goes before the OS thread (L. George, N. Rivierre and M. Spuri,
  "Preemptive and non-preemptive real-time uniprocessor scheduling", INRIA 2966, 1996; with all jobs of the busy period
  as R. J. Bril, J. J. Lukkien and W. F. J. Verhaegh, Real-Time Systems 42, 2009, require).
* ``wait_set``: ROS 2's single-threaded executor takes what waits at its polling points, timers first, and runs it all
  before it looks again (D. Casini, T. Blass, I. Luetkebohle and B. B. Brandenburg, "Response-time analysis of ROS 2
  processing chains under reservation-based scheduling", ECRTS 2019). It is never idle while a job waits, and runs the
  jobs of one callback as they come: until one starts, all that comes of others may go before it, as theirs of polled
  callbacks. That is a safe bound, whatever the order.

(docs/semantics.md, section 4.6)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from heapq import merge

from dse.analysis.response_time import (
    MOST_STEPS,
    STEPS_A_LOOK,
    Task,
    densest_releases_ns,
    is_late,
    last_to_look_at_ns,
    load,
    most_jobs,
)
from dse.records import dataclass
from dse.space.hosts import ExecutorKind
from dse.timelimit import look_at_the_clock
from dse.units import Exact

STEPS_BEFORE_REPETITION = 16
"""Most busy periods take fewer steps; from there on it is worth knowing when jobs repeat."""


@dataclass(frozen=True, slots=True)
class Fellow:
    """Another task of an executor; `goes_first` among those that wait (in a callback group)."""

    task: Task
    goes_first: bool


class _Endless(Exception):
    """A busy period takes more steps than `MOST_STEPS`."""


def executor_response_ns(
    kind: ExecutorKind, task: Task, fellows: Sequence[Fellow], higher: Sequence[Task], blocked_ns: Exact = 0
) -> Exact | None:
    """The longest time from the release of a job of an executor to its end; None when it is not bounded.

    Parameters
    ----------
    kind, fellows
        the executor, and what else it runs.
    higher
        the tasks of the core that go before the executor's OS thread.
    blocked_ns
        how long less urgent work outside of the executor may keep the core, at most.

    Examples
    --------
    A timer of 1 every 10 behind a callback of 3 every 20, and the other way round; alone at its priority, and with
    another OS thread of 2 every 5 before both.

    >>> from dse.analysis.response_time import periodic
    >>> timer, callback = periodic("timer", 1, 10), periodic("callback", 3, 20)
    >>> executor_response_ns("fifo", timer, [Fellow(callback, False)], [])
    4
    >>> executor_response_ns("callback_group", callback, [Fellow(timer, True)], [periodic("other", 2, 5)])
    8
    """
    if task.worst_ns == 0:
        return 0
    found = executor_worst_job(kind, task, fellows, higher, blocked_ns)
    return None if found is None else found.end_ns - found.release_ns


@dataclass(frozen=True, slots=True)
class WorstJob:
    """The job of an executor that responds last, in a busy period: of its fellows those count that come `until` then.

    Of a callback group something less urgent may have begun, for `behind_ns`. Where that or other less urgent work
    keeps the core at first it begins a moment before, and so does the job: what comes at its very start `comes_late`.
    """

    release_ns: Exact
    end_ns: Exact
    until_ns: Exact
    behind_ns: Exact = 0
    comes_late: bool = False

    def jobs(self, task: Task) -> int:
        """How many jobs of a fellow go before it."""
        return (most_jobs if self.comes_late else jobs_by)(task, self.until_ns)


def executor_worst_job(
    kind: ExecutorKind, task: Task, fellows: Sequence[Fellow], higher: Sequence[Task], blocked_ns: Exact = 0
) -> WorstJob | None:
    """The job with the longest response time, which takes some time; see `executor_response_ns`.

    Examples
    --------
    The callback comes with the timer and waits for it; from then on nobody may come before it.

    >>> from dse.analysis.response_time import periodic
    >>> timer, callback = periodic("timer", 1, 10), periodic("callback", 3, 20)
    >>> executor_worst_job("fifo", callback, [Fellow(timer, False)], [periodic("other", 2, 5)])
    WorstJob(release_ns=0, end_ns=8, until_ns=0, behind_ns=0, comes_late=False)
    """
    counted = [item.task for item in fellows if item.task.worst_ns and (item.goes_first or kind != "callback_group")]
    behind: Exact = 0
    if kind == "callback_group":  # a less urgent job may have begun
        behind = max((item.task.worst_ns for item in fellows if not item.goes_first), default=0)
        blocked_ns = max(blocked_ns, behind)
    outside = [item for item in higher if item.worst_ns]
    used = load((task, *counted, *outside))
    if used > 1 or (used == 1 and (blocked_ns or not task.streams or any(map(is_late, (task, *counted, *outside))))):
        return None
    work = _Work(task, counted, outside, blocked_ns)
    try:
        return _fifo(work) if kind == "fifo" else _grouped(work, behind)
    except _Endless:
        return None


def jobs_before(
    kind: ExecutorKind, worst: WorstJob, fellows: Sequence[Fellow], higher: Sequence[Task], blocked_ns: Exact
) -> list[tuple[Task, int]]:
    """How many jobs of what go before the job that responds last: what preempts the executor first, then its fellows.

    At last the one of these that had begun, where that takes longer than what else blocks.
    """
    jobs = [(item, most_jobs(item, worst.end_ns)) for item in higher]
    jobs += [(item.task, worst.jobs(item.task)) for item in fellows if kind != "callback_group" or item.goes_first]
    if worst.behind_ns > blocked_ns:
        begun = (item.task for item in fellows if not item.goes_first and item.task.worst_ns == worst.behind_ns)
        jobs.append((next(begun), 1))
    return jobs


@dataclass
class _Work:
    """The task, the others of its executor, and what preempts them."""

    task: Task
    fellows: Sequence[Task]
    outside: Sequence[Task]
    blocked_ns: Exact
    steps: int = 0

    def step(self) -> None:
        """Count a step of the way to a fixed point."""
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise _Endless
        if not self.steps % STEPS_A_LOOK:
            look_at_the_clock()

    def least(self, begin: Exact, demand: Callable[[Exact], Exact]) -> Exact:
        """The least time, no sooner than `begin`, by which all that is demanded until then is done."""
        time = begin
        while (needed := demand(time)) > time:
            self.step()
            time = needed
        return time

    def preempting(self, window_ns: Exact) -> Exact:
        """The work of what preempts the executor in a window."""
        return sum(most_jobs(item, window_ns) * item.worst_ns for item in self.outside)

    def busy_ns(self, *, repeats: bool = True) -> Exact:
        """The longest busy period of the executor and all that goes before it.

        Where all jobs later than some release respond no later than earlier ones, as what `repeats` with the
        hyperperiod does (`last_to_look_at_ns`), it may end after that release.
        """
        inside = (self.task, *self.fellows)

        def demand(window: Exact) -> Exact:
            own = sum(most_jobs(item, window) * item.worst_ns for item in inside)
            return self.blocked_ns + own + self.preempting(window)

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

    >>> from dse.analysis.response_time import periodic
    >>> [jobs_by(periodic("a", 1, 10, 3), time) for time in (0, 6, 7)]
    [1, 1, 2]
    """
    if not task.streams:
        return 1
    jobs = sum((time_ns + stream.jitter_ns) // stream.period_ns + 1 for stream in task.streams)
    return jobs if task.separation_ns is None else min(jobs, time_ns // task.separation_ns + 1)


def _fifo(work: _Work) -> WorstJob:
    inside = (work.task, *work.fellows)
    busy = work.busy_ns()
    worst = WorstJob(0, 0, 0)
    last: Exact = -1
    for arrival in _until(merge(*map(densest_releases_ns, inside)), busy):
        if arrival == last:
            continue
        last = arrival
        work.step()
        before = work.blocked_ns + sum(jobs_by(item, arrival) * item.worst_ns for item in inside)
        end = work.least(before, lambda window, before=before: before + work.preempting(window))  # type: ignore[misc]
        if end - arrival > worst.end_ns - worst.release_ns:
            worst = WorstJob(arrival, end, arrival)
    return worst


def _grouped(work: _Work, behind_ns: Exact) -> WorstJob:
    """Job after job of the busy period of the task and of what goes before it."""
    busy = work.busy_ns()
    worst = WorstJob(0, 0, 0)
    came = most_jobs if work.blocked_ns else jobs_by  # it has begun before the busy period, however little
    for number, release in enumerate(_until(densest_releases_ns(work.task), busy)):
        begun = work.blocked_ns + number * work.task.worst_ns

        def waiting(time: Exact, begun: Exact = begun) -> Exact:
            urgent = (*work.fellows, *work.outside)
            return begun + sum(came(item, time) * item.worst_ns for item in urgent)

        start = work.least(begun, waiting)
        fixed = begun + sum(came(item, start) * item.worst_ns for item in work.fellows) + work.task.worst_ns
        end = work.least(fixed, lambda window, fixed=fixed: fixed + work.preempting(window))  # type: ignore[misc]
        if end - release > worst.end_ns - worst.release_ns:
            worst = WorstJob(release, end, start, behind_ns, work.blocked_ns > 0)
    return worst


def queued_ns(task: Task, own: Sequence[Task], fellows: Sequence[Task]) -> Exact | None:
    """The longest time that a job waits and runs where jobs run as they come, when all `own` before it have ended.

    It comes a after the executor was idle last. What the `fellows` released until then has run for a, less what its
    `own` jobs took of that, and these are not before it: they have ended.

    Examples
    --------
    While a piece of 8 runs, three jobs of 2 every 4 come, before the next piece of 2; strangers would take 8 + 2 + 2.

    >>> from dse.analysis.response_time import periodic
    >>> queued_ns(periodic("last", 2, 40), [periodic("first", 8, 40)], [periodic("other", 2, 4)])
    8
    """
    found = queued_job(task, own, fellows)
    return None if found is None else found.waited_ns + task.worst_ns


@dataclass(frozen=True, slots=True)
class QueuedJob:
    """The job that waits longest (`queued_ns`): behind all of others that came `until` then, which ran for `ran_ns`."""

    waited_ns: Exact = 0
    until_ns: Exact = 0
    ran_ns: Exact = 0


def queued_job(task: Task, own: Sequence[Task], fellows: Sequence[Task]) -> QueuedJob | None:
    """The job whose time `queued_ns` is."""
    inside = [item for item in (*own, *fellows) if item.worst_ns]
    used = load((task, *inside))
    if used > 1 or (used == 1 and any(map(is_late, (task, *inside)))):
        return None
    work = _Work(task, inside, (), 0)
    longest = QueuedJob(-1)
    try:
        busy = work.busy_ns(repeats=False)
        for arrival in _until(merge(*map(densest_releases_ns, (task, *inside))), busy):
            work.step()
            came = sum(jobs_by(item, arrival) * item.worst_ns for item in fellows)
            ended = sum(jobs_by(item, arrival) * item.worst_ns for item in (task, *own)) - task.worst_ns
            ran = max(0, arrival - ended)
            if came - ran > longest.waited_ns:
                longest = QueuedJob(came - ran, arrival, ran)
    except _Endless:
        return None
    return longest


def _until(releases: Iterator[Exact], end: Exact) -> Iterator[Exact]:
    """The releases before an end, the first in any case."""
    for count, release in enumerate(releases):
        if count and release >= end:
            return
        yield release
