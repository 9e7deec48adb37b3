"""Busy time of a bus: the longest transmission times of its messages, and what contradicts its load."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.support.errors import ProblemError

CAN = """
dse: 1
name: busy
bus_types:
  can_250k: {exclusive: true, bandwidth: 250 kbit/s, transmission_time: {fixed: 128 us, per_byte: 32 us .. 44 us}}
  can_500k: {exclusive: true, bandwidth: 500 kbit/s, transmission_time: {fixed: 64 us, per_byte: 16 us .. 22 us}}
  stack: {virtual: true, overhead: 4 B, latency: 1 us}
buses: {can0: {type: [can_250k, can_500k]}, net: {type: stack, bus: can0}}
devices: {sensor: {period: [400 us, 800 us]}, valve: {}}
connections:
  command: {from: sensor, to: valve, data_size: 8 B, bus: can0}
flows: {f: {path: [sensor, valve]}}
objectives: [minimise busy, minimise latency]
"""
PPM = 10**6


def busy(text: str, *design: str) -> Fraction:
    """The busy time of can0 as a share of the time."""
    return dse.analyse(dse.loads(text), design).metrics["busy of can0"] / PPM


def test_frames_of_eight_bytes_every_400_us() -> None:
    """128 us + 8 * 44 us = 480 us of 400 us, although 8 B every 400 us are 64 % of 31 250 B/s."""
    found = dse.analyse(dse.loads(CAN), ["can0.type = can_250k", "sensor.period = 400 us"])
    assert found.metrics["busy of can0"] == 1_200_000
    assert found.metrics["load of can0"] == 20_000
    (usage, *_) = found.buses
    assert usage.capacity is not None
    assert usage.total / usage.capacity == Fraction(64, 100)
    assert (usage.busy, usage.busy_total) == ({"command": 1_200_000}, 1_200_000)
    assert found.to_dict()["buses"]["can0"]["busy"] == {
        "unit": "ppm", "shares": {"command": 1_200_000}, "total": 1_200_000,
    }  # fmt: skip
    assert [text.split(":")[0] for text in found.warnings] == [
        "can0 is busy for 120 % of the time, although its load is 64 % of the bandwidth"
    ]


def test_it_is_longest_time_times_rate() -> None:
    assert busy(CAN, "can0.type = can_500k", "sensor.period = 400 us") == Fraction(240, 400)
    assert busy(CAN, "can0.type = can_250k", "sensor.period = 800 us") == Fraction(480, 800)
    stacked = CAN.replace("8 B, bus: can0", "8 B, bus: net")  # 4 B of overhead on the wire
    assert busy(stacked, "can0.type = can_500k", "sensor.period = 400 us") == Fraction(64 + 12 * 22, 400)
    stated = CAN.replace("8 B, bus: can0", "8 B, data_rate: 4 KB/s, bus: can0")  # 500 messages a second
    assert busy(stated, "can0.type = can_250k", "sensor.period = 400 us") == Fraction(480 * 500, PPM)
    empty = CAN.replace("can_500k]}", "can_500k], optional: true}").replace(", bus: can0}\nflows", "}\nflows")
    without_net = empty.replace(", net: {type: stack, bus: can0}", "")
    assert busy(without_net, "can0.type = none", "sensor.period = 400 us") == 0


def test_the_search_limits_and_minimises_it() -> None:
    front = dse.solve(dse.loads(CAN), max_busy="100 %").front
    assert [(point.objectives["busy of can0"], point.decisions["sensor.period"]) for point in front] == [
        (300_000, "800 us")
    ]
    assert dse.solve(dse.loads(CAN), max_busy="can0=29.9 %").status == "infeasible"
    both = dse.solve(dse.loads(CAN), require=["busy of can0 >= 119 %"], overload="allowed")
    assert [point.objectives["busy of can0"] for point in both.front] == [1_200_000]
    assert dse.verify(both, problem=dse.loads(CAN)).status == "verified"


@pytest.mark.parametrize(
    ("before", "after", "reason"),
    [
        ("data_size: 8 B", "data_rate: 4 KB/s", '"command" states a data rate, but no message size'),
        (
            "bandwidth: 500 kbit/s, transmission_time: {fixed: 64 us, per_byte: 16 us .. 22 us}",
            "bandwidth: 500 kbit/s",
            'its type "can_500k" states no transmission time',
        ),
    ],
)
def test_not_computable(before: str, after: str, reason: str) -> None:
    text = CAN.replace(before, after).replace("[minimise busy, ", "[").replace("f: {path: [sensor, valve]}", "")
    text = text.replace("minimise latency", "minimise price")
    found = dse.analyse(dse.loads(text), ["can0.type = can_250k", "sensor.period = 400 us"])
    assert "busy of can0" not in found.metrics
    assert found.to_dict()["buses"]["can0"]["busy"] == {"total": None, "reason": f"is not computable: {reason}"}
    with pytest.raises(ProblemError, match="is not computable"):
        dse.loads(text.replace("minimise price", "minimise busy of can0"))


def test_check_remarks_what_the_load_does_not_say() -> None:
    remarks = "\n".join(dse.check(dse.loads(CAN)).remarks)
    assert (
        "can0 may be busier than its load says: command (8 B) takes up to 480 us, at 250 kbit/s it would be 256 us; "
        "`busy of can0` counts the time"
    ) in remarks
    assert "whatever the design" not in remarks
    always = CAN.replace("[400 us, 800 us]", "200 us")
    assert "can0 is busy for at least 120 % of the time, whatever the design" in dse.check(dse.loads(always)).remarks
    rate = CAN.replace("  command:", "  more: {from: sensor, data_rate: 1 KB/s, bus: can0}\n  command:")
    (remark,) = [text for text in dse.check(dse.loads(rate.replace("minimise busy, ", ""))).remarks if "busier" in text]
    assert remark.endswith('its busy time is not computable: "more" states a data rate, but no message size')


def test_a_bus_with_a_bandwidth_alone_takes_no_time() -> None:
    text = CAN.replace("500 kbit/s, transmission_time: {fixed: 64 us, per_byte: 16 us .. 22 us}", "100 Mbit/s")
    text = text.replace("minimise busy, ", "")
    said = (
        "transfers over can0 take no time: its type can_500k states a bandwidth, but no transmission time "
        "(`transmission_time: from bandwidth` asks for size / bandwidth)"
    )
    assert said in dse.check(dse.loads(text)).remarks
    chosen = dse.analyse(dse.loads(text), ["can0.type = can_500k", "sensor.period = 400 us"])
    assert said in chosen.warnings
    other = dse.analyse(dse.loads(text), ["can0.type = can_250k", "sensor.period = 400 us"])
    assert said not in other.warnings
    evaluator = Evaluator(dse.loads(text).space)
    assert "busy of can0" not in [measure.metric.name for measure in evaluator.metrics]
