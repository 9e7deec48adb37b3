"""Remembered figures: the same as computed anew, bounded, and left alone where nothing is asked for again."""

from __future__ import annotations

import random
from typing import cast

import pytest

from dse.analysis.diagnosis.front_verdicts import ContentionReferee, with_contention
from dse.analysis.diagnosis.unbounded import unbounded_in
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency.metrics import flow_figure_ns
from dse.analysis.limits import Limit, Verdict, build_limit, judge
from dse.analysis.memo import TRIED, Recall
from dse.analysis.views import View
from dse.examples.random import random_problem
from dse.space.model.space import Design, Space
from dse.space.question.open_cores import is_scheduled
from tests.helpers.effort import cases
from tests.helpers.support import space_of
from tests.helpers.thread_systems import draw, text_of


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


class Alone(View):
    """A design whose response times are found one by one, each from what decides it."""

    __slots__ = ()


def _told(space: Space, limits: list[Limit], view: View) -> list[tuple[object, ...]]:
    found: list[tuple[object, ...]] = []
    for limit in limits:
        metric = limit.requirement.metric
        found.append((judge(limit, view), flow_figure_ns(space, metric, view), unbounded_in(space, metric, view)))
    return found


@pytest.mark.parametrize("kind", ["chained", "stated", "blocked", "ordered", "best", "grouped", "reserved", "mixed"])
@pytest.mark.parametrize("seed", cases(20))
def test_designs_share_response_times_that_each_has_alone(kind: str, seed: int) -> None:
    space = with_contention(space_of(text_of(draw(seed, kind=kind)))) or space_of(text_of(draw(seed, kind=kind)))
    _compare(space)


@pytest.mark.parametrize("seed", cases(10))
def test_large_designs_share_response_times_that_each_has_alone(seed: int) -> None:
    space = with_contention(space_of(random_problem(14, seed, 2, "many-buses")))
    assert space is not None
    _compare(space)


def _compare(space: Space) -> None:
    limits = [build_limit(space, item) for item in space.requirements if is_scheduled(space, item.metric)]
    referee = ContentionReferee(space)
    for design in _drawn(space, 12):
        if Evaluator(space).evaluate(design).breaches:
            continue
        shared = _told(space, limits, View(design))
        assert shared == _told(space, limits, Alone(design))
        misses = [item[0] for item in shared if not cast(Verdict, item[0]).holds]
        if not space.open_priorities:
            assert [miss.verdict for miss in referee.judge(design).misses] == misses
