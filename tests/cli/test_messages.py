"""What commands say where there is little to say, or where something is called by a shorter name."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.examples.shipped import example_path

STARTER = str(example_path("starter"))
SINGLE = """
dse: 1
name: single
processor_types: {small: {price: 10 EUR}}
processors: {computer: {type: small}}
devices: {sensor: {period: 10 ms}}
threads: {t: {processor: computer, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}}
connections: {c: {from: sensor, to: t, data_size: 1 B}}
flows: {f: {path: [sensor, t]}}
requirements: [latency of f <= 100 ms]
uncertainty: {threads.t.compute_execution_time: {range: 1 ms .. 2 ms}}
objectives: [minimise price]
baseline: {}
processing: execution_time
"""


@pytest.fixture
def single(tmp_path: Path) -> str:
    path = tmp_path / "single.yaml"
    path.write_text(SINGLE)
    return str(path)


def said(arguments: list[str], code: int, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert run(arguments) == code
    found = capsys.readouterr()
    return found.out + found.err


def test_a_type_goes_by_the_name_of_its_component(capsys: pytest.CaptureFixture[str]) -> None:
    """As tables show it: ``can0 can_500k``, not ``can0.type can_500k``."""
    long = ["--fix", "can0.type = can_500k", "-q", "--csv", "-"]
    short = ["--fix", "can0 = can_500k", "-q", "--csv", "-"]
    assert said(["solve", STARTER, *short], 0, capsys) == said(["solve", STARTER, *long], 0, capsys)
    assert "can0 can_500k" in said(["analyse", STARTER, "--design", "can0 = can_500k"], 4, capsys)
    assert 'nothing is called "can2"' in said(["solve", STARTER, "--fix", "can2 = can_500k"], 2, capsys)


def test_an_offer_says_its_form(capsys: pytest.CaptureFixture[str]) -> None:
    form = "an offer is COMPONENT.FIELD += OPTION"
    assert form in said(["explain", STARTER, "--offer", "can0.type can_500k"], 2, capsys)
    assert "it is an option already" in said(["explain", STARTER, "--offer", "can0 += can_500k"], 2, capsys)


def test_what_stands_in_the_place_of_a_folder_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "taken"
    path.write_text("kept")
    assert f"{path}: is a file; -o names the folder" in said(["solve", STARTER, "--report", "-o", str(path)], 2, capsys)
    for name, meant in (("r.json", "--json r.json"), ("r.html", "--report r.html"), ("out", "--report -o out")):
        assert f"did you mean `{meant}`" in said(["solve", STARTER, "-o", name], 2, capsys)
    assert path.read_text() == "kept"


@pytest.mark.parametrize("limit", ["3 m", "3 EUR", "0", "-1s"])
def test_a_limit_of_time_is_seconds_or_a_duration(limit: str, capsys: pytest.CaptureFixture[str]) -> None:
    why = "a time limit is positive" if limit in ("0", "-1s") else "expected seconds or a duration with its unit"
    assert why in said(["solve", STARTER, "--time-limit", limit], 2, capsys)
    for right in ("60", "60s", "1 min"):
        assert said(["solve", STARTER, "-q", "--time-limit", right], 0, capsys) is not None


@pytest.mark.parametrize("duration", ["3", "3 m", "3 EUR"])
def test_a_time_of_the_system_has_a_unit(duration: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "expected a duration" in said(["simulate", STARTER, "--duration", duration], 2, capsys)


def test_nothing_observed_is_no_support(single: str, capsys: pytest.CaptureFixture[str]) -> None:
    short = said(["simulate", single, "--duration", "1ns"], 0, capsys)
    assert "Nothing was observed" in short and "WITHIN BOUNDS" not in short
    assert "WITHIN BOUNDS" in said(["simulate", single], 0, capsys)


def test_there_is_nothing_to_tell_of_no_decisions(single: str, capsys: pytest.CaptureFixture[str]) -> None:
    found = said(["check", single], 0, capsys)
    assert "No decision is open" in found and "decision " not in found.replace("No decision is", "")
    assert "At most" not in found


def test_counts_agree_with_their_nouns(single: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "at most 1 design\n" in said(["solve", single], 0, capsys)
    double = tmp_path / "double.yaml"
    text = SINGLE.replace("type: small}", "type: [small, large]}").replace("10 EUR}", "10 EUR}, large: {price: 5 EUR}")
    text = re.sub("uncertainty: .*", "", text).replace(
        "compute_execution_time: 1 ms", "compute_execution_time: {small: 1 ms, large: 2 ms}"
    )
    double.write_text(text.replace("[minimise price]", "[minimise price, minimise latency of f]"))
    assert "With waiting for the CPU both meet every limit." in said(["solve", str(double)], 0, capsys)


def test_what_is_drawn_is_said_only_where_it_is_drawn(single: str, capsys: pytest.CaptureFixture[str]) -> None:
    drawn = said(["sensitivity", single, "--samples", "10"], 0, capsys)
    assert "anything (sampled uniformly) in 1 ms .. 2 ms" in drawn and "0 further inputs" not in drawn
    robust = said(["solve", single, "--robust"], 0, capsys)
    assert "anything in 1 ms .. 2 ms" in robust and "sampled" not in robust


def test_columns_are_the_width_of_what_is_piped(
    single: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    widest = {}
    for columns in ("60", "300", "0", "wide"):
        monkeypatch.setenv("COLUMNS", columns)
        widest[columns] = max(map(len, said(["analyse", STARTER, "--all"], 4, capsys).splitlines()))
    assert widest["60"] <= 60 < widest["0"] == widest["wide"] <= 160 < widest["300"] <= 300


def test_an_alternative_in_place_of_a_problem_is_told_where_it_goes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "r.json").write_text("{}", encoding="utf-8")
    text = said(["simulate", f"{tmp_path / 'r.json'}#2"], 2, capsys)
    assert f"give the problem file, and --design {tmp_path / 'r.json'}#2" in " ".join(text.split())


@pytest.mark.parametrize("command", ["solve", "verify", "fit", "import"])
def test_a_misspelt_file_is_answered_with_the_nearest_name(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pump.yaml").write_text("", encoding="utf-8")
    for asked, near in (("pmup.yaml", "pump.yaml"), (str(tmp_path / "pum.yaml"), str(tmp_path / "pump.yaml"))):
        assert f"does not exist. (Did you mean {near!r}?)" in " ".join(said([command, asked], 2, capsys).split())
    assert "mean" not in said([command, "other/pump.yaml"], 2, capsys) + said([command, "robot.yaml"], 2, capsys)


PUMP = (Path(__file__).parents[1] / "fuzz" / "pump.yaml").read_text(encoding="utf-8")


def test_a_problem_file_is_no_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "pump.yaml"
    path.write_text(PUMP)
    words = f"{path}: is a problem file, and no result: `dse solve PROBLEM --json RESULT.json` writes one"
    for command in (["verify", str(path)], ["report", str(path)], ["compare", str(path), str(path)]):
        assert words in said(command, 2, capsys)
    with pytest.raises(dse.UsageError, match=re.escape(words)):
        dse.read(path)


def test_a_folder_without_models_is_no_problem(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is said of traces, of which only `dse import` reads folders; the example is a problem file of it."""
    words = f"'{tmp_path}' is a folder without AADL models: name a problem file"
    (tmp_path / "metadata").write_text("")
    assert f"{words}." in said(["solve", str(tmp_path)], 2, capsys)
    (tmp_path / "a.yaml").write_text("x: 1\n")
    (tmp_path / "b.yaml").write_text(PUMP)
    assert f"{words} such as '{tmp_path / 'b.yaml'}'." in said(["solve", str(tmp_path)], 2, capsys)
    (tmp_path / "a.aadl").write_text("package p\nend p;\n")
    assert "trace" not in said(["solve", str(tmp_path)], 3, capsys)


