"""Exports of designs in which a join is not used."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.cli.main import run

OPEN = """
dse: 1
name: fusion
processor_types: {pc: {}}
processors: {pc: {type: pc}}
devices: {lidar: {period: 100 ms}, camera: {period: 100 ms, latency: 0 ms .. 80 ms}}
threads:
  fusion: {processor: pc, join: %s, pairing: [latest, fifo], dispatch_protocol: [periodic, aperiodic], period: 50 ms,
           compute_execution_time: 10 ms}
connections: {l: {from: lidar, to: fusion}, c: {from: camera, to: fusion}}
flows: {f: {path: [lidar, fusion]}}
objectives: [minimise jitter of f, minimise utilisation of pc]
"""


@pytest.mark.parametrize("form", ["problem", "aadl"])
@pytest.mark.parametrize("join", ["all", "[any, all]"])
def test_every_design_is_a_file_that_can_be_read(tmp_path: Path, join: str, form: str) -> None:
    source, answer = tmp_path / "p.yaml", tmp_path / "r.json"
    source.write_text(OPEN % join, encoding="utf-8")
    assert run(["solve", str(source), "--json", str(answer)]) == 0
    front = dse.solve(source).front
    assert len(front) > 1
    for number, point in enumerate(front, 1):
        out = tmp_path / (f"x{number}.yaml" if form == "problem" else f"x{number}.aadl")
        assert run(["export", f"{answer}#{number}", "--format", form, "-o", str(out)]) == 0
        again = dse.analyse(out)
        mine, same = (
            {flow.name: sum(row.max_ns for row in flow.rows) for flow in found.flows}
            for found in (again, dse.analyse(source, point.decisions))
        )
        assert list(mine.values()) == list(same.values())
