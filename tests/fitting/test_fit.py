"""`dse fit`: what is told of measurements, and that what it writes is a catalogue that answers with it."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import dse
from dse.cli.main import run
from dse.fitting.lines import (
    LinearModel,
    Points,
    below_upper,
    envelope,
    least_squares,
    lower_envelope_parts,
    squares_parts,
)
from dse.spec.loading.load import parse_spec
from tests.helpers.small import TABLES

US = 1000


def sweep(path: Path, wide: range, seed: int = 1) -> Path:
    """Round trips like those of section 5.3: 76 to 14,020 B in steps of 560 B, with a spread that jumps in `wide`."""
    source = np.random.default_rng(seed)
    lines = ["size_bytes,rtt_us"]
    for size in range(76, 14021, 560):
        spread = 900.0 if size in wide else 60.0
        delays = 800 + 0.05 * size + source.gamma(4, spread / 4, 200)
        lines += [f"{size},{delay:.1f}" for delay in delays]
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def kinds(found: dse.Fit) -> list[str]:
    return [remark.kind for items in (found.transports, found.executions) for item in items for remark in item.remarks]


def test_sizes_whose_spread_jumps_are_found_named_and_offered_as_a_limit(tmp_path: Path) -> None:
    """The anomaly of section 5.3: between 3 and 7.5 kB."""
    file = sweep(tmp_path / "sweep.csv", range(3000, 7500))
    [item] = dse.fit(file).transports
    [remark] = [remark for remark in item.remarks if remark.kind == "spread"]
    assert remark.limit_bytes == 2876 and "from 3436 to 7356 B" in remark.text
    assert "assumptions: [" in dse.fit(file).to_yaml() and "messages of at most 2876 B" in dse.fit(file).to_yaml()
    assert item.sizes_bytes == (76, 2876) and 'sizes: "76 B .. 2876 B"' in dse.fit(file).to_yaml()
    without = dse.fit(file, without=["3 KB .. 7.5 KB"])
    assert without.transports[0].sizes_bytes == (76, 2876)
    assert "spread" not in kinds(without)
    assert without.transports[0].left_out == tuple(range(3436, 7357, 560))
    assert dse.fit(file, sizes="0 B .. 2876 B").transports[0].high_fit.rms_ns < item.high_fit.rms_ns / 4


def test_an_even_spread_is_no_anomaly(tmp_path: Path) -> None:
    even = dse.fit(sweep(tmp_path / "even.csv", range(0)))
    assert "spread" not in kinds(even) and even.transports[0].sizes_bytes == (76, 13516)
    ends = dse.fit(tmp_path / "even.csv", without=["0 B .. 1 KB", "9 KB .. 90 KB"])
    assert ends.transports[0].sizes_bytes == (1196, 8476)
    assert "spread" not in kinds(dse.fit(TABLES / "table_5_3.csv"))
    rows = [f"{size},{size},{3 * size},{size // 9}" for size in range(100, 2000, 100)]
    growing = tmp_path / "growing.csv"
    growing.write_text("\n".join(["size_bytes,min_us,max_us,stddev_us", *rows]), encoding="utf-8")
    assert "spread" not in kinds(dse.fit(growing))


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "m.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_is_odd_is_told(tmp_path: Path) -> None:
    head = "size_bytes,min_us,max_us,median_us\n"
    steep = written(tmp_path, head + "100,1,2,1\n200,11,12,11\n300,21,22,21\n")
    assert kinds(dse.fit(steep)).count("negative part") == 2
    [item] = dse.fit(steep).transports
    assert item.fixed_ns == (0, 0)
    assert "would be negative (-9 us)" in str(item.remarks)
    ceiling = written(tmp_path, head + "1,1,50,9\n2,3,70,9\n3,4,90,90\n4,5,90,9\n5,6,90,11\n")
    assert kinds(dse.fit(ceiling)).count("saturated") == 2
    bent = written(tmp_path, head + "".join(f"{x},5,{max(10, x - 40)},\n" for x in range(10, 110, 10)))
    [bend] = [remark for remark in dse.fit(bent).transports[0].remarks if remark.kind == "bend"]
    assert "bend at 50 B" in bend.text
    crossing = written(tmp_path, head + "10,1,90,\n20,50,91,\n30,80,92,\n")
    assert "crossing" in kinds(dse.fit(crossing))
    assert dse.fit(crossing).transports[0].per_byte_ns == (100, 100)
    [crossed] = dse.fit(crossing).transports  # 130 / 3 is the mean of the minima, 20 B that of the sizes
    assert crossed.low.fixed_ns == Fraction(131_000, 3) - 20 * 100 and crossed.low_fit.beyond == 1
    assert "few sizes" in kinds(dse.fit(written(tmp_path, head + "10,1,90,\n20,50,91,\n")))


def test_samples_at_the_ceiling_are_told(tmp_path: Path) -> None:
    rows = [f"{size},{min(40, number % 53)}" for size in (1, 2, 3) for number in range(200)]
    found = dse.fit(written(tmp_path, "\n".join(["bytes,delay_us", *rows])))
    assert kinds(found).count("saturated") == 3


def test_both_forms_of_measurements_give_the_same_lines(tmp_path: Path) -> None:
    samples = {1: [4, 9, 5], 10: [7, 8, 30], 100: [60, 80, 70]}
    rows = [f"{size};udp;pc;{value} us" for size, values in samples.items() for value in values]
    one = dse.fit(written(tmp_path, "\n".join(["Message Size [B];RMW;host;delay", *rows])))
    figures = [f"{size},udp,pc,{min(v) / 1000},{max(v) / 1000}" for size, v in samples.items()]
    other = dse.fit(written(tmp_path, "\n".join(["bytes,transport,platform,min (ms),max (ms)", *figures])))
    assert one.transports[0].low == other.transports[0].low and one.transports[0].high == other.transports[0].high
    assert (one.transports[0].transport, one.transports[0].platform) == ("udp", "pc")


def test_several_platforms_and_transports_make_one_catalogue(tmp_path: Path) -> None:
    rows = [
        f"{transport},{platform},{size},{fixed + size},{2 * fixed + 3 * size}"
        for transport, fixed in (("shm", 10), ("udp", 40))
        for platform in ("arm", "x86")
        for size in (0, 100, 200)
    ]
    text = dse.fit(
        written(tmp_path, "\n".join(["rmw,cpu,bytes,min_us,max_us", *rows])), platforms={"arm": "ARM"}
    ).to_yaml()
    spec = parse_spec(f"dse: 1\nname: x\n{text}processor_types: {{ARM: {{}}, x86: {{}}}}\n").spec
    times: Any = {name: item.transmission_time for name, item in spec.bus_types.items()}
    assert {name: list(item) for name, item in times.items()} == {
        "shm": ["ARM", "x86"],
        "udp": ["ARM", "x86"],
    }
    found = times["udp"]["ARM"]
    assert (*found.fixed, *found.per_byte) == ((40 * US, 80 * US), (1 * US, 3 * US))


PROBLEM = """
dse: 1
name: measured
include: threads.yaml
processor_types: {RT101: {}, Spectra: {}}
processors: {c: {type: [RT101, Spectra]}}
threads: {t: {type: NAME, processor: c, period: 20 ms}}
"""


def test_table_5_5_is_a_catalogue_with_what_is_not_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    table = str(TABLES / "table_5_5.csv")
    names = ["--platform", "rt101=RT101", "--platform", "spectra=Spectra"]
    assert run(["fit", table, *names, "-o", "threads.yaml"]) == 0
    problem = parse_spec(PROBLEM.replace("NAME", "ekf_pose_provider_onTimer").replace("include: threads.yaml", "")
        + Path("threads.yaml").read_text(encoding="utf-8"))  # fmt: skip
    times: Any = problem.spec.thread_types["ekf_pose_provider_onTimer"].compute_execution_time
    assert {name: tuple(value[0]) for name, value in times.items()} == {
        "RT101": (1_700, 2_800_000),
        "Spectra": (486, 1_600_000),
    }
    stated = problem.spec.uncertainty["thread_types.ekf_pose_provider_onTimer.compute_execution_time.RT101.max"]
    assert (stated.mean, stated.deviation, stated.range) == ("53.1 us", "53.6 us", "1.7 us .. 2.8 ms")
    single = problem.spec.thread_types["implement_controller_onCmd_inMsg"]
    assert "a single sample on RT101, Spectra" in (single.source or "")
    assert not any("onCmd_inMsg" in path for path in problem.spec.uncertainty)
    Path("p.yaml").write_text(PROBLEM.replace("NAME", "ekf_pose_provider_onTimer"), encoding="utf-8")
    assert run(["sensitivity", "p.yaml", "--design", "c.type = RT101", "--samples", "64"]) == 0


def test_samples_of_callbacks_go_beside_the_catalogue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows = [*(f"cam,{10 + n} us" for n in range(9)), *(f"nav,{5 * n} us" for n in range(1, 4)), "one,7 us"]
    written(tmp_path, "\n".join(["callback,duration", *rows]))
    assert run(["fit", "m.csv", "-o", "threads.yaml"]) == 0
    text = "dse: 1\nname: x\ninclude: threads.yaml\nprocessor_types: {p: {}}\nprocessors: {c: {type: p}}\n"
    text += "threads: {cam: {type: cam, processor: c, period: 1 ms}, nav: {type: nav, processor: c, period: 1 ms}}\n"
    Path("p.yaml").write_text(text, encoding="utf-8")
    found = dse.sensitivity("p.yaml", samples=64).to_dict()
    assert set(found["uncertainty"]["inputs"]) >= {
        "thread_types.cam.compute_execution_time.max",
        "thread_types.nav.compute_execution_time.max",
    }
    assert "3 samples of threads.samples.csv" in str(found)


def test_extreme_value_fits_stand_beside_the_figures_and_are_tested(tmp_path: Path) -> None:
    """Known tails: that of an exponential has shape 0, and its level is known; values that drift are not accepted."""
    source = np.random.default_rng(3)
    drawn = {"exponential": source.exponential(100, 4000), "uniform": source.uniform(0, 100, 4000)}
    rows = [f"{name},{value:.4f}" for name, values in drawn.items() for value in values]
    found = dse.fit(written(tmp_path, "\n".join(["thread,duration_us", *rows])), extremes=10_000)
    for item in found.executions:
        assert [tail.model for tail in item.tails] == ["block maxima (GEV)", "peaks over threshold (GPD)"]
        assert not any(tail.is_rejected for tail in item.tails)
    exponential, uniform = (item.tails[1] for item in found.executions)
    assert exponential.level_ns == pytest.approx(100 * US * np.log(10_000), rel=0.2)
    assert abs(exponential.shape) < 0.3
    assert uniform.shape < -0.6 and uniform.level_ns == pytest.approx(100 * US, rel=0.01)
    assert "level" not in found.to_yaml()
    walk = np.abs(source.normal(0, 1, 4000).cumsum())
    rows = [f"walk,{value:.4f}" for value in walk]
    [item] = dse.fit(written(tmp_path, "\n".join(["thread,duration_us", *rows])), extremes=10_000).executions
    assert all(tail.lag_1 > 0.9 for tail in item.tails)


def test_plots_are_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sweep(tmp_path / "sweep.csv", range(0))
    assert run(["fit", str(tmp_path / "sweep.csv"), "--figures", str(tmp_path / "plots"), "--json", "-"]) == 0
    names = {path.name for path in (tmp_path / "plots").iterdir()}
    assert names == {f"sweep-sweep{part}.svg" for part in ("", "-residuals")}
    assert "message size [B]" in (tmp_path / "plots" / "sweep-sweep.svg").read_text(encoding="utf-8")


def test_catalogue_and_table_to_standard_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(written(tmp_path, "size_bytes,min_us,max_us\n0,10,20\n10,20,30\n20,30,40\n"))
    assert run(["fit", path, "-o", "-"]) == 0
    out = capsys.readouterr().out
    assert parse_spec(f"dse: 1\nname: x\n{out}").spec.bus_types["m"].transmission_time is not None
    assert run(["fit", path]) == 0
    assert out in capsys.readouterr().out


def test_columns_as_performance_test_names_them(tmp_path: Path) -> None:
    """ApexAI's performance_test writes `latency_min (ms)`: 0.1 ms and 1 us a byte, and twice that at most."""
    path = tmp_path / "run.csv"
    rows = ["dds,pi,100,0.2,0.4,0.3", "dds,pi,200,0.3,0.6,0.4", "dds,pi,400,0.5,1.0,0.7"]
    path.write_text("rmw,host,size_bytes,latency_min (ms),latency_max (ms),latency_mean (ms)\n" + "\n".join(rows))
    body = parse_spec("dse: 1\nname: x\n" + dse.fit(path).to_yaml()).spec.bus_types["dds"]
    assert body.virtual and "fixed: 100 us .. 200 us" in dse.fit(path).to_yaml().replace('"', "")
    assert "per_byte: 1 us .. 2 us" in dse.fit(path).to_yaml().replace('"', "")


