"""Fixing a design in the model gives exactly what the analysis gives; refused combinations are refused by the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from ortools.sat.python import cp_model
from support import PROBLEMS, counted_down, evaluated, load_space, raw_designs

from dse.analysis.evaluate import Evaluator
from dse.analysis.validity import canonical
from dse.encode.model import EncodedSpace, encode
from dse.space.types import INACTIVE, Design, Space

PROFILES = ("dse", "osate-2.2", "osate-2.19")


def fixed_objectives(encoded: EncodedSpace, design: Design) -> tuple[int, ...] | None:
    """The counted objectives when every option literal is fixed as in `design`; None when the model refuses that."""
    model = encoded.model.clone()
    for literals, inactive, chosen in zip(encoded.options, encoded.inactive, design, strict=True):
        for option, literal in enumerate(literals):
            model.add(model.get_bool_var_from_proto_index(literal.index) == (option == chosen))
        if inactive is not None:
            model.add(model.get_bool_var_from_proto_index(inactive.index) == (chosen == INACTIVE))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.cp_model_presolve = False
    status = solver.solve(model)
    if status == cp_model.INFEASIBLE:
        return None
    assert status == cp_model.OPTIMAL
    values = solver.response_proto.solution
    return tuple(item.offset + item.step * values[item.variable.index] for item in encoded.objectives)


def assert_model_is_analysis(space: Space) -> None:
    """Every combination of options has the same fate and the same objectives in the model and in the analysis."""
    evaluator = Evaluator(space)
    encoded = encode(evaluator)
    verdicts = evaluated(evaluator)
    assert any(item.is_feasible for item in verdicts.values())
    for design, evaluation in verdicts.items():
        found = fixed_objectives(encoded, design)
        expected = counted_down(space, evaluation.objectives) if evaluation.is_feasible else None
        if any(limit.measure.rounded for limit in evaluator.limits) and expected is None and not evaluation.breaches:
            continue  # relaxed to the safe side: the referee refuses what exact comparison refuses
        assert found == expected, (design, evaluation)


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_every_design_has_the_figures_of_the_analysis(path: Path) -> None:
    assert_model_is_analysis(load_space(path))
