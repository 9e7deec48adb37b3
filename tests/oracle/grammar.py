"""The small languages of a problem file: metrics, requirements, objectives, derived metrics and rules, as tuples."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import TypeAlias

from .quantities import NUMBER, UNITS, Quantity, quantity

METRICS = (
    "latency", "min latency", "jitter", "run jitter", "reaction time", "data age", "disparity", "utilisation", "load",
    "busy", "price", "power", "response time",
)  # fmt: skip
KEYWORDS = {"and", "or", "not", "implies", "requires", "in", "is"}
OPERATORS = {"<=", "<", ">=", ">", "==", "!="}
Sum: TypeAlias = "tuple[tuple[int, Metric | Extreme, tuple[tuple[int, Quantity], ...]], ...]"

_TOKEN = re.compile(r"""\s*('[^']*'(?:\.\w+)?|"[^"]*"(?:\.\w+)?|<=|>=|==|!=|[<>()\[\],]|[^\s()\[\],<>=!'"]+)""")
_UNIT = "|".join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))
_TERM_TOKEN = re.compile(
    rf"""\s*('[^']*'|"[^"]*"|{NUMBER.removeprefix("[+-]?")}(?:\s*(?:{_UNIT})(?![\w/]))?"""
    r"""|[+\-*/(),]|[^\s+\-*/'"(),]+)"""
)


@dataclass(frozen=True)
class Metric:
    """``METRIC [of NAME]``."""

    name: str
    of: str | None


@dataclass(frozen=True)
class Extreme:
    """``max(…)`` or ``min(…)`` of sums; a metric that stands alone without ``of`` is every one of its kind."""

    kind: str
    operands: tuple[Sum, ...]
    of: None = None

    @property
    def name(self) -> str:
        """For lists of what is covered."""
        return self.kind


@dataclass(frozen=True)
class Requirement:
    """``METRIC [of NAME] OP QUANTITY``; the limit stays text: what it means depends on the metric."""

    text: str
    metric: Metric | Extreme
    operator: str
    limit: str


@dataclass(frozen=True)
class Objective:
    """``minimise METRIC`` (sign 1) or ``maximise METRIC`` (sign -1)."""

    text: str
    sign: int
    metric: Metric | Extreme


@dataclass(frozen=True)
class Rule:
    """``require`` (wanted: not False) or ``forbid`` (wanted: not True) a condition, which is a nested tuple."""

    text: str
    forbid: bool
    condition: tuple


def _scan(pattern: re.Pattern[str], text: str) -> list[str]:
    tokens, position, text = [], 0, text.rstrip()
    while position < len(text):
        match = pattern.match(text, position)
        if match is None:
            raise ValueError(f"cannot read {text[position:]!r} in {text!r}")
        tokens.append(match[1])
        position = match.end()
    return tokens


def unquote(token: str) -> str:
    """The name that a token stands for: ``'my bus'.type`` is ``my bus.type``."""
    match = re.fullmatch(r"""(['"])(.*)\1(\.\w+)?""", token)
    return match[2] + (match[3] or "") if match else token


def metric(tokens: list[str]) -> Metric:
    """``["jitter", "of", "f"]``."""
    if "of" in tokens:
        at = tokens.index("of")
        return Metric(" ".join(map(unquote, tokens[:at])), " ".join(map(unquote, tokens[at + 1 :])))
    return Metric(" ".join(map(unquote, tokens)), None)


def core_of(of: str | None) -> tuple[int | None, str] | None:
    """The core (None: each) and the processor that ``core N of P`` and ``each core of P`` name."""
    found = re.fullmatch(r"(?:core (\d+)|each core) of (.+)", of or "")
    return None if found is None else (int(found[1]) if found[1] else None, unquote(found[2]))


def inner(metric: Metric | Extreme) -> list[Metric]:
    """A metric, or all that an extreme is made of."""
    if isinstance(metric, Metric):
        return [metric]
    return [item for operand in metric.operands for _, one, _ in operand for item in inner(one)]


@cache
def requirement(text: str) -> Requirement:
    """Reads ``METRIC [of NAME] OP QUANTITY``."""
    if re.match(r"\s*(max|min)\s*\(", text):
        left, operator, limit = re.split(r"\s*(<=|>=|==|<|>)\s*", text, maxsplit=1)
        return Requirement(text, _asked(left), operator, limit)
    tokens = _scan(_TOKEN, text)
    at = next(i for i, token in enumerate(tokens) if token in OPERATORS)
    return Requirement(text, metric(tokens[:at]), tokens[at], " ".join(tokens[at + 1 :]))


@cache
def objective(text: str) -> Objective:
    """Reads ``minimise METRIC [of NAME]`` or ``maximise …``."""
    verb, _, rest = text.strip().partition(" ")
    return Objective(text, {"minimise": 1, "maximise": -1}[verb], _asked(rest))


