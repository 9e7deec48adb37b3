"""Arrays of designs evaluated at once: objectives, feasibility, and how far each limit is exceeded.

Nothing is computed here that is not tabulated from the formulas of the analysis (`dse.analysis.views.tabulate`): a
formula becomes an array over the decisions that it consults, or a tree of them where that array would be large; a
measure is a sum of such tables. Sums are exact: int64 where they fit, Python integers where they do not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import ceil, floor, lcm, prod
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit, keeps_cores
from dse.analysis.measures import Measure, Term
from dse.analysis.memo import Recall
from dse.analysis.rates import rate_hz
from dse.analysis.validity import is_broken
from dse.analysis.views import Case, View, tabulate
from dse.space.model.space import EMPTY, Space

Columns: TypeAlias = npt.NDArray[np.int64]
"""Designs by column: one row for each decision, contiguous."""
Numbers: TypeAlias = npt.NDArray[Any]
"""int64, or Python integers (dtype object) where these could overflow."""
Flags: TypeAlias = npt.NDArray[np.bool_]

CASE_LIMIT = 200_000
DENSE_LIMIT = 4096
"""Tables with more entries than this are walked as trees."""
INT64_LIMIT = 2**62
CHUNK = 65_536


@dataclass(frozen=True)
class Dense:
    """A value for each combination of options of `decisions`."""

    decisions: tuple[int, ...]
    values: Numbers

    def look_up(self, columns: Columns) -> Numbers:
        """The value of each design."""
        place = np.zeros(columns.shape[1], dtype=np.int64)
        for decision, count in zip(self.decisions, self.values.shape, strict=True):
            place *= count
            place += columns[decision]
        return self.values.reshape(-1)[place]


@dataclass(frozen=True)
class Walk:
    """A tree of decisions: node k asks `asks[k]` and goes on to `branches[first[k] + option]`.

    Where `asks[k]` is -1, it is a leaf with `values[k]`.
    """

    asks: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    branches: npt.NDArray[np.int64]
    values: Numbers

    def look_up(self, columns: Columns) -> Numbers:
        """The value of each design."""
        node = np.zeros(columns.shape[1], dtype=np.int64)
        rows = np.arange(columns.shape[1])
        while rows.size:
            asked = self.asks[node[rows]]
            rows = rows[asked >= 0]
            here = node[rows]
            node[rows] = self.branches[self.first[here] + columns[self.asks[here], rows]]
        return self.values[node]


Lookup: TypeAlias = Dense | Walk


@dataclass(frozen=True)
class Sum:
    """A sum of tables, with its bounds."""

    tables: tuple[Lookup, ...]
    dtype: Any

    def look_up(self, columns: Columns) -> Numbers:
        """The sum for each design."""
        total: Numbers = np.zeros(columns.shape[1], dtype=self.dtype)
        for table in self.tables:
            total += table.look_up(columns)
        return total


@dataclass(frozen=True)
class Bound:
    """A limit in integers: least <= value <= most, or for ``!=`` the value `other_than`; tables by design."""

    value: Sum
    least: Lookup | None
    most: Lookup | None
    other_than: Lookup | None = None

    def excess(self, columns: Columns) -> Numbers:
        """How far beyond the limit each design is; 0 where it holds."""
        value = self.value.look_up(columns)
        beyond: Numbers = np.zeros(columns.shape[1], dtype=value.dtype)
        if self.most is not None:
            beyond = np.maximum(beyond, value - self.most.look_up(columns))
        if self.least is not None:
            beyond = np.maximum(beyond, self.least.look_up(columns) - value)
        if self.other_than is not None:
            beyond = np.maximum(beyond, (value == self.other_than.look_up(columns)).astype(value.dtype))
        return beyond


@dataclass(frozen=True)
class Batch:
    """What a batch of designs amounts to, row by row.

    `objectives` (n, objectives) are the evaluator's integers, in the objectives' own sense; they mean nothing where
    `is_valid` is false. `excess` (n, limits) says how far each limit is exceeded, in units of its own: 0 where it
    holds. The columns are the requirements in order; one on utilisation is followed by one for each thread on one core.
    At the end stands one for each of these: 1 where only the fullest core is beyond it.
    """

    objectives: Numbers
    is_valid: Flags
    excess: Numbers

    @property
    def is_feasible(self) -> Flags:
        """Valid, and every requirement holds."""
        holds: Flags = self.is_valid & ~np.any(self.excess > 0, axis=1)
        return holds


class VectorisedEvaluator:
    """The tables of a space, built once; equal to `Evaluator.evaluate` design by design.

    Parameters
    ----------
    evaluator
        whose measures, limits and rules are tabulated. Decisions that its space fixes must be kept by the designs.

    Raises
    ------
    OverflowError
        when a formula depends on more combinations of options than can be tabulated.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self.space = evaluator.space
        self.objectives = tuple(_objective(self.space, measure) for measure in evaluator.objectives)
        self.limits = tuple(bound for limit in evaluator.limits for bound in _bounds(self.space, limit))
        self.spread = tuple(limit for limit in evaluator.limits if limit.cores is not None)
        self._fits: Recall[bool] = Recall()
        self._holds = tuple(_validity(evaluator))
        self._covers = tuple(_covers(evaluator))

    def evaluate(self, designs: npt.ArrayLike) -> Batch:
        """The figures of designs.

        Parameters
        ----------
        designs
            shape (n, decisions): option numbers; decisions that a design does not use may hold any option, or -1.
        """
        rows = np.asarray(designs, dtype=np.int64)
        if rows.ndim != 2 or rows.shape[1] != len(self.space.decisions):
            raise ValueError(f"expected shape (n, {len(self.space.decisions)}), got {rows.shape}")
        parts = [self._evaluate(rows[start : start + CHUNK]) for start in range(0, len(rows), CHUNK)]
        parts = parts or [self._evaluate(rows)]
        return Batch(
            np.concatenate([part.objectives for part in parts]),
            np.concatenate([part.is_valid for part in parts]),
            np.concatenate([part.excess for part in parts]),
        )

    def _evaluate(self, rows: npt.NDArray[np.int64]) -> Batch:
        columns = np.ascontiguousarray(np.maximum(rows, 0).T)
        valid: Flags = np.ones(len(rows), dtype=np.bool_)
        for table in self._holds:
            valid &= table.look_up(columns)
        for users in self._covers:
            used: Flags = np.zeros(len(rows), dtype=np.bool_)
            for table in users:
                used |= table.look_up(columns)
            valid &= used
        excess = [bound.excess(columns) for bound in self.limits]
        kept = np.logical_and.reduce([valid, *(item <= 0 for item in excess)])
        excess += [self._beyond_cores(number, columns, kept) for number in range(len(self.spread))]
        objectives = _stack([total.look_up(columns) for total in self.objectives], len(rows))
        return Batch(objectives, valid, _stack(excess, len(rows)))

    def _beyond_cores(self, number: int, columns: Columns, kept: Flags) -> Numbers:
        """1 where the fullest core is beyond a limit; looked at one by one, where everything else is kept.

        Designs that agree in all that it depends on share one answer.
        """
        beyond = np.zeros(columns.shape[1], dtype=np.int64)
        for row in np.flatnonzero(kept):
            view = View([int(option) for option in columns[:, row]])
            beyond[row] = not self._fits.recall(self.space, number, view, self._keeps_cores)
        return beyond

    def _keeps_cores(self, _: Space, number: int, view: View) -> bool:
        return keeps_cores(self.spread[number], view)


