"""Chains of threads: what is over, windows, lags, and the ways to cut a chain (docs/semantics.md, section 4.9).

A window is a row of two threads or more of a chain on one core, by themselves or in executors. The lag of a window, or
of a thread that priorities alone schedule, is how much later it ends than what released it comes at the latest.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Container, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import count
from math import lcm
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from .pieces import distance
from .stretches import MOST_PLAYED, Releases, has_no_end, kept_apart
from .successors import Behind, Case, Successors

if TYPE_CHECKING:
    from .scheduling import Job, Scheduling

Row: TypeAlias = tuple[str, ...]
"""Threads that release each other, the first one first."""


class Rival(NamedTuple):
    """What goes first: when its jobs come, how long each takes, and whether they are over.

    Those `behind` the window itself come no more often than that lets them.
    """

    releases: Releases
    work: Fraction
    is_over: bool = False
    behind: Behind | None = None


class Begun(NamedTuple):
    """A busy window of a row of threads: when these come, and what the time to their end is counted from.

    Besides, what goes first, how long something else may have begun before, and before which places in the row again.
    """

    own: Releases
    counted: Releases
    rivals: Sequence[Rival]
    blocked: Fraction
    breaks: Sequence[int]


class Windows:
    """How long chains of a design take, None without a bound.

    `spans` are the windows as last found, `lags` those of windows and of single threads that are not the first of their
    chain.
    """

    def __init__(self, scheduling: Scheduling) -> None:
        self.known, self.chains = scheduling, scheduling.chains
        self.successors = Successors(scheduling)
        self._times: dict[Releases, Dense] = {}
        self.spans: dict[Row, Fraction | None] = {}
        self.lags: dict[Row, Fraction | None] = {}
        if not scheduling.only_buses:
            here = {job[0] for job in scheduling.jobs if self.successors.may_be_in_window(job)}
            for name in scheduling.threads:
                for row in self._rows(name, here):
                    work = sum(scheduling.times((each, "timer"))[1] for each in row)
                    takes = work + sum(self._ways(row), Fraction(0))
                    if len(row) > 1:
                        self.spans[row] = takes
                    if self.source(row[0]) != row[0] and (len(row) > 1 or self.successors.is_plain((name, "timer"))):
                        self.lags[row] = takes

    def _rows(self, name: str, here: set[str]) -> Iterator[Row]:
        """All windows that end with a thread, and the thread by itself."""
        chain = self.chains.chain(name)
        for first in reversed(range(len(chain))):
            row = tuple(chain[first:])
            if not here.issuperset(row) or len({self.known.core((each, "timer")) for each in row}) > 1:
                return
            if len(row) > 1 and any(self.successors.is_stated(each) for each in row):
                return
            yield row

    def _ways(self, row: Sequence[str]) -> list[Fraction]:
        """The longest times of the connections between threads in a row."""
        return [self.chains.way(name) for name in row[1:]]

    # Cuts

    def source(self, name: str) -> str:
        """The first of the chain of a thread."""
        return self.chains.chain(name)[0]

    def bound(self, part: Sequence[str]) -> Fraction | None:
        """S of part of a chain, by response times alone: the least over all ways to cut it; None without a bound."""
        return self._cut(part, {name: self.known.of(name) for name in part}, {})

    def cut(
        self,
        part: Sequence[str],
        responses: Mapping[str, Fraction | None],
        stated: Container[str] = (),
        *,
        counts_lags: bool,
        slowest: int | None = None,
    ) -> Fraction | None:
        """The longest that part of a chain takes, of threads that respond so, some of them as `stated`.

        Lags count where that begins with the source of a chain, but not while nothing waits. With the period of the
        `slowest` timer before a thread that takes messages in order it is from the latest release of that on.
        """
        has_lags = counts_lags and not self.known.is_alone
        lags = {row: lag for row, lag in self.lags.items() if row[0] not in stated} if has_lags else {}
        if slowest is not None and part[0] not in stated and self.successors.is_plain((part[0], "timer")):
            begins = Releases(((slowest, Fraction(0)),))
            lags[part[0],] = self._alone((part[0], "timer"), begins)
            lags |= {row: self._window(row, begins) for row in self.spans if row[0] == part[0]}
        return self._cut(part, responses, lags)

    def _cut(
        self, part: Sequence[str], responses: Mapping[str, Fraction | None], lags: Mapping[Row, Fraction | None]
    ) -> Fraction | None:
        ways = [Fraction(0), *self._ways(part)]
        best: list[Fraction | None] = [Fraction(0)]
        for end in range(1, len(part) + 1):
            sums = []
            for at in range(end):
                row = tuple(part[at:end])
                takes = responses[row[0]] if len(row) == 1 else self.spans.get(row)
                before, lag = best[at], lags.get(row)
                if takes is not None and before is not None:
                    sums.append(before + ways[at] + (takes if lag is None else min(takes, lag)))
            best.append(min(sums, default=None))
        return best[-1]

    def response(self, row: Row) -> Fraction | None:
        """R of a single thread or a window."""
        return self.known.of(row[0]) if len(row) == 1 else self.spans[row]

    # What goes first

    def single(
        self,
        job: Job,
        rivals: Sequence[Job],
        shares: Sequence[tuple[Releases, int]],
        counted: Releases | None = None,
    ) -> Fraction | None:
        """The response time of a thread, some of whose rivals are over; None without a bound.

        From what is `counted` to its end where that is not its own release.
        """
        over = {other for other in rivals if self._is_over(other, job)}
        work, blocked = Fraction(self.known.times(job)[1]), Fraction(self.known.blocked(job))
        found = []
        for case in self.successors.cases(job, job, job, rivals):
            given = self._given(case, over)
            if given is None or case.own is None:
                return None
            found.append(
                self._longest(
                    case.own, counted or case.own, work, [*given, *_others(shares)], ends=bool(over), begun=blocked
                )
            )
        return greatest(found)

    def is_over_somewhere(self, job: Job, rivals: Sequence[Job]) -> bool:
        """Whether some rival of a thread is over when it is released."""
        return any(self._is_over(other, job) for other in rivals)

    def _is_over(self, other: Job, job: Job) -> bool:
        if not (self.successors.may_be_in_window(other) and self.successors.is_plain(job)):
            return False
        return self.chains.never_meet(other, job)

    def _given(self, case: Case, over: Container[Job]) -> list[Rival] | None:
        """What goes first in busy windows of a kind; None where some of it may be late without a bound."""
        found = []
        for job, releases in case.rivals.items():
            if releases is None:
                return None
            found.append(Rival(releases, Fraction(self.known.times(job)[1]), job in over, case.behind.get(job)))
        return found

    # Windows and lags

    def fresh(self) -> tuple[dict[Row, Fraction | None], dict[Row, Fraction | None]]:
        """All windows and all lags anew, by what is known."""
        spans = {row: span and self._window(row) for row, span in self.spans.items()}
        return spans, {row: lag and self._lag(row) for row, lag in self.lags.items()}

    def _lag(self, row: Row) -> Fraction | None:
        """How long after the latest release of its first thread a row of a chain ends."""
        begins = self.known.releases((self.source(row[0]), "timer"))
        if begins is None:
            return None
        begins = Releases(begins.streams)  # whatever their least distance
        if len(row) > 1:
            return self._window(row, begins)
        return self._alone((row[0], "timer"), begins)

    def _alone(self, job: Job, begins: Releases) -> Fraction | None:
        """How long after its latest release a thread ends, with the releases that this is counted from."""
        here = [other for other in self.known.beside(job) if self.known.times(other)[1]]
        shares = self.known.shares(job)
        if shares is None:
            return None
        return self.single(job, [other for other in here if self.known.goes_before(other, job)], shares, begins)

    def _window(self, row: Row, counted: Releases | None = None) -> Fraction | None:
        """The longest to the end of the last of a row; from the release of the first, or as is `counted`.

        What is less urgent in the group of the level has begun, or is a rival: the lesser of both.
        """
        ways = [self._window_where(row, counted, in_group=in_group) for in_group in (True, False)]
        return min((each for each in ways if each is not None), default=None)

    def _window_where(self, row: Row, counted: Releases | None, *, in_group: bool) -> Fraction | None:
        known = self.known
        jobs: list[Job] = [(name, "timer") for name in row]
        beside = [other for other in known.beside(jobs[0]) if other not in jobs and known.times(other)[1]]
        rivals = [other for other in beside if any(self._goes_before(other, job) for job in jobs)]
        level = self._level(jobs, beside)
        begun = [each for each in rivals if in_group and self._may_have_begun(each, level, [*beside, *jobs])]
        rivals = [other for other in rivals if other not in begun]
        sections = [known.section(other[0]) for other in beside if not self._goes_before(other, level)]
        blocked = Fraction(max([0, *sections, *(known.times(other)[1] for other in begun)]))
        ends = self.chains.ends_before(row[0], row[-1])
        if not ends and any(known.reading.room(*job) is not None for job in jobs):
            return None
        breaks = [place for place, way in enumerate(self._ways(row), start=1) if way or begun]
        over = {other for other in rivals if ends and self._is_past(other, row)}
        found = []
        cases = self.successors.cases(jobs[0], level, jobs[-1], rivals)
        if begun:  # a job of these ends in each piece, whenever it was released
            coming = {other: known.coming(other, begun) for other in rivals}
            cases = iter([Case(known.coming(jobs[0], begun), coming, {})])
        elif breaks:
            cases = iter([self.successors.broken(jobs[0], level, rivals, 1 + len(breaks) if ends else None)])
        for case in cases:
            given = self._given(case, over)
            if given is None or case.own is None:
                return None
            given += _others(known.shares(level) or ())
            window = Begun(case.own, counted or case.own, given, blocked, breaks)
            if ends or breaks:
                found.append(self._ended(row, window))
            if not ends:
                found.append(self._behind(row, window))
        return greatest(found)

    def _ended(self, row: Row, case: Begun) -> Fraction | None:
        """Of a row that has ended whenever it is released again."""
        ways, work = self._ways(row), Fraction(sum(self.known.times((name, "timer"))[1] for name in row))
        begun = sum(ways, Fraction(0)) + (1 + len(case.breaks)) * case.blocked
        tail = self._tail(row, case)
        return self._longest(case.own, case.counted, work, case.rivals, ends=True, begun=begun, tail=tail)

    def _behind(self, row: Row, case: Begun) -> Fraction | None:
        """Of the last threads of a row as if all of it came at once, and those before these went first.

        The last threads begin with the first that goes before none that follows; with breaks that is only the last.
        """
        times = [Fraction(self.known.times((name, "timer"))[1]) for name in row]
        jobs: list[Job] = [(name, "timer") for name in row]
        cut = any(self._executor(job) is not None and self.known.section(job[0]) for job in jobs[:-1])
        turns = (at for at in range(len(row)) if not case.breaks and not cut and self._goes_first_nowhere(jobs, at))
        begin = next(turns, len(row) - 1)
        work = sum(times[begin:], sum(self._ways(row), Fraction(0))) + len(case.breaks) * case.blocked
        before = [Rival(case.own, time) for time in times[:begin]]
        rivals = [*case.rivals, *before]
        return self._longest(case.own, case.counted, work, rivals, ends=False, begun=case.blocked)

    def _executor(self, job: Job) -> str | None:
        return self.known.reading.executor_of(job[0])

    def _goes_before(self, other: Job, job: Job) -> bool:
        """Whether one thread may go before another one on its core: in one executor each goes before the others."""
        executor = self._executor(job)
        return (executor is not None and executor == self._executor(other)) or self.known.goes_before(other, job)

    def _is_group(self, job: Job, beside: Sequence[Job]) -> bool:
        """Whether a thread is in a callback group, with a priority that nothing outside of it shares."""
        executor = self._executor(job)
        if executor is None or self.known.reading.get(executor, "kind") != "callback_group":
            return False
        outside = [each for each in [*beside, *self.known.beside(job)] if self._executor(each) != executor]
        return not any(self.known.goes_before(other, job) and self.known.goes_before(job, other) for other in outside)

    def _level(self, jobs: Sequence[Job], beside: Sequence[Job]) -> Job:
        """The least urgent of a row: of its threads in a callback group that one of these."""
        least = next(job for job in jobs if all(other == job or self._goes_before(other, job) for other in jobs))
        if not self._is_group(least, [*beside, *jobs]):
            return least
        inside = [job for job in jobs if self._executor(job) == self._executor(least)]
        first = self.known.goes_first_inside
        return next(job for job in inside if all(other == job or first(other, job) for other in inside))

    def _may_have_begun(self, other: Job, level: Job, beside: Sequence[Job]) -> bool:
        """Whether one job of a thread may have begun at most: it is less urgent in the callback group of the level."""
        is_inside = self._executor(other) == self._executor(level) and self._is_group(level, beside)
        return is_inside and not self.known.goes_first_inside(other, level)

    def _goes_first_nowhere(self, jobs: Sequence[Job], place: int) -> bool:
        """Whether one in a row goes before none of those behind it."""
        return not any(self._goes_before(jobs[place], other) for other in jobs[place + 1 :])

    def _is_past(self, other: Job, row: Row) -> bool:
        """Whether a rival comes before a window, or after it, and all of that has ended when it begins again."""
        name = other[0]
        homes = {self._executor((each, "timer")) for each in row} - {None}
        if not self.successors.may_be_in_window(other) or homes - {self._executor(other)}:
            return False
        if name in self.chains.chain(row[0]):
            return self.chains.ends_before(name, row[-1])
        return row[-1] in self.chains.chain(name) and self.chains.ends_before(row[0], name)

    def _tail(self, row: Row, case: Begun) -> Fraction:
        """What may be left of an earlier job that is on its way when the busy period begins."""
        if not case.breaks:
            return Fraction(0)
        tail = Fraction(sum(self.known.times((name, "timer"))[1] for name in row[case.breaks[0] :]))
        alone = (Releases(()), case.blocked + tail)
        is_endless = has_no_end([alone, *((each.releases, each.work) for each in case.rivals)], 0)
        ends = None if is_endless else self._least(case.blocked + tail, case.rivals)
        releases, takes = self.known.releases((row[0], "timer")), self.bound(row)
        most = None if releases is None else distance(releases)
        if ends is None or takes is None or (most is not None and ends > most - takes):
            return tail
        return Fraction(0)

    # The busy period

    def _came(self, releases: Releases, end: Fraction) -> int:
        """Jobs in [0, end)."""
        return self._dense(releases).before(end)

    def _dense(self, releases: Releases) -> Dense:
        return self._times.setdefault(releases, Dense(releases))

    def _came_of(self, rival: Rival, end: Fraction, ended: int | None, release: Fraction | None) -> int:
        """Jobs of a rival in [0, end), until the end of a job with such a release; so many had `ended` before."""
        count = self._came(rival.releases, end)
        return count if rival.behind is None or ended is None else min(count, rival.behind.most(ended, release))

    def _least(
        self,
        work: Fraction,
        rivals: Sequence[Rival],
        ended: int | None = None,
        release: Fraction | None = None,
    ) -> Fraction | None:
        """The first time at which so much work is done, and all of rivals that has come."""
        now = work
        for _ in range(MOST_PLAYED):
            need = work + sum(each.work * self._came_of(each, now, ended, release) for each in rivals)
            if need <= now:
                return now
            now = need
        return None

    def _longest(
        self,
        own: Releases,
        counted: Releases,
        work: Fraction,
        rivals: Sequence[Rival],
        *,
        ends: bool,
        begun: Fraction = Fraction(0),
        tail: Fraction = Fraction(0),
    ) -> Fraction | None:
        """The greatest of w - max(r, ...) over the jobs of the busy period, with r of the releases that are `counted`.

        With `ends` each job has ended when the next one comes. What has `begun` goes before all, and the `tail`.
        """
        every = [(own, work), *((each.releases, each.work) for each in rivals)]
        if has_no_end(every, 1 if begun + tail else 0):
            return None
        found = Fraction(0)
        last_job = self._last_job(own, every)
        for job in count(1):
            need, soonest = begun + tail + job * work, self._dense(own).at(job - 1)
            latest, release = self._least(need, rivals, job - 1), self._dense(counted).at(job - 1)
            assert soonest is not None and release is not None
            if latest is None:
                return None
            looks = {at for each in rivals if each.behind for at in each.behind.looks(job - 1, soonest) if at < latest}
            for at in (soonest, *looks):
                now = self._least(need, rivals, job - 1, at)
                assert now is not None  # it is no later than the latest
                past = Fraction(0)
                if ends:
                    past = tail + (job - 1) * work
                    past += sum(each.work * self._came_of(each, now, job - 1, at) for each in rivals if each.is_over)
                found = max(found, now - max(at, release, past))
            following = self._dense(own).at(job)
            all_done = self._least(need, rivals, job)
            if following is None or job == last_job or (all_done is not None and all_done <= following):
                return found
        raise AssertionError

    def _last_job(self, own: Releases, every: Sequence[tuple[Releases, Fraction]]) -> int | None:
        """The job from which on those of a core without any idle time are as late as before.

        These are all that come before whatever comes so many times only has come, and in the hyperperiod behind that.
        """
        if own.most is not None or sum(releases.often * work for releases, work in every) < 1:
            return None
        endless = [releases for releases, _ in every if releases.most is None]
        hyperperiod = lcm(*(period for releases in endless for period, _ in kept_apart(releases)))
        latest = [self._dense(releases).at((releases.most or 1) - 1) for releases, _ in every if releases.most]
        return self._came(
            own, max((each for each in latest if each is not None), default=Fraction(0)) + 2 * hyperperiod
        )


class Dense:
    """The releases of streams from the first on, each as early as it can be."""

    def __init__(self, releases: Releases) -> None:
        self._coming, self._known = releases.densest(), list[Fraction]()

    def at(self, place: int) -> Fraction | None:
        """When a job comes, the first of which is 0; None where there are not so many."""
        while len(self._known) <= place:
            following = next(self._coming, None)
            if following is None:
                return None
            self._known.append(following)
        return self._known[place]

    def before(self, end: Fraction) -> int:
        """How many come before a time."""
        while not self._known or self._known[-1] < end:
            if self.at(len(self._known)) is None:
                break
        return bisect_left(self._known, end)


def greatest(times: Sequence[Fraction | None]) -> Fraction | None:
    """The greatest time; None where one has no bound."""
    known = [time for time in times if time is not None]
    return max(known) if len(known) == len(times) else None


def _others(shares: Sequence[tuple[Releases, int]]) -> list[Rival]:
    """What reservations take."""
    return [Rival(releases, Fraction(work)) for releases, work in shares]
