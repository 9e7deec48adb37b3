"""Chains on one clock under logical execution time, against figures of the literature and an exact simulation."""

from __future__ import annotations

import random
from fractions import Fraction
from statistics import median
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency.exact_chains import ClockSegment, Hop, longest_and_shortest_ns
from dse.analysis.latency.sampling import Pair, wait_ns
from dse.analysis.views import View
from dse.answers.ranking.reasons import dominants
from tests.clocks import let
from tests.helpers.effort import cases

PUBLISHED = let.published()
LONGEST = "WATERS2019, LG->LOC->EKF->Planner->DASM"
"""The one published chain whose sum of pairs no datum reaches."""


def figures(data: dict[str, Any]) -> dict[str, Any]:
    """Every metric of the chain in the one design of its problem, in ms."""
    evaluator = Evaluator(dse.load(data).space)
    view = View([0] * len(evaluator.space.decisions))
    metrics = {item.metric.name: item.value(view) / 10**6 for item in evaluator.metrics}
    return {name.removesuffix(" of chain"): value for name, value in metrics.items() if name.endswith(" of chain")}


@pytest.mark.parametrize(("name", "chain"), PUBLISHED, ids=[name for name, _ in PUBLISHED])
def test_published_chains(name: str, chain: list[tuple[int, int, int]]) -> None:
    """The sum of pairs is the maximum reaction time in all of them but one: 910 against 908 ms."""
    found, exact = figures(let.problem(chain)), let.observed(chain)
    first = chain[0][1]
    assert found["exact latency"] == exact["longest"]
    assert found["min latency"] <= found["exact min latency"] == exact["shortest"]
    assert (found["reaction time"], exact["longest"] + first) == (
        (910, 908) if name == LONGEST else (exact["longest"] + first, exact["longest"] + first)
    )


def test_there_are_24_published_chains_up_to_72_percent_shorter_than_the_sum_of_periods() -> None:
    beyond = []
    for _, chain in PUBLISHED:
        asynchronous, bound = figures(let.problem(chain, known=False)), figures(let.problem(chain))
        assert asynchronous["reaction time"] == sum(period + deadline for _, period, deadline in chain)
        beyond.append(float(asynchronous["reaction time"] / bound["reaction time"] - 1))
    assert len(beyond) == 24
    assert (round(min(beyond), 2), round(median(beyond), 2), round(max(beyond), 2)) == (0.02, 0.41, 0.72)


@pytest.mark.parametrize("seed", cases(40))
def test_random_chains_are_never_beyond_their_bounds(seed: int) -> None:
    rng = random.Random(f"chain {seed}")
    chain = let.drawn(rng)
    found, exact = figures(let.problem(chain)), let.observed(chain)
    assert found["latency"] >= found["exact latency"] == exact["longest"]
    assert found["min latency"] <= found["exact min latency"] == exact["shortest"]
    assert found["data age"] >= exact["age"]
    assert found["run jitter"] == found["jitter"] and found["exact jitter"] == exact["longest"] - exact["shortest"]
    unknown = figures(let.problem(chain, known=False))
    assert unknown["jitter"] == sum(period for _, period, _ in chain[1:])
    assert unknown["run jitter"] == found["jitter"]  # no better and no worse constant offsets
    assert unknown["latency"] == unknown["exact latency"] >= found["latency"]