def _stack(columns: Sequence[Numbers], count: int) -> Numbers:
    return np.stack(columns, axis=1) if columns else np.zeros((count, 0), dtype=np.int64)


def _validity(evaluator: Evaluator) -> Iterable[Lookup]:
    """Structure and rules, and acyclic activation: what must hold in every design."""
    space = evaluator.space
    formulas: list[Callable[[View], bool]] = [predicate.holds for predicate in evaluator.rulebook.predicates]
    formulas += [partial(_is_kept, rule) for rule in space.rules]
    formulas += [partial(_has_rate, space, number) for number in range(len(space.components))]
    tables = [_flags(space, formula) for formula in formulas]
    return _merged(space, [table for table in tables if not _is_always_true(table)], np.logical_and)


def _is_always_true(table: Lookup) -> bool:
    if isinstance(table, Walk):
        return bool(np.all(table.values[2:] | (table.asks[2:] >= 0)) and np.all(table.branches != 1))
    return bool(np.all(table.values))


def _is_kept(rule: Any, view: View) -> bool:
    return not is_broken(rule, view)


def _has_rate(space: Space, number: int, view: View) -> bool:
    """Tabulation leaves out the cases in which this raises: cycles, and options that are not offered."""
    rate_hz(space, ("activation", number), view)
    return True


