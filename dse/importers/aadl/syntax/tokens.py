"""AADL text to tokens that know their place; comments and blanks are left out, an annex is one token."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

from dse.importers.allowance import spend
from dse.importers.registry import Place
from dse.support.errors import Diagnostic, ProblemError

_TOKEN = re.compile(
    r"""
    (?P<blank>\s+|--[^\n]*)
  | (?P<annex>\{\*\*.*?\*\*\})
  | (?P<name>[A-Za-z][A-Za-z0-9_]*)
  | (?P<number>[0-9][0-9_]*\#[0-9A-Fa-f_]+\#(?:[eE][+-]?[0-9]+)?|[0-9][0-9_]*(?:\.[0-9][0-9_]*)?(?:[eE][+-]?[0-9]+)?)
  | (?P<string>"(?:[^"\\]|\\.|"")*")
  | (?P<symbol>\+=>|=>|<->|->|\]->|-\[|::|\.\.|\{(?!\*\*)|[:;,.()}\[\]+\-*@<>=|!/\\%&^?~'])
    """,
    re.X | re.S,
)
END = "the end of the file"
PIECES = 10
"""The share of the allowance that a token takes."""


@dataclass(frozen=True, slots=True)
class Token:
    """One token: its kind (``name``, ``number``, ``string``, ``symbol``, ``annex``, ``end``), text and offset.

    `key` is the text in small letters: AADL does not tell them from capitals.
    """

    kind: str
    text: str
    key: str
    offset: int


class SourceText:
    """The text of one AADL file, with the places of its offsets."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def place(self, offset: int) -> Place:
        """Line and column of an offset, counted from 1."""
        line = bisect_right(self._starts, offset)
        return Place(self.file, line, offset - self._starts[line - 1] + 1)

    def fail(self, message: str, offset: int, hint: str = "") -> NoReturn:
        """Raise `ProblemError` with one finding at an offset."""
        raise ProblemError([finding(message, self.place(offset), hint)])

    def tokens(self) -> Iterator[Token]:
        """The tokens, and one of kind ``end`` behind them.

        Raises
        ------
        ProblemError
            at a character that begins no token.
        """
        at, size = 0, len(self.text)
        while at < size:
            match = _TOKEN.match(self.text, at)
            if match is None:
                self._fail_at(at)
            kind = match.lastgroup
            assert kind is not None
            if kind != "blank":
                spend(PIECES)
                text = match.group()
                yield Token(kind, text, text.lower() if kind == "name" else text, at)
            at = match.end()
        yield Token("end", END, "", size)

    def _fail_at(self, at: int) -> NoReturn:
        if self.text[at] == '"':
            self.fail(
                "the text that begins here does not end", at, "a text ends with a quote, one within it has a backslash"
            )
        if self.text.startswith("{**", at):
            self.fail("the annex that begins here does not end", at, 'it ends with "**}"')
        char = self.text[at]
        self.fail(f"{char!r} begins nothing in AADL" if char.isprintable() else f"character U+{ord(char):04X}", at)


def finding(message: str, place: Place, hint: str = "", *, warning: bool = False) -> Diagnostic:
    """A finding at a place of a model."""
    severity = "warning" if warning else "error"
    return Diagnostic(message, "", place.file, place.line, place.column, hint, severity)  # type: ignore[arg-type]
