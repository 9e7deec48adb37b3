"""A core of a processor: what runs, what is ready, and what keeps it from running.

Interrupts go before everything; a job inside its non-preemptive section gives way to nothing else; an operating system
that throttles lets threads run for a budget in each period, then nothing but interrupts until the period is over. So
does a reservation, for its own threads; what it has not used when its period ends is lost.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import pairwise
from typing import ClassVar, TypeAlias

from dse.simulation.plan import Gap, ReservationShare, SimulatedTask, StepKey
from dse.support.units import Exact

Births: TypeAlias = dict[StepKey, list[Exact]]
"""For each flow step, when the data were born that are there."""
HELD = -1
"""The urgency of a job inside its section; that of interrupts is below, that of threads above."""
PUT_BACK = -1
"""An interrupted job goes before later ones of its own task."""


@dataclass
class Job:
    """A job of a task with the time that is left of it; between `holds` and `yields` left nothing preempts it.

    A message that came `by` a connection released it, where one did.
    """

    task: SimulatedTask
    release: Exact
    left: Exact
    births: Births
    holds: Exact = 0
    yields: Exact = 0
    has_read: bool = False
    by: int | None = None

    @property
    def is_interrupt(self) -> bool:
        """Whether the job is an interrupt, not a job of a thread.

        Interrupts run before every thread and do not use a thread's budget.
        """
        return self.task.urgency < HELD

    @property
    def is_held(self) -> bool:
        """Whether the job is inside its non-preemptive section, not at either end of the section.

        Such a job is not preempted by other threads.
        """
        return self.yields < self.left < self.holds


class InputQueue:
    """The door of an event-triggered task: one job in service, arrivals that wait."""

    def __init__(self) -> None:
        self.busy = False
        self.waiting: deque[tuple[Exact, Births, int, int]] = deque()
        self.not_before: Exact = 0


@dataclass
class ExecutorQueue:
    """The jobs that wait in an executor, each with the number of its release; `window` are those of a polling point.

    An executor that is ready has not chosen yet: its OS thread looks at what waits when it gets the core.
    """

    jobs: list[tuple[int, Job]] = field(default_factory=list)
    window: list[tuple[int, Job]] = field(default_factory=list)
    is_busy: bool = False
    is_interrupt: ClassVar[bool] = False

    def makes_place(self, job: Job, room: int) -> bool:
        """Whether fewer jobs of its task than there is room for wait; else each takes what the next one would have had.

        So the oldest message is dropped, and what it says lives on in the next. A release of a timer is skipped.
        """
        same = [other for _, other in (*self.window, *self.jobs) if other.task is job.task]
        if len(same) < room:
            return True
        if job.task.period_ns is None:
            same.append(job)
            for key, born in same[1].births.items():
                same[0].births.setdefault(key, []).extend(born)
            for one, following in pairwise(same[1:]):
                one.births = following.births
        return False

    def take(self) -> Job:
        """The job that runs next; there is one.

        The window of the rclcpp executor: jobs that were ready at one polling point run before later ones.
        """
        if not self.window:
            self.window = self._chosen()
            self.jobs = [item for item in self.jobs if item not in self.window]
        return self.window.pop(0)[1]

    def _chosen(self) -> list[tuple[int, Job]]:
        """The next job; of a wait set the oldest of each task, timers first."""
        kinds = {job.task.queue.kind for _, job in self.jobs if job.task.queue is not None}
        if not kinds.isdisjoint(("wait_set", "polling")):
            oldest: dict[object, tuple[int, Job]] = {}
            for item in self.jobs:
                oldest.setdefault(item[1].task.key, item)
            return sorted(oldest.values(), key=_level)
        return [min(self.jobs, key=_level if "callback_group" in kinds else _order)]


@dataclass
class Server:
    """A reservation on a core: what is ready in it, and how much of its budget the running period has used.

    It `is_listed` among what is ready on the core.
    """

    share: ReservationShare
    ready: list[tuple[int, int, Job | ExecutorQueue]] = field(default_factory=list)
    used: Exact = 0
    is_listed: bool = False
    is_interrupt: ClassVar[bool] = False

    @property
    def left(self) -> Exact:
        """The remaining budget of the reservation.

        In ns.
        """
        return self.share.budget_ns - self.used


def _order(item: tuple[int, Job]) -> int:
    return item[0]


def _level(item: tuple[int, Job]) -> tuple[tuple[int, ...], int]:
    order, job = item
    return (job.task.queue.level if job.task.queue is not None else (), order)


class Core:
    """The running job, since when, and what is ready, most urgent first; `budget_ns` of a period if it throttles.

    Time in ns. The engine calls `pick` whenever something may have changed.
    """

    def __init__(self, budget_ns: int | None) -> None:
        self.budget_ns = budget_ns
        self.running: Job | None = None
        self.since: Exact = 0
        self.version = 0
        self.ready: list[tuple[int, int, Job | ExecutorQueue | Server]] = []
        self.used: Exact = 0
        self.queues: dict[int, ExecutorQueue] = {}
        self.servers: dict[int, Server] = {}

    @property
    def _is_closed(self) -> bool:
        """Whether threads have used up their budget."""
        return self.budget_ns is not None and self.used >= self.budget_ns

    def add(self, job: Job, order: int) -> bool:
        """A job that is ready, unless its executor has another one; whether there was room for it.

        `order` is the number of the arrival and breaks ties between equal priorities.
        """
        queue = job.task.queue
        if queue is None:
            self._list(job.task, job.task.urgency, order, job)
            return True
        waiting = self.queues.setdefault(queue.executor, ExecutorQueue())
        if job.task.keeps is not None and not waiting.makes_place(job, job.task.keeps):
            return False
        waiting.jobs.append((order, job))
        if not waiting.is_busy:
            self._begin(waiting)
        return True

    def done(self, job: Job) -> None:
        """A job has ended: its executor takes the next, its reservation goes on.

        Jobs of one executor run one at a time.
        """
        if job.task.queue is not None:
            self._begin(self.queues[job.task.queue.executor])
        server = self._server_of(job.task)
        if server is not None:
            self.offer(server, PUT_BACK)

    def _begin(self, waiting: ExecutorQueue) -> None:
        following = waiting.window or waiting.jobs
        waiting.is_busy = bool(following)
        if following:
            order, job = following[0]
            self._list(job.task, job.task.urgency, order, waiting)

    def _list(self, task: SimulatedTask, urgency: int, order: int, entry: Job | ExecutorQueue) -> None:
        """Something is ready, on the core or in the reservation of its task."""
        server = self._server_of(task)
        if server is None:
            heappush(self.ready, (urgency, order, entry))
        else:
            heappush(server.ready, (urgency, order, entry))
            self.offer(server, order)

    def _server_of(self, task: SimulatedTask) -> Server | None:
        """The reservation that a task is in."""
        if task.share is None:
            return None
        return self.servers.setdefault(task.share.number, Server(task.share))

    def offer(self, server: Server, order: int) -> None:
        """A reservation is ready as long as something in it is, and some budget is left; not while a job of it runs.

        `order` breaks ties between equal priorities.
        """
        runs = self.running is not None and self.running.task.share == server.share
        if server.ready and server.left > 0 and not server.is_listed and not runs:
            server.is_listed = True
            heappush(self.ready, (server.share.urgency, order, server))

    @property
    def is_overtaken(self) -> bool:
        """Whether something that is ready is more urgent than the running job.

        Reservations compete by their own urgency, threads inside of one by theirs.
        """
        assert self.running is not None
        task = self.running.task
        server = self._server_of(task)
        urgency = task.urgency if server is None else server.share.urgency
        if self.ready and self.ready[0][0] < urgency:
            return True
        return server is not None and bool(server.ready) and server.ready[0][0] < task.urgency

    def settle(self, now: Exact) -> None:
        """Note what the running job has done until now.

        `now` is in ns; work left, budgets used and the start of the running job are updated.
        """
        if self.running is not None:
            done = now - self.since
            self.running.left -= done
            self.used += 0 if self.running.is_interrupt else done
            server = self._server_of(self.running.task)
            if server is not None:
                server.used += done
            self.since = now

    def refill(self, of: Gap | ReservationShare, now: Exact, order: int) -> None:
        """A period of throttling or of a reservation begins; what was left of the budget is lost.

        `of` is the throttling or the reservation whose period begins at `now`, in ns.
        """
        server = self.servers.get(of.number) if isinstance(of, ReservationShare) else None
        self.settle(now)
        if self.running is not None and (server is None or self._server_of(self.running.task) is server):
            self.put_back()
        if server is not None:
            server.used = 0
            self.offer(server, order)
        elif isinstance(of, Gap):
            self.used = 0

    def put_back(self) -> None:
        """The running job is interrupted, to go on later.

        A job inside a section that nothing interrupts goes on before every other thread.
        """
        job = self.running
        assert job is not None
        self.running = None
        self._list(job.task, HELD if job.is_held else job.task.urgency, PUT_BACK, job)

    def pick(self, now: Exact) -> Exact | None:
        """Let the most urgent ready job run, if one may; how long it may at most.

        In ns: until the job ends or a budget is used up; None where nothing may run.
        """
        if not self.ready or (self._is_closed and not self.ready[0][2].is_interrupt):
            return None
        first = heappop(self.ready)[2]
        length: list[Exact] = []
        if isinstance(first, Server):
            first.is_listed = False
            length = [first.left]
            first = heappop(first.ready)[2]
        self.running = first.take() if isinstance(first, ExecutorQueue) else first
        self.since = now
        self.version += 1
        if self.budget_ns is not None and not self.running.is_interrupt:
            length.append(self.budget_ns - self.used)
        return min([self.running.left, *length])
