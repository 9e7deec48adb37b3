"""Limits on response times: what the search's model knows of them from the start, and what it learns.

A model knows at first only that threads have cores. Where the referee finds a thread late in a solution, other cores
are tried for the same decisions (`dse.analysis.placement.heuristics`); they cost nothing, as no objective depends on
cores. Where that is in vain the model gets the rows of the processor (`dse.encode.scheduling.schedulability`), and
where it has them, a clause that names a set of threads which cannot meet the limit together
(`dse.encode.scheduling.reasons`; an "unschedulability core" of Y. Zhao and H. Zeng, "The concept of unschedulability
core for optimizing priority assignment in real-time systems", DATE 2017). Rows and clauses hold in every design that
the referee accepts, and each solution that it refuses is excluded: no design is lost, and none is accepted that misses
a limit.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Sequence

from ortools.sat.python import cp_model

from dse.analysis.limits import Limit, judge, keeps_cores
from dse.analysis.placement.heuristics import placements
from dse.analysis.placement.lexicographic import first_placement
from dse.analysis.scheduling.responses import is_released_alone
from dse.analysis.views import View
from dse.encode.linear import Board, OpenTerm
from dse.encode.messages.reasons import order_conditions
from dse.encode.rates import RateVariables
from dse.encode.scheduling.combined import Combined
from dse.encode.scheduling.core_limits import CoreLimit
from dse.encode.scheduling.core_symmetry import number_cores
from dse.encode.scheduling.orders import order_reasons
from dse.encode.scheduling.reasons import Reason, reason_of, reason_of_message, reason_of_value
from dse.encode.scheduling.schedulability import Deadline, add_rows
from dse.encode.scheduling.threads import Places
from dse.encode.scheduling.waiting import WaitRows
from dse.space.model.space import Design, OpenCore, OpenPriority, Space
from dse.space.question.open_cores import rules_on_order, tells_cores_apart

MOST_LESSONS = 60
"""After so many lessons the search for the first design with some figures gives up."""
RAISED = 10
"""A solution with figures that are too low counts as so many lessons: rows for more jobs take longer than a clause."""


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
        core_limits: Sequence[CoreLimit] = (),
    ) -> None:
        self.space, self.model, self.places, self.deadlines = space, model, places, deadlines
        self.core_limits = core_limits
        self.movable = movable and not tells_cores_apart(space)
        self.reorders = movable and not rules_on_order(space) and bool(space.open_priorities)
        self.known: set[int] = set()
        self.without_rows: cp_model.CpModel | None = None  # the model before it learnt of cores that are full
        self.numbering: list[int] = []  # clauses without which equal cores are interchangeable
        self._let_go = 0  # so many of them say nothing for now
        self.is_first = True
        self.is_upward = False
        self._seeks_first = False
        self._lessons, self._most_lessons = 0, MOST_LESSONS
        self.combined = Combined(model, places)
        self.waiting: WaitRows | None = None

    def seek_first(self, *, patient: bool) -> None:
        """From now on designs are to be the first of their kind: with the first cores that will do.

        `is_first` tells afterwards whether they were. A search that is not `patient` is stuck when it learns too often.
        """
        self._seeks_first, self._lessons, self.is_first = True, 0, True
        self._most_lessons = sys.maxsize if patient else MOST_LESSONS
        self._let_go_of_numbers()

    def _let_go_of_numbers(self) -> None:
        """Cores have any numbers where it is the first design that counts, which the order of threads does not tell.

        Where the executor of a thread is decided the decisions on cores do not follow each other as threads do.
        """
        if self._seeks_first and self.space.has_open_groups:
            for clause in self.numbering[self._let_go :]:
                self.model.proto.constraints[clause].bool_or.literals.append(self.places.true)
            self._let_go = len(self.numbering)

    def seek_any(self) -> None:
        """Designs are taken as they come."""
        self._seeks_first = False
        self._number_again()

    def _number_again(self) -> None:
        for clause in self.numbering[: self._let_go]:
            literals = self.model.proto.constraints[clause].bool_or.literals
            *kept, _ = literals
            literals.clear()
            literals.extend(kept)
        self._let_go = 0

    @property
    def is_stuck(self) -> bool:
        """Whether the search for the first design has learnt too often."""
        return self._seeks_first and self._lessons > self._most_lessons

    @property
    def may_move(self) -> bool:
        """Whether threads can be moved, and any design with the same figures will do."""
        return bool(self.moved) and not self._seeks_first

    @property
    def moved(self) -> frozenset[int]:
        """The decisions on cores and best orders where threads can be moved."""
        cores = self.space.open_cores if self.movable else ()
        return frozenset(item.index for item in (*cores, *(self.space.open_priorities if self.reorders else ())))

    def copy(self, model: cp_model.CpModel) -> Contention:
        """The limits on response times for a copy of the model, with all that this one has learnt."""
        other = Contention(
            self.space, model, self.places, self.deadlines, movable=self.movable, core_limits=self.core_limits
        )
        other.is_upward, other.reorders = self.is_upward, self.reorders
        other.known, other.numbering, other._let_go = set(self.known), list(self.numbering), self._let_go
        other.without_rows = self.without_rows
        other.combined = self.combined.copy(model)
        other.waiting = self.waiting.copy(other.combined) if self.waiting is not None else None
        return other

    def add_known_rows(self) -> None:
        """Rows at once where threads cannot be moved: every core is stated."""
        for processor in range(len(self.space.processors)):
            if not self.movable or not any(item.is_open for item in self.places.on(processor)):
                self._add_rows(processor)

    def _add_rows(self, processor: int) -> None:
        self.known.add(processor)
        self.numbering += add_rows(self.space, self.model, self.places, processor, self.deadlines)
        self._let_go_of_numbers()

    def add_waiting(self, board: Board) -> None:
        """Rows of what threads wait for (`dse.encode.scheduling.waiting`)."""
        if self.waiting is not None:
            self.waiting.extend(board)
        elif board.open_terms:
            self.waiting = WaitRows(board, self.places, self.combined)

    def number_cores(self) -> None:
        """Number the interchangeable cores of processors that have no rows yet."""
        for processor in range(len(self.space.processors)):
            if processor not in self.known:
                self.numbering += number_cores(self.space, self.model, self.places, processor)

    def raised(self, terms: Sequence[OpenTerm], design: Design, value: Callable[[cp_model.IntVar], int]) -> bool:
        """Raise open terms that a solution has too low, for all designs with the same reason; whether there are any.

        First the jobs are counted that are not yet; where that changes nothing the reason is a clause.
        """
        view = View(design)
        low = [(term, exact) for term in terms if value(term.variable) < (exact := term.value(view))]
        self._lessons += RAISED if low else 0
        fresh = False
        for term, _ in low:
            if term.waits is not None and self.waiting is not None:
                fresh |= self.waiting.refine(term.waits[0], view)
        for term, exact in low if not fresh else ():
            if self._ordered(term, view, value):
                continue
            has = value(term.variable)
            reason, least = reason_of_value(self.space, self.places, term, View(design), has, exact)
            held = [self.combined.literal(index) for index in self.combined.conditions(reason)]
            variable = self.model.get_int_var_from_proto_index(term.variable.index)
            self.model.add(variable >= least).only_enforce_if(held)
        return bool(low)

    def _ordered(self, term: OpenTerm, view: View, value: Callable[[cp_model.IntVar], int]) -> bool:
        """Say what goes before the message of a figure that a solution does not have there; whether there is any."""

        def is_known(literal: int) -> bool:
            return bool(value(self.combined.literal(literal)))

        fresh = False
        for conditions, literal in order_conditions(self.space, self.places.chosen, term, view, is_known):
            held = [self.combined.literal(index) for index in self.combined.conditions(Reason(tuple(conditions), ()))]
            self.model.add_bool_or([self.combined.literal(literal), *(one.negated() for one in held)])
            fresh = True
        return fresh

    def why_late(self, limit: Limit, view: View) -> list[int]:
        """Literals that are true together only where the message of a limit is late; all are in the design."""
        return self.combined.conditions(reason_of_message(self.space, self.places, limit, view))

    def settled(
        self,
        design: Design,
        is_true: Callable[[cp_model.IntVar], bool],
        with_rows: Collection[int] = (),
        *,
        is_best: bool = True,
    ) -> Design | None:
        """The design, or the same on other cores, that meets all limits; None where the model has learnt instead.

        From a design that is not the best of its model, which may never come again, no rows are learnt: then None says
        nothing more than that no cores were found.

        A design with a core that is too full is left to the limits of each core (`dse.encode.scheduling.core_limits`),
        which refuse it, where no thread is late, or where these alone forbid the cores on which none would be. The
        latter not of limits in `with_rows`, by their numbers, of which the model has rows: it learns that threads are
        late, by far more rows.
        """
        view = View(design)
        held = [item for item in self.deadlines if self._holds(item.guard, is_true)]
        limits = [item.limit for item in held]
        cores = {number: item.limit for number, item in enumerate(self.core_limits) if self._holds(item.guard, is_true)}
        beside = list(cores.values())
        open_ = [item for item in self.space.open_cores if self.movable and self._is_free(item)]
        orders = [item for item in self.space.open_priorities if self.reorders and self._is_free(item)]
        if self._seeks_first and (self.movable or self.reorders):
            first, is_sure = first_placement(self.space, design, open_, limits, beside, orders)
            self.is_first &= is_sure and (not orders or self._is_sure(view))
            if first is not None:
                return first
        late = [item for item in held if not judge(item.limit, view).holds]
        if not late:
            return design
        is_full = False
        if self.movable or self.reorders:
            for other in placements(self.space, design, open_, limits, orders, beside):
                moved = View(other)
                if not all(judge(limit, moved).holds for limit in limits):
                    continue
                if all(judge(limit, moved).holds for limit in beside):
                    return other
                is_full = True
        if is_full and any(number not in with_rows and not keeps_cores(limit, view) for number, limit in cores.items()):
            return design
        if is_best or not self._fresh(late, view):
            self._learn(late, held, view, orders)
        return None

    def elsewhere(self, design: Design, value: Callable[[cp_model.IntVar], int]) -> Iterator[Design]:
        """The design on other cores, as quick ways find them, whatever its figures are there; nobody is late."""

        def is_true(literal: cp_model.IntVar) -> bool:
            return bool(value(literal))

        limits = [item.limit for item in self.deadlines if self._holds(item.guard, is_true)]
        beside = [item.limit for item in self.core_limits if self._holds(item.guard, is_true)]
        open_ = [item for item in self.space.open_cores if self._is_free(item)]
        for other in placements(self.space, design, open_, limits, (), beside) if open_ else ():
            view = View(other)
            if all(judge(limit, view).holds for limit in (*limits, *beside)):
                yield other

    def _is_sure(self, view: View) -> bool:
        """Whether it is certain which orders will do: no release depends on them, nor on how many levels there are."""
        space = self.space
        few = any(slot.priority_levels is not None for slot in space.processors)
        return not few and all(is_released_alone(space, number, view) for number in self.places.threads)

    def _holds(self, guard: int | None, is_true: Callable[[cp_model.IntVar], bool]) -> bool:
        """Whether a limit is asked for."""
        return guard is None or is_true(self.model.get_int_var_from_proto_index(guard))

    def _is_free(self, item: OpenCore) -> bool:
        """Whether nothing fixes a thread's core: neither the question, nor who asks it of the model."""
        domains = [
            list(self.model.proto.variables[index].domain)
            for index in (self.places.options[item.index] if item.index < len(self.places.options) else ())
            if index != self.places.true
        ]
        return item.index not in self.space.fixed and bool(domains) and all(item == [0, 1] for item in domains)

    def _fresh(self, late: Sequence[Deadline], view: View) -> set[int]:
        """The processors of late threads that have no rows yet."""
        return {self.places.processor_of(item.thread, view) for item in late} - self.known

    def _learn(
        self, late: Sequence[Deadline], held: Sequence[Deadline], view: View, orders: Sequence[OpenPriority]
    ) -> None:
        self._lessons += 1
        fresh = self._fresh(late, view)
        if fresh and self.without_rows is None:
            self.without_rows = self.model.clone()
        for processor in sorted(fresh):
            self._add_rows(processor)
        if fresh:
            return
        without = False
        for reason, group in order_reasons(self.space, self.places, [item.limit for item in held], view.design, orders):
            self._forbid([item for item in held if item.thread in group], reason)
            without = True
        for item in late if not without else ():
            self._forbid([item], reason_of(self.space, self.places, item.limit, view))

    def _forbid(self, late: Sequence[Deadline], reason: Reason) -> None:
        """Not all of the reason's conditions together while all these limits are asked for."""
        clause = [-item.guard - 1 for item in late if item.guard is not None]
        clause += [-index - 1 for index in self.combined.conditions(reason)]
        self.model.add_bool_or([self.combined.literal(index) for index in clause])


def is_deadline(limit: Limit) -> bool:
    """Whether a limit is an upper one on a response time of the space itself."""
    return not limit.is_elsewhere and limit.requirement.is_deadline


def contention_of(board: Board, rates: RateVariables) -> Contention | None:
    """The `Contention` of a board's model, made on first use and shared by all questions.

    None where there are none. Threads can be moved unless some other sum holds a response time.
    """
    if not board.deadlines and not board.open_terms:
        return None
    if board.contention is None:
        places = Places(board, rates)
        board.contention = Contention(
            board.space,
            board.model,
            places,
            board.deadlines,
            movable=not board.scheduled,
            core_limits=board.core_limits,
        )
    found: Contention = board.contention
    found.movable = found.movable and not board.scheduled
    found.reorders = found.reorders and not board.scheduled
    return found
