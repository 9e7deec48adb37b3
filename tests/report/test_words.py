"""Words that no output uses: texts of the program, descriptions of the schema, help of the commands."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import pytest

DSE = Path(__file__).parents[2] / "dse"
UNUSED = (
    "hangs? on", "is told", "are told", "mends?", "mended", "must give", "goes before", "stands out", "fellow",
    "comes across", "at rest", "counts it otherwise", "nobody", "besides?", "gives? up", "given up",
    "so manieth", "keeps everything", "told", "anew", "likewise", "go before", "come across", "mending",
)  # fmt: skip
WORDS = re.compile(rf"\b({'|'.join(UNUSED)})\b", re.IGNORECASE)
INNER = ("analysis/scheduling", "encode", "verification", "importers")
"""Folders whose texts are not read yet."""


@cache
def modules() -> Mapping[Path, ast.Module]:
    """Every module of the program by its path."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(DSE.rglob("*.py"))}


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
        for path, tree in modules().items()
        if not any(path.is_relative_to(DSE / folder) for folder in INNER)
        for line, text in texts(tree)
        for hit in WORDS.finditer(text)
    ]
    assert found == []


@pytest.mark.parametrize("name", ["spec/schema/descriptions.yaml", "report/templates/first.html.j2"])
def test_no_description_uses_an_unclear_word(name: str) -> None:
    text = (DSE / name).read_text(encoding="utf-8")
    assert [hit[0] for hit in WORDS.finditer(text)] == []


ONE_LINE_PERCENT = 30
"""At most this share of the public functions, classes and methods says all in one line."""
LEANING = re.compile(r"The same|That of|Those |See `|So (often|many|much|deep|long)\b")
"""How a docstring begins that needs the one above it."""
NOT_READ_YET = ("encode/scheduling",)
"""Folders where a docstring may still lean on its neighbour."""
CLAUSE = re.compile(r"What\b")
"""How a public docstring begins that has a clause in place of the noun of the field."""


def public_docstrings(tree: ast.AST) -> Iterator[str]:
    """The docstring of each public function, class and method of a module, "" where there is none."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If | ast.Try):
            yield from public_docstrings(node)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield ast.get_docstring(node) or ""
            if isinstance(node, ast.ClassDef):
                yield from public_docstrings(node)


def public_modules() -> Iterator[tuple[Path, ast.Module]]:
    for path, tree in modules().items():
        if not path.stem.startswith("_") or path.stem == "__init__":
            yield path, tree


def test_most_public_docstrings_say_more_than_one_line() -> None:
    """What is returned, with unit and shape, what is raised, the source: that takes more than a line."""
    found = [text for _, tree in public_modules() for text in public_docstrings(tree)]
    short = sum("\n" not in text.strip() for text in found)
    assert 100 * short <= ONE_LINE_PERCENT * len(found), f"{short} of {len(found)}"


def test_no_docstring_leans_on_its_neighbour() -> None:
    found = [
        f"{path.relative_to(DSE)}:{node.lineno}"
        for path, tree in public_modules()
        if not any(path.is_relative_to(DSE / folder) for folder in NOT_READ_YET)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if LEANING.match(str(node.value.value))
    ]
    assert found == []


def test_public_docstrings_begin_with_a_noun_or_a_verb() -> None:
    found = [
        f"{path.relative_to(DSE)}: {text.splitlines()[0]}"
        for path, tree in public_modules()
        for text in public_docstrings(tree)
        if CLAUSE.match(text)
    ]
    assert found == []


LEANING_TEXT = re.compile(r"(They|It|Its|That|Those|The same|In each|As for|Why it|Whether (it|that))\b")
"""How the text of a field begins that needs another one to be understood."""


def test_no_text_of_an_answer_leans_on_its_neighbour() -> None:
    """Texts of fields of JSON stand by themselves in a schema and in docs/formats.md."""
    answers = {path: tree for path, tree in modules().items() if path.is_relative_to(DSE / "answers")}
    leaning = [
        f"{path.relative_to(DSE)}:{line}: {text[:80]}"
        for path, tree in answers.items()
        for line, text in texts(tree)
        if LEANING_TEXT.match(text)
    ]
    assert leaning == []


def test_the_words_are_found() -> None:
    assert WORDS.search("What each metric hangs on most")
    assert not WORDS.search("The most influential input")
