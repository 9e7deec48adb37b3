"""Assignments against all permutations, and against SciPy's."""

from __future__ import annotations

import random
from itertools import permutations

import pytest
from scipy.optimize import linear_sum_assignment

from dse.answers.ranking.core_numbering import best_assignment


@pytest.mark.parametrize("seed", range(60))
def test_no_permutation_gains_more(seed: int) -> None:
    draw = random.Random(seed)
    count = draw.randint(0, 6)
    gains = [[draw.randint(-5, 9) for _ in range(count)] for _ in range(count)]
    found = best_assignment(gains)
    most = max(sum(gains[row][column] for row, column in enumerate(order)) for order in permutations(range(count)))
    assert sorted(found) == list(range(count))
    assert sum(gains[row][column] for row, column in enumerate(found)) == most


@pytest.mark.parametrize("count", [40, 90])
def test_large_ones_gain_what_scipy_finds(count: int) -> None:
    draw = random.Random(count)
    gains = [[draw.randint(0, 10**6) for _ in range(count)] for _ in range(count)]
    rows, columns = linear_sum_assignment(gains, maximize=True)
    theirs = sum(gains[row][column] for row, column in zip(rows, columns, strict=True))
    assert sum(gains[row][column] for row, column in enumerate(best_assignment(gains))) == theirs
