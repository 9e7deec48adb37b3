"""Knapsack and assignment problems: numbers that are drawn, and problem files (docs/classic-problems.md) of numbers."""

from __future__ import annotations

import random
from collections.abc import Sequence
from itertools import product

Row = tuple[int, ...]


def figures(name: str, values: Sequence[int]) -> str:
    return ", ".join(f"{name}{number}: {value} points" for number, value in enumerate(values, start=1))


def knapsack(items: list[Row], most: int) -> str:
    """Each item, of a number, a weight and values, a device that is taken or left; `most` is what fits."""
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


def assignment(costs: list[Row]) -> str:
    """Each task a device, each agent a type, and a total that counts the tasks of each agent.

    A row has the numbers of a task and an agent, and the costs of the pair.
    """
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


def drawn_items(count: int, kinds: int, seed: int) -> tuple[list[Row], int]:
    """Items, and the weight that fits: values and weights of 1 to 1,000, of which half fits.

    As the knapsacks of G. Kirlik and S. Sayin are (EJOR 232, 2014).
    """
    rng = random.Random(f"knapsack {count} {kinds} {seed}")
    items = [(item, *(rng.randint(1, 1000) for _ in range(1 + kinds))) for item in range(1, count + 1)]
    return items, sum(item[1] for item in items) // 2


def drawn_costs(count: int, kinds: int, seed: int) -> list[Row]:
    """As many agents as tasks, and costs of 1 to 20 for each pair: as the assignments of Kirlik and Sayin are."""
    rng = random.Random(f"assignment {count} {kinds} {seed}")
    numbers = range(1, count + 1)
    return [(*pair, *(rng.randint(1, 20) for _ in range(kinds))) for pair in product(numbers, numbers)]
