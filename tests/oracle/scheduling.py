"""Response times of one design, by playing the busiest stretch of each core job by job.

A core is played from the moment at which everything on it is released as soon as it can be: more urgent work first,
then the jobs of the thread itself in the order of their release. How long its jobs take there, at worst, is its
response time. What response times add to the releases of those that events dispatch is found by playing all of it
again until nothing changes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from heapq import heappop, heappush, merge
from itertools import count
from typing import TYPE_CHECKING, Any, TypeAlias

from . import quantities
from .problem import as_list
from .quantities import NS_PER_S

if TYPE_CHECKING:
    from .reading import Reading

Job: TypeAlias = tuple[str, str]
"""A thread, and ``timer`` or ``callback``: a hybrid thread runs both, whatever events dispatch is a timer here, too."""
MOST_PLAYED = 200_000
"""Releases of a stretch that has not ended by then: it is taken to have no end."""


@dataclass(frozen=True)
class Releases:
    """Streams of (period, how late at most); jobs at least `apart` from each other. No stream: one job."""

    streams: tuple[tuple[int, Fraction], ...]
    apart: int = 0

    def densest(self) -> Iterator[Fraction]:
        """Times from the first release on, each as early as it can be."""
        if not self.streams:
            yield Fraction(0)
            return
        for number, time in enumerate(merge(*(_each(*stream) for stream in self.streams))):
            yield max(time, Fraction(number * self.apart))

    @property
    def often(self) -> Fraction:
        """Jobs per ns in the long run."""
        whole = sum((Fraction(1, period) for period, _ in self.streams), Fraction(0))
        return min(whole, Fraction(1, self.apart)) if self.apart else whole


def _each(period: int, late: Fraction) -> Iterator[Fraction]:
    """The releases of one stream."""
    return (max(Fraction(0), number * period - late) for number in count())


class Scheduling:
    """The response times of all that runs on the processors in one complete design."""

    def __init__(self, reading: Reading) -> None:
        self.reading, self.problem = reading, reading.problem
        self.threads = list(self.problem.sections["threads"])
        self.jobs = [job for name in self.threads for job in self._jobs_of(name)]
        self.cores: dict[tuple[str, int], list[Job]] = {}
        for job in self.jobs:
            self.cores.setdefault(self._core(job[0]), []).append(job)
        self.longest = self._longest_period()
        self.response: dict[Job, Fraction | None] = {job: Fraction(self._times(job)[1]) for job in self.jobs}
        self._settle()

    def of(self, name: str, part: str = "timer") -> Fraction | None:
        """The response time, None without a bound; what executes nothing on a processor takes what it takes."""
        alone = Fraction(self._times((name, part))[1])
        found = self.response.get((name, part), alone)
        return None if found is None else max(alone, found)

    def _jobs_of(self, name: str) -> Iterator[Job]:
        if self.reading.processor_of(name) is None:
            return
        if self.reading.protocol(name) == "hybrid" and self.reading.get(name, "callback_execution_time") is not None:
            yield name, "callback"
        if self.reading.get(name, "compute_execution_time") is not None:
            yield name, "timer"

    def _core(self, name: str) -> tuple[str, int]:
        slot = self.reading.processor_of(name)
        assert slot is not None
        if int(self.reading.get(slot, "cores") or 1) == 1:
            return slot, 1
        chosen = as_list(self.reading.design.get(f"{name}.core") or self.problem.component(name).get("core"))
        (core,) = chosen  # where it is open nobody may ask for a response time
        return slot, int(core)

    def _times(self, job: Job) -> tuple[int, int]:
        """Shortest and longest time of one job alone."""
        fields = ("compute_execution_time", "latency", "response_time")
        for field in ("callback_execution_time",) if job[1] == "callback" else fields:
            text = self.reading.get(job[0], field)
            if text is not None:
                return quantities.time_range(text)
        return 0, 0

    def _longest_period(self) -> int:
        """Of everything in the file, in whatever design."""
        found: list[int] = []
        for section in ("devices", "threads"):
            for name in self.problem.sections[section]:
                kinds: list[Any] = [kind for kind in self.problem.types(name) if kind != "none"]
                for kind in kinds or [None]:
                    found += map(quantities.period, as_list(self.problem.stated(name, "period", kind)))
        return max(found, default=NS_PER_S)

    def _settle(self) -> None:
        """Plays all cores again and again; what grows beyond ten times the longest period has no bound."""
        for number in count():
            fresh = {job: self._played(job) for job in self.jobs}
            for job, before in self.response.items():
                found = fresh[job]
                grows = number > 0 and found is not None and found != before and found > 10 * self.longest
                fresh[job] = None if before is None or grows else found
            if fresh == self.response:
                return
            self.response = fresh

    def _played(self, job: Job) -> Fraction | None:
        """The longest that a job takes in the busiest stretch of its core; None where the stretch may not end."""
        own, work = self._releases(job), self._times(job)[1]
        if work == 0:
            return Fraction(0)
        if self._executor(job[0]) is not None:
            return self._played_inside(job)
        rivals = [
            (self._releases(other), self._times(other)[1])
            for other in self._beside(job)
            if self._goes_before(other, job)
        ]
        if own is None or any(releases is None for releases, _ in rivals):
            return None
        before = [(releases, time) for releases, time in rivals if releases is not None and time]
        shares = self._shares(job)
        if shares is None or _has_no_end([(own, work), *before, *shares], 0):
            return None
        return play(own, work, [*before, *shares])

    def _played_inside(self, job: Job) -> Fraction | None:
        """The same of a job that shares an OS thread: of an executor one job runs at a time, to its end.

        What goes before the executor preempts all of it.
        """
        here = [other for other in self._beside(job) if self._times(other)[1]]
        executor = self._executor(job[0])
        fellows = [other for other in here if self._executor(other[0]) == executor]
        outside = [other for other in here if other not in fellows and self._goes_before(other, job)]
        assert executor is not None
        kind, begun = self.reading.get(executor, "kind"), 0
        if kind == "callback_group":
            urgent = [other for other in fellows if self._goes_first_inside(other, job)]
            begun = max((self._times(other)[1] for other in fellows if other not in urgent), default=0)
            fellows = urgent
        given = [(self._releases(other), self._times(other)[1]) for other in (job, *fellows, *outside)]
        known = [(releases, work) for releases, work in given if releases is not None]
        shares = self._shares(job)
        if len(known) < len(given) or shares is None or _has_no_end([*known, *shares], begun):
            return None
        inside, others = known[: len(fellows) + 1], known[len(fellows) + 1 :]
        return play_inside(inside, [*others, *shares], begun, in_order=kind == "fifo")

    # Reservations

    def _reservation(self, name: str) -> str | None:
        found: str | None = self.problem.component(name).get("reservation")
        return found

    def _beside(self, job: Job) -> list[Job]:
        """What else runs on the core of a job in the same reservation, or outside of all as the job does."""
        home = self._reservation(job[0])
        here = self.cores[self._core(job[0])]
        return [other for other in here if other != job and self._reservation(other[0]) == home]

    def _budget(self, reservation: str) -> tuple[int, int]:
        """How much there is in each period."""
        period = self.reading.get(reservation, "period")
        return quantities.deadline(self.reading.get(reservation, "budget")), quantities.period(period)

    def _shares(self, job: Job) -> list[tuple[Releases, int]] | None:
        """What reservations take of the core of a job; inside of one, the times without a budget.

        These are, from the worst moment on: nothing for twice the rest of a period, then a budget, and after each
        budget nothing for one such rest. None where the budget itself may come too late.
        """
        home = self._reservation(job[0])
        if home is None:
            return self._reserved_before(job)
        budget, period = self._budget(home)
        outside = [other for other in self.cores[self._core(job[0])] if self._reservation(other[0]) is None]
        given = [(self._releases(other), self._times(other)[1]) for other in outside if self._goes_before(other, job)]
        before = [(releases, work) for releases, work in given if releases is not None and work]
        before += self._reserved_before(job)
        if any(releases is None for releases, _ in given):
            return None
        own = Releases(())
        ends = None if _has_no_end([(own, budget), *before], 0) else play(own, budget, before)
        if ends is None or ends > period:
            return None
        return [(Releases(((period, Fraction(budget)),)), period - budget)] if budget < period else []

    def _reserved_before(self, job: Job) -> list[tuple[Releases, int]]:
        """The budgets of other reservations that go before a job, each as late in its period as it may be wanted."""
        found = {}
        for other in self.cores[self._core(job[0])]:
            reservation = self._reservation(other[0])
            if reservation not in (None, self._reservation(job[0])) and self._goes_before(other, job):
                budget, period = self._budget(reservation)
                found[reservation] = (Releases(((period, Fraction(period - budget)),)), budget)
        return list(found.values())

    # Who goes first

    def _executor(self, name: str) -> str | None:
        found: str | None = self.problem.component(name).get("executor")
        return found

    def _goes_first_inside(self, other: Job, job: Job) -> bool:
        if other[0] == job[0]:
            return other[1] == "callback"
        one, two = self._turn(other[0]), self._turn(job[0])
        if one[0] == two[0] == 0 and one == two:
            return True
        return (one, self.threads.index(other[0])) < (two, self.threads.index(job[0]))

    def _place(self, name: str) -> tuple[tuple[int, Fraction], int]:
        """The turn of an OS thread on its core, and the place in the file of its first thread."""
        executor = self._executor(name)
        if executor is None:
            return self._turn(name), self.threads.index(name)
        members = [other for other in self.threads if self._executor(other) == executor]
        number = self.problem.component(executor).get("priority")
        if number is not None:
            return (0, Fraction(-int(number))), self.threads.index(members[0])
        rate = max(self.reading.rate(member) for member in members)
        return ((1, NS_PER_S / rate) if rate else (2, Fraction(0))), self.threads.index(members[0])

    def _place_of_all(self, name: str) -> tuple[tuple[int, Fraction], int]:
        """The same where what is in a reservation goes as that does."""
        reservation = self._reservation(name)
        if reservation is None:
            return self._place(name)
        first = next(i for i, other in enumerate(self.threads) if self._reservation(other) == reservation)
        number = self.problem.component(reservation).get("priority")
        turn = (0, Fraction(-int(number))) if number is not None else (1, Fraction(self._budget(reservation)[1]))
        return turn, first

    def _goes_before(self, other: Job, job: Job) -> bool:
        if other[0] == job[0]:
            return other[1] == "callback"
        homes = [self._reservation(name) for name in (other[0], job[0])]
        place = self._place if homes[0] == homes[1] else self._place_of_all
        (one, first), (two, second) = place(other[0]), place(job[0])
        if one[0] == two[0] == 0 and one == two:
            return True  # one number: each may be before the other
        return (one, first) < (two, second)

    def _turn(self, name: str) -> tuple[int, Fraction]:
        """Numbers before times before nothing; the lesser goes first."""
        rule = self.reading.get(name, "priority") or self.problem.document.get("priorities", "rate_monotonic")
        if rule not in ("rate_monotonic", "deadline_monotonic"):
            return 0, Fraction(-int(rule))
        deadline = self.reading.get(name, "deadline")
        if rule == "deadline_monotonic":
            if deadline is not None:
                return 1, Fraction(quantities.deadline(deadline))
            if self.reading.has_period(name):
                return 1, Fraction(self.reading.period_ns(name) or 0)
        rate = self.reading.rate(name)
        return (1, NS_PER_S / rate) if rate else (2, Fraction(0))

    # What releases jobs

    def _releases(self, job: Job) -> Releases | None:
        """None where they may be late without a bound."""
        name, part = job
        protocol = self.reading.protocol(name)
        period = self.reading.period_ns(name) if self.reading.has_period(name) else None
        if part == "timer" and protocol in ("periodic", "hybrid"):
            assert period is not None, name
            return Releases(((period, Fraction(0)),))
        arriving = self._arriving(name)
        apart = period if part == "timer" and protocol == "sporadic" else None
        return None if arriving is None else Releases(arriving, apart or 0)

    def _arriving(self, name: str) -> tuple[tuple[int, Fraction], ...] | None:
        found: list[tuple[int, Fraction]] = []
        for connection in self.reading.triggers(name):
            delivered = self._delivered(connection)
            if delivered is None:
                return None
            found += delivered
        return tuple(found)

    def _delivered(self, connection: str) -> list[tuple[int, Fraction]] | None:
        """What a connection brings: late by what its sender and the way may take longer than at least."""
        rows = self.reading.connection_rows(connection)
        spread = sum((Fraction(row[3]) - row[2] for row in rows), Fraction(0))
        sender = self.problem.component(connection).get("from")
        if sender is None or self.reading.states_rate(connection):
            rate = self.reading.delivered_rate(connection)
            return [(max(1, int(NS_PER_S / rate)), spread)] if rate else []
        leaving = self._leaving(sender)
        return None if leaving is None else [(period, late + spread) for period, late in leaving]

    def _leaving(self, name: str) -> list[tuple[int, Fraction]] | None:
        """What a component sends, once for each of its jobs; one that keeps its distance sends no faster than that."""
        releases, takes = self._releases((name, "timer")), self.of(name)
        if releases is None or takes is None:
            return None
        streams = releases.streams
        if releases.apart and sum(Fraction(1, period) for period, _ in streams) * releases.apart >= 1:
            streams = ((releases.apart, Fraction(0)),)
        return [(period, late + takes - self._times((name, "timer"))[0]) for period, late in streams]


def _has_no_end(given: Sequence[tuple[Releases, int]], begun: int) -> bool:
    """Whether there is more work than time, or as much and some of it is early: a stretch never ends then."""
    used = sum((releases.often * work for releases, work in given), Fraction(0))
    is_more = begun > 0 or any(
        not releases.streams or any(late for _, late in releases.streams) for releases, _ in given
    )
    return used > 1 or (used == 1 and is_more)


def play(own: Releases, work: int, before: Sequence[tuple[Releases, int]]) -> Fraction | None:
    """The longest time from the release of one of `own` jobs, of so much `work`, to its end.

    The core is never idle meanwhile: all that is released goes `before` these jobs.

    >>> a, b, c = (Releases(((period, Fraction(0)),)) for period in (7, 12, 20))
    >>> play(c, 5, [(a, 3), (b, 3)])
    Fraction(20, 1)
    """
    coming: list[tuple[Fraction, int, int, Iterator[Any]]] = []
    for number, (releases, cost) in enumerate([(own, work), *before]):
        times = releases.densest()
        heappush(coming, (next(times), number, cost, times))
    now = urgent = worst = Fraction(0)
    waiting: deque[tuple[Fraction, Fraction]] = deque()
    for _ in range(MOST_PLAYED):
        upcoming = coming[0][0] if coming else None
        while urgent or waiting:  # until the next release
            left = None if upcoming is None else upcoming - now
            need = urgent or waiting[0][1]
            if left is not None and left <= 0:
                break
            done = need if left is None else min(need, left)
            now += done
            if urgent:
                urgent -= done
            elif done == need:
                worst = max(worst, now - waiting.popleft()[0])
            else:
                waiting[0] = (waiting[0][0], need - done)
        if upcoming is None or (now < upcoming and not urgent and not waiting):
            return worst
        if now == upcoming and now > 0 and not urgent and not waiting:
            return worst  # all is done when the next begins: a stretch of its own
        time, number, cost, times = heappop(coming)
        if number:
            urgent += cost
        else:
            waiting.append((time, Fraction(cost)))
        following = next(times, None)
        if following is not None:
            heappush(coming, (following, number, cost, times))
    return None


MOMENT = Fraction(1, 10**12)
"""How much sooner than what waits for it something has begun, in ns."""


def play_inside(
    inside: Sequence[tuple[Releases, int]], outside: Sequence[tuple[Releases, int]], begun: int, *, in_order: bool
) -> Fraction | None:
    """The longest time from the release of a job of the first of `inside` to its end: one job at a time, to its end.

    What is `outside` preempts. The others inside go first among what waits, or all go `in_order` of their release: then
    whoever comes at that time may be the first of them. Something else inside may have `begun` a moment before.

    >>> timer, callback = (Releases(((period, Fraction(0)),)) for period in (10, 20))
    >>> [play_inside([(timer, 1), (callback, 3)], [], 0, in_order=in_order) for in_order in (True, False)]
    [Fraction(4, 1), Fraction(4, 1)]
    """
    coming: list[tuple[Fraction, int, int, Iterator[Any]]] = []
    for number, (releases, cost) in enumerate([*inside, *outside]):
        times = releases.densest()
        heappush(coming, (next(times), number, cost, times))
    sooner = MOMENT if begun else Fraction(0)
    now, worst = Fraction(0), Fraction(0)
    running: list[Any] = [None, Fraction(begun) - sooner] if begun else []
    preempting = Fraction(0)
    waiting: list[tuple[Any, Fraction, int]] = []  # what goes first, the release, the cost

    for _ in range(MOST_PLAYED):
        while coming and coming[0][0] <= now:
            time, number, cost, times = heappop(coming)
            if number >= len(inside):
                preempting += cost
            else:
                rank: Any = (time, number == 0) if in_order else (number == 0, time)
                heappush(waiting, (rank, time, cost))
            following = next(times, None)
            if following is not None:
                heappush(coming, (following, number, cost, times))
        if not preempting and not running and not waiting:
            return worst
        upcoming = coming[0][0] if coming else None
        if not preempting and not running:
            rank, time, cost = heappop(waiting)
            running = [(time, in_order or rank[0] is True), Fraction(cost)]
        need = preempting or running[1]
        done = need if upcoming is None else min(need, upcoming - now)
        now += done
        if preempting:
            preempting -= done
        else:
            running[1] -= done
            if not running[1]:
                if running[0] is not None and running[0][1]:
                    worst = max(worst, now + sooner - running[0][0])
                running = []
        if not preempting and not running and not waiting and coming and coming[0][0] >= now > 0:
            return worst  # all is done when the next begins
    return None
