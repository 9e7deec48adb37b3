"""Options that make the question: their order, and what is said of mistakes in them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dse.cli.main import run

TEXT = """
dse: 1
name: question
processor_types: {small: {price: 10 EUR, power: 9 W}, large: {price: 20 EUR, power: 5 W}}
processors: {computer: {type: [small, large]}}
threads: {t: {processor: computer, period: [10 ms, 20 ms], compute_execution_time: 1 ms}}
requirements: [utilisation of computer <= 100 %]
objectives: [minimise price]
"""


@pytest.fixture
def path(tmp_path: Path) -> str:
    (tmp_path / "question.yaml").write_text(TEXT)
    return str(tmp_path / "question.yaml")


@pytest.mark.parametrize(
    ("options", "order"),
    [
        (["--maximise", "price", "--minimise", "power"], ["maximise price", "minimise power"]),
        (["--minimise=power", "--maximize=price"], ["minimise power", "maximise price"]),
        (["--maximise", "price", "--minimize", "power", "--maximise", "utilisation"],
         ["maximise price", "minimise power", "maximise utilisation of computer"]),
        ([], ["minimise price"]),
    ],
)  # fmt: skip
def test_objectives_keep_the_order_in_which_they_are_given(
    path: str, options: list[str], order: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["solve", path, *options, "-q", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [f"{item['sense']} {item['name']}" for item in found["objectives"]] == order


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("utilizaton of computer <= 30 %", 'unknown metric "utilizaton" (did you mean "utilisation"?)'),
        ("utilsation <= 30 %", 'unknown metric "utilsation" (did you mean "utilisation"?)'),
        ("forbid prise <= 30 EUR", 'unknown metric "prise" (did you mean "price"?)'),
        ("t.perod == 10 ms", 'unknown name "t.perod" in a rule (did you mean "t.period"?)'),
        ("small requires lage", 'unknown name "lage" in a rule (did you mean "large"?)'),
    ],
)
def test_a_misspelt_requirement_is_no_rule(path: str, text: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["solve", path, "--require", text]) == 2
    assert said in capsys.readouterr().err


def test_fixing_what_a_design_does_not_use_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A timer's period is not used by a thread that each message dispatches."""
    text = TEXT.replace("period: [10 ms, 20 ms]", "dispatch_protocol: [periodic, aperiodic], period: [10 ms, 20 ms]")
    text += "devices: {d: {period: 5 ms}}\nconnections: {c: {from: d, to: t, data_size: 1 B}}\n"
    text = text.replace("[minimise price]", "[minimise utilisation of computer, minimise jitter of f]")
    text += "flows: {f: {path: [d, t]}}\n"
    path = str(tmp_path / "idle.yaml")
    Path(path).write_text(text)
    silent = ["solve", path, "--fix", "t.period = 20 ms", "--fix", "t.dispatch_protocol = periodic"]
    assert run(silent) == 0 and "was fixed, but" not in capsys.readouterr().out
    said = "t.period = 20 ms was fixed, but changes nothing in"
    told = tmp_path / "told.json"
    assert run(["solve", path, "--fix", "t.period = 20 ms", "--json", str(told)]) == 0
    data = json.loads(told.read_text())
    assert data["unused"] == [{"decision": "t.period", "option": "20 ms", "points": [2]}]
    data["unused"][0]["points"] = [1]
    told.write_text(json.dumps(data))
    assert run(["verify", str(told)]) == 4
    assert f"{said} #2, where it is not used." in capsys.readouterr().out
    never = ["--fix", "t.period = 20 ms", "--fix", "t.dispatch_protocol = aperiodic"]
    assert run(["solve", path, *never, "--report", "-o", str(tmp_path)]) == 0
    assert f"{said} every design here, where it is not used." in capsys.readouterr().out
    assert f"{said} every design here" in (tmp_path / "idle.md").read_text()
    assert run(["analyse", path, *never, "--design", "computer.type = small"]) == 0
    assert "warning: t.period = 20 ms was given, but changes nothing: it is not used here" in capsys.readouterr().out
    used = ["--design", "computer.type=small", "--design", "t.dispatch_protocol=periodic"]
    assert run(["analyse", path, *never[:2], *used]) == 0
    assert "was given, but" not in capsys.readouterr().out


def test_settings_that_contradict_each_other_are_refused(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", path, "--settings", "ET", "--worst-case", "deadline"]) == 2
    assert "--worst-case deadline contradicts --settings, which says execution-time" in capsys.readouterr().err


@pytest.mark.parametrize("option", [["--root", "a::b"], ["--mode", "x"]])
def test_options_of_models_are_not_for_problem_files(
    option: list[str], path: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["check", path, *option]) == 2
    assert f"{option[0]} is for AADL models" in capsys.readouterr().err
