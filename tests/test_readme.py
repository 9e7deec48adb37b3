"""What the README shows is what happens: its files, its console sessions and its Python session.

In the output of a command a line ``...`` stands for any lines, and ``...`` within a line for anything.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterable
from doctest import ELLIPSIS
from pathlib import Path

import pytest
from sybil import Document, Example, Region
from sybil.evaluators.doctest import DocTestEvaluator
from sybil.parsers.abstract.doctest import DocTestStringParser

from dse.cli.main import COMMANDS

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
DSE = [sys.executable, "-c", "from dse.cli.main import main; main()"]
FILE = re.compile(r"<!-- file: (?P<name>\S+) -->\n```yaml\n(?P<text>.*?)^```", re.M | re.S)
SESSION = re.compile(r"^```console\n(?P<text>.*?)^```", re.M | re.S)
COMMAND = re.compile(r"<!-- ci: (?P<name>\w+) -->\n```sh\n(?P<text>.*?)^```", re.M | re.S)
LINK = re.compile(r"\]\((?!https?:)(?P<path>[^)#]+)\)")


def files(document: Document) -> Iterable[Region]:
    """A file that is shown is there for what follows."""
    for found in FILE.finditer(document.text):
        yield Region(found.start(), found.end(), found, write_file)


def write_file(example: Example) -> None:
    Path(example.parsed["name"]).write_text(example.parsed["text"], encoding="utf-8")


def sessions(document: Document) -> Iterable[Region]:
    """A command prints what is shown, and nothing to the standard error."""
    for found in SESSION.finditer(document.text):
        yield Region(found.start(), found.end(), found["text"], run_session)


def run_session(example: Example) -> str | None:
    prompt, _, expected = example.parsed.partition("\n")
    words = shlex.split(prompt.removeprefix("$ "))
    assert words[0] == "dse"
    done = subprocess.run([*DSE, *words[1:]], capture_output=True, text=True, check=False)
    printed = "\n".join(line.rstrip() for line in done.stdout.splitlines()) + "\n"
    if re.fullmatch(pattern(expected), printed) and not done.stderr:
        return None
    return f"{prompt}\nexpected:\n{expected}\nprinted:\n{printed}\n{done.stderr}"


def pattern(expected: str) -> str:
    """The expression that output must match."""
    lines = [
        "(?:.*\n)*?" if line == "..." else ".*".join(map(re.escape, line.split("..."))) + "\n"
        for line in expected.splitlines()
    ]
    return "".join(lines)


def python(document: Document) -> Iterable[Region]:
    """A Python session gives what is shown."""
    return DocTestStringParser(DocTestEvaluator(ELLIPSIS))(document.text, document.path)


def test_what_the_readme_shows_is_what_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    (tmp_path / "problems").symlink_to(ROOT / "problems")
    document = Document.parse(str(README), files, sessions, python)
    examples = list(document.examples())
    assert len(examples) > 5
    for example in examples:
        example.evaluate()


def test_commands_that_are_named_exist() -> None:
    named = set(re.findall(r"`dse (\w+)", README.read_text(encoding="utf-8")))
    assert {"solve", "analyse"} <= named <= set(COMMANDS)


def test_links_lead_somewhere() -> None:
    paths = {found["path"] for found in LINK.finditer(README.read_text(encoding="utf-8"))}
    assert paths
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_commands_to_copy_are_single_lines_that_make_their_own_environment() -> None:
    commands = {found["name"]: found["text"] for found in COMMAND.finditer(README.read_text(encoding="utf-8"))}
    assert set(commands) == {"solve", "tests"}
    for text in commands.values():
        assert text.count("\n") == 1
        assert text.startswith("python3 -m venv .venv")
