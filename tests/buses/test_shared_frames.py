"""Messages that carry the data of several connections: sizes, loads, deadlines, decisions and mistakes."""

from __future__ import annotations

import re

import pytest

import dse
from dse.report.words.contention import bus_words
from dse.support.errors import ProblemError

MOTOR = """
dse: 1
name: what a motor says
bus_types: {can: {bandwidth: 500 kbit/s, frame: can, price: 1 EUR}}
buses: {can0: {type: can}}
devices: {motor: {period: 5 ms}, other: {period: 5 ms}, drive: {}}
connections:
  status: {from: motor, to: drive, port: data, data_size: 4 B, bus: can0, identifier: 0x20}
  current: {from: motor, to: drive, port: data, data_size: 2 B, carried_in: status, deadline: 5 ms}
  warmth: {from: motor, to: drive, port: data, data_size: 2 B, carried_in: WAYS}
  urgent: {from: other, to: drive, port: data, data_size: 8 B, bus: can0, identifier: 0x10}
flows: {heat: {path: [motor, warmth, drive]}}
objectives: [minimise load of can0, minimise latency of heat]
"""
ALWAYS = MOTOR.replace("WAYS", "status")
OPEN = MOTOR.replace("WAYS", "[status, alone], bus: can0, identifier: [0x8, 0x30]")


def test_one_message_has_the_data_of_all() -> None:
    """8 bytes: 270 us behind another 270 us; two messages of 270 us every 5 ms are 10.8 % of the time."""
    found = dse.analyse(dse.loads(ALWAYS))
    assert [(item.name, item.response_ns) for item in found.messages["can0"]] == [
        ("urgent", 540_000),
        ("status", 540_000),
    ]
    assert found.metrics["latency of heat"] == 540_000
    assert found.metrics["busy of can0"] == 108_000
    assert found.metrics["load of can0"] == 2 * 135 * 25
    assert not dse.simulate(dse.loads(ALWAYS), runs=3).contradictions


def test_the_least_deadline_of_a_frame_counts_where_its_identifier_is_chosen() -> None:
    text = ALWAYS.replace("0x20", "any").replace("0x10", "any, deadline: 6 ms")
    assert [item.name for item in dse.analyse(dse.loads(text)).messages["can0"]] == ["status", "urgent"]
    text = text.replace("deadline: 5 ms", "deadline: 7 ms").replace("flows: {heat: {path: [motor, warmth, drive]}}", "")
    text = text.replace(", minimise latency of heat", "")
    assert [item.name for item in dse.analyse(dse.loads(text)).messages["can0"]] == ["urgent", "status"]


def test_whether_data_share_a_frame_is_a_decision() -> None:
    """With a message of its own it may go before all others, and costs the bus another frame."""
    result = dse.solve(dse.loads(OPEN))
    chosen = {tuple(point.decisions.items()): tuple(point.objectives.values()) for point in result.front}
    assert chosen == {
        (("warmth.carried_in", "status"),): (6750, 540_000),
        (("warmth.identifier", "0x8"), ("warmth.carried_in", "alone")): (8125, 420_000),
    }
    assert not dse.verify(result).findings


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (("carried_in: status,", "carried_in: state,"), 'unknown connection "state"'),
        (("carried_in: status,", "carried_in: urgent,"), '"urgent" is sent by "other": a frame has one sender'),
        (("carried_in: status,", "carried_in: warmth,"), '"warmth" is carried itself, in "status"'),
        (("carried_in: status,", "carried_in: status, identifier: 1,"), 'the frame has the identifier of "status"'),
        (("carried_in: status,", "carried_in: status, rate: 1 Hz,"), 'the frame has the rate of "status"'),
        (("carried_in: status,", "carried_in: status, from_port: o,"), '"current" has a `from_port`: it shares no'),
        (
            ("carried_in: status,", "carried_in: [status, alone], rate: 1 Hz,"),
            "all of them state a `rate`, or none does",
        ),
        (("carried_in: status,", "carried_in: status, bus: can1,"), "all of a frame is on one bus"),
        (("data_size: 4 B, bus", "data_size: 5 B, bus"), 'the frame of "status" has 9 B, at most 8 B fit'),
        (("dse: 1", "dse: 1\nprofile: osate-2.19"), "knows no frames of several connections"),
    ],
)
def test_mistakes(edit: tuple[str, str], said: str) -> None:
    assert edit[0] in ALWAYS
    text = ALWAYS.replace(*edit)
    with pytest.raises(ProblemError, match=said):
        dse.loads(text)


def test_an_open_frame_that_is_too_long_is_no_design() -> None:
    text = OPEN.replace("data_size: 4 B", "data_size: 6 B")
    result = dse.solve(dse.loads(text))
    assert {point.decisions["warmth.carried_in"] for point in result.front} == {"alone"}


def test_a_frame_is_one_message_of_a_database() -> None:
    text = ALWAYS.replace("minimise load of can0, minimise latency of heat", "minimise price")
    written = dse.export(dse.solve(dse.loads(text)), 1, form="dbc")
    assert re.findall(r"^BO_ (\d+) (\w+): (\d+)", written, re.MULTILINE) == [
        ("32", "status", "8"),
        ("16", "urgent", "8"),
    ]


def test_a_frame_of_two_senders_is_one_mistake() -> None:
    """The identifier that it would have from its carrier is not asked about."""
    with pytest.raises(ProblemError) as error:
        dse.loads(ALWAYS.replace("current: {from: motor", "current: {from: other"))
    assert str(error.value).count("connections.") == 1 and 'sent by "motor": a frame has one sender' in str(error.value)


def test_what_is_missing_is_missing_of_the_carrier() -> None:
    text = ALWAYS.replace(", identifier: 0x20", "")
    assert "no `identifier` of status)" in bus_words(dse.loads(text).space)
