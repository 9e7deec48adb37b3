"""The line that moves on a terminal; help in groups; what a shell completes."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import click
import pytest
from click.shell_completion import BashComplete
from click.testing import CliRunner

from dse.cli import progress
from dse.cli.grouping import GROUPS
from dse.cli.main import COMMANDS, cli
from dse.cli.progress import Working
from dse.examples.shipped import example_path

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"


def test_something_moves_at_once_and_ctrl_c_is_acknowledged(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(progress, "rewrite", said.append)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    before = signal.signal(signal.SIGINT, lambda *_: None)
    try:
        with Working("making the model", quiet=False) as line:
            until = time.monotonic() + 10
            while len(said) < 2 and time.monotonic() < until:
                time.sleep(0.01)
            assert said[0].startswith("making the model, 0.") and said[1] != said[0]
            line.text = "3 points, 2 regions open"
            os.kill(os.getpid(), signal.SIGINT)
            while not said[-1].startswith("Ctrl-C: stopping") and time.monotonic() < until:
                time.sleep(0.01)
            assert said[-1].startswith("Ctrl-C: stopping, and keeping what was found; again: at once")
    finally:
        signal.signal(signal.SIGINT, before)
    assert said[-1] == "" and signal.set_wakeup_fd(-1) == -1


@pytest.mark.parametrize("quiet", [True, False])
def test_nothing_moves_in_a_pipe_or_where_it_shall_be_quiet(quiet: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(progress, "rewrite", said.append)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: quiet, raising=False)
    with Working("making the model", quiet=quiet):
        pass
    assert said == []


def sections_of(shown: str) -> list[str]:
    """The lines from the first group of options on."""
    lines = shown.splitlines()
    return lines[min(lines.index(f"{title}:") for title in (*GROUPS, "Options") if f"{title}:" in lines) :]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_every_option_once_what_is_asked_first(name: str) -> None:
    shown = CliRunner().invoke(cli, [name, "--help"], env={"COLUMNS": "200"}).output
    assert isinstance(cli, click.Group)
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    below = sections_of(shown)
    lines = [line.strip() for line in below if line.startswith("  -") or not line.startswith(" ")]
    for item in command.params:
        if isinstance(item, click.Option) and not item.hidden:
            longest = max(item.opts, key=len)
            assert (
                sum(longest in line.split("  ")[0].replace(",", "").split() for line in lines if line[:1] == "-") == 1
            ), longest
    titles = [line.rstrip(":") for line in lines if line.rstrip(":") in GROUPS]
    assert titles == [title for title in GROUPS if title in titles]
    if name in ("solve", "sweep", "explain", "check", "analyse"):
        assert titles[0] == "What is asked"


def test_the_first_options_of_solve_are_limits_objectives_and_fixes() -> None:
    shown = CliRunner().invoke(cli, ["solve", "--help"], env={"COLUMNS": "200"}).output
    options = [line.split()[0].rstrip(",") for line in sections_of(shown) if line.startswith("  --")]
    assert options[:9] == [*(f"--max-{name}" for name in (
        "jitter", "latency", "utilisation", "load", "busy", "price", "power", "changes")), "--minimise"]  # fmt: skip
    assert options[9:11] == ["--maximise", "--fix"]


def test_all_and_quiet_mean_one_thing() -> None:
    assert isinstance(cli, click.Group)
    texts: dict[str, set[str | None]] = {}
    for name in COMMANDS:
        command = cli.get_command(click.Context(cli), name)
        assert command is not None
        for item in command.params:
            if isinstance(item, click.Option) and {"--all", "--quiet"} & set(item.opts):
                texts.setdefault(item.opts[-1], set()).add(item.help)
    assert {option: len(found) for option, found in texts.items()} == {"--all": 1, "--quiet": 1}


def completed(words: list[str], begun: str) -> list[str]:
    found = BashComplete(cli, {}, "dse", "_DSE_COMPLETE").get_completions(words, begun)
    return [item.value for item in found]


def test_a_shell_completes_examples_rankings_and_options_of_decisions() -> None:
    assert completed(["new", "--example"], "inmark") == ["inmark", "inmark_chapter2", "inmark_chapter3", "inmark_clock"]
    assert completed(["solve", str(PUMP), "--rank-by"], "k") == ["knee"]
    assert completed(["solve", str(PUMP), "--rank-by"], "order:p") == ["order:price"]
    assert completed(["solve", str(PUMP), "--fix"], "can0") == ["can0.type = can_250k", "can0.type = can_500k"]
    assert completed(["solve", str(example_path("starter")), "--fix"], "computer") == [
        "computer.type = small", "computer.type = large",
    ]  # fmt: skip
    assert completed(["solve", "--fix"], "can0") == []
