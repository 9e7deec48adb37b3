"""The expression language: trees, quotes, and errors with their place."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dse.spec.language.expressions import (
    And,
    Compare,
    Condition,
    ExtremeRef,
    MetricRef,
    MultipleOf,
    Not,
    OneOf,
    Or,
    Ref,
    Used,
)
from dse.spec.language.grammar import (
    ExpressionError,
    parse_assignment,
    parse_derived,
    parse_limit,
    parse_objective,
    parse_requirement,
    parse_rule,
)
from dse.support import units
from dse.support.units import Quantity, parse_quantity

NAMES = {"nav.period", "main_loop.period", "my thread.period", "can.type", "not ready.period", "x and y.type"}
BARE = {"Spectra", "can_500k", "can", "big box", "R (rev B)"}


def rule(text: str) -> Condition:
    return parse_rule(text, NAMES, BARE).condition


@pytest.mark.parametrize(
    ("text", "metric", "of", "operator", "limit"),
    [
        ("jitter of main <= 100 ms", "jitter", "main", "<=", "100 ms"),
        ("jitter of my flow<20ms", "jitter", "my flow", "<", "20 ms"),
        ("max latency of main ≤ 5 ms", "latency", "main", "<=", "5 ms"),
        ("min latency of main >= 1 ms", "min latency", "main", ">=", "1 ms"),
        ("minimum latency ≥ 1 ms", "min latency", None, ">=", "1 ms"),
        ("utilization of computer == 70 %", "utilisation", "computer", "==", "70 %"),
        ("load = 50 %", "load", None, "==", "50 %"),
        ("price > 3 EUR", "price", None, ">", "3 EUR"),
        ("mass of computer <= 90 g", "mass", "computer", "<=", "90 g"),
        ("line variation <= 3 cm", "line variation", None, "<=", "3 cm"),
        ("'share of cpu' <= 3 %", "share of cpu", None, "<=", "3 %"),
        ("jitter of 'a <= b' <= 3 ms", "jitter", "a <= b", "<=", "3 ms"),
        ('jitter of "of it" <= 3 ms', "jitter", "of it", "<=", "3 ms"),
        ("jitter of bob's flow <= 3 ms", "jitter", "bob's flow", "<=", "3 ms"),
    ],
)
def test_requirement(text: str, metric: str, of: str | None, operator: str, limit: str) -> None:
    found = parse_requirement(text)
    assert (found.metric, found.operator) == (MetricRef(metric, of), operator)
    assert found.limit == parse_quantity(limit)
    assert found.text == text


@pytest.mark.parametrize(
    ("text", "sense", "metric"),
    [
        ("minimise jitter of my flow", "minimise", MetricRef("jitter", "my flow")),
        ("  maximize mass ", "maximise", MetricRef("mass")),
        ("minimize utilization of computer", "minimise", MetricRef("utilisation", "computer")),
    ],
)
def test_objective(text: str, sense: str, metric: MetricRef) -> None:
    found = parse_objective(text)
    assert (found.sense, found.metric, found.text) == (sense, metric, text.strip())


def test_derived() -> None:
    [(constant, metric)] = parse_derived("jitter of f * 0.6 m/s").terms
    assert (constant, metric) == (Quantity(Fraction(3, 5), units.SPEED, "m/s"), MetricRef("jitter", "f"))
    terms = parse_derived("2 * latency of a - latency of b / 2 + price").terms
    assert [(constant.value, str(metric)) for constant, metric in terms] == [
        (Fraction(2), "latency of a"),
        (Fraction(-1, 2), "latency of b"),
        (Fraction(1), "price"),
    ]
    [(constant, metric)] = parse_derived("-jitter of 'a + b' * 36 km/h / 2 s").terms
    assert constant == Quantity(Fraction(-5), units.SPEED.over(units.TIME), "")
    assert isinstance(metric, MetricRef) and metric.of == "a + b"
    [(constant, _)] = parse_derived("price / 2 EUR * 5 W").terms
    assert (constant.value, constant.dimension) == (Fraction(1, 40), units.POWER.over(units.MONEY))
    [(_, metric)] = parse_derived("jitter of my-flow/2").terms
    assert isinstance(metric, MetricRef) and metric.of == "my-flow/2"


def test_extremes() -> None:
    [(constant, found)] = parse_derived("-max( latency of a,  2 * min(jitter) + latency of 'b, c' ) / 2").terms
    assert constant.value == Fraction(-1, 2) and isinstance(found, ExtremeRef)
    assert str(found) == "max(latency of a, 2 * min(jitter) + latency of 'b, c')"
    inner = found.operands[1].terms
    assert [(item.value, str(metric)) for item, metric in inner] == [(2, "min(jitter)"), (1, "latency of b, c")]
    assert str(parse_objective("minimise max (load)").metric) == "max(load)"
    requirement = parse_requirement("min(latency of f(1, 2), latency of g) >= 3 ms")
    assert str(requirement.metric) == "min(latency of f(1, 2), latency of g)" and requirement.operator == ">="
    [(_, metric)] = parse_derived("latency of max(a)").terms  # a name
    assert metric == MetricRef("latency", "max(a)")
    deep = "max(" * 20 + "price" + ")" * 20
    assert str(parse_derived(deep).terms[0][1]) == deep


def test_rule_verbs() -> None:
    for text, verb in (("Spectra", "require"), ("require Spectra", "require"), ("forbid Spectra", "forbid")):
        found = parse_rule(text, NAMES, BARE)
        assert (found.verb, found.condition, found.text) == (verb, Used("Spectra"), text)


@pytest.mark.parametrize(
    ("text", "condition"),
    [
        ("can.type == can_500k", Compare(Ref("can.type"), "==", "can_500k")),
        ("can.type = R (rev B)", Compare(Ref("can.type"), "==", "R (rev B)")),
        ("nav.period <= 10 ms", Compare(Ref("nav.period"), "<=", "10 ms")),
        ("nav.period≥10 ms", Compare(Ref("nav.period"), ">=", "10 ms")),
        ("nav.period != main_loop.period", Compare(Ref("nav.period"), "!=", Ref("main_loop.period"))),
        ("nav.period == 'main_loop'.period", Compare(Ref("nav.period"), "==", Ref("main_loop.period"))),
        ("'my thread'.period < 1 ms", Compare(Ref("my thread.period"), "<", "1 ms")),
        ('"my thread.period" < 1 ms', Compare(Ref("my thread.period"), "<", "1 ms")),
        ("my thread.period < 1 ms", Compare(Ref("my thread.period"), "<", "1 ms")),
        ("can.type == 'a and b'", Compare(Ref("can.type"), "==", "a and b")),
        ("not ready.period == 1 ms", Compare(Ref("not ready.period"), "==", "1 ms")),
        ("x and y.type == x and Spectra", And((Compare(Ref("x and y.type"), "==", "x"), Used("Spectra")))),
        ("nav.period is a multiple of main_loop.period", MultipleOf(Ref("nav.period"), Ref("main_loop.period"))),
        ("can.type in [a b, R (rev B), 'c, d']", OneOf(Ref("can.type"), ("a b", "R (rev B)", "c, d"))),
        ("can.type not in [a]", Not(OneOf(Ref("can.type"), ("a",)))),
        ("Spectra requires can_500k", Or((Not(Used("Spectra")), Used("can_500k")))),
        ("Spectra implies can_500k", Or((Not(Used("Spectra")), Used("can_500k")))),
        ("if Spectra then not can_500k", Or((Not(Used("Spectra")), Not(Used("can_500k"))))),
        ("Spectra or can and big box", Or((Used("Spectra"), And((Used("can"), Used("big box")))))),
        ("(Spectra or can) and big box", And((Or((Used("Spectra"), Used("can"))), Used("big box")))),
        ("not Spectra or can or big box", Or((Not(Used("Spectra")), Used("can"), Used("big box")))),
        ("Spectra implies (can implies big box)", Or((Not(Used("Spectra")), Or((Not(Used("can")), Used("big box")))))),
        ("not Spectra and can implies big box", Or((Not(And((Not(Used("Spectra")), Used("can")))), Used("big box")))),
        ("Spectra and (can requires big box)", And((Used("Spectra"), Or((Not(Used("can")), Used("big box")))))),
        ("(Spectra and can) requires big box", Or((Not(And((Used("Spectra"), Used("can")))), Used("big box")))),
        ("Spectra requires not can", Or((Not(Used("Spectra")), Not(Used("can"))))),
        ("Spectra requires if can then big box", Or((Not(Used("Spectra")), Or((Not(Used("can")), Used("big box")))))),
    ],
)
def test_conditions(text: str, condition: Condition) -> None:
    assert rule(text) == condition


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("nav.period = 10 ms", ("nav.period", "10 ms")),
        ("nav.period==10 ms", ("nav.period", "10 ms")),
        ("nav.period: 10 ms", ("nav.period", "10 ms")),
        ("ns::nav.period = 10 ms", ("ns::nav.period", "10 ms")),
        ("'a = b'.type = 'c'", ("a = b.type", "c")),
    ],
)
def test_assignment(text: str, expected: tuple[str, str]) -> None:
    assert parse_assignment(text) == expected


@pytest.mark.parametrize(
    ("text", "name"), [("20ms", None), ("f=20ms", "f"), ("a=b = 20 ms", "a=b"), ("'my f'=20 ms", "my f")]
)
def test_limit(text: str, name: str | None) -> None:
    assert parse_limit(text) == (name, Quantity(Fraction(1, 50), units.TIME, "ms"))


@pytest.mark.parametrize(
    ("parse", "text", "offset", "message"),
    [
        (parse_requirement, "jitter", 6, "expected a comparison"),
        (parse_requirement, "a <= 1 ms <= b", 10, "one comparison at a time"),
        (parse_requirement, "a != 3", 2, 'a requirement has no "!="'),
        (parse_requirement, "jitter of <= 5 ms", 10, 'expected a name after "of"'),
        (parse_requirement, "of f <= 5 ms", 0, 'expected a metric before "of"'),
        (parse_requirement, "<= 5 ms", 0, "expected a metric"),
        (parse_requirement, "jitter of f <=", 14, "expected a quantity"),
        (parse_requirement, "jitter of f <= soon", 15, "expected a number with its unit"),
        (parse_requirement, "jitter of 'f <= 5 ms", 10, "this quote is not closed"),
        (parse_requirement, "x" * 20_000, 10_000, "longer than 10000"),
        (parse_objective, "min jitter", 0, 'expected "minimise" or "maximise"'),
        (parse_objective, "", 0, 'expected "minimise" or "maximise"'),
        (parse_objective, "minimise", 8, "expected a metric"),
        (parse_objective, "minimise x <= 3", 11, "an objective has no comparison"),
        (parse_objective, "minimise max(a, 2*b)", 17, "an operator has blanks around"),
        (parse_derived, "", 0, "expected a metric"),
        (parse_derived, "5 ms", 0, "expected a metric in each term"),
        (parse_derived, "a * b", 3, "a product has one metric"),
        (parse_derived, "1 / a", 3, "a metric cannot be a divisor"),
        (parse_derived, "a / 0", 3, "division by zero"),
        (parse_derived, "a * 3 msec", 3, 'unknown unit "msec" (did you mean "ms"?)'),
        (parse_derived, "3 * (a + b)", 3, "is without parentheses"),
        (parse_derived, "a <= 3", 2, "a derived metric has no comparison"),
        (parse_derived, "b + max(a", 7, "this parenthesis is not closed"),
        (parse_derived, "max(a,)", 6, "expected a metric"),
        (parse_derived, "max()", 4, "expected a metric"),
        (parse_derived, "max(a) b", 6, "expected nothing behind the extreme"),
        (parse_derived, "b + max(a, 3 * (b))", 14, "is without parentheses"),
        (parse_derived, "max(a, b < c)", 9, "a derived metric has no comparison"),
        (parse_derived, "max(a, 3 ms)", 7, "expected a metric in each term"),
        (parse_derived, "max(" * 21 + "a" + ")" * 21, 80, "nested too deep"),
        (parse_requirement, "max(a <= 3) <= 4 ms", 6, "without comparisons"),
        (parse_requirement, "max(a, b <= 4 ms", 3, "this parenthesis is not closed"),
        (parse_objective, "minimise max(a", 12, "this parenthesis is not closed"),
        (parse_objective, "minimise max(a < b)", 15, "an objective has no comparison"),
        (parse_assignment, "nav.period", 10, "expected NAME = VALUE"),
        (parse_assignment, "= 3", 0, "expected the name of a decision"),
        (parse_assignment, "x =", 3, 'expected a value for "x"'),
        (parse_limit, "=3 ms", 0, 'expected a name before "="'),
        (parse_limit, "f=", 2, "expected a quantity"),
        (rule, "", 0, "expected the name of a decision, type or slot"),
        (rule, "require", 7, "expected the name of a decision, type or slot"),
        (rule, "nva.period == 3", 0, 'unknown name "nva.period" in a rule (did you mean "nav.period"?)'),
        (rule, "'nva'.period == 3", 0, 'unknown name "nva.period" in a rule (did you mean "nav.period"?)'),
        (rule, "Spectra and spectra", 12, 'unknown name "spectra" in a rule (did you mean "Spectra"?)'),
        (rule, "can == can_500k", 0, 'cannot be compared (did you mean "can.type"?)'),
        (rule, "nav.period", 10, "expected a comparison after"),
        (rule, "nav.period is even", 14, 'expected "a multiple of"'),
        (rule, "nav.period is a multiple of can", 28, '"can" is not a decision'),
        (rule, "nav.period < 3 ms < 4 ms", 18, "one comparison at a time"),
        (rule, "nav.period < ", 13, "expected a value"),
        (rule, "can.type in a", 12, 'expected "["'),
        (rule, "can.type in [a", 14, 'expected "," or "]"'),
        (rule, "can.type not a", 13, 'expected "in"'),
        (rule, "if Spectra", 10, 'expected "then"'),
        (rule, "(Spectra", 8, 'expected ")"'),
        (rule, "Spectra Spectra", 8, "expected the end of the rule"),
        (rule, "can.type == a(b)", 13, "expected the end of the rule"),
        (rule, "Spectra and", 11, "expected the name"),
        (rule, "(" * 60 + "Spectra", 50, "nested deeper than 50"),
        (rule, "not " * 2000 + "Spectra", 199, "nested deeper than 50"),
        (rule, "Spectra implies " * 500, 799, "nested deeper than 50"),
        (rule, "Spectra and can requires big box", 16, "such as (Spectra and can) requires big box"),
        (rule, "not (Spectra and can requires big box)", 21, "such as (Spectra and can) requires big box"),
        (rule, "Spectra or can requires big box", 15, '"requires" can be read in two ways here'),
        (rule, "not Spectra requires can", 12, "such as (not Spectra) requires can"),
        (rule, "Spectra requires can and big box", 8, "such as Spectra requires (can and big box)"),
        (rule, "Spectra implies can implies big box", 8, "such as Spectra implies (can implies big box)"),
        (rule, "Spectra requires can requires big box", 8, "such as Spectra requires (can requires big box)"),
    ],
)
def test_errors(parse: Callable[[str], Any], text: str, offset: int, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse(text)
    assert message in str(caught.value)
    assert caught.value.offset == offset


PARTS = ["jitter", " of ", "nav.period", "Spectra", "can", "<=", "==", "(", ")", "[", "]", ",", "'", " and ", " or "]
PARTS += [" not ", " implies ", " requires ", "if ", " then ", " in ", " is a multiple of ", "10 ms", " * ", " + ", "x"]


@given(st.lists(st.sampled_from(PARTS) | st.text(max_size=3), max_size=12).map("".join))
def test_any_text_is_parsed_or_refused_within_itself(text: str) -> None:
    parsers = (parse_requirement, parse_objective, parse_derived, parse_assignment, parse_limit, rule)
    for parse in parsers:
        try:
            parse(text)
        except ExpressionError as error:
            assert 0 <= error.offset <= len(text) and error.message


def test_names_that_are_known_win_over_keywords_only_when_longer() -> None:
    assert parse_rule("requirement", set(), {"requirement"}).condition == Used("requirement")
    assert parse_rule("'and' and a", set(), {"and", "a"}).condition == And((Used("and"), Used("a")))
