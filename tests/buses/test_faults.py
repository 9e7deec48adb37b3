"""Faults of a CAN wire: played bit by bit, in problems, in the search, and what is said of them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from random import Random

import pytest

import dse
from dse.analysis.diagnosis.front_verdicts import waiting_counted
from dse.analysis.scheduling.busy_window import load
from dse.analysis.scheduling.policies.buses import Arbitrated
from dse.analysis.scheduling.policies.faults import ERROR_BITS, faults_of_wire, with_frame
from dse.report.words.contention import arbitration_words
from dse.report.words.messages import late_message_words, message_tables
from dse.support.errors import ProblemError
from tests.buses.test_identifiers import robot
from tests.buses.test_messages import SYNC
from tests.buses.test_policies import windows_of
from tests.helpers.arbitration import BIT, Message, by_identifier, draw_bus, drawn, with_all_at_once
from tests.helpers.effort import cases

FAULTY = SYNC.replace("frame: can,", "frame: can, fault_interval: 10 ms, fault_burst: 2,")


def faulty(messages: Sequence[Message], interval: int, burst: int) -> list[Arbitrated]:
    """The windows of messages on a wire with faults, in bits."""
    faults = faults_of_wire(interval, burst, 1)
    return [
        replace(window, faults=with_frame(faults, max(item.bits for item in messages[: place + 1])))
        for place, window in enumerate(windows_of(list(messages)))
    ]


@pytest.mark.parametrize("seed", cases(60))
def test_no_message_is_later_than_its_bound(seed: int) -> None:
    """As many faults as the burst, and one more with each interval, hit whatever frame is on the wire."""
    rng = Random(seed)
    messages = draw_bus(rng, load=0.6)
    interval, burst = rng.choice((500, 2000, 10_000)), rng.randint(1, 3)
    left: list[Fraction] = [Fraction(burst), Fraction(0)]
    share = rng.random()

    def hits(_: int, end: Fraction) -> bool:
        left[0] = min(Fraction(burst), left[0] + (end - left[1]) / interval)
        left[1] = end
        is_hit = left[0] >= 1 and rng.random() < share
        left[0] -= is_hit
        return is_hit

    seen = drawn(messages, by_identifier, rng, 12, hits=hits)
    for message, window in zip(messages, faulty(messages, interval, burst), strict=True):
        bound, parts = window.response_ns(), window.parts()
        if bound is not None:
            assert parts is not None
            assert seen[message.place] <= bound == parts.waited_ns + message.bits


@pytest.mark.parametrize("seed", cases(60))
def test_a_burst_on_the_longest_frame_reaches_the_bound(seed: int) -> None:
    rng = Random(seed)
    messages = draw_bus(rng, load=0.6, late=False)
    burst = rng.randint(1, 3)
    for message, window in zip(messages, faulty(messages, 10**7, burst), strict=True):
        before = messages[: message.place + 1]
        longest = max(before, key=lambda item: item.bits)
        left = [burst]

        def hits(place: int, _: Fraction, longest: int = longest.place, left: list[int] = left) -> bool:
            left[0] -= place == longest
            return place == longest and left[0] >= 0

        job = window.worst_job()
        assert job is not None
        jobs = int(job[1] // min(item.period for item in before)) + 5
        bound = window.response_ns()
        assert bound is not None
        seen = with_all_at_once(messages, message.place, jobs, hits)
        assert seen <= bound
        assert bound - seen <= 1 - BIT or job[0]  # a later job than that of the burst


def test_each_fault_costs_an_error_frame_and_the_longest_frame_that_may_be_hit() -> None:
    """At 1 Mbit/s a bit is 1 us: SYNC of 55 us, behind 135 us; the other message has both frames to fear for."""
    found = dse.analyse(dse.loads(FAULTY))
    sync, pdo = found.messages["can0"]
    assert (sync.faults, sync.faults_ns) == (2, 2 * (ERROR_BITS + 55) * 1000)
    assert sync.response_ns == (55 + 135) * 1000 + sync.faults_ns
    assert (pdo.faults, pdo.faults_ns) == (2, 2 * (ERROR_BITS + 135) * 1000)
    assert pdo.response_ns == (55 + 135) * 1000 + pdo.faults_ns
    assert arbitration_words(found.space) == "Waiting for can0 (by identifier, with faults of the wire) is counted."
    assert waiting_counted(found.space) == {"counted": ["can0"], "not_counted": [], "faults": ["can0"]}
    written = json.loads(found.to_json())["messages"]["can0"][0]
    assert (written["faults"], written["faults_ns"]) == (2, 172_000)


def test_faults_in_any_window_follow_the_interval() -> None:
    """A fault of 31 + 75 bits each 100, 200 and 150 bits, on a message of 75 bits alone on its wire."""
    faults = faults_of_wire(100, 1, 1)
    slow = Message(0, 75, 1000)
    (window,) = (replace(item, faults=with_frame(faults, 75)) for item in windows_of([slow]))
    assert window.response_ns() is None  # 106 bits each 100: nothing is ever sent
    assert round(float(load(window.demand)), 3) == 1.135
    (window,) = (replace(item, faults=with_frame(faults_of_wire(200, 1, 1), 75)) for item in windows_of([slow]))
    assert window.response_ns() == 75 + 106
    (window,) = (replace(item, faults=with_frame(faults_of_wire(150, 1, 1), 75)) for item in windows_of([slow]))
    assert window.response_ns() == 75 + 2 * 106


def test_the_interval_is_a_decision_and_is_varied() -> None:
    text = FAULTY.replace("fault_interval: 10 ms", "fault_interval: [10 ms, 0.25 ms]").replace(
        "identifier: 0x80", "identifier: 0x80, deadline: 0.4 ms"
    )
    text += "objectives: [minimise latency of sync_flow]\n"
    result = dse.solve(dse.loads(text))
    assert [point.decisions["can0.fault_interval"] for point in result.front] == ["10 ms"]
    assert not dse.verify(result).findings
    late = dse.explain(dse.loads(text.replace("[10 ms, 0.25 ms]", "0.25 ms")))
    (message,) = late.conflicts[0].members[0][1].late_messages
    assert "3 faults (0.258 ms)" in late_message_words(message)
    margins = dse.sensitivity(dse.loads(text.replace("[10 ms, 0.25 ms]", "10 ms"))).margins
    assert "bus_types.can_1m.fault_interval" in {item.path for item in margins}
    chosen = dse.loads(dse.export(result, 1))
    assert dse.analyse(chosen).messages["can0"][0].faults == 2


def test_faults_where_a_flow_has_two_of_40_messages() -> None:
    """How long either waits for faults at least is known before an order is looked at."""
    text = robot(40).replace("frame: can,", "frame: can, fault_interval: 10 ms, fault_burst: 2,")
    text = text.replace("from: d37, to: sink", "from: d37, to: d38")
    flow = "flows: {f: {path: [d37, m37, d38, m38, sink]}}\nobjectives: "
    text = text.replace("objectives: [minimise price, ", flow + "[minimise price, minimise jitter of f, ")
    found = dse.solve(text, processing="execution_time")
    assert found.status == "complete"
    least = {tuple(point.objectives.values()) for point in found.front}
    assert len(least) == 14
    assert {(600, 117_602_000, 0), (600, 109_612_000, 1), (600, 107_092_000, 13)} <= least
    assert not dse.verify(found).findings


def test_what_makes_a_message_unbounded_is_said() -> None:
    found = dse.analyse(dse.loads(FAULTY.replace("10 ms", "0.1 ms")))
    (table,) = message_tables(found.messages)
    assert table.rows[1][-1] == "no bound, for it and what goes first, with faults, need 174.2 % of the bus"


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        ([("fault_interval: 10 ms, ", "")], "needs a `fault_interval`"),
        ([("frame: can,", "frame: serial, arbitration: fifo,")], "only CAN repeats a frame after a fault"),
        ([("frame: can,", "frame: can, arbitration: fifo,")], "not with `fifo`"),
        ([("10 ms", "0 ms")], "must be above zero"),
    ],
)
def test_mistakes(edits: list[tuple[str, str]], message: str) -> None:
    text = FAULTY
    for edit in edits:
        assert edit[0] in text
        text = text.replace(*edit)
    with pytest.raises(ProblemError, match=message):
        dse.loads(text)
