"""Rows of cores in the second proof, against every partition of drawn threads and response times by iteration."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from random import Random

import pytest
from benchmarks.cases import nearly_full
from effort import cases
from ortools.sat.python import cp_model

import dse
from dse.analysis.evaluate import Evaluator
from dse.pareto.front import search_front
from dse.verification.levels import add_levels
from dse.verification.reduced import Reduction
from dse.verification.tables import build_tables

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
    model = cp_model.CpModel()
    add_levels(model, [{(0, cores, period, work): 1} for period, work in threads])
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    assert (solver.solve(model) == cp_model.OPTIMAL) == expected


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
