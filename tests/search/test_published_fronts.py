"""Published fronts of knapsack and assignment problems, point for point; and by looking at every choice."""

from __future__ import annotations

import csv
from itertools import permutations, product
from pathlib import Path

import pytest

import dse
from tests.helpers.classics import assignment, knapsack
from tests.helpers.support import dominates

GOLDEN = Path(__file__).parents[1] / "golden"
Point = tuple[int, ...]


def table(name: str) -> list[Point]:
    lines = [line for line in (GOLDEN / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return [tuple(map(int, row)) for row in list(csv.reader(lines))[1:]]


def points_of(text: str) -> list[Point]:
    result = dse.solve(dse.loads(text))
    assert result.status == "complete"
    return sorted(tuple(point.objectives.values()) for point in result.front)


def non_dominated(points: set[Point]) -> list[Point]:
    return sorted(point for point in points if not any(dominates(other, point) for other in points))


def sums(rows: list[Point]) -> Point:
    return tuple(map(sum, zip(*rows, strict=True)))


@pytest.mark.parametrize(("kinds", "most"), [(3, 2137), (4, 2653)])
def test_knapsacks_of_ten_items(kinds: int, most: int) -> None:
    items = table(f"knapsack_10_{kinds}_items.csv")
    expected = sorted(table(f"knapsack_10_{kinds}_front.csv"))
    assert points_of(knapsack(items, most)) == expected
    choices = [
        [item[1:] for item, taken in zip(items, mask, strict=True) if taken] for mask in product((0, 1), repeat=10)
    ]
    weighed = [sums(chosen) for chosen in choices if chosen]
    looked_at = non_dominated({tuple(-value for value in values) for weight, *values in weighed if weight <= most})
    assert sorted(tuple(-value for value in point) for point in looked_at) == expected


def test_an_assignment_of_five_tasks() -> None:
    costs = table("assignment_5_3_costs.csv")
    expected = sorted(table("assignment_5_3_front.csv"))
    assert points_of(assignment(costs)) == expected
    by_pair = {(task, agent): tuple(values) for task, agent, *values in costs}
    agents = range(1, 6)
    assigned = {sums([by_pair[pair] for pair in enumerate(order, start=1)]) for order in permutations(agents)}
    assert non_dominated(assigned) == expected
