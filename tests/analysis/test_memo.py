"""Remembered figures: the same as computed anew, bounded, and left alone where nothing is asked for again."""

from __future__ import annotations

import random

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.memo import TRIED, Recall
from dse.analysis.views import View
from dse.generator import random_problem
from dse.space.types import Design, Space
from tests.support import space_of


@pytest.fixture(scope="module")
def space() -> Space:
    return space_of(random_problem(6, 3, 2, "many-buses"))


def _drawn(space: Space, count: int) -> list[Design]:
    rng = random.Random(5)
    near = tuple(rng.randrange(len(decision.options)) for decision in space.decisions)
    found = [near]
    for _ in range(count):
        design = list(rng.choice(found[-5:]))
        place = rng.randrange(len(design))
        design[place] = rng.randrange(len(space.decisions[place].options))
        found.append(tuple(design))
    return found


class Counted:
    """A formula that looks at the first `depth` decisions and counts how often it is asked."""

    def __init__(self, depth: int) -> None:
        self.depth, self.calls = depth, 0

    def __call__(self, space: Space, key: str, view: View) -> tuple[int, ...]:
        self.calls += 1
        return tuple(view[number] for number in range(self.depth))


def test_designs_that_agree_where_a_formula_looks_share_its_value(space: Space) -> None:
    recall, formula = Recall[tuple[int, ...]](4), Counted(2)
    for last in range(50):
        assert recall.recall(space, "key", View((1, 2, last)), formula) == (1, 2)
    assert formula.calls == 1


def test_no_more_values_are_kept_than_allowed(space: Space) -> None:
    recall, formula = Recall[tuple[int, ...]](4), Counted(1)
    for first in (0, 1, 2, 3, 4, 0):
        for _ in range(20):
            assert recall.recall(space, "key", View((first,)), formula) == (first,)
    assert formula.calls == 6  # the fifth value makes room, so that the first one is found anew


def test_a_formula_that_is_never_asked_the_same_again_is_left_alone(space: Space) -> None:
    recall, formula = Recall[tuple[int, ...]](1000), Counted(1)
    for first in range(TRIED):
        recall.recall(space, "key", View((first,)), formula)
    for _ in range(2):
        assert recall.recall(space, "key", View((0,)), formula) == (0,)
    assert formula.calls == TRIED + 2


def test_an_evaluator_says_of_each_design_what_a_new_one_does(space: Space) -> None:
    shared = Evaluator(space)
    for design in _drawn(space, 60):
        anew = Evaluator(space)
        assert shared.evaluate(design) == anew.evaluate(design)
        if not anew.evaluate(design).breaches:
            assert shared.metric_values(design) == anew.metric_values(design)
