"""Limits on response times: what the search's model knows of them from the start, and what it learns.

A model knows at first only that threads have cores. Where the referee finds a thread late in a solution, other cores
are tried for the same decisions (`dse.analysis.packing`); they cost nothing, as no objective depends on cores. Where
that is in vain the model gets the rows of the processor (`dse.encode.schedulability`), and where it has them, a clause
that names a set of threads which cannot meet the limit together (`dse.encode.reasons`; an "unschedulability core" of
Y. Zhao and H. Zeng, "The concept of unschedulability core for optimizing priority assignment in real-time systems",
DATE 2017). Rows and clauses hold in every design that the referee accepts, and each solution that it refuses is
excluded: no design is lost, and none is accepted that misses a limit.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.limits import Limit, judge
from dse.analysis.packing import first_placement, placements
from dse.analysis.views import View
from dse.encode.forms import Board, Form, OpenTerm, floor_int
from dse.encode.places import Places, Thread
from dse.encode.rates import RateVariables
from dse.encode.reasons import Reason, reason_of, reason_of_value
from dse.encode.schedulability import add_rows, number_cores
from dse.space.cores import is_scheduled, rules_on_cores
from dse.space.types import Design, OpenCore, Space
from dse.timelimit import look_at_the_clock

MOST_LESSONS = 60
"""After so many lessons the search for the first design with some figures gives up."""


@dataclass(frozen=True)
class Deadline:
    """An upper limit on the response time of a thread; it holds while the literal `guard` (an index) is true."""

    limit: Limit
    guard: int | None = None

    @property
    def thread(self) -> int:
        """The number of the thread."""
        return self.limit.requirement.metric.index or 0


class Contention:
    """The limits on response times of one model, and what has been added to it for their sake."""

    def __init__(
        self,
        space: Space,
        model: cp_model.CpModel,
        places: Places,
        deadlines: Sequence[Deadline],
        *,
        movable: bool,
    ) -> None:
        self.space, self.model, self.places, self.deadlines = space, model, places, deadlines
        self.movable = movable and not rules_on_cores(space)
        self.known: set[int] = set()
        self.is_first = True
        self.is_upward = False
        self._seeks_first = False
        self._lessons, self._most_lessons = 0, MOST_LESSONS
        self._made: dict[Any, int] = {}

    def seek_first(self, *, patient: bool) -> None:
        """From now on designs are to be the first of their kind: with the first cores that will do.

        `is_first` tells afterwards whether they were. A search that is not `patient` is stuck when it learns too often.
        """
        self._seeks_first, self._lessons, self.is_first = True, 0, True
        self._most_lessons = sys.maxsize if patient else MOST_LESSONS

    def seek_any(self) -> None:
        """Designs are taken as they come."""
        self._seeks_first = False

    @property
    def is_stuck(self) -> bool:
        """Whether the search for the first design has learnt too often."""
        return self._seeks_first and self._lessons > self._most_lessons

    @property
    def moved(self) -> frozenset[int]:
        """The decisions on cores where threads can be moved."""
        return frozenset(item.index for item in self.space.open_cores) if self.movable else frozenset()

    def copy(self, model: cp_model.CpModel) -> Contention:
        """The same for a copy of the model."""
        other = Contention(self.space, model, self.places, self.deadlines, movable=self.movable)
        other.is_upward = self.is_upward
        other.known, other._made = set(self.known), dict(self._made)
        return other

    def add_known_rows(self) -> None:
        """Rows at once where threads cannot be moved: every core is stated."""
        for processor in range(len(self.space.processors)):
            if not self.movable or not any(item.is_open for item in self.places.on(processor)):
                self._add_rows(processor)

    def _add_rows(self, processor: int) -> None:
        self.known.add(processor)
        add_rows(self.space, self.model, self.places, processor, self.deadlines)

    def add_waiting(self, terms: Sequence[OpenTerm]) -> None:
        """Each thread waits at least for one job of whatever is more urgent on its core.

        variable >= least + weight * sum(worst of other * literal of other's delaying the thread), for each type of the
        processor; the numbers of equal cores come with it.
        """
        for processor in range(len(self.space.processors)):
            if terms and processor not in self.known and not rules_on_cores(self.space):
                number_cores(self.space, self.model, self.places, processor)
        for term in terms:
            if term.waits is None or term.least is None or term.waits[0] not in self.places.threads:
                continue
            for processor in self.places.threads[term.waits[0]].cores:
                look_at_the_clock()
                self._add_waiting(term, term.least, *term.waits, processor)

    def _add_waiting(self, term: OpenTerm, least: Form, number: int, weight: Fraction, processor: int) -> None:
        thread = self.places.threads[number]
        if thread.is_odd or thread.rates is None:
            return
        delays = {}
        for other in self.places.on(processor):
            if other.number != number and not other.is_odd and other.rates is not None:
                found = self._delays(processor, other, thread)
                if found is not None:
                    delays[other.number] = found
        variables = [self.model.get_int_var_from_proto_index(index) for index in least.coefficients]
        alone = cp_model.LinearExpr.weighted_sum(variables, list(least.coefficients.values())) + least.constant
        for position, kind in enumerate(self.places.types[processor]):
            waiting = sum(
                floor_int(weight * self.places.worst_on[processor, other][position]) * self._literal(index)
                for other, index in delays.items()
            )
            self.model.add(term.variable >= alone + waiting).only_enforce_if(self._literal(kind))

    def _delays(self, processor: int, other: Thread, thread: Thread) -> int | None:
        """A literal that is true where the other thread delays this one on the processor; None where it never does."""
        key = ("delays", processor, other.number, thread.number)
        if key in self._made:
            return self._made[key]
        orders: list[list[int]] = [[]]
        if other.priority is not None or thread.priority is not None:
            if other.priority is None or (thread.priority is not None and other.priority < thread.priority):
                return None
        else:
            orders = self._orders(other, thread)
            if not orders:
                return None
        together = self._together((processor, tuple(sorted((other.number, thread.number)))))
        found = self.model.new_bool_var("")
        for parts in orders:
            held = [index for index in (*parts, together) if index is not None and index != self.places.true]
            self.model.add_bool_or([found, *(self._literal(-index - 1) for index in held)])
        self._made[key] = found.index
        return found.index

    def _orders(self, other: Thread, thread: Thread) -> list[list[int]]:
        """Literals that are all true where the other thread has a rate, and this one a rate that goes after it."""
        orders = []
        for literal, rate in other.rates or ():
            slower = {
                index
                for index, own in thread.rates or ()
                if own and (own < rate or (own == rate and other.number < thread.number))
            }
            if slower and rate:
                made = self._any(tuple(sorted(slower)))
                orders.append([literal, *([made] if made is not None else [])])
        return orders

    def raised(self, terms: Sequence[OpenTerm], design: Design, value: Callable[[cp_model.IntVar], int]) -> bool:
        """Raise open terms that a solution has too low, for all designs with the same reason; whether there are any."""
        found = False
        for term in terms:
            exact = term.value(View(design))
            if value(term.variable) >= exact:
                continue
            found = True
            reason = reason_of_value(self.space, self.places, term.value, View(design), exact)
            held = [self._literal(index) for index in self._conditions(reason)]
            variable = self.model.get_int_var_from_proto_index(term.variable.index)
            self.model.add(variable >= exact).only_enforce_if(held)
        return found

    def settled(self, design: Design, is_true: Callable[[cp_model.IntVar], bool]) -> Design | None:
        """The design, or the same on other cores, that meets all limits; None where the model has learnt instead."""
        view = View(design)
        held = [
            item
            for item in self.deadlines
            if item.guard is None or is_true(self.model.get_int_var_from_proto_index(item.guard))
        ]
        limits = [item.limit for item in held]
        open_ = [item for item in self.space.open_cores if self._is_free(item)]
        if self._seeks_first and self.movable:
            first = first_placement(self.space, design, open_, limits)
            if first is not None:
                return first
            self.is_first = False
        late = [item for item in held if not judge(item.limit, view).holds]
        if not late:
            return design
        if self.movable:
            for other in placements(self.space, design, open_, limits):
                moved = View(other)
                if all(judge(item.limit, moved).holds for item in held):
                    return other
        self._learn(late, view)
        return None

    def _is_free(self, item: OpenCore) -> bool:
        """Whether nothing fixes a thread's core: neither the question, nor who asks it of the model."""
        domains = [
            list(self.model.proto.variables[index].domain)
            for index in (self.places.options[item.index] if item.index < len(self.places.options) else ())
            if index != self.places.true
        ]
        return item.index not in self.space.fixed and bool(domains) and all(item == [0, 1] for item in domains)

    def _learn(self, late: Sequence[Deadline], view: View) -> None:
        self._lessons += 1
        fresh = {self.places.processor_of(item.thread, view) for item in late} - self.known
        for processor in sorted(fresh):
            self._add_rows(processor)
        if fresh:
            return
        for item in late:
            self._forbid(item, reason_of(self.space, self.places, item.limit, view))

    def _forbid(self, late: Deadline, reason: Reason) -> None:
        """Not all of the reason's conditions together."""
        clause = [] if late.guard is None else [-late.guard - 1]
        clause += [-index - 1 for index in self._conditions(reason)]
        self.model.add_bool_or([self._literal(index) for index in clause])

    def _conditions(self, reason: Reason) -> list[int]:
        """Literals that are all true where the reason holds."""
        held = []
        for literals in reason.conditions:
            made = self._any(tuple(sorted(set(literals))))
            if made is not None:
                held.append(made)
        for group in reason.together:
            if len(group[1]) < 2:
                continue
            made = self._together(group)
            if made is not None:
                held.append(made)
        return held

    def _literal(self, index: int) -> Any:
        if index < 0:
            return self.model.get_int_var_from_proto_index(-index - 1).negated()
        return self.model.get_int_var_from_proto_index(index)

    def _any(self, literals: tuple[int, ...]) -> int | None:
        """A literal that is true where one of these is; None where that is always."""
        if self.places.true in literals:
            return None
        if len(literals) == 1:
            return literals[0]
        if literals not in self._made:
            made = self.model.new_bool_var("")
            self._made[literals] = made.index
            for index in literals:
                self.model.add_implication(self._literal(index), made)
        return self._made[literals]

    def _together(self, group: tuple[int, tuple[int, ...]]) -> int | None:
        """A literal that is true where all threads of the group run on one core of the processor."""
        if group not in self._made:
            processor, threads = group
            cores = self.places.cores_of(processor, threads)
            if any(all(index == self.places.true for index in literals) for literals in cores):
                return None
            made = self.model.new_bool_var("")
            self._made[group] = made.index
            for literals in cores:
                self.model.add_bool_or([made, *(self._literal(-index - 1) for index in literals)])
        return self._made[group]


def is_deadline(limit: Limit) -> bool:
    """Whether a limit is an upper one on a response time of the space itself."""
    return (
        not limit.is_elsewhere
        and limit.requirement.metric.kind == "response time"
        and limit.requirement.operator in ("<=", "<")
    )


def is_upward(space: Space) -> bool:
    """Whether a longer response time is nowhere an advantage: then it is enough that open terms are not too low."""
    lower = [item.metric for item in space.requirements if item.operator not in ("<=", "<")]
    lower += [item.metric for item in space.objectives if item.sense == "maximise"]
    asked = [item.metric for item in space.requirements] + [item.metric for item in space.objectives]
    derived = any(item.kind == "derived" and is_scheduled(space, item) for item in asked)
    return not derived and not any(is_scheduled(space, item) for item in lower)


def contention_of(board: Board, rates: RateVariables) -> Contention | None:
    """What the model of a board knows of its limits on response times, one for all that is asked of the board.

    None where there are none. Threads can be moved unless some other sum holds a response time.
    """
    if not board.deadlines and not board.open_terms:
        return None
    if board.contention is None:
        places = Places(board, rates)
        board.contention = Contention(board.space, board.model, places, board.deadlines, movable=not board.scheduled)
    found: Contention = board.contention
    found.movable = found.movable and not board.scheduled
    return found
