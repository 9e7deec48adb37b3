"""CP-SAT loses solutions: the models here show it, and that our solvers do not.

Random problems, reduced. OR-tools 9.15 with its default parameters solves `lost_solution.txt` to 5260 and calls that
optimal, where 0 is possible (google/or-tools issue 5293, a presolve step). It calls `infeasible_with.txt` infeasible
with presolve, and `infeasible_without.txt` without: detection of bounds that have two conditions.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ortools.sat.python import cp_model

from dse.search.solver import settings
from dse.verification.solver_calls import other_solver

MODELS = [("lost_solution.txt", 0), ("infeasible_with.txt", None), ("infeasible_without.txt", None)]
HERE = Path(__file__).parent
SETTINGS = {
    "bare": settings.BARE,
    "relaxed": settings.RELAXED,
    "options first": settings.OPTIONS_FIRST,
    "cutting": settings.CUTTING,
    "bare in order": settings.BARE_IN_ORDER,
    "cutting in order": settings.CUTTING_IN_ORDER,
}


def solved(solver: cp_model.CpSolver, name: str) -> tuple[Any, Any]:
    model = cp_model.CpModel()
    assert model.proto.parse_text_format((HERE / name).read_text())
    return solver.solve(model), solver.objective_value


@pytest.mark.parametrize("work", [1.0, 10.0])
@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize(("name", "least"), MODELS)
def test_no_solution_is_lost(setting: str, name: str, least: int | None, work: float) -> None:
    solver = settings.sound_solver()
    SETTINGS[setting].apply(solver.parameters, work)
    assert_sound(solver, name, least)


@pytest.mark.parametrize(("name", "least"), MODELS)
def test_the_second_proof_loses_none_either(name: str, least: int | None) -> None:
    assert_sound(other_solver(), name, least)


def assert_sound(solver: cp_model.CpSolver, name: str, least: int | None) -> None:
    status, value = solved(solver, name)
    assert status == cp_model.OPTIMAL
    assert least is None or value == least
