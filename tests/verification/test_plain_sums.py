"""What the relaxation of plain sums refutes holds no design, and what holds none is refuted."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from dse import load
from dse.analysis.evaluate import Evaluator
from dse.verification.cases import MOST_SOLUTIONS
from dse.verification.exhaustion import exhaust
from dse.verification.model import SecondModel
from dse.verification.plain_sums import PlainSums, plain_sums
from dse.verification.reduced import Reduction
from dse.verification.tables import Tables, build_tables
from tests.helpers import classics
from tests.helpers.effort import cases

WITH_A_FLOW = """
dse: 1
name: a flow
processor_types: {slow: {price: 1 EUR}, fast: {price: 2 EUR}}
processors: {p: {type: [slow, fast]}}
threads:
  a: {processor: p, period: [5 ms, 10 ms], compute_execution_time: {slow: 2 ms, fast: 1 ms}}
  b: {processor: p, period: [10 ms, 20 ms], compute_execution_time: {slow: 2 ms, fast: 1 ms}}
connections: {c: {from: a, to: b}}
flows: {f: {path: [a, b]}}
processing: execution_time
objectives: [minimise price, minimise latency of f]
"""


def tables_of(text: str, tmp_path: Path) -> Tables:
    path = tmp_path / "problem.yaml"
    path.write_text(text)
    return build_tables(Evaluator(load(path).space))


def drawn(kind: str, seed: int, tmp_path: Path) -> Tables:
    """A knapsack, or an assignment with so few costs that designs have the same."""
    if kind == "knapsack":
        return tables_of(classics.knapsack(*classics.drawn_items(8, 2 + seed % 2, seed)), tmp_path)
    costs = classics.drawn_costs(4, 2 + seed % 2, seed)
    few = [(task, agent, *(value % 2 for value in values)) for task, agent, *values in costs]
    return tables_of(classics.assignment(few), tmp_path)


@pytest.mark.parametrize("kind", ["knapsack", "assignment"])
@pytest.mark.parametrize("seed", cases(8))
def test_regions_are_refuted_where_no_design_is(kind: str, seed: int, tmp_path: Path) -> None:
    """Bounds are drawn around designs; half of the questions leave one design out."""
    tables = drawn(kind, seed, tmp_path)
    found = exhaust(tables)
    sums = plain_sums(Reduction(tables), None)
    assert isinstance(sums, PlainSums)
    rng = random.Random(seed)
    answers = set()
    for number in range(40):
        row = rng.randrange(len(found.vectors))
        vector = [int(value) for value in found.vectors[row]]
        below = [value + rng.choice((0, 1, 1, 200)) for value in vector]
        from_on = None if number % 4 < 2 else [bound - rng.choice((1, 1, 300)) for bound in below]
        above = True if from_on is None else (found.vectors >= from_on).all(axis=1)
        inside = np.array((found.vectors < below).all(axis=1) & above)
        design = tuple(int(option) for option in found.designs[row]) if number % 2 else None
        if design is not None:
            inside[row] = False
        assert sums.is_refuted(50.0, below, from_on, design) == (not inside.any()), (below, from_on, design)
        answers.add(bool(inside.any()))
    assert answers == {True, False}


@pytest.mark.parametrize("kind", ["knapsack", "assignment"])
@pytest.mark.parametrize("seed", cases(4, first=20))
def test_the_second_model_leaves_what_it_should(kind: str, seed: int, tmp_path: Path) -> None:
    """Regions with a design stay open, and claims of a design that is not the first; no claim of one that is alone."""
    tables = drawn(kind, seed, tmp_path)
    found = exhaust(tables)
    model = SecondModel(tables)
    rows = zip(found.designs, found.vectors, strict=True)
    designs = {tuple(map(int, row)): tuple(map(int, vector)) for row, vector in rows}
    picked = random.Random(seed).sample(sorted(designs), 24)
    regions = [[value + number % 2 for value in designs[design]] for number, design in enumerate(picked)]
    holding = [at for at, below in enumerate(regions) if (found.vectors < below).all(axis=1).any()]
    assert model.unproved_regions(regions) == holding
    claims = [(designs[design], design) for design in picked]
    same = [{other for other, values in designs.items() if values == vector} for vector, _ in claims]
    later = {at for at, (_, design) in enumerate(claims) if min(same[at]) < design}
    left = set(model.unproved_claims(claims))
    assert later <= left <= {at for at, others in enumerate(same) if len(others) > 1}
    assert left == later or len(later) >= MOST_SOLUTIONS
    assert later or kind == "knapsack"


def test_other_questions_are_none_of_plain_sums(tmp_path: Path) -> None:
    assert plain_sums(Reduction(tables_of(WITH_A_FLOW, tmp_path)), None) is None