@pytest.mark.parametrize("name", ["mean power", "mean  power"])
def test_a_metric_is_found_whatever_blanks_and_quotes_it_is_written_with(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "pump.yaml"
    path.write_text(
        PUMP.replace("objectives: [", f'metrics: {{"{name}": price * 2}}\nobjectives: [minimise mean power, ')
    )
    for text in ("mean power", "mean  power", f"'{name}'", f'"{name}"'):
        said(["check", str(path), "-q", "--require", f"{text} <= 1000 EUR"], 0, capsys)
    found = said(["check", str(path), "--require", "Mean Power <= 1000 EUR"], 2, capsys)
    assert f'unknown metric "Mean Power" (did you mean "{name}"?' in found


def test_no_path_is_suggested_that_is_like_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "pump.yaml"
    path.write_text(PUMP)
    found = said(["sweep", str(path), "--vary", "control.perod=1ms,2ms"], 2, capsys)
    assert 'no quantity of the problem is called "control.perod" (did you mean "threads.control.period"?)' in found
    assert "did you mean" not in said(["sweep", str(path), "--vary", "max wurst=1ms,2ms"], 2, capsys)


def test_messages_are_set_in_lines_of_the_terminal() -> None:
    """A message on a terminal breaks between words at its width; what is piped is one line."""
    code = "from dse.cli.printing import tell; tell('dse: ' + 'some words ' * 20 + '/a/long/path' * 10)"
    master, slave = pty.openpty()
    with os.fdopen(master, "rb", 0) as read:
        subprocess.run([sys.executable, "-c", code], check=True, stderr=slave, env={**os.environ, "COLUMNS": "60"})
        os.close(slave)
        lines = read.read(10_000).decode().splitlines()
    assert max(map(len, lines[:-1])) <= 60 and len(lines) == 5 and lines[1].startswith("  ")
    assert lines[-1].strip() == "/a/long/path" * 10
    piped = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert piped.stderr.count("\n") == 1
