"""Figures that have no common unit fine enough are rounded up, and said to be."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import dse
from dse.report.words.reasons import rounding_words

PROBLEM = """
dse: 1
name: Cameras
processor_types: {pc: {}}
bus_types: {eth: {bandwidth: 10 Mbit/s}}
processors: {computer: {type: pc}}
buses: {eth0: {type: eth}}
devices:
  fast: {period: [16.667 ms, 33.333 ms]}
  slow: {period: 33.333 ms}
threads: {track: {processor: computer, compute_execution_time: PT}}
connections:
  fast_image: {from: fast, to: track, data_size: 1 KB, bus: eth0}
  slow_image: {from: slow, to: track, data_size: 1 KB, bus: eth0}
flows: {f: {path: [fast, track]}}
objectives: [minimise utilisation of computer, maximise load of eth0]
"""


def solved(time: str, path: Path) -> tuple[dse.Result, dict[str, object]]:
    problem = path / "cameras.yaml"
    problem.write_text(PROBLEM.replace("PT", time), encoding="utf-8")
    result = dse.solve(str(problem))
    (path / "result.json").write_text(result.to_json(), encoding="utf-8")
    return result, json.loads(result.to_json())


def test_rounded_figures_are_named_and_a_little_too_large(tmp_path: Path) -> None:
    """16 667 and 33 333 have no factor in common: rates are counted in neither."""
    result, data = solved("1 ms", tmp_path)
    assert result.rounded == ("utilisation of computer", "load of eth0") and data["rounded"] == list(result.rounded)
    said = "utilisation of computer (to 1/10000000 ppm), load of eth0 (to 1/10000000 B/s)"
    assert said in rounding_words(result)
    for point in result.front:
        fast = Fraction(10**9, 16_667_000 if point.decisions["fast.period"] == "16.667 ms" else 33_333_000)
        rates = fast + Fraction(10**9, 33_333_000)
        for name, exact in (("utilisation of computer", rates * 1000), ("load of eth0", rates * 1000)):
            assert 0 <= Fraction(point.objectives[name], 10**7) - exact < Fraction(2, 10**7)
    assert dse.verify(str(tmp_path / "result.json")).status == "verified"
    (tmp_path / "result.json").write_text(json.dumps({**data, "rounded": []}), encoding="utf-8")
    assert dse.verify(str(tmp_path / "result.json")).status == "rejected"


def test_nothing_is_said_of_exact_figures(tmp_path: Path) -> None:
    """1/10, 1/30 and 1/70 per ms are all whole in 210ths."""
    problem = PROBLEM.replace("[16.667 ms, 33.333 ms]", "[10 ms, 30 ms]").replace("period: 33.333 ms", "period: 70 ms")
    result = dse.solve(dse.loads(problem.replace("PT", "1 ms")))
    assert result.rounded == () and rounding_words(result) == "" and "rounded" not in result.to_dict()
