"""Traced figures keep what they are made of, whatever has been computed before with the same numbers."""

from __future__ import annotations

import dse
from dse.analysis.evaluate import Evaluator
from dse.study.functions import DesignFunction
from dse.study.inputs import InputSpace

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
