"""Two witnesses: on random designs no observation leaves the bounds, and the worst offsets come close to them."""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import cache

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.answers.result import decisions_of
from dse.answers.simulation import Simulation
from dse.questions.verbs.simulate import simulate
from tests.helpers.effort import LONG, cases
from tests.oracle import generator

SEEDS = range(24) if LONG else (0, 1, 2, 4, 5, 7, 8, 10, 12, 14, 17, 18)
"""To draw one takes a second: half of them, with all whose flows reach their bounds."""


RUNS = 12 if LONG else 6


@cache
def drawn(seed: int, size: str = "small") -> dse.Problem:
    """A random problem, for both witnesses."""
    return dse.loads(generator.random_problem(seed, size))


def random_simulation(seed: int, *, contention: bool, size: str = "small") -> Simulation | None:
    """The simulation of a random design of a random problem; None when it has no flow or no design is found."""
    problem = drawn(seed, size)
    space, rng = problem.space, random.Random(seed)
    evaluator = Evaluator(space)
    for _ in range(100 if space.flows else 0):
        design = tuple(rng.randrange(len(decision.options)) for decision in space.decisions)
        if not evaluator.invalid(design):
            chosen = decisions_of(space, design)
            drift = rng.choice([0, 0, 500])
            return simulate(problem, chosen, runs=RUNS, contention=contention, seed=seed, drift_ppm=drift)
    return None


def simulations(*, contention: bool) -> Iterator[tuple[int, Simulation]]:
    for seed in SEEDS:
        result = random_simulation(seed, contention=contention)
        if result is not None:
            yield seed, result


def test_without_contention_every_latency_is_within_its_bounds_and_the_bounds_are_approached() -> None:
    reached = []
    tiny = ((seed, random_simulation(seed, contention=False, size="tiny")) for seed in range(24))
    for seed, result in (*simulations(contention=False), *tiny):
        if result is None:
            continue
        assert not result.contradictions, (seed, result.contradictions)
        for flow in result.flows:
            if not flow.excuse and flow.count and not result.lost and flow.reach is not None:
                reached.append(float(flow.reach))
    assert len(reached) >= 12
    assert sorted(reached)[len(reached) // 2] > 0.95


def test_with_contention_response_times_hold() -> None:
    tasks = []
    for seed, result in simulations(contention=True):
        assert not result.contradictions, (seed, result.contradictions)
        tasks += [task for task in result.tasks if task.is_compared and task.bound_ns]
    assert len(tasks) >= 30
    tight = [task for task in tasks if task.observed_ns == task.bound_ns]
    assert len(tight) >= len(tasks) // 5


@pytest.mark.parametrize("seed", cases(20, 300))
def test_response_times_of_executors_hold(seed: int) -> None:
    """Threads that take no time, equal times and executors of one thread among them."""
    result = random_simulation(seed, contention=True, size="grouped")
    assert result is None or not result.contradictions
