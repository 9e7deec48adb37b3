"""The peer on plain models has the front of exhaustion, and so has the command."""

from __future__ import annotations

import random
from itertools import permutations, product

import pytest

from tests.helpers.classics import Row, drawn_costs, drawn_items

from .asking import Vector
from .cases import Case, classical
from .classical import PEERS, assignment_model, by_rectangles, epsilon_front, model_of
from .comparing import command
from .fronts import non_dominated

CASES = [
    Case("assignment", "assignment", 4, 3),
    Case("knapsack, 3 values", "knapsack", 8, 3),
    Case("knapsack, 4 values", "knapsack", 8, 4),
]


def total(rows: list[Vector]) -> Vector:
    return tuple(map(sum, zip(*rows, strict=True)))


def exhaustion(case: Case) -> list[Vector]:
    if case.family == "assignment":
        return of_assignments(drawn_costs(case.threads, case.objectives, case.seed))
    return of_knapsacks(*drawn_items(case.threads, case.objectives, case.seed))


def of_assignments(rows: list[Row]) -> list[Vector]:
    """The front of all permutations."""
    costs = {row[:2]: row[2:] for row in rows}
    agents = sorted({row[1] for row in rows})
    found = [total([costs[pair] for pair in enumerate(order, start=1)]) for order in permutations(agents)]
    return [tuple(map(int, point)) for point in non_dominated(found)]


def of_knapsacks(items: list[Row], most: int) -> list[Vector]:
    """The front of all sets of items that fit."""
    nothing = (0,) * (len(items[0]) - 1)
    found = []
    for mask in product((False, True), repeat=len(items)):
        weight, *values = total([nothing, *(item[1:] for item, taken in zip(items, mask, strict=True) if taken)])
        if weight <= most:
            found.append(tuple(-value for value in values))
    return [tuple(map(int, point)) for point in non_dominated(found)]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_fronts_are_those_of_exhaustion(case: Case) -> None:
    expected = exhaustion(case)
    assert len(expected) > 3
    for name, way in PEERS.items():
        found = epsilon_front(model_of(case), 60.0, **way)
        assert (found["front"], found["is_complete"]) == (expected, True), name
    ours = command(case, 60.0)
    assert (ours["front"], ours["is_complete"]) == (expected, True)


@pytest.mark.parametrize("name", PEERS)
def test_small_costs_have_ties(name: str) -> None:
    """A least last objective with values of the others that are dominated, and steps of one between points."""
    for seed in range(1, 9):
        costs = [(*row[:2], *(1 + value % 3 for value in row[2:])) for row in drawn_costs(4, 3, seed)]
        found = epsilon_front(assignment_model(costs), 60.0, **PEERS[name])
        assert (found["front"], found["is_complete"]) == (of_assignments(costs), True), seed


def test_a_corner_takes_as_many_calls_as_it_is_said_to() -> None:
    calls = {name: epsilon_front(model_of(CASES[0]), 60.0, **way)["calls"] for name, way in PEERS.items()}
    assert calls["one call"] < calls["two calls"] < 2 * calls["one call"]


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_rectangles_of_drawn_points(axes: int) -> None:
    """Without a solver: sets of points with small values, so that many are equal or dominated."""
    for seed in range(60):
        rng = random.Random(f"rectangles {axes} {seed}")
        points = [tuple(rng.randint(0, 5) for _ in range(axes + 1)) for _ in range(rng.randint(1, 25))]

        def corner(upper: Vector, points: list[Vector] = points) -> Vector | None:
            below = [point for point in points if all(map(int.__lt__, point, upper))]
            return min(below, key=lambda point: (point[-1], sum(point)), default=None)

        columns = list(zip(*points, strict=True))[:-1]
        found = by_rectangles(corner, tuple(map(min, columns)), tuple(map(max, columns)))
        assert sorted(set(found)) == [tuple(map(int, point)) for point in non_dominated(points)], seed


def test_a_peer_that_has_no_time_says_so() -> None:
    assert not epsilon_front(model_of(classical(quick=False, seed=1)[-1]), 0.0, **PEERS["two calls"])["is_complete"]
