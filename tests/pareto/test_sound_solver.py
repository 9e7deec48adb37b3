"""CP-SAT's presolve must not lose solutions.

`lost_solution.txt` is a model that OR-tools 9.15 with its default parameters solves to 5260 and calls that optimal
(google/or-tools issue 5293); without presolve it finds 0. It is a random problem's model, reduced.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ortools.sat.python import cp_model

from dse.pareto import settings

MODEL = Path(__file__).with_name("lost_solution.txt").read_text()
SETTINGS = {
    "bare": settings.bare,
    "relaxed": settings.relaxed,
    "thorough": settings.thorough,
    "in order": lambda p: settings.in_order(p, 1, 2),
}


def solved(solver: cp_model.CpSolver) -> tuple[int, Any]:
    model = cp_model.CpModel()
    assert model.proto.parse_text_format(MODEL)
    return solver.solve(model), solver.objective_value


@pytest.mark.parametrize("name", SETTINGS)
def test_no_solution_is_lost(name: str) -> None:
    reference = cp_model.CpSolver()
    reference.parameters.cp_model_presolve = False
    solver = settings.sound_solver()
    SETTINGS[name](solver.parameters)
    assert solved(solver) == solved(reference) == (cp_model.OPTIMAL, 0)
