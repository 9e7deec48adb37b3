"""Break-points against looking at every design, on every shipped problem: without the solver, limit by limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import prod
from typing import Any

import numpy
import pytest

from dse.analysis.evaluate import Evaluator
from dse.questions.sweep.axes import LimitAxis, limited, read_axis
from dse.questions.sweep.break_points import break_points
from dse.questions.sweep.fronts import minimised
from dse.questions.sweep.inputs_of_file import Inputs, merged_data
from dse.space.model.criteria import Objective
from dse.space.model.space import Space
from tests.benchmarks.vectorised import VectorisedEvaluator
from tests.helpers.support import evaluated
from tests.questions.studies import ALL, LONG, example
from tests.questions.sweep.test_breaks import expected

GRID = 4000 if LONG else 100
Vector = tuple[Fraction, ...]


def ranges(space: Space) -> list[str]:
    """Limits on what is a figure of its own, not a share of what is chosen."""
    found = [f"jitter of {space.flows[0].name}=1us..400ms", f"latency of {space.flows[-1].name}=1us..1500ms"]
    return [*found, f"price=1 {space.currency}..3000 {space.currency}"]


def every_vector(space: Space) -> set[Vector]:
    """The objectives of every feasible design, exactly."""
    evaluator = Evaluator(space)
    if space.processing != "execution_time":  # which arrays do not compute quicker
        scales = [measure.scale for measure in evaluator.objectives]
        return {scaled(item.objectives, scales) for item in evaluated(evaluator).values() if item.is_feasible}
    vectorised = VectorisedEvaluator(evaluator)
    shape = [len(item.options) for item in space.decisions]
    found: set[tuple[int, ...]] = set()
    for start in range(0, prod(shape), 50_000):
        numbers = numpy.arange(start, min(start + 50_000, prod(shape)))
        batch = vectorised.evaluate(numpy.stack(numpy.unravel_index(numbers, shape), axis=1))
        found |= {tuple(map(int, row)) for row in batch.objectives[batch.is_feasible]}
    scales = [measure.scale for measure in evaluator.objectives]
    return {scaled(row, scales) for row in found}


def scaled(row: tuple[int, ...], scales: list[int]) -> Vector:
    """Objectives in their units."""
    return tuple(Fraction(value, scale) for value, scale in zip(row, scales, strict=True))


def with_point(front: set[Vector], point: Vector, senses: Sequence[str]) -> set[Vector]:
    """A front with one more point, if nothing dominates it."""
    here = minimised(point, senses)
    if any(all(a <= b for a, b in zip(minimised(item, senses), here, strict=True)) for item in front):
        return front
    return {item for item in front if not all(a <= b for a, b in zip(here, minimised(item, senses), strict=True))} | {
        point
    }


SLOW = () if LONG else ("perception",)
"""One of two problems with response times, all of whose designs take long to look at."""
QUESTIONS = [(name, text) for at, name in enumerate(ALL) for text in range(3) if LONG or text == at % 3]
"""Problems and the limits that are swept: each problem with one of them, all three where there is time."""


@pytest.mark.parametrize(("name", "text"), [item for item in QUESTIONS if item[0] not in SLOW])
def test_break_points_are_those_of_every_design(name: str, text: int) -> None:
    """The front of the other objectives at each limit of a fine grid, on each break-point and just below it."""
    problem = example(name)
    axis = read_axis(problem, Inputs(merged_data(problem)), ranges(problem.space)[text])
    assert isinstance(axis, LimitAxis) and axis.high is not None
    rest = tuple(item for item in problem.space.objectives if item.metric != axis.metric) or problem.space.objectives
    objective = Objective("minimise it", "minimise", axis.metric)
    space = replace(limited(problem.space, axis.high), objectives=(*rest, objective))
    points = sorted(every_vector(space), key=lambda vector: vector[-1])
    outcome = break_points(problem.space, axis, 0)
    low, high = Fraction(outcome["from"]), Fraction(outcome["to"])
    starts = [Fraction(item["from"]) for item in outcome["stretches"]]
    places = {low + (high - low) * number / GRID for number in range(GRID + 1)}
    places |= {place for start in starts for place in (start, start - Fraction(1, 1000)) if place >= low}
    senses = [item.sense for item in rest]
    front: set[Vector] = set()
    taken = 0
    for place in sorted(places):
        while taken < len(points) and points[taken][-1] <= place:
            front = with_point(front, points[taken][:-1], senses)
            taken += 1
        assert front == told(outcome, place), float(place)
    assert (outcome["status"] == "infeasible") == (not front)


def told(outcome: dict[str, Any], place: Fraction) -> set[Vector]:
    """What the break-points say of a limit."""
    return {tuple(Fraction(value) for value in vector) for vector in expected(outcome, place)}
