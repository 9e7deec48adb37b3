"""DBC files as tools write them: what is not whole is refused, what cantools stumbles over is mended and told.

Two habits of tools are read: identifiers of more than 11 bits without the bit that marks them as long, and texts of
values (``VAL_``, ``SIG_VALTYPE_``) for signals that no message has.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dse.importers.can_sizes import TEXT
from dse.support.errors import Diagnostic, ProblemError
from dse.support.units.text import first_of

UNUSED_SIGNALS = "VECTOR__INDEPENDENT_SIG_MSG"
"""Under this name DBC files keep signals of no message."""
LONG = 1 << 31
"""The bit of an identifier in a DBC file that says that it has 29 bits."""
SHORTEST_LONG, MOST_IDENTIFIER = 1 << 11, (1 << 29) - 1
MOST_DIGITS = 10
MOST_NAMED = 8
_BEGUN = re.compile(r'^[ \t]*(?P<word>(BO_|SG_)(?!\S)|(BA_DEF_DEF_|BA_)(?=[ \t]+"))', re.MULTILINE)
_ENDED = re.compile(r'\w+\s+""[^;]*[\w"]\s*;')
_WHOLE = {
    "BA_": ("attribute", _ENDED),
    "BA_DEF_DEF_": ("attribute", _ENDED),
    "BO_": ("message", re.compile(r"BO_\s+\d+\s+[^\s:]+\s*:\s*\d+\s+\w+")),
    "SG_": (
        "signal",
        re.compile(
            r"SG_\s+[^\s:]+(\s+\w+)?\s*:\s*\d+\s*\|\s*\d+\s*@\s*[01]\s*[+-]\s*\([^()]*\)\s*\[[^\[\]]*\]\s*"
            r'"\s*"\s*\w+'
        ),
    ),
}
"""How the statements of a DBC file go, its texts left empty."""
_PART = re.compile(r"^[ \t]*(?:BO_\s+(?P<id>\d+)\s+(?P<message>[^\s:]+)|SG_\s+(?P<signal>[^\s:]+))", re.MULTILINE)
_VALUES = re.compile(r"^[ \t]*(?P<word>VAL_|SIG_VALTYPE_)\s+(?P<id>\d+)\s+(?P<signal>[^\s:;]+)[^;]*;", re.MULTILINE)
_IDENTIFIER = re.compile(r"\b(?:BO_|SG_|VAL_|SIG_VALTYPE_|SG_MUL_VAL_|BO_TX_BU_|SIG_GROUP_)\s+(?P<id>\d+)\b")


def check_statements(path: Path, text: str) -> None:
    """Stop where a message, signal or attribute of a DBC file is not whole: cantools passes over its rest.

    Raises
    ------
    ProblemError
        with the line of each of them.
    """
    plain = TEXT.sub(lambda match: '"' + "\n" * match[0].count("\n") + '"', text)
    mistakes = []
    for match in _BEGUN.finditer(plain):
        what, whole = _WHOLE[match["word"]]
        if not whole.match(plain, match.start("word")):
            line = plain.count("\n", 0, match.start("word")) + 1
            mistakes.append(
                Diagnostic(f"this {what} is not whole", file=str(path), line=line, hint="is the file cut off?")
            )
    if mistakes:
        raise ProblemError(mistakes)


def mended(path: Path, text: str) -> tuple[str, list[Diagnostic]]:
    """A DBC text that cantools reads, line for line, and what was changed in it.

    Examples
    --------
    >>> text, [remark] = mended(Path("a.dbc"), "BO_ 4000 A: 1 B")
    >>> print(text, remark.message)
    BO_ 2147487648 A: 1 B identifiers of more than 11 bits that are not marked as long count as 29 bits: A (0xfa0)
    """
    plain = TEXT.sub(lambda match: '"' + re.sub(r"[^\n]", " ", match[0][1:-1]) + '"', text)
    statements = _Statements(path, plain)
    cuts = [*statements.unused(), *statements.renumbered()]
    pieces, end = [], 0
    for start, stop, new in sorted(cuts):
        if start >= end:
            pieces += [text[end:start], new]
            end = stop
    return "".join([*pieces, text[end:]]), statements.told


@dataclass
class _Statements:
    """The messages of a DBC text whose quoted texts are blank, and what is wrong with what concerns them."""

    path: Path
    plain: str
    told: list[Diagnostic] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Look for messages and their signals."""
        self.signals: dict[int, set[str]] = {}
        self.messages: dict[int, tuple[str, int]] = {}
        of: int | None = None
        for part in _PART.finditer(self.plain):
            if part["signal"] is None:
                of = None if part["message"] == UNUSED_SIGNALS else _number(part["id"])
                if of is not None:
                    self.messages.setdefault(of, (part["message"], part.start("message")))
                    self.signals.setdefault(of, set())
            elif of is not None:
                self.signals[of].add(part["signal"])

    def unused(self) -> Iterator[tuple[int, int, str]]:
        """The places of values without a signal: start, end and the empty lines that replace them."""
        statements = [
            item
            for item in _VALUES.finditer(self.plain)
            if item["signal"] not in self.signals.get(_number(item["id"]), ())
        ]
        self._tell(
            "left out: values of signals that no message has",
            [
                (f"{item['signal']} ({item['word']} {item['id'][:MOST_DIGITS]})", item.start("word"))
                for item in statements
            ],
        )
        return ((item.start(), item.end(), "\n" * item[0].count("\n")) for item in statements)

    def renumbered(self) -> Iterator[tuple[int, int, str]]:
        """The places of identifiers that are too long for 11 bits: start, end and the identifier marked as long."""
        long: Mapping[int, tuple[str, int]] = {
            key: item
            for key, item in self.messages.items()
            if SHORTEST_LONG <= key <= MOST_IDENTIFIER and key | LONG not in self.messages
        }
        self._tell(
            "identifiers of more than 11 bits that are not marked as long count as 29 bits",
            [(f"{name} ({key:#x})", at) for key, (name, at) in long.items()],
        )
        for item in _IDENTIFIER.finditer(self.plain) if long else ():
            if (key := _number(item["id"])) in long:
                yield item.start("id"), item.end("id"), str(key | LONG)

    def _tell(self, words: str, items: list[tuple[str, int]]) -> None:
        if items:
            line = self.plain.count("\n", 0, items[0][1]) + 1
            names = first_of([name for name, _ in items], MOST_NAMED)
            message = f"{words}: {names}"
            self.told.append(Diagnostic(message, file=str(self.path), line=line, severity="warning"))


def _number(text: str) -> int:
    return int(text) if len(text) <= MOST_DIGITS else -1
