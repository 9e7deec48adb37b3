"""What must not change the front, and what may change it in one direction only, on random problems."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.search.front import search_front
from dse.space.model.space import Design
from tests.helpers.effort import cases
from tests.oracle.generator import random_problem
from tests.properties.pair import Pair
from tests.properties.rewriting import Document, document_of, in_other_units, renamed, reordered, text_of, with_limit

SEEDS = cases(30, 1_019)
FEW = cases(15, 1_019)

Points = Mapping[tuple[int, ...], Design]
Vector = tuple[Fraction, ...]


def front(text: str) -> tuple[list[str], Points]:
    """Units of the objectives, and the points of the front."""
    evaluator = Evaluator(dse.loads(text).space)
    found = search_front(evaluator)
    assert found.is_complete
    return [measure.counting_unit for measure in evaluator.objectives], found.points


def exact_front(text: str) -> set[Vector]:
    """The front's vectors in whole units, to be minimised: counting units may differ from problem to problem."""
    pair = Pair(text)
    found = search_front(pair.evaluator)
    assert found.is_complete
    return {pair.vector(counted) for counted in found.points}


def without(document: Document, key: str, position: int) -> Document:
    """The problem without one requirement or rule."""
    rest = [item for number, item in enumerate(document[key]) if number != position]
    fewer = {name: value for name, value in document.items() if name != key}
    return {**fewer, key: rest} if rest else fewer


def weakly_dominates(better: Iterable[Vector], worse: Iterable[Vector]) -> bool:
    """Whether each of `worse` has one in `better` that is nowhere larger."""
    better = list(better)
    return all(any(all(a <= b for a, b in zip(one, other, strict=True)) for one in better) for other in worse)


# The same problem in other words


@pytest.mark.parametrize("seed", SEEDS)
def test_names_do_not_matter(seed: int) -> None:
    document = document_of(random_problem(seed, "tiny"))
    changed, names = renamed(document)
    assert not set(names) & set(names.values())
    assert front(text_of(changed)) == front(text_of(document))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_order_of_entries_does_not_matter(seed: int) -> None:
    document = document_of(random_problem(seed, "tiny"))
    units, points = front(text_of(document))
    other_units, other_points = front(text_of(reordered(document, random.Random(seed))))
    assert (other_units, other_points.keys()) == (units, points.keys())


@pytest.mark.parametrize("seed", SEEDS)
def test_units_do_not_matter(seed: int) -> None:
    document = document_of(random_problem(seed, "tiny"))
    changed = in_other_units(document, random.Random(seed))
    assert text_of(changed) != text_of(document)
    assert front(text_of(changed)) == front(text_of(document))


def test_a_quantity_is_rewritten_exactly() -> None:
    document = {"dse": "1", "name": "10 ms", "threads": {"c0": {"period": "10 ms"}}, "rules": ["can_125k or c0"]}
    found = {in_other_units(document, random.Random(seed))["threads"]["c0"]["period"] for seed in range(40)}
    assert {"0.01 s", "10000us", "10000000 ns", "10 ms"} <= found
    assert in_other_units(document, random.Random(0))["rules"] == document["rules"]
    assert in_other_units(document, random.Random(0))["name"] == document["name"]


# Limits


@pytest.mark.parametrize("factor", [Fraction(21, 20), Fraction(2), Fraction(9, 10), Fraction(1, 2)], ids=str)
@pytest.mark.parametrize("seed", FEW)
def test_a_looser_limit_loses_no_point_and_a_tighter_one_wins_none(seed: int, factor: Fraction) -> None:
    document = document_of(random_problem(seed, "tiny"))
    before: set[Vector] | None = None
    for position, requirement in enumerate(document.get("requirements") or []):
        changed = with_limit(document, position, factor)
        if "==" in requirement or changed is None:
            continue
        before = exact_front(text_of(document)) if before is None else before
        after = exact_front(text_of(changed))
        is_farther = (factor > 1) == (re.search(r"=\s*-", requirement) is None)  # twice -100 EUR is less than -100 EUR
        is_looser = is_farther == ("<" in requirement)
        assert weakly_dominates(after, before) if is_looser else weakly_dominates(before, after), requirement


@pytest.mark.parametrize("seed", FEW)
def test_a_requirement_or_rule_less_loses_no_point(seed: int) -> None:
    document = document_of(random_problem(seed, "tiny"))
    before = exact_front(text_of(document))
    for key in ("requirements", "rules"):
        for position in range(len(document.get(key) or [])):
            assert weakly_dominates(exact_front(text_of(without(document, key, position))), before)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_requirement_that_all_points_meet_keeps_them_all(seed: int) -> None:
    problem = dse.loads(random_problem(seed, "tiny"))
    evaluator = Evaluator(problem.space)
    before = search_front(evaluator).points
    if not before:
        return
    requirements = []
    for measure in evaluator.metrics:
        values = [evaluator.metric_values(design)[measure.metric.name] for design in before.values()]
        kind, _, name = measure.metric.name.partition(" of ")
        subject = f"{kind} of '{name}'" if name else kind
        if measure.unit in ("ns", "mW", "B/s", "g") and measure.scale == 1:
            requirements += [f"{subject} <= {max(values)} {measure.unit}", f"{subject} >= {min(values)} {measure.unit}"]
    result = dse.solve(problem, require=requirements)
    assert {tuple(point.objectives.values()): point.design for point in result.front} == before, requirements


# The same answer every time


def without_time(text: str) -> str:
    """A result as text, without the one figure that may differ from run to run."""
    result = json.loads(text)
    assert result["search"].pop("wall_s") >= 0
    return json.dumps(result)


@pytest.mark.parametrize("seed", FEW)
def test_the_same_problem_and_seed_give_the_same_bytes(seed: int) -> None:
    text = random_problem(seed, "tiny")
    first, again = (dse.solve(dse.loads(text), workers=1).to_json() for _ in range(2))
    assert without_time(first) == without_time(again)


@pytest.mark.parametrize("seed", FEW)
def test_the_front_depends_neither_on_the_seed_nor_on_the_workers(seed: int) -> None:
    problem = dse.loads(random_problem(seed, "tiny"))
    settings: list[dict[str, Any]] = [{}, {"seed": 1}, {"seed": 12345}, {"workers": 2}, {"workers": 2, "seed": 7}]
    results = [dse.solve(problem, **chosen) for chosen in settings]
    assert len({result.to_csv() for result in results}) == 1
    parts = [json.loads(result.to_json()) for result in results]
    for part in parts:
        del part["search"]
    assert len({json.dumps(part) for part in parts}) == 1
