"""``transmission_time: from bandwidth``: a message takes its size over the bandwidth, under the profile dse."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from tests.properties.pair import Pair
from tests.properties.test_against_oracle import figures_agree

NETWORK = """
dse: 1
name: network
bus_types:
  fast: {bandwidth: [100 Mbit/s, 1 Gbit/s], overhead: 66 B, latency: 5 us .. 7 us, transmission_time: from bandwidth}
  slow: {bandwidth: 115200 bit/s, transmission_time: {fixed: [1 us, 2 us], per_byte: 87 us}}
buses: {wire: {type: [fast, slow]}}
devices: {camera: {period: 40 ms}, screen: {}}
connections: {image: {from: camera, to: screen, data_size: 100 KB, bus: wire}}
flows: {f: {path: [camera, screen]}}
objectives: [minimise latency]
"""
AT_100M = 100_066 * 80
"""ns: 8 bits at 100 Mbit/s take 80 ns."""


def latency(text: str, *design: str, profile: str | None = None) -> tuple[Fraction, Fraction]:
    metrics = dse.analyse(dse.loads(text), design, profile=profile).metrics
    return metrics["min latency of f"], metrics["latency of f"]


def test_a_message_takes_its_size_over_the_bandwidth() -> None:
    """100 KB and 66 B over 100 Mbit/s take 8.00528 ms; the bus's latency does not count beside it."""
    assert latency(NETWORK, "wire.type = fast", "wire.bandwidth = 100 Mbit/s") == (AT_100M, AT_100M)
    assert latency(NETWORK, "wire.type = fast", "wire.bandwidth = 1 Gbit/s") == (AT_100M / 10, AT_100M / 10)
    assert (
        latency(NETWORK, "wire.type = slow", "wire.bandwidth = 115.2 kbit/s", "wire.transmission_time.fixed = 1 us")[1]
        == 1000 + 10**5 * 87_000
    )
    thirds = NETWORK.replace("1 Gbit/s", "115200 bit/s")
    exact = Fraction(100_066 * 8 * 10**9, 115_200)
    assert latency(thirds, "wire.type = fast", "wire.bandwidth = 115200 bit/s") == (exact, exact)


@pytest.mark.parametrize("profile", ["osate-2.2", "osate-2.19"])
def test_osate_knows_no_such_time(profile: str) -> None:
    fixed = ("wire.type = fast", "wire.bandwidth = 1 Gbit/s")
    table = dse.analyse(dse.loads(NETWORK), fixed, profile=profile).flows[0]
    assert [(row.min_ns, row.max_ns) for row in table.rows if row.category == "connection"] == [(5_000, 7_000)]


def test_the_bus_is_busy_for_as_long() -> None:
    found = dse.analyse(dse.loads(NETWORK), ["wire.type = fast", "wire.bandwidth = 100 Mbit/s"])
    (usage,) = found.buses
    assert usage.busy_total == Fraction(AT_100M * 25, 1000)
    assert usage.total * 8 / 100_000_000 == usage.busy_total / 10**6
    assert not found.warnings


def test_search_simulation_and_oracle_agree() -> None:
    problem = dse.loads(NETWORK)
    front = dse.solve(problem).front
    assert [point.objectives["latency of f"] for point in front] == [AT_100M // 10]
    assert dse.verify(dse.solve(problem), problem=problem).status == "verified"
    figures_agree(Pair(NETWORK))
    simulated = dse.simulate(problem, ["wire.type = fast", "wire.bandwidth = 1 Gbit/s"]).to_dict()["flows"]["f"]
    assert (simulated["min_ns"], simulated["max_ns"]) == (AT_100M // 10, AT_100M // 10)


def test_a_sweep_over_a_bandwidth_says_whether_it_moves_latencies() -> None:
    one = NETWORK.replace("[100 Mbit/s, 1 Gbit/s]", "100 Mbit/s").replace("[fast, slow]", "fast")
    moved = dse.sweep(dse.loads(one), "bus_types.fast.bandwidth=100Mbit/s,200Mbit/s")
    assert [run.front[0]["metrics"]["latency of f"] for run in moved.runs] == [AT_100M, AT_100M // 2]
    assert moved.remarks == ()
    still = one.replace("transmission_time: from bandwidth", "transmission_time: {per_byte: 80 ns}")
    (remark,) = dse.sweep(dse.loads(still), "bus_types.fast.bandwidth=100Mbit/s,200Mbit/s").remarks
    assert remark.startswith("bus_types.fast.bandwidth moves no latency")
    osate = dse.sweep(dse.loads(one), "bus_types.fast.bandwidth=100Mbit/s,200Mbit/s", profile="osate-2.2")
    assert osate.remarks == ("bus_types.fast.bandwidth moves no latency: under profile osate-2.2 none follows from it",)


def test_margins_and_robust_fronts_follow_the_bandwidth() -> None:
    """A latency of at most 10 ms holds down to 80.0528 Mbit/s: 100 066 B * 8 / 10 ms."""
    one = NETWORK.replace("[100 Mbit/s, 1 Gbit/s]", "100 Mbit/s").replace("[fast, slow]", "fast")
    asked = one + "requirements: [latency of f <= 10 ms]\n"
    (margin,) = [
        item for item in dse.sensitivity(dse.loads(asked), []).margins if item.path == "bus_types.fast.bandwidth"
    ]
    assert margin.below is not None and margin.below.last == 100_066 * 8 * 100
    stated = "uncertainty: {bus_types.fast.bandwidth: {range: LOW .. 100 Mbit/s}}\n"
    for low, status in (("80.0528 Mbit/s", "complete"), ("80.0527 Mbit/s", "infeasible")):
        study = dse.solve_robust(dse.loads(asked + stated.replace("LOW", low)))
        assert study.robust.status == status
