"""Chains of event-triggered threads on computers that may be overloaded: fronts and conflicts against every design.

What the source of a chain waits for is the jitter of what follows; where several on the way have no bound, that has
none either, and a design that nothing limits stays one all the same.
"""

from __future__ import annotations

import random
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.encode.scheduling import waiting_forms
from dse.questions.problem import load
from dse.search.feasibility.oracle import Oracle
from dse.search.front import search_front
from dse.verification import tables
from tests.helpers.effort import cases
from tests.helpers.support import brute_front


def drawn(source: random.Random, overload: str) -> dict[str, Any]:
    """A timer or a device, two to four threads that it releases one after the other, and others beside them."""
    types = {"slow": {"cores": source.choice((1, 2)), "price": "10 EUR"}}
    types["fast"] = {"cores": source.choice((1, 2)), "price": "20 EUR"}

    def execution() -> dict[str, str]:
        slow = source.randint(2, 9)
        return {"slow": f"1 ms .. {slow} ms", "fast": f"1 ms .. {max(1, slow // 2)} ms"}

    names = [f"t{number}" for number in range(source.randint(2, 4))]
    threads: dict[str, Any] = {
        name: {"processor": "p", "dispatch_protocol": "aperiodic", "compute_execution_time": execution()}
        for name in names
    }
    threads["timer"] = {
        "processor": "p",
        "dispatch_protocol": "periodic",
        "period": source.choice((["5 ms", "20 ms"], "5 ms", "10 ms")),
        "compute_execution_time": execution(),
    }
    if source.random() < 0.5:
        threads["beside"] = {
            "processor": "p",
            "period": source.choice((["4 ms", "40 ms"], "12 ms")),
            "compute_execution_time": execution(),
        }
    if source.random() < 0.4:
        for thread in threads.values():
            thread["core"] = "any"
    path = ["timer", *names]
    wires = {f"c{number}": {"from": path[number], "to": name} for number, name in enumerate(names)}
    return {
        "dse": 1,
        "name": "An overloaded chain",
        "processing": "response_time",
        "overload": overload,
        "processor_types": types,
        "processors": {"p": {"type": ["slow", "fast"]}},
        "threads": threads,
        "connections": wires,
        "flows": {"all": {"path": path}},
        "objectives": source.choice((["minimise price"], ["minimise price", "minimise latency of all"])),
    }


@pytest.mark.parametrize("limit", [1, waiting_forms.SCHEDULE_CASE_LIMIT])
@pytest.mark.parametrize("seed", cases(20, 73_000))
def test_the_front_is_that_of_all_designs(seed: int, limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", limit)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", limit)
    source = random.Random(seed)
    evaluator = Evaluator(load(drawn(source, "allowed")).space)
    search = search_front(evaluator)
    assert search.is_complete
    assert search.points.keys() == brute_front(evaluator).keys() != set()


@pytest.mark.parametrize("seed", cases(6, 75_000))
def test_such_fronts_are_proved_again(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)  # no response time is tabulated
    problem = load(drawn(random.Random(seed), "allowed"))
    result = dse.solve(problem, workers=1)
    assert dse.verify(result, problem=problem, method="model").status == "verified"


@pytest.mark.parametrize("seed", cases(10, 74_000))
def test_which_demands_have_a_design_together(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With limits that are switched off, whatever the others have taught the model before."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    source = random.Random(seed)
    problem = drawn(source, "forbidden")
    problem["requirements"] = [f"latency of all <= {source.choice((10, 20, 40))} ms", "price <= 10 EUR"]
    space = load(problem).space
    oracle = Oracle(space)
    whole = frozenset(range(len(oracle.members)))
    for kept in (whole, whole - {0}, whole - {1}, frozenset({0}), frozenset({1}), whole - {0, 1}, frozenset[int]()):
        assert (oracle.solve(kept) is None) == (not brute_front(Evaluator(oracle.space_of(kept)))), kept
