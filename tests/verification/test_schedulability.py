"""Rows of cores in the second proof, against every partition of drawn threads and response times by iteration."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product
from random import Random
from typing import Any

import pytest
from ortools.sat.python import cp_model

import dse
from dse.analysis.evaluate import Evaluator
from dse.search.front import search_front
from dse.verification import reduced
from dse.verification.reduced import Reduction
from dse.verification.scheduling.pooled_cores import add_pools
from dse.verification.scheduling.schedulability import Demand, add_levels
from dse.verification.tables import build_tables
from tests.benchmarks.cases import nearly_full
from tests.helpers.effort import cases

MS = 1_000_000


def is_in_time(threads: list[tuple[int, int]]) -> bool:
    """Whether each of (period, work) ends by its next release, the shorter period first."""
    ordered = sorted(threads)
    for position, (period, work) in enumerate(ordered):
        response = 0
        following = work
        while following != response and following <= period:
            response = following
            following = work + sum(-(-response // other) * time for other, time in ordered[:position])
        if following > period:
            return False
    return True


@pytest.mark.parametrize("seed", cases(400))
def test_rows_of_cores_hold_exactly_where_some_partition_is_in_time(seed: int) -> None:
    draw = Random(seed)
    cores = draw.choice((1, 2, 3))
    periods = draw.sample((4, 5, 6, 10, 12, 15, 20), 4)
    threads = []
    for _ in range(draw.randint(cores, 6)):
        period = draw.choice(periods)
        threads.append((period, draw.randint(1, max(1, min(period, 2 * cores)))))
    expected = any(
        all(is_in_time([item for item, there in zip(threads, chosen, strict=True) if there == core]) for core in chosen)
        for chosen in product(range(cores), repeat=len(threads))
    )
    uses = [{(0, cores, period, work): 1} for period, work in threads]
    assert admits(add_levels, uses) == expected
    assert admits(add_pools, uses) or not expected, "what is counted together loses nothing"


def admits(
    add: Callable[[cp_model.CpModel, Sequence[Mapping[Demand, Any]]], None], uses: list[dict[Demand, int]]
) -> bool:
    """Whether rows have a solution where each thread has its only demand."""
    model = cp_model.CpModel()
    add(model, uses)
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    return solver.solve(model) == cp_model.OPTIMAL


@pytest.mark.parametrize(("works", "expected"), [((10, 8, 9), True), ((10, 8, 12), True), ((10, 9, 12), False)])
def test_pools_of_one_core_say_what_its_rows_say(works: tuple[int, int, int], expected: bool) -> None:
    """Periods 20, 25 and 40, which do not divide each other: less than the whole core may be too much."""
    uses = [{(0, 1, period, work): 1} for period, work in zip((20, 25, 40), works, strict=True)]
    threads = list(zip((20, 25, 40), works, strict=True))
    assert is_in_time(threads) == admits(add_levels, uses) == admits(add_pools, uses)


def test_pools_refute_what_utilisation_does_not() -> None:
    """Four threads that use half a core each, no two of which are in time together, on two cores."""
    threads = [(40, 20), (50, 25), (60, 30), (70, 35)]
    assert not any(is_in_time(list(pair)) for pair in combinations(threads, 2))
    assert not admits(add_pools, [{(0, 2, period, work): 1} for period, work in threads])
    assert admits(add_pools, [{(0, 4, period, work): 1} for period, work in threads])


def test_a_region_is_refuted_by_pools_before_each_core_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """The least latency of the slowest type of eight threads on two cores."""
    evaluator = Evaluator(dse.loads(nearly_full(8, 2, 0.85, 3)).space)
    tables = build_tables(evaluator)
    [least] = [latency for price, latency in search_front(evaluator).points if price == 10_000]
    asked: list[object] = []

    def noted(*arguments: Any) -> None:
        asked.append(arguments)
        add_levels(*arguments)

    monkeypatch.setattr(reduced, "add_levels", noted)
    assert Reduction(tables).region([10_001, least], None).is_refuted(10.0, None)
    assert not asked


@pytest.mark.parametrize("load", [0.65, 0.85])
def test_nearly_full_cores_are_verified_and_regions_with_designs_are_not_refuted(load: float) -> None:
    problem = dse.loads(nearly_full(8, 2, load, 3))
    assert dse.verify(dse.solve(problem), problem=problem, method="model").status == "verified"
    evaluator = Evaluator(problem.space)
    tables = build_tables(evaluator)
    assert tables.levels is not None
    assert len(tables.levels.demands) == 8
    reduction = Reduction(tables)
    points = search_front(evaluator).points
    assert len(points) > 1
    for vector in points:
        region = reduction.region([value + 1 for value in vector], vector)
        assert not any(region.is_refuted(1.0, None) for _ in range(3)), "there is a design with these objectives"


def test_without_rows_of_cores_a_region_stays_open_that_they_refute() -> None:
    """The least latency of the cheapest type: utilisation alone leaves a step below it."""
    evaluator = Evaluator(dse.loads(nearly_full(8, 2, 0.85, 3)).space)
    tables = build_tables(evaluator)
    [least] = [latency for price, latency in search_front(evaluator).points if price == 10_000]
    assert Reduction(tables).region([10_001, least], None).is_refuted(10.0, None)
    assert not Reduction(replace(tables, levels=None)).region([10_001, least], None).is_refuted(10.0, None)
