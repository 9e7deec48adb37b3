"""Published fronts of knapsack and assignment problems, point for point; and by looking at every choice."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from itertools import permutations, product
from pathlib import Path

import pytest

import dse
from tests.support import dominates

GOLDEN = Path(__file__).parents[1] / "golden"
Point = tuple[int, ...]


def table(name: str) -> list[Point]:
    lines = [line for line in (GOLDEN / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return [tuple(map(int, row)) for row in list(csv.reader(lines))[1:]]


def figures(name: str, values: Sequence[int]) -> str:
    return ", ".join(f"{name}{number}: {value} points" for number, value in enumerate(values, start=1))


def points_of(text: str) -> list[Point]:
    result = dse.solve(dse.loads(text))
    assert result.status == "complete"
    return sorted(tuple(point.objectives.values()) for point in result.front)


def non_dominated(points: set[Point]) -> list[Point]:
    return sorted(point for point in points if not any(dominates(other, point) for other in points))


def knapsack(items: list[Point], most: int) -> str:
    """Each item a device that is taken or left."""
    kinds = range(1, len(items[0]) - 1)
    lines = [
        "dse: 1",
        "name: knapsack",
        f"totals: {{weight: g, {', '.join(f'value{kind}: points' for kind in kinds)}}}",
    ]
    lines += ["device_types:", "  left: {}"]
    lines += [
        f"  take_{item}: {{totals: {{weight: {weight} g, {figures('value', values)}}}}}"
        for item, weight, *values in items
    ]
    lines += ["devices:", *(f"  item_{item[0]}: {{type: [take_{item[0]}, left]}}" for item in items)]
    lines += ["requirements:", f"  - weight <= {most} g", "objectives:"]
    return "\n".join([*lines, *(f"  - maximise value{kind}" for kind in kinds)])


def assignment(costs: list[Point]) -> str:
    """Each task a device, each agent a type, and a total that counts the tasks of each agent."""
    tasks, agents = sorted({row[0] for row in costs}), sorted({row[1] for row in costs})
    kinds = range(1, len(costs[0]) - 1)
    totals = [f"agent{agent}: tasks" for agent in agents] + [f"cost{kind}: points" for kind in kinds]
    lines = ["dse: 1", "name: assignment", f"totals: {{{', '.join(totals)}}}", "device_types:"]
    for task, agent, *values in costs:
        lines.append(f"  t{task}_a{agent}: {{totals: {{agent{agent}: 1 tasks, {figures('cost', tuple(values))}}}}}")
    lines += ["devices:"]
    lines += [f"  task{task}: {{type: [{', '.join(f't{task}_a{agent}' for agent in agents)}]}}" for task in tasks]
    lines += ["requirements:", *(f"  - agent{agent} <= 1 tasks" for agent in agents), "objectives:"]
    return "\n".join([*lines, *(f"  - minimise cost{kind}" for kind in kinds)])


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
