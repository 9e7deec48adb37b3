"""Arrays of designs have exactly the figures that the evaluator gives them one by one."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import islice, product
from pathlib import Path

import numpy as np
import pytest

from dse.analysis.evaluate import Evaluator
from dse.examples.random import FAMILIES, random_problem
from dse.examples.shipped import example_files
from dse.questions.problem import Problem, load, loads
from dse.space.model.space import Design, Space
from tests.benchmarks import vectorised
from tests.benchmarks.vectorised import VectorisedEvaluator
from tests.helpers.effort import cases
from tests.helpers.small import quick, without_waiting
from tests.oracle.generator import random_problem as oracle_problem

MOST = 150


def quick_of(text: str) -> Problem:
    """The problem of a text, in which no thread waits for the CPU unless the text says what counts itself."""
    return loads(without_waiting(text))


def some_designs(space: Space, seed: int) -> list[Design]:
    """Every design of a small space; of a large one a sample, the baseline and its neighbours among them."""
    counts = [len(decision.options) for decision in space.decisions]
    if np.prod(counts, dtype=float) <= MOST:
        return list(islice(product(*map(range, counts)), MOST))
    rng = random.Random(seed)
    start = [space.baseline.get(index, 0) for index in range(len(counts))]
    found = [tuple(start)]
    while len(found) < MOST:
        changed = list(start) if len(found) % 2 else [rng.randrange(count) for count in counts]
        for _ in range(rng.randint(1, 3)):
            index = rng.randrange(len(counts))
            changed[index] = rng.randrange(counts[index])
        found.append(tuple(changed))
    return found


def compare(space: Space, seed: int = 0) -> tuple[int, int]:
    """How many designs were compared, and how many of them are feasible."""
    evaluator = Evaluator(space)
    designs = some_designs(space, seed)
    batch = VectorisedEvaluator(evaluator).evaluate(np.array(designs, dtype=np.int64).reshape(len(designs), -1))
    feasible = batch.is_feasible
    for row, design in enumerate(designs):
        evaluation = evaluator.evaluate(design)
        assert bool(batch.is_valid[row]) == (not evaluation.breaches), (design, evaluation.breaches)
        assert bool(feasible[row]) == evaluation.is_feasible, (design, evaluation)
        if not evaluation.breaches:
            assert tuple(map(int, batch.objectives[row])) == evaluation.objectives, design
    return len(designs), int(feasible.sum())


@pytest.mark.parametrize("seed", cases(20))
def test_random_problems_of_the_oracle(seed: int) -> None:
    compare(quick_of(oracle_problem(seed, "small")).space, seed)


@pytest.mark.parametrize("path", example_files(), ids=lambda path: path.stem)
def test_examples(path: Path) -> None:
    space = quick(load(path)).space
    if space.processing != "execution_time":
        pytest.skip("tables of response times take longer than the designs of a benchmark")
    compare(space)


@pytest.mark.parametrize("family", FAMILIES)
def test_generated_problems(family: str) -> None:
    _, feasible = compare(quick_of(random_problem(20, 1, 5, family)).space)
    assert feasible


@pytest.mark.parametrize(("name", "value"), [("DENSE_LIMIT", 8), ("INT64_LIMIT", 0)])
def test_trees_and_large_integers_give_the_same(name: str, value: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables too large for arrays, and sums too large for int64, take the other way: forced here for all."""
    monkeypatch.setattr(vectorised, name, value)
    for seed in range(4):
        compare(quick_of(oracle_problem(seed, "small")).space, seed)
    compare(quick_of(random_problem(8, 1, 5, "event-driven")).space)


def test_operators_at_their_edges() -> None:
    text = """
dse: 1
name: edges
processor_types: {p: {price: 100 EUR}, q: {price: 101 EUR}, r: {price: 102 EUR}}
processors: {c: {type: [p, q, r]}}
threads: {t: {processor: c, period: [2 ms, 3 ms], compute_execution_time: 1 ms}}
requirements: [REQUIREMENT]
objectives: [minimise price, maximise utilisation of c]
"""
    for metric, limits in (("price", ("101 EUR",)), ("utilisation of c", ("50 %", "100/3 %", "33 %"))):
        for operator in ("<=", "<", ">=", ">", "=="):
            for limit in limits:
                if operator == "==" and metric != "price":
                    continue
                count, feasible = compare(quick_of(text.replace("REQUIREMENT", f"{metric} {operator} {limit}")).space)
                assert count == 6
                assert feasible in range(7)


def test_excess_is_zero_exactly_where_a_limit_holds_and_grows_beyond_it() -> None:
    space = quick_of(random_problem(8, 1, 2, "robot")).space
    evaluator = Evaluator(space)
    designs = some_designs(space, 1)
    batch = VectorisedEvaluator(evaluator).evaluate(designs)
    for row, design in enumerate(designs):
        evaluation = evaluator.evaluate(design)
        if evaluation.breaches:
            continue
        first = evaluation.verdicts[0]
        assert first.requirement.metric.kind == "jitter"
        assert batch.excess[row, 0] == max(Fraction(0), -first.slack)


def test_no_designs_and_inactive_options() -> None:
    space = quick_of(random_problem(8, 1, 2, "robot")).space
    tables = VectorisedEvaluator(Evaluator(space))
    width = len(space.decisions)
    empty = tables.evaluate(np.zeros((0, width), dtype=np.int64))
    assert empty.objectives.shape == (0, 2)
    assert empty.is_feasible.shape == (0,)
    inactive, zero = tables.evaluate([[-1] * width]), tables.evaluate([[0] * width])
    assert np.array_equal(inactive.objectives, zero.objectives)
    with pytest.raises(ValueError, match="expected shape"):
        tables.evaluate([[0]])
