"""The canonical design of a point: one of those that have it, whatever way the search went.

It is the first in the order of decisions and options of the file, wherever a short depth-first search finds that one;
else the one that the solver finds from the canonical design of the point before, which depends on the problem, the seed
and the solver's version only (decision record 3). Where threads share cores and neither is found within a budget, or
messages wait for buses and the first is not, the design of the search stays, which may depend on its way.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.linear import EXACT_LIMIT, set_domain
from dse.search.regions import Bound
from dse.search.solver.settings import BRIEF, SolverSettings, ways_to_any
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished
from dse.space.model.space import Design


@dataclass
class InOrder:
    """Statistics of depth-first searches in the order of the file, by solver settings.

    Counts misses and successes and the work of each setting, to choose the setting for the next point.
    """

    missed: Counter[SolverSettings] = field(default_factory=Counter)  # how often in a row
    found: Counter[SolverSettings] = field(default_factory=Counter)
    spent: dict[SolverSettings, float] = field(default_factory=dict)  # work, in vain or not

    def elsewhere(self) -> InOrder:
        """The statistics that also hold for distant points: the cost of designs, and the failed relaxations.

        A copy with the costs, and with the misses of settings that have a linear relaxation.
        """
        missed = Counter({settings: times for settings, times in self.missed.items() if settings.linearization_level})
        return InOrder(missed, self.found.copy(), self.spent.copy())

    def first(self, strategy: Strategy, *, to_the_end: bool) -> Answer:
        """The first solution in the order of the model's decision strategy; unfinished when that takes too long.

        The strategy is followed strictly (fixed search), linear relaxation only refutes branches; `to_the_end` tries
        longer. The settings with which a design has cost least come first; those that missed too often in a row are not
        tried any more.
        """
        attempts = list(strategy.tuning.first_designs.ways_to_the_end) if to_the_end else self._promising(strategy)
        strategy.calls += bool(attempts)
        for settings, work in attempts:
            before = strategy.work
            answer = strategy.run(settings, work)
            self.spent[settings] = self.spent.get(settings, 0.0) + strategy.work - before
            if not isinstance(answer, Unfinished):
                self.found[settings] += 1
                self.missed[settings] = 0
                return answer
            self.missed[settings] += 1
        return Unfinished()

    def _promising(self, strategy: Strategy) -> list[tuple[SolverSettings, float]]:
        """Settings and work of the attempts that are worth it."""
        tuning = strategy.tuning.first_designs
        is_large = len(strategy.encoded.model.proto.variables) > tuning.few_variables
        attempts = [
            (settings, work)
            for settings, work, most_missed in tuning.ways
            if self.missed[settings] < most_missed and not (is_large and settings.linearization_level)
        ]
        return sorted(attempts, key=self._price)

    def _price(self, attempt: tuple[SolverSettings, float]) -> float:
        """The work that a design has taken with some settings, as if they had found one for all their work before."""
        settings, work = attempt
        return (self.spent.get(settings, 0.0) + work) / (self.found[settings] + 1)


def canonical_design(
    strategy: Strategy, known: Found, near: Design | None, order: InOrder, *, strictly: bool = False
) -> tuple[Design, bool] | None:
    """A design with the point of a known one, and whether it is the first of them; None when stopped.

    The model is left as it was.

    `near` is the canonical design of another point, to start from, `order` how it went with those before. `strictly`
    the lexicographically smallest, inactive before every option, however long it takes; for models that the search has
    changed.
    """
    first = strategy.parts.first(known.point)
    if first is not None:
        return first, True
    contention = strategy.encoded.contention
    if contention is None:
        return _canonical(strategy, known, near, order, strictly=strictly)
    contention.seek_first(patient=strictly)
    try:
        canonical = _canonical(strategy, known, near, order, strictly=strictly)
        return None if canonical is None else (canonical[0], canonical[1] and contention.is_first)
    finally:
        contention.seek_any()


def _canonical(
    strategy: Strategy, known: Found, near: Design | None, order: InOrder, *, strictly: bool
) -> tuple[Design, bool] | None:
    model = strategy.encoded.model
    strategy.set_point(known.point)
    model.clear_objective()
    model.clear_hints()
    answer = order.first(strategy, to_the_end=strictly)
    if isinstance(answer, Found):
        return answer.design, True
    if strictly:
        by_digits = _by_digits(strategy, known)
        return None if by_digits is None else (by_digits, True)
    if strategy.encoded.has_messages:
        return None  # another way to it would learn again what the search has learnt
    if strategy.encoded.contention is not None:
        strategy.encoded.contention.seek_any()
    strategy.hint(near)
    answer = any_solution(strategy, known.point)
    return (answer.design, False) if isinstance(answer, Found) else None


def any_solution(strategy: Strategy, point: Bound) -> Answer:
    """A solution with the point that `Call.set_point` fixed, the same one whatever was asked before.

    What is hard as a whole is asked part by part, in their order; those proved not to have it are left out.
    """
    strategy.calls += 1
    answer = strategy.run(*BRIEF)
    if not isinstance(answer, Unfinished):
        return answer
    attempts = ways_to_any(waits=strategy.encoded.is_loose, shares=strategy.encoded.contention is not None)
    region = tuple(value + 1 for value in point)
    for part in strategy.parts.all:
        if part.open([region]):
            for attempt in attempts if len(strategy.parts) > 1 else attempts[1:]:
                answer = strategy.run_within(part, *attempt)
                if isinstance(answer, Found) or strategy.out_of_time():
                    return answer
                if isinstance(answer, NoSuchDesign):
                    break
    return NoSuchDesign()


def _by_digits(strategy: Strategy, known: Found) -> Design | None:
    """The first design of a point by minimising options as digits of numbers, where depth-first search is too slow.

    Several decisions go to a call as far as the number stays exact.
    """
    encoded, model = strategy.encoded, strategy.encoded.model
    restore: list[int] = []
    design = known.design
    try:
        for digits in _chunks(strategy):
            strategy.set_point(known.point)
            model.clear_objective()
            model.minimize(sum(_digit(strategy, index) * weight for index, weight in digits))
            strategy.hint(design)
            answer = strategy.ask()
            if not isinstance(answer, Found):
                return None
            design = answer.design
            restore += _fix(strategy, design, [index for index, _ in digits])
    finally:
        for variable in restore:
            set_domain(encoded.model.proto.variables[variable], 0, 1)
    return design


def _open(strategy: Strategy) -> list[int]:
    return [index for index, literals in enumerate(strategy.encoded.options) if len(literals) > 1]


def _base(strategy: Strategy, index: int) -> int:
    return len(strategy.encoded.options[index]) + (strategy.encoded.inactive[index] is not None)


def _chunks(strategy: Strategy) -> list[list[tuple[int, int]]]:
    """The open decisions in order, cut into groups whose digits make an exact number; with their place values."""
    groups: list[list[int]] = [[]]
    size = 1
    for index in _open(strategy):
        if size * _base(strategy, index) >= EXACT_LIMIT >> 4:
            groups.append([])
            size = 1
        groups[-1].append(index)
        size *= _base(strategy, index)
    chunks = []
    for group in groups:
        weight, digits = 1, []
        for index in reversed(group):
            digits.append((index, weight))
            weight *= _base(strategy, index)
        if digits:
            chunks.append(digits[::-1])
    return chunks


def _digit(strategy: Strategy, index: int) -> Any:
    """The option's number as an expression: 0 for inactive where that is possible."""
    literals = strategy.encoded.options[index]
    shift = strategy.encoded.inactive[index] is not None
    return cp_model.LinearExpr.weighted_sum(list(literals), [number + shift for number in range(len(literals))])


def _fix(strategy: Strategy, design: Design, indices: list[int]) -> list[int]:
    """Fix decisions at the design's options; returns the variables to set free again."""
    fixed = []
    for index in indices:
        inactive = strategy.encoded.inactive[index]
        pairs = [(literal, number == design[index]) for number, literal in enumerate(strategy.encoded.options[index])]
        if inactive is not None:
            pairs.append((inactive, design[index] < 0))
        for literal, value in pairs:
            variable = strategy.encoded.model.proto.variables[literal.index]
            if list(variable.domain) == [0, 1]:
                set_domain(variable, int(value), int(value))
                fixed.append(literal.index)
    return fixed
