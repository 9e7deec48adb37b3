"""What threads of one processor send each other is on no bus: by default over physical ones, or where `local` says it.

The figures are by hand: 100 B over 10 kbit/s take 80 ms; the middleware takes 5 ms.
"""

from __future__ import annotations

from typing import Any

import pytest
import yaml

import dse

TEXT = """
dse: 1
name: local or lan
processor_types: {a: {cores: 2, price: 10 EUR}, b: {cores: 2, price: 10 EUR}}
bus_types:
  slow: {bandwidth: 10 kbit/s, transmission_time: from bandwidth}
  fast: {bandwidth: 100 kbit/s, transmission_time: from bandwidth}
  dds: {virtual: true, transmission_time: {fixed: 5 ms}}
processors: {p: {type: a}, q: {type: b}}
buses: {lan: {type: slow}, wan: {type: fast}, ros: {type: dds, bus: lan}}
devices: {s: {period: 100 ms}}
threads:
  x: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  y: {processor: [p, q], dispatch_protocol: aperiodic, compute_execution_time: {a: 2 ms, b: 1 ms}}
connections:
  in: {from: s, to: x}
  m: {from: x, to: y, data_size: 100 B, bus: BUS}
flows: {f: {path: [s, x, y]}}
objectives: [minimise latency of f, minimise load of lan]
processing: execution_time
"""
MS = 10**6
FIGURES = {
    "lan": (3, 82),
    "[local, lan]": (3, 82),
    "dds": (8, 7),  # a virtual bus may be what carries it within the processor
    "[local, dds]": (3, 7),
    "ros": (88, 87),
    "[local, ros]": (3, 87),
}
"""The latency in ms with both threads on p, and with one on q."""


def problem(bus: str, **changes: Any) -> dse.Problem:
    data = yaml.safe_load(TEXT.replace("BUS", bus))
    data["connections"]["m"] |= changes
    return dse.load(data)


@pytest.mark.parametrize("bus", FIGURES)
def test_the_figures_by_hand(bus: str) -> None:
    for place, expected in zip(("p", "q"), FIGURES[bus], strict=True):
        found = dse.analyse(problem(bus), {"y.processor": place})
        [flow] = found.flows
        assert flow.max_ns == expected * MS
        loads = {item.name: item.total for item in found.buses}
        is_carried = "lan" in bus or "ros" in bus
        assert loads["lan"] == (1000 if is_carried and (place == "q" or expected > 80) else 0)


@pytest.mark.parametrize("bus", ["[lan, wan]", "[local, lan, wan]", "[wan, local, lan]", "[local, dds, lan]"])
def test_the_bus_is_no_decision_on_one_processor(bus: str) -> None:
    """One design with both on p, and one for each bus with one on q; the second proof and exhaustion agree."""
    result = dse.solve(problem(bus))
    assert [point.decisions for point in result.front] == [{"y.processor": "p"}]
    checked = dse.verify(result)
    assert not checked.findings and all("is not there" in text for text in checked.left_open)
    assert "every design looked at: 3 that are possible, 3 of them feasible" in checked.checked[-1]
    if "dds" in bus:
        assert not dse.verify(result, method="model").findings
    asked = dse.solve(problem(bus).ask(fix="y.processor = q"))
    assert asked.front and all("m.bus" in point.decisions for point in asked.front)


def test_devices_other_ends_and_processes_are_as_they_were() -> None:
    data = yaml.safe_load(TEXT.replace("BUS", "lan"))
    data["connections"]["in"] |= {"data_size": "100 B", "bus": "lan"}
    assert dse.analyse(dse.load(data), {"y.processor": "p"}).buses[0].total == 1000
    data["threads"]["x"]["process"] = "box"
    data["threads"]["y"]["process"] = "box"
    data["connections"]["in"] = {"from": "s", "to": "x"}
    found = dse.analyse(dse.load(data), {"y.processor": "p"})
    assert found.buses[0].total == 0 and found.flows[0].max_ns == 3 * MS


def test_its_own_latency_counts_on_one_processor() -> None:
    """Within a process it does not."""
    asked = problem("lan", latency="1 ms .. 4 ms")
    latencies = [dse.analyse(asked, {"y.processor": place}).flows[0].max_ns for place in ("p", "q")]
    assert latencies == [7 * MS, 82 * MS]


def test_osate_takes_the_bus_that_is_bound() -> None:
    data = yaml.safe_load(TEXT.replace("BUS", "lan"))
    found = dse.analyse(dse.load(data | {"profile": "osate-2.19"}), {"y.processor": "p"})
    assert found.buses[0].total == 1000


def test_a_bus_may_be_called_local() -> None:
    data = yaml.safe_load(TEXT.replace("BUS", "[local, lan]"))
    data["buses"]["local"] = {"type": "fast"}
    result = dse.solve(dse.load(data).ask(fix="y.processor = q"))
    assert {point.decisions["m.bus"] for point in result.front} == {"local"}
