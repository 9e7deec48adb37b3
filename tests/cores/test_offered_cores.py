"""Cores that are offered in any order, and executors that are decisions: fronts and first designs against all designs.

Equal cores are searched once; the first design in the order of the file has to stay, and none may be lost because a
thread may have its core from several executors.
"""

from __future__ import annotations

import random

import pytest

import dse
from dse.support.errors import ProblemError
from tests.helpers.effort import cases

LISTS = """
dse: 1
name: cores in any order
processor_types: {A: {cores: 3, price: 10 EUR}}
processors: {p0: {type: A}}
threads:
  t0: {processor: p0, core: [2, 1], period: [4 ms, 8 ms], compute_execution_time: 4 ms}
  t1: {processor: p0, period: 4 ms, compute_execution_time: 3 ms}
  t2: {processor: p0, period: [10 ms, 20 ms], compute_execution_time: 3 ms}
objectives: [minimise response time of t2]
"""
ONE_STATED = """
dse: 1
name: one executor has a core
processor_types: {A: {cores: 2, price: 10 EUR}}
processors: {p0: {type: A}}
executors:
  E1: {processor: p0, kind: fifo, core: any}
  E2: {processor: p0, kind: fifo, core: [1]}
threads:
  t0: {processor: p0, core: any, period: 10 ms, compute_execution_time: 3 ms}
  t1: {executor: [E2, E1], period: 4 ms, compute_execution_time: 3 ms}
  t2: {executor: [E1, E2], period: 8 ms, compute_execution_time: 3 ms}
objectives: [minimise response time of t1]
"""
OTHER_ORDER = """
dse: 1
name: executors do not follow each other as their threads do
processor_types: {A: {cores: 3, price: 10 EUR}}
processors: {p0: {type: A}}
executors:
  E1: {processor: p0, kind: fifo, core: any}
  E2: {processor: p0, kind: fifo, core: any}
threads:
  t0: {executor: E2, period: 8 ms, compute_execution_time: 1 ms}
  t1: {executor: [E1, E2], period: 4 ms, compute_execution_time: 3 ms}
  t2: {executor: [E2, E1], period: [4 ms, 8 ms], compute_execution_time: 3 ms}
  t3: {processor: p0, core: any, period: 10 ms, compute_execution_time: 3 ms}
objectives: [minimise response time of t2, minimise utilisation of p0]
"""


def decisions_of(text: str) -> list[dict[str, str]]:
    """The decisions of every point, after every design was looked at."""
    problem = dse.loads(text)
    found = dse.solve(problem)
    assert dse.verify(found, problem=problem, method="exhaustion").status == "verified"
    points = found.to_dict()["front"]
    assert not any(point.get("is_first") is False for point in points)
    return [point["decisions"] for point in points]


def test_the_first_design_has_the_cores_that_are_offered_first() -> None:
    [design] = decisions_of(LISTS)
    assert [design[f"t{number}.core"] for number in range(3)] == ["2", "1", "3"]


def test_no_design_is_lost_where_a_thread_has_its_core_from_one_of_several_executors() -> None:
    [design] = decisions_of(ONE_STATED)
    assert design == {"t1.executor": "E2", "t2.executor": "E1", "t0.core": "2", "E1.core": "2"}


def test_the_first_design_is_the_first_where_executors_are_decided() -> None:
    [design] = decisions_of(OTHER_ORDER)
    assert (design["E2.core"], design["E1.core"], design["t3.core"]) == ("1", "2", "2")


def drawn(source: random.Random) -> str:
    """Up to four threads, most of them in one of two executors, on up to three cores; lists of cores in any order."""
    count = source.choice((2, 3, 3))

    def core() -> str:
        listed = source.sample(range(1, count + 1), source.randint(1, count))
        return "any" if source.random() < 0.6 else str(listed)

    lines = ["dse: 1", "name: drawn", f"processor_types: {{A: {{cores: {count}, price: 10 EUR}}}}"]
    lines += ["processors: {p0: {type: A}}"]
    threads, used = [], set()
    for number in range(source.randint(2, 4)):
        home = f"processor: p0, core: {core()}"
        if source.random() < 0.6:
            among = source.choice((["E1"], ["E2"], ["E1", "E2"], ["E2", "E1"]))
            used |= set(among)
            home = f"executor: [{', '.join(among)}]"
        period = source.choice(("4 ms", "8 ms", "[4 ms, 8 ms]", "10 ms"))
        threads += [f"  t{number}: {{{home}, period: {period}, compute_execution_time: {source.randint(1, 3)} ms}}"]
    if used:
        lines += ["executors:", *(f"  {name}: {{processor: p0, kind: fifo, core: {core()}}}" for name in sorted(used))]
    more = source.choice(("", ", minimise utilisation of p0"))
    lines += ["threads:", *threads, f"objectives: [minimise response time of t{source.randrange(len(threads))}{more}]"]
    if source.random() < 0.3:
        lines += [source.choice(("deadlines: all", "overload: allowed", "requirements: ['utilisation of p0 <= 80 %']"))]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("seed", cases(60, 72_000))
def test_fronts_and_first_designs_are_those_of_all_designs(seed: int) -> None:
    text = drawn(random.Random(seed))
    try:
        problem = dse.loads(text)
    except ProblemError:
        pytest.skip("no core exists for a thread")
    found = dse.solve(problem)
    for method in ("exhaustion", "model"):
        said = dse.verify(found, problem=problem, method=method)
        assert said.status == "verified", (text, said.findings)
