"""A metric has one scale and one unit, wherever it is asked for."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.answers.result import FurtherDesign, Point
from dse.report.content.front.filters import decide_data

SHIPPED = ["inmark", "starter"]


@pytest.mark.parametrize("name", SHIPPED)
def test_metrics_of_a_point_are_those_of_its_analysis(name: str, tmp_path: Path) -> None:
    problem = dse.load(dse.example_path(name))
    result = dse.with_further_designs(dse.solve(problem), 1, top=1)
    path = tmp_path / "r.json"
    path.write_text(result.to_json(), encoding="utf-8")
    again = dse.reopen(path)
    designs: list[Point | FurtherDesign] = [*result.front, *(item for group in result.others for item in group.designs)]
    read: list[Point | FurtherDesign] = [*again.front, *(item for group in again.others for item in group.designs)]
    for one, other in zip(designs, read, strict=True):
        analysis = dse.analyse(problem, one)
        assert dict(one.metrics) == dict(other.metrics) == dict(analysis.metrics)
    assert dict(result.metric_units) == dict(again.metric_units) == dict(analysis.metric_units)


def test_a_metric_that_is_counted_in_parts_of_its_unit() -> None:
    """0.6 m/s times a jitter in ns is a fifth of a nm: JSON counts in such fifths, and says so."""
    result = dse.solve(dse.example_path("inmark"))
    point = result.front[0]
    assert (point.counts["line_variation"], result.counting_units["line_variation"]) == (104122512, "1/5 nm")
    assert (point.metrics["line_variation"], result.metric_units["line_variation"]) == (Fraction(104122512, 5), "nm")
    data = json.loads(result.to_json())
    assert data["front"][0]["metrics"]["line_variation"] == 104122512
    assert data["metric_units"]["line_variation"] == "1/5 nm"


def test_today_is_drawn_in_the_unit_of_the_front() -> None:
    """The page to decide with compares the baseline with the points, which count in parts of a unit."""
    result = dse.solve(dse.example_path("inmark"))
    assert result.baseline is not None
    today = dse.analyse(dse.example_path("inmark")).metrics
    (entry,) = [item for item in decide_data(result, today)["metrics"] if item["name"] == "line_variation"]
    assert int(entry["values"]["baseline"]) == 5 * today["line_variation"]
