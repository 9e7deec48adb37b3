"""Designs of fronts are played with the worst offsets: nothing leaves its bounds, and what meets a limit keeps it."""

from __future__ import annotations

from typing import Any

import pytest

import dse
from dse.examples.random.problem import random_problem
from dse.questions.problem import Problem
from dse.questions.verbs.simulate import simulate
from dse.space.model.criteria import Requirement
from tests.helpers.effort import LONG, cases
from tests.helpers.joins import draw_join
from tests.helpers.polled_callbacks import draw_polled
from tests.test_shipped_problems import QUESTIONS, problem_path, question_name

MOST_PLAYED = 3
"""About so many designs of a front are played, evenly spread; with more effort all of them."""
RUNS = 8 if LONG else 2


def play_front(problem: Problem, **question: Any) -> int:
    """Play designs of a front, and hold what is seen against their bounds and limits; how many were played."""
    result = dse.solve(problem, workers=1, **question)
    played = result.front[:: 1 if LONG else max(1, len(result.front) // MOST_PLAYED)]
    for point in played:
        found = simulate(problem, dict(point.decisions), runs=RUNS, contention=True)
        assert not found.contradictions, (point.decisions, found.contradictions)
        seen = {flow.name: flow.latencies for flow in found.flows if flow.latencies}
        for item in problem.space.requirements:
            flow = item.metric.name.removeprefix(f"{item.metric.kind} of ")
            if flow in seen and item.metric.kind in ("latency", "jitter"):
                assert keeps(item, seen[flow]), (point.decisions, item.text)
    return len(played)


def keeps(item: Requirement, latencies: Any) -> bool:
    """Whether latencies that were seen, in ns, break no upper limit on the latency or the jitter of their flow."""
    jitter = item.metric.kind == "jitter"
    figure = max(latencies) - (min(latencies) if jitter else 0)
    return not item.is_upper or figure <= item.limit.value * 10**9


@pytest.mark.parametrize("asked", QUESTIONS, ids=question_name)
def test_fronts_of_shipped_problems_are_played(asked: tuple[str, dict[str, Any]]) -> None:
    problem = dse.load(problem_path(asked[0]))
    if not problem.space.flows:
        pytest.skip("no flow")
    assert play_front(problem, **asked[1])


@pytest.mark.parametrize("family", ["robot", "event-driven", "automotive"])
@pytest.mark.parametrize("seed", cases(1))
def test_fronts_of_drawn_problems_are_played(family: str, seed: int) -> None:
    text = random_problem(6, seed, 2, family)
    assert play_front(dse.loads(f"{text}processing: response_time\n"))


@pytest.mark.parametrize("seed", cases(4, 5_000))
def test_fronts_with_joins_and_drops_are_played(seed: int) -> None:
    """These problems have no limits: what is seen is held against bounds alone."""
    for text in (draw_join(seed, options=True), draw_polled(seed)):
        assert play_front(dse.loads(text))
