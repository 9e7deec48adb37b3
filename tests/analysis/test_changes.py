"""Changes against the baseline, from the file to the second proof, on a problem worked out by hand.

Thread t1 takes 4 ms of 20 ms (20 %; 2 ms on a `big` processor), t2 6 ms (30 %), t3 9 ms (45 %, or 22.5 % at 40 ms).
All run on `left` today: 95 %. One change: t3 at 40 ms, 72.5 %. Two: t3 moves to `right`, which is then there: 50 %.
Three: t2 moves instead and t3 slows down: 20 + 22.5 = 42.5 %. With a big processor in `left` 10 + 22.5 = 32.5 %.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.answers.ranking.order import ranked_by
from dse.cli.main import run
from dse.questions.robust.robust import solve_robust
from dse.report.plots.front import axis_title

HAND = """
dse: 1
name: running
processor_types: {cpu: {price: 100 EUR}, big: {price: 150 EUR}}
processors: {left: {type: [cpu, big]}, right: {type: cpu, optional: true}}
devices: {sensor: {period: 20 ms}}
threads:
  t1:
    processor: [left, right]
    dispatch_protocol: [aperiodic, periodic]
    period: [10 ms, 20 ms]
    compute_execution_time: {cpu: 2 ms .. 4 ms, big: 1 ms .. 2 ms}
  t2: {processor: [left, right], period: 20 ms, compute_execution_time: 2 ms .. 6 ms}
  t3: {processor: [left, right], period: [20 ms, 40 ms], compute_execution_time: 2 ms .. 9 ms}
connections: {c1: {from: sensor, to: t1}, c2: {from: sensor, to: t2}, c3: {from: sensor, to: t3}}
flows: {f1: {path: [sensor, t1]}, f2: {path: [sensor, t2]}, f3: {path: [sensor, t3]}}
requirements: [utilisation <= 100 %]
objectives: [minimise utilisation, minimise changes]
baseline:
  left: {type: cpu}
  right: {type: none}
  t1: {processor: left, dispatch_protocol: periodic, period: 20 ms}
  t2: {processor: left, period: 20 ms}
  t3: {processor: left, period: 20 ms}
"""
FRONT = {(950_000, 0), (725_000, 1), (500_000, 2), (425_000, 3), (325_000, 4)}
COSTS = "cost_of_change: {left: {type: 5}, t1: {processor: 2, dispatch_protocol: 0}}\n"
ALL_THERE = ["t1.processor = left", "t2.processor = left", "t3.processor = left", "left.type = cpu"]


def vectors(result: dse.Result) -> set[tuple[int, ...]]:
    return {tuple(point.objectives.values()) for point in result.front}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "running.yaml"
    path.write_text(HAND, encoding="utf-8")
    return path


def test_as_little_change_as_possible() -> None:
    result = dse.solve(dse.loads(HAND))
    assert result.status == "complete"
    assert vectors(result) == FRONT
    assert result.units["changes"] == ""
    assert vectors(dse.solve(dse.loads(HAND + COSTS))) == {*(FRONT - {(325_000, 4)}), (325_000, 8)}


def test_the_most_that_may_change() -> None:
    for limit in ({"max_changes": "2"}, {"require": "changes <= 2"}, {"require": "changes < 5/2"}):
        result = dse.solve(dse.loads(HAND), minimise="utilisation", **limit)  # type: ignore[arg-type]
        assert vectors(result) == {(500_000,)}
        assert result.front[0].metrics["changes"] == 2
    assert vectors(dse.solve(dse.loads(HAND), maximise="changes", fix=ALL_THERE)) == {(2,)}


@pytest.mark.parametrize(
    ("fix", "count"),
    [
        (["t1.dispatch_protocol = periodic", "t1.period = 20 ms"], 1),
        (["t1.dispatch_protocol = periodic", "t1.period = 10 ms"], 2),
        (["t1.dispatch_protocol = aperiodic"], 2),  # the period falls away with it
    ],
)
def test_what_falls_away_is_no_change(fix: list[str], count: int) -> None:
    result = dse.solve(dse.loads(HAND), minimise="changes", fix=[*ALL_THERE, "t3.period = 40 ms", *fix])
    assert vectors(result) == {(count,)}


def test_the_cost_of_changing_what_is_fixed_is_told() -> None:
    fixed = dse.loads(HAND + "cost_of_change: {t1: {compute_execution_time: 2}, t3: {period: 2}}")
    [told] = [remark for remark in dse.check(fixed).remarks if "cost of changing" in remark]
    assert told == "the cost of changing t1.compute_execution_time is not counted: it is no open decision"


def test_what_the_baseline_leaves_out_is_no_change(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    partly = HAND.replace("  right: {type: none}\n", "").replace("  t3: {processor: left, period: 20 ms}\n", "")
    assert vectors(dse.solve(dse.loads(partly))) == {(500_000, 0), (400_000, 1), (325_000, 2)}
    remarks = dse.check(dse.loads(partly + "cost_of_change: {t3: {period: 2}}")).remarks
    [left] = [remark for remark in remarks if "open" in remark]
    assert left.startswith(
        "the baseline leaves right.type, t3.processor, t3.period open: what a design chooses there is"
    )
    assert "the cost of changing t3.period is not counted: the baseline does not state it" in remarks
    file.write_text(partly, encoding="utf-8")
    assert run(["solve", str(file), "--minimise", "utilisation", "--max-changes", "1"]) == 0
    assert "  Changes  1 change: left from cpu to big.\n" in capsys.readouterr().out


def test_reports_name_the_changes(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["solve", str(file), "--top", "all", "--explain"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Against the baseline: 2 changes: right from none to cpu; t3.processor from left to right. Gains:" in said
    assert "percentage points more (22.5 percentage points per change)" in said
    assert run(["solve", str(file), "--minimise", "changes", "--explain"]) == 0
    assert "Against the baseline: No change is counted. Unchanged: changes." in capsys.readouterr().out
    file.write_text(HAND + COSTS, encoding="utf-8")
    assert (
        run(["solve", str(file), "--fix", "t1.dispatch_protocol = aperiodic", "--minimise", "changes", "--explain"])
        == 0
    )
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "1 change at a cost of 0: t1.dispatch_protocol from periodic to aperiodic (0) (with it: no t1.period)" in said
    )


def test_ranking_by_the_baseline_counts_the_same() -> None:
    asked = dse.loads(HAND + COSTS).ask(minimise=["utilisation", "price", "changes"])
    result = ranked_by(dse.solve(asked), "baseline")
    counted = [point.objectives["changes"] for point in result.front]
    assert counted == sorted(counted)
    assert {point.rank for point in result.front if point.objectives["changes"] == counted[0]} == {1}


def test_cores_are_no_changes() -> None:
    """In time both threads are on two cores only, whatever the baseline says of these."""
    text = """
