"""The same front and designs in whatever way it is searched: with and without each heuristic, and with other limits."""

from __future__ import annotations

import random
from functools import cache
from typing import Any

import pytest

from dse.analysis.evaluate import Evaluator
from dse.search import front, lexicographic
from dse.search.front import FrontSearch, SearchLimits, search_front
from dse.search.solver.settings import BARE, CUTTING, LOWEST, RELAXED, SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver.subspaces import Subspace
from dse.search.solver_answer import Answer, Found, Unfinished
from dse.support.errors import TooLargeError
from tests.benchmarks.cases import nearly_full
from tests.helpers.effort import cases
from tests.helpers.support import brute_front, space_of
from tests.helpers.thread_systems import draw, text_of
from tests.helpers.tuned import HEURISTICS, tune, tuning_with
from tests.oracle.generator import random_problem
from tests.properties.pair import Pair

WAYS = 3
MOST_COMBINATIONS = 1500
LIGHT = 1.0
"""So much work may be drawn to have been too little."""
HURRIED = 1e-6
"""Work in which nothing is answered: what comes after the first attempts has its turn."""
SOON: dict[str, dict[str, Any]] = {
    "shared_forms": {"shared_by": 1},
    "subspaces": {"first_work": HURRIED, "brief": (BARE, HURRIED)},
    "lowest_first": {"at_once": HURRIED},
    "knapsack_tables": {"after": 0.0},
}
"""Constants with which each heuristic has its turn in problems that are small."""


def drawn(seed: int) -> list[str]:
    """Problems of all kinds: full cores, threads that wait, and what the generator draws."""
    waiting = text_of(draw(seed, kind=("plain", "chained", "reserved")[seed % 3]))
    return [
        nearly_full(4, 2, 0.9, seed),
        waiting,
        waiting.replace("processing: execution_time", "processing: response_time"),
        *(random_problem(2 * seed + number, "tiny") for number in range(2)),
    ]


@cache
def evaluators(seed: int) -> list[Evaluator]:
    """What is known of the drawn problems, one for all heuristics."""
    return [Evaluator(space_of(text)) for text in drawn(seed)]


@cache
def expected(seed: int, number: int) -> FrontSearch:
    """The search with all heuristics on."""
    return search_front(evaluators(seed)[number])


@pytest.mark.parametrize("soon", [False, True])
@pytest.mark.parametrize("heuristic", HEURISTICS)
def test_each_heuristic_off_and_on_finds_the_same_front(heuristic: str, soon: bool) -> None:
    """With its usual limits, and with limits at which heuristics have their turn in small problems."""
    given = {name: dict(changes) for name, changes in SOON.items()} if soon else {}
    given[heuristic] = {**given.get(heuristic, {}), "is_on": False}
    for seed in cases(2):
        for number, evaluator in enumerate(evaluators(seed)):
            found = search_front(evaluator, SearchLimits(tuning=tuning_with(given)))
            assert found.is_complete
            assert found.points.keys() == expected(seed, number).points.keys()


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
    """A search with drawn heuristics and limits; what is too hard for some settings is drawn too."""
    tune(changed, **{name: {"is_on": False} for name in HEURISTICS if draw.random() < 0.25})
    tune(
        changed,
        shared_forms={"shared_by": draw.choice([1, 2, 3])},
        region_unions={"most": draw.randint(1, 6), "fewest_objectives": draw.choice([1, 2, 3])},
        subspaces={"ways": tuple(draw.sample((CUTTING, RELAXED, LOWEST, BARE), 3))},
    )
    changed.setattr(front, "HELP_AFTER_S", draw.choice([0.0, front.HELP_AFTER_S]))
    changed.setattr(
        lexicographic, "EXACT_LIMIT", draw.choice([1, lexicographic.EXACT_LIMIT, lexicographic.EXACT_LIMIT])
    )
    often, seldom = draw.choice([0.0, 0.5, 0.9]), draw.choice([0.0, 0.5])
    whole, within = Strategy._solve_whole, Strategy.run_within

    def solve_whole(self: Strategy, settings: SolverSettings, work: float) -> Answer:
        return Unfinished() if work < LIGHT and draw.random() < often else whole(self, settings, work)

    def solve_within(self: Strategy, part: Subspace, settings: SolverSettings, work: float, least: int = 0) -> Answer:
        answer = within(self, part, settings, work, least)
        is_stopped = work < LIGHT and draw.random() < seldom
        return Unfinished(best=answer if isinstance(answer, Found) else None) if is_stopped else answer

    changed.setattr(Strategy, "_solve_whole", solve_whole)
    changed.setattr(Strategy, "run_within", solve_within)
    return search_front(pair.evaluator, SearchLimits(workers=draw.randint(1, 3), seed=draw.randint(0, 9)))
