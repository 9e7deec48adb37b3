"""Every call of the solver has a limit that counts steps, and a way on where it was not enough."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from ortools.sat.python import cp_model

import dse
from dse.analysis.evaluate import Evaluator
from dse.examples.shipped import example_path
from dse.search.alternatives import Finder
from dse.search.front import search_front

STARTER = example_path("starter")
SOURCES = Path(dse.__file__).parent
CONFLICT = STARTER.read_text().replace("requirements:\n", "requirements:\n  - price <= 1 EUR\n", 1)


def solve() -> Any:
    """The figures: which design stands for a point depends on what looking for the first one may take."""
    return [point.objectives for point in dse.solve(STARTER).front]


def other_designs() -> Any:
    """How many there are: ties may be broken otherwise."""
    evaluator = Evaluator(dse.load(STARTER).space)
    objectives, design = next(iter(search_front(evaluator).points.items()))
    near = Finder(evaluator).near(objectives, design, 3, Fraction(1, 5))
    return len(near.designs), near.more


def verify() -> Any:
    return [dse.verify(dse.solve(STARTER), problem=STARTER, method="model").findings]


def explain() -> Any:
    """The conflicts: other designs may be their witnesses."""
    found = dse.explain(dse.loads(CONFLICT), every=True).conflicts
    return [[demand.text for demand, _ in conflict.members] for conflict in found]


QUESTIONS: list[Callable[[], Any]] = [solve, other_designs, verify, explain]


@pytest.mark.parametrize("question", QUESTIONS)
def test_calls_that_end_at_their_limit_change_no_answer(
    question: Callable[[], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each call has a limit in deterministic time; two of three are stopped before they have begun."""
    expected = question()
    calls: list[float] = []
    solve_as_before = cp_model.CpSolver.solve

    def unlucky(self: cp_model.CpSolver, model: cp_model.CpModel, callback: Any = None) -> Any:
        calls.append(self.parameters.max_deterministic_time)
        if len(calls) % 3:
            self.parameters.max_deterministic_time = 0.0
        return solve_as_before(self, model, callback)

    monkeypatch.setattr(cp_model.CpSolver, "solve", unlucky)
    assert question() == expected
    assert len(calls) > 3
    assert all(0 < limit < math.inf for limit in calls)


def test_solvers_are_made_where_their_limits_are_set() -> None:
    """Whoever makes a solver elsewhere joins the test above."""
    made = {
        f"{path.relative_to(SOURCES)}: {line.strip()}"
        for path in SOURCES.rglob("*.py")
        for line in path.read_text().splitlines()
        if "= sound_solver(" in line or "= other_solver(" in line or ".CpSolver()" in line
    }
    assert {item.split(":")[0] for item in made} == {
        "search/solver/settings.py",
        "search/solver/call.py",
        "search/feasibility/conflicts.py",
        "verification/solver_calls.py",
    }
    assert len(made) == 5