def test_the_chain_of_kloda_davare_and_durr() -> None:
    """(T, R) = (5, 1), (10, 3), (20, 8) ms: Davare's sum is 47 ms, Dürr's 43, the exact value of Kloda's 28."""
    data = let.problem([(0, 5, 5), (0, 10, 10), (0, 20, 20)], known=False)
    for name, time in {"t0": "1 ms", "t1": "2 ms", "t2": "4 ms"}.items():
        del data["threads"][name]["communication"]
        data["threads"][name]["compute_execution_time"] = time
    data |= {"processing": "response_time", "clocks": {"common": {}}}
    [responses] = dse.analyse(data, {}).responses.values()
    times = {item.name: (item.response_ns or 0) // 10**6 for item in responses}
    davare = figures(data)["reaction time"]
    # a reader of lower priority on the same core starts after what is released with it: its data are there at once
    assert (davare, davare - times["t0"] - times["t1"]) == (47, 43)
    waits = [wait_ns(Pair(5, 10, 0, 0), 0, 0)[1], wait_ns(Pair(10, 20, 0, 0), 0, 0)[1]]
    assert waits == [5, 10] and 5 + sum(waits) + times["t2"] == 28
    found = longest_and_shortest_ns(ClockSegment(5, 0, (Hop(10, 0, 0, 0), Hop(20, 0, 0, 0))))
    assert found is not None and found[1] == sum(waits)


def test_a_synchronisation_error_costs_on_both_sides() -> None:
    """3 ms later, with an error of 1 ms: from 3 + 1 - 2 to 3 - 1 + 2 ms; at a crossing up to the period."""
    assert wait_ns(Pair(10, 10, 3, 0), 0, 0) == (3, 3)
    assert wait_ns(Pair(10, 10, 3, 1), 0, 0) == (2, 4)
    assert wait_ns(Pair(10, 10, 0, 1), 0, 0) == (0, 10)
    two = let.problem([(0, 10, 10), (3, 10, 10)])
    two["processors"] = {"computer": {"type": "any", "clock": "k"}, "other": {"type": "any", "clock": "k"}}
    two["threads"]["t1"]["processor"] = "other"
    two["clocks"] = {"k": {"synchronisation_error": "1 ms"}}
    assert (figures(two)["min latency"], figures(two)["latency"]) == (22, 24)
    del two["processors"]["other"]["clock"]
    assert (figures(two)["min latency"], figures(two)["latency"], figures(two)["run jitter"]) == (20, 30, 10)


def test_jitter_may_vanish_whose_parts_do_not() -> None:
    """What comes sooner waits longer: no row is called contradictory, and the report names no part of nothing."""
    data = let.problem([(0, 20, 20), (5, 20, 20)]) | {"objectives": ["minimise jitter of chain"]}
    data["threads"]["t0"] |= {"communication": "implicit", "compute_execution_time": "1 ms .. 5 ms"}
    [row] = [row for row in dse.analyse(data, {}).flows[0].rows if row.max_method == "sampling on one clock"]
    assert (row.min_ns, row.max_ns) == (4_000_000, 0)
    assert dse.analyse(data, {}).warnings == ()
    assert [item.of for item in dominants(dse.analyse(data, {}))] == ["latency"]


def test_implicit_communication_pays_a_period_where_a_read_can_be_crossed() -> None:
    """T = 20 and 20 ms, response 1 to 5 ms: at offset 3 ms it is read after 3 or 23 ms, at 5 ms always after 5 ms."""
    data = let.problem([(0, 20, 20), (3, 20, 20)])
    for thread in data["threads"].values():
        del thread["communication"]
    data["threads"]["t0"]["compute_execution_time"] = "1 ms .. 5 ms"
    data["threads"]["t1"]["compute_execution_time"] = "0 ms"
    found = figures(data)
    assert (found["min latency"], found["latency"], found["exact latency"]) == (3, 23, 23)
    data["threads"]["t1"]["offset"] = "5 ms"
    found = figures(data)
    assert (found["min latency"], found["latency"], found["run jitter"]) == (5, 5, 0)
    data["threads"]["t1"]["offset"] = "unknown"
    found = figures(data)
    assert (found["min latency"], found["latency"], found["jitter"], found["run jitter"]) == (1, 25, 24, 20)


def test_awkward_periods_keep_the_bound() -> None:
    data = let.problem([(0, 20, 20), (0, 20, 20), (0, 20, 20)])
    data["threads"]["t1"] |= {"period": "33.333333 ms", "deadline": "33.333333 ms"}
    found = figures(data)
    assert found["exact latency"] == found["latency"] == Fraction(126_666_664, 10**6)
    said = [text for text in dse.analyse(data, {}).warnings if "repeats" in text]
    assert said == ["chain repeats only after more than 10,000 releases: its bound stands for its exact latency"]


def test_a_margin_says_how_far_a_time_may_grow_before_a_read_is_missed() -> None:
    """Released 5 ms later, what takes 1 to 3 ms is read in time up to 5 ms; beyond it waits a period more."""
    data = let.problem([(0, 20, 20), (5, 20, 20)]) | {"requirements": ["latency of chain <= 30 ms"]}
    data["threads"]["t0"] |= {"communication": "implicit", "compute_execution_time": "1 ms .. 3 ms"}
    margins = dse.sensitivity(data, {}).margins
    [found] = [item for item in margins if item.path == "threads.t0.compute_execution_time.max"]
    assert found.above is not None and found.above.last == 5_000_000
