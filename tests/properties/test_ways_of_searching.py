"""The same front and designs in whatever way it is searched: parts, regions at once, settings, workers, two stages."""

from __future__ import annotations

import random

import pytest

from dse.encode import model, sums
from dse.search import front, lexicographic
from dse.search.front import Budget, FrontSearch, search_front
from dse.search.solver import subspaces
from dse.search.solver.settings import BARE, CUTTING, LOWEST, RELAXED, Settings
from dse.search.solver.solver import Solver
from dse.search.solver.subspaces import Part
from dse.search.solver_answer import Answer, Found, Unfinished
from dse.support.errors import TooLargeError
from tests.helpers.effort import cases
from tests.helpers.support import brute_front
from tests.oracle.generator import random_problem
from tests.properties.pair import Pair

WAYS = 3
MOST_COMBINATIONS = 1500
LIGHT = 1.0
"""So much work may be drawn to have been too little."""


@pytest.mark.parametrize("seed", cases(30))
def test_every_way_finds_the_same(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        pair = Pair(random_problem(seed, {3: "segmented", 4: "reserved", 5: "hosted"}.get(seed % 6, "tiny")))
    except TooLargeError:
        pytest.skip("a limit too large to keep exactly, by name")
    expected = brute_front(pair.evaluator) if pair.combinations <= MOST_COMBINATIONS else None
    for way in range(WAYS):
        with monkeypatch.context() as changed:
            try:
                found = searched(pair, random.Random(1000 * seed + way), changed)
            except TooLargeError:
                pytest.skip("too large to search exactly, by name")
        assert found.is_complete
        expected = expected if expected is not None else dict(found.points)
        assert found.points == expected


def searched(pair: Pair, draw: random.Random, changed: pytest.MonkeyPatch) -> FrontSearch:
    """A search with drawn limits; what is too hard for some settings is drawn too."""
    changed.setattr(sums, "SHARED_BY", draw.choice([1, 2, sums.SHARED_BY]))
    changed.setattr(model, "MOST_REGIONS", draw.randint(1, 6))
    changed.setattr(model, "FEWEST_OBJECTIVES", draw.choice([1, 2, 3]))
    changed.setattr(front, "HELP_AFTER_S", draw.choice([0.0, front.HELP_AFTER_S]))
    changed.setattr(
        lexicographic, "EXACT_LIMIT", draw.choice([1, lexicographic.EXACT_LIMIT, lexicographic.EXACT_LIMIT])
    )
    changed.setattr(subspaces, "APART_WAYS", draw.sample((CUTTING, RELAXED, LOWEST, BARE), 3))
    often, seldom = draw.choice([0.0, 0.5, 0.9]), draw.choice([0.0, 0.5])
    whole, within = Solver._solve_whole, Solver.run_within

    def solve_whole(self: Solver, settings: Settings, work: float) -> Answer:
        return Unfinished() if work < LIGHT and draw.random() < often else whole(self, settings, work)

    def solve_within(self: Solver, part: Part, settings: Settings, work: float, least: int = 0) -> Answer:
        answer = within(self, part, settings, work, least)
        is_stopped = work < LIGHT and draw.random() < seldom
        return Unfinished(best=answer if isinstance(answer, Found) else None) if is_stopped else answer

    changed.setattr(Solver, "_solve_whole", solve_whole)
    changed.setattr(Solver, "run_within", solve_within)
    return search_front(pair.evaluator, Budget(workers=draw.randint(1, 3), seed=draw.randint(0, 9)))
