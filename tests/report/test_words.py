"""Words that no output uses: texts of the program, descriptions of the schema, help of the commands."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

DSE = Path(__file__).parents[2] / "dse"
UNUSED = (
    "hangs? on", "is told", "are told", "mends?", "mended", "must give", "goes before", "stands out", "fellow",
    "comes across", "at rest", "counts it otherwise", "nobody", "besides?", "gives? up", "given up",
    "so manieth", "keeps everything",
)  # fmt: skip
WORDS = re.compile(rf"\b({'|'.join(UNUSED)})\b", re.IGNORECASE)
INNER = ("analysis/scheduling", "encode", "verification", "importers")
"""Folders whose texts are not read yet."""


def texts(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """The texts of a module with a blank in them, but for docstrings and texts that stand alone."""
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in alone
            and " " in node.value
        ):
            yield node.lineno, node.value


def test_no_text_of_the_program_uses_an_unclear_word() -> None:
    found = [
        f"{path.relative_to(DSE)}:{line}: {hit[0]}: {text[:80]}"
        for path in sorted(DSE.rglob("*.py"))
        if not any(path.is_relative_to(DSE / folder) for folder in INNER)
        for line, text in texts(ast.parse(path.read_text(encoding="utf-8")))
        for hit in WORDS.finditer(text)
    ]
    assert found == []


@pytest.mark.parametrize("name", ["spec/schema/descriptions.yaml", "report/templates/first.html.j2"])
def test_no_description_uses_an_unclear_word(name: str) -> None:
    text = (DSE / name).read_text(encoding="utf-8")
    assert [hit[0] for hit in WORDS.finditer(text)] == []


def test_the_words_are_found() -> None:
    assert WORDS.search("What each metric hangs on most")
    assert not WORDS.search("The most influential input")