dse: 1
name: cores
overload: allowed
processor_types: {duo: {cores: 2}}
processors: {box: {type: duo}}
threads:
  t1: {processor: box, period: 10 ms, deadline: 10 ms, core: any, compute_execution_time: 6 ms}
  t2: {processor: box, period: [10 ms, 20 ms], deadline: 10 ms, core: any, compute_execution_time: 6 ms}
flows: {f: {path: [t1]}}
deadlines: all
objectives: [minimise changes, minimise utilisation]
baseline: {t1: {core: 1}, t2: {core: 1, period: 10 ms}}
"""
    assert vectors(dse.solve(dse.loads(text))) == {(0, 1_200_000), (1, 900_000)}
    assert not any("core" in remark for remark in dse.check(dse.loads(text)).remarks)


def test_exported_designs_are_where_changes_start(tmp_path: Path, file: Path) -> None:
    file.write_text(HAND + COSTS, encoding="utf-8")
    result = dse.solve(file)
    chosen = next(point for point in result.front if point.objectives["changes"] == 3)
    again = dse.loads(dse.export(result, chosen.id))
    assert vectors(dse.solve(again)) == {(425_000, 0)}
    assert vectors(dse.solve(again, minimise="changes", require="changes <= 0")) == {(0,)}


def test_sweeps(file: Path) -> None:
    result = dse.sweep(file, vary="changes=0..4", minimise="utilisation")
    stretches = result.to_dict()["runs"][0]["stretches"]
    assert [stretch["from"] for stretch in stretches] == [0, 1, 2, 3, 4]
    assert dse.sweep(file, vary="changes=0,2", minimise="utilisation").status == "complete"
    varied = dse.sweep(file, vary="threads.t2.period=20 ms,30 ms")  # the baseline states this fixed field, too
    assert [row["status"] for row in varied.to_dict()["runs"]] == ["complete", "complete"]


@pytest.mark.parametrize("method", ["exhaustion", "model"])
def test_proved_a_second_time(method: Any, file: Path, tmp_path: Path) -> None:
    path = tmp_path / "running.json"
    file.write_text(HAND + COSTS, encoding="utf-8")
    path.write_text(dse.solve(file, require="changes <= 7").to_json(), encoding="utf-8")
    assert not dse.verify(path, method=method).findings
    data = json.loads(path.read_text(encoding="utf-8"))
    for refuted in data["refuted"]:
        refuted["max(utilisation)"] += 100_000
    path.write_text(json.dumps(data), encoding="utf-8")
    assert dse.verify(path, method=method).findings


def test_robust_designs_with_few_changes() -> None:
    """t3 may take 12 ms: on `left` beside t2 and t1 that is 20 + 30 + 60 = 110 % at 20 ms, 80 % at 40 ms."""
    stated = "uncertainty: {threads.t3.compute_execution_time.max: {range: 8 ms .. 12 ms}}\n"
    found = solve_robust(dse.loads(HAND + stated), minimise="changes")
    assert vectors(found.nominal) == {(0,)}
    assert vectors(found.robust) == {(1,)}


def test_explained(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", str(file), "--max-utilisation", "45%", "--max-changes", "1"]) == 4
    said = " ".join(capsys.readouterr().out.split())
    assert "changes <= 1 (command line): feasible with 3 (+2): `changes <= 3`" in said


def test_figures_without_a_unit_have_none_in_headings() -> None:
    thirds = HAND.replace("objectives:", "metrics: {effort: changes / 3}\nobjectives:")
    result = dse.solve(dse.loads(thirds), minimise=["utilisation", "effort"], require="effort <= 1")
    assert vectors(result) == {(950_000, 0), (725_000, 1), (500_000, 2), (425_000, 3)}
    assert "effort [1/3],latency" in result.to_csv().replace("max(utilisation) [ppm],", "")
    assert {"changes", "effort [1/3]"} <= set(result.frame("exact").columns)
    assert axis_title(dse.solve(dse.loads(HAND)), 1) == ["changes"]
