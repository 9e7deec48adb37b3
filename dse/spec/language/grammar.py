"""Texts of requirements, objectives, derived metrics, rules and command-line assignments to syntax trees.

One recursive-descent parser without tables. Names may contain blanks: after ``of`` a name runs to the operator or the
end; in rules a known name is matched greedily; anything can be put in quotes. Names are not resolved here, beyond
telling in a rule what is a decision, what is a bare name and what is a literal.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from fractions import Fraction
from typing import Literal

from dse.spec.language.expressions import (
    DerivedExpr,
    ExtremeRef,
    MetricExpr,
    MetricRef,
    ObjectiveExpr,
    Operator,
    RequirementExpr,
    RuleExpr,
)
from dse.spec.language.rules import RuleParser
from dse.spec.language.scan import CALL, ExpressionError, Scanner, check_length, operator_at, unquoted
from dse.support.units import DIMENSIONLESS, UNITS, Dimension, Quantity, UnitError, parse_quantity, shown, unit_hint

__all__ = [
    "ExpressionError",
    "parse_assignment",
    "parse_derived",
    "parse_limit",
    "parse_objective",
    "parse_requirement",
    "parse_rule",
]

_SENSES: dict[str, Literal["minimise", "maximise"]] = {
    "minimise": "minimise",
    "minimize": "minimise",
    "maximise": "maximise",
    "maximize": "maximise",
}
_METRICS = {"max latency": "latency", "maximum latency": "latency", "minimum latency": "min latency"}
_METRICS |= {"utilization": "utilisation"}
_STARTS_NUMBER = re.compile(r"[+-]?\.?[0-9]")
_OF = re.compile(r"\bof\b")
DEEPEST = 20
"""How deep extremes may be nested."""


def parse_requirement(text: str) -> RequirementExpr:
    """``METRIC [of NAME] OP QUANTITY``.

    >>> parse_requirement("jitter of gnss_to_sprayer <= 100 ms").metric
    MetricRef(metric='jitter', of='gnss_to_sprayer')
    """
    check_length(text)
    match = next(_operators(text), None)
    if match is None:
        hint = 'such as "jitter of my_flow <= 20 ms"'
        raise ExpressionError("expected a comparison, METRIC [of NAME] <= QUANTITY", len(text), hint)
    start, end, operator = match
    if operator == "!=":
        raise ExpressionError('a requirement has no "!="', start, "use <=, <, >=, > or ==")
    another = next(_operators(text, end), None)
    if another is not None:
        raise ExpressionError("one comparison at a time", another[0], "write two requirements")
    return RequirementExpr(text.strip(), _metric(text[:start], 0), operator, _quantity(text[end:], end))


def parse_objective(text: str) -> ObjectiveExpr:
    """``minimise METRIC [of NAME]`` or ``maximise …``.

    An `ObjectiveExpr` with the names not yet resolved. Raises `ExpressionError` for another verb, for a comparison, and
    for text behind the metric.
    """
    check_length(text)
    verb, _, rest = text.strip().partition(" ")
    sense = _SENSES.get(verb)
    if sense is None:
        hint = f'such as "{_meant_objective(verb, rest.strip()[:80], text.strip()[:80])}"'
        raise ExpressionError('expected "minimise" or "maximise"', 0, hint)
    offset = len(text) - len(rest)
    _check_closed(rest, offset)
    operator = next(_operators(rest, inside=True), None)
    if operator is not None:
        raise ExpressionError("an objective has no comparison", offset + operator[0], "make it a requirement")
    return ObjectiveExpr(text.strip(), sense, _metric(rest, offset))


def _meant_objective(verb: str, rest: str, text: str) -> str:
    """The objective that a text without "minimise" or "maximise" may mean.

    >>> _meant_objective("min", "price", "min price"), _meant_objective("", "", "price")
    ('minimise price', 'minimise price')
    """
    short = verb.casefold()
    if rest and short[:3] in ("min", "max"):
        return f"{'minimise' if short.startswith('min') else 'maximise'} {rest}"
    return f"minimise {text or 'price'}"


def parse_derived(text: str) -> DerivedExpr:
    """A sum of metrics and of extremes of metrics, each multiplied or divided by constants.

    >>> [str(metric) for _, metric in parse_derived("2 * latency of a - latency of b / 2").terms]
    ['latency of a', 'latency of b']
    >>> [str(metric) for _, metric in parse_derived("max(load) - min(load of a,  load of b + load of c)").terms]
    ['max(load)', 'min(load of a, load of b + load of c)']
    """
    check_length(text)
    operator = next(_operators(text, inside=True), None)
    if operator is not None:
        raise ExpressionError("a derived metric has no comparison", operator[0])
    _check_closed(text, 0)
    return DerivedExpr(text.strip(), _sum(text, 0, 0))


def parse_rule(text: str, names: Collection[str], bare: Collection[str]) -> RuleExpr:
    """``[require | forbid] CONDITION``.

    Parameters
    ----------
    text
        The rule.
    names
        Full names of decisions, such as ``gnss_provider.period``.
    bare
        Names that may stand alone: types and slots.
    """
    check_length(text)
    return RuleParser(text, names, bare).rule()


def parse_assignment(text: str) -> tuple[str, str]:
    """``NAME = VALUE`` (also ``==`` and ``:``), as in ``--fix "gnss_provider.period = 10 ms"``.

    The name of the decision and the text of its value, without quotes. Raises `ExpressionError` where one of them is
    missing.
    """
    check_length(text)
    start, end = _separator(text)
    name, value = unquoted(text[:start]), unquoted(text[end:])
    if not name:
        raise ExpressionError("expected the name of a decision before the value", 0)
    if not value:
        raise ExpressionError(f"expected a value for {shown(name)}", end)
    return name, value


def parse_limit(text: str) -> tuple[str | None, Quantity]:
    """``QUANTITY`` or ``NAME=QUANTITY``, as in ``--max-jitter FLOW=20ms``; the last ``=`` separates.

    The name, None where there is none, and the quantity. Raises `ExpressionError` for an empty name or a quantity that
    cannot be read.
    """
    check_length(text)
    name, separator, limit = text.rpartition("=")
    if separator and not unquoted(name):
        raise ExpressionError('expected a name before "="', 0)
    return (unquoted(name) if separator else None), _quantity(limit, len(text) - len(limit))


def _separator(text: str) -> tuple[int, int]:
    places = Scanner(text).outside_quotes()
    colon = None
    for at in places:
        if text[at] == "=":
            return at, at + (2 if text[at : at + 2] == "==" else 1)
        if text[at] == ":" and colon is None:
            colon = at
    if colon is None:
        raise ExpressionError("expected NAME = VALUE", len(text), 'such as "my_thread.period = 10 ms"')
    return colon, colon + 1


def _operators(text: str, start: int = 0, *, inside: bool = False) -> Iterator[tuple[int, int, Operator]]:
    """Start, end and operator of each comparison outside quotes (and extremes, unless `inside`)."""
    end = start
    for at in Scanner(text).outside_quotes() if inside else Scanner(text).outside():
        operator = operator_at(text, at) if at >= end else None
        if operator is not None:
            end = at + operator[0]
            yield at, end, operator[1]


def _quantity(text: str, offset: int) -> Quantity:
    place = offset + len(text) - len(text.lstrip())
    if not text.strip():
        raise ExpressionError("expected a quantity", place, 'such as "20 ms"')
    try:
        return parse_quantity(text)
    except UnitError as error:
        raise ExpressionError(error.message, place, error.hint) from None


def _metric(text: str, offset: int, depth: int = 0) -> MetricExpr:
    place = offset + len(text) - len(text.lstrip())
    if not text.strip():
        raise ExpressionError("expected a metric", place, 'such as "jitter of my_flow" or "price"')
    if CALL.match(text.lstrip()):
        return _extreme(text.rstrip(), place - offset, offset, depth)
    outside = set(Scanner(text).outside_quotes())
    of = next((match for match in _OF.finditer(text) if match.start() in outside), None)
    metric, name = (text[: of.start()], text[of.end() :]) if of else (text, None)
    if not metric.strip():
        raise ExpressionError('expected a metric before "of"', place)
    if name is not None and not unquoted(name):
        raise ExpressionError('expected a name after "of"', offset + len(text))
    return MetricRef(_metric_name(metric), None if name is None else unquoted(name))


def _metric_name(text: str) -> str:
    words = " ".join(text.split())
    return _METRICS.get(words, words) if words[0] not in "'\"" else unquoted(text)


def _extreme(text: str, start: int, offset: int, depth: int) -> ExtremeRef:
    """``max(A, B, …)`` or ``min(…)`` from `start` to the end of the text."""
    if depth >= DEEPEST:
        raise ExpressionError("extremes are nested too deep", offset + start, f"at most {DEEPEST} deep")
    opened = text.index("(", start)
    closed = Scanner(text).closed(opened)
    if closed < len(text) - 1:
        hint = "operators have blanks around; a sum gets a name under `metrics`"
        raise ExpressionError("expected nothing behind the extreme", offset + closed + 1, hint)
    operands, begin = [], opened + 1
    inside = text[:closed]
    commas = [at for at in _top_level(inside, begin) if inside[at] == ","]
    for end in (*commas, closed):
        part = text[begin:end]
        if not part.strip():
            raise ExpressionError("expected a metric", offset + end, 'such as "max(latency of a, latency of b)"')
        compared = next(_operators(part, inside=True), None)
        if compared is not None:
            raise ExpressionError("an extreme is of metrics, without comparisons", offset + begin + compared[0])
        terms = _sum(part, offset + begin, depth + 1)
        operands.append(DerivedExpr(" ".join(part.split()), terms))
        begin = end + 1
    kind: Literal["max", "min"] = "max" if text.startswith("max", start) else "min"
    return ExtremeRef(kind, tuple(operands))


def _check_closed(text: str, offset: int) -> None:
    """Refuse extremes without their closing parenthesis; `text` stands at `offset` of the whole."""
    try:
        for _ in Scanner(text).outside():
            pass
    except ExpressionError as error:
        raise ExpressionError(error.message, offset + error.offset) from None


def _top_level(text: str, start: int) -> Iterator[int]:
    """The places behind `start` that are inside no further parentheses, and outside quotes."""
    depth = 0
    for at in Scanner(text).outside_quotes():
        if at >= start:
            depth += (text[at] == "(") - (text[at] == ")")
            if not depth:
                yield at


# --- derived metrics ----------------------------------------------------------------------------------------------


def _split(text: str, signs: str, offset: int) -> Iterator[tuple[str, str, int]]:
    """Parts between signs that stand between blanks outside quotes: (sign before it, part, its offset)."""
    sign, start = "", 0
    for at in Scanner(text).outside():
        if text[at] in signs and text[at - 1 : at] == " " and text[at + 1 : at + 2] == " " and at >= start:
            yield sign, text[start:at], offset + start
            sign, start = text[at], at + 1
    yield sign, text[start:], offset + start


def _signed_parts(text: str) -> Iterator[tuple[int, str, int]]:
    body, minus = text.lstrip(), 1
    if body.startswith("-") and not _STARTS_NUMBER.match(body):
        body, minus = body[1:], -1
    elif body.startswith("+ "):
        body = body[1:]
    for sign, part, offset in _split(body, "+-", len(text) - len(body)):
        yield (-1 if sign == "-" else 1 if sign else minus), part, offset


def _sum(text: str, offset: int, depth: int) -> tuple[tuple[Quantity, MetricExpr], ...]:
    """The terms of a sum that stands at `offset` of the whole text."""
    return tuple(_term(sign, part, offset + at, depth) for sign, part, at in _signed_parts(text))


def _term(sign: int, text: str, offset: int, depth: int) -> tuple[Quantity, MetricExpr]:
    constant, metric = Quantity(Fraction(sign), DIMENSIONLESS, ""), None
    for operator, factor, place in _split(text, "*/", offset):
        if factor.strip().startswith("("):
            raise ExpressionError("a sum is without parentheses, but for those of max and min", place)
        if _STARTS_NUMBER.match(factor.strip()):
            constant = _scaled(constant, _constant(factor, place), operator, place)
        elif metric is not None:
            raise ExpressionError("a product has one metric", place, "the other factors are constants")
        elif operator == "/":
            raise ExpressionError("a metric cannot be a divisor", place)
        else:
            metric = _metric(factor, place, depth)
    if metric is None:
        raise ExpressionError("expected a metric in each term", offset, "each term is a metric times constants")
    return constant, metric


def _constant(text: str, offset: int) -> Quantity:
    quantity = _quantity(text, offset)
    if "*" in quantity.unit:
        spaced = text.strip().replace("*", " * ", 1)
        raise ExpressionError("an operator has blanks around", offset + text.index("*"), f'such as "{spaced}"')
    if quantity.dimension is None:
        unit = quantity.unit
        raise ExpressionError(f"unknown unit {shown(unit)}", offset, unit_hint(unit), unknown=unit)
    return quantity


def _scaled(left: Quantity, right: Quantity, operator: str, offset: int) -> Quantity:
    assert left.dimension is not None and right.dimension is not None
    if operator == "/":
        if not right.value:
            raise ExpressionError("division by zero", offset)
        dimension = left.dimension.over(right.dimension)
        return Quantity(left.value / right.value, dimension, _coherent(dimension))
    dimension = left.dimension.times(right.dimension)
    unit = left.unit or right.unit
    return Quantity(left.value * right.value, dimension, _coherent(dimension) if left.unit and right.unit else unit)


def _coherent(dimension: Dimension) -> str:
    """The coherent unit of a dimension where the table has one, else ""."""
    return next((unit for unit, known in UNITS.items() if known == (Fraction(1), dimension)), "")
