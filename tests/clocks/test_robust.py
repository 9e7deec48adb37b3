"""Robust fronts of problems with clocks, against every design at every corner and inside."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import product
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.questions.problem import load
from dse.questions.robust.robust import solve_robust
from dse.questions.robust.worst_case import Box
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.uncertainty import read_uncertainties
from dse.support.errors import UsageError
from tests.clocks.test_open_offsets import drawn
from tests.helpers.effort import cases
from tests.helpers.support import counted_down, dominates, evaluated
from tests.oracle.generator import to_yaml


def uncertain(rng: random.Random) -> dict[str, Any]:
    """A random problem with open offsets, a limit or two, and times that may differ."""
    data = drawn(rng)
    names = list(data["threads"])
    for name in rng.sample(names, 2):  # fewer designs
        data["threads"][name]["offset"] = f"{rng.randrange(4)} ms"
    stated = {f"threads.{rng.choice(names)}.compute_execution_time": {"factor": "0.5 .. 2"}}
    if rng.random() < 0.5:
        stated[f"threads.{rng.choice(names)}.compute_execution_time"] = {"factor": "1 .. 1.3"}
    if rng.random() < 0.3:
        fixed = next(name for name in names if isinstance(data["threads"][name]["offset"], str)
                     and data["threads"][name]["offset"] != "any")  # fmt: skip
        stated[f"threads.{fixed}.offset"] = {"range": rng.choice(["0 ms .. 1 ms", "1 ms .. 3 ms"])}
    data["uncertainty"] = stated
    kind = rng.choice(["latency", "latency", "min latency", "jitter", "run jitter", "reaction time"])
    sign, limit = (">=", rng.randint(0, 6)) if kind == "min latency" else ("<=", rng.randint(8, 40))
    data["requirements"] = [f"{kind} of f{number} {sign} {limit} ms" for number in (0, 1)]
    return data


def brute(problem: dse.Problem) -> tuple[set[tuple[int, ...]], int]:
    """The front of the designs that hold at every corner and at many places, and how many designs do."""
    inputs = InputSpace(problem)
    box = Box(read_uncertainties(problem, inputs))
    inside = random.Random(1)
    places = [[ends[end] for ends, end in zip(box.ends, corner, strict=True)]
              for corner in product((0, 1), repeat=len(box.ends))]  # fmt: skip
    places += [[low + (high - low) * Fraction(inside.randrange(101), 100) for low, high in box.ends] for _ in range(12)]
    robust: dict[Any, tuple[int, ...]] = {}
    for design, evaluation in evaluated(Evaluator(problem.space)).items():
        if evaluation.is_feasible:
            function = DesignFunction(inputs, design)
            columns = []
            for place in places:
                values = list(inputs.nominal)
                for item, value in zip(box.uncertain, place, strict=True):
                    item.set(values, value)
                columns.append(values)
            if not any(function.broken(function.analysed(values)) for values in columns):
                robust[design] = evaluation.objectives
    points = {vector: counted_down(problem.space, vector) for vector in robust.values()}
    return {one for one, mine in points.items() if not any(dominates(other, mine) for other in points.values())}, len(
        robust
    )


@pytest.mark.parametrize("seed", cases(8))
def test_robust_fronts_equal_brute_force(seed: int) -> None:
    problem = load(to_yaml(uncertain(random.Random(f"robust {seed}"))))
    try:
        found = solve_robust(problem)
    except UsageError as error:
        assert "rise and fall" in str(error) or "moves in steps" in str(error)
        return
    front, robust = brute(problem)
    assert {tuple(point.objectives.values()) for point in found.robust.front} == front
    assert bool(front) == bool(robust) and found.robust.status == ("complete" if front else "infeasible")
