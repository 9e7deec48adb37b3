"""Messages on CAN whose sender queues them as they come: only the oldest of a queue competes for the bus.

All messages of a queue are analysed at the identifier of the least urgent one, with what of others is more urgent than
that. A message that comes `a` after its busy period has begun waits for all of the queue that come no later:

    s(a) = B + work of the queue in [0, a] - last frame + sum over the urgent of ceil((s + J + F + bit) / T) C
    R = max over a of s(a) + last frame - a

Another message sees those of a queue when they are the oldest there, up to F after they come, with F = R - C: more
jitter, unless all of the queue is more urgent than it. Safe bounds, in the manner of R. I. Davis, S. Kollmann, V.
Pollex and F. Slomka, "Controller Area Network (CAN) schedulability analysis with FIFO queues", ECRTS 2011.
(docs/semantics.md, section 5.4)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from heapq import merge

from dse.analysis.scheduling.busy_window import PLAIN, Task, densest_releases_ns, is_late, is_plain, load, most_jobs
from dse.analysis.scheduling.model import Resource
from dse.analysis.scheduling.parts import Parts, before_job
from dse.analysis.scheduling.policies.executor_work import EndlessError, Work, demand_of, jobs_by, until_end
from dse.analysis.scheduling.policies.faults import work_of
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class QueuedMessage:
    """A message of a queue, the others of it (`line`), and what of others goes first; times in ns.

    Attributes
    ----------
    urgent
        messages of other senders that are more urgent than the least urgent one of the queue.
    blocked_ns
        for how long a frame that is less urgent than all of the queue may keep the bus.
    last_ns
        its last frame, before which nothing goes once it has begun.
    bit_ns
        what comes up to so much after a start still competes for it.
    faults
        the faults of the wire, each with what it costs this message; None where none are counted.

    Examples
    --------
    A message of 2 every 10 behind one of 3 every 20 in its queue, and one of 1 every 5 of another sender.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> own, other, urgent = periodic("own", 2, 10), periodic("other", 3, 20), periodic("urgent", 1, 5)
    >>> QueuedMessage(own, (other,), (urgent,), 0, 2, 0).response_ns()
    6
    """

    task: Task
    line: tuple[Task, ...]
    urgent: tuple[Task, ...]
    blocked_ns: Exact
    last_ns: Exact
    bit_ns: Exact
    faults: Task | None = None

    def response_ns(self) -> Exact | None:
        """The longest time from when the message is queued to its end, in ns; None where it has no bound."""
        numbers = (self.blocked_ns, self.last_ns, self.bit_ns)
        tasks = (self.task, *self.line, *self.urgent, *self._of_wire)
        plain = all(type(item) in PLAIN for item in numbers) and all(map(is_plain, tasks))
        found = _remembered(self) if plain else self.worst_job()
        return None if found is None else found[1] - found[0]

    def parts(self) -> Parts | None:
        """The parts of the wait of the message with the longest response time; None where it has no bound."""
        found = self.worst_job()
        if found is None:
            return None
        release, end = found
        until = end - self.last_ns + self.bit_ns
        jobs = [(item, jobs_by(item, release)) for item in self.line]
        jobs += [(item, self._jobs(item, until)) for item in self.urgent]
        faults = [(item, most_jobs(item, end)) for item in self._of_wire]
        return before_job(self.task, jobs, self.blocked_ns, release, end, faults)

    @property
    def demand(self) -> tuple[Task, ...]:
        """The messages of its queue with all that goes before these, faults of the wire among it.

        Without a bound where they need more than all of the bus.
        """
        return (self.task, *self.line, *self.urgent, *self._of_wire)

    @property
    def _of_wire(self) -> tuple[Task, ...]:
        return () if self.faults is None else (self.faults,)

    @property
    def _jobs(self) -> Callable[[Task, Exact], int]:
        return jobs_by if self._counts_starts else most_jobs

    @property
    def _counts_starts(self) -> bool:
        """Whether what comes at the very start of a frame goes first: nothing has begun a moment before."""
        return not self.bit_ns and not self.blocked_ns

    def worst_job(self) -> tuple[Exact, Exact] | None:
        """Release and end of the job that responds last, from when its busy period begins; None without a bound.

        Both in ns; without a bound where more than 100 % of the bus is used, or exactly 100 % with blocking or jitter.
        """
        task, line = self.task, [item for item in self.line if item.worst_ns]
        urgent = [item for item in self.urgent if item.worst_ns]
        used = load(self.demand)
        late = self.blocked_ns or self.faults or not task.streams or any(map(is_late, (task, *line, *urgent)))
        if used > 1 or (used == 1 and late):
            return None
        with suppress(EndlessError):
            return self._worst_of(Work(task, line, (*urgent, *self._of_wire), self.blocked_ns), urgent)
        return None

    def _worst_of(self, work: Work, urgent: Sequence[Task]) -> tuple[Exact, Exact]:
        queue = (work.task, *work.fellows)
        busy, demand = work.busy_ns(), demand_of(urgent, until=self._counts_starts)
        faulty = work_of(self.faults)

        def needed(own: Exact, time: Exact) -> Exact:
            return own + demand(time + self.bit_ns) + faulty(time + self.last_ns)

        worst: tuple[Exact, Exact] = (0, 0)
        start: Exact = 0
        last: Exact = -1
        for arrival in until_end(merge(*map(densest_releases_ns, queue)), busy):
            if arrival == last:
                continue
            last = arrival
            own = self.blocked_ns + sum(jobs_by(item, arrival) * item.worst_ns for item in queue) - self.last_ns
            start = work.least(max(own, start), partial(needed, own))
            if start + self.last_ns - arrival > worst[1] - worst[0]:
                worst = arrival, start + self.last_ns
        return worst


@lru_cache(16384)
def _remembered(window: QueuedMessage) -> tuple[Exact, Exact] | None:
    return window.worst_job()


def queued_window(resource: Resource, position: int, seen: Sequence[Task | None]) -> QueuedMessage | None:
    """The busy window of a message whose sender queues as it comes; None where it has no bound.

    `seen` are the messages of the bus as those of other queues are seen (`seen_by`).
    """
    wire, entry, task = resource.wire, resource.entries[position], seen[position]
    assert wire is not None
    mine = wire.lines[position]
    line = [seen[item] for item in mine if item != position]
    urgent = [seen[item] for item in entry.rivals if item not in mine]
    known = [item for item in (task, *line, *urgent) if item is not None]
    if task is None or len(known) < 1 + len(line) + len(urgent):
        return None
    return QueuedMessage(
        task,
        tuple(known[1 : 1 + len(line)]),
        tuple(known[1 + len(line) :]),
        entry.blocked_ns,
        wire.last_ns[position],
        wire.bit_ns,
        wire.faults[position] if wire.faults else None,
    )


def seen_by(
    resource: Resource, position: int, tasks: Sequence[Task | None], waits: Sequence[Exact | None]
) -> list[Task | None]:
    """The messages of a bus as one of them meets them: later by what they wait in a queue that reaches behind it.

    `waits` are how long each may wait for others of its queue, in ns; None without a bound.
    """
    wire = resource.wire
    assert wire is not None
    own = wire.lines[position]
    level = own[-1] if own else position
    found: list[Task | None] = []
    for other, task in enumerate(tasks):
        line, wait = wire.lines[other], waits[other]
        if task is None or not line or line == own or line[-1] < level:
            found.append(task)
        else:
            found.append(None if wait is None else _later(task, wait))
    return found


def _later(task: Task, wait: Exact) -> Task:
    return replace(task, streams=tuple(replace(item, jitter_ns=item.jitter_ns + wait) for item in task.streams))


def waits_in_queues(resource: Resource, tasks: Sequence[Task | None]) -> list[Exact | None]:
    """How long each message of a bus may wait for others of its queue, at most, in ns; None without a bound.

    0 of messages in no queue. Queue by queue, the one with the least urgent message first: to each queue only those
    matter later that reach further behind.
    """
    wire = resource.wire
    assert wire is not None
    waits: list[Exact | None] = [0] * len(tasks)
    for line in sorted({line for line in wire.lines if line}, key=lambda line: -line[-1]):
        for position in line:
            window = queued_window(resource, position, seen_by(resource, position, tasks, waits))
            response = None if window is None else window.response_ns()
            waits[position] = None if window is None or response is None else response - window.task.worst_ns
    return waits
