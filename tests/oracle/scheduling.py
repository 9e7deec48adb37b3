"""Response times of one design, by playing the busiest stretch of each core job by job.

A core is played from the moment at which everything on it is released as soon as it can be: more urgent work first,
then the jobs of the thread itself in the order of their release. How long its jobs take there, at worst, is its
response time. What response times add to the releases of those that events dispatch is found by playing all of it
again until nothing changes.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from fractions import Fraction
from itertools import count
from math import ceil
from typing import TYPE_CHECKING, Any, TypeAlias

from . import quantities
from .arbitration import counted
from .buses import Buses
from .chains import Chains
from .pieces import Pieces, piece_of
from .problem import as_list
from .quantities import NS_PER_S
from .stretches import Releases, earliest, has_no_end, kept_apart, play, play_inside
from .successors import Case
from .windows import Windows, greatest

if TYPE_CHECKING:
    from .reading import Reading

Job: TypeAlias = tuple[str, str]
"""A thread, and ``timer`` or ``callback`` (a hybrid thread runs both, whatever events dispatch is a timer here, too).

Of a thread with segments ``piece 0``, ``piece 1`` and so on.
"""

Time: TypeAlias = Fraction | None


class Scheduling:
    """The response times of all that runs on the processors in one complete design, and of messages that wait.

    With `only_buses` threads and devices take what latencies count of them, as if nothing delayed them.
    """

    def __init__(self, reading: Reading, *, only_buses: bool = False) -> None:
        self.reading, self.problem, self.only_buses = reading, reading.problem, only_buses
        self.is_alone = False  # while nothing waits
        self.threads = list(self.problem.sections["threads"])
        self.jobs = [] if only_buses else [job for name in self.threads for job in self._jobs_of(name)]
        self.cores: dict[tuple[str, int], list[Job]] = {}
        for job in self.jobs:
            self.cores.setdefault(self.core(job), []).append(job)
        self.buses = Buses(self)
        self.longest, self.pieces = self._longest_period(), Pieces(self)
        self.chains = Chains(self)
        self.windows = Windows(self)
        self.jobs += self.buses.jobs
        self.response: dict[Job, Fraction | None] = {job: self._alone(job) for job in self.jobs}
        self.message_lags = {name: self.response[name, part] for name, part in self.buses.jobs}
        self.is_alone = True
        self.buses.choose()
        self.is_alone = False
        self._settle()

    def waits(self, connection: str, *, lags: bool = False) -> Fraction | None:
        """How long the message of a connection waits for its bus at most, 0 of one that waits for none.

        From when it is queued, or where it `lags` from when it is at the latest.
        """
        if connection not in self.buses.bus_of:
            return Fraction(0)
        name = self.buses.sent_as(connection)
        response = self.message_lags[name] if lags else self.response[name, "message"]
        return None if response is None else response - self.buses.times(name)[1]

    def of(self, name: str, part: str = "timer") -> Fraction | None:
        """The response time, None without a bound; what executes nothing on a processor takes what it takes."""
        alone = Fraction(self.times((name, part))[1])
        stated = self.reading.get(name, "response_time") if part == "timer" else None
        if stated is not None and self.reading.processor_of(name) is None:
            alone = max(alone, Fraction(quantities.time_range(stated)[1]))
        pieces = self.pieces_of(name)
        found = self.response.get(pieces[-1] if pieces else (name, part), alone)
        return None if found is None else max(alone, found)

    def _jobs_of(self, name: str) -> Iterator[Job]:
        if self.reading.processor_of(name) is None:
            return
        yield from self.pieces_of(name)
        if self.reading.protocol(name) == "hybrid" and self.reading.get(name, "callback_execution_time") is not None:
            yield name, "callback"
        if self.reading.get(name, "compute_execution_time") is not None:
            yield name, "timer"

    def pieces_of(self, name: str) -> list[Job]:
        """The pieces of a thread, one after the other; none of one without segments."""
        return [(name, f"piece {place}") for place in range(len(self.reading.segments(name)))]

    def order(self, job: Job) -> str | None:
        """How the accelerator serves on which a job runs; None of a core."""
        return self.reading.order(self.core(job)[0])

    def core(self, job: Job) -> tuple[str, int]:
        """Where a job runs."""
        name, place = job[0], piece_of(job)
        slot = self.reading.processor_of(name) if place is None else self.reading.piece_slot(name, place)
        assert slot is not None
        if int(self.reading.get(slot, "cores") or 1) == 1:
            return slot, 1
        (core,) = self.reading.possible_cores(self.reading.place_of(name))
        return slot, core  # where it is open nobody may ask for a response time

    def times(self, job: Job) -> tuple[int, int]:
        """Shortest and longest time of one job alone."""
        place = piece_of(job)
        if self.reading.segments(job[0]):
            return self.reading.piece_times(job[0], place)
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
        for body in self.problem.sections["connections"].values() if counted(self.problem) else ():
            found += [ceil(NS_PER_S / quantities.rate(rate)) for rate in as_list(body.get("rate"))]
        return max(found, default=NS_PER_S)

    def _alone(self, job: Job) -> Fraction:
        """What a job takes where nothing else runs, from the release of its thread."""
        if job[1] == "message":
            return self.buses.times(job[0])[1]
        place = piece_of(job)
        before = 0 if place is None else self.reading.piece_times(job[0], place, before=True)[1]
        return Fraction(before + self.times(job)[1])

    def _settle(self) -> None:
        """Plays all cores again and again; what grows beyond ten times the longest period has no bound."""
        for number in count():
            known = self.windows
            fresh = self._grown(self.response, {job: self._played(job) for job in self.jobs}, number)
            spans, lags = (
                self._grown(before, after, number)
                for before, after in zip((known.spans, known.lags), known.fresh(), strict=True)
            )
            late = {name: lag and self.buses.lag(name) for name, lag in self.message_lags.items()}
            late = self._grown(self.message_lags, late, number)
            found = (fresh, spans, lags, late)
            if found == (self.response, known.spans, known.lags, self.message_lags):
                return
            self.response, known.spans, known.lags, self.message_lags = found

    def _grown(self, before: dict[Any, Time], found: dict[Any, Time], number: int) -> dict[Any, Time]:
        """Times as they are now, None of what grows too far."""

        def is_endless(key: Any) -> bool:
            time = found[key]
            return number > 0 and time is not None and time != before[key] and time > 10 * self.longest

        return {key: None if before[key] is None or is_endless(key) else found[key] for key in before}

    def _played(self, job: Job) -> Fraction | None:
        """The longest that a job takes in the busiest stretch of its core; None where the stretch may not end."""
        if job[1] == "message":
            return self.buses.played(job[0])
        work = self.times(job)[1]
        if piece_of(job) is not None:
            return self.pieces.end(job)
        if work == 0:
            return Fraction(0)
        if self.reading.executor_of(job[0]) is not None or self.order(job) is not None:
            return self._played_inside(job)
        here = [other for other in self.beside(job) if self.times(other)[1] and self.goes_before(other, job)]
        shares = self.shares(job)
        if shares is None:
            return None
        cases = list(self.windows.successors.cases(job, job, job, here))
        if self.windows.is_over_somewhere(job, here) or any(case.has_limits for case in cases):
            return self.windows.single(job, here, shares)
        return greatest([self._in_case(job, case, shares) for case in cases])

    def _in_case(self, job: Job, case: Case, shares: list[tuple[Releases, int]]) -> Fraction | None:
        """The longest that a job takes in a stretch where others come so."""
        work, blocked, own = self.times(job)[1], self.blocked(job), case.own
        before = [(releases, self.times(other)[1]) for other, releases in case.rivals.items() if releases is not None]
        if own is None or len(before) < len(case.rivals) or has_no_end([(own, work), *before, *shares], blocked):
            return None
        return play(own, work, [*before, *shares], blocked)

    def blocked(self, job: Job) -> int:
        """The longest section of what never goes before a job on its core."""
        here = [other for other in self.cores[self.core(job)] if other[0] != job[0]]
        return max((self.section(other[0]) for other in here if not self.goes_before(other, job)), default=0)

    def section(self, name: str) -> int:
        """How long a thread keeps all others from its core at most."""
        text = self.reading.get(name, "non_preemptive")
        return 0 if text is None else min(quantities.duration(text), self.times((name, "timer"))[1])

    def _played_inside(self, job: Job) -> Fraction | None:
        """The response time of a job that shares an OS thread: an executor runs one job at a time, to its end.

        What goes before the executor preempts all of it.
        """
        here = [other for other in self.beside(job) if self.times(other)[1]]
        executor = self.reading.executor_of(job[0])
        fellows = [other for other in here if self.reading.executor_of(other[0]) == executor]
        outside = [other for other in here if other not in fellows and self.goes_before(other, job)]
        kind = self.order(job) if executor is None else self.reading.get(executor, "kind")
        first = fellows
        beyond = [other for other in self.beside(job) if self.reading.executor_of(other[0]) != executor]
        equals = (each for each in beyond if self.goes_before(each, job) and self.goes_before(job, each))
        shares_level = executor is not None and any(equals)
        if kind == "priority":
            first = [other for other in fellows if self.goes_before(other, job)]
        elif kind == "callback_group" and not shares_level:
            first = [other for other in fellows if self.goes_first_inside(other, job)]
        rest = [other for other in fellows if other not in first]
        before, shares = self._known([job, *first]), self.shares(job)
        preempting = self._known(outside)
        if preempting is None or shares is None:
            return None
        preempting += shares
        found = []
        less = [other for other in here if other not in [*fellows, *outside]]
        blocked = 0 if executor is None else max((self.section(other[0]) for other in less), default=0)
        if before is not None:
            begun = max([blocked, *(self.times(other)[1] for other in rest)])
            if not has_no_end([*before, *preempting], begun):
                found.append(play_inside(before, preempting, begun, in_order=kind == "fifo"))
            found.append(self.chains.behind_the_rest(job, first, rest, preempting, blocked, in_order=kind == "fifo"))
        if kind == "polling" and not shares_level and self.coming(job) is not None:
            found.append(self._in_rounds(job, fellows, preempting, blocked))
        cuts = any(self.section(each[0]) for each in [job, *fellows])
        if kind == "fifo" and not shares_level and not (preempting and cuts):
            found.append(self.chains.in_lines(job, fellows, preempting, blocked))
        return min((each for each in found if each is not None), default=None)

    def _in_rounds(self, job: Job, fellows: Sequence[Job], preempting: Sequence[Any], blocked: int) -> Fraction | None:
        """A round for each job that waits, in which everything in the executor runs once, and part of one that runs.

        Of that either the job itself has begun, or all that goes first is yet to come once more.
        """
        room = self.reading.room(*job)
        if room is None or sum(releases.often * work for releases, work in preempting) >= 1:
            return None
        work = room * sum(self.times(each)[1] for each in [job, *fellows])
        certain = sum(self.times(each)[1] for each in fellows if self.has_turn_before(each[0], job[0]))
        unknown = sum(
            self.times(each)[1]
            for each in fellows
            if not self.has_turn_before(each[0], job[0]) and not self.has_turn_before(job[0], each[0])
        )
        work += unknown + max(certain, self.times(job)[1]) + blocked
        return play(Releases(()), work, preempting)

    def _known(self, jobs: Sequence[Job]) -> list[tuple[Releases, int]] | None:
        """When jobs come, and their work; None where one may be late without a bound."""
        given = [(self.coming(job), self.times(job)[1]) for job in jobs]
        known = [(releases, work) for releases, work in given if releases is not None]
        return known if len(known) == len(given) else None

    # Reservations

    def beside(self, job: Job) -> list[Job]:
        """What else runs on the core of a job in the same reservation, or outside of all as the job does."""
        home = self.reading.reservation_of(job[0])
        here = self.cores[self.core(job)]
        return [other for other in here if other != job and self.reading.reservation_of(other[0]) == home]

    def _budget(self, reservation: str) -> tuple[int, int]:
        """How much there is in each period."""
        period = self.reading.get(reservation, "period")
        return quantities.deadline(self.reading.get(reservation, "budget")), quantities.period(period)

    def shares(self, job: Job) -> list[tuple[Releases, int]] | None:
        """What reservations take of the core of a job; inside of one, the times without a budget.

        These are, from the worst moment on: nothing for twice the rest of a period, then a budget, and after each
        budget nothing for one such rest. None where the budget itself may come too late.
        """
        home = self.reading.reservation_of(job[0])
        if home is None:
            return self._reserved_before(job)
        budget, period = self._budget(home)
        outside = [other for other in self.cores[self.core(job)] if self.reading.reservation_of(other[0]) is None]
        given = [
            (self.coming(other), self.times(other)[1])
            for other in outside
            if self.times(other)[1] and self.goes_before(other, job)
        ]
        before = [(releases, work) for releases, work in given if releases is not None]
        before += self._reserved_before(job)
        if any(releases is None for releases, _ in given):
            return None
        own = Releases(())
        ends = None if has_no_end([(own, budget), *before], 0) else play(own, budget, before)
        if ends is None or ends > period:
            return None
        return [(Releases(((period, Fraction(budget)),)), period - budget)] if budget < period else []

    def _reserved_before(self, job: Job) -> list[tuple[Releases, int]]:
        """The budgets of other reservations that go before a job, each as late in its period as it may be wanted."""
        found = {}
        for other in self.cores[self.core(job)]:
            reservation = self.reading.reservation_of(other[0])
            if reservation not in (None, self.reading.reservation_of(job[0])) and self.goes_before(other, job):
                budget, period = self._budget(reservation)
                found[reservation] = (Releases(((period, Fraction(period - budget)),)), budget)
        return list(found.values())

    # Who goes first

    def has_turn_before(self, other: str, name: str) -> bool:
        """Whether in a round of an executor that polls one thread goes first by its number: both have one."""
        one, two = self._turn(other), self._turn(name)
        return one[0] == two[0] == 0 and one < two

    def goes_first_inside(self, other: Job, job: Job) -> bool:
        if other[0] == job[0]:
            return other[1] == "callback"
        one, two = self._turn(other[0]), self._turn(job[0])
        if one[0] == two[0] == 0 and one == two:
            return True
        return (one, self.threads.index(other[0])) < (two, self.threads.index(job[0]))

    def _place(self, name: str) -> tuple[tuple[int, Fraction], int]:
        """The turn of an OS thread on its core, and the place in the file of its first thread."""
        executor = self.reading.executor_of(name)
        if executor is None:
            return self._turn(name), self.threads.index(name)
        members = [other for other in self.threads if self.reading.executor_of(other) == executor]
        number = self.problem.component(executor).get("priority")
        if number is not None:
            return (0, Fraction(-int(number))), self.threads.index(members[0])
        rate = max(self.reading.rate(member) for member in members)
        return ((1, NS_PER_S / rate) if rate else (2, Fraction(0))), self.threads.index(members[0])

    def _place_of_all(self, name: str) -> tuple[tuple[int, Fraction], int]:
        """The place of a job in the order of priorities; in a reservation it is the place of the reservation."""
        reservation = self.reading.reservation_of(name)
        if reservation is None:
            return self._place(name)
        first = next(i for i, other in enumerate(self.threads) if self.reading.reservation_of(other) == reservation)
        number = self.problem.component(reservation).get("priority")
        turn = (0, Fraction(-int(number))) if number is not None else (1, Fraction(self._budget(reservation)[1]))
        return turn, first

    def goes_before(self, other: Job, job: Job) -> bool:
        if other[0] == job[0]:
            return other[1] == "callback"
        homes = [self.reading.reservation_of(name) for name in (other[0], job[0])]
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

    def coming(self, job: Job, beyond: Container[Job] = ()) -> Releases | None:
        """When jobs come in a busy window in which all of their executor runs but those `beyond`; None as below.

        What others of the executor release at once comes as the first of these do.
        """
        found = self.releases(job)
        for other in self.chains.heads_inside(job, beyond):
            begins = self.releases(other)
            found = found if begins is None else earliest(begins, found)
        return found

    def releases(self, job: Job) -> Releases | None:
        """None where they may be late without a bound."""
        name, part = job
        place = piece_of(job)
        if place:
            return self._released_by(
                name, (name, f"piece {place - 1}"), self.reading.piece_times(name, place, before=True)[0]
            )
        if place == 0 and self.response[self.pieces_of(name)[-1]] is None:
            return None  # the thread begins a job when the one before has ended, whenever that is
        part = "timer" if place == 0 else part
        protocol = self.reading.protocol(name)
        period = self.reading.period_ns(name) if self.reading.has_period(name) else None
        if part == "timer" and protocol in ("periodic", "hybrid"):
            assert period is not None, name
            if protocol == "hybrid" and self.reading.joins.joins(name):
                return Releases(self._published(name), period)
            return Releases(((period, Fraction(0)),))
        arriving = self._joined(name) if part == "timer" and self.reading.joins.joins(name) else self._arriving(name)
        apart = period if part == "timer" and protocol == "sporadic" else None
        return None if arriving is None else Releases(arriving, apart or 0)

    def _joined(self, name: str) -> tuple[tuple[int, Fraction], ...] | None:
        """The jobs of a thread that needs a message of each trigger."""
        found: tuple[tuple[int, Fraction], ...] | None = self.reading.joins.streams(
            name, {connection: self._delivered(connection) for connection in self.reading.triggers(name)}
        )
        return found

    def _published(self, name: str) -> tuple[tuple[int, Fraction], ...]:
        """The jobs of a timer that finds a message of each trigger."""
        callback = self.times((name, "callback"))[0], self.of(name, "callback")
        arriving = {connection: self._delivered(connection) for connection in self.reading.triggers(name)}
        joins = self.reading.joins
        steady = {each for each in arriving if each not in self.buses.bus_of and joins.is_steady(each)}
        return tuple(joins.published(name, arriving, callback, steady))

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
        if connection in self.buses.bus_of:
            name = self.buses.sent_as(connection)
            handed, takes = self.buses.releases(name), self.message_lags[name]
            if handed is None or takes is None:
                return None
            more = takes - self.buses.times(name)[0]
            return [(period, late + more) for period, late in handed.streams]
        rows = self.reading.transit_rows(connection)
        spread = sum((Fraction(row[3]) - row[2] for row in rows), Fraction(0))
        sender = self.problem.component(connection).get("from")
        if sender is None or self.reading.states_rate(connection):
            rate = self.reading.delivered_rate(connection)
            return [(max(1, int(NS_PER_S / rate)), spread)] if rate else []
        leaving = self.leaving(sender)
        return None if leaving is None else [(period, late + spread) for period, late in leaving]

    def _released_by(self, name: str, last: Job, least: int) -> Releases | None:
        """What the end of a piece of a thread releases; that takes at `least` so long from the thread's release."""
        releases, takes = self.releases((name, "timer")), self.response[last]
        if releases is None or takes is None:
            return None
        return Releases(tuple((period, late + takes - least) for period, late in kept_apart(releases)))

    def leaving(self, name: str) -> list[tuple[int, Fraction]] | None:
        """What a component sends, once for each of its jobs; one that keeps its distance sends no faster than that."""
        chain = self.chains.chain(name)
        releases = self.releases((chain[0], "timer"))
        takes = self.windows.cut(chain, self._singles(chain), counts_lags=True)
        if releases is None or takes is None:
            return None
        takes -= sum(self.times((each, "timer"))[0] for each in chain)
        takes -= sum((self.chains.way(each, least=True) for each in chain[1:]), Fraction(0))
        return [(period, late + takes) for period, late in kept_apart(releases)]

    def _singles(self, part: list[str]) -> dict[str, Fraction | None]:
        """What threads take by themselves, each; where nothing waits they end when they say."""
        found: dict[str, Fraction | None] = {}
        for name in part:
            takes = self.of(name)
            stated = self.reading.get(name, "response_time") if self.only_buses or self.is_alone else None
            if takes is not None and stated is not None:
                takes = max(takes, Fraction(quantities.time_range(stated)[1]))
            found[name] = takes
        return found
