"""A total's figures, limits, rules and uncertainties may stand in any unit of the kind that is declared for it."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from dse.support.errors import ProblemError, UsageError

TEXT = """
dse: 1
name: freight
totals: {mass: UNIT}
processor_types:
  light: {price: 30 EUR, totals: {mass: FIRST}}
  heavy: {price: 10 EUR, totals: {mass: SECOND}}
processors: {p: {type: [light, heavy]}}
threads: {t: {processor: p, period: 10 ms, compute_execution_time: 1 ms, totals: {mass: [0.2 kg, 100 g]}}}
requirements: [mass <= LIMIT]
rules: [RULE]
objectives: [minimise price, minimise mass]
uncertainty: {processor_types.light.totals.mass: {range: 0.4 kg .. 600 g}}
"""
RULE = "t.totals.mass > 0.15 kg implies light"


def text(unit: str, first: str, second: str, limit: str, rule: str = RULE) -> str:
    words = {"UNIT": unit, "FIRST": first, "SECOND": second, "LIMIT": limit, "RULE": rule}
    found = TEXT
    for word, put in words.items():
        found = found.replace(word, put)
    return found


@pytest.mark.parametrize(
    ("unit", "first", "second", "limit"),
    [
        ("g", "500 g", "1500 g", "1600 g"),
        ("g", "0.5 kg", "1.5 kg", "1.6 kg"),
        ("g", "500000 mg", "1.5 kg", "0.0016 Mg"),
        ("kg", "500 g", "1.5 kg", "1600 g"),
    ],
)
def test_units_of_a_total_are_converted(unit: str, first: str, second: str, limit: str) -> None:
    """Least mass: 600 g with the light one for 30 EUR, 1600 g with the heavy one for 10 EUR."""
    problem = dse.loads(text(unit, first, second, limit))
    result = dse.solve(problem)
    [counted] = [item.unit for item in result.objectives if item.name == "mass"]
    parts = {"g": Fraction(1), "1/10 kg": Fraction(100)}[counted]  # in g
    assert {(point.objectives["price"], point.objectives["mass"] * parts) for point in result.front} == {
        (3000, 600),
        (1000, 1600),
    }
    assert dse.verify(result, problem=problem).status == "verified"
    [light] = [point for point in result.front if point.objectives["price"] == 3000]
    assert light.decisions["t.totals.mass"] == {"g": "100 g", "kg": "0.1 kg"}[unit]
    robust = dse.solve_robust(problem)
    assert len(robust.robust.front) == 2
    assert len(dse.solve(problem.ask(max_price="99 EUR", fix="t.totals.mass = 0.2 kg")).front) == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("g", "5 mm", "1 kg", "2 kg"), 'processor_types.light.totals.mass: expected a figure in g, got "mm"'),
        (("g", "5 g", "1 kg", "2 EUR"), 'expected a limit in g for mass, got "EUR"'),
        (("g", "5 g", "1 kg", "2"), "expected a limit in g for mass, got a bare number"),
        (("g", "5 g", "1 kg", "2 kg", "t.totals.mass > 1 W implies light"), 'expected a figure in g, got "W"'),
        (("EUR", "5 EUR", "1 USD", "2 EUR"), 'expected a figure in EUR, got "USD"'),
    ],
)
def test_what_measures_something_else_is_refused(arguments: tuple[str, ...], said: str) -> None:
    with pytest.raises(ProblemError) as caught:
        dse.loads(text(*arguments))
    assert said in str(caught.value)


def test_one_figure_in_two_units_is_one_option() -> None:
    with pytest.raises(ProblemError, match=r"threads.t.totals.mass\[1\]: option given twice"):
        dse.loads(text("g", "5 g", "1 kg", "2 kg").replace("[0.2 kg, 100 g]", "[0.2 kg, 200 g]"))


def test_a_sweep_over_a_total_counts_its_ends_and_step_in_one_unit() -> None:
    """A step of 1 kg between 600 g and 2600 g is no step of 1 g, and 0.6 kg is 600 g."""
    problem = dse.loads(text("g", "500 g", "1.5 kg", "9 kg"))
    assert len(dse.sweep(problem, "mass=600 g..2.6 kg step 1 kg").runs) == 3
    assert len(dse.sweep(problem, "mass=0.6 kg..2600 g step 500 g").runs) == 5
    assert len(dse.sweep(problem, "mass=600 g,1.6 kg").runs) == 2
    whole = dse.sweep(problem, "mass=1 g..9 kg").runs[0].outcome
    assert whole is not None and whole["exact"]
    for wrong, said in (
        ("mass=0.6 kg,600 g", "a value is given twice"),
        ("mass=600 g..2.6 kg step 1 mm", "is not of the kind of"),
        ("mass=600 g..1 mm", "of different kinds"),
        ("mass=1 kg..600 g", "the range is empty"),
    ):
        with pytest.raises(UsageError, match=said):
            dse.sweep(problem, wrong)
