"""Each exit code means one thing, whichever command answers with it; docs/commands.md has the table."""

from __future__ import annotations

import json
import re
from pathlib import Path

import click
import pytest

import dse.support.errors
from dse.cli.main import COMMANDS, cli, run
from dse.examples.shipped import example_path
from dse.support.errors import EXIT_MEANINGS
from tests.helpers.documents import ROOT

STARTER = str(example_path("starter"))
PLAIN = """
dse: 1
name: two threads on one core
processor_types: {one: {}}
processors: {computer: {type: one}}
devices: {sensor: {period: 10 ms, compute_execution_time: 0 us}}
threads:
  low: {processor: computer, dispatch_protocol: aperiodic, compute_execution_time: 2 ms, priority: 1}
  high: {processor: computer, period: 10 ms, compute_execution_time: 3 ms, priority: 2}
connections: {reading: {from: sensor, to: low, data_size: 1 B}}
flows: {main: {path: [sensor, low]}}
requirements: [latency of main <= 100 ms]
objectives: [minimise price]
processing: execution_time
"""
LATE = PLAIN.replace("<= 100 ms", "<= 1 ms")
FILES = {
    "broken.yaml": "dse: 1\nname: [",
    "late.yaml": LATE,
    "plain.yaml": PLAIN,
}
CASES = [
    (0, "solve STARTER -q"),
    (0, "explain STARTER"),
    (0, "sweep STARTER --vary price=200EUR,500EUR --no-store --workers 1"),
    (0, "analyse plain.yaml"),
    (0, "sensitivity plain.yaml --samples 100"),
    (0, "simulate plain.yaml --processing response-time"),
    (0, "simulate plain.yaml --no-contention"),
    (0, "verify good.json"),
    (2, "solve STARTER --require nonsense"),
    (2, "verify nothing.json"),
    (3, "solve broken.yaml"),
    (3, "check broken.yaml"),
    (3, "verify good.json --problem broken.yaml"),
    (4, "solve STARTER --max-jitter 1ms"),
    (4, "explain STARTER --max-jitter 1ms"),
    (4, "sweep STARTER --vary price=1EUR,2EUR --no-store --workers 1"),
    (4, "analyse late.yaml"),
    (4, "sensitivity late.yaml --samples 100"),
    (4, "simulate plain.yaml"),
    (4, "verify forged.json"),
    (5, "verify carried.json"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("codes")
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    assert run(["solve", STARTER, "-q", "--json", str(folder / "good.json")]) == 0
    data = json.loads((folder / "good.json").read_text(encoding="utf-8"))
    gone = folder / "gone.yaml"
    gone.write_text(PLAIN, encoding="utf-8")
    assert run(["solve", str(gone), "-q", "--json", str(folder / "carried.json")]) == 0
    gone.unlink()
    del data["front"][0]
    (folder / "forged.json").write_text(json.dumps(data), encoding="utf-8")
    return folder


@pytest.mark.parametrize(("code", "line"), CASES, ids=[line for _, line in CASES])
def test_each_code_means_one_thing(code: int, line: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert run([STARTER if word == "STARTER" else word for word in line.split()]) == code


def test_the_table_of_the_documents_is_that_of_the_code() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| (\d+) \| ([^|:]+?)(?::[^|]*)? \|$", text, re.M))
    assert {int(code): meaning for code, meaning in rows.items()} == EXIT_MEANINGS
    codes = {
        value for name, value in vars(dse.support.errors).items() if name.startswith("EXIT_") and isinstance(value, int)
    }
    assert codes == set(EXIT_MEANINGS)


def test_every_code_of_a_help_is_said_to_mean_what_the_table_says(capsys: pytest.CaptureFixture[str]) -> None:
    """Commands say what a code means for them; which commands have it is in the table, too."""
    table = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    [no] = re.findall(r"^\| 4 \|.*$", table, re.M)
    for name in COMMANDS:
        command = cli.get_command(click.Context(cli), name)
        assert command is not None and command.help is not None
        assert ("4 when" in command.help or "code 4" in command.help) <= (f"`{name}`" in no), name
        assert " 3 when" not in command.help
