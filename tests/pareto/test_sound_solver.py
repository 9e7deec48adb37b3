"""CP-SAT's presolve loses solutions: the models here show it, and that our solvers do not.

They are those of random problems, reduced. OR-tools 9.15 with its default parameters solves `lost_solution.txt` to 5260
and calls that optimal (google/or-tools issue 5293); with the guilty step's work limit at 0 it calls
`wrongly_infeasible.txt` infeasible. Without presolve it finds 0 and a solution.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ortools.sat.python import cp_model

from dse.pareto import settings

HERE = Path(__file__).parent
SETTINGS = {
    "bare": settings.bare,
    "relaxed": settings.relaxed,
    "thorough": settings.thorough,
    "in order": lambda parameters: settings.in_order(parameters, 1, 2),
}


def solved(solver: cp_model.CpSolver, name: str) -> tuple[int, Any]:
    model = cp_model.CpModel()
    assert model.proto.parse_text_format((HERE / name).read_text())
    return solver.solve(model), solver.objective_value


@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize(("name", "least"), [("lost_solution.txt", 0), ("wrongly_infeasible.txt", None)])
def test_no_solution_is_lost(setting: str, name: str, least: int | None) -> None:
    solver = settings.sound_solver()
    SETTINGS[setting](solver.parameters)
    assert not solver.parameters.cp_model_presolve
    status, value = solved(solver, name)
    assert status == cp_model.OPTIMAL
    assert least is None or value == least
