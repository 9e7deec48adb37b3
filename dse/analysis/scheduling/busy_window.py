"""Response times under fixed-priority preemptive scheduling, exact for independent tasks on one core.

The level-i busy period of J. P. Lehoczky ("Fixed priority scheduling of periodic task sets with arbitrary deadlines",
RTSS 1990) with the release jitter of N. Audsley, A. Burns, M. Richardson, K. Tindell and A. Wellings ("Applying new
scheduling theory to static priority pre-emptive scheduling", Software Engineering Journal 8(5), 1993); without jitter
and with response times up to the period it is the recurrence of M. Joseph and P. Pandya ("Finding response times in a
real-time system", The Computer Journal 29(5), 1986). A busy period may begin with less urgent work that cannot be
interrupted (`dse.analysis.scheduling.overheads`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from heapq import merge
from itertools import count, islice, repeat, takewhile
from math import gcd, lcm
from operator import ge
from typing import Annotated, Literal, NamedTuple, TypeAlias

from dse.support.timelimit import look_at_the_clock
from dse.support.units import Exact, Rounded

Part: TypeAlias = Literal["thread", "callback", "message"]
TaskKey: TypeAlias = tuple[int, Part]
"""A thread or device by its number and which of its tasks, or a connection by its number and ``message``."""
STEPS_A_LOOK = 256
"""The number of steps, about a millisecond, between two looks at the clock."""
MOST_STEPS = 100_000
"""A busy period that takes more steps than this is reported as unbounded, which is safe."""
JOBS_BEFORE_REPETITION = 16
"""Most busy periods have fewer jobs; from there on it is worth knowing when jobs repeat."""
CLEARLY = 1e-9
"""Sums of thousands of shares in floating point are closer to the exact ones than this."""
PLAIN = (int, Fraction, Rounded, type(None))
"""The types of mere numbers; None where there is none."""


@dataclass(frozen=True, slots=True)
class Stream:
    """A stream of releases of a thread.

    Events are at least `period_ns` apart.
    """

    JSON_NAME = "Releases"

    period_ns: Annotated[int, "The least time between two events of the stream, without jitter."]
    jitter_ns: Annotated[Exact, "The longest time by which a release comes later than periodically."] = 0


class Behind(NamedTuple):
    """How many jobs come in a window behind jobs of the task whose window it is (docs/semantics.md, section 4.9).

    No more than earlier jobs of that in the window and `sooner` ones, and, where it is released at x after the window
    began, than x + `reach_ns` has periods; None where it has no single period.
    """

    sooner: int
    reach_ns: Exact | None
    period_ns: int

    def most(self, earlier: int, released_ns: Exact | None) -> int:
        """The most jobs with so many earlier jobs, released then; without a time, whenever it is."""
        most = earlier + self.sooner
        if self.reach_ns is None or released_ns is None:
            return most
        return min(most, (released_ns + self.reach_ns) // self.period_ns)


@dataclass(frozen=True, slots=True)
class Task:
    """A task on a core: one job of up to `worst_ns` at each event of any of its streams.

    `separation_ns` is a minimum distance between two jobs on top of that (a sporadic thread's period), or None. In a
    window there are no more jobs than `most`, where that is known; without a stream there are so many, or one. Of one
    that comes behind the task whose window it is, `behind` says of how many jobs of that it does. Its name, and the
    `stage` that it is, if it is one, make no difference.
    """

    name: str = field(compare=False)
    worst_ns: int
    streams: tuple[Stream, ...]
    separation_ns: int | None = None
    stage: TaskKey | None = field(default=None, compare=False)
    most: int | None = None
    behind: Behind | None = None

    @property
    def utilisation(self) -> Fraction:
        """The share of the core that the task uses in the long run, at most.

        A fraction of one core, exact: the worst time over the period of each stream, at most over the separation.
        """
        if self.most is not None:
            return Fraction(0)
        worst = Fraction(1) * self.worst_ns
        share = sum((worst / stream.period_ns for stream in self.streams), Fraction(0))
        return share if self.separation_ns is None else min(share, worst / self.separation_ns)

    def single(self) -> Task:
        """The task with one job only, whose earlier jobs have ended.

        Used where it is proved that earlier jobs do not wait when a job is released.
        """
        return replace(self, streams=(), separation_ns=None)


class BusyJob(NamedTuple):
    """The job of a busy period that responds last: its release and its end since that began, and how many go before.

    `over_ns` is the release, or when what is over by then has been done, where that is later.
    """

    over_ns: Exact
    end_ns: Exact
    earlier: int
    released_ns: Exact


@dataclass(frozen=True, slots=True)
class Kin:
    """Rivals of a task of which no job waits while a job of the task does, and what its own chain may leave.

    They are threads before and behind it in its chain, of which a job always ends before the next one is released.
    `under_way_ns` is how much work of a job of its own that was released before the busy period may be in it.
    """

    rivals: tuple[Task, ...] = ()
    under_way_ns: Exact = 0


def is_plain(task: Task) -> bool:
    """Whether its times are mere numbers, not traced ones (`dse.questions.sensitivity`), which differ though equal.

    Only plain tasks may be keys of a memory; equal traced numbers have different expressions.
    """
    if type(task.worst_ns) not in PLAIN or type(task.separation_ns) not in PLAIN:
        return False
    if task.behind is not None and type(task.behind.reach_ns) not in PLAIN:
        return False
    return all(type(item.period_ns) in PLAIN and type(item.jitter_ns) in PLAIN for item in task.streams)


def load(tasks: Sequence[Task]) -> float | Fraction:
    """The share of a core that tasks use together in the long run, exact unless it is clearly more or less than 1.

    >>> load([periodic("a", 1, 3), periodic("b", 2, 3)]), load([periodic("a", 1, 4)])
    (Fraction(1, 1), 0.25)
    """
    if all(map(is_plain, tasks)):
        rough = sum(map(_rough_share, tasks))
        if abs(rough - 1) > CLEARLY:
            return rough
    return sum((task.utilisation for task in tasks), Fraction(0))


def _rough_share(task: Task) -> float:
    if task.most is not None:
        return 0.0
    share = sum(float(task.worst_ns / stream.period_ns) for stream in task.streams)
    return share if task.separation_ns is None else min(share, float(task.worst_ns / task.separation_ns))


def periodic(name: str, worst_ns: int, period_ns: int, jitter_ns: Exact = 0) -> Task:
    """A task with one stream.

    Times in ns; the jitter is how much later than periodically a release may come.
    """
    return Task(name, worst_ns, (Stream(period_ns, jitter_ns),))


def is_late(task: Task) -> bool:
    """Whether all of its jobs in a window may be more than its share of that: there is jitter, and nothing else.

    >>> is_late(periodic("a", 1, 10, 3)), is_late(periodic("a", 1, 10))
    (True, False)
    """
    return task.separation_ns is None and any(stream.jitter_ns for stream in task.streams)


def most_jobs(task: Task, window_ns: Exact) -> int:
    """The most jobs released in a window of this length: the sum of ceil((window + jitter) / period).

    >>> most_jobs(periodic("a", 1, 10, 3), 10)
    2
    """
    if not task.streams:
        return 1 if task.most is None else task.most
    jobs = sum(-(-(window_ns + stream.jitter_ns) // stream.period_ns) for stream in task.streams)
    jobs = jobs if task.separation_ns is None else min(jobs, -(-window_ns // task.separation_ns))
    return jobs if task.most is None else min(jobs, task.most)


def in_window_of(tasks: Iterable[Task], earlier: int, released_ns: Exact | None = None) -> tuple[Task, ...]:
    """Tasks as they come in a window of a task with so many earlier jobs, the last job of which is released then."""
    return tuple(task if task.behind is None else _in_window_of(task, earlier, released_ns) for task in tasks)


def _in_window_of(task: Task, earlier: int, released_ns: Exact | None) -> Task:
    assert task.behind is not None
    most = task.behind.most(earlier, released_ns)
    known = task.most if task.streams or task.most is not None else 1
    return replace(task, most=most if known is None else min(known, most), behind=None)


def densest_releases_ns(task: Task) -> Iterator[Exact]:
    """When the jobs of a busy period are released, the first at 0 and each as early as it can be.

    >>> from itertools import islice
    >>> list(islice(densest_releases_ns(periodic("a", 1, 10, 3)), 4))
    [0, 7, 17, 27]
    """
    if not task.streams:
        yield from repeat(0, 1 if task.most is None else task.most)
        return
    releases = merge(*(map(partial(_release_ns, stream), count()) for stream in task.streams))
    for number, time in enumerate(releases if task.most is None else islice(releases, task.most)):
        yield time if task.separation_ns is None else max(time, number * task.separation_ns)


def _release_ns(stream: Stream, number: int) -> Exact:
    return max(0, number * stream.period_ns - stream.jitter_ns)


def response_time_ns(
    task: Task,
    higher: Sequence[Task],
    blocked_ns: Exact = 0,
    kin: Kin | None = None,
    source: Task | None = None,
) -> Exact | None:
    """The worst time from the release of a job to its end; None when it is not bounded.

    Parameters
    ----------
    task
        the task itself; its jobs run in the order of their release.
    higher
        the tasks of its core that go before it.
    blocked_ns
        how long less urgent work may keep the core, at most, once it has begun; a bound is then one that is not
        reached, but approached.
    kin
        those of `higher` of which no job waits while a job of the task does; None where no such thing is known.
    source
        what releases the task, each job one job of it; the time is then that from the latest release that there can be
        to the end. Jobs are as far apart as those of the source, however close their releases come
        (docs/semantics.md, section 4.9).

    Examples
    --------
    C = 3, 3 and 5 with T = 7, 12 and 20: 5 + 2 * 3 + 3 * 3 = 20, the last task just fits.

    >>> a, b, c = periodic("a", 3, 7), periodic("b", 3, 12), periodic("c", 5, 20)
    >>> [response_time_ns(a, []), response_time_ns(b, [a]), response_time_ns(c, [a, b])]
    [3, 6, 20]
    >>> response_time_ns(a, [], 2)
    5
    """
    if task.worst_ns == 0:
        return 0
    found = worst_job_ns(task, higher, blocked_ns, kin, source)
    return None if found is None else found.end_ns - found.over_ns


def worst_job_ns(
    task: Task,
    higher: Sequence[Task],
    blocked_ns: Exact = 0,
    kin: Kin | None = None,
    source: Task | None = None,
) -> BusyJob | None:
    """Release and end of the job that responds last, from the beginning of its busy period; see `response_time_ns`.

    With `kin` the time at which so much of the busy period is over in place of the release, where that is later: what
    jobs of these and earlier jobs of the chain have taken.

    >>> a, b = periodic("a", 26, 70), periodic("b", 62, 100)
    >>> worst_job_ns(b, [a])
    BusyJob(over_ns=400, end_ns=518, earlier=4, released_ns=400)

    Of jobs of 8 that come up to 15 later than every 10 three may come within 5: the third one ends 19 after its
    release. It was to come 20 after the first: none ends more than 8 after its latest release.

    >>> late = periodic("a", 8, 10, 15)
    >>> [response_time_ns(late, [], source=source) for source in (None, periodic("b", 0, 10))]
    [19, 8]

    What its own jobs release comes behind these: the first job waits for none.

    >>> worst_job_ns(late, [replace(periodic("c", 1, 10, 30), behind=Behind(0, None, 10))]).end_ns
    26
    """
    rivals = [other for other in higher if other.worst_ns]
    used = load((task, *rivals))
    if used > 1 or (used == 1 and (blocked_ns or not task.streams or any(map(is_late, (task, *rivals))))):
        return None  # such a busy period has no end
    worst = BusyJob(0, 0, 0, 0)
    releases = releases_to_look_at_ns(task, rivals)
    apart = None if source is None else densest_releases_ns(source)
    released: Exact = next(releases)
    under_way_ns = 0 if kin is None else kin.under_way_ns
    work = _Work(rivals, blocked_ns + under_way_ns)
    for earlier in count():
        busy = work.done_by(task.worst_ns, earlier)
        if busy is None:
            return None
        least = released if apart is None else next(apart, released)
        for job in work.jobs(task, earlier, released, busy):
            over = max(least, job.released_ns)
            if kin is not None:
                there = in_window_of(kin.rivals, earlier, job.released_ns)
                before = earlier * task.worst_ns + sum(most_jobs(one, job.end_ns) * one.worst_ns for one in there)
                over = max(over, under_way_ns + before)
            if job.end_ns - over > worst.end_ns - worst.over_ns:
                worst = job._replace(over_ns=over)
        if work.behind and (busy := work.done_by(0, earlier + 1)) is None:  # with what this job releases
            return None
        released = next(releases, busy)
        if busy <= released:
            return worst
    raise AssertionError


class _Work:
    """The work of a core in one busy period of a task: what is released meanwhile, and the time at which it is done.

    Times in ns from the beginning of the busy period. `begun_ns` is work that was there before, which nothing preempts.
    """

    def __init__(self, rivals: Sequence[Task], begun_ns: Exact) -> None:
        self.rivals, self.begun_ns, self.busy_ns, self.counted_ns, self.steps = rivals, begun_ns, begun_ns, 0, 0
        self.others = [one for one in rivals if one.separation_ns is not None or not one.streams or _is_capped(one)]
        self.behind = [one.behind for one in rivals if one.behind is not None]
        streams = [(stream, one.worst_ns) for one in rivals if one not in self.others for stream in one.streams]
        self.terms = [(stream.period_ns, worst_ns) for stream, worst_ns in streams]
        # the first release of each that `busy_ns` has no work of
        self.following: list[Exact] = [-stream.jitter_ns for stream, _ in streams]

    def done_by(self, more_ns: Exact, earlier: int) -> Exact | None:
        """When so much more is done, too, in a window with so many earlier jobs; None where it takes too many steps.

        The least window that holds all work released in it: each addition counts for the next at once.
        """
        others = in_window_of(self.others, earlier) if self.behind else self.others
        busy, following, grows = self.busy_ns + more_ns, self.following, True
        while grows:
            self.steps, grows = self.steps + 1, False
            if self.steps > MOST_STEPS:
                return None
            if not self.steps % STEPS_A_LOOK:
                look_at_the_clock()
            for index, (period_ns, worst_ns) in enumerate(self.terms):
                if following[index] < busy:
                    more = -((following[index] - busy) // period_ns)
                    following[index] += more * period_ns
                    busy += more * worst_ns
                    grows = True
            if others:
                work = sum(most_jobs(other, busy) * other.worst_ns for other in others)
                busy, self.counted_ns, grows = busy + work - self.counted_ns, work, grows or work > self.counted_ns
        self.busy_ns = busy
        return busy

    def jobs(self, task: Task, earlier: int, released_ns: Exact, busy_ns: Exact) -> Iterator[BusyJob]:
        """A job with so many earlier ones, released then or later, as long as the core is busy.

        One for each time from which on one more of those that come behind the task may be on its way: until then the
        job that is released soonest responds last.
        """
        while True:
            counts = [(one, one.most(earlier, released_ns)) for one in self.behind]
            later = [
                (most + 1) * one.period_ns - one.reach_ns
                for one, most in counts
                if one.reach_ns is not None and most < earlier + one.sooner
            ]
            if not later:
                yield BusyJob(released_ns, busy_ns, earlier, released_ns)
                return
            there = _Work(in_window_of(self.rivals, earlier, released_ns), self.begun_ns)
            end = there.done_by((earlier + 1) * task.worst_ns, earlier)
            yield BusyJob(released_ns, busy_ns if end is None else end, earlier, released_ns)
            released_ns = min(later)
            if released_ns >= busy_ns:
                return


def _is_capped(task: Task) -> bool:
    return task.most is not None or task.behind is not None


def releases_to_look_at_ns(task: Task, rivals: Sequence[Task]) -> Iterator[Exact]:
    """Releases of the jobs of which one responds last.

    In ns from the beginning of the busy period, the first at 0; beyond the last one the pattern repeats
    (`last_to_look_at_ns`).
    """
    releases = densest_releases_ns(task)
    yield from islice(releases, JOBS_BEFORE_REPETITION)
    last = last_to_look_at_ns((task, *rivals))
    yield from releases if last is None else takewhile(partial(ge, last), releases)


def last_to_look_at_ns(tasks: Sequence[Task]) -> Exact | None:
    """When the last job of a busy period is released that may respond later than all before it; None if not known.

    It is the hyperperiod H. With a demand of at most H in each window of that length, what is done at w of the first
    q jobs, and all that goes before them, is done at w + H of those that are released up to H later. Releases after the
    first instant repeat with H, so that jobs released after H respond no later than those H before them. (Where loads
    come close to 100 % a busy period has millions of jobs.) A separation of jobs does not repeat with H.

    >>> last_to_look_at_ns([periodic("a", 3, 8, 500), periodic("b", 3, 12)])
    Fraction(24, 1)
    """
    streams = [stream for task in tasks for stream in task.streams]
    if not streams or any(task.separation_ns is not None for task in tasks):
        return None
    if not all(type(stream.period_ns) in (int, Fraction) for stream in streams):
        return None
    ratios = [(Fraction(stream.period_ns).numerator, Fraction(stream.period_ns).denominator) for stream in streams]
    return Fraction(lcm(*(over for over, _ in ratios)), gcd(*(under for _, under in ratios)))
