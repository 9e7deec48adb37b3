"""Regions that the second proof refutes on a smaller question hold no design."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from effort import cases

from dse.analysis.evaluate import Evaluator
from dse.errors import DseError
from dse.verification.diagrams import Node, TooLarge
from dse.verification.exhaustion import TooMany, exhaust
from dse.verification.model import SecondModel
from dse.verification.reduced import Reduction, Row, leave_out_dominated, narrow
from dse.verification.tables import build_tables
from tests.properties.test_every_question import question

FEW = 1_000


@pytest.mark.parametrize("scheduled", [False, True])
@pytest.mark.parametrize("seed", cases(10, first=500))
def test_what_is_refuted_holds_no_design(seed: int, scheduled: bool, tmp_path: Path) -> None:
    """Where rows say all there is to say, what holds none is refuted, too."""
    asked = question(seed, tmp_path, scheduled=scheduled)
    if asked is None:
        return
    try:
        tables = build_tables(Evaluator(asked.problem.space))
        SecondModel(tables)  # which refuses figures that are too large
        vectors = exhaust(tables, FEW).vectors
    except (DseError, TooLarge, TooMany):
        return
    rng = random.Random(seed)
    reduction = Reduction(tables)
    sums = [*(bound.sum for bound in tables.bounds), *(total for total, _ in tables.objectives)]
    only_rows = tables.is_exact and not tables.cores and not any(item.extremes for item in sums)
    for _ in range(4):
        if len(vectors):
            below = [int(value) + rng.choice((0, 1)) for value in vectors[rng.randrange(len(vectors))]]
        else:
            below = [total.high // divisor + 1 for total, divisor in tables.objectives]
        from_on = [bound - rng.randint(1, 3) for bound in below] if tables.bounds_are_exact else None
        has_one = (vectors < below).all(axis=1) & (True if from_on is None else (vectors >= from_on).all(axis=1))
        is_refuted = reduction.region(below, from_on).is_refuted(50.0, None)
        assert not (is_refuted and has_one.any()), (below, from_on)
        assert is_refuted or has_one.any() or not only_rows


def test_what_breaks_a_row_goes_and_so_does_what_is_never_better() -> None:
    """Options 3, 5 and 9 in a sum with 2 or 4 at most 9; in another row the dearer options save nothing."""
    first, second = Node(0, (3, 5, 9)), Node(1, (4, 2))
    rows = [Row((first, second), 9), Row((Node(0, (1, 1, 0)), Node(1, (0, 5))), 100)]
    left = [[0, 1, 2], [0, 1]]
    assert narrow(rows, left, rows)
    assert left == [[0, 1], [0, 1]]
    leave_out_dominated(rows, left)
    assert left == [[0], [0, 1]]  # 4 and 0 against 2 and 5: neither is better
    assert not narrow([*rows, Row((second, first), 4)], left, [Row((second, first), 4)])
