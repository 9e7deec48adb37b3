"""Response times in flows: how long each thread waits for others, one variable for all flows that it is in.

A thread with worst time C ends, R after its release, at the least R with

    R = C + sum(ceil((R + J) / T) * worst over what is more urgent on its core, with separation T and jitter J)

and any R that this is the least of, with >= in place of =, is no less. That is the end of the first job of a busy
period. A later one may respond later, though its response time is no such R: then the first job has a variable of its
own, and the thread waits no less than that. As jobs are counted the equation is

    R >= C + sum(worst * (first + second + third + ...)),    the k-th job of another thread where R + J > (k - 1) * T

so that a literal for each job of each rival makes a linear row of it (compare M. Di Natale and H. Zeng, "An efficient
formulation of the real-time feasibility region for design optimization", IEEE Transactions on Computers 62(4), 2013).
First jobs are in the model from the start, further ones follow where a solution has a response time too low
(`WaitRows.refine`). A jitter is at least what the threads and connections add that dispatch a thread, one after the
other. All rows are necessary conditions: of several streams the rate of their sum counts, of a busy period the first
job, of options that are not listed the shortest time. What they leave open a clause says (`Contention.raised`).
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.rates import is_event_triggered
from dse.analysis.scheduling.chained import chain_wait_ns
from dse.analysis.scheduling.model import Ends
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses
from dse.analysis.scheduling.tasks import longest_alone_ns
from dse.analysis.terms import FlowChain, Waiter
from dse.analysis.views import View, tabulate
from dse.encode.linear import EXACT_LIMIT, Board, Form, OpenTerm, greatest
from dse.encode.scheduling.combined import Combined
from dse.encode.scheduling.delays.chains import ChainRows
from dse.encode.scheduling.delays.hosted import add_hosted_rows
from dse.encode.scheduling.delays.jitters import Jitters
from dse.encode.scheduling.delays.jobs import JobRows
from dse.encode.scheduling.threads import Places, Thread
from dse.space.architecture.chains import may_come_seldom
from dse.space.model.space import Space
from dse.space.model.trees import at, leaves
from dse.support.timelimit import look_at_the_clock
from dse.support.units import Exact

MOST_BOUNDS = 256
"""A limit with more values than this bounds no response time directly."""


class WaitRows:
    """The waiting times of one model's threads, in units of 1 / `scale` ns, with their rows."""

    def __init__(self, board: Board, places: Places, combined: Combined) -> None:
        self.space: Space = board.space
        self.places, self.combined = places, combined
        self.scale = board.wait_scale or 1
        self.variables: dict[int, int] = {}
        self.chains = ChainRows(self)
        self.firsts: dict[int, int] = {}
        """How long the first job of a busy period waits: the same where no later job waits longer."""
        self.jitters = Jitters(self)
        self.jobs = JobRows(combined, self.jitters, self.scale)
        self._latest: dict[int, int] = {}
        self._terms = 0
        self._deadlines: set[int] = set()
        self._orderly: set[int] = set()
        self.extend(board)

    def extend(self, board: Board) -> None:
        """Rows of whatever has been asked of the board since, and of its limits."""
        self.variables.update((item, found.index) for item, found in board.waiting.items() if isinstance(item, int))
        self._orderly |= {item.thread for item in board.deadlines if item.guard is None and _ends_first(board, item)}
        for term in board.open_terms[self._terms :]:
            self._add_term(term)
        self._terms = len(board.open_terms)
        for waiter, variable in board.waiting.items():
            if isinstance(waiter, FlowChain):
                self.chains.add_figure(waiter, variable.index)
        for number in list(self.variables):
            look_at_the_clock()
            if number not in self.jobs.rows:
                self._add_first(number)
                add_hosted_rows(board, self, number)
        self._add_deadlines(board)
        for number in sorted({other for waiter in self.jobs.rows for other in self._rivals_of(waiter)}):
            self.jitters.add(board, number, frozenset())

    def copy(self, combined: Combined) -> WaitRows:
        """The waiting times for a copy of the model, with their variables and rows; this one stays as it is."""
        other = object.__new__(WaitRows)
        other.__dict__.update(self.__dict__)
        other.combined = combined
        other.variables = dict(self.variables)
        other.chains, other.jitters = self.chains.copy(other), self.jitters.copy(other)
        other.jobs = self.jobs.copy(combined, other.jitters)
        other.firsts = dict(self.firsts)
        return other

    @property
    def model(self) -> cp_model.CpModel:
        """The model that the rows are in."""
        return self.combined.model

    def waiting(self, number: int) -> cp_model.IntVar:
        """The variable of a thread's waiting, with the rows of first jobs."""
        if number not in self.variables:
            self.variables[number] = self.model.new_int_var(0, UNBOUNDED_NS * self.scale, "").index
            self._add_first(number)
        return self.combined.variable(self.variables[number])

    def expression(self, form: Form) -> Any:
        """A form in the model's variables."""
        variables = [self.combined.variable(index) for index in form.coefficients]
        return cp_model.LinearExpr.weighted_sum(variables, list(form.coefficients.values())) + form.constant

    def work(self, thread: Thread) -> Any:
        """The longest time of a thread's job in the model's unit."""
        literals = [self.combined.literal(index) for index, _ in thread.worst]
        return cp_model.LinearExpr.weighted_sum(literals, [self.scale * worst for _, worst in thread.worst])

    def _rivals(self, number: int) -> list[Thread]:
        """Threads that may delay a thread and are simple enough to be counted.

        Not those that come once at most in its busy windows: of these only some do (docs/semantics.md, section 4.9).
        """
        thread = self.places.threads.get(number)
        if thread is None or thread.is_odd or thread.rates is None:
            return []
        found = {}
        for processor in thread.cores:
            for other in self.places.on(processor):
                if other.number == number or other.is_odd or other.rates is None:
                    continue
                if not may_come_seldom(self.space, other.number, (number,)):
                    found[other.number] = other
        return list(found.values())

    def _rivals_of(self, waiter: Waiter) -> set[int]:
        """The numbers of the threads that may delay a thread, or a thread of a chain."""
        members = (waiter,) if isinstance(waiter, int) else waiter.threads
        return {other.number for number in members for other in self._rivals(number)}

    # --- rows from the start ---------------------------------------------------------------------------------------

    def _add_term(self, term: OpenTerm) -> None:
        """A figure with a variable of its own that holds waiting: variable >= least + weight * waiting."""
        if term.waits is None or term.least is None:
            return
        number, weight = term.waits
        if (
            not isinstance(number, int)
            or number not in self.places.threads
            or self.variables.get(number) == term.variable.index
        ):
            return
        each = weight / self.scale
        most = each.denominator * (abs(term.least.high) + abs(term.least.low)) + each.numerator * UNBOUNDED_NS
        if most * self.scale < EXACT_LIMIT:
            low = each.denominator * self.expression(term.least) + each.numerator * self.waiting(number)
            self.model.add(each.denominator * (term.variable + 1) >= low + 1)

    def _add_first(self, number: int) -> None:
        """The first job waits for sum(worst of other * literal of its delaying it), for each type of each processor."""
        thread = self.places.threads[number]
        self.jobs.rows[number] = []
        rivals = {other.number for other in self._rivals(number)}
        if not rivals or not self.executes(number):
            return
        if not all(worst for _, worst in thread.worst):  # a job without work ends at its release
            return
        first = self._made_first(number)
        for processor in thread.cores:
            delays = {
                other.number: self.combined.literal(found)
                for other in self.places.on(processor)
                if other.number in rivals and (found := self.combined.delays(processor, other, thread)) is not None
            }
            for position, kind in enumerate(self.places.types[processor]):
                literals = list(delays.values())
                works = [self.scale * self.places.worst_on[processor, other][position] for other in delays]
                row = self.model.add(first - cp_model.LinearExpr.weighted_sum(literals, works) >= 0)
                row.only_enforce_if(self.combined.literal(kind))
                self.jobs.rows[number].append((processor, position, row.index))

    def _made_first(self, number: int) -> cp_model.IntVar:
        """The variable of the first job's waiting."""
        waiting = self.waiting(number)
        if number in self._orderly:
            self.firsts[number] = waiting.index
            return waiting
        first = self.model.new_int_var(0, UNBOUNDED_NS * self.scale, "")
        self.model.add(first <= waiting)
        self.firsts[number] = first.index
        return first

    def _first_end(self, thread: Thread) -> Any:
        """When the first job of a busy period ends."""
        return self.combined.variable(self.firsts[thread.number]) + self.work(thread)

    def _add_deadlines(self, board: Board) -> None:
        """A response time is no longer than a limit on it."""
        for position, item in enumerate(board.deadlines):
            if position in self._deadlines:
                continue
            number, operator = item.thread, item.limit.requirement.operator
            if number not in self.variables or number not in self.places.threads:
                continue
            table = board.short_table(item.limit.bound, MOST_BOUNDS)
            if table is None:
                continue
            inwards = greatest(strict=operator == "<")
            # no response of the model is longer, and so none breaks a longer limit
            most = self.scale * (UNBOUNDED_NS + max((one for _, one in self.places.threads[number].worst), default=0))
            bounds = [(literal, min(inwards(bound * self.scale), most)) for literal, bound in table]
            self._deadlines.add(position)
            if item.guard is None:
                self._latest[number] = max(bound for _, bound in bounds)
            end = self.waiting(number) + self.work(self.places.threads[number])
            row = self.model.add(end <= self.expression(board.form(bounds)))
            if item.guard is not None:
                row.only_enforce_if(self.combined.literal(item.guard))

    def executes(self, number: int) -> bool:
        """Whether a thread executes something in every design."""
        return all(leaf is not None for leaf in leaves(self.space.components[number].execution_ns))

    # --- rows that follow ------------------------------------------------------------------------------------------

    def refine(self, waiter: Waiter, view: View) -> bool:
        """Count the jobs that delay a thread in a design, and how late they are; whether any was not counted yet.

        Of a chain those of the threads that are cut off from the others in the design.
        """
        known = all_responses(self.space, view)
        if isinstance(waiter, int):
            return self._refine(waiter, view, known, set())
        fresh = False
        for part in self._parts(waiter.threads, view):
            if len(part) == 1:
                fresh |= self._refine(part[0], view, known, set())
            else:
                fresh |= self._refine_chain(replace(waiter, threads=part), view)
        return fresh

    def _parts(self, chain: tuple[int, ...], view: View) -> list[tuple[int, ...]]:
        """The parts of a chain of which all threads share a core in a design, as long as can be."""
        found = [chain[:1]]
        for number in chain[1:]:
            processor = at(self.space.components[number].processor, view)
            if processor is not None and self._shares_core(processor, found[-1][-1], number, view):
                found[-1] = (*found[-1], number)
            else:
                found.append((number,))
        return found

    def _refine_chain(self, chain: FlowChain, view: View) -> bool:
        """Count further jobs of each thread that delays all threads of a chain on their core."""
        processor = self.places.processor_of(chain.threads[0], view)
        variable = self.chains.variable(chain)
        works = [self.work(self.places.threads[number]) for number in chain.threads]
        alone = sum(longest_alone_ns(self.space, number, "thread", view) for number in chain.threads)
        reach = min(UNBOUNDED_NS, chain_wait_ns(self.space, chain, view) + alone)
        fresh = False
        for other, delays in self.chains.throughout(chain, processor):
            if self._shares_core(processor, chain.threads[0], other.number, view):
                fresh |= self.jobs.count(chain, variable + sum(works), processor, other, delays, reach, view)
        return fresh

    def _refine(self, number: int, view: View, known: Ends, seen: set[int]) -> bool:
        seen.add(number)
        response = known.get((number, "thread"))
        thread = self.places.threads.get(number)
        if thread is None or (number, "thread") not in known or not self.jobs.rows.get(number):
            return False
        reach: Exact = UNBOUNDED_NS if response is None else response
        if number in self._latest:  # what is released later is of no account
            reach = min(reach, Fraction(self._latest[number] + 1, self.scale))
        processor = self.places.processor_of(number, view)
        fresh = False
        for other in self._rivals(number):
            if processor not in other.cores:
                continue
            delays = self.combined.delays(processor, other, thread)
            if delays is None or not self._shares_core(processor, number, other.number, view):
                continue
            fresh |= self.jobs.count(number, self._first_end(thread), processor, other, delays, reach, view)
            for upstream in self.jitters.before(other.number, view):
                if upstream not in seen:
                    fresh |= self._refine(upstream, view, known, seen)
        return fresh

    def _shares_core(self, processor: int, number: int, other: int, view: View) -> bool:
        components = self.space.components
        if at(components[other].processor, view) != processor:
            return False
        cores = at(components[number].core, view), at(components[other].core, view)
        return None in cores or cores[0] == cores[1]


def _ends_first(board: Board, item: Any) -> bool:
    """Whether a limit on a thread's response time keeps each of its jobs from waiting for the one before."""
    component = board.space.components[item.thread]

    def ends(view: View) -> bool:
        return not is_event_triggered(component, view) and item.limit.bound(view) <= at(component.period_ns, view)

    cases = tabulate(board.space, ends, MOST_BOUNDS)
    return cases is not None and all(case.value for case in cases)
