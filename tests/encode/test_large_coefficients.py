"""Rows with coefficients beyond exact arithmetic keep their solutions with coefficients within it."""

from __future__ import annotations

import random
from itertools import product

import pytest
from ortools.sat.python import cp_model

import dse
from dse.encode.linear import EXACT_LIMIT, Board, Form
from tests.helpers.documents import ROOT
from tests.helpers.support import space_of

SPACE = """
dse: 1
name: two types
processors: {cpu: {type: [a, b]}}
processor_types: {a: {price: 1 EUR}, b: {price: 2 EUR}}
threads: {t: {processor: cpu, period: 10 ms, compute_execution_time: 1 ms}}
objectives: [minimise price]
"""


def value(form: Form, values: dict[int, int]) -> int:
    return form.constant + sum(coefficient * values[index] for index, coefficient in form.coefficients.items())


@pytest.mark.parametrize("seed", range(20))
def test_a_form_stays_what_it_is_up_to_its_limit(seed: int) -> None:
    drawn = random.Random(seed)
    board = Board(space_of(SPACE))
    form = Form()
    variables = []
    for _ in range(drawn.randint(1, 3)):  # tables, of which one case is true, some of them without a bound
        literals = [board.model.new_bool_var("") for _ in range(drawn.randint(1, 3))]
        variables.append([literal.index for literal in literals])
        figures = [drawn.choice([drawn.randint(-50, 50), EXACT_LIMIT * drawn.randint(1, 3)]) for _ in literals]
        form.add(board.form(zip(literals, figures, strict=True)))
    most = drawn.randint(-60, 120)
    held = board.within(form, most)
    for chosen in product(*variables):
        values = {index: int(index in chosen) for group in variables for index in group}
        exact = value(form, values)
        assert (value(held, values) == exact) if exact <= most else value(held, values) > most
    if form.high >= EXACT_LIMIT and form.low <= most:
        assert held.high < EXACT_LIMIT


@pytest.mark.parametrize("seed", range(20))
def test_a_form_of_times_stays_what_it_is_up_to_its_limit(seed: int) -> None:
    """Before, the greatest value of a time was read as 0, and what is below the limit was proved to be infeasible."""
    drawn = random.Random(f"times {seed}")
    board = Board(space_of(SPACE))
    constant = drawn.randint(-20, 20)
    form = Form(constant, {}, constant, constant)
    times = []
    for _ in range(drawn.randint(1, 3)):
        low, high, coefficient = drawn.randint(0, 9), EXACT_LIMIT * drawn.randint(1, 3), drawn.randint(1, 4)
        times.append(board.model.new_int_var(low, high, ""))
        form.add(Form(0, {times[-1].index: coefficient}, coefficient * low, coefficient * high))
    most = drawn.randint(0, 120)
    held = board.within(form, most)
    assert held.high < EXACT_LIMIT or held is form
    total = board.expression(held) if held is not form else None
    for _ in range(10):
        model = board.model.clone()
        values = {item.index: drawn.randint(0, 40) + drawn.choice([9, 9, EXACT_LIMIT - 50]) for item in times}
        for index, chosen in values.items():
            model.add(model.get_int_var_from_proto_index(index) == chosen)
        exact = value(form, values)
        if total is None:
            assert form.low > most
            continue
        solver = cp_model.CpSolver()
        assert solver.solve(model) == cp_model.OPTIMAL
        found = value(held, dict(enumerate(solver.response_proto.solution)))
        assert found == exact if exact <= most else found > most


def test_a_limit_in_fractions_of_a_nanosecond_does_not_stop_a_search_with_response_times() -> None:
    problem = dse.load(ROOT / "problems" / "report" / "middleware.yaml")
    found = dse.solve(problem, processing="response_time")
    assert found.status == "complete"
    for point in found.front:  # each design of the quick question holds with waiting
        assert dse.analyse(problem, point, processing="response_time").is_feasible
    quick = dse.solve(problem)
    assert {item.status for item in quick.contended.values()} == {"kept"} and len(quick.front) == len(found.front)
