"""Options that count otherwise than they are written are found by how the file writes them."""

from __future__ import annotations

import pytest

import dse

TEXT = """
dse: 1
name: inexact
processor_types: {P: {cores: 1}}
processors: {p: {type: P}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 1 ms, deadline: [4 ms, 4260000.7 ns],
      non_preemptive: [0 ns, 10.2 ns]}
flows: {f: {path: [a]}}
rules: [a.deadline == 4260000.7 ns]
baseline: {a: {deadline: 4260000.7 ns, non_preemptive: 0 ns}}
objectives: [minimise changes, minimise response time of a]
"""


@pytest.mark.parametrize("text", ["4260000.7 ns", "4.26 ms"])
def test_a_deadline_rounds_down_wherever_it_is_named(text: str) -> None:
    """The baseline, rules and fixed decisions refused what the list itself takes, and 0 ns of a section."""
    problem = dse.loads(TEXT.replace("== 4260000.7 ns", f"== {text}")).ask(fix=f"a.deadline={text}")
    (point,) = dse.solve(problem, workers=1).front
    assert (point.decisions["a.deadline"], point.decisions["a.non_preemptive"]) == ("4.26 ms", "0 ns")
