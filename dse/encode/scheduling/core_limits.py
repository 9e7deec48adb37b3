"""Limits of each core of a processor: what the search's model knows of them, and what it learns.

Sums over threads whose core is stated are rows of the model from the start (`dse.encode.requirements`). What depends on
where the others run is left to the referee, who finds a partition for nearly every design that keeps the sum and each
thread. Where a design proves to have none, the model gets a clause: not these threads there, at these rates, as many of
them as it takes (`dse.analysis.limits.too_many`). Where it has to learn that again and again, or cores are decisions,
it gets rows for the processor:

    x[t, k]: thread t runs on core k        sum over k of x[t, k] = 1
    w[t] >= use of t                        for each case of its table
    y[t, k] >= w[t] - most[t] * (1 - x[t, k])
    sum over k of y[t, k] >= w[t]
    sum over t of y[t, k] <= limit          for each core k
    x[t, k] = 0                             for each thread t but the first k - 1, where all may have any core:
                                            equal cores are numbered as their first threads stand in the file

The use is rounded down where it has no common unit, so that no design is lost; what the referee refuses then is
excluded by the options that it looked at.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import floor
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.limits import Limit, keeps_cores, too_many
from dse.analysis.measures import Term
from dse.analysis.memo import Recall, consulted
from dse.analysis.views import Case, View, tabulate
from dse.encode.linear import Board, greatest
from dse.encode.literals import Chosen, literal_of
from dse.encode.search_order import strategy_of_places
from dse.encode.tuning import CoreLimitClauses
from dse.space.core_symmetry import interchangeable_cores
from dse.space.model.space import Design, Space
from dse.space.model.trees import Choice, Tree, at, leaves

SHARED = 256
"""The number of verdicts on a processor that are shared by the designs that agree in what it carries."""
MOST_CASES = 2_000
"""A thread whose use depends on more combinations of options has no rows."""


@dataclass(frozen=True)
class CoreLimit:
    """An upper limit on every core of a processor; it holds while the literal `guard` (an index) is true."""

    limit: Limit
    guard: int | None = None


class CoreLimits:
    """The limits on cores of one model, and what has been added to it for their sake."""

    def __init__(
        self,
        space: Space,
        model: cp_model.CpModel,
        literals: Chosen,
        limits: Sequence[CoreLimit],
        tuning: CoreLimitClauses,
    ) -> None:
        self.space, self.model, self.literals, self.limits = space, model, literals, limits
        self.tuning = tuning
        self.known: set[int] = set()
        self.tables: dict[tuple[int, str], list[Case[int]] | None] = {}
        """What each thread uses, by limit and name, as its options are; with every copy."""
        self.places: list[tuple[int, list[int]]] = []
        """Of each thread in the rows its greatest use, and the variables of its cores."""
        self.clauses: Counter[int] = Counter()
        """How many designs were forbidden, by limit."""
        self._packing: tuple[int, Any] = (0, None)
        self._kept: Recall[bool] = Recall(SHARED)

    def copy(self, model: cp_model.CpModel) -> CoreLimits:
        """The limits of each core for a copy of the model, with the rows that this one has."""
        other = CoreLimits(self.space, model, self.literals, self.limits, self.tuning)
        other.known, other.places = set(self.known), list(self.places)
        other.tables, other._kept, other.clauses = self.tables, self._kept, Counter(self.clauses)
        return other

    def packing(self) -> list[Any]:
        """The strategy that packs the cores once the options are chosen; none where the model has no rows."""
        if self._packing[0] < len(self.places):
            self._packing = len(self.places), strategy_of_places(self.model, self.places)
        return [self._packing[1]] if self.places else []

    def settled(self, design: Design, is_true: Callable[[cp_model.IntVar], bool], *, is_best: bool = True) -> bool:
        """Whether every core keeps its limits in a design; where one does not, the model has learnt from it.

        From a design that is not the best of its model, which may never come again, nothing new is learnt.
        """
        view, is_kept = View(design), True
        for number, item in enumerate(self.limits):
            if item.guard is not None and not is_true(self._literal(item.guard)):
                continue
            if self._kept.recall(self.space, number, view, self._keeps):
                continue
            is_kept = False
            if number in self.known:
                self._forbid(number, design)
            elif is_best:
                rows = _Rows(self, number, item)
                if rows.is_free and self.tuning.is_on and self.clauses[number] < self.tuning.most:
                    self._forbid(number, design)
                else:
                    self.known.add(number)
                    rows.add()
        return is_kept

    def _keeps(self, _: Space, number: int, view: View) -> bool:
        return keeps_cores(self.limits[number].limit, view)

    def _forbid(self, number: int, design: Design) -> None:
        """Not the options that the referee looks at where there are but the threads that are too many, all together."""
        self.clauses[number] += 1
        item = self.limits[number]
        beyond = too_many(item.limit, View(design))
        _, asked = consulted(View(design), lambda view: keeps_cores(item.limit, view, beyond))
        clause = [self.literals.literal(decision, option) for decision, option in asked.items()]
        clause += [] if item.guard is None else [item.guard]
        self.model.add_bool_or([self._literal(index).negated() for index in clause])

    def _literal(self, index: int) -> Any:
        return literal_of(self.model, index)


class _Rows:
    """The rows of one limit."""

    def __init__(self, owner: CoreLimits, number: int, item: CoreLimit) -> None:
        assert item.limit.cores is not None
        self.cores, self.number = item.limit.cores, number
        self.owner, self.model, self.literals = owner, owner.model, owner.literals
        self.space, self.processor = self.cores.space, self.cores.processor
        self.limit, self.guard = item.limit, item.guard
        self.count = max([1, *leaves(self.space.processors[self.processor].cores)])
        self.scale = item.limit.measure.scale
        self.free = 0
        here = [item for item in self.space.components if self.processor in set(leaves(item.processor))]
        self.is_free = all(item.core is None for item in here)  # no core is stated or decided
        self.is_alike = self.is_free and len(interchangeable_cores(self.space, self.processor, by_rule=False)) == 1

    def add(self) -> None:
        """Every core's sum is within the limit; a thread with too many cases is left out, which loses no design."""
        room = greatest(strict=self.cores.is_strict)(self.cores.most * self.scale)
        columns: list[list[Any]] = [[] for _ in range(self.count)]
        numbers = {item.name: number for number, item in enumerate(self.space.components)}
        for name, terms in self.limit.alone.items():
            for core, share in enumerate(self._shares(numbers[name], terms)):
                columns[core].append(share)
        held = [] if self.guard is None else [self.owner._literal(self.guard)]
        for column in columns:
            self.model.add(sum(column) <= room).only_enforce_if(held)

    def _shares(self, number: int, terms: Sequence[Term]) -> list[Any]:
        """What a thread uses of each core, as variables."""

        def use(view: View) -> int:
            if at(self.space.components[number].processor, view) != self.processor:
                return 0
            return floor(sum((term.value(view) for term in terms), Fraction(0)) * self.scale)

        tables, key = self.owner.tables, (self.number, self.space.components[number].name)
        if key not in tables:
            tables[key] = tabulate(self.space, use, MOST_CASES)
        cases = tables[key]
        most = max((case.value for case in cases or ()), default=0)
        if cases is None or not most:
            return []
        whole = self.model.new_int_var(0, most, "")
        for case in cases:
            if case.value:
                self.model.add(whole >= case.value).only_enforce_if(self._all(case.conditions))
        shares, places = [], self._places(number)
        self.owner.places.append((most, [place.index for place in places if isinstance(place, cp_model.IntVar)]))
        for place in places:
            share = self.model.new_int_var(0, most, "")
            self.model.add(share >= whole - most * (1 - place))
            shares.append(share)
        self.model.add(sum(shares) >= whole)
        return shares

    def _all(self, conditions: Sequence[tuple[int, int]]) -> list[Any]:
        return [self.owner._literal(self.literals.literal(decision, option)) for decision, option in conditions]

    def _places(self, number: int) -> list[Any]:
        """For each core whether the thread runs there: as stated, as decided, or as the model likes."""
        tree = self.space.components[number].core
        if isinstance(tree, int):
            return [int(core + 1 == tree) for core in range(self.count)]
        items = [one for one in self.space.open_cores if number in one.threads]
        if isinstance(tree, Choice) and any(tree.decision == one.index for one in items):
            chosen = dict(zip(tree.branches, self.literals.options[tree.decision], strict=True))
            return [self.owner._literal(chosen[core]) if core in chosen else 0 for core in range(1, self.count + 1)]
        if tree is not None:
            return self._decided(tree)
        return self._free(items[0].decision.values if items else range(1, self.count + 1))

    def _decided(self, tree: Tree) -> list[Any]:
        """Places by the options that a thread's core hangs on, such as its executor; any where these are too many."""
        places = [self.model.new_bool_var("") for _ in range(self.count)]
        self.model.add_exactly_one(places)
        for case in tabulate(self.space, lambda view: at(tree, view), MOST_CASES) or ():
            if case.value is not None and case.value <= self.count:
                self.model.add_bool_or([places[case.value - 1], *(one.negated() for one in self._all(case.conditions))])
        return places

    def _free(self, values: Collection[int]) -> list[Any]:
        """Places as the model likes: equal cores are numbered as the first that use them stand in the file.

        None where a type has none of the cores that the thread may have: it runs elsewhere, or on the only one.
        """
        places = [self.model.new_bool_var("") for _ in range(self.count)]
        self.model.add_at_most_one(places)
        self.free += 1
        for place in places[self.free :] if self.is_alike else ():
            self.model.add(place == 0)
        for core, place in enumerate(places, start=1):
            if core not in values:
                self.model.add(place == 0)
        for case in tabulate(self.space, partial(_cores, self.space, self.processor), MOST_CASES) or ():
            elsewhere = [one.negated() for one in self._all(case.conditions)]
            for place in places[case.value :]:
                self.model.add_bool_or([place.negated(), *elsewhere])
            if any(core <= case.value for core in values):
                self.model.add_bool_or([*places, *elsewhere])
        return places


def _cores(space: Space, processor: int, view: View) -> int:
    return max(1, int(at(space.processors[processor].cores, view)))


def core_limits_of(board: Board) -> CoreLimits | None:
    """The `CoreLimits` of a board's model, made on first use and shared by all questions; None without limits."""
    if not board.core_limits:
        return None
    if board.cores is None:
        chosen = Chosen.of_model(board.options, board.inactive)
        board.cores = CoreLimits(board.space, board.model, chosen, board.core_limits, board.tuning.core_limit_clauses)
    found: CoreLimits = board.cores
    return found