def _covers(evaluator: Evaluator) -> Iterable[tuple[Lookup, ...]]:
    """A filled optional slot has a user: for each slot, tables of which one must be true."""
    for cover in evaluator.rulebook.covers:
        slot, empty = cover.slot, cover.slot.types.index(EMPTY)
        formulas: list[Callable[[View], bool]] = [partial(_is_empty, slot.type_decision, empty), *cover.users]
        yield tuple(_flags(evaluator.space, formula) for formula in formulas)


def _is_empty(decision: int, empty: int, view: View) -> bool:
    return view[decision] == empty


def _cases(space: Space, formula: Callable[[View], Any]) -> list[Case[Any]]:
    cases = tabulate(space, formula, CASE_LIMIT)
    if cases is None:
        raise OverflowError("a figure depends on more combinations of options than can be tabulated")
    return cases


def _flags(space: Space, formula: Callable[[View], bool]) -> Lookup:
    return _table(space, [Case(case.conditions, bool(case.value)) for case in _cases(space, formula)], np.bool_)


def _objective(space: Space, measure: Measure) -> Sum:
    """In units of 1 / scale; a rounded measure rounds each term up, as `Measure.integer` does."""
    listed = [_cases(space, term.value) for term in measure.terms]
    return _sum(space, [[Case(c.conditions, ceil(c.value * measure.scale)) for c in cases] for cases in listed])


def _bounds(space: Space, limit: Limit) -> Iterable[Bound]:
    operator = limit.requirement.operator
    yield _bound(space, limit.measure.terms, limit.bound, operator)
    for terms in limit.alone.values():
        yield _bound(space, terms, lambda view: limit.cores and limit.cores.most, operator)


def _bound(space: Space, terms: Sequence[Term], bound: Callable[[View], Any], operator: str) -> Bound:
    """The comparison in integers: values over their common denominator, the limit rounded inwards, which is exact."""
    listed = [_cases(space, term.value) for term in terms]
    limits = _cases(space, bound)
    scale = lcm(*(Fraction(case.value).denominator for cases in listed for case in cases))
    value = _sum(space, [[Case(c.conditions, int(c.value * scale)) for c in cases] for cases in listed])

    def rounded(towards: Callable[[Fraction], int]) -> Lookup:
        pairs = [Case(case.conditions, towards(case.value * scale)) for case in limits]
        return _table(space, pairs, _dtype(pairs))

    if operator == "!=":  # a limit between two integers is met by none
        whole = [Case(c.conditions, c.value * scale) for c in limits]
        missed = [Case(c.conditions, int(c.value) if c.value == int(c.value) else -INT64_LIMIT) for c in whole]
        return Bound(value, None, None, _table(space, missed, _dtype(missed)))
    least = {">=": ceil, ">": lambda item: floor(item) + 1, "==": ceil}.get(operator)
    most = {"<=": floor, "<": lambda item: ceil(item) - 1, "==": floor}.get(operator)
    return Bound(value, None if least is None else rounded(least), None if most is None else rounded(most))


