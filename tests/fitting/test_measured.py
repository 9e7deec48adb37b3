"""A design against measurements: metrics, drift of what the file states, requirements with the measured figures."""

from __future__ import annotations

import json
import random
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.answers.forms.registry import mistakes_in
from dse.answers.measured import MeasuredComparison
from dse.cli.main import run

PROBLEM = """dse: 1
name: Fusion
bus_types: {ethernet: {bandwidth: 100 Mbit/s}}
processor_types: {pc: {}}
processors: {computer: {type: pc}}
buses: {eth: {type: ethernet}}
devices: {imu: {period: 50 ms}}
threads:
  ekf: {processor: computer, compute_execution_time: 1 ms .. 2 ms, period: [20 ms, 40 ms]}
  log: {processor: computer, compute_execution_time: 1 ms}
connections:
  data: {from: imu, to: ekf, data_size: 228 B, bus: eth}
  out: {from: ekf, to: log, data_size: 10 B, rate: 5 Hz}
flows: {reaction: {path: [imu, ekf]}}
requirements: [latency of reaction <= 25 ms, utilisation of computer <= 70 %]
baseline: {ekf: {period: 20 ms}}
processing: execution_time
"""


def compare(folder: Path, text: str, *, problem: str = PROBLEM, tolerance: str = "1 %") -> MeasuredComparison:
    path = folder / "seen.csv"
    path.write_text(text, encoding="utf-8")
    return dse.compare_measured(problem, path, tolerance=tolerance)


