"""Drawn systems of all kinds of homes and a bus: no run is outside of the bounds of its flows, threads and messages."""

from __future__ import annotations

import pytest

import dse
from tests.helpers.effort import cases
from tests.helpers.whole_systems import draw_whole_system


@pytest.mark.parametrize("seed", cases(300))
def test_no_run_of_a_whole_system_is_outside_its_bounds(seed: int) -> None:
    result = dse.simulate(dse.loads(draw_whole_system(seed)), runs=4, seed=seed)
    assert result.is_anything_observed or not result.flows
    assert not result.contradictions


AT_ONCE = """
dse: 1
name: at once
processing: response_time
deadlines: none
processor_types: {p: {}}
processors: {cpu: {type: p}}
threads:
  before: {processor: cpu, period: 20 ms, compute_execution_time: 2 ms, priority: 2}
  after: {processor: cpu, dispatch_protocol: aperiodic, compute_execution_time: 3 ms, priority: 4}
  first: {processor: cpu, period: 20 ms, compute_execution_time: 0 ms .. 1 ms, priority: 2}
  second: {processor: cpu, dispatch_protocol: aperiodic, compute_execution_time: 1 ms, priority: 3}
connections: {ba: {from: before, to: after}, fs: {from: first, to: second}}
flows: {f: {path: [first, second]}}
objectives: [minimise latency of f]
"""


def test_a_job_that_takes_no_time_ends_behind_what_comes_at_this_moment() -> None:
    """When `before` ends `after` comes at once, and goes before `first`: `second` never meets it."""
    result = dse.simulate(AT_ONCE, runs=100, offsets="random", execution="min", seed=1)
    assert not result.contradictions
    assert {item.name: item.bound_ns for item in result.tasks}["second"] == 10**6


def test_growth_is_followed_behind_threads_that_never_meet() -> None:
    """In this overloaded system lags and jobs on their way grow from round to round, and are followed in one step."""
    assert not dse.simulate(dse.loads(draw_whole_system(2266)), runs=1, seed=1).contradictions
