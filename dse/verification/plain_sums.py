"""Questions about plain sums: every figure adds up what the decisions contribute one by one, and nothing else counts.

Then a region is refuted by the relaxation of its rows, of some thousand values too, where what rows alone propagate has
to count combinations: of a knapsack of 40 items and three values a region takes 5 ms instead of a second. The rows have
a literal for each option and no figure in between, for only so the relaxation is tight.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ortools.sat.python import cp_model

from dse.space.model.space import Design
from dse.verification.reduced import Reduction, Row
from dse.verification.solver_calls import BY_RELAXATION, attempted
from dse.verification.tables import Tables


class PlainSums:
    """The rows of a question as linear constraints over literals of options, to be asked for parts of it."""

    def __init__(self, reduction: Reduction, deadline: float | None) -> None:
        self.reduction, self.deadline = reduction, deadline
        self.model = cp_model.CpModel()
        self.literals = [self._literals(len(options)) for options in reduction.tables.allowed]
        for row in reduction.rows:
            self._add(self.model, row)

    def is_refuted(
        self,
        limit: float,
        below: Sequence[int | None],
        from_on: Sequence[int | None] | None = None,
        other_than: Design | None = None,
    ) -> bool:
        """Whether it is proved within `limit` of deterministic time that a region holds no design `other_than` one.

        Bounds are exclusive above and inclusive below, in counting units; True is a proof, False says nothing.
        """
        model = self.model.clone()
        for row in self.reduction.rows_in(below, from_on):
            self._add(model, row)
        if other_than is not None:
            chosen = zip(self.literals, self.reduction.tables.allowed, other_than, strict=True)
            alike = [literals[options.index(option)] for literals, options, option in chosen if option in options]
            model.add(sum(alike) <= len(other_than) - 1)
        status, _ = attempted(model, self.deadline, limit, ways=BY_RELAXATION)
        return bool(status == cp_model.INFEASIBLE)

    def _literals(self, count: int) -> list[Any]:
        """A literal for each option of a decision; of two the second is the contrary of the first."""
        if count == 1:
            return [1]
        first = [self.model.new_bool_var("") for _ in range(count if count > 2 else 1)]
        if count == 2:
            return [first[0], ~first[0]]
        self.model.add_exactly_one(first)
        return first

    def _add(self, model: cp_model.CpModel, row: Row) -> None:
        """Demand that a row holds."""
        pairs = (pair for at, values in row.alone.items() for pair in zip(values, self.literals[at], strict=True))
        model.add(row.constant + sum(value * literal for value, literal in pairs) <= row.most)


def plain_sums(reduction: Reduction, deadline: float | None) -> PlainSums | None:
    """The question of plain sums, where a question is one; else None."""
    tables = reduction.tables
    every = [0] * len(tables.objectives)
    rows = [*reduction.rows, *reduction.rows_in(every, every)]
    is_one = _has_sums_only(tables) and not any(row.deep for row in rows)
    return PlainSums(reduction, deadline) if is_one else None


def _has_sums_only(tables: Tables) -> bool:
    """Whether every decision is in use, and neither cores, waiting, messages nor extremes are in the question."""
    sums = [*(bound.sum for bound in tables.bounds), *(total for total, _ in tables.objectives)]
    scheduled = tables.cores or tables.late or tables.messages or tables.waits is not None
    return not scheduled and all(met is None for met in tables.met) and not any(item.extremes for item in sums)
