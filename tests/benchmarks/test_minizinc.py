"""The peer's model is ours in other words, and its front is the front."""

from __future__ import annotations

import pytest
from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.space.model.space import Space
from tests.helpers.support import PROBLEMS, brute_front, counted_down, load_space

from .asking import Ask, OutOfTime, by_cp_sat
from .minizinc import MiniZinc, NotTranslatable, answer, installed, translated
from .textbook import OURS, PLAIN, textbook_front

needs_minizinc = pytest.mark.skipif(installed() is None, reason="MiniZinc with a free solver is not installed")


def test_every_kind_of_constraint() -> None:
    model = cp_model.CpModel()
    a, b, fixed = model.new_bool_var("a"), model.new_bool_var("b"), model.new_constant(1)
    z = model.new_int_var(-2, 9, "z")
    model.add_bool_or(a, b.negated())
    model.add_bool_and(a, b.negated()).only_enforce_if(fixed)
    model.add_exactly_one(a, b, fixed.negated())
    model.add_at_most_one(a.negated(), b)
    model.add(z + 3 * b == 4)
    model.add_linear_constraint(z - a, 1, 5).only_enforce_if(a, b.negated())
    model.add(z <= 7)
    model.minimize(2 * z + a)
    assert translated(model.proto, [z.index, a.index]).splitlines() == [
        "var bool: v0;",
        "var bool: v1;",
        "bool: v2 = true;",
        "var -2..9: v3;",
        "constraint clause([v0], [v1]);",
        "constraint clause([v0], [v2]);",
        "constraint clause([], [v1, v2]);",
        "constraint sum([v0, v1, not v2]) = 1;",
        "constraint sum([not v0, v1]) <= 1;",
        "constraint sum([3*v1, 1*v3]) = 4;",
        "constraint v0 /\\ not v1 -> sum([-1*v0, 1*v3]) >= 1;",
        "constraint v0 /\\ not v1 -> sum([-1*v0, 1*v3]) <= 5;",
        "constraint sum([1*v3]) <= 7;",
        "solve :: bool_search([v0, v1], dom_w_deg, indomain_max, complete) minimize sum([1*v0, 2*v3]);",
        'output ["point \\(1*v3) \\(1*v0)\\n"];',
    ]


def test_large_numbers() -> None:
    """What the coefficients share is divided by; what is still large is cut into parts."""
    model = cp_model.CpModel()
    a, b = model.new_bool_var("a"), model.new_bool_var("b")
    model.add_linear_constraint(7_000_000_000 * a + 8_000_000_000 * b, 1, 9_999_999_999)
    model.add(700_000_001 * a + 800_000_000 * b <= 900_000_000)
    assert translated(model.proto, []).splitlines()[2:9] == [
        "constraint sum([7*v0, 8*v1]) >= 1;",
        "constraint sum([7*v0, 8*v1]) <= 9;",
        "var 0..700000001: p0;",
        "constraint sum([700000001*v0, -p0]) = 0;",
        "var 0..800000000: p1;",
        "constraint sum([800000000*v1, -p1]) = 0;",
        "constraint sum([p0, p1]) <= 900000000;",
    ]


def test_other_constraints_are_refused() -> None:
    product = cp_model.CpModel()
    x, y = product.new_int_var(0, 5, "x"), product.new_int_var(0, 25, "y")
    product.add_multiplication_equality(y, [x, x])
    hole = cp_model.CpModel()
    hole.add(hole.new_int_var(0, 5, "x") != 3)
    vast, steep = cp_model.CpModel(), cp_model.CpModel()
    vast.new_int_var(0, 2**40, "x")
    steep.add(2**40 * steep.new_bool_var("a") + steep.new_bool_var("b") <= 2**40)
    for model in (product, hole, vast, steep):
        with pytest.raises(NotTranslatable, match="not translated"):
            translated(model.proto, [])


def test_only_proofs_count() -> None:
    assert answer("point 3 -4\n----------\n==========\n", 2) == (3, -4)
    assert answer("=====UNSATISFIABLE=====\n", 2) is None
    for text in ("point 3 -4\n----------\n% Time limit exceeded!\n", "=====UNKNOWN=====\n", ""):
        with pytest.raises(OutOfTime):
            answer(text, 2)


@pytest.mark.parametrize("plain", [False, True])
def test_the_peers_models_have_no_switches_of_ours(plain: bool) -> None:
    evaluator = Evaluator(_space("types"))
    assert encode(evaluator).regions
    assert not encode(evaluator, PLAIN if plain else OURS).regions


@pytest.mark.parametrize("name", ["rules", "types", "buses"])
def test_front_of_the_textbook_loop(name: str) -> None:
    _check_front(_space(name), by_cp_sat(1))


@needs_minizinc
@pytest.mark.parametrize("name", ["rules", "derived", "bindings"])
def test_front(name: str) -> None:
    solver = installed()
    assert solver is not None
    _check_front(_space(name), MiniZinc(solver))


@needs_minizinc
def test_a_limit_is_no_proof() -> None:
    solver = installed()
    assert solver is not None
    model = cp_model.CpModel()
    literal = model.new_bool_var("")
    model.minimize(literal)
    with pytest.raises(OutOfTime):
        MiniZinc(solver)(model, [literal], 0.001)


def _space(name: str) -> Space:
    return load_space(next(path for path in PROBLEMS if path.stem == name))


def _check_front(space: Space, ask: Ask) -> None:
    evaluator = Evaluator(space)
    made = textbook_front(evaluator, 600, ask, "plain")
    assert made["is_complete"]
    assert made["front"] == sorted(counted_down(space, vector) for vector in brute_front(evaluator))
