"""Two fronts and two designs, against what is known by hand."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

import dse
from dse.answers.comparison import DesignComparison, ResultComparison, compare_results
from dse.questions.verbs.compare import compare
from dse.report.content.compare import comparison_page
from dse.report.page import Text
from dse.report.terminal import print_page
from dse.support.errors import UsageError

CHEAP = """
dse: 1
name: Two
overload: allowed
processor_types: {slow: {price: 100 EUR}, fast: {price: PRICE EUR}}
processors: {cpu: {type: [slow, fast]}}
devices: {source: {period: 10 ms}}
threads: {worker: {processor: cpu, period: 10 ms, compute_execution_time: {slow: 0 ns .. 4 ms, fast: 0 ns .. 1 ms}}}
connections: {wire: {from: source, to: worker}}
flows: {main: {path: [source, worker]}}
requirements: [jitter of main <= 13 ms]
objectives: [minimise jitter of main, minimise price]
baseline: {cpu: {type: slow}}
"""


def written(folder: Path, name: str, price: int, **asked: Any) -> str:
    problem = folder / f"{name}.yaml"
    problem.write_text(CHEAP.replace("PRICE", str(price)), encoding="utf-8")
    path = folder / f"{name}.json"
    path.write_text(dse.solve(problem, **asked).to_json(), encoding="utf-8")
    return str(path)


def test_two_designs(tmp_path: Path) -> None:
    found = compare(written(tmp_path, "one", 300) + "#1", "baseline")
    assert isinstance(found, DesignComparison)
    assert [(line.one, line.other) for line in found.decisions] == [("fast", "slow")]
    jitter = next(line for line in found.metrics if line.name == "jitter of main")
    assert (jitter.one, jitter.other, jitter.difference) == (11_000_000, 14_000_000, 3_000_000)
    assert [(line.one, line.other) for line in found.verdicts] == [("holds", "broken")]
    assert found.to_dict()["metrics"]["price"] == {"values": [30000, 10000], "unit": "ct"}


def test_what_a_design_is_better_in_is_said(tmp_path: Path) -> None:
    dear, cheap = written(tmp_path, "one", 300) + "#1", written(tmp_path, "two", 90) + "#1"
    said = {
        pair: [block.text for block in comparison_page(compare(*pair)).sections[0].blocks if isinstance(block, Text)]
        for pair in ((dear, "baseline"), (cheap, "baseline"), (cheap, dear))
    }
    assert said[dear, "baseline"][-1] == "Trade-off: B has lower price, but higher jitter of main."
    assert said[cheap, "baseline"][-1] == "A dominates B: it has lower jitter of main and lower price."
    assert said[cheap, dear][-1] == "A dominates B: it has lower price; equal: jitter of main."


def test_money_in_two_currencies_is_not_compared(tmp_path: Path) -> None:
    euros, dollars = written(tmp_path, "euros", 300), tmp_path / "dollars.yaml"
    dollars.write_text(CHEAP.replace("PRICE", "300").replace("EUR", "USD"), encoding="utf-8")
    other = tmp_path / "dollars.json"
    other.write_text(dse.solve(dollars).to_json(), encoding="utf-8")
    found = compare(f"{euros}#1", f"{other}#1")
    assert isinstance(found, DesignComparison)
    price = next(line for line in found.metrics if line.name == "price")
    assert price.differs
    assert price.difference is None
    printed = io.StringIO()
    print_page(Console(file=printed, width=120), comparison_page(found))
    assert "300 EUR" in printed.getvalue()
    assert "300 USD" in printed.getvalue()
    with pytest.raises(UsageError, match="EUR and in USD"):
        compare(euros, str(other))


def test_shares_differ_by_percentage_points(tmp_path: Path) -> None:
    """10 % against 40 % of a core: 30 percentage points, not 30 %."""
    printed = io.StringIO()
    print_page(
        Console(file=printed, width=200), comparison_page(compare(written(tmp_path, "one", 300) + "#1", "baseline"))
    )
    row = next(line for line in printed.getvalue().splitlines() if "utilisation of cpu" in line)
    assert row.split(maxsplit=3)[-1].split() == ["10", "%", "40", "%", "+30", "percentage", "points"]


def test_two_results() -> None:
    dear, cheap = (
        dse.solve(dse.loads(CHEAP.replace("PRICE", price).replace("13 ms", "20 ms"))) for price in ("300", "200")
    )
    found = compare_results(("dear", "cheap"), dear, cheap)
    said = {
        point.point.decisions["cpu.type"]: (bool(point.equal), bool(point.dominated_by)) for point in found.points[0]
    }
    assert said == {"slow": (True, False), "fast": (False, True)}
    assert [bool(point.dominated_by) for point in found.points[1]] == [False, False]
    assert isinstance(found, ResultComparison)
    assert found.to_dict()["of"] == "results"


def test_figures_of_different_rules_are_not_compared(tmp_path: Path) -> None:
    """A result by response times loses against every one by execution times, which says nothing of the designs."""
    one = written(tmp_path, "one", 300, processing="execution_time")
    other = written(tmp_path, "other", 300, processing="response_time")
    rules = ("processing: execution_time and response_time",)
    found = compare(one, other)
    assert isinstance(found, ResultComparison) and found.unlike == rules
    assert not any(item.equal or item.dominated_by for points in found.points for item in points)
    printed = io.StringIO()
    print_page(Console(file=printed, width=200), comparison_page(found))
    assert "not comparable, their objectives follow different rules: processing" in printed.getvalue()
    assert "dominated" not in printed.getvalue() and "only here" not in printed.getvalue()
    designs = compare(f"{one}#1", f"{other}#1")
    assert isinstance(designs, DesignComparison) and designs.unlike == rules
    alike = {line.name: line.is_alike for line in designs.metrics}
    assert not alike["jitter of main"] and alike["price"] and alike["utilisation of cpu"]
    prices = [
        written(tmp_path, name, 300, processing=name, minimise="price") for name in ("execution_time", "response_time")
    ]
    same = compare(*prices)
    assert isinstance(same, ResultComparison) and same.unlike == ()
    assert [item.equal for item in same.points[0]] == [(1,)]


def test_what_cannot_be_compared(tmp_path: Path) -> None:
    one, other = written(tmp_path, "one", 300), written(tmp_path, "other", 300, minimise="price")
    with pytest.raises(UsageError, match="different objectives"):
        compare(one, other)
    with pytest.raises(UsageError, match="a whole result compares with a result"):
        compare(one, "baseline")
    with pytest.raises(UsageError, match="one side must be a result"):
        compare("baseline", "baseline")
    with pytest.raises(UsageError, match="no alternative 9"):
        compare(f"{one}#9", "baseline")
