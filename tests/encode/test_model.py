"""Fixing a design in the model gives exactly what the analysis gives; refused combinations are refused by the model.

Each file in `problems/` covers a family of decisions and constraints, and is small enough to look at every combination
of options.
"""

from __future__ import annotations

import random
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.encode import decisions, linear, sums
from dse.encode.model import EncodedSpace, encode
from dse.encode.rates import RateTables, RateVariables
from dse.space.model.space import INACTIVE, Design, Space
from dse.support.errors import TooLargeError
from tests.helpers.effort import LONG
from tests.helpers.support import PROBLEMS, counted_down, evaluated, load_space, space_of
from tests.helpers.tuned import tune

BY_NAME = {path.stem: path for path in PROBLEMS}
each_problem = pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)


def in_turn(names: list[str], forms: list[tuple[int, int]]) -> list[tuple[str, int, int]]:
    """Each problem in one of the forms, in turn; in all of them where there is time."""
    return [
        (name, *form)
        for at, name in enumerate(names)
        for number, form in enumerate(forms)
        if LONG or number == at % len(forms)
    ]


def fixed_objectives(encoded: EncodedSpace, design: Design) -> tuple[int, ...] | None:
    """The counted objectives when every option literal is fixed as in `design`; None when the model refuses that."""
    if encoded.open_terms or encoded.contention is not None or encoded.core_limits is not None:
        encoded = encoded.copy()  # the model learns from the design
    wanted: set[tuple[int, bool]] = set()
    for literals, inactive, chosen in zip(encoded.options, encoded.inactive, design, strict=True):
        wanted |= {(literal.index, option == chosen) for option, literal in enumerate(literals)}
        wanted |= {(inactive.index, chosen == INACTIVE)} if inactive is not None else set()
    fixed = {(index, int(value)) if index >= 0 else (-index - 1, int(not value)) for index, value in wanted}
    before = {index: tuple(encoded.model.proto.variables[index].domain) for index, _ in fixed}
    if len(before) < len(fixed) or any(not before[index][0] <= value <= before[index][1] for index, value in fixed):
        return None
    for index, value in fixed:
        _set_domain(encoded, index, (value, value))
    try:
        return _objectives(encoded, design)
    finally:
        for index, domain in before.items():
            _set_domain(encoded, index, domain)


def _set_domain(encoded: EncodedSpace, index: int, ends: tuple[int, ...]) -> None:
    domain = encoded.model.proto.variables[index].domain
    domain[0], domain[1] = ends


def _objectives(encoded: EncodedSpace, design: Design) -> tuple[int, ...] | None:
    """The counted objectives of a solution; None when there is none."""
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.cp_model_presolve = False
    while True:  # until the model has learnt what this design shows
        status = solver.solve(encoded.model)
        if status == cp_model.INFEASIBLE:
            return None
        assert status == cp_model.OPTIMAL
        if encoded.settled(design, solver.value) is not None:
            break
    values = solver.response_proto.solution
    return tuple(item.offset + item.step * values[item.variable.index] for item in encoded.objectives)


