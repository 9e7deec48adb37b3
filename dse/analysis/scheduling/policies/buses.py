"""Buses: messages that wait for each other, of which one is sent at a time, to its end.

* ``priority`` (CAN): of the messages that wait the one with the lowest identifier goes next. One less urgent may have
  begun before, and what comes up to one bit after a start still competes for it:

      w(q) = B + q C + sum over the more urgent of ceil((w(q) + J + bit) / T) C
      R = max over q of w(q) + C - release(q)

  over all jobs q of the busy period (R. I. Davis, A. Burns, R. J. Bril and J. J. Lukkien, "Controller Area Network
  (CAN) schedulability analysis: refuted, revisited and revised", Real-Time Systems 35, 2007). A message of several
  frames competes with each of them: until the last one begins what is more urgent goes first. Messages whose sender
  queues them as they come have a module of their own (`transmit_queues`), and so have faults of the wire (`faults`).
* ``classes`` (Ethernet, IEEE 802.1Q): the same by priority, of which equal ones go as they come: a class is a line, as
  those of senders that queue, whose messages all have one level. Nothing comes after a start.
* ``fifo``: messages go in the order in which they come.
* ``none``: each sender has a line of its own, on which its messages go as they come.
* ``round_robin``: senders take turns, each with its oldest message: before each message of the own sender one of each
  other sender may go, the longest. Or, whatever the order, all that comes until it starts: the lesser of both counts.

(docs/semantics.md, section 5.4)
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from operator import is_
from typing import TypeAlias

from dse.analysis.scheduling.busy_window import (
    PLAIN,
    Task,
    densest_releases_ns,
    is_late,
    is_plain,
    load,
    most_jobs,
    releases_to_look_at_ns,
)
from dse.analysis.scheduling.model import Resource
from dse.analysis.scheduling.parts import Parts, before_job, counted
from dse.analysis.scheduling.policies.executor_work import EndlessError, Work, demand_of, jobs_by, until_end
from dse.analysis.scheduling.policies.executors import Fellow, Queued, WorstJob
from dse.analysis.scheduling.policies.faults import work_of
from dse.analysis.scheduling.policies.transmit_queues import QueuedMessage, queued_window, seen_by, waits_in_queues
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class Arbitrated:
    """A message, the more urgent ones, and for how long a less urgent frame may keep the bus; times in ns.

    Attributes
    ----------
    last_ns
        its last frame, before which nothing goes once it has begun.
    bit_ns
        what comes up to so much after a start still competes for it.
    faults
        the faults of the wire, each with what it costs this message; None where none are counted.
    source
        what releases the chain of its sender, where the time counts from the latest release of that on.

    Examples
    --------
    Davis and others 2007, section 3.3, times in us: of three messages of 1 ms every 2.5, 3.5 and 3.5 ms the last one
    responds last in its second job.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> a, b, c = periodic("a", 1000, 2500), periodic("b", 1000, 3500), periodic("c", 1000, 3500)
    >>> [Arbitrated(a, (), 1000, 1000, 0).response_ns(), Arbitrated(b, (a,), 1000, 1000, 0).response_ns()]
    [2000, 3000]
    >>> last = Arbitrated(c, (a, b), 0, 1000, 0)
    >>> last.response_ns(), last.parts().earlier_jobs
    (3500, 1)

    A message of 328 every 5000 that comes up to 8612 late may be queued right behind an earlier one, which comes late
    then, but was early itself: 656 after the latest time at which it can be queued it has been sent.

    >>> late = Arbitrated(periodic("pdo", 328, 5000, 8612), (), 328, 328, 2)
    >>> late.response_ns(), late.counted_from(periodic("timer", 0, 5000)).response_ns()
    (984, 656)
    """

    task: Task
    urgent: tuple[Task, ...]
    blocked_ns: Exact
    last_ns: Exact
    bit_ns: Exact
    faults: Task | None = None
    source: Task | None = None

    def counted_from(self, source: Task) -> Arbitrated:
        """The message with its time counted from the latest time at which a release of a source may have it queued."""
        return replace(self, source=source)

    def response_ns(self) -> Exact | None:
        """The longest time from when the message is queued to its end, in ns; None where it has no bound.

        Davis and others 2007, section 3.3: the job that responds last in the busy period, here over several streams
        with jitter.
        """
        numbers = (self.blocked_ns, self.last_ns, self.bit_ns)
        tasks = (self.task, *self.urgent, *self.of_wire, *(() if self.source is None else (self.source,)))
        plain = all(type(item) in PLAIN for item in numbers) and all(map(is_plain, tasks))
        found = _remembered(self) if plain else self.worst_job()
        return None if found is None else found[1] - found[0]

    def parts(self) -> Parts | None:
        """The parts of the wait of the message with the longest response time; None where it has no bound.

        Interference counts messages that are queued until the last frame starts, a bit time included.
        """
        found = self.worst_job()
        if found is None:
            return None
        until, jobs = found[1] - self.last_ns + self.bit_ns, jobs_by if self._counts_starts else most_jobs
        others = [(item, jobs(item, until)) for item in self.urgent]
        faults = [(item, most_jobs(item, found[1])) for item in self.of_wire]
        return before_job(self.task, others, self.blocked_ns, *found, faults)

    def competes(self, release_ns: Exact, start_ns: Exact) -> bool:
        """Whether what is queued at a time may win the frame that starts at another one; both in ns."""
        return release_ns <= start_ns if self._counts_starts else release_ns < start_ns + self.bit_ns

    @property
    def demand(self) -> tuple[Task, ...]:
        """The message with all that goes before it, faults of the wire among it.

        Without a bound where they need more than all of the bus.
        """
        return (self.task, *self.urgent, *self.of_wire)

    @property
    def of_wire(self) -> tuple[Task, ...]:
        """The faults of the wire, as one task or none."""
        return () if self.faults is None else (self.faults,)

    @property
    def _counts_starts(self) -> bool:
        """Whether what comes at the very start of a frame goes first: nothing has begun a moment before."""
        return not self.bit_ns and not self.blocked_ns

    def worst_job(self) -> tuple[Exact, Exact] | None:
        """Release and end of the job that responds last, from when its busy period begins; None without a bound.

        Both in ns. With a `source` the soonest release of that, counted from its first one, in place of that of the
        message, where it is later. Without a bound: more than 100 % of the bus is used, or exactly 100 % with blocking
        or jitter, or the busy period takes too many steps.
        """
        task, urgent, blocked = self.task, [item for item in self.urgent if item.worst_ns], self.blocked_ns
        used = load(self.demand)
        if used > 1 or (
            used == 1 and (blocked or self.faults or not task.streams or any(map(is_late, (task, *urgent))))
        ):
            return None
        with suppress(EndlessError):
            return self._worst_of(Work(task, urgent, self.of_wire, blocked))
        return None

    def _worst_of(self, work: Work) -> tuple[Exact, Exact]:
        busy, demand = work.busy_ns(), demand_of(work.fellows, until=self._counts_starts)
        faulty = work_of(self.faults)

        def needed(own: Exact, time: Exact) -> Exact:
            return own + demand(time + self.bit_ns) + faulty(time + self.last_ns)

        worst: tuple[Exact, Exact] = (0, 0)
        start: Exact = 0
        others = (*work.fellows, *self.of_wire)
        apart = None if self.source is None else densest_releases_ns(self.source)
        for count, release in enumerate(until_end(releases_to_look_at_ns(self.task, others), busy)):
            before = self.blocked_ns + count * self.task.worst_ns + (self.task.worst_ns - self.last_ns)
            start = work.least(max(before, start), partial(needed, before))
            since = release if apart is None else max(release, next(apart, release))
            if start + self.last_ns - since > worst[1] - worst[0]:
                worst = since, start + self.last_ns
        return worst


@lru_cache(16384)
def _remembered(window: Arbitrated) -> tuple[Exact, Exact] | None:
    return window.worst_job()


@dataclass(frozen=True, slots=True)
class InTurn:
    """A message, the others that go as they come with it, and `turns`: of each other sender one goes before each.

    `others` are all other messages of the bus where senders take turns.

    Examples
    --------
    Two senders take turns, the other one with 5 every 100: a message of 2 every 10 waits for it once. In one line with
    it the message waits for it, too.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> mine, other = periodic("mine", 2, 10), periodic("other", 5, 100)
    >>> InTurn(mine, (), (other.single(),), (other,)).response_ns(), InTurn(mine, (other,)).response_ns()
    (7, 7)
    """

    task: Task
    queue: tuple[Task, ...]
    turns: tuple[Task, ...] = ()
    others: tuple[Task, ...] = ()

    def response_ns(self) -> Exact | None:
        """The longest time from when the message is queued to its end, in ns; None where it has no bound.

        The lesser one of two bounds: senders in turn, and any order of all messages.
        """
        found = [item.response_ns() for item in (self.in_line, self._any_order) if item is not None]
        return min((item for item in found if item is not None), default=None)

    def parts(self) -> Parts | None:
        """The parts of the wait of the message with the longest response time; None where it has no bound.

        Those of the bound that is used.
        """
        line, free = self.in_line, self._any_order
        bounds = [None if item is None else item.response_ns() for item in (line, free)]
        if bounds[0] is None or (bounds[1] is not None and bounds[1] < bounds[0]):
            return None if free is None else free.parts()
        worst = line.worst_job()
        assert worst is not None
        return self._parts_of(worst)

    def _parts_of(self, worst: WorstJob) -> Parts:
        jobs = [(item, jobs_by(item, worst.until_ns)) for item in self.queue]
        own = jobs_by(self.task, worst.until_ns)
        taken = own + sum(count for _, count in jobs)
        others = counted([*jobs, *((item, taken) for item in self.turns)])
        return Parts(others, own - 1, (own - 1) * self.task.worst_ns, 0, worst.release_ns)

    @property
    def in_line(self) -> Queued:
        """The message in one line with those that go as they come, each longer by one turn of each other sender."""
        turn = sum(item.worst_ns for item in self.turns)
        longer = [replace(item, worst_ns=item.worst_ns + turn) for item in (self.task, *self.queue)]
        return Queued("fifo", longer[0], tuple(Fellow(item, True) for item in longer[1:]))

    @property
    def _any_order(self) -> Queued | None:
        return Queued("wait_set", self.task, tuple(Fellow(item, True) for item in self.others)) if self.others else None

    @property
    def demand(self) -> tuple[Task, ...]:
        """The message with all that goes before it, by the bound for which they need less of the bus."""
        line, free = self.in_line, self._any_order
        ways = [(line.task, *line.sharing), *([] if free is None else [(free.task, *free.sharing)])]
        return min(ways, key=load)


OnBus: TypeAlias = Arbitrated | InTurn | QueuedMessage
"""The busy window of a message on its bus: one for each way of arbitration."""


def window_of(resource: Resource, position: int, tasks: Sequence[Task | None]) -> OnBus | None:
    """The busy window that decides the response time of a message on a bus; None where it has no bound.

    Of less urgent messages one may be in the way, however often it comes. Where senders take turns that is so of each
    other sender, but for the bound that counts whatever comes.
    """
    wire = resource.wire
    assert wire is not None
    if wire.lines:
        tasks = seen_by(resource, position, tasks, _waits(resource, tasks))
        if wire.lines[position]:
            return queued_window(resource, position, tasks)
    entry, task = resource.entries[position], tasks[position]
    rivals = [tasks[item] for item in entry.rivals]
    before = tuple(item for item in rivals if item is not None)
    if task is None or len(before) < len(rivals):
        return None
    if wire.arbitration in ("priority", "classes"):
        faults = wire.faults[position] if wire.faults else None
        return Arbitrated(task, before, entry.blocked_ns, wire.last_ns[position], wire.bit_ns, faults)
    turns = wire.turns[position]
    others = [item for at, item in enumerate(tasks) if at != position] if turns else []
    known = tuple(item for item in others if item is not None)
    return InTurn(task, before, turns, known if len(known) == len(others) else ())


_LATEST: list[tuple[Resource, Sequence[Task | None], list[Exact | None]]] = []
"""The bus whose queues were asked about last: all its messages are asked about one after the other."""


def _waits(resource: Resource, tasks: Sequence[Task | None]) -> list[Exact | None]:
    """The longest time in ns that each message of a bus waits in the queue of its sender; None without a bound.

    Those of the bus that was asked about last are remembered (`waits_in_queues`).
    """
    for known, seen, waits in _LATEST:
        if known is resource and len(seen) == len(tasks) and all(map(is_, seen, tasks)):
            return waits
    waits = waits_in_queues(resource, tasks)
    _LATEST[:] = [(resource, tuple(tasks), waits)]
    return waits
