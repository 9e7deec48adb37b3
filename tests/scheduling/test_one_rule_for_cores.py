"""Who checks a design of a front meets the figures of the line about contention: the cores are the same."""

from __future__ import annotations

import pytest

import dse

SHARED = """
dse: 1
name: shared
overload: allowed
processor_types: {cpu: {cores: 2, price: 60 EUR}, more: {cores: 3, price: 90 EUR}}
processors: {p: {type: [cpu, more]}}
devices: {s: {period: 10 ms, compute_execution_time: 1 ms}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 3 ms}
  b: {processor: p, period: 20 ms, compute_execution_time: 6 ms}
  c: {processor: p, period: 40 ms, compute_execution_time: 8 ms}
connections: {w: {from: s, to: c}}
flows: {f: {path: [s, c]}}
requirements: [latency of f <= 60 ms]
objectives: [minimise latency of f, minimise price]
processing: execution_time
"""
"""All three fit on the first core, where c waits; on the least used one it would not."""


@pytest.mark.parametrize("kind", ["cpu", "more"])
def test_the_cores_are_those_of_first_fit(kind: str) -> None:
    design = {"p.type": kind}
    told = dse.analyse(SHARED, design).contended
    assert told is not None
    [broken] = told.broken
    counted = dse.analyse(SHARED, design, processing="response_time")
    [verdict] = counted.verdicts
    assert (verdict.value, verdict.holds) == (broken.value, False) == (61_000_000, False)
    assert {counted.decisions[f"{name}.core"] for name in "abc"} == {"1"}


def test_a_limit_that_first_fit_misses_has_other_cores() -> None:
    asked = SHARED.replace("requirements: [", "requirements: [response time of c <= 10 ms, ")
    counted = dse.analyse(asked, {"p.type": "cpu"}, processing="response_time")
    assert counted.is_feasible
    assert counted.decisions["c.core"] != counted.decisions["a.core"]
