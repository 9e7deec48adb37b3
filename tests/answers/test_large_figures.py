"""Figures beyond what solvers count with, and fractions longer than anybody writes: computed, written, read back."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

import dse
from dse.analysis.measures import build_measure
from dse.analysis.views import View
from dse.support.units.text import LONGEST
from tests.helpers.small import design_of

PUMP = """
dse: 1
name: Pump
processor_types: {small: {price: 60 EUR}, large: {price: 240 EUR}}
processors: {computer: {type: [small, large]}}
threads: {control: {processor: computer, period: [5 ms, 10 ms], compute_execution_time: {small: 2 ms, large: 1 ms}}}
objectives: [minimise utilisation of computer, minimise price]
metrics:
  METRICS
"""
SCALED = "m: 1000000000000000 * price"
SCALED_TWICE = "m: 1e30 * price\n  n: 1e30 * m\n  o: min(1e30 * n, 1e29 * n)"


@pytest.mark.parametrize("metrics", [SCALED, SCALED_TWICE, "m: max(1e30 * price, 1e29 * price)"])
def test_a_metric_of_any_size_is_read_back(metrics: str, tmp_path: Path) -> None:
    """Prices are 6,000 ct and 24,000 ct; 10^15 times as much is above 2^62."""
    file, path = tmp_path / "pump.yaml", tmp_path / "r.json"
    file.write_text(PUMP.replace("METRICS", metrics), encoding="utf-8")
    result = dse.solve(file)
    path.write_text(result.to_json(), encoding="utf-8")
    assert max(json.loads(result.to_json())["front"][0]["metrics"].values()) > 2**62
    assert dse.verify(path).status == "verified"
    again = dse.reopen(path)
    assert [point.metrics for point in again.front] == [point.metrics for point in result.front]
    assert json.loads(again.to_json())["front"] == json.loads(result.to_json())["front"]
    analysed = tmp_path / "a.json"
    analysed.write_text(dse.analyse(file, result.front[0]).to_json(), encoding="utf-8")
    dse.read(analysed)


def test_the_metric_that_is_scaled_by_ten_to_the_fifteenth_is_exact() -> None:
    result = dse.solve(dse.loads(PUMP.replace("METRICS", SCALED)))
    assert {point.metrics["m"] for point in result.front} == {6 * 10**18, 24 * 10**18}


def test_a_hostile_size_is_refused_where_a_result_is_read(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    data = json.loads(dse.solve(dse.loads(PUMP.replace("METRICS", SCALED))).to_json())
    for wrong in (10**301, "1/2", 1.5, True):
        data["front"][0]["metrics"]["m"] = wrong
        path.write_text(json.dumps(data), encoding="utf-8")
        found = dse.verify(path)
        assert found.status == "rejected"
        assert found.findings[0].place == "front[0].metrics.m"
        assert found.findings[0].text.startswith("expected an integer of at most 300 digits, got")


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 100_000_007
    while len(found) < count:
        if all(number % divisor for divisor in range(3, int(number**0.5) + 1, 2)):
            found.append(number)
        number += 2
    return found


@pytest.fixture(scope="module")
def many_periods(request: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Threads whose periods have no common factor: what they use of a core has a denominator of 480 or 4,680 digits.

    Python writes no number of more than 4,300 digits.
    """
    threads = "".join(
        f"  t{number}: {{processor: p, period: {period} ns, compute_execution_time: 400 ns}}\n"
        for number, period in enumerate(_primes(getattr(request, "param", 60)))
    )
    head = dedent("""
        dse: 1
        name: Primes
        processor_types: {small: {cores: 2, price: 60 EUR}, large: {cores: 4, price: 90 EUR}}
        processors: {p: {type: [small, large]}}
        objectives: [minimise price]
        threads:
        """)
    path = tmp_path_factory.mktemp("primes") / "primes.yaml"
    path.write_text(head + threads, encoding="utf-8")
    return path


@pytest.mark.parametrize("many_periods", [60, 520], indirect=True)
def test_long_fractions_are_written_rounded_up_and_read_back(many_periods: Path, tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    result = dse.solve(many_periods)
    path.write_text(result.to_json(), encoding="utf-8")
    used = json.loads(result.to_json())["front"][0]["core_use"]["p"]["used"][0]
    assert 10**15 % Fraction(used).denominator == 0
    assert dse.verify(path).status == "verified"
    assert dse.reopen(path).front[0].metrics == result.front[0].metrics
    analysis = dse.analyse(many_periods, {"p.type": "small"})
    total = analysis.to_dict()["processors"]["p"]["total"]
    measure = build_measure(analysis.space, analysis.space.requirements[0].metric, counted=False)
    exact = measure.value(View(design_of(analysis.space, {"p.type": "small"})))
    assert exact.denominator >= 10**LONGEST
    assert 0 < Fraction(total) - exact < Fraction(1, 10**15)


@pytest.mark.parametrize("limit", ["<= 0.0001 %", ">= 90 %", "== 0.0001 %"])
def test_the_closest_limit_is_rounded_and_not_refuted_for_that(many_periods: Path, tmp_path: Path, limit: str) -> None:
    """With one core nothing has to be placed: the closest limit is the sum, rounded up to 15 decimals of a ppm."""
    text = many_periods.read_text(encoding="utf-8").replace("cores: 2, ", "").replace("cores: 4, ", "")
    file, path = tmp_path / "one.yaml", tmp_path / "r.json"
    file.write_text(f"{text}requirements: [utilisation of p {limit}]\n", encoding="utf-8")
    path.write_text(dse.solve(file).to_json(), encoding="utf-8")
    found = dse.verify(path)
    assert (found.status, found.findings) == ("verified", ())


def test_limits_of_long_fractions_are_told(many_periods: Path, tmp_path: Path) -> None:
    """A limit that no design keeps, in words and in JSON."""
    text = many_periods.read_text(encoding="utf-8")
    file = tmp_path / "tight.yaml"
    file.write_text(f"{text}requirements: [utilisation of p <= 0.0001 %]\n", encoding="utf-8")
    assert len(dse.check(file).to_dict()["impossible"]) == 1
    result = dse.solve(file)
    path = tmp_path / "r.json"
    path.write_text(result.to_json(), encoding="utf-8")
    assert result.status == "infeasible"
    found = dse.verify(path)
    assert (found.status, found.findings) == ("unfinished", ())
    assert found.left_open == (
        "conflicts[0].members[0].closest: whether the threads fit on cores with less is undecided",
    )
    explained = tmp_path / "e.json"
    explained.write_text(dse.explain(file).to_json(), encoding="utf-8")
    dse.read(explained)
