"""Literals made of those of threads: one of several, sharing a core, delaying each other; each made once for a model.

They are true where what they stand for is; where it is not, they may be either. That is enough for what is learnt from
late threads: a clause or a row that a literal switches on is then never switched off where it has to hold.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.literals import literal_of
from dse.encode.scheduling.reasons import Reason
from dse.encode.scheduling.threads import Places, Thread
from dse.space.architecture.chains import successors

Group = tuple[int, tuple[int, ...]]
"""A processor, and the numbers of threads that share a core of it."""


class Combined:
    """The combined literals of one model."""

    def __init__(self, model: cp_model.CpModel, places: Places) -> None:
        self.model, self.places = model, places
        self._made: dict[Any, int] = {}

    def copy(self, model: cp_model.CpModel) -> Combined:
        """The combined literals for a copy of the model, which has those that were made so far."""
        other = Combined(model, self.places)
        other._made = dict(self._made)
        return other

    def literal(self, index: int) -> Any:
        """The solver's literal of an index; below 0 its negation."""
        return literal_of(self.model, index)

    def variable(self, index: int) -> cp_model.IntVar:
        """The solver's variable of an index."""
        return self.model.get_int_var_from_proto_index(index)

    def implied(self, conditions: Iterable[int | None], result: int) -> None:
        """The result is true where all conditions are; None stands for what is always true."""
        held = [index for index in conditions if index is not None and index != self.places.true]
        self.model.add_bool_or([self.literal(result), *(self.literal(-index - 1) for index in held)])

    def any_of(self, literals: tuple[int, ...]) -> int | None:
        """A literal that is true where one of these is; None where that is always."""
        if self.places.true in literals:
            return None
        if len(literals) == 1:
            return literals[0]
        if literals not in self._made:
            made = self.model.new_bool_var("")
            self._made[literals] = made.index
            for index in literals:
                self.model.add_implication(self.literal(index), made)
        return self._made[literals]

    def together(self, group: Group) -> int | None:
        """A literal that is true where all threads of the group run on one core; None where that is always."""
        if group not in self._made:
            processor, threads = group
            cores = self.places.cores_of(processor, threads)
            if any(all(index == self.places.true for index in literals) for literals in cores):
                return None
            made = self.model.new_bool_var("")
            self._made[group] = made.index
            for literals in cores:
                self.implied(literals, made.index)
        return self._made[group]

    def conditions(self, reason: Reason) -> list[int]:
        """Literals that are all true where the reason holds."""
        held = [self.any_of(tuple(sorted(set(literals)))) for literals in reason.conditions]
        held += [self.together(group) for group in reason.together if len(group[1]) > 1]
        threads = self.places.threads
        held += [self.above(threads[other], threads[number]) for other, number in reason.above]
        return [index for index in held if index is not None and index != self.places.true]

    def delays(self, processor: int, other: Thread, thread: Thread) -> int | None:
        """A literal that is true where the other thread delays this one on the processor; None where it never does.

        Of two threads that may be in a chain it is true where a timer cuts it: else they need not wait for each other.
        """
        base = self._goes_before(processor, other, thread)
        between = successors(self.places.space, other.number, thread.number) if base is not None else ()
        if base is None or not between:
            return base
        key = ("cut", processor, other.number, thread.number)
        if key not in self._made:
            cuts = [item for number in between if (item := self.timers(number))]
            if not cuts:
                return None
            made = self.model.new_bool_var("")
            self._made[key] = made.index
            for timers in cuts:
                self.implied([base, self.any_of(timers)], made.index)
        return self._made[key]

    def timers(self, number: int) -> tuple[int, ...]:
        """Literals of which one is true where a timer releases a thread."""
        thread = self.places.threads.get(number)
        return () if thread is None else tuple(sorted(index for index, rate in thread.modes if rate is not None))

    def _goes_before(self, processor: int, other: Thread, thread: Thread) -> int | None:
        """A literal that is true where both share a core of the processor and the other thread goes first."""
        key = ("delays", processor, other.number, thread.number)
        if key in self._made:
            return self._made[key]
        orders: list[list[int]] = [[]]
        if other.is_numbered or thread.is_numbered:
            above = self.above(other, thread)
            if above == -self.places.true - 1:
                return None
            orders = [[above]]
        else:
            orders = self._orders(other, thread)
            if not orders:
                return None
        together = self.together((processor, tuple(sorted((other.number, thread.number)))))
        found = self.model.new_bool_var("")
        for parts in orders:
            self.implied([*parts, together], found.index)
        self._made[key] = found.index
        return found.index

    def above(self, other: Thread, thread: Thread) -> int:
        """A literal that is true where the other thread has a priority no lower than this one's; one is a number."""
        true = self.places.true
        if not other.is_numbered or not thread.is_numbered:
            return true if other.is_numbered else -true - 1
        if not other.numbers and not thread.numbers:
            return true if (other.priority or 0) >= (thread.priority or 0) else -true - 1
        key = ("above", other.number, thread.number)
        if key not in self._made:
            found = self.model.new_bool_var("")
            self._made[key] = found.index
            self.model.add(self._number(other) + 1 <= self._number(thread)).only_enforce_if(found.negated())
            mirrored = self._made.get(("above", thread.number, other.number))
            if mirrored is not None:
                self.model.add_bool_or([found, self.literal(mirrored)])
        return self._made[key]

    def _number(self, thread: Thread) -> Any:
        """The priority of a thread as an expression."""
        if not thread.numbers:
            return thread.priority
        literals = [self.literal(index) for index, _ in thread.numbers]
        return cp_model.LinearExpr.weighted_sum(literals, [number for _, number in thread.numbers])

    def _orders(self, other: Thread, thread: Thread) -> list[list[int]]:
        """Literals that are all true where the other thread has a rate, and this one a rate that goes after it."""
        orders = []
        for literal, order, rate in other.turns or ():
            slower = {
                index
                for index, own, _ in thread.turns or ()
                if order is not None and own is not None and (order, other.number) < (own, thread.number)
            }
            if slower and rate:
                made = self.any_of(tuple(sorted(slower)))
                orders.append([literal, *([made] if made is not None else [])])
        return orders
