"""Drawn systems of all kinds of homes and a bus: no run is outside of the bounds of its flows, threads and messages."""

from __future__ import annotations

import pytest

import dse
from tests.helpers.effort import cases
from tests.helpers.whole_systems import draw_whole_system


@pytest.mark.parametrize("seed", cases(300))
def test_no_run_of_a_whole_system_is_outside_its_bounds(seed: int) -> None:
    """Messages that come while the thread runs are lost in half of the systems, and wait in the others."""
    text = draw_whole_system(seed)
    result = dse.simulate(dse.loads(text), runs=4, seed=seed, endless_queues=seed % 2 > 0)
    assert result.is_anything_observed or not result.flows
    assert not result.contradictions
    is_compared = "processing: response_time" in text
    assert not any("data wait" in flow.excuse for flow in result.flows if is_compared)


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


QUEUED = """
dse: 1
name: queued
processing: response_time
deadlines: none
processor_types: {c: {}}
processors: {p: {type: c}}
executors: {e: {processor: p, kind: fifo, priority: 5}}
devices: {d: {period: PERIOD}, g: {period: PERIOD}}
threads:
  t: {executor: e, compute_execution_time: WORK, dispatch_protocol: aperiodic, queue_size: 2}
  u: {HOME, compute_execution_time: 1 ms}
connections: {c1: {from: d, to: t}, c2: {from: g, to: t}}
flows: {f: {path: [d, t]}}
objectives: [minimise price]
"""


def observed_ms(period: str, work: str, home: str) -> dict[str, int]:
    text = QUEUED.replace("PERIOD", period).replace("WORK", work).replace("HOME", home)
    result = dse.simulate(text, offsets="zero", execution="max")
    assert not result.contradictions
    return {item.name: round(item.observed_ns / 10**6) for item in result.tasks}


def test_a_message_that_waits_in_a_thread_of_an_executor_goes_before_less_urgent_threads() -> None:
    assert observed_ms("8 ms", "1 ms", "processor: p, priority: 1, period: 8 ms") == {"t": 2, "u": 3}


def test_a_message_that_waits_in_a_thread_of_a_fifo_keeps_its_turn() -> None:
    """Both messages come at 0; jobs of u that come from 3 ms on go behind the second one."""
    assert observed_ms("24 ms", "4 ms", "executor: e, period: 3 ms") == {"t": 8, "u": 9}
