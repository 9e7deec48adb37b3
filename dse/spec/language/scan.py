"""Parts of all expression parsers: errors with a place, quotes, comparison operators, word boundaries."""

from __future__ import annotations

import re
from collections.abc import Iterator

from dse.spec.language.expressions import Operator

MAX_TEXT = 10_000
STOPS = "()[],<>=!≤≥"
CALL = re.compile(r"(max|min)\s*\(")
"""The beginning of an extreme of several metrics, where a metric can begin."""
BEFORE_A_METRIC = "+-*/(,<>=≤≥"
_OPERATORS: tuple[tuple[str, Operator], ...] = (
    ("<=", "<="),
    (">=", ">="),
    ("==", "=="),
    ("!=", "!="),
    ("≤", "<="),
    ("≥", ">="),
    ("<", "<"),
    (">", ">"),
    ("=", "=="),
)


class ExpressionError(ValueError):
    """A text does not follow the grammar; `offset` counts characters from its start, from 0.

    `unknown` is the name that nothing has, where that is what is wrong.
    """

    def __init__(self, message: str, offset: int, hint: str = "", *, unknown: str = "") -> None:
        self.message = message
        self.offset = offset
        self.hint = hint
        self.unknown = unknown
        super().__init__(f"{message} ({hint})" if hint else message)


def check_length(text: str) -> None:
    """Refuse texts that no person writes.

    Raises `ExpressionError` for more than `MAX_TEXT` characters, so that a generated file cannot stall the parser.
    """
    if len(text) > MAX_TEXT:
        raise ExpressionError(f"the text is longer than {MAX_TEXT} characters", MAX_TEXT)


def operator_at(text: str, at: int) -> tuple[int, Operator] | None:
    """Length and meaning of the comparison operator at a place, if there is one.

    The longest operator is tried first, so that ``<=`` is not read as ``<``.
    """
    return next(((len(sign), operator) for sign, operator in _OPERATORS if text.startswith(sign, at)), None)


def unquoted(text: str) -> str:
    """The text without surrounding blanks and quotes: ``'my thread'.period`` is ``my thread.period``.

    Single and double quotes count; a name in quotes may contain blanks, dots and operators.
    """
    text = text.strip()
    for quote in "'\"":
        if text.startswith(quote) and quote in text[1:]:
            inner, _, rest = text[1:].partition(quote)
            if not rest or rest.startswith("."):
                return inner + rest
    return text


def quoted(name: str) -> str:
    """The name in quotes that it does not hold; bare where it holds both, as quotes inside a name begin nothing.

    >>> print(quoted("my thread"), quoted("bob's"))
    'my thread' "bob's"
    """
    return next((f"{quote}{name}{quote}" for quote in "'\"" if quote not in name), name)


class Scanner:
    """Finds what is inside quotes; a quote opens only where a name can begin, so that ``bob's flow`` needs none."""

    def __init__(self, text: str) -> None:
        self.text = text

    def opens_quote(self, at: int) -> bool:
        """Whether the character is a quote that begins a quoted text."""
        before = self.text[at - 1] if at else " "
        return self.text[at] in "'\"" and (before.isspace() or before in STOPS or before in ":")

    def quoted_end(self, at: int) -> int:
        """The place of the quote that closes the one at `at`.

        Raises `ExpressionError` where the quote is not closed.
        """
        end = self.text.find(self.text[at], at + 1)
        if end < 0:
            raise ExpressionError("this quote is not closed", at)
        return end

    def outside_quotes(self) -> Iterator[int]:
        """The places of all characters that are not inside quotes, the quotes themselves left out.

        Ascending indices into the text; used to find operators and words that are not part of a name.
        """
        at = 0
        while at < len(self.text):
            if self.opens_quote(at):
                at = self.quoted_end(at) + 1
                continue
            yield at
            at += 1

    def outside(self) -> Iterator[int]:
        """The places that are neither inside quotes nor of an extreme, ``max(…)`` or ``min(…)``.

        Ascending indices into the text. A comparison inside of ``max(…)`` is no comparison of the requirement.
        """
        end = 0
        for at in self.outside_quotes():
            if at >= end and self.calls(at):
                end = self.closed(self.text.index("(", at)) + 1
            if at >= end:
                yield at

    def calls(self, at: int) -> bool:
        """Whether an extreme begins at a place.

        ``max(`` or ``min(`` at the beginning or behind an operator; a metric may otherwise contain these words.
        """
        before = self.text[:at].rstrip()
        return CALL.match(self.text, at) is not None and (not before or before[-1] in BEFORE_A_METRIC)

    def closed(self, at: int) -> int:
        """The place of the parenthesis that closes the one at `at`.

        Raises `ExpressionError` where the parenthesis is not closed.
        """
        depth = 0
        for place in self.outside_quotes():
            if place < at:
                continue
            depth += (self.text[place] == "(") - (self.text[place] == ")")
            if not depth:
                return place
        raise ExpressionError("this parenthesis is not closed", at)
