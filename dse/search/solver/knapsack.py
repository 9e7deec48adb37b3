"""Two objectives without the limits: a multiple-choice knapsack for each part of a space, by dynamic programming.

With the types of the processors given, both objectives are often plain sums over the decisions. Then the least value of
one for every value of the other follows from a table with a row for each decision (Kellerer, Pferschy and Pisinger,
"Knapsack Problems", 2004, chapter 11; Klamroth and Wiecek, "Dynamic programming approaches to the multiple criteria
knapsack problem", Naval Research Logistics 47, 2000). What limits, rules and validity forbid is left out: the table
bounds what designs can have, and a design of it that the analysis accepts is as good as any (decision record 12).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from dse.analysis.validity import canonical
from dse.encode.model import EncodedObjective, EncodedSpace
from dse.search.regions import Bound
from dse.search.solver.value_grid import Grid, grids_of
from dse.search.tuning import KnapsackTables
from dse.space.model.space import INACTIVE, Design

NO_VALUE = 2**62
"""In a table: no choice has this sum. Values are below 2**53, and at most 2**9 of them are added to it."""

Row: TypeAlias = npt.NDArray[np.int64]
Choices: TypeAlias = tuple[tuple[int, int, int], ...]
"""Of a decision, in the order of the file: the option, what it adds along the table, and what to the value."""


@dataclass(frozen=True)
class Least:
    """The least weighted sum of a table, and the point that has it.

    In solver steps.
    """

    weighted: int
    point: Bound


class Knapsack:
    """The table of one part: `rows[i][k]` is the least value that decisions from i on have where they add up to k.

    Objective `axis` is `grid.start` + `grid.step` * k, the other one `base` + value.
    """

    def __init__(self, axis: int, grid: Grid, base: int, decisions: Sequence[Choices]) -> None:
        self.axis, self.grid, self.base, self.decisions = axis, grid, base, decisions
        size = _states(decisions)
        row = np.full(size, NO_VALUE, dtype=np.int64)
        row[0] = 0
        self.rows = [row]
        for choices in reversed(decisions):
            self.rows.append(_before(self.rows[-1], choices))
        self.rows.reverse()
        reached = np.flatnonzero(self.rows[0] < NO_VALUE)
        self._along = grid.start + grid.step * reached
        self._values = base + self.rows[0][reached]

    def least(self, weights: Sequence[int], region: Bound) -> Least | None:
        """The least weighted sum in a region; None where the table has nothing there.

        `region` is an upper corner in solver steps, exclusive.
        """
        axis = self.axis
        held = (self._along < region[axis]) & (self._values < region[1 - axis])
        if not held.any():
            return None
        along, values = self._along[held], self._values[held]
        sums = weights[axis] * along + weights[1 - axis] * values
        position = int(np.argmin(sums))
        point = int(along[position]), int(values[position])
        return Least(int(sums[position]), point if axis == 0 else point[::-1])

    def value_beside(self, point: Bound) -> int | None:
        """The least value of the other objective where the one along the table is that of a point.

        In solver steps; None where no combination of options has that value.
        """
        steps, left = divmod(point[self.axis] - self.grid.start, self.grid.step or 1)
        if left or not 0 <= steps < len(self.rows[0]) or self.rows[0][steps] >= NO_VALUE:
            return None
        return self.base + int(self.rows[0][steps])

    def designs(self, point: Bound) -> Iterator[Design]:
        """The designs of a point of the table, in the order of the file.

        Depth-first through the rows of the table, so that the first design comes first.
        """
        along = (point[self.axis] - self.grid.start) // (self.grid.step or 1)
        waiting: list[tuple[Design, int, int]] = [((), along, point[1 - self.axis] - self.base)]
        while waiting:
            taken, along, value = waiting.pop()
            if len(taken) == len(self.decisions):
                yield taken
                continue
            row = self.rows[len(taken) + 1]
            for option, step, added in reversed(self.decisions[len(taken)]):
                if step <= along and row[along - step] == value - added:
                    waiting.append(((*taken, option), along - step, value - added))


class Knapsacks:
    """The tables of all parts of a space, in their order.

    One table for each part; answers are designs that the analysis has accepted.
    """

    def __init__(self, encoded: EncodedSpace, tables: Sequence[Knapsack], most_tried: int) -> None:
        assert encoded.space is not None
        self.encoded, self.tables, self._space, self._most_tried = encoded, tables, encoded.space, most_tried

    def design(self, number: int, point: Bound) -> Design | None:
        """A design of a part with a point of its table that the analysis accepts, the first of them in order.

        At most `most_tried` candidates are shown to the analysis; None where none is accepted.
        """
        return next(self._accepted(number, point), None)

    def first(self, point: Bound) -> Design | None:
        """The first design in the order of the file that has a point; None where the tables do not tell.

        Compares the parts by their first design.
        """
        designs: list[Design] = []
        for number, table in enumerate(self.tables):
            value = table.value_beside(point)
            if value is None or value > point[1 - table.axis]:
                continue
            design = self.design(number, point) if value == point[1 - table.axis] else None
            if design is None:
                return None
            designs.append(design)
        return min(designs, default=None)

    def _accepted(self, number: int, point: Bound) -> Iterator[Design]:
        for design in islice(self.tables[number].designs(point), self._most_tried):
            if canonical(self._space, design) == design and self.encoded.weigh(design) == point:
                yield design


def knapsacks_of(encoded: EncodedSpace, parts: Sequence[Sequence[int]], tuning: KnapsackTables) -> Knapsacks | None:
    """The tables of the parts that some literals tell apart.

    None where an objective of a part is no sum over its decisions, or the tables would be too large.
    """
    if not tuning.is_on or len(encoded.objectives) != 2 or encoded.contention is not None or encoded.open_terms:
        return None
    if encoded.space is None or len(encoded.options) > tuning.most_decisions:
        return None
    every = {index for part in parts for index in part}
    made = []
    left = tuning.most_cells
    for part in parts:
        plan = _planned(encoded, part, every)
        if plan is None:
            return None
        left -= _states(plan[3]) * sum(len(choices) > 1 for choices in plan[3])
        if left < 0:
            return None
        made.append(plan)
    return Knapsacks(encoded, [Knapsack(*plan) for plan in made], tuning.most_tried)


def _planned(
    encoded: EncodedSpace, part: Sequence[int], every: set[int]
) -> tuple[int, Grid, int, list[Choices]] | None:
    """The plan of the table of a part; its axis is the objective with fewer values."""
    held = frozenset(part)
    sums = [total for objective in encoded.objectives if (total := _sum_of(objective, held)) is not None]
    decisions = [_options(encoded, decision, held) for decision in range(len(encoded.options))]
    known = {index for pairs in decisions for _, index in pairs}
    if len(sums) < 2 or any(not coefficients.keys() - every <= known for _, coefficients in sums):
        return None
    plans = []
    for axis, grid in enumerate(grids_of(encoded.objectives, part, every.difference(part))):
        start, along = sums[axis]
        base, beside = sums[1 - axis]
        listed: list[Choices] = []
        for pairs in decisions:
            steps = [along.get(index, 0) for _, index in pairs]
            values = [beside.get(index, 0) for _, index in pairs]
            start, base = start + min(steps), base + min(values)
            counts = [(step - min(steps)) // (grid.step or 1) for step in steps]
            options = [option for option, _ in pairs]
            listed.append(tuple(zip(options, counts, (value - min(values) for value in values), strict=True)))
        plans.append((axis, Grid(start, grid.step), base, listed))
    return min(plans, key=lambda plan: _states(plan[3]))


def _sum_of(objective: EncodedObjective, held: frozenset[int]) -> tuple[int, dict[int, int]] | None:
    """The constant and the coefficients of an objective where some literals are true."""
    for chosen, constant, coefficients in objective.branches:
        if chosen <= held:
            return constant, dict(coefficients)
    return None


def _options(encoded: EncodedSpace, decision: int, held: frozenset[int]) -> list[tuple[int, int]]:
    """The options of a decision that a part leaves, with their literals, in the order of the file."""
    unused = encoded.inactive[decision]
    pairs = [] if unused is None else [(INACTIVE, unused.index)]
    pairs += [(option, literal.index) for option, literal in enumerate(encoded.options[decision])]
    taken = [pair for pair in pairs if pair[1] in held]
    fixed = encoded.space.fixed.get(decision) if encoded.space is not None else None
    return taken or [pair for pair in pairs if fixed is None or pair[0] in (fixed, INACTIVE)]


def _states(decisions: Sequence[Choices]) -> int:
    """How many values along the table there are."""
    return 1 + sum(max(step for _, step, _ in choices) for choices in decisions)


def _before(row: Row, choices: Choices) -> Row:
    """The row of a decision, from that of the decisions after it."""
    pairs = {(step, value) for _, step, value in choices}
    if pairs == {(0, 0)}:
        return row
    row_before = np.full_like(row, NO_VALUE)
    for step, value in sorted(pairs):
        shifted = row[: len(row) - step] + value
        np.minimum(row_before[step:], shifted, out=row_before[step:])
    return np.minimum(row_before, NO_VALUE)
