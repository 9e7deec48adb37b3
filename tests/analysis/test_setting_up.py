"""What problems of thousands of threads are set up with is found once for all, not for each bus, rule or flow anew."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

import dse
from dse.analysis import timescale, usage
from dse.analysis.evaluate import Evaluator
from dse.spec.language.rules import RuleParser, _longest

THREADS, BUSES = 40, 8


def text() -> str:
    lines = ["dse: 1", "name: many", "overload: allowed", "processor_types: {P: {}}", "processors: {p: {type: P}}"]
    lines += ["bus_types: {can: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 10 us}}}", "buses:"]
    lines += [f"  b{number}: {{type: can}}" for number in range(BUSES)] + ["threads:"]
    lines += [
        f"  t{number}: {{processor: p, period: [5 ms, 10 ms], compute_execution_time: 1 us}}"
        for number in range(THREADS)
    ]
    lines += ["connections:"]
    lines += [
        f"  c{number}: {{from: t{number}, to: t{number + 1}, data_size: 1 B, bus: b{number % BUSES}}}"
        for number in range(THREADS - 1)
    ]
    lines += ["flows:"] + [f"  f{number}: {{path: [t{number}, t{number + 1}]}}" for number in range(THREADS - 1)]
    lines += ["rules:"] + [f"  - t{number}.period == t{number + 1}.period" for number in range(THREADS - 1)]
    return "\n".join([*lines, "objectives: [minimise latency of f0]"])


def test_each_connection_is_asked_once_for_its_buses_and_its_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each bus and each flow asked every connection."""
    asked: Counter[str] = Counter()
    for module, name in ((usage, "carriers"), (timescale, "wrapping")):
        own = getattr(module, name)

        def counting(*arguments: Any, name: str = name, own: Any = own) -> Any:
            asked[name] += 1
            return own(*arguments)

        monkeypatch.setattr(module, name, counting)
    evaluator = Evaluator(dse.loads(text()).space)
    assert len(evaluator.metrics) > THREADS
    assert asked["wrapping"] == THREADS - 1
    assert asked["carriers"] <= 6 * (THREADS - 1) < BUSES * (THREADS - 1)


def test_names_are_measured_once_for_all_rules() -> None:
    names, bare = frozenset({"a.period", "b.period"}), frozenset({"b"})
    _longest.cache_clear()
    for _ in range(3):
        RuleParser("a.period == b.period", names, bare)
    assert (_longest.cache_info().misses, _longest.cache_info().hits) == (1, 2)
