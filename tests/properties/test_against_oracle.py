"""The product against brute force by an independent reading of the documents, on random problems.

``DSE_RANDOM_PROBLEMS=5000`` looks at that many tiny problems, and a twentieth as many small ones, instead of the
default; ``DSE_FIRST_SEED=100000`` at others than usual.
"""

from __future__ import annotations

import os
from fractions import Fraction

import pytest

from dse.pareto.front import search_front
from dse.space.types import Design
from tests.oracle import evaluator as oracle
from tests.oracle.generator import random_problem
from tests.properties.pair import Pair, exact_value

COUNT = int(os.environ.get("DSE_RANDOM_PROBLEMS", "500"))
FIRST = int(os.environ.get("DSE_FIRST_SEED", "0"))
PROBLEMS = [("tiny", seed) for seed in range(FIRST, FIRST + COUNT)]
PROBLEMS += [("small", seed) for seed in range(FIRST, FIRST + COUNT // 20)]
MOST_COMPARED = 250
"""Designs of a problem whose figures are compared, evenly spread; a tiny problem has fewer."""
MOST_COMBINATIONS = 1500
"""Problems with more combinations of options are not searched by evaluating all of them."""


@pytest.mark.parametrize(("size", "seed"), PROBLEMS)
def test_a_random_problem(size: str, seed: int) -> None:
    pair = Pair(random_problem(seed, size))
    figures_agree(pair)
    found = search_front(pair.evaluator)
    assert found.is_complete
    fronts_agree(pair, found.points)
    if pair.combinations <= MOST_COMBINATIONS:
        assert found.points == pair.own_front()


def figures_agree(pair: Pair) -> None:
    """Both call the same combinations designs, use the same decisions in them, and give them the same figures."""
    for judged in pair.valid[:: len(pair.valid) // MOST_COMPARED + 1]:
        evaluation = pair.evaluator.evaluate(tuple(max(option, 0) for option in judged.design))
        assert evaluation.breaches == ()
        assert evaluation.design == judged.design
        broken = {verdict.requirement.text for verdict in evaluation.verdicts if not verdict.holds}
        assert bool(broken) == bool(judged.figures["violations"]), judged.named
        expected = pair.oracle_metrics(judged.figures)
        assert {measure.metric.name for measure in pair.evaluator.metrics} == expected.keys()
        counted = pair.evaluator.metric_values(evaluation.design)
        for measure in pair.evaluator.metrics:
            exact, shown = expected[measure.metric.name], exact_value(measure, counted[measure.metric.name])
            if measure.rounded:
                assert 0 <= shown - exact < len(measure.terms) * exact_value(measure, 1), measure.metric.name
            else:
                assert shown == exact, measure.metric.name


def fronts_agree(pair: Pair, points: dict[tuple[int, ...], Design]) -> None:
    """The same vectors, each with the first of all its designs; an infeasible problem has none."""
    assert bool(points) == bool(pair.feasible)
    if pair.is_rounded:
        rounded_front_agrees(pair, points)
        return
    found = {pair.vector(counted): design for counted, design in points.items()}
    assert found.keys() == pair.front.keys()
    for vector, design in found.items():
        assert design == pair.front[vector][0].design
        figures = oracle.evaluate(pair.oracle, pair.named(design))
        assert figures["violations"] == []
        assert figures["objectives"] == vector


def rounded_front_agrees(pair: Pair, points: dict[tuple[int, ...], Design]) -> None:
    """Where the product counts too coarsely to be exact, its front is that of the vectors as it counts them."""
    first: dict[tuple[int, ...], Design] = {}
    for judged in pair.feasible:
        first.setdefault(pair.evaluator.evaluate(judged.design).objectives, judged.design)
    vectors: dict[tuple[Fraction, ...], tuple[int, ...]] = {pair.vector(counted): counted for counted in first}
    assert points == {vectors[vector]: first[vectors[vector]] for vector in oracle.non_dominated(set(vectors))}
    for design in points.values():
        assert oracle.evaluate(pair.oracle, pair.named(design))["violations"] == []


def test_the_random_problems_are_worth_it() -> None:
    """Fronts of several points, ties between designs, and infeasible problems do occur."""
    pairs = [Pair(random_problem(seed, "tiny")) for seed in range(40)]
    assert sum(len(pair.front) > 2 for pair in pairs) > 10
    assert any(not pair.front for pair in pairs)
    assert any(len(designs) > 1 for pair in pairs for designs in pair.front.values())
    assert any(-1 in designs[0].design for pair in pairs for designs in pair.front.values())
