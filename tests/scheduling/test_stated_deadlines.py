"""Deadlines that threads state are requirements of every question: what each command makes of one."""

from __future__ import annotations

import json
import random
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.questions.problem import loads
from dse.support.errors import UsageError
from tests.helpers.effort import cases
from tests.helpers.thread_systems import draw, text_of

LATE = """
dse: 1
name: late
processor_types: {small: {cores: 2, price: 60 EUR}, large: {cores: 2, price: 240 EUR}}
processors: {computer: {type: [small, large]}}
devices: {sensor: {period: 20 ms}}
threads:
  filter: {processor: computer, period: [5 ms, 10 ms], compute_execution_time: {small: 4 ms, large: 2 ms}}
  control: {processor: computer, period: 10 ms, compute_execution_time: {small: 5 ms, large: 2 ms}, deadline: 6 ms}
  log: {processor: computer, period: 40 ms, compute_execution_time: 12 ms}
connections: {r: {from: sensor, to: filter}, s: {from: filter, to: control}}
flows: {f: {path: [sensor, filter, control]}}
objectives: [minimise price, minimise latency of f]
"""
# small: filter with control on a core gives 4 + 5 = 9 ms; apart, log (12 ms, behind both) goes beside control (80 %).
TOGETHER = ["filter.core = 1", "control.core = 1"]
DEADLINE = "response time of control <= its deadline"


def prices(result: dse.Result) -> list[int]:
    return sorted(int(point.objectives["price"] / 100) for point in result.front)


def test_each_design_of_a_front_is_in_time() -> None:
    assert prices(dse.solve(loads(LATE))) == [60, 240]
    assert prices(dse.solve(loads(LATE), fix=TOGETHER)) == [240]
    assert prices(dse.solve(loads(LATE), fix=[*TOGETHER, "filter.period = 10 ms"], deadlines="none")) == [60, 240]
    result = dse.solve(loads(LATE), fix=TOGETHER)
    assert dse.verify(result, problem=loads(LATE)).status == "verified"
    for point in result.front:
        found = dse.analyse(loads(LATE), {**point.decisions}, response_times=True)
        assert found.is_feasible
        assert {item.name: item.meets_deadline for item in found.responses["computer"]}["control"]


def test_a_thread_without_a_deadline_may_be_late() -> None:
    """Log has no bound beside both on a small core, and takes 12 + 2 * 4 = 20 ms, its period, on a large one."""
    one = LATE.replace("cores: 2", "cores: 1").replace("[5 ms, 10 ms]", "10 ms").replace(", deadline: 6 ms", "")
    one = one.replace("period: 40 ms", "period: 20 ms") + "overload: allowed\n"
    assert prices(dse.solve(loads(one))) == [60, 240]
    assert prices(dse.solve(loads(one), deadlines="all")) == [240]
    for deadline, expected in (("20 ms", [240]), ("19 ms", [])):
        stated = loads(one.replace("period: 20 ms, c", f"period: 20 ms, deadline: {deadline}, c"))
        assert prices(dse.solve(stated)) == expected


