"""Chains of threads in executors: what never waits at the same time (docs/semantics.md, section 4.6).

A chain begins with any thread or device; behind one are event-triggered ones with one trigger each. Of a hybrid thread
it is the timer that may begin one; its callback is in none, and in no line.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Container, Iterator, Sequence
from fractions import Fraction
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

from .pieces import Work, distance, piece_of
from .problem import NONE, as_list
from .stretches import MOMENT, MOST_PLAYED, Releases, has_no_end, play

if TYPE_CHECKING:
    from .scheduling import Job, Scheduling


class Chains:
    """Who is before whom in the chains of a design, and what follows for jobs that do not preempt each other."""

    def __init__(self, scheduling: Scheduling) -> None:
        self.known = scheduling
        self._names = [*scheduling.problem.sections["devices"], *scheduling.threads]
        self._before = {name: self._sender(name) for name in self._names}

    def _sender(self, name: str) -> tuple[str, Fraction, Fraction] | None:
        """The thread whose end alone releases this one, and the least and the longest time on the way."""
        reading = self.known.reading
        triggers = reading.triggers(name)
        if reading.protocol(name) != "aperiodic" or len(triggers) != 1 or reading.states_rate(triggers[0]):
            return None
        sender = reading.problem.component(triggers[0]).get("from")
        if sender not in self._names or reading.logical_ns(sender) is not None:
            return None
        if reading.segments(name) or reading.segments(sender) or reading.joins.joins(name):
            return None
        if reading.problem.may_wait(triggers[0]):
            return None
        rows = reading.transit_rows(triggers[0])
        least, most = (sum((Fraction(row[end]) for row in rows), Fraction(0)) for end in (2, 3))
        return sender, least, most

    def always_begins(self, name: str) -> bool:
        """Whether a chain begins here in every design: with a device, a timer, what is sporadic or several release."""
        reading, problem = self.known.reading, self.known.problem
        if name not in self.known.threads or len(reading.triggers(name)) > 1:
            return problem.section_of[name] in ("devices", "threads")
        kinds: list[str | None] = [kind for kind in problem.types(name) if kind != NONE]
        given = [each for kind in kinds or [None] for each in as_list(problem.stated(name, "dispatch_protocol", kind))]
        return "aperiodic" not in (given or [reading.protocol(name)])

    def sender(self, name: str) -> str | None:
        """What alone releases a thread by its end."""
        before = self._before[name]
        return None if before is None else before[0]

    def chain(self, name: str) -> list[str]:
        """All that is before a thread, the first of all first, and the thread."""
        before = self._before[name]
        return [name] if before is None else [*self.chain(before[0]), name]

    def heads_inside(self, job: Job, beyond: Container[Job]) -> Iterator[Job]:
        """The threads of an executor that release each other at once up to one, the nearest first; none `beyond`."""
        home, first = self.known.reading.executor_of(job[0]), job
        may_be = self.known.windows.successors.may_be_in_window
        while home is not None and may_be(first):
            sender = self.sender(first[0])
            before: Job = (sender or "", "timer")
            if sender is None or self.way(first[0]) or self.known.reading.executor_of(sender) != home:
                return
            if before in beyond or not may_be(before):
                return
            yield before
            first = before

    def ends_before(self, first: str, last: str) -> bool:
        """Whether a chain that begins with one thread, or before it, has ended at another whenever it begins again."""
        chain = self.chain(last)
        begins = chain[: chain.index(first) + 1] if first in chain else []
        return any(self._takes_no_longer(chain[chain.index(name) :]) for name in begins)

    def _takes_no_longer(self, part: list[str]) -> bool:
        """Whether part of a chain has always ended when its first is released again."""
        releases, takes = self.known.releases((part[0], "timer")), self.known.windows.bound(part)
        if takes is None or releases is None:
            return False
        most = distance(releases)
        return most is not None and takes <= most

    def way(self, name: str, *, least: bool = False) -> Fraction:
        """The longest time, or the least, of the connection that alone releases a thread."""
        before = self._before[name]
        assert before is not None, name
        return before[1] if least else before[2]

    def never_meet(self, one: Job, other: Job) -> bool:
        """Whether two jobs never wait at the same time; of one thread that and the next one."""
        if (one[1], other[1]) != ("timer", "timer"):
            return False
        return self.ends_before(one[0], other[0]) or self.ends_before(other[0], one[0])

    # What is over

    def behind_the_rest(
        self,
        job: Job,
        first: Sequence[Job],
        rest: Sequence[Job],
        outside: Sequence[Work],
        blocked: int,
        *,
        in_order: bool,
    ) -> Fraction | None:
        """The response time where what never waits while a job does is over; None without a bound.

        `first` goes before it inside (all that comes no later where they go `in_order`), of the `rest` one job may have
        begun, and what is `outside` preempts.
        """
        if not any(self.never_meet(other, job) for other in (*first, *rest)):
            return None
        times = self.known.times
        begun = max([blocked, *(times(other)[1] for other in rest if not self.never_meet(other, job))])
        over = max((times(other)[1] for other in rest if self.never_meet(other, job)), default=0)
        found = [self._behind(job, first, outside, (begun, 0), in_order=in_order)]
        if over:
            found.append(self._behind(job, first, outside, (0, over), in_order=in_order))
        return None if None in found else max(each for each in found if each is not None)

    def _behind(
        self, job: Job, first: Sequence[Job], outside: Sequence[Work], begun: tuple[int, int], *, in_order: bool
    ) -> Fraction | None:
        """The response time behind something that has `begun`, of another chain or of its own."""
        jobs = (job, *first)
        given = [(self.known.coming(other), self.known.times(other)[1]) for other in jobs]
        inside = [(releases, work) for releases, work in given if releases is not None]
        if len(inside) < len(given) or has_no_end([*inside, *outside], sum(begun)):
            return None
        over = [True, *(self.never_meet(other, job) for other in first)]  # its own earlier job is, with any other
        return Meanwhile(inside, over, outside, begun, in_order=in_order).longest()

    # Lines

    def in_lines(self, job: Job, fellows: Sequence[Job], outside: Sequence[Work], blocked: int = 0) -> Fraction | None:
        """The response time in the order of arrival where each thread is in a line; None where one is in none."""
        lines = self._lines([job, *(other for other in fellows if self.known.times(other)[1])])
        if lines is None:
            return None
        own = None if piece_of(job) is None else job[0]
        work = Fraction(self.known.times(job)[1] + blocked)
        for line in lines:
            waiting = [other for other in line if other[0] != own and not self.never_meet(other, job)]
            work += max((self.known.times(other)[1] for other in waiting), default=0)
        alone = Releases(())
        return None if has_no_end([(alone, work), *outside], 0) else play(alone, work, outside)

    def _lines(self, jobs: Sequence[Job]) -> list[list[Job]] | None:
        """Of all of which at most one job waits when another comes."""
        here = {job[0] for job in jobs if job[1] == "timer"}
        groups: dict[str, list[Job]] = {}
        for job in jobs:
            if job[1] == "callback" or self.known.coming(job) is None:
                return None
            chain = [name for name in self.chain(job[0]) if name in here]
            groups.setdefault(job[0] if piece_of(job) is not None else chain[0], []).append(job)
        found: list[list[Job]] = []
        for group in groups.values():
            pairs = [] if piece_of(group[0]) is not None else list(combinations_with_replacement(group, 2))
            if all(self.never_meet(*pair) for pair in pairs):
                found.append(group)
            elif all(self.never_meet(job, job) for job in group):
                found += [[job] for job in group]
            else:
                return None
        return found


class Meanwhile:
    """What a job waits for that comes so long after a busy period has begun; the first of `inside` is its own."""

    def __init__(
        self,
        inside: Sequence[Work],
        over: Sequence[bool],
        outside: Sequence[Work],
        begun: tuple[int, int],
        *,
        in_order: bool,
    ) -> None:
        self.inside, self.over, self.outside, self.in_order = inside, over, outside, in_order
        self.begun_over = begun[1]
        self.sooner = MOMENT if begun[0] else Fraction(0)
        self.begun = begun[0] - self.sooner
        self._known: dict[Releases, tuple[list[Fraction], Iterator[Fraction]]] = {}

    def longest(self) -> Fraction | None:
        """Over all times of the busy period at which the job may come."""
        end = self._end()
        if end is None:
            return None
        starts = sorted({time for work in self.inside for time in self._until(work, end)})
        found: list[Fraction | None] = []
        for start, following in zip(starts, [*starts[1:], end], strict=True):
            found.append(self._waits(start, start))
            most = self._over_by(start)
            if start < most:  # the later it comes the longer what is over may have run
                found.append(self._waits(start, most if most < following else following - MOMENT / 1000))
        if None in found:
            return None
        return max(each for each in found if each is not None) + self.sooner

    def _until(self, work: Work, end: Fraction) -> list[Fraction]:
        """When jobs come before a time."""
        known, times = self._known.setdefault(work[0], ([], work[0].densest()))
        while not known or known[-1] < end:
            following = next(times, None)
            if following is None:
                break
            known.append(following)
        return known[: bisect_left(known, end)]

    def _count(self, work: Work, time: Fraction, *, closed: bool) -> int:
        """Jobs that come before a time, or no later than it."""
        return len(self._until(work, time + MOMENT / 10**6 if closed else time))

    def _end(self) -> Fraction | None:
        """When all is done for the first time."""
        return self._least(self.begun + self.begun_over, [*self.inside, *self.outside], closed=False)

    def _least(self, work: Fraction, coming: Sequence[Work], *, closed: bool) -> Fraction | None:
        """The first time at which so much work is done, and what comes until then."""
        now = max(work, MOMENT / 10**5)
        for _ in range(MOST_PLAYED):
            need = work + sum(cost * self._count((each, cost), now, closed=closed) for each, cost in coming)
            if need <= now:
                return need
            now = need
        return None

    def _over_by(self, start: Fraction) -> Fraction:
        """All work until a time of what is over when a job comes then."""
        own, *others = zip(self.inside, self.over, strict=True)
        found = Fraction(self.begun_over)
        if own[1]:
            found += own[0][1] * (self._count(own[0], start, closed=True) - 1)
        return found + sum(work[1] * self._count(work, start, closed=True) for work, over in others if over)

    def _waits(self, start: Fraction, comes: Fraction) -> Fraction | None:
        """From its release to its end, of a job that `comes` when nothing else has come since `start`."""
        own, *others = self.inside
        work = self.begun + min(self._over_by(start), comes)
        if not self.over[0]:
            work += own[1] * (self._count(own, start, closed=True) - 1)
        waiting = [each for each, over in zip(others, self.over[1:], strict=True) if not over]
        if self.in_order:
            work += sum(each[1] * self._count(each, start, closed=True) for each in waiting)
        else:
            begins = self._least(work, [*waiting, *self.outside], closed=True)
            if begins is None:
                return None
            work += sum(each[1] * self._count(each, begins, closed=True) for each in waiting)
        ends = self._least(work + own[1], self.outside, closed=False)
        return None if ends is None else ends - comes
