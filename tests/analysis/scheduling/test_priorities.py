"""The order of the threads of a core, against published response times and by hand."""

from __future__ import annotations

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import all_responses
from dse.analysis.views import View
from dse.questions.problem import loads

LEHOCZKY = """
dse: 1
name: Lehoczky 1990
processor_types: {cpu: {}}
processors: {p: {type: cpu}}
threads:
  one: {processor: p, period: 100 ms, compute_execution_time: 52 ms, priority: ONE}
  two: {processor: p, period: 140 ms, compute_execution_time: 52 ms, priority: TWO}
objectives: [minimise utilisation of p]
"""


def times_ms(text: str) -> dict[str, int | None]:
    """The response time of each thread in the only design, in whole ms."""
    space = loads(text).space
    assert all(len(item.options) == 1 for item in space.decisions)
    found = all_responses(space, View((0,) * len(space.decisions)))
    Evaluator(space).evaluate((0,) * len(space.decisions))
    return {
        space.components[key[0]].name: None if time is None else int(time / 10**6)
        for key, time in found.items()
        if key[1] == "thread"
    }


@pytest.mark.parametrize(
    ("one", "two", "expected"),
    [
        ("rate_monotonic", "rate_monotonic", (52, 156)),
        ("2", "1", (52, 156)),
        ("1", "2", (108, 52)),
        ("rate_monotonic", "1", (108, 52)),
    ],
)
def test_the_example_of_lehoczky(one: str, two: str, expected: tuple[int, int]) -> None:
    """J. P. Lehoczky, "Fixed priority scheduling of periodic task sets with arbitrary deadlines", RTSS 1990."""
    found = times_ms(LEHOCZKY.replace("ONE", one).replace("TWO", two))
    assert (found["one"], found["two"]) == expected


THREE = """
dse: 1
name: three
processor_types: {cpu: {LEVELS}}
processors: {p: {type: cpu}}
threads:
  slow: {processor: p, period: 50 ms, deadline: 6 ms, compute_execution_time: 3 ms, priority: deadline_monotonic}
  fast: {processor: p, period: 10 ms, compute_execution_time: 2 ms, priority: FAST}
  rest: {processor: p, period: 20 ms, compute_execution_time: 1 ms, priority: deadline_monotonic}
objectives: [minimise utilisation of p]
"""


@pytest.mark.parametrize(
    ("fast", "levels", "expected"),
    [
        ("rate_monotonic", "", (3, 5, 6)),  # 6 ms before 10 ms before 20 ms
        ("deadline_monotonic", "", (3, 5, 6)),  # without a deadline its period counts
        ("7", "", (5, 2, 6)),
        ("7", "priority_levels: 3", (5, 2, 6)),
        ("7", "priority_levels: 2", (6, 2, 6)),  # the last level has both
        ("7", "priority_levels: 1", (6, 6, 6)),
    ],
)
def test_numbers_go_first_then_times_and_the_last_level_is_shared(
    fast: str, levels: str, expected: tuple[int, ...]
) -> None:
    found = times_ms(THREE.replace("FAST", fast).replace("LEVELS", levels))
    assert (found["slow"], found["fast"], found["rest"]) == expected