def test_table_5_2_is_told_as_the_report_does(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """ECE-TR-25, Table 5.2: 4,560 B/s estimated, 4,884.5 B/s measured, 6.64 % (of the measured value)."""
    (tmp_path / "p.yaml").write_text(PROBLEM, encoding="utf-8")
    (tmp_path / "m.csv").write_text("bus,load_B/s\neth,4884.5\n", encoding="utf-8")
    out = str(tmp_path / "out.json")
    assert run(["compare", str(tmp_path / "p.yaml"), "--measured", str(tmp_path / "m.csv"), "--json", out]) == 0
    assert "0.3245 KB/s beyond, 6.64 % of the measured value, 7.12 % of the predicted one" in capsys.readouterr().out
    data = json.loads(Path(out).read_text(encoding="utf-8"))
    assert list(mistakes_in("comparison", data)) == []
    [load] = data["predictions"]
    assert (load["predicted"], load["measured"]["high"], load["beyond"]) == ([None, 4560], "9769/2", "649/2")
    assert round(100 * load["of_measured"], 2) == 6.64


def test_samples_are_counted_inside_and_outside(tmp_path: Path) -> None:
    """The flow takes from 1 ms (processing at best) to 20 + 2 ms (a period, processing at worst)."""
    found = compare(tmp_path, "flow;latency [ms]\nreaction;0.9\nreaction;1\nreaction;22\nreaction;22.5\n")
    [item] = found.predictions
    assert (item.low, item.high) == (10**6, 22 * 10**6)
    assert (item.outside, item.verdict, item.beyond) == (2, "both", 500_000)
    assert item.seen.mean == Fraction(464, 40) * 10**6


def test_drift_counts_in_requirements_by_hand(tmp_path: Path) -> None:
    text = "metric,min,max,mean\nexecution time of ekf,0.5 ms,4 ms,\nperiod of ekf,21 ms,23 ms,22 ms\n"
    found = compare(
        tmp_path, text + "rate of out,9 Hz,11 Hz,\ndata size of data,100 B,456 B,\nrate of imu,19.9 Hz,20.1 Hz,20 Hz\n"
    )
    assert {item.name: item.counted for item in found.inputs} == {
        "execution time of ekf": (500_000, 4_000_000),
        "period of ekf": (22_000_000, 22_000_000),
        "rate of out": (10, 10),
        "data size of data": (456, 456),
        "rate of imu": None,
    }
    assert [item.seen.count for item in found.inputs] == [None] * 5  # nobody says it
    kept = {item.text: item for item in found.requirements}
    latency, cpu = kept["latency of reaction <= 25 ms"], kept["utilisation of computer <= 70 %"]
    assert latency.values == (22_000_000, 26_000_000) and latency.holds == (True, False)
    assert latency.slacks == (3_000_000, -1_000_000)
    assert cpu.values == (105_000, Fraction(4, 22) * 10**6 + 10_000)
    assert kept["load of eth <= 100 % (implied)"].values == (4560, 9120)


def test_random_drift_is_what_the_edited_file_gives(tmp_path: Path) -> None:
    """The problem with the measured figures written into it says the same."""
    source = random.Random(5)
    for _ in range(6):
        low, high = sorted(source.sample(range(100, 9000), 2))
        period, size, rate = source.randint(10, 60), source.randint(229, 900), source.randint(6, 30)
        text = "metric,min,max\n" + "".join(
            [
                f"execution time of ekf,{low} us,{high} us\n",
                f"period of ekf,{period} ms,{period} ms\n",
                f"data size of data,{size} B,{size} B\nrate of out,{rate} Hz,{rate} Hz\n",
            ]
        )
        found = compare(tmp_path, text, tolerance="0.01 %")
        ends = min(low, 1000), max(high, 2000)
        edited = PROBLEM.replace("1 ms .. 2 ms", f"{ends[0]} us .. {ends[1]} us").replace("228 B", f"{size} B")
        edited = edited.replace("[20 ms, 40 ms]", f"{period} ms").replace("5 Hz", f"{rate} Hz")
        there = dse.analyse(edited.replace("baseline: {ekf: {period: 20 ms}}\n", ""))
        assert [item.values[1] for item in found.requirements] == [verdict.value for verdict in there.verdicts]
        assert [item.slacks[1] for item in found.requirements] == [verdict.slack for verdict in there.verdicts]


def test_what_is_measured_of_a_limited_metric_must_keep_the_limit_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file predicts 22 ms and 1 to 21 ms of jitter: 30 ms were seen, where 25 ms are allowed; no figure drifted."""
    text = PROBLEM.replace(
        "requirements: [", "requirements: [jitter of reaction <= 21 ms, min latency of reaction >= 1 ms, "
    )
    found = compare(tmp_path, "flow,latency_ms\nreaction,0.5\nreaction,30\n", problem=text)
    kept = {item.text: (item.observed, item.observed_holds) for item in found.requirements}
    assert kept["latency of reaction <= 25 ms"] == (30_000_000, False)
    assert kept["jitter of reaction <= 21 ms"] == (29_500_000, False)
    assert kept["min latency of reaction >= 1 ms"] == (500_000, False)
    assert kept["utilisation of computer <= 70 %"] == (None, None) and not found.still_holds
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
    here, there = str(tmp_path / "p.yaml"), str(tmp_path / "seen.csv")
    assert run(["compare", here, "--measured", there]) == 4
    told = " ".join(capsys.readouterr().out.split())
    assert "latency of reaction <= 25 ms: 30 ms was measured" in told
    assert "jitter of reaction <= 21 ms: 29.5 ms was measured" in told
    (tmp_path / "seen.csv").write_text("flow,latency_ms\nreaction,1\nreaction,21.9\n", encoding="utf-8")
    assert run(["compare", here, "--measured", there]) == 0


def test_a_design_of_a_result_and_plots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.yaml").write_text(PROBLEM.replace("<= 25", "<= 45") + "objectives: [minimise utilisation of computer]\n")
    Path("m.csv").write_text("metric,sample_ms\nlatency of reaction,41\nexecution time of ekf,9\n", encoding="utf-8")
    assert run(["solve", "p.yaml", "--json", "r.json"]) == 0
    options = [
        "--measured",
        "m.csv",
        "--design",
        "r.json#1",
        "--json",
        "o.json",
        "--figures",
        "plots",
        "--report",
        "o.html",
    ]
    assert run(["compare", "p.yaml", *options]) == 4
    data = json.loads(Path("o.json").read_text(encoding="utf-8"))
    assert data["decisions"] == {"ekf.period": "40 ms"} and data["predictions"][0]["verdict"] == "inside"
    assert data["requirements"][0]["measured"] == {"value": 49_000_000, "slack": -4_000_000, "holds": False}
    page = Path("o.html").read_text(encoding="utf-8")
    assert len(list(Path("plots").glob("*.svg"))) == 1 and "latency of reaction" in page
    assert '<p class="badge infeasible">' in page
    Path("m.csv").write_text("metric,sample_ms\nlatency of reaction,41\n", encoding="utf-8")
    assert run(["compare", "p.yaml", *options]) == 0
    assert '<p class="badge">' in Path("o.html").read_text(encoding="utf-8")


BAD = {
    "empty": ("", "seen.csv:1: the file is empty"),
    "no row": ("metric,sample\n", "seen.csv:1: there is no row"),
    "no subject": ("a,sample\n1,2 ms\n", "seen.csv:1: no column says what was measured"),
    "no figure": ("metric,b\nlatency of reaction,2 ms\n", "seen.csv:1: no column holds figures"),
    "both": ("metric,sample,min,max\nload of eth,1 B/s,1 B/s,1 B/s\n", "samples, or the least and greatest of many"),
    "cut off": ("metric,sample\nload of eth\n", "seen.csv:2: 1 cells, but the header has 2"),
    "no unit": ("metric,sample\nlatency of reaction,3\n", "seen.csv:2: sample: expected a figure with its unit"),
    "other unit": ("metric,sample\nlatency of reaction,3 B\n", "seen.csv:2: latency of reaction"),
    "units change": ("metric,sample\nload of eth,3 B/s\nload of eth,3 %\n", "seen.csv:3: load of eth was in B/s"),
    "negative": ("metric,sample\nlatency of reaction,-3 ms\n", "expected a figure of at least 0"),
    "no metric": ("metric,sample\nlatencie of reaction,3 ms\n", "seen.csv:2: latencie of reaction"),
    "no flow": ("metric,sample\nlatency of raction,3 ms\n", "seen.csv:2: latency of raction"),
    "no thread": ("thread,execution_time_ms\nekg,3\n", "there is no such thread or device (did you mean"),
    "unit of input": ("metric,sample\nperiod of ekf,3 B\n", "seen.csv:2: period of ekf: B is no unit of it"),
    "rate 0": ("metric,sample\nrate of ekf,0 Hz\n", "0 is no rate"),
    "period 0": ("metric,sample\nperiod of ekf,0 ms\n", "seen.csv:2: period of ekf: 0 is no rate, and no period"),
    "period below 1 ns": ("metric,sample\nperiod of ekf,0.1 ns\n", "0 is no rate, and no period"),
    "rate of a connection 0": ("metric,sample\nrate of out,0 Hz\n", "0 is no rate"),
    "period and rate": ("metric,sample\nperiod of ekf,12 ms\nrate of ekf,99 Hz\n", ":3: rate of ekf: that is stated"),
    "of which": ("metric,sample\nlatency of,3 ms\n", "seen.csv:2"),
    "twice": ("metric,min,max\nload of eth,1 B/s,2 B/s\nload of eth,1 B/s,2 B/s\n", ":3: load of eth is stated"),
    "order": ("metric,min,max\nload of eth,3 B/s,2 B/s\n", "the minimum is above the maximum"),
    "mean": ("metric,min,max,mean\nload of eth,1 B/s,2 B/s,3 B/s\n", "the mean is not between"),
    "count": ("metric,min,max,count\nload of eth,1 B/s,2 B/s,x\n", "expected the number of samples"),
    "wide": (",".join(f"c{n}" for n in range(1000)) + "\n" + "1," * 999 + "1\n", "(1000 in all)"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_measurements_are_told_with_file_and_line(name: str, tmp_path: Path) -> None:
    text, words = BAD[name]
    with pytest.raises(dse.ProblemError) as raised:
        compare(tmp_path, text)
    assert words in str(raised.value)


def test_other_encodings_and_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "p.yaml").write_text(PROBLEM, encoding="utf-8")
    (tmp_path / "m.csv").write_text("metric,sample\nload of eth,1 B/s\n", encoding="utf-16")
    here, there = str(tmp_path / "p.yaml"), str(tmp_path / "m.csv")
    assert run(["compare", here, "--measured", there]) == 3
    assert "m.csv:1: the file is not UTF-8 text (it looks like UTF-16)" in capsys.readouterr().err
    assert run(["compare", here]) == 2
    assert run(["compare", here, "x.json", "--measured", there]) == 2
    assert run(["compare", here, "x.json", "--tolerance", "1 %"]) == 2
    assert run(["compare", here, "--measured", there, "--tolerance", "much"]) == 2


@pytest.mark.parametrize(
    ("seen", "of_all", "holds"), [("50 %", None, None), ("139 %", None, None), ("141 %", 1_410_000, False)]
)
def test_a_measured_utilisation_is_the_sum_over_the_cores(
    tmp_path: Path, seen: str, of_all: int | None, holds: bool | None
) -> None:
    """Two cores, each to at most 70 %: 141 % of one core in all are too much, 139 % may or may not be."""
    two = PROBLEM.replace("{pc: {}}", "{pc: {cores: 2}}")
    found = compare(tmp_path, f"processor,utilisation\ncomputer,{seen}\n", problem=two)
    [item] = found.predictions
    assert (item.high, item.seen.high) == (Fraction(105_000), int(seen.split()[0]) * 10_000)
    [kept] = [item for item in found.requirements if "utilisation" in item.text]
    assert (kept.observed, kept.observed_holds) == (of_all, holds)


def test_a_margin_of_a_sum_over_cores_says_of_how_much_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two cores to 70 % each leave 129.5 of 140 %; 15 ms every 20 ms break one core alone, by 5 of its 70 %."""
    (tmp_path / "p.yaml").write_text(PROBLEM.replace("{pc: {}}", "{pc: {cores: 2}}"), encoding="utf-8")
    (tmp_path / "seen.csv").write_text("thread,sample_us\nekf,1000\nekf,15000\n", encoding="utf-8")
    assert run(["compare", str(tmp_path / "p.yaml"), "--measured", str(tmp_path / "seen.csv")]) == 4
    [line] = [line for line in capsys.readouterr().out.splitlines() if line.startswith("utilisation of computer")]
    assert "129.5 % of 140 %" in line and " -5 % " in line
    assert [text for text in line.split("  ") if " of " in text] == [
        "utilisation of computer <= 70 %",
        "129.5 % of 140 %",
    ]
