"""Designs that a command is given, or makes whole: what is not decided is never invented."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.cli.main import run
from dse.examples.shipped import example_path

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
processing: execution_time
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
def test_a_baseline_that_leaves_decisions_open_is_none(question: dict[str, Any]) -> None:
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


@pytest.fixture
def solved(plant: Path) -> Path:
    """A result whose question is another than the file's: response times, one limit more."""
    file = plant.with_suffix(".json")
    limit = ["--max-latency", "60ms", "--fix", "filter.core = 2"]
    assert run(["solve", str(plant), "--processing", "response-time", *limit, "-q", "--json", str(file)]) == 0
    return file


def analysed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[dict[str, Any], str]:
    capsys.readouterr()
    assert run(["analyse", *arguments, "--json", "-"]) in (0, 4)
    said = capsys.readouterr()
    return json.loads(said.out), said.err


def asked_in(found: dict[str, Any]) -> list[str]:
    """The requirements that somebody states."""
    return [item["requirement"] for item in found["requirements"] if not item["implied"]]


def test_a_design_of_a_result_is_judged_by_the_question_of_the_result(
    plant: Path, solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = json.loads(solved.read_text())
    for point in result["front"]:
        found, said = analysed([str(plant), "--design", f"{solved}#{point['id']}"], capsys)
        assert found["decisions"] == point["decisions"] and found["decisions"]["filter.core"] == "2"
        assert {name: found["metrics"][name]["value"] for name in point["metrics"]} == point["metrics"]
        assert asked_in(found) == result["problem"]["effective"]["requirements"]
        beyond = "processing response_time; latency of loop <= 60 ms; filter.core = 2"
        assert said == f"dse: as in {solved}, beyond what the problem file asks: {beyond}\n"


def test_what_the_caller_asks_takes_the_place_of_what_the_result_asks(
    plant: Path, solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chosen = ["--design", f"{solved}#1", "--design", "filter.core = 1", "--processing", "execution-time"]
    found, said = analysed([str(plant), *chosen, "--max-jitter", "1ms"], capsys)
    assert found["feasible"] is False and found["breaches"] == []
    assert found["processing"] == "execution_time" and found["decisions"]["filter.core"] == "1"
    assert asked_in(found) == [
        "latency of loop <= 60 ms",
        "jitter of loop <= 1 ms",
    ]
    assert f"processing is execution_time, as asked here; in {solved} it is response_time" in said


@pytest.mark.parametrize("core", [1, 2])
def test_a_core_that_a_design_states_counts_whatever_is_asked(plant: Path, core: int) -> None:
    analysis = dse.analyse(plant, {"filter.core": str(core)})
    assert analysis.decisions["filter.core"] == str(core)
    assert analysis.processors[0].cores["filter"] == core


@pytest.mark.parametrize("command", ["simulate", "sensitivity"])
def test_other_commands_take_the_question_of_a_result_too(
    command: str, plant: Path, solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([command, str(plant), "--design", f"{solved}#1", "--json", "-"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["decisions"]["filter.core"] == "2"
    assert "latency of loop <= 60 ms" in said.out + said.err and "processing response_time" in said.err
    if command == "sensitivity":
        assert "latency of loop <= 60 ms" in said.out


def test_a_file_that_has_changed_since_is_told(plant: Path, solved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plant.write_text(
        plant.read_text().replace("1 ms .. 3 ms", "1 ms .. 4 ms") + "requirements: [jitter of loop <= 1 s]\n"
    )
    found, said = analysed([str(plant), "--design", f"{solved}#1"], capsys)
    assert asked_in(found) == [
        "latency of loop <= 60 ms",
        "jitter of loop <= 1 s",
    ]
    assert f"{plant} has changed since {solved} was written: " in said


def test_a_design_is_one_alternative(plant: Path, solved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["analyse", str(plant), "--design", f"{solved}#1", "--design", f"{solved}#2"]) == 2
    assert "one alternative of one result" in capsys.readouterr().err


def test_a_result_may_have_any_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`FILE#ID` names a design of any file that is there; where there is none both forms are said."""
    result = tmp_path / "found.result"
    starter = str(example_path("starter"))
    result.write_text(dse.solve(starter).to_json(), "utf-8")
    assert run(["analyse", starter, "--design", f"{result}#1"]) == 0
    assert f"design #1 of {result}" in capsys.readouterr().out
    assert run(["compare", f"{result}#1", f"{result}#2"]) == 0
    assert run(["analyse", starter, "--design", f"{tmp_path}/none#1"]) == 2
    said = capsys.readouterr().err
    assert "expected RESULT.json#ID or DECISION = OPTION; there is no file" in said and "none'" in said
    assert run(["analyse", starter, "--design", str(result)]) == 2
    assert f"{str(result)!r}: expected RESULT.json#ID or DECISION = OPTION" in capsys.readouterr().err
