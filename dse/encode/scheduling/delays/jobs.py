"""Further jobs of other threads that delay a thread, or threads of a chain, counted where a solution is too low.

The k-th job of another thread counts where the wait is not over when it is released: where R + J > (k - 1) T, with the
other thread's period T and jitter J, and R the end of a first job of the thread. Of threads that may be one chain, all
of which the other thread delays, R is the time that they take together: however the chain is cut into windows, the jobs
counted in them are no fewer than those of one window as long as all of them (docs/semantics.md, section 4.9).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.rates import NS_PER_S, is_event_triggered, rate_hz
from dse.analysis.terms import Waiter
from dse.analysis.views import View
from dse.encode.linear import floor_int
from dse.encode.scheduling.combined import Combined
from dse.encode.scheduling.delays.jitters import Jitters
from dse.encode.scheduling.threads import Places, Thread
from dse.space.architecture.chains import before_on_core
from dse.support.units import Exact

MOST_JOBS = 32
"""The greatest number of jobs of one thread that are counted within the response time of another."""

Rows = list[tuple[int, int, int]]
"""Rows of a wait: a processor, the position of a type of it, and the row that is: wait >= work of jobs counted."""


class JobRows:
    """The jobs that are counted in the rows of one model, each once."""

    def __init__(self, combined: Combined, jitters: Jitters, scale: int) -> None:
        self.combined, self.jitters, self.scale = combined, jitters, scale
        self.rows: dict[Waiter, Rows] = {}
        self._made: dict[Any, int] = {}

    def copy(self, combined: Combined, jitters: Jitters) -> JobRows:
        """The jobs that are counted so far, in a copy of the model."""
        other = JobRows(combined, jitters, self.scale)
        other.rows = {waiter: list(rows) for waiter, rows in self.rows.items()}
        other._made = dict(self._made)
        return other

    @property
    def places(self) -> Places:
        """Where each thread may run."""
        return self.combined.places

    @property
    def model(self) -> cp_model.CpModel:
        """The model that the rows are in."""
        return self.combined.model

    def count(
        self, waiter: Waiter, end: Any, processor: int, other: Thread, delays: int, reach: Exact, view: View
    ) -> bool:
        """Count the jobs of another thread up to a time in ns, and how late they are; whether any is new.

        `end` is an expression of when the wait is over, and `delays` a literal that is true where the other thread
        delays the whole of it on a processor. `view` is a design that does so.
        """
        space, fresh = self.places.space, False
        for literal, rate in other.rates or ():
            for job in range(2, MOST_JOBS + 1) if rate else ():
                if (job - 1) * NS_PER_S >= reach * rate:
                    break
                fresh |= self._add_job(waiter, end, processor, other, (literal, rate), job, delays)
        is_late = other.number in self.jitters.variables and not before_on_core(space, other.number)
        if is_late and is_event_triggered(space.components[other.number], view):
            fresh |= self._add_late_jobs(waiter, end, processor, other, view, reach, delays)
        return fresh

    def _add_job(
        self,
        waiter: Waiter,
        end: Any,
        processor: int,
        other: Thread,
        rate: tuple[int, Fraction],
        job: int,
        delays: int,
    ) -> bool:
        """The k-th job counts where R > (k - 1) * T; whether that is new."""
        literal, speed = rate
        key = ("job", waiter, processor, other.number, literal, job)
        if key in self._made:
            return False
        latest = floor_int((job - 1) * NS_PER_S * self.scale / speed)
        counted = self._counted(waiter, processor, other, job)
        self._made[key] = counted
        self.combined.implied([delays, literal, self._beyond(waiter, end, latest)], counted)
        return True

    def _add_late_jobs(
        self, waiter: Waiter, end: Any, processor: int, other: Thread, view: View, reach: Exact, delays: int
    ) -> bool:
        """The k-th job counts where R + J > (k - 1) * T, at the rate that the other thread has."""
        fresh = False
        eager = [index for index, rate in other.modes if rate is None]
        jitter = self.combined.variable(self.jitters.variables[other.number])
        for literal, speed in other.rates or ():
            if not speed or speed != rate_hz(self.places.space, ("activation", other.number), view):
                continue
            window = reach + self.jitters.of(other.number, view)
            for job in range(2, MOST_JOBS + 1):
                if (job - 1) * NS_PER_S >= window * speed:
                    break
                key = ("late", waiter, processor, other.number, literal, job)
                if key in self._made:
                    continue
                latest = floor_int((job - 1) * NS_PER_S * self.scale / speed)
                beyond = self.model.new_bool_var("")
                self.model.add(end + jitter <= latest).only_enforce_if(beyond.negated())
                self._made[key] = counted = self._counted(waiter, processor, other, job)
                self.combined.implied(
                    [delays, literal, self.combined.any_of(tuple(sorted(eager))), beyond.index], counted
                )
                fresh = True
        return fresh

    def _beyond(self, waiter: Waiter, end: Any, latest: int) -> int:
        """A literal that is true where the wait is over later than `latest`."""
        key = ("beyond", waiter, latest)
        if key not in self._made:
            made = self.model.new_bool_var("")
            self.model.add(end <= latest).only_enforce_if(made.negated())
            self._made[key] = made.index
        return self._made[key]

    def _counted(self, waiter: Waiter, processor: int, other: Thread, job: int) -> int:
        """The literal of a job of another thread within a wait, in its rows."""
        key = ("counted", waiter, processor, other.number, job)
        if key not in self._made:
            made = self.model.new_bool_var("")
            self._made[key] = made.index
            for slot, position, row in self.rows[waiter]:
                if slot == processor:
                    linear = self.model.proto.constraints[row].linear
                    linear.vars.append(made.index)
                    linear.coeffs.append(-self.scale * self.places.worst_on[processor, other.number][position])
        return self._made[key]
