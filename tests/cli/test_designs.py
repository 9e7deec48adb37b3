"""Designs that a command is given, or makes whole: what is not decided is never invented."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.cli.main import run

OPEN_CORES = [["--processing", "response-time"], ["--deadlines", "all"]]
PLANT = """\
dse: 1
name: Plant
processor_types: {board: {cores: 2}}
bus_types: {cable: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 1 ms, per_byte: 0 us}}}
processors: {main: {type: board}}
buses: {line: {type: cable, optional: true}}
devices:
  sensor: {period: 10 ms}
threads:
  filter: {processor: main, period: [10 ms, 20 ms], compute_execution_time: 1 ms .. 2 ms}
  control: {processor: main, dispatch_protocol: aperiodic, period: 20 ms, compute_execution_time: 1 ms .. 3 ms}
connections:
  raw: {from: sensor, to: filter, data_size: 8 B, bus: line}
  state: {from: filter, to: control}
flows: {loop: {path: [sensor, filter, control]}}
objectives: [minimise latency of loop, minimise utilisation of main]
"""
BASELINE = "baseline: {filter: {period: 20 ms}}\n"


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    file = tmp_path / "plant.yaml"
    file.write_text(PLANT + BASELINE)
    return file


@pytest.mark.parametrize("question", [[], *OPEN_CORES])
@pytest.mark.parametrize("command", ["analyse", "simulate", "sensitivity"])
def test_what_is_left_open_is_not_filled_in(
    command: str, question: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "open.yaml"
    file.write_text(PLANT)
    assert run([command, str(file), *question]) == 2
    assert "the design leaves open: filter.period (give them" in capsys.readouterr().err


@pytest.mark.parametrize("question", [{"processing": "response_time"}, {"deadlines": "all"}])
def test_a_baseline_that_leaves_decisions_open_is_none(question: dict[str, str]) -> None:
    assert dse.solve(dse.loads(PLANT + "baseline: {line: {type: cable}}\n"), **question).baseline is None


@pytest.mark.parametrize("question", OPEN_CORES)
@pytest.mark.parametrize("command", ["analyse", "simulate", "sensitivity"])
def test_an_optional_slot_is_filled_where_cores_are_open(
    command: str, question: list[str], plant: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([command, str(plant), *question]) == 0
    assert "line none" not in capsys.readouterr().out


def test_solving_compares_with_the_baseline_where_cores_are_open(plant: Path) -> None:
    result = dse.solve(plant, processing="response_time")
    assert result.baseline is not None
    chosen = {
        item.name: item.options[option] for item, option in zip(result.space.decisions, result.baseline, strict=True)
    }
    assert (chosen["line.type"], chosen["filter.period"]) == ("cable", "20 ms")
