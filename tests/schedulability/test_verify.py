"""Fronts with deadlines proved a second time: by looking at every design, and by a model that learns from lateness."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from effort import cases
from thread_systems import draw, text_of

import dse
from dse.api.problem import load
from dse.verification import tables


@pytest.mark.parametrize("method", ["model", "exhaustion"])
@pytest.mark.parametrize("kind", ["plain", "chained", "stated", "fixed"])
@pytest.mark.parametrize("seed", cases(8))
def test_true_fronts_are_proved_again_and_false_ones_refused(
    kind: str, method: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)  # no response time is tabulated
    file = tmp_path / "drawn.yaml"
    file.write_text(text_of(draw(seed, kind=kind)), encoding="utf-8")
    result = dse.solve(load(file), workers=1)
    proved = dse.verify(result, method=method)  # type: ignore[arg-type]
    assert (proved.status, proved.findings, proved.left_open) == ("verified", (), ())
    if result.front:
        data = json.loads(json.dumps(result.to_dict()))
        last = data["front"].pop()
        data["refuted"] = [{name: value + 1 for name, value in last["objectives"].items()}] + data["refuted"]
        assert dse.verify(data, method=method).status == "rejected"  # type: ignore[arg-type]