@cache
def derived(text: str) -> Sum:
    """A sum of terms (sign, metric or extreme, constants each with exponent 1 or -1)."""
    tokens = _scan(_TERM_TOKEN, text)
    terms = _sum(tokens)
    if tokens:
        raise ValueError(f"cannot read {' '.join(tokens)!r} in {text!r}")
    return terms


def _sum(tokens: list[str]) -> Sum:
    terms, sign = [], 1
    while tokens and tokens[0] not in "),":
        while tokens and tokens[0] in "+-":
            sign = sign if tokens.pop(0) == "+" else -sign
        constants, words, found, exponent = [], [], None, 1
        while tokens and tokens[0] not in ("+", "-", ")", ","):
            if tokens[0] in ("*", "/"):
                exponent = 1 if tokens.pop(0) == "*" else -1
            elif tokens[0][0] in "0123456789.":
                constant = quantity(tokens.pop(0))
                assert constant is not None
                constants.append((exponent, constant))
            elif exponent < 0:
                raise ValueError(f"a constant cannot be divided by a metric: {tokens}")
            elif tokens[0] in ("max", "min") and tokens[1:2] == ["("]:
                found = _extreme(tokens)
            else:
                words.append(tokens.pop(0))
        terms.append((sign, found or metric(words), tuple(constants)))
        sign = 1
    return tuple(terms)


def _extreme(tokens: list[str]) -> Extreme:
    kind, _ = tokens.pop(0), tokens.pop(0)
    operands = [_sum(tokens)]
    while tokens.pop(0) == ",":
        operands.append(_sum(tokens))
    return Extreme(kind, tuple(operands))


def _asked(text: str) -> Metric | Extreme:
    """What is limited or optimised: ``METRIC [of NAME]``, ``max(…)`` or ``min(…)``."""
    if re.match(r"\s*(max|min)\s*\(", text):
        ((sign, found, constants),) = derived(text)
        assert sign == 1 and not constants
        return found
    return metric(_scan(_TOKEN, text))


def value_of(constants: tuple[tuple[int, Quantity], ...]) -> Fraction:
    """The product of the constants of a term, in coherent units."""
    product = Fraction(1)
    for exponent, constant in constants:
        product = product * constant.value if exponent > 0 else product / constant.value
    return product


@cache
def rule(text: str) -> Rule:
    """Reads ``[require | forbid] CONDITION``; ``implies`` and ``requires`` bind weakest, then or, and, not."""
    tokens = _scan(_TOKEN, text)
    forbid = tokens[0] == "forbid"
    if tokens[0] in ("require", "forbid"):
        tokens = tokens[1:]
    condition = _implication(tokens)
    if tokens:
        raise ValueError(f"cannot read {' '.join(tokens)!r} in {text!r}")
    return Rule(text, forbid, condition)


def operands(condition: tuple) -> list[str]:
    """Every name and value that a condition compares.

    >>> operands(rule("a.core == 1 implies not b.type in [x, y]").condition)
    ['a.core', '1', 'b.type', 'x', 'y']
    """
    kind, *parts = condition
    if kind in ("and", "or"):
        return [text for part in parts[0] for text in operands(part)]
    if kind == "not":
        return operands(parts[0])
    if kind == "in":
        return [parts[0], *parts[1]]
    return [parts[0], parts[2]] if kind == "compare" else list(parts)


def _implication(tokens: list[str]) -> tuple:
    left = _chain(tokens, "or", lambda rest: _chain(rest, "and", _negation))
    if tokens and tokens[0] in ("implies", "requires"):
        tokens.pop(0)
        return ("or", (("not", left), _implication(tokens)))
    return left


def _chain(tokens: list[str], word: str, part) -> tuple:
    parts = [part(tokens)]
    while tokens and tokens[0] == word:
        tokens.pop(0)
        parts.append(part(tokens))
    return parts[0] if len(parts) == 1 else (word, tuple(parts))


def _negation(tokens: list[str]) -> tuple:
    if tokens[0] == "not":
        tokens.pop(0)
        return ("not", _negation(tokens))
    if tokens[0] == "(":
        tokens.pop(0)
        inside = _implication(tokens)
        if tokens.pop(0) != ")":
            raise ValueError("a bracket is not closed")
        return inside
    left = _operand(tokens)
    if tokens and tokens[0] in OPERATORS:
        return ("compare", left, tokens.pop(0), _operand(tokens))
    if tokens and tokens[0] == "in":
        del tokens[:2]
        values = [_operand(tokens)]
        while tokens.pop(0) == ",":
            values.append(_operand(tokens))
        return ("in", left, tuple(values))
    if tokens[:4] == ["is", "a", "multiple", "of"]:
        del tokens[:4]
        return ("multiple", left, _operand(tokens))
    return ("used", left)


def _operand(tokens: list[str]) -> str:
    words = []
    while tokens and tokens[0] not in KEYWORDS and tokens[0] not in OPERATORS and tokens[0] not in "()[],":
        words.append(unquote(tokens.pop(0)))
    if not words:
        raise ValueError(f"a name or value is missing before {' '.join(tokens)!r}")
    return " ".join(words)
