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

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.binding import transmission_ns
from dse.analysis.rates import NS_PER_S, is_event_triggered, rate_hz
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses
from dse.analysis.scheduling.model import Ends
from dse.analysis.scheduling.tasks import TaskKey, alone_ns, longest_alone_ns, shortest_alone_ns
from dse.analysis.terms import Waiter
from dse.analysis.views import View, tabulate
from dse.encode.linear import EXACT_LIMIT, Board, Form, OpenTerm, floor_int, greatest
from dse.encode.scheduling.chains import ChainRows
from dse.encode.scheduling.combined import Combined
from dse.encode.scheduling.hosted import add_hosted_rows
from dse.encode.scheduling.places import Places, Thread
from dse.space.architecture.chains import may_succeed, way_up
from dse.space.model.space import Component, Space
from dse.space.model.trees import at, leaves
from dse.support.timelimit import look_at_the_clock
from dse.support.units import Exact

MOST_JOBS = 32
"""The greatest number of jobs of one thread that are counted within the response time of another."""
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
        self.jitters: dict[int, int] = {}
        self.upstream: dict[int, int] = {}
        """What dispatches a thread whose jitter is known: its only source."""
        self._rows: dict[int, list[tuple[int, int, int]]] = {}
        self._latest: dict[int, int] = {}
        self._made: dict[Any, int] = {}
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
            if isinstance(waiter, tuple):
                self.chains.adopt(waiter, variable.index)
        for number in list(self.variables):
            look_at_the_clock()
            if number not in self._rows:
                self._add_first(number)
                add_hosted_rows(board, self, number)
        self._add_deadlines(board)
        for number in sorted({other.number for thread in self.variables for other in self._rivals(thread)}):
            self._add_jitter(board, number, frozenset())

    def copy(self, combined: Combined) -> WaitRows:
        """The same for a copy of the model."""
        other = object.__new__(WaitRows)
        other.__dict__.update(self.__dict__)
        other.combined = combined
        other.variables, other._made = dict(self.variables), dict(self._made)
        other.chains = self.chains.copy(other)
        other.firsts = dict(self.firsts)
        other._rows = {number: list(rows) for number, rows in self._rows.items()}
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

    def _expression(self, form: Form) -> Any:
        variables = [self.combined.variable(index) for index in form.coefficients]
        return cp_model.LinearExpr.weighted_sum(variables, list(form.coefficients.values())) + form.constant

    def work(self, thread: Thread) -> Any:
        """The longest time of a thread's job in the model's unit."""
        literals = [self.combined.literal(index) for index, _ in thread.worst]
        return cp_model.LinearExpr.weighted_sum(literals, [self.scale * worst for _, worst in thread.worst])

    def _rivals(self, number: int) -> list[Thread]:
        """Threads that may delay a thread and are simple enough to be counted.

        None of those that may come before or after it in a chain, for which it need not wait.
        """
        thread = self.places.threads.get(number)
        if thread is None or thread.is_odd or thread.rates is None:
            return []
        found = {}
        for processor in thread.cores:
            for other in self.places.on(processor):
                if other.number == number or other.is_odd or other.rates is None:
                    continue
                if not may_succeed(self.space, number, other.number):
                    found[other.number] = other
        return list(found.values())

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
            low = each.denominator * self._expression(term.least) + each.numerator * self.waiting(number)
            self.model.add(each.denominator * (term.variable + 1) >= low + 1)

    def _add_first(self, number: int) -> None:
        """The first job waits for sum(worst of other * literal of its delaying it), for each type of each processor."""
        thread = self.places.threads[number]
        self._rows[number] = []
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
                self._rows[number].append((processor, position, row.index))

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
            row = self.model.add(end <= self._expression(board.form(bounds)))
            if item.guard is not None:
                row.only_enforce_if(self.combined.literal(item.guard))

    def executes(self, number: int) -> bool:
        """Whether a thread executes something in every design."""
        return all(leaf is not None for leaf in leaves(self.space.components[number].execution_ns))

    def _add_jitter(self, board: Board, number: int, below: frozenset[int]) -> cp_model.IntVar | None:
        """At least the jitter of the only source, and what its job and the connection add, where events dispatch it.

        None where several sources do, or one that holds events back.
        """
        if number in self.jitters:
            return self.combined.variable(self.jitters[number])
        component = self.space.components[number]
        eager = self._eager(board, component)
        if eager is None or len(component.triggers) != 1 or number in below:
            return None
        wire = self.space.connections[component.triggers[0]]

        def carrying(view: View) -> int:
            if not is_event_triggered(component, view):
                return 0
            least, most, _ = transmission_ns(self.space, wire, view)
            return floor_int(Fraction(most - least) * self.scale)

        forms, waits = [board.form(board.table(carrying))], list[Any]()
        if wire.source is not None and wire.rate_hz is None and wire.data_rate is None:
            if len(way_up(self.space, wire.source)) > 1:
                return self._chained_jitter(board, number, wire.source, forms[0], eager, below)
            source = self.space.components[wire.source]
            if "sporadic" in set(leaves(source.protocol)):
                return None

            def varying(view: View, number: int = wire.source) -> int:
                shortest = shortest_alone_ns(self.space, number, "thread", view)
                return self.scale * (longest_alone_ns(self.space, number, "thread", view) - shortest)

            forms.append(board.form(board.table(varying)))
            self.upstream[number] = wire.source
            if wire.source in self.places.threads and self.executes(wire.source):
                waits.append(self.waiting(wire.source))
            further = self._add_jitter(board, wire.source, below | {number})
            if further is not None:
                waits.append(further)
        most = sum(form.high for form in forms) + sum(
            self.model.proto.variables[item.index].domain[1] for item in waits
        )
        variable = self.model.new_int_var(0, most, "")  # several on the way may have no bound
        parts = [self._expression(form) for form in forms]
        self.model.add(variable >= sum([*parts, *waits])).only_enforce_if(self.combined.literal(eager))
        self.jitters[number] = variable.index
        return variable

    def _chained_jitter(
        self, board: Board, number: int, source: int, carried: Form, eager: int, below: frozenset[int]
    ) -> cp_model.IntVar:
        """At least the jitter that the connection to a thread adds, behind a thread that may be chained itself.

        Where events release all threads of a part of that chain but the first, and a timer releases that one or it is
        the first of all, what they vary and wait together is in it, too.
        """
        chain = way_up(self.space, source)
        chain = chain[max((place + 1 for place, item in enumerate(chain) if not self.executes(item)), default=0) :]
        self.upstream[number] = source
        variable = self.model.new_int_var(0, carried.high + 2 * len(chain) * UNBOUNDED_NS * self.scale, "")
        self.jitters[number] = variable.index
        where = [eager]
        self.model.add(variable >= self._expression(carried)).only_enforce_if(self.combined.literal(eager))
        if any("sporadic" in set(leaves(self.space.components[item].protocol)) for item in chain):
            return variable
        for start in reversed(range(len(chain))):
            part, first = chain[start:], self.places.threads.get(chain[start])
            total = (
                self._expression(carried) + self._expression(self._varying(board, part)) + self.chains.variable(part)
            )
            for literal, _ in [item for item in (first.modes if first is not None else ()) if item[1] is not None]:
                held = [self.combined.literal(index) for index in (*where, literal)]
                self.model.add(variable >= total).only_enforce_if(held)
            eager_one = self._eager(board, self.space.components[chain[start]])
            if eager_one is None:
                break
            where.append(eager_one)
            if not start and chain == way_up(self.space, source):
                further = self._add_jitter(board, chain[0], below | {number})
                held = [self.combined.literal(index) for index in where]
                self.model.add(variable >= total + (0 if further is None else further)).only_enforce_if(held)
        return variable

    def _varying(self, board: Board, chain: Sequence[int]) -> Form:
        """How much more than at least the threads of a chain take at most by themselves."""

        def varying(view: View) -> int:
            times = (alone_ns(self.space.components[item], "thread", view) for item in chain)
            return self.scale * sum(most - least for least, most in times)

        return board.form(board.table(varying))

    def _eager(self, board: Board, component: Component) -> int | None:
        """A literal that is true where events dispatch a component; None where they never do."""
        found = [literal for literal, value in board.table(lambda view: is_event_triggered(component, view)) if value]
        return board.any_of(found).index if found else None

    # --- rows that follow ------------------------------------------------------------------------------------------

    def refine(self, waiter: Waiter, view: View) -> bool:
        """Count the jobs that delay a thread in a design, and how late they are; whether any was not counted yet.

        Of a chain those of the threads that are cut off from the others in the design.
        """
        known = all_responses(self.space, view)
        if isinstance(waiter, int):
            return self._refine(waiter, view, known, set())
        joined = [(last, first) in known for first, last in pairwise(waiter)]
        ends = zip(waiter, [False, *joined], [*joined, False], strict=True)
        alone = [number for number, is_behind, is_before in ends if not is_behind and not is_before]
        fresh = False
        for number in alone:
            fresh |= self._refine(number, view, known, set())
        return fresh

    def _refine(self, number: int, view: View, known: Ends, seen: set[int]) -> bool:
        seen.add(number)
        response = known.get((number, "thread"))
        thread = self.places.threads.get(number)
        if thread is None or (number, "thread") not in known or not self._rows.get(number):
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
            for literal, rate in other.rates or ():
                for job in range(2, MOST_JOBS + 1) if rate else ():
                    if (job - 1) * NS_PER_S >= reach * rate:
                        break
                    fresh |= self._add_job(thread, processor, other, (literal, rate), job, delays)
            if other.number in self.jitters and is_event_triggered(self.space.components[other.number], view):
                fresh |= self._add_late_jobs(thread, processor, other, view, reach, delays)
                for upstream in self._chain(other.number, view):
                    if upstream not in seen:
                        fresh |= self._refine(upstream, view, known, seen)
        return fresh

    def _shares_core(self, processor: int, number: int, other: int, view: View) -> bool:
        components = self.space.components
        if at(components[other].processor, view) != processor:
            return False
        cores = at(components[number].core, view), at(components[other].core, view)
        return None in cores or cores[0] == cores[1]

    def _chain(self, number: int, view: View) -> list[int]:
        """What dispatches a thread in a design, and what that one, as far as their waiting is its jitter."""
        found: list[int] = []
        while number in self.upstream and is_event_triggered(self.space.components[number], view):
            number = self.upstream[number]
            found.append(number)
        return found

    def _add_job(
        self, thread: Thread, processor: int, other: Thread, rate: tuple[int, Fraction], job: int, delays: int
    ) -> bool:
        """The k-th job counts where R > (k - 1) * T; whether that is new."""
        literal, speed = rate
        key = ("job", thread.number, processor, other.number, literal, job)
        if key in self._made:
            return False
        latest = floor_int((job - 1) * NS_PER_S * self.scale / speed)
        counted = self._counted(thread, processor, other, job)
        self._made[key] = counted
        self.combined.implied([delays, literal, self._beyond(thread, latest)], counted)
        return True

    def _add_late_jobs(
        self, thread: Thread, processor: int, other: Thread, view: View, reach: Exact, delays: int
    ) -> bool:
        """The k-th job counts where R + J > (k - 1) * T, at the rate that the other thread has."""
        fresh = False
        chain = self._chain(other.number, view)
        eager = [index for index, rate in other.modes if rate is None]
        jitter = self.combined.variable(self.jitters[other.number])
        for literal, speed in other.rates or ():
            if not speed or speed != rate_hz(self.space, ("activation", other.number), view):
                continue
            window = reach + self._jitter_of(other.number, chain, view)
            for job in range(2, MOST_JOBS + 1):
                if (job - 1) * NS_PER_S >= window * speed:
                    break
                key = ("late", thread.number, processor, other.number, literal, job)
                if key in self._made:
                    continue
                latest = floor_int((job - 1) * NS_PER_S * self.scale / speed)
                beyond = self.model.new_bool_var("")
                self.model.add(self._first_end(thread) + jitter <= latest).only_enforce_if(beyond.negated())
                self._made[key] = counted = self._counted(thread, processor, other, job)
                self.combined.implied(
                    [delays, literal, self.combined.any_of(tuple(sorted(eager))), beyond.index], counted
                )
                fresh = True
        return fresh

    def _jitter_of(self, number: int, chain: Sequence[int], view: View) -> Exact:
        """The jitter of a thread's releases in a design, as the rows count it."""
        known = all_responses(self.space, view)
        total: Exact = 0
        for target, source in zip([number, *chain], [*chain, None], strict=True):
            component = self.space.components[target]
            if target not in self.jitters or not is_event_triggered(component, view):
                break
            least, most, _ = transmission_ns(self.space, self.space.connections[component.triggers[0]], view)
            total += most - least
            if source is not None:
                alone = longest_alone_ns(self.space, source, "thread", view)
                found = known.get((source, "thread"), alone)
                response = UNBOUNDED_NS if found is None else max(found, alone)
                total += response - shortest_alone_ns(self.space, source, "thread", view)
        return total

    def _beyond(self, thread: Thread, latest: int) -> int:
        """A literal that is true where the thread's first job ends later than `latest`."""
        key = ("beyond", thread.number, latest)
        if key not in self._made:
            made = self.model.new_bool_var("")
            self.model.add(self._first_end(thread) <= latest).only_enforce_if(made.negated())
            self._made[key] = made.index
        return self._made[key]

    def _counted(self, thread: Thread, processor: int, other: Thread, job: int) -> int:
        """The literal of a job of another thread within a thread's response time, in its rows."""
        key = ("counted", thread.number, processor, other.number, job)
        if key not in self._made:
            made = self.model.new_bool_var("")
            self._made[key] = made.index
            for slot, position, row in self._rows[thread.number]:
                if slot == processor:
                    linear = self.model.proto.constraints[row].linear
                    linear.vars.append(made.index)
                    linear.coeffs.append(-self.scale * self.places.worst_on[processor, other.number][position])
        return self._made[key]


def _ends_first(board: Board, item: Any) -> bool:
    """Whether a limit on a thread's response time keeps each of its jobs from waiting for the one before."""
    component = board.space.components[item.thread]

    def ends(view: View) -> bool:
        return not is_event_triggered(component, view) and item.limit.bound(view) <= at(component.period_ns, view)

    cases = tabulate(board.space, ends, MOST_BOUNDS)
    return cases is not None and all(case.value for case in cases)
