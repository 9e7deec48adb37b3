"""Which values a weighted sum of objectives can have at all in a part of the space: every so manieth one.

With the types of the processors given, a latency grows in steps of the periods' common divisor, though over all types
together any nanosecond may occur. A bound between two steps is as good as the next of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from math import gcd

from dse.encode.model import EncodedObjective


@dataclass(frozen=True)
class Grid:
    """The values `start` + k * `step` for every whole k; with a step of 0 there is one only.

    >>> grid = Grid(3, 5)
    >>> grid.up(9), grid.down(12), Grid(3, 0).up(1), Grid(3, 0).down(9)
    (13, 8, 3, 3)
    """

    start: int
    step: int

    def up(self, value: int) -> int:
        """The least value of the grid that is no less; beyond the only one the value itself.

        A grid without a step has the single value `start`.
        """
        if self.step:
            return value + (self.start - value) % self.step
        return max(value, self.start)

    def down(self, value: int) -> int:
        """The greatest value of the grid that is no more; below the only one the value itself.

        A grid without a step has the single value `start`.
        """
        if self.step:
            return value - (value - self.start) % self.step
        return min(value, self.start)


EVERY = Grid(0, 1)
"""Every whole number."""


def grids_of(
    objectives: Iterable[EncodedObjective], literals: Collection[int], others: Collection[int]
) -> tuple[Grid, ...]:
    """The values of each objective where all these `literals` are true, and none of the `others`.

    One `Grid` for each objective: the start and the greatest common divisor of what the open literals can add.
    """
    held, grids = frozenset(literals), []
    for objective in objectives:
        grid = EVERY
        for chosen, constant, coefficients in objective.branches:
            if chosen <= held:
                start = constant + sum(coefficients.get(index, 0) for index in held)
                left = (number for index, number in coefficients.items() if index not in held and index not in others)
                grid = Grid(start, gcd(*left))
                break
        grids.append(grid)
    return tuple(grids)


def weighted_grid(grids: Sequence[Grid], weights: Sequence[int]) -> Grid:
    """The values of the sum of weight * objective.

    >>> weighted_grid([Grid(1, 4), Grid(0, 6)], [10, 1])
    Grid(start=10, step=2)
    """
    pairs = [(grid, weight) for grid, weight in zip(grids, weights, strict=True) if weight]
    return Grid(
        sum(weight * grid.start for grid, weight in pairs), gcd(*(weight * grid.step for grid, weight in pairs))
    )
