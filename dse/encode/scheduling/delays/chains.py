"""Chains in flows: how long the threads of one wait together, a variable for each chain and each part of it.

Threads that may be one chain (`dse.space.architecture.chains`) wait, all of them together, for one job at least of each
thread that may delay one of them on its core: however the chain is cut into busy windows, some window counts it
(docs/semantics.md, section 4.9). Where a timer releases a thread of it, or it is on another core than the one before,
the chain is cut there for sure, and waits no less than its two parts. Of a part that is one thread the rows are those
of its own response time (`dse.encode.scheduling.waiting`), or of its lag (docs/semantics.md, section 4.9), which is no
less than what the first job of a busy period waits. All rows are necessary conditions; what they leave open a
clause says (`dse.encode.scheduling.contention.Contention.raised`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from ortools.sat.python import cp_model

from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.terms import FlowChain, Waiter
from dse.encode.scheduling.combined import Combined
from dse.encode.scheduling.threads import Places, Thread
from dse.space.architecture.chains import follows, may_come_seldom
from dse.space.model.space import Space
from dse.space.model.trees import leaves


class CountedJobs(Protocol):
    """The interface of the jobs that are counted in rows which these rows use."""

    @property
    def rows(self) -> dict[Waiter, list[tuple[int, int, int]]]:
        """By thread or chain: a processor, the position of a type of it, and a row."""


class Waiting(Protocol):
    """The interface of the waiting times of single threads that these rows use."""

    space: Space
    places: Places
    combined: Combined
    scale: int

    firsts: dict[int, int]

    @property
    def jobs(self) -> CountedJobs:
        """The jobs that are counted in rows."""

    @property
    def model(self) -> cp_model.CpModel:
        """The model that the rows are in."""

    def waiting(self, number: int) -> cp_model.IntVar:
        """The variable of a thread's waiting."""

    def executes(self, number: int) -> bool:
        """Whether a thread executes something in every design."""


