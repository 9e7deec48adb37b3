"""``-`` reads standard input wherever a problem or a result is read; a misspelt command gets a suggestion."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

import dse
from dse.cli.main import run

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
CHOSEN = ["--design", "r.json#1"]
PROBLEMS = [
    ["solve", "-", "-q", "--json", "out.json"],
    ["analyse", "-", *CHOSEN],
    ["check", "-"],
    ["explain", "-", "--max-price", "1 EUR"],
    ["sweep", "-", "--vary", "price=60EUR..90EUR", "--no-store"],
    ["sensitivity", "-", *CHOSEN, "--no-front"],
    ["simulate", "-", *CHOSEN, "--runs", "2"],
]
RESULTS = [
    ["verify", "-"],
    ["report", "-", "-o", "reports"],
    ["export", "-", "--alternative", "1"],
    ["compare", "-", "r.json"],
    ["solve", "--resume", "-", "-q"],
]


@pytest.fixture
def problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> bytes:
    monkeypatch.chdir(tmp_path)
    text = PUMP.read_bytes()
    Path("r.json").write_text(dse.solve(PUMP).to_json(), encoding="utf-8")
    return text


def given(data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data), encoding="utf-8"))


@pytest.mark.parametrize("arguments", PROBLEMS, ids=lambda arguments: arguments[0])
def test_a_problem(arguments: list[str], problem: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    given(problem, monkeypatch)
    Path("pump.yaml").write_bytes(problem)
    assert run(arguments) == run(["pump.yaml" if word == "-" else word for word in arguments]) in (0, 4)


@pytest.mark.parametrize("arguments", RESULTS, ids=lambda arguments: arguments[0])
@pytest.mark.usefixtures("problem")
def test_a_result(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    given(Path("r.json").read_bytes(), monkeypatch)
    assert run(arguments) == 0


def test_mistakes_are_located(
    problem: bytes, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    given(problem.replace(b"threads:", b"threds:", 1), monkeypatch)
    assert run(["check", "-"]) == 3
    assert 'did you mean "threads"' in capsys.readouterr().err
    given(b"", monkeypatch)
    assert run(["verify", "-"]) == 2
    given(b"\xff\xfe\x00", monkeypatch)
    assert run(["verify", "-"]) == 2
    assert "not UTF-8" in capsys.readouterr().err


@pytest.mark.parametrize(("word", "meant"), [("slove", "solve"), ("sensitvity", "sensitivity"), ("xyz", None)])
def test_a_misspelt_command(word: str, meant: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([word]) == 2
    said = capsys.readouterr().err
    assert f"No such command '{word}'" in said
    assert (f"Did you mean '{meant}'?" in said) is (meant is not None)
