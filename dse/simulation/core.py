"""A core of a processor: what runs, what is ready, and what keeps it from running.

Interrupts go before everything; a job inside its non-preemptive section gives way to nothing else; an operating system
that throttles lets threads run for a budget in each period, then nothing but interrupts until the period is over.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from typing import TYPE_CHECKING

from dse.units import Exact

if TYPE_CHECKING:
    from dse.simulation.engine import Births
    from dse.simulation.plan import Task

HELD = -1
"""The urgency of a job inside its section; that of interrupts is below, that of threads above."""
PUT_BACK = -1
"""An interrupted job goes before later ones of its own task."""


@dataclass
class Job:
    """A job of a task with the time that is left of it; between `holds` and `yields` left nothing preempts it."""

    task: Task
    release: Exact
    left: Exact
    births: Births
    holds: Exact = 0
    yields: Exact = 0

    @property
    def is_interrupt(self) -> bool:
        """Whether it is none of a thread."""
        return self.task.urgency < HELD

    @property
    def is_held(self) -> bool:
        """Whether it is inside its section, not at either end of it."""
        return self.yields < self.left < self.holds


class Core:
    """The running job, since when, and what is ready, most urgent first; `budget_ns` of a period if it throttles."""

    def __init__(self, budget_ns: int | None) -> None:
        self.budget_ns = budget_ns
        self.running: Job | None = None
        self.since: Exact = 0
        self.version = 0
        self.ready: list[tuple[int, int, Job]] = []
        self.used: Exact = 0

    @property
    def is_closed(self) -> bool:
        """Whether threads have used up their budget."""
        return self.budget_ns is not None and self.used >= self.budget_ns

    def add(self, job: Job, order: int) -> None:
        """A job that is ready."""
        heappush(self.ready, (job.task.urgency, order, job))

    def settle(self, now: Exact) -> None:
        """Note what the running job has done until now."""
        if self.running is not None:
            done = now - self.since
            self.running.left -= done
            self.used += 0 if self.running.is_interrupt else done
            self.since = now

    def put_back(self) -> None:
        """The running job is interrupted, to go on later."""
        job = self.running
        assert job is not None
        heappush(self.ready, (HELD if job.is_held else job.task.urgency, PUT_BACK, job))
        self.running = None

    def pick(self, now: Exact) -> Exact | None:
        """Let the most urgent ready job run, if one may; how long it may at most."""
        if not self.ready or (self.is_closed and not self.ready[0][2].is_interrupt):
            return None
        self.running = heappop(self.ready)[2]
        self.since = now
        self.version += 1
        if self.budget_ns is None or self.running.is_interrupt:
            return self.running.left
        return min(self.running.left, self.budget_ns - self.used)