def test_conflicts_name_it_with_its_place_and_the_nearest_that_can_be_met(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(LATE.lstrip(), encoding="utf-8")
    found = dse.explain(file, fix=TOGETHER, max_price="100 EUR")
    assert found.status == "infeasible"
    [item] = [item for item in found.relaxations if item.demand.text == DEADLINE]
    assert item.demand.origin.endswith("p.yaml:8")
    assert item.closest == Fraction(3_000_000)  # 9 ms, that is 3 ms late
    fixed = dse.explain(file, fix=[*TOGETHER, "computer.type = small"], every=True)
    assert {item.demand.text: item.helps for item in fixed.relaxations} == {
        DEADLINE: True,
        "filter.core = 1": True,
        "control.core = 1": True,
        "computer.type = small": True,
    }
    result = dse.solve(file, fix=TOGETHER, max_price="100 EUR")
    assert result.status == "infeasible"
    assert dse.verify(result).status == "verified"


def test_margins_ranges_and_stopped_searches_keep_to_it(tmp_path: Path) -> None:
    apart = {"computer.type": "small", "filter.period": "10 ms", "filter.core": "1", "control.core": "2"}
    margins = dse.sensitivity(loads(LATE), apart).margins
    [own] = [item.above for item in margins if item.path == "threads.control.compute_execution_time.small"]
    assert own is not None and (own.last, own.requirement) == (6_000_000, DEADLINE)
    file, out = tmp_path / "p.yaml", tmp_path / "r.json"
    text = "uncertainty: {threads.control.compute_execution_time.small: {factor: 1 .. 1.3}}\n"
    file.write_text(LATE.lstrip() + text, encoding="utf-8")
    robust = dse.solve_robust(file)
    assert (prices(robust.nominal), prices(robust.robust)) == ([60, 240], [240])  # 6.5 ms
    out.write_text(json.dumps(dse.solve(file, fix=TOGETHER, time_limit_s=1e-9).to_dict()), encoding="utf-8")
    again = dse.resume(out, problem=file)
    assert isinstance(again, dse.Result) and prices(again) == [240]
    other = tmp_path / "other.yaml"
    other.write_text(LATE.replace("deadline: 6 ms", "deadline: 5 ms").lstrip(), encoding="utf-8")
    with pytest.raises(UsageError):
        dse.resume(out, problem=other)
    swept = dse.sweep(loads(LATE), "threads.control.deadline=1 ms,2 ms,4500 us,6 ms")
    assert [len(run.front) for run in swept.runs] == [0, 1, 1, 2]


@pytest.mark.parametrize("kind", ["plain", "stated"])
@pytest.mark.parametrize("seed", cases(8, 1))
def test_conflicts_with_fixed_cores_are_conflicts(kind: str, seed: int) -> None:
    """Before, equal cores were numbered as if none was fixed: whichever fix was given up, designs were lost."""
    rng = random.Random(f"fixed cores {kind} {seed}")
    text = text_of(draw(seed, kind=kind))
    problem = loads(text)
    fix = [
        f"{item.name} = {rng.choice(item.options)}"
        for item in problem.space.decisions
        if item.is_open and rng.random() < (0.8 if item.field == "core" else 0.4)
    ]
    found = dse.explain(problem, fix=fix, every=True)
    result = dse.solve(problem, fix=fix)
    assert (found.status == "infeasible") == (result.status == "infeasible")
    assert dse.verify(result, problem=problem, method="exhaustion").status == "verified"


FEW = """
dse: 1
name: few
processing: response_time
processor_types: {small: {cores: 4, price: 10 EUR}, large: {cores: 8, price: 42 EUR}}
processors: {p: {type: [small, large]}}
devices: {s: {period: 20 ms}}
threads:
  t0: {processor: p, period: [8 ms, 20 ms], compute_execution_time: 6 ms, deadline: 22 ms}
  t1: {processor: p, period: 15 ms, compute_execution_time: 12 ms}
  t2: {processor: p, period: 15 ms, compute_execution_time: {small: 4 ms, large: 3 ms}, deadline: 8 ms, core: [1, 2]}
connections: {w: {from: s, to: t0}, w1: {from: t0, to: t1}, w2: {from: t1, to: t2}}
flows: {f: {path: [s, t0, t1, t2]}}
requirements: [utilisation of p <= 80 %]
objectives: [minimise price, minimise latency of f]
"""


@pytest.mark.parametrize("more", ["", "priorities: any\n"])
def test_a_list_of_the_first_cores_is_no_choice_among_all(more: str) -> None:
    """Before, cores were numbered all the same: t0 every 8 ms needs a core of its own, and then t2 has the second."""
    found = dse.solve(loads(FEW + more))
    latencies = [point.objectives["latency of f"] for point in found.front]
    assert latencies == [60_000_000, 59_000_000]  # 8 + 6 + 15 + 12 + 15 + 4 ms, from the sensor on
    assert dse.verify(found, problem=loads(FEW + more)).status == "verified"


FAR = """
dse: 1
name: one deadline beyond all others
processing: response_time
processor_types: {cpu: {cores: 3}}
processors: {c: {type: cpu}}
threads:
  first: {processor: c, core: [1, 2, 3], period: 80 ms, DEADLINE, priority: 9, compute_execution_time: 3 ms}
  second: {processor: c, core: [1, 2, 3], dispatch_protocol: aperiodic, priority: 8, compute_execution_time: 16 ms}
  third: {processor: c, core: [1, 2, 3], period: 80 ms, deadline: 80 ms, priority: 7, compute_execution_time: 2 ms}
  fourth: {processor: c, core: [1, 2, 3], period: 100 ms, deadline: 100 ms, compute_execution_time: 20 ms}
connections: {w: {from: first, to: second}}
flows: {f: {path: [first, second]}, g: {path: [third]}}
rules: [second.core == first.core, third.core == first.core, fourth.core == first.core]
objectives: [minimise latency of f, minimise latency of g]
"""


@pytest.mark.parametrize("deadline", ["1e13 ms", "1e15 ms", "1e30 s"])
def test_a_deadline_that_nothing_reaches_changes_nothing(deadline: str) -> None:
    """However large it is: not even a response time without a bound, which counts as 27.8 h, is a row of it."""
    found = dse.solve(loads(FAR.replace("DEADLINE", f"deadline: {deadline}")), workers=1)
    without = dse.solve(loads(FAR.replace("DEADLINE", "deadline: 10 s")), workers=1)
    assert found.status == without.status == "complete"
    assert [point.objectives for point in found.front] == [point.objectives for point in without.front]
    assert [point.decisions for point in found.front] == [point.decisions for point in without.front]
    assert dse.check(loads(FAR.replace("DEADLINE", f"deadline: {deadline}")))
