"""What would take all memory or all time is refused at once, with its place; check says what solve will refuse."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import dse
from dse.analysis.bounds import Ends, impossible
from dse.analysis.evaluate import Evaluator
from dse.cli.main import run

PUMP = (Path(__file__).parent / "fuzz" / "pump.yaml").read_text(encoding="utf-8")
INMARK = str(Path(__file__).parents[1] / "problems" / "inmark.yaml")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["new", "x.yaml", "--random", "--threads", "999999999999"],
            "a whole number from 5 to 5,000",
        ),
        (["simulate", INMARK, "--duration", "1e9s"], "give a shorter --duration"),
        (["simulate", INMARK, "--duration", "1e30s"], "give a shorter --duration"),
    ],
)
def test_what_would_not_end_is_refused(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    assert said in capsys.readouterr().err


def test_samples_are_bounded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "uncertain.yaml"
    stated = 'uncertainty: {threads.filter.compute_execution_time.small.max: {factor: "0.9 .. 1.1"}}'
    path.write_text(f"{PUMP}{stated}\n", encoding="utf-8")
    design = ["computer.type = large", "can0.type = can_500k", "filter.dispatch_protocol = aperiodic"]
    choices = [word for text in [*design, "control.period = 5 ms"] for word in ("--design", text)]
    assert run(["sensitivity", str(path), *choices, "--samples", "100000000"]) == 2
    assert "100,000,000 samples of 1 uncertain inputs: at most 50,000,000" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (("price: 60 EUR", "price: 99999999999999 EUR"), "minimise price"),
        (("period: 1 ms}", "period: 9999999 s}"), "jitter of sensor_to_valve <= 30 ms"),
    ],
)
def test_check_says_what_solve_refuses(
    change: tuple[str, str], place: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "large.yaml"
    path.write_text(PUMP.replace(*change), encoding="utf-8")
    line = next(n for n, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1) if place in text)
    assert run(["solve", str(path), "-q"]) == 3
    said = capsys.readouterr().err.strip().removeprefix("dse: ")
    assert said.startswith(f"too large to search exactly: {path}:{line}: {place}: a sum may reach")
    assert said in dse.check(path).remarks
    assert dse.check(path).too_large == said
    assert run(["check", str(path), "--json", str(tmp_path / "check.json")]) == 3
    shown = capsys.readouterr()
    assert "Pump: too large to search exactly" in shown.out
    assert shown.err.strip().removeprefix("dse: ") == said
    assert json.loads((tmp_path / "check.json").read_text(encoding="utf-8"))["too_large"] == said
    assert run(["check", str(path), "-q"]) == 3
    assert capsys.readouterr().err.strip().removeprefix("dse: ") == said


def test_an_objective_of_the_command_line_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "large.yaml"
    path.write_text(PUMP.replace("price: 60 EUR", "price: 99999999999999 EUR"), encoding="utf-8")
    assert run(["solve", str(path), "-q", "--minimise", "price"]) == 3
    assert "too large to search exactly: command line: minimise price" in capsys.readouterr().err


WAITING = """
dse: 1
name: long bounds
processing: response_time
processor_types: {four: {cores: 4}}
processors: {p: {type: four}}
threads: {THREADS}
flows: {f: {path: [t0]}}
requirements: [min latency of f >= 1 h]
objectives: [minimise latency of f]
"""
THREAD = "t%d: {processor: p, core: [1, 2, 3, 4], period: 100 ms, compute_execution_time: 1 ms .. 2 ms}"


def test_check_works_out_no_response_time_for_a_minimum() -> None:
    """Cores of thirty threads make 4^30 cases, a response time in each; the least latency of one is its own 1 ms."""
    text = WAITING.replace("THREADS", ", ".join(THREAD % number for number in range(30)))
    space = dse.loads(text).space
    [limit] = [item for item in Evaluator(space).limits if item.requirement.metric.kind == "min latency"]
    [found] = impossible([limit], Ends(space))
    assert (found.value, found.limit) == (1_000_000, 3_600_000_000_000)


def test_what_check_has_no_time_for_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from dse.questions.verbs import check

    monkeypatch.setattr(check, "TIME_S", -1.0)
    found = dse.check(dse.loads(PUMP))
    assert "what else there is to remark was not found out within -1 s" in found.remarks
    assert (found.size, found.too_large) == (768, "")
