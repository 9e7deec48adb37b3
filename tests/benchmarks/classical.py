"""An exact epsilon-constraint method on plain models of knapsack and assignment problems, as a peer of `dse solve`.

The models are written straight from the numbers of a problem, as a textbook of integer programming has them: a binary
variable for each item, or for each pair of a task and an agent; one row of capacity, or one row for each task and each
agent; each objective a sum. Nothing of our encoder is in them.

The method is that of G. Kirlik and S. Sayin ("A new algorithm for generating all nondominated solutions of
multiobjective discrete optimization problems", EJOR 232, 2014) for any number of objectives: the last of them is
minimised, the others are bounded. What is left to look at is a list of rectangles in the space of the bounded ones.

1. The rectangle is taken whose upper corner spans the largest volume with the ideal point.
2. Two calls for its upper corner: the least last objective with each other one less than the corner's (by one: all are
   integers), then the least sum of all objectives with that value of the last. What is found is non-dominated.
3. All rectangles are split at the point found, and those between it and the corner leave the list; where nothing is
   found, all below the corner.

The two calls can be one: the last objective, weighed with more than the sum of the others can differ by, and that sum.
CP-SAT has its default parameters and one worker, or `linearization_level = 2` besides; no hints.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ortools.sat.python import cp_model

from tests.helpers.classics import Row, drawn_costs, drawn_items

from .asking import Ask, OutOfTime, Vector, within_processor_time
from .cases import Case

Corner = Callable[[Vector], Vector | None]
"""A non-dominated point with values of all objectives but the last less than these; None where there is none."""
UNBOUNDED = 2**62
PEERS: dict[str, dict[str, Any]] = {
    "two calls": {"calls_each": 2},
    "two calls at level 2": {"calls_each": 2, "level": 2},
    "one call": {"calls_each": 1},
    "one call at level 2": {"calls_each": 1, "level": 2},
}
"""How the method is run: calls for a corner, and the `linearization_level` if not the default."""


@dataclass(frozen=True)
class PlainModel:
    """A model, its objectives as sums that are minimised, and a row for each to bound it by."""

    model: cp_model.CpModel
    objectives: Sequence[Any]
    rows: Sequence[Any]

    def bound(self, number: int, least: int, most: int) -> None:
        """The values that an objective may have from now on."""
        domain = self.rows[number].proto.linear.domain
        domain.clear()
        domain.extend([least, most])


def _bounded(model: cp_model.CpModel, variables: Sequence[Any], figures: Sequence[Row]) -> PlainModel:
    """The model with objectives of these coefficients."""
    sums = [cp_model.LinearExpr.weighted_sum(variables, row) for row in figures]
    return PlainModel(model, sums, [model.add_linear_constraint(each, -UNBOUNDED, UNBOUNDED) for each in sums])


def knapsack_model(items: Sequence[Row], most: int) -> PlainModel:
    """Items with a number, a weight and values to be maximised, of which so much weight fits."""
    model = cp_model.CpModel()
    taken = [model.new_bool_var("") for _ in items]
    _, weights, *values = zip(*items, strict=True)
    model.add(cp_model.LinearExpr.weighted_sum(taken, weights) <= most)
    return _bounded(model, taken, [tuple(-value for value in row) for row in values])


def assignment_model(costs: Sequence[Row]) -> PlainModel:
    """Pairs of a task and an agent with costs; each task has one agent, and each agent one task."""
    model = cp_model.CpModel()
    chosen = [model.new_bool_var("") for _ in costs]
    for side in (0, 1):
        for number in sorted({row[side] for row in costs}):
            model.add(sum(one for one, row in zip(chosen, costs, strict=True) if row[side] == number) == 1)
    _, _, *figures = zip(*costs, strict=True)
    return _bounded(model, chosen, figures)


def model_of(case: Case) -> PlainModel:
    """The plain model of a case of `cases.classical`."""
    if case.family == "knapsack":
        return knapsack_model(*drawn_items(case.threads, case.objectives, case.seed))
    return assignment_model(drawn_costs(case.threads, case.objectives, case.seed))


def epsilon_front(plain: PlainModel, limit_s: float, calls_each: int, level: int | None = None) -> dict[str, Any]:
    """The front as minimised values, whether it is proved, and the number of calls, within so much processor time."""
    search = _Search(plain, within_processor_time(limit_s, level))
    points: dict[Vector, None] = {}
    try:
        least, most = search.payoffs()
        corner = search.in_two_calls if calls_each == 2 else search.in_one_call(1 + sum(most) - sum(least))
        for point in by_rectangles(corner, least, most):
            points[point] = None
        is_complete = True
    except OutOfTime:
        is_complete = False
    return {"front": sorted(points), "is_complete": is_complete, "calls": search.calls, "solver_s": search.solver_s}


class _Search:
    """Asks the solver; counts the calls, and the processor seconds in them."""

    def __init__(self, plain: PlainModel, ask: Ask) -> None:
        self.plain, self.ask, self.calls, self.solver_s = plain, ask, 0, 0.0

    def payoffs(self) -> tuple[Vector, Vector]:
        """The least and the most that each objective but the last can be."""
        bounds = []
        for number, objective in enumerate(self.plain.objectives[:-1]):
            least, most = self._minimise(objective), self._minimise(-objective)
            assert least is not None and most is not None
            bounds.append((least[number], most[number]))
        low, high = zip(*bounds, strict=True)
        return low, high

    def in_two_calls(self, upper: Vector) -> Vector | None:
        """The least last objective, and with it the least sum of all."""
        last = self._below(upper)
        first = self._minimise(self.plain.objectives[last])
        if first is None:
            return None
        self.plain.bound(last, first[last], first[last])
        point = self._minimise(sum(self.plain.objectives))
        assert point is not None
        return point

    def in_one_call(self, weight: int) -> Corner:
        """The same, where the sums of all objectives but the last differ by less than a weight."""

        def corner(upper: Vector) -> Vector | None:
            last = self._below(upper)
            return self._minimise(weight * self.plain.objectives[last] + sum(self.plain.objectives[:last]))

        return corner

    def _below(self, upper: Vector) -> int:
        """Bound all objectives but the last, and say which that is."""
        for number, value in enumerate(upper):
            self.plain.bound(number, -UNBOUNDED, value - 1)
        self.plain.bound(len(upper), -UNBOUNDED, UNBOUNDED)
        return len(upper)

    def _minimise(self, expression: Any) -> Vector | None:
        """The objectives' values where an expression is least."""
        self.calls += 1
        self.plain.model.minimize(expression)
        began = time.process_time()
        try:
            return self.ask(self.plain.model, self.plain.objectives, 0.0)
        finally:
            self.solver_s += time.process_time() - began


def by_rectangles(corner: Corner, least: Vector, most: Vector) -> Iterator[Vector]:
    """Every non-dominated point, some of them more than once; the bounds are those of all objectives but the last."""
    ideal = np.array(least)
    low, high = ideal[None, :], np.array(most)[None, :] + 1
    while len(low):
        lower, upper = ideal, high[np.argmax(np.prod((high - ideal).astype(float), axis=1))]
        point = corner(tuple(map(int, upper)))
        if point is not None:
            yield point
            lower = np.array(point[:-1])
            low, high = _split(low, high, lower)
        left = ~(np.all(low >= lower, axis=1) & np.all(high <= upper, axis=1))
        low, high = low[left], high[left]


def _split(low: Any, high: Any, point: Any) -> tuple[Any, Any]:
    """Lower and upper corners of what rectangles fall into along each axis on which the point is within them."""
    for axis, value in enumerate(point):
        cut = (low[:, axis] < value) & (value < high[:, axis])
        above, below = low[cut], high[cut]
        above[:, axis] = below[:, axis] = value
        low, high = np.concatenate([low[~cut], low[cut], above]), np.concatenate([high[~cut], below, high[cut]])
    return low, high
