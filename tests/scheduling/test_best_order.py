"""The best order of threads: the test of Audsley against every order, and what the search and its proof make of it."""

from __future__ import annotations

import random
from itertools import permutations
from pathlib import Path

import pytest

import dse
from dse.analysis.limits import judge
from dse.analysis.placement.heuristics import core_limits
from dse.analysis.placement.priority_assignment import with_best_order
from dse.analysis.views import View
from dse.encode.scheduling import contention
from dse.encode.scheduling.orders import order_reasons
from dse.questions.problem import loads
from tests.helpers.effort import cases

HEAD = """
dse: 1
name: orders
deadlines: all
priorities: any
processor_types: {{cpu: {{cores: {cores}, price: 1 EUR}}}}
processors: {{p: {{type: cpu}}}}
threads:
"""


def drawn(seed: int) -> str:
    """Four threads with deadlines before and behind their periods, and some sections, on one core."""
    rng = random.Random(seed)
    lines = []
    for number in range(4):
        period = rng.choice((8, 10, 12, 15, 20))
        work = rng.randint(1, max(1, period * 2 // 5))
        fields = [f"processor: p, period: {period} ms, compute_execution_time: {work} ms"]
        if rng.random() < 0.7:
            fields.append(f"deadline: {rng.randint(work, 2 * period)} ms")
        if rng.random() < 0.4:
            fields.append(f"non_preemptive: {rng.randint(1, 4)} ms")
        lines.append(f"  t{number}: {{{', '.join(fields)}}}")
    return HEAD.format(cores=1) + "\n".join(lines) + "\nobjectives: [minimise price]\noverload: allowed\n"


@pytest.mark.parametrize("seed", cases(60))
def test_an_order_is_found_exactly_where_there_is_one(seed: int) -> None:
    space = loads(drawn(seed)).space
    limits = core_limits(space)
    fixed = (0,) * space.first_order
    there = any(
        all(judge(limit, View((*fixed, *order))).holds for limit in limits)
        for order in permutations(range(len(space.open_priorities)))
    )
    found = list(with_best_order(space, (*fixed, 0, 0, 0, 0), space.open_priorities, limits))
    assert any(all(judge(limit, View(design)).holds for limit in limits) for design in found) == there


THREE = """  a: {processor: p, period: [5 ms, 12 ms], compute_execution_time: 4 ms, deadline: 9 ms}
  b: {processor: p, period: 10 ms, compute_execution_time: 3 ms, deadline: 4 ms}
  c: {processor: p, period: 30 ms, compute_execution_time: 2 ms}
objectives: [minimise utilisation of p]
"""


def test_the_order_of_deadlines_is_shown_and_decides() -> None:
    """B before a: 3 ms and 3 + 4 = 7 ms; the rates say a before b, which ends at 4 + 3 = 7 ms then, not within 4 ms."""
    text = HEAD.format(cores=1) + THREE
    assert dse.solve(dse.loads(text.replace("priorities: any\n", ""))).front[0].decisions["a.period"] == "12 ms"
    result = dse.solve(dse.loads(text))
    (point,) = result.front
    chosen = [point.decisions[f"{name}.priority"] for name in "abc"]
    assert (point.decisions["a.period"], chosen) == ("12 ms", ["2", "3", "1"])
    rates = text.replace("period: 10 ms", "period: 13 ms").replace("priorities: any\n", "")
    assert dse.solve(dse.loads(rates)).status == "infeasible"
    assert dse.solve(dse.loads(text.replace("period: 10 ms", "period: 13 ms"))).status == "complete"


def test_without_rows_and_moves_lessons_name_threads_that_no_order_saves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contention, "add_rows", lambda *_: [])
    seen = []

    def noted(*given: object) -> object:
        for reason, group in order_reasons(*given):  # type: ignore[arg-type]
            seen.append((len(reason.conditions), group))
            yield reason, group

    monkeypatch.setattr(contention, "order_reasons", noted)
    lines = "".join(
        f"  t{n}: {{processor: p, period: [5 ms, {10 + n} ms], compute_execution_time: 3 ms}}\n" for n in range(5)
    )
    text = HEAD.format(cores=2) + lines + "objectives: [maximise utilisation of p]\n"
    result = dse.solve(dse.loads(text.replace("deadlines: all", "deadlines: all\noverload: allowed")), workers=1)
    assert result.status == "complete"
    assert seen
    assert all(len(group) in (2, 3) for _, group in seen)
    assert {conditions // len(group) for conditions, group in seen} == {2}  # a rate and a time of each


def test_chosen_orders_are_exported_and_can_be_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "asked.yaml"
    file.write_text(HEAD.format(cores=1) + THREE, encoding="utf-8")
    result = dse.solve(dse.load(file))
    again = dse.loads(dse.export(result, result.front[0].id))
    assert [again.loaded.spec.threads[name].priority for name in "abc"] == [(2,), (3,), (1,)]
    assert dse.analyse(again).is_feasible
    assert dse.analyse(dse.load(file), design=["a.period = 12 ms"]).is_feasible
    assert not dse.analyse(dse.load(file), design=["a.period = 12 ms", "b.priority = 1"]).is_feasible