def assert_model_is_analysis(space: Space, one_of: int = 1) -> None:
    """Every combination of options has the same fate and the same objectives in the model and in the analysis.

    Of models in another form one of so many combinations is looked at, drawn among all, where time is short.
    """
    evaluator = Evaluator(space)
    encoded = encode(evaluator)
    verdicts = evaluated(evaluator)
    rounded = {limit.requirement for limit in evaluator.limits if limit.measure.rounded}
    looked_at = len(verdicts) if LONG else -(-len(verdicts) // one_of)
    for design, evaluation in random.Random(looked_at).sample(list(verdicts.items()), looked_at):
        found = fixed_objectives(encoded, design)
        broken = {verdict.requirement for verdict in evaluation.verdicts if not verdict.holds}
        if broken and broken <= rounded:
            continue  # such limits are relaxed to the safe side; the referee refuses what exact comparison refuses
        expected = counted_down(space, evaluation.objectives) if evaluation.is_feasible else None
        assert found == expected, (design, evaluation)


@each_problem
def test_every_design_has_the_figures_of_the_analysis(path: Path) -> None:
    assert_model_is_analysis(load_space(path))


@cache
def evaluator_of(path: Path) -> Evaluator:
    return Evaluator(load_space(path))


@each_problem
def test_the_problems_have_designs_of_every_fate(path: Path) -> None:
    verdicts = evaluated(evaluator_of(path)).values()
    assert any(item.is_feasible for item in verdicts)
    assert any(not item.is_feasible for item in verdicts)


@each_problem
def test_a_combination_and_its_canonical_form_are_one_design(path: Path) -> None:
    evaluator = evaluator_of(path)
    for design, evaluation in evaluated(evaluator).items():
        again = evaluator.evaluate(design)
        assert (again.objectives, again.verdicts) == (evaluation.objectives, evaluation.verdicts)
        assert bool(again.breaches) == bool(evaluation.breaches)


@pytest.mark.parametrize("profile", ["osate-2.2", "osate-2.19"])
@pytest.mark.parametrize("worst_case", ["execution_time", "deadline"])
def test_profiles(profile: str, worst_case: str) -> None:
    assert_model_is_analysis(replace(load_space(BY_NAME["protocols"]), profile=profile, worst_case=worst_case), 3)


@pytest.mark.parametrize(
    ("name", "shared_by", "pair_limit"),
    in_turn(["protocols", "cycle", "derived", "bindings", "buses", "types", "extremes"], [(1, 0), (10**6, 1_000)]),
)
def test_rates_apart_give_the_same(name: str, pair_limit: int, shared_by: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Products by pairs of coefficient and rate, or with a rate variable; for each shared option, or at once."""
    used = []
    product_form, times = RateVariables.product_form, RateTables.times
    tune(monkeypatch, shared_forms={"shared_by": shared_by})
    monkeypatch.setattr(sums, "PAIR_LIMIT", pair_limit)
    monkeypatch.setattr(RateTables, "times", lambda *given: used.append(given) or times(*given))
    monkeypatch.setattr(RateVariables, "product_form", lambda *given: used.append(given) or product_form(*given))
    assert_model_is_analysis(load_space(BY_NAME[name]), 3)
    assert used


@pytest.mark.parametrize(
    ("name", "shared_by", "pair_limit"),
    in_turn(["types", "derived", "equal", "buses", "protocols", "extremes"], [(1, 1_000), (10**6, 0)]),
)
def test_rounded_measures_lose_no_design(
    name: str, shared_by: int, pair_limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a unit that is too coarse, constraints are relaxed and objectives rounded as the analysis rounds them."""
    monkeypatch.setattr("dse.analysis.measures.SCALE_LIMIT", 1)
    tune(monkeypatch, shared_forms={"shared_by": shared_by})
    monkeypatch.setattr(sums, "PAIR_LIMIT", pair_limit)
    space = load_space(BY_NAME[name])
    evaluator = Evaluator(space)
    assert any(measure.rounded for measure in (*evaluator.objectives, *(limit.measure for limit in evaluator.limits)))
    assert_model_is_analysis(space, 3)


@pytest.mark.parametrize("name", ["rules", "large_rule"])
@pytest.mark.parametrize("clauses", [0, 256, 10**6])
def test_rules_as_clauses_and_as_literals(name: str, clauses: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Small rules forbid their cases; larger ones go through Kleene literals. Both mean the same."""
    used = []
    kleene = decisions._kleene
    monkeypatch.setattr(linear, "CLAUSES", clauses)
    monkeypatch.setattr(
        decisions, "_kleene", lambda board, condition: used.append(condition) or kleene(board, condition)
    )
    assert_model_is_analysis(load_space(BY_NAME[name]))
    assert bool(used) == (clauses == 0 or (name == "large_rule" and clauses == 256))


@pytest.mark.parametrize("name", ["rules", "cycle", "bindings"])
def test_fixed_decisions(name: str) -> None:
    space = load_space(BY_NAME[name])
    for index, decision in enumerate(space.decisions):
        option = len(decision.options) - 1
        assert_model_is_analysis(replace(space, fixed={index: option}))
        if name == "bindings":
            break


def test_the_model_has_no_variable_for_what_is_given() -> None:
    space = space_of("dse: 1\nname: x\nprocessor_types: {a: {}}\nprocessors: {p: {type: a}}\n")
    encoded = encode(Evaluator(space))
    assert [len(literals) for literals in encoded.options] == [1]
    assert encoded.inactive == [None]
    assert fixed_objectives(encoded, (0,)) == ()


def test_sums_beyond_exact_arithmetic_are_refused_by_name() -> None:
    text = """
    dse: 1
    name: huge
    processor_types: {a: {price: [90000000000000 EUR, 1 EUR]}}
    processors: {p: {type: a}, q: {type: a}}
    """
    with pytest.raises(TooLargeError, match=r"price >= 10 EUR: a sum may reach \d+, beyond exact arithmetic"):
        encode(Evaluator(space_of(text + "requirements: [price >= 10 EUR]\n")))
    with pytest.raises(TooLargeError, match=r"minimise price: a sum may reach"):
        encode(Evaluator(space_of(text + "objectives: [minimise price]\n")))