def _dtype(cases: Iterable[Case[int]], others: int = 0) -> Any:
    return np.int64 if others + max((abs(case.value) for case in cases), default=0) < INT64_LIMIT else object


def _sum(space: Space, listed: Sequence[list[Case[int]]]) -> Sum:
    """Tables of terms, those over few decisions added up beforehand."""
    most = sum(max((abs(case.value) for case in cases), default=0) for cases in listed)
    dtype: Any = np.int64 if most < INT64_LIMIT else object
    tables = [_table(space, cases, dtype) for cases in listed]
    return Sum(tuple(_merged(space, tables, np.add)), dtype)


def _merged(space: Space, tables: Iterable[Lookup], combine: Callable[[Any, Any], Any]) -> list[Lookup]:
    """Fewer tables with the same total: dense ones join where the joint table stays small."""
    walks: list[Lookup] = []
    dense: list[Dense] = []
    for table in sorted(tables, key=_extent, reverse=True):
        if isinstance(table, Walk):
            walks.append(table)
            continue
        for place, host in enumerate(dense):
            joint = tuple(sorted({*host.decisions, *table.decisions}))
            size = prod(len(space.decisions[item].options) for item in joint)
            if joint == host.decisions or size <= DENSE_LIMIT // 4:
                joined = combine(_spread(space, host, joint), _spread(space, table, joint))
                dense[place] = Dense(joint, np.asarray(joined, dtype=host.values.dtype))  # a figure alone is an array
                break
        else:
            dense.append(table)
    return [*dense, *walks]


def _extent(table: Lookup) -> int:
    return len(table.decisions) if isinstance(table, Dense) else 0


def _spread(space: Space, table: Dense, joint: tuple[int, ...]) -> Numbers:
    """The values of a table over more decisions."""
    shape = [len(space.decisions[item].options) if item in table.decisions else 1 for item in joint]
    return np.broadcast_to(table.values.reshape(shape), [len(space.decisions[item].options) for item in joint])


def _table(space: Space, cases: Sequence[Case[Any]], dtype: Any) -> Lookup:
    """Cases as an array, or as a tree; 0 or False where there is no case: the design is not valid there."""
    decisions = tuple(sorted({decision for case in cases for decision, _ in case.conditions}))
    shape = [len(space.decisions[decision].options) for decision in decisions]
    if prod(shape) > DENSE_LIMIT:
        return _walk(space, cases, dtype)
    values = np.zeros(shape, dtype=dtype)
    place = {decision: axis for axis, decision in enumerate(decisions)}
    for case in cases:
        index: list[Any] = [slice(None)] * len(decisions)
        for decision, option in case.conditions:
            index[place[decision]] = option
        values[tuple(index)] = case.value
    return Dense(decisions, values)


def _walk(space: Space, cases: Sequence[Case[Any]], dtype: Any) -> Walk:
    """Cases list their conditions in the order in which the formula asked, so they are the paths of a tree."""
    asks, first, values = [-1, -1], [0, 0], [0, 0]  # node 0 is the root, node 1 where there is no case
    branches: list[int] = []
    for case in cases:
        node = 0
        for decision, option in case.conditions:
            if asks[node] < 0:
                asks[node], first[node] = decision, len(branches)
                branches += [1] * len(space.decisions[decision].options)
            if branches[first[node] + option] == 1:
                branches[first[node] + option] = len(asks)
                asks.append(-1)
                first.append(0)
                values.append(0)
            node = branches[first[node] + option]
        values[node] = case.value
    return Walk(np.array(asks), np.array(first), np.array(branches, dtype=np.int64), np.array(values, dtype=dtype))
