"""A simulation with clocks and offsets, as a second witness: no observation leaves the bounds of the analysis."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

import dse
from tests.clocks import let
from tests.helpers.effort import cases


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


def slotted(offset: Any) -> dict[str, Any]:
    """A message that is handed over up to 1.2 ms after 0 ms, sent in a slot every 5 ms, and read at 4 ms of 10 ms."""
    return {
        "dse": 1, "name": "slots", "clocks": {"net": {}}, "processor_types": {"small": {}}, "offset_grid": "500 us",
        "bus_types": {"ethernet": {"bandwidth": "1 Mbit/s", "transmission_time": "from bandwidth"}},
        "processors": {name: {"type": "small", "clock": "net"} for name in ("one", "two")},
        "buses": {"backbone": {"type": "ethernet"}},
        "devices": {"slot": {"category": "bus", "period": "5 ms", "clock": "net", "offset": offset}},
        "threads": {
            "a": {"processor": "one", "period": "10 ms", "offset": "0 ms", "compute_execution_time": "1 ms .. 1200 us"},
            "b": {"processor": "two", "period": "10 ms", "offset": "4 ms"},
        },
        "connections": {
            "handed": {"from": "a", "to": "slot", "data_size": "16 B"},
            "sent": {"from": "slot", "to": "b", "data_size": "16 B", "bus": "backbone"},
        },
        "flows": {"f": {"path": ["a", "slot", "b"]}},
        "objectives": ["minimise exact latency of f"],
    }  # fmt: skip


def test_the_schedule_of_a_bus_is_that_of_the_slots_of_its_messages(tmp_path: Path) -> None:
    """Just missed at 1 ms, some wait until 6 and are read at 14; from 1.5 ms on all of it is read at 4."""
    [flow] = dse.simulate(slotted("1 ms"), runs=20, seed=1).flows
    assert flow.bounds_ns == (4_000_000, 14_000_000) and max(flow.latencies) == 14_000_000
    (tmp_path / "p.yaml").write_text(json.dumps(slotted("any")), encoding="utf-8")
    found = dse.solve(tmp_path / "p.yaml")
    assert [(point.decisions, point.objectives) for point in found.front] == [
        ({"slot.offset": "1.5 ms"}, {"exact latency of f": 4_000_000})
    ]
    assert dse.verify(found).status == "verified"