class ChainRows:
    """The waiting of chains in one model, in its unit of time, with their rows."""

    def __init__(self, waiting: Waiting) -> None:
        self.waiting = waiting
        self._variables: dict[FlowChain, int] = {}
        self._figures: set[int] = set()
        self._throughout: dict[tuple[FlowChain, int, int], int] = {}

    def copy(self, waiting: Waiting) -> ChainRows:
        """The waiting of the same chains in a copy of the model, without a change of this one."""
        other = ChainRows(waiting)
        other._variables, other._throughout = dict(self._variables), dict(self._throughout)
        other._figures = set(self._figures)
        return other

    def add_figure(self, chain: FlowChain, index: int) -> None:
        """Add the row of a variable of the model that stands for what a flow counts for the waiting of a chain."""
        if index not in self._figures:
            self._figures.add(index)
            self.waiting.model.add(self.waiting.combined.variable(index) >= self.variable(chain))

    def variable(self, chain: FlowChain) -> cp_model.IntVar:
        """The variable of how long the threads of a chain wait together, by the least way to cut it, with its rows."""
        if len(chain.threads) == 1 and not (chain.has_source and self._may_lag(chain.threads[0])):
            return self.waiting.waiting(chain.threads[0])
        if chain not in self._variables:
            made = self.waiting.model.new_int_var(0, len(chain.threads) * UNBOUNDED_NS * self.waiting.scale, "")
            self._variables[chain] = made.index
            self._add_rows(chain, made)
        return self.waiting.combined.variable(self._variables[chain])

    def _add_rows(self, chain: FlowChain, variable: cp_model.IntVar) -> None:
        model, threads = self.waiting.model, chain.threads
        if len(threads) == 1:
            self._add_lag(threads[0], variable)
            return
        self._add_once(chain, variable)
        for place in range(1, len(threads)):
            parts = [self.variable(replace(chain, threads=part)) for part in (threads[:place], threads[place:])]
            for cut in self._cuts(threads[place - 1], threads[place]):
                literals = [self.waiting.combined.literal(index) for index in cut]
                model.add(variable >= sum(parts)).only_enforce_if(literals)

    def _add_lag(self, number: int, variable: cp_model.IntVar) -> None:
        """A thread lags no less than the first job of a busy period waits; a timer's as long as each job waits."""
        whole = self.waiting.waiting(number)
        first = self.waiting.firsts.get(number)
        if first is not None:
            self.waiting.model.add(variable >= self.waiting.combined.variable(first))
        for index in self.waiting.combined.timers(number):
            self.waiting.model.add(variable >= whole).only_enforce_if(self.waiting.combined.literal(index))

    def _may_lag(self, number: int) -> bool:
        """Whether another thread or device may release a thread that may be in no executor."""
        space = self.waiting.space
        is_released = follows(space.components, space.connections, number) is not None
        return is_released and None in leaves(space.components[number].executor)

    def _add_once(self, chain: FlowChain, variable: cp_model.IntVar) -> None:
        """One job of each thread that may delay some thread of the chain, for each type of each processor."""
        places, combined, model = self.waiting.places, self.waiting.combined, self.waiting.model
        own = [places.threads[number] for number in chain.threads if self._counts(number)]
        works: dict[int, cp_model.IntVar] = {}
        for processor in sorted({processor for thread in own for processor in thread.cores}):
            delays = [
                (other, found) for other in places.on(processor) if (found := self._delays(processor, other, own))
            ]
            if not delays:
                continue
            literals = [combined.literal(index) for _, index in delays]
            work = works[processor] = model.new_int_var(0, len(own) * UNBOUNDED_NS * self.waiting.scale, "")
            rows = self.waiting.jobs.rows.setdefault(chain, [])
            for position, kind in enumerate(places.types[processor]):
                times = [self.waiting.scale * places.worst_on[processor, other.number][position] for other, _ in delays]
                row = model.add(work - cp_model.LinearExpr.weighted_sum(literals, times) >= 0)
                row.only_enforce_if(combined.literal(kind))
                rows.append((processor, position, row.index))
        if works:
            model.add(variable >= sum(works.values()))

    def throughout(self, chain: FlowChain, processor: int) -> list[tuple[Thread, int]]:
        """The threads that may delay every thread of a chain on a processor, each with a literal of its doing so."""
        places, combined = self.waiting.places, self.waiting.combined
        if chain not in self.waiting.jobs.rows or not all(map(self._counts, chain.threads)):
            return []
        own = [places.threads[number] for number in chain.threads]
        found = []
        for other in places.on(processor):
            if self._delays(processor, other, own) is None or any(processor not in item.cores for item in own):
                continue
            delays = [combined.delays(processor, other, thread) for thread in own]
            if None in delays:
                continue
            key = (chain, processor, other.number)
            if key not in self._throughout:
                made = self.waiting.model.new_bool_var("")
                combined.implied(delays, made.index)
                self._throughout[key] = made.index
            found.append((other, self._throughout[key]))
        return found

    def _counts(self, number: int) -> bool:
        """Whether a thread waits for others in every design, by its own priority."""
        thread = self.waiting.places.threads.get(number)
        if thread is None or thread.is_odd or thread.rates is None or not self.waiting.executes(number):
            return False
        return all(worst for _, worst in thread.worst)

    def _delays(self, processor: int, other: Thread, own: Sequence[Thread]) -> int | None:
        """A literal that is true where another thread delays one of these on a processor; None where it never does."""
        if other.is_odd or other.rates is None or any(other.number == item.number for item in own):
            return None
        if may_come_seldom(self.waiting.space, other.number, [item.number for item in own]):  # of these only some do
            return None
        found = {
            delays
            for thread in own
            if processor in thread.cores
            and (delays := self.waiting.combined.delays(processor, other, thread)) is not None
        }
        return self.waiting.combined.any_of(tuple(sorted(found))) if found else None

    def _cuts(self, before: int, number: int) -> list[tuple[int, ...]]:
        """Literals that are all true only where a thread is no chain with the one before, in several ways.

        A timer releases it, or the two are on cores of their own.
        """
        places = self.waiting.places
        one, other = places.threads.get(before), places.threads.get(number)
        if one is None or other is None:
            return [(places.true,)]
        timers = self.waiting.combined.timers(number)
        cuts: list[tuple[int, ...]] = [(index,) for index in timers]
        if places.true in timers:
            return [(places.true,)]
        for processor, cores in one.cores.items():
            there = other.cores.get(processor)
            for core, index in enumerate(cores):
                elsewhere = None if there is None or core >= len(there) else -there[core] - 1
                found = [item for item in (index, elsewhere) if item is not None and item != places.true]
                if -places.true - 1 not in found:
                    cuts.append(tuple(found) or (places.true,))
        return cuts
