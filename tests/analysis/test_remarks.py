"""What is remarked of designs and problems whose figures contradict each other."""

from __future__ import annotations

import pytest

import dse

TWO = """
dse: 1
name: minima above maxima
profile: PROFILE
worst_case: deadline
processor_types: {c: {}}
processors: {p: {type: c}}
threads:
  a: {processor: p, period: 20 ms, compute_execution_time: [5 ms .. 8 ms, 1 ms], deadline: 3 ms}
  b: {processor: p, period: 20 ms, compute_execution_time: 5 ms .. 8 ms}
connections: {w: {from: a, to: b}}
flows: {f: {path: [a, b]}}
"""
DEADLINE = "a at least 5 ms (processing time), at most 3 ms (deadline)"
NOTHING = "b at least 5 ms (processing time), at most 0 ns (no latency)"


@pytest.mark.parametrize(
    ("profile", "named"), [("osate-2.2", f"{DEADLINE}; {NOTHING}"), ("osate-2.19", DEADLINE), ("dse", "")]
)
def test_a_minimum_above_its_maximum_is_remarked_on(profile: str, named: str) -> None:
    problem = dse.loads(TWO.replace("PROFILE", profile))
    head = f"the maximum and the jitter of f are too small: by profile {profile} (worst case by deadline) it counts for"
    expected = [f"{head} {named}"] if named else []
    assert [text for text in dse.check(problem).remarks if "too small" in text] == expected
    analysis = dse.analyse(problem, {"a.compute_execution_time": "5 ms .. 8 ms"})
    assert [text for text in analysis.warnings if "too small" in text] == expected
    [flow] = analysis.flows
    assert any(row.min_ns > row.max_ns for row in flow.rows) == bool(named)


def test_an_equality_of_utilisation_looks_at_the_sum_alone() -> None:
    """70 % on each of two cores keeps == 70 % and so do 100 % and 40 %; nobody should read more into it."""
    text = TWO.replace("PROFILE", "dse") + "requirements: [utilisation of p == 70 %, utilisation of p >= 1 %]\n"
    found = [remark for remark in dse.check(dse.loads(text)).remarks if "compares the sum" in remark]
    said = "compares the sum over all cores, not each thread and core: `utilisation of p <= 70 %` limits these too"
    assert found == [f"utilisation of p == 70 % {said}"]


def test_a_stated_response_time_below_the_execution_time_is_remarked_on_too() -> None:
    text = TWO.replace("PROFILE", "dse").replace("deadline: 3 ms", "response_time: 2 ms .. 4 ms")
    found = [remark for remark in dse.check(dse.loads(text)).remarks if "too small" in remark]
    assert len(found) == 1
    assert found[0].endswith("it counts for a at least 5 ms (processing time), at most 4 ms (response time)")
