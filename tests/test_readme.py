"""What the README shows is what happens: its files, its console sessions and its Python session."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from dse.cli.main import COMMANDS, cli
from tests.helpers.documents import ROOT, run

README = ROOT / "README.md"
COMMAND = re.compile(r"<!-- ci: (?P<name>\w+) -->\n```sh\n(?P<text>.*?)^```", re.M | re.S)


def test_what_the_readme_shows_is_what_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    (tmp_path / "problems").symlink_to(ROOT / "problems")
    assert run(README) > 5


def test_commands_that_are_named_exist() -> None:
    named = set(re.findall(r"`dse (\w+)", README.read_text(encoding="utf-8")))
    assert {"solve", "analyse"} <= named <= set(COMMANDS)


def test_commands_without_json_are_named() -> None:
    without = {
        name for name in COMMANDS if "--json" not in {option for item in _command(name).params for option in item.opts}
    }
    [said] = re.findall(r"All of them but (.*?), which write files", README.read_text(encoding="utf-8"))
    assert set(re.findall(r"`(\w+)`", said)) == without


def _command(name: str) -> click.Command:
    found = cli.get_command(click.Context(cli), name)
    assert isinstance(found, click.Command)
    return found


def test_commands_to_copy_are_single_lines_that_make_their_own_environment() -> None:
    commands = {found["name"]: found["text"] for found in COMMAND.finditer(README.read_text(encoding="utf-8"))}
    assert set(commands) == {"solve", "tests"}
    for text in commands.values():
        assert text.count("\n") == 1
        assert text.startswith("python3 -m venv .venv")


def test_the_readme_is_short() -> None:
    text = README.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150 and len(text.split()) <= 1200
