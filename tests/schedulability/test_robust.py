"""Deadlines that hold for all execution times that are stated, against looking at every design at every corner."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest
from effort import cases
from support import counted_down, dominates
from thread_systems import draw, text_of

import dse
from dse.analysis.evaluate import Evaluator
from dse.api.problem import load
from dse.encode import sums
from dse.pareto.front import search_front
from dse.study.corners import RobustQuestion
from dse.study.inputs import InputSpace
from dse.study.robust import solve_robust
from dse.study.uncertainty import read_uncertainties
from dse.study.worst_place import Box

UPWARD = ("minimise price", "minimise latency of f")
BOTH_WAYS = ("minimise price", "maximise latency of f", "minimise min latency of f")


def expected(problem: dse.Problem) -> set[tuple[int, ...]]:
    """The vectors of designs that are in time at the figures of the file and at every corner."""
    inputs = InputSpace(problem)
    box = Box(read_uncertainties(problem, inputs))
    spaces = [inputs.at(box.values(inputs.nominal, corner)) for corner in product((0, 1), repeat=len(box.ends))]
    evaluators = [Evaluator(space) for space in (problem.space, *spaces)]
    found = set()
    for raw in product(*(range(len(item.options)) for item in problem.space.decisions)):
        judged = [item.evaluate(raw) for item in evaluators]
        if all(item.is_feasible for item in judged):
            found.add(judged[0].objectives)
    points = {vector: counted_down(problem.space, vector) for vector in found}
    return {vector for vector in found if not any(dominates(other, points[vector]) for other in points.values())}


@pytest.mark.parametrize("objectives", [UPWARD, BOTH_WAYS], ids=["upward", "both ways"])
@pytest.mark.parametrize("kind", ["plain", "chained", "unequal", "grouped"])
@pytest.mark.parametrize("seed", cases(3))
def test_no_design_is_lost_that_is_in_time_at_every_corner(
    kind: str, objectives: tuple[str, ...], seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Limits at corners are of other figures: what the search learns of them names all that they hang on."""
    monkeypatch.setattr(sums, "SCHEDULE_CASE_LIMIT", 1)
    file = tmp_path / "drawn.yaml"
    text = text_of(draw(seed, kind=kind), objectives).replace(
        "deadlines: all", "deadlines: all\nprocessing: response_time"
    )
    file.write_text(f"{text}uncertainty: {{'threads.t0.compute_execution_time.fast': {{factor: 1 .. 1.3}}}}\n", "utf-8")
    problem = load(file)
    wanted = expected(problem)
    robust = solve_robust(problem).robust
    assert {tuple(point.objectives.values()) for point in robust.front} == wanted
    question = RobustQuestion(problem)
    for point in robust.front:
        question.expect(point.design)
    again = search_front(question.evaluator())
    assert again.is_complete
    assert wanted <= set(again.points) or not wanted
