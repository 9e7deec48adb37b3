"""A front among all feasible designs."""

from __future__ import annotations

import pytest

import dse
from dse.examples.shipped import example_path
from dse.questions.verbs import feasible_designs as feasible
from dse.questions.verbs.feasible_designs import feasible_designs
from tests.helpers.small import quick


@pytest.mark.parametrize(
    ("name", "question"),
    [
        ("starter", {}),
        ("inmark", {"max_jitter": "20 ms"}),
        ("starter", {"minimise": ["price", "utilisation of computer"], "require": "price <= 300 EUR"}),
        ("starter", {"maximise": "min latency of sensor_to_actuator", "minimise": "price"}),
    ],
)
def test_the_front_is_what_no_feasible_design_dominates(name: str, question: dict[str, str]) -> None:
    result = dse.solve(quick(dse.load(example_path(name))), **question)  # type: ignore[arg-type] # the question is one
    found = feasible_designs(result)
    assert found is not None and found.count >= len(found.vectors) > len(result.front)
    signs = [1 if info.sense == "minimise" else -1 for info in result.objectives]
    rows = [tuple(sign * value for sign, value in zip(signs, row, strict=True)) for row in found.vectors]
    best = {row for row in rows if not any(_covers(other, row) for other in rows if other != row)}
    front = [[point.objectives[info.name] for info in result.objectives] for point in result.front]
    assert best == {tuple(sign * value for sign, value in zip(signs, row, strict=True)) for row in front}


def _covers(one: tuple[int, ...], other: tuple[int, ...]) -> bool:
    return all(left <= right for left, right in zip(one, other, strict=True))


def test_too_many_designs_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    result = dse.solve(example_path("starter"))
    for limit in ("MOST_DESIGNS", "MOST_ROWS", "MOST_VECTORS"):
        with monkeypatch.context() as patch:
            patch.setattr(feasible, limit, 1)
            assert feasible_designs(result) is None
