"""Traced figures keep what they are made of, whatever has been computed before with the same numbers."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import count
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.inputs import PARTS, InputSpace
from dse.space.build import build_space
from dse.spec.quantities.quantities import Figure, with_figures
from dse.spec.schema.fields import COUNT
from dse.support.units import PERIOD
from tests.questions.studies import example

TWO = """
dse: 1
name: two on a core
processing: response_time
processor_types: {c: {}}
processors: {p: {type: c}}
threads:
  a: {processor: p, priority: 2, period: 10 ms, compute_execution_time: 2 ms}
  b: {processor: p, priority: 1, period: 20 ms, compute_execution_time: 3 ms}
flows: {f: {path: [b]}}
"""


def test_a_response_time_that_is_remembered_has_its_inputs_all_the_same() -> None:
    problem = dse.loads(TWO)
    design = (0,) * len(problem.space.decisions)
    assert Evaluator(problem.space).metric_values(design)["latency of f"] == 5_000_000
    for _ in range(2):
        inputs = InputSpace(problem)
        function = DesignFunction(inputs, design)
        [program] = function.programs
        reached = program.variables(program.outputs[function.outputs.names.index("latency of f")])
        paths = {f"threads.{name}.compute_execution_time" for name in "ab"}
        assert {inputs.variables[index].path for index in reached} == paths


@pytest.mark.parametrize("name", ["starter", "inmark", "perception"])
def test_spaces_of_other_values_are_those_that_are_built_of_them(name: str) -> None:
    """Also where two figures move, and where values were asked for before and after each other."""
    problem = example(name)
    inputs = InputSpace(problem)
    source = random.Random(5)
    no_options = [item.index for item in inputs.variables if item.kind not in (PERIOD, COUNT)]
    for _ in range(6):
        moved = source.sample(no_options, 2)
        values = [value * (3 if index in moved else 1) for index, value in enumerate(inputs.nominal)]
        kept, traced = inputs.at(values), inputs.at(values, traced=True)
        assert inputs.at(values) is kept
        number = count()

        def make(value: Any, figure: Figure, number: Any = number, values: Any = values) -> Any:
            now = next(number)
            assert inputs.variables[now].path == figure.path
            return value if values[now] == figure.nominal else type(value)(values[now])

        spec = with_figures(problem.loaded.spec, make).model_copy(
            update={"uncertainty": {}, "processing": problem.space.processing}
        )
        built = build_space(replace(problem.loaded, spec=spec))
        for part in PARTS:
            assert getattr(kept, part) == getattr(built, part) == getattr(traced, part)
            assert not getattr(traced, part) or getattr(traced, part) is not getattr(inputs.traced, part)
    assert inputs.at(inputs.nominal) == replace(problem.space, requirements=inputs.traced.requirements)
