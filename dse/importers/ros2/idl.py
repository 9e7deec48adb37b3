"""Expressions in IDL that would be computed without an end: they are refused before rosbags computes them.

It shifts and multiplies whatever is stated, and tries each pair of parentheses, and each sequence in a sequence (of
which it takes one), in many ways, within each other in many times many.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

MOST_BITS = 4096
"""Of a number that an expression may have."""
MOST_SHIFTED = 63
_COVER = re.compile(
    r'/\*.*?(?:\*/|\Z)|//[^\n]*|"(?:\\.|[^"\\])*"|@\s*[\w:]+\s*\([^()"]*(?:"(?:\\.|[^"\\])*"[^()"]*)*\)', re.DOTALL
)
"""Comments, texts, and annotations with what is in their parentheses."""
_NESTED = re.compile(r"\bsequence\s*<\s*sequence\b")
_PART = re.compile(r"(?P<shift><<\s*(?P<by>[^\s;,\]})>]*))|(?P<name>[A-Za-z_]\w*)|(?P<number>\d\w*)")


def wrong_expressions(text: str) -> Iterator[tuple[int, str]]:
    """The expressions in a text of IDL that cannot be computed, each as a line and a message.

    Every number of a statement is counted as if all numbers in it were multiplied: its bits add up.

    >>> list(wrong_expressions("const long A = 1 << 3; const long B = 1 << 99999999999;"))
    [(1, 'a number is shifted by at most 63, as `<< 63`')]
    """
    plain = _COVER.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    bits: dict[str, int] = {}
    line = 1
    for statement in re.split(r"[;{}]", plain):
        first = line + statement[: len(statement) - len(statement.lstrip())].count("\n")
        line += statement.count("\n")
        if "(" in statement:
            yield first, "parentheses are not read here: state the value"
        if _NESTED.search(statement):
            yield first, "a sequence of sequences is not read here: give the inner one a struct"
        match = 0
        for part in _PART.finditer(statement):
            if part["shift"]:
                by = part["by"]
                if not (by.isdecimal() and len(by) < 4 and int(by) <= MOST_SHIFTED):
                    yield first, f"a number is shifted by at most {MOST_SHIFTED}, as `<< {MOST_SHIFTED}`"
                match += MOST_SHIFTED
            elif part["number"]:
                match += 4 * len(part["number"])
            else:
                match += bits.get(part["name"], 0)
        if match > MOST_BITS:
            yield first, "the numbers of this statement are too large"
            match = MOST_BITS
        named, is_stated, _ = statement.partition("=")
        if is_stated and "const" in named:
            name = named.split()[-1]
            bits[name] = max(match, bits.get(name, 0))
