"""Senders that queue messages as they come: by hand, and buses played bit by bit."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

import dse
from dse.analysis.scheduling.busy_window import Stream, Task
from dse.analysis.scheduling.model import NO_PROCESSOR, Entry, Resource, Wire
from dse.analysis.scheduling.policies.buses import window_of
from tests.helpers.arbitration import Message, draw_bus, drawn
from tests.helpers.effort import cases

GATEWAY = """
dse: 1
name: a controller that queues as messages come
processor_types: {small: {transmit_queue: fifo, price: 1 EUR}, large: {price: 9 EUR}}
bus_types: {can: {bandwidth: 500 kbit/s, frame: can}}
processors: {p: {type: [small, large]}}
buses: {can0: {type: can}}
devices: {radar: {period: 1 ms}, sink: {}}
threads:
  brake: {processor: p, period: 5 ms}
  log: {processor: p, period: 100 ms}
connections:
  stop: {from: brake, to: sink, data_size: 8 B, bus: can0, identifier: 0x10}
  near: {from: radar, to: sink, data_size: 8 B, bus: can0, identifier: 0x20}
  text: {from: log, to: sink, data_size: 8 B, bus: can0, identifier: 0x30}
requirements: ["response time of stop <= 540 us"]
objectives: [minimise price]
"""


def resource_of(messages: list[Message]) -> Resource:
    """A bus on which senders 0 and 1 queue messages as they come; others by identifier."""
    lines = []
    for message in messages:
        alike = tuple(item.place for item in messages if item.sender == message.sender)
        lines.append(alike if message.sender < 2 and len(alike) > 1 else ())
    entries = []
    for message in messages:
        last = lines[message.place][-1] if lines[message.place] else message.place
        blocked = max((item.bits for item in messages[last + 1 :]), default=0)
        rivals = tuple(place for place in range(last + 1) if place != message.place)
        entries.append(Entry((message.place, "message"), message.place, rivals, (), blocked))
    frames = tuple(item.bits for item in messages)
    return Resource(
        NO_PROCESSOR, 0, tuple(entries), wire=Wire("priority", 1, frames, ((),) * len(frames), frames, tuple(lines))
    )


@pytest.mark.parametrize("seed", cases(200))
def test_queues_bit_by_bit(seed: int) -> None:
    """Nothing that is drawn is above the bound, and the bound is what its parts add up to."""
    rng = Random(seed)
    messages = draw_bus(rng, load=rng.choice((0.6, 0.8)))
    resource = resource_of(messages)
    wire = resource.wire
    assert wire is not None
    tasks = [Task(str(item.place), item.bits, (Stream(item.period, item.jitter),)) for item in messages]

    def oldest(_: Fraction, waiting: list[tuple[Fraction, int, int]]) -> tuple[Fraction, int, int]:
        """The most urgent of those that compete: of a queue the oldest."""
        first = {line: min(job for job in waiting if job[1] in line) for *_, line in competing(waiting) if line}
        may = [job for job, line in competing(waiting) if not line or first[line] == job]
        return min(may, key=lambda job: (job[1], job[2]))

    def competing(
        waiting: list[tuple[Fraction, int, int]],
    ) -> list[tuple[tuple[Fraction, int, int], tuple[int, ...]]]:
        return [(job, wire.lines[job[1]]) for job in waiting]

    seen = drawn(messages, oldest, rng, 12)
    for message in messages:
        window = window_of(resource, message.place, tasks)
        bound = None if window is None else window.response_ns()
        parts = None if window is None else window.parts()
        if bound is not None:
            assert parts is not None
            assert seen[message.place] <= bound == parts.waited_ns + message.bits


def test_an_urgent_message_waits_behind_an_old_one() -> None:
    """270 us each: in the queue `stop` waits for `text`, which lets `near` go first; else one frame has begun."""
    found = {}
    for kind in ("small", "large"):
        messages = dse.analyse(dse.loads(GATEWAY), {"p.type": kind}).messages["can0"]
        found[kind] = {item.name: item.response_ns for item in messages}
    assert found["large"] == {"stop": 540_000, "near": 810_000, "text": 810_000}
    assert found["small"] == {"stop": 810_000, "near": 810_000, "text": 810_000}


def test_the_queue_decides_which_computer_will_do() -> None:
    result = dse.solve(dse.loads(GATEWAY))
    (point,) = result.front
    assert point.objectives["price"] == 900
    assert not dse.verify(result).findings
    assert not dse.simulate(dse.loads(GATEWAY.replace("[small, large]", "small")), runs=3).contradictions


def test_a_thread_states_another_queue_than_its_processor() -> None:
    """`log` sends by identifier: `stop` is alone in its queue."""
    text = GATEWAY.replace("[small, large]", "small").replace("100 ms}", "100 ms, transmit_queue: priority}")
    found = dse.analyse(dse.loads(text)).messages["can0"]
    assert [item.response_ns for item in found] == [540_000, 810_000, 810_000]


def test_what_waits_in_a_queue_comes_later_for_others() -> None:
    """`q1` comes every 5 ms, up to what it waits behind `q2` late: within the wait of `p` it comes twice."""
    lines = ["dse: 1", "name: n", "bus_types: {can: {bandwidth: 125 kbit/s, frame: can}}", "buses: {b: {type: can}}"]
    lines += ["processor_types: {c: {transmit_queue: fifo}}", "processors: {q: {type: c}}", "threads:"]
    lines += ["  q1: {processor: q, period: 5 ms}", "  q2: {processor: q, period: 50 ms}"]
    lines += ["devices: {p: {period: 20 ms}, r: {period: 20 ms}, sink: {}}", "connections:"]
    lines += [
        f"  of_{name}: {{from: {name}, to: sink, data_size: 8 B, bus: b, identifier: {number}, port: data}}"
        for number, name in enumerate(("q1", "r", "p", "q2"))
    ]
    found = {item.name: item for item in dse.analyse(dse.loads("\n".join(lines))).messages["b"]}
    assert found["of_q1"].response_ns == found["of_q2"].response_ns == 4 * 1_080_000
    assert found["of_p"].response_ns == 4 * 1_080_000 + 1_080_000
    assert [(item.name, item.jobs) for item in found["of_p"].interference] == [("of_q1", 2), ("of_r", 1)]


def test_explain_names_the_identifier_that_would_do_for_a_queue() -> None:
    """`text` and its queue behind both others; in 810 us (540 of the queue, one frame that has begun) before them."""
    text = GATEWAY.replace("[small, large]", "small").replace("stop <= 540 us", "text <= 0.9 ms")
    text = text.replace("sink: {}", "other: {period: 9 ms}, sink: {}")
    text = text.replace(
        "  text: {from", "  far: {from: other, to: sink, data_size: 8 B, bus: can0, identifier: 0x25}\n  text: {from"
    )
    (late,) = dse.explain(dse.loads(text)).conflicts[0].members[0][1].late_messages
    assert (late.message.name, late.message.response_ns, late.late_ns) == ("text", 1_080_000, 180_000)
    assert (late.before, late.identifier, late.makes_late) == ("near", 0x1F, ())
