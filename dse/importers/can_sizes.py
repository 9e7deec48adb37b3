"""Sizes in a CAN database that cantools would make something as large of: they are refused before it reads them.

It writes a character for each bit of a signal and of what lies before it, a number for each value in a range of a
multiplexer (DBC), and a message for each identifier in a range (SYM).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TypeAlias

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.xml import walk

Place: TypeAlias = int | re.Match[str]
"""A line, or what was found in the text."""
MOST_MISTAKES = 50
MOST_BITS = 1_000_000
"""Of a signal or message, and of what lies before a signal: frames of CAN FD have 512, PDUs of AUTOSAR some 10 000."""
MOST_BITS_TOGETHER = 100_000_000
MOST, MOST_DIGITS = 10**20, 80
MOST_OF_A_RANGE = 65_536
MOST_OF_RANGES = 1_000_000
TEXT = re.compile(r'"(?:\\"|[^"])*?"')
_EXPONENT = re.compile(r"\d[eE][+-]?0*[1-9]\d{3,}")
_DBC = (
    (re.compile(r"\bBO_\s+\d+\s+[^\s:]+\s*:\s*(\w+)"), "the message", 8),
    (re.compile(r"\bSG_\s+[^\s:]+(?:\s+\w+)?\s*:\s*(\d+)\s*\|\s*(\d+)"), "the signal", 1),
)
_RANGES_OF_DBC = re.compile(r"\bSG_MUL_VAL_\s+\d+\s[^;]*")
_RANGE = re.compile(r"(\d+)\s*-\s*(\d+)")
_WORD = r"[^\s=(\]-]{1,1000}"
_SYM = (
    (re.compile(r"\bLen\s*=\s*(\d+)"), "the message", 8),
    (re.compile(rf"\bSig\s*=\s*\S{{1,1000}}?\s*{_WORD}\s+(\d+)"), "the signal", 1),
    (re.compile(rf"\bVar\s*=\s*\S{{1,1000}}?\s*{_WORD}\s+(\d+)\s*,\s*(\d+)"), "the variable", 1),
    (re.compile(r"\bMux\s*=\s*\S{1,1000}?\s*(\d+)\s*,\s*(\d+)"), "the multiplexer", 1),
)
_RANGE_OF_SYM = re.compile(r"\bID\s*=\s*(\d[0-9A-Fa-f]*)h\s*-?\s*([0-9A-Fa-f]+)h")
_TOO_LONG = re.compile(r"(?<![^\s=(\]-])[^\s=(\]-]{1001}")
OF_KCD = ("length", "offset")
"""Attributes of signals that state bits; the length of a message states bytes."""
OF_ARXML = ("LENGTH", "POSITION", "OFFSET")
"""Endings of the names of ARXML elements that state bits or bytes."""


def check_sizes(path: Path, text: str, form: str) -> None:
    """Stop where a size or a range in the text of a database is beyond what any has.

    Raises
    ------
    ProblemError
        with each of them and its line; where XML is none, with the place of that.
    """
    if form in ("kcd", "arxml"):
        sizes = _Sizes(path)
        walk(path, text, sizes.start, sizes.end)
        sizes.check()
        return
    plain = TEXT.sub(lambda item: '"' + "\n" * item[0].count("\n") + '"', text)
    sizes = _Sizes(path)
    for pattern, what, factor in _SYM if form == "sym" else _DBC:
        for place in pattern.finditer(plain):
            sizes.take(what, [factor * _whole(number) for number in place.groups()], place)
    for range_, first, last in _ranges(plain, form):
        sizes.take_range(first, last, range_)
    for place in _EXPONENT.finditer(plain):
        sizes.wrong(f"{place[0][:60]}: a number is below 1e1000", place)
    for place in _TOO_LONG.finditer(plain) if form == "sym" else ():
        sizes.wrong(f"a word of more than 1000 characters: {place[0][:40]}...", place)
    sizes.check()


class _Sizes:
    """The mistakes among the sizes of a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.mistakes: list[Diagnostic] = []
        self.bits = self.values = 0

    def wrong(self, message: str, place: Place) -> None:
        """Note a mistake."""
        line = place if isinstance(place, int) else place.string.count("\n", 0, place.start()) + 1
        self.mistakes.append(Diagnostic(message, file=str(self.path), line=line))
        if len(self.mistakes) == MOST_MISTAKES:
            self.check()

    def take(self, what: str, sizes: list[int], place: Place) -> None:
        """The numbers of bits that a message or signal states."""
        self.bits += sum(sizes)
        if max(sizes, default=0) > MOST_BITS:
            self.wrong(f"{what} has {max(sizes)} bits: at most {MOST_BITS} are read", place)
        elif self.bits > MOST_BITS_TOGETHER >= self.bits - sum(sizes):
            self.wrong(f"signals and messages have more than {MOST_BITS_TOGETHER} bits up to here", place)

    def take_range(self, first: int, last: int, place: Place) -> None:
        """A range of values."""
        count = last - first + 1
        self.values += max(0, count)
        if count > MOST_OF_A_RANGE:
            self.wrong(f"a range of {count} values: at most {MOST_OF_A_RANGE} are read", place)
        elif self.values > MOST_OF_RANGES >= self.values - count:
            self.wrong(f"ranges have more than {MOST_OF_RANGES} values up to here", place)

    def start(self, name: str, attributes: Mapping[str, str], line: int) -> None:
        """An element of KCD, whose sizes are attributes."""
        kind = name.rpartition("}")[2].rpartition(":")[2]
        factor = 8 if kind == "Message" else 1
        named = f"{kind} {attributes.get('name', '')[:80]}".strip()
        self.take(named, [factor * _whole(attributes[key]) for key in OF_KCD if key in attributes], line)

    def end(self, name: str, text: str, line: int) -> None:
        """An element of ARXML, whose sizes are elements."""
        if name.endswith(OF_ARXML):
            self.take(name, [_whole(text)], line)

    def check(self) -> None:
        """Stop where there are mistakes."""
        if self.mistakes:
            raise ProblemError(self.mistakes)


def _whole(text: str) -> int:
    """About the number in a text, however it is written; 0 where it is none, `MOST` where it is larger."""
    digits = re.sub(r"[\s_]", "", text).lower()
    try:
        if digits[:2] in ("0x", "0b"):
            return int(digits[:MOST_DIGITS], 16 if digits[1] == "x" else 2)
        number = float(digits)
    except ValueError:
        return 0
    return int(min(number, MOST)) if number > 0 else 0


def _ranges(text: str, form: str) -> Iterator[tuple[Place, int, int]]:
    if form == "sym":
        for match in _RANGE_OF_SYM.finditer(text):
            yield match, int(match[1][-16:], 16), int(match[2][-16:], 16)
        return
    for match in _RANGES_OF_DBC.finditer(text):
        for first, last in _RANGE.findall(match[0]):
            yield match, _whole(first), _whole(last)
