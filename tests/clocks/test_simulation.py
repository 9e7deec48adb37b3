"""A simulation with clocks and offsets, as a second witness: no observation leaves the bounds of the analysis."""

from __future__ import annotations

import random
from typing import Any

import pytest

import dse
from tests.clocks import let
from tests.effort import cases


def mixed(rng: random.Random) -> dict[str, Any]:
    """A random chain on two computers, some of it implicit, some offsets unknown, on one clock or two."""
    data = let.problem(let.drawn(rng))
    for thread in data["threads"].values():
        if rng.random() < 0.4:
            del thread["communication"]
            most = rng.randint(0, int(thread["period"].split()[0]) * 500)
            thread["compute_execution_time"] = f"{rng.randint(0, most)} us .. {most} us"
        if rng.random() < 0.15:
            thread["offset"] = "unknown"
        thread["processor"] = rng.choice(["computer", "computer", "other"])
    shared = {"clock": "common"} if rng.random() < 0.6 else {}
    data["processors"] = {"computer": {"type": "any", "clock": "common"}, "other": {"type": "any", **shared}}
    return data | {"clocks": {"common": {}}, "overload": "allowed"}


@pytest.mark.parametrize("seed", cases(12))
def test_no_observation_leaves_the_bounds(seed: int) -> None:
    rng = random.Random(f"mixed {seed}")
    data = mixed(rng)
    drift = rng.choice([0, 300])
    found = dse.simulate(data, runs=6, contention=False, offsets="worst", seed=seed, drift_ppm=drift)
    assert not found.contradictions, (data, found.contradictions)
    assert all(not flow.excuse for flow in found.flows)


def test_known_offsets_are_kept_and_unknown_ones_searched() -> None:
    data = let.problem([(0, 20, 20), (3, 20, 5)])
    [flow] = dse.simulate(data, runs=8, seed=1).flows
    assert set(flow.latencies) == {28_000_000} and flow.bounds_ns == (28_000_000, 28_000_000)
    [flow] = dse.simulate(data, runs=1, offsets="zero").flows
    assert set(flow.latencies) == {28_000_000}
    data["threads"]["t1"]["offset"] = "unknown"
    [flow] = dse.simulate(data, runs=8, seed=1).flows
    assert flow.bounds_ns == (25_000_000, 45_000_000) and max(flow.latencies) > 44_990_000


def test_what_ends_after_its_deadline_is_told() -> None:
    data = let.problem([(0, 20, 2), (3, 20, 5)])
    data["threads"]["t0"]["compute_execution_time"] = "4 ms"
    [flow] = dse.simulate(data, runs=2).flows
    assert flow.excuse == "t0 may end after its deadline, at which its data pass"


@pytest.mark.parametrize("seed", cases(10))
def test_no_crossing_of_response_times_leaves_the_bounds(seed: int) -> None:
    """Implicit communication on one core, with response times and contention: who is met and who is missed."""
    rng = random.Random(f"contended {seed}")
    data = let.problem(let.drawn(rng))
    for thread in data["threads"].values():
        if rng.random() < 0.7:
            del thread["communication"]
        most = rng.randint(1, max(1, int(thread["period"].split()[0]) * 500 // len(data["threads"])))
        thread["compute_execution_time"] = f"{rng.randint(0, most)} us .. {most} us"
        if rng.random() < 0.15:
            thread["offset"] = "unknown"
    data |= {"clocks": {"k": {}}, "processing": "response_time", "deadlines": "none"}
    found = dse.simulate(data, runs=6, contention=True, offsets="worst", seed=seed)
    assert not found.contradictions, (data, found.contradictions)
