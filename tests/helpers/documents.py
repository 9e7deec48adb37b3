"""Documents as tests: their files, their console sessions, their Python sessions and their tables of figures.

In the output of a command a line ``...`` stands for any lines, and ``...`` within a line for anything.
"""

from __future__ import annotations

import io
import re
import shlex
from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from doctest import ELLIPSIS
from pathlib import Path

from sybil import Document, Example, Region
from sybil.evaluators.doctest import DocTestEvaluator
from sybil.parsers.abstract.doctest import DocTestStringParser

import dse
from dse.cli.main import run as command

ROOT = Path(__file__).parents[2]
FILE = re.compile(r"<!-- file: (?P<name>\S+) -->\n```yaml\n(?P<text>.*?)^```", re.M | re.S)
SESSION = re.compile(r"^```console\n(?P<text>.*?)^```", re.M | re.S)
FIGURES = re.compile(r"<!-- figures: (?P<name>\S+) -->\n(?P<table>(?:^\|.*\n)+)", re.M)


PROGRESS = re.compile(r"^\d[\d ]* (points?, .* open, [\d.]+ s|of \d+ runs.*)\n", re.M)
"""Lines of progress, which a slow machine prints to the standard error."""


def files(document: Document) -> Iterable[Region]:
    """A file that is shown is there for what follows."""
    for found in FILE.finditer(document.text):
        yield Region(found.start(), found.end(), found, write_file)


def write_file(example: Example) -> None:
    Path(example.parsed["name"]).write_text(example.parsed["text"], encoding="utf-8")


def sessions(document: Document) -> Iterable[Region]:
    """A command prints what is shown, and nothing but progress to the standard error."""
    for found in SESSION.finditer(document.text):
        yield Region(found.start(), found.end(), found["text"], run_session)


def run_session(example: Example) -> str | None:
    prompt, _, expected = example.parsed.partition("\n")
    words = shlex.split(prompt.removeprefix("$ "))
    assert words[0] == "dse"
    out, error = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(error):
        command(words[1:])
    printed = "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"
    if re.fullmatch(pattern(expected), printed) and not PROGRESS.sub("", error.getvalue()):
        return None
    return f"{prompt}\nexpected:\n{expected}\nprinted:\n{printed}\n{error.getvalue()}"


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


def figures(document: Document) -> Iterable[Region]:
    """A table of metrics holds what the analysis of a file's only design gives."""
    for found in FIGURES.finditer(document.text):
        yield Region(found.start(), found.end(), found, check_figures)


def check_figures(example: Example) -> str | None:
    rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in example.parsed["table"].splitlines()[2:]]
    expected = {name: int(value) for name, value in rows}
    computed = dse.analyse(example.parsed["name"]).metrics
    wrong = {name: computed.get(name) for name, value in expected.items() if computed.get(name) != value}
    return f"the analysis gives {wrong}" if wrong or not expected else None


def run(path: Path) -> int:
    """Run everything that a document shows, in the current folder; how many examples there were."""
    examples = list(Document.parse(str(path), files, sessions, figures, python).examples())
    for example in examples:
        example.evaluate()
    return len(examples)
