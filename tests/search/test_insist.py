"""The front with each option fixed, from the whole front: as a search with it fixed finds it, and exhaustion."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.questions.verify.insisting import open_options
from dse.search.front import SearchLimits, search_front
from dse.search.insist import Insistence
from dse.support.timelimit import TimeLimit
from tests.helpers.effort import cases
from tests.helpers.support import brute_front
from tests.oracle.generator import random_problem
from tests.properties.pair import Pair

MOST_COMBINATIONS = 1500
PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
MOST_OPTIONS = 8


@pytest.mark.parametrize(
    ("size", "seed"), [*(("", seed) for seed in cases(12)), *(("hosted", seed) for seed in cases(5, 111))]
)
def test_each_front_is_that_with_the_option_fixed(size: str, seed: int) -> None:
    draw = random.Random(seed)
    drawn = draw.choice(["tiny", "tiny", "small"])
    pair = Pair(random_problem(seed, size or drawn))
    space = pair.evaluator.space
    whole = search_front(pair.evaluator)
    insistence = Insistence(pair.evaluator, replace(whole, frame=None) if seed % 3 else whole)
    options = open_options(space)
    for decision, option in draw.sample(options, min(MOST_OPTIONS, len(options))):
        found = insistence.front(decision, option, SearchLimits())
        fixed = Evaluator(replace(space, fixed={**space.fixed, decision: option}))
        assert found.is_complete
        if pair.combinations <= MOST_COMBINATIONS:
            assert dict(found.points) == brute_front(fixed)
        else:
            assert found.points.keys() == search_front(fixed).points.keys()


def test_what_the_whole_front_tells_is_not_searched_again() -> None:
    """Where every point has the option, or the option is all that was left, no question is asked."""
    pair = Pair(random_problem(3, "tiny"))
    whole = search_front(pair.evaluator)
    insistence = Insistence(pair.evaluator, whole)
    space = pair.evaluator.space
    shared = [
        (decision, option)
        for decision, option in open_options(space)
        if all(design[decision] == option for design in whole.points.values())
    ]
    assert shared
    for decision, option in shared:
        found = insistence.front(decision, option, SearchLimits())
        assert found.points == whole.points and found.calls == whole.calls


def test_what_was_not_finished_is_incomplete_and_what_is_known_stays() -> None:
    evaluator = Evaluator(dse.load(PUMP).space)
    insistence = Insistence(evaluator, search_front(evaluator))
    late = SearchLimits(TimeLimit.after(0))
    states = []
    for decision, option in open_options(evaluator.space):
        known = insistence.known(decision, option)
        found = insistence.front(decision, option, late)
        states.append(found.is_complete)
        assert found.is_complete is known.is_complete
        assert known.points.items() <= found.points.items()
    assert not all(states)