def test_a_lower_line_below_the_upper_one_is_the_best_of_those() -> None:
    """Against a grid of lines: least squares and envelopes of which the upper line limits the slope or fixed part."""
    points = [(1, Fraction(1)), (2, Fraction(9)), (4, Fraction(13))]
    steps = [Fraction(step, 8) for step in range(81)]
    for high in (
        LinearModel(Fraction(5), Fraction(2)),
        LinearModel(Fraction(1), Fraction(3)),
        LinearModel(Fraction(0), Fraction(1, 2)),
    ):
        lines = [LinearModel(fixed, slope) for fixed in steps for slope in steps]
        lines = [one for one in lines if one.fixed_ns <= high.fixed_ns and one.per_byte_ns <= high.per_byte_ns]
        squares = below_upper(least_squares(points), high, *squares_parts(points))
        assert squares.fixed_ns <= high.fixed_ns and squares.per_byte_ns <= high.per_byte_ns
        assert _rest(points, squares) <= min(_rest(points, one) for one in lines)
        below = below_upper(envelope(points, upper=False), high, *lower_envelope_parts(points))
        safe = [one for one in lines if all(one.at(size) <= time for size, time in points)]
        assert all(below.at(size) <= time for size, time in points)
        assert _sum(points, below) >= max(_sum(points, one) for one in safe)


def _rest(points: Points, line: LinearModel) -> Fraction:
    return sum(((time - line.at(size)) ** 2 for size, time in points), Fraction(0))


def _sum(points: Points, line: LinearModel) -> Fraction:
    return sum((line.at(size) for size, _ in points), Fraction(0))


def test_sizes_that_were_left_out_are_an_assumption_of_the_catalogue(tmp_path: Path) -> None:
    rows = "".join(f"{size},{size + 5},{size + 9}\n" for size in (1, 2, 3, 4, 5, 6))
    path = written(tmp_path, f"size_bytes,min_us,max_us\n{rows}")
    for options, told in (
        (
            {"without": ["3 B .. 4 B"]},
            "messages from 3 to 4 B were measured and left out: the figures are not for them",
        ),
        ({"sizes": "0 B .. 4 B"}, "messages of at most 4 B (beyond, what was measured was left out)"),
    ):
        found = yaml.safe_load(dse.fit(path, name="n", **options).to_yaml())
        assert found["assumptions"] == [f"n: {told}"]
    assert "assumptions" not in yaml.safe_load(dse.fit(path).to_yaml())
