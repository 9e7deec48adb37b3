"""Ethernet with strict priorities: one link played bit by bit, in problems, in the search, and mistakes."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from random import Random

import pytest

import dse
from dse.analysis.scheduling.model import NO_PROCESSOR, Entry, Resource, Wire
from dse.analysis.scheduling.policies.buses import window_of
from dse.report.words.contention import arbitration_words, bus_words
from dse.report.words.messages import late_message_words
from dse.space.architecture.frames import Frame, ethernet_frames_ns, last_frame_ns, wire_ns
from dse.support.errors import ProblemError
from tests.buses.test_policies import task_of
from tests.helpers.arbitration import Message, draw_bus, drawn
from tests.helpers.effort import cases

DOCS = Path(__file__).parents[2] / "docs"
LINK = """
dse: 1
name: a link
bus_types:
  eth: {bandwidth: 100 Mbit/s, frame: {protocol: ethernet, vlan: true, transport: udp}, arbitration: priority}
buses: {link: {type: eth}}
devices: {sink: {}, control: {period: 5 ms}, lidar: {period: 100 ms}, camera: {period: 33 ms}, log: {period: 10 ms}}
connections:
  steer: {from: control, to: sink, port: data, data_size: 64 B, bus: link, priority: 6, deadline: 1 ms}
  scan: {from: lidar, to: sink, port: data, data_size: 20 KB, bus: link, priority: 4}
  image: {from: camera, to: sink, port: data, data_size: 100 KB, bus: link, priority: [4, 3]}
  logs: {from: log, to: sink, port: data, data_size: 4 KB, bus: link, priority: 0}
flows: {f: {path: [lidar, scan, sink]}, g: {path: [camera, image, sink]}}
objectives: [minimise latency of f, minimise latency of g]
"""
FULL_NS = (1500 + 42) * 80
"""A frame of 1,500 B at 100 Mbit/s, with preamble, header, tag, check sequence and gap."""


def resource_of(messages: list[Message], classes: list[int]) -> Resource:
    """A link with messages in the order of their classes, as a resource of the analysis."""
    entries = []
    lines = [tuple(at for at, one in enumerate(classes) if one == own) for own in classes]
    for place in range(len(messages)):
        end = lines[place][-1]
        blocked = max((item.bits for item in messages[end + 1 :]), default=0)
        rivals = tuple(at for at in range(end + 1) if at != place)
        entries.append(Entry((place, "message"), place, rivals, blocked_ns=blocked))
    bits = tuple(item.bits for item in messages)
    lines = [line if len(line) > 1 else () for line in lines]
    wire = Wire("classes", 0, bits, ((),) * len(bits), (), tuple(lines))
    return Resource(NO_PROCESSOR, 0, tuple(entries), wire=wire)


@pytest.mark.parametrize("seed", cases(60))
def test_no_message_is_later_than_its_bound(seed: int) -> None:
    """Of those that wait the one with the highest priority goes next, of equal ones the oldest."""
    rng = Random(seed)
    messages = draw_bus(rng, load=rng.choice((0.7, 0.9)))
    classes = sorted((rng.randint(0, 3) for _ in messages), reverse=True)

    def oldest_of_class(_: Fraction, waiting: list[tuple[Fraction, int, int]]) -> tuple[Fraction, int, int]:
        return min(waiting, key=lambda job: (-classes[job[1]], job))

    seen = drawn(messages, oldest_of_class, rng, 12, exact=True)
    resource, tasks = resource_of(messages, classes), [task_of(item) for item in messages]
    for place, item in enumerate(messages):
        window = window_of(resource, place, tasks)
        assert window is not None
        bound, parts = window.response_ns(), window.parts()
        assert bound is not None
        assert parts is not None
        assert seen[place] <= bound == parts.waited_ns + item.bits


@pytest.mark.parametrize("transport", ["none", "udp", "tcp"])
@pytest.mark.parametrize("size", [0, 1, 46, 1400, 1472, 1473, 1500, 3000, 20_000])
def test_frames_of_a_message_are_all_of_it(transport: str, size: int) -> None:
    frame = _frame(transport)
    times = ethernet_frames_ns(frame, size, 10**8)
    assert (sum(item[0] for item in times), sum(item[1] for item in times)) == wire_ns(frame, size, 10**8)
    last, longest = last_frame_ns(frame, size, 10**8)
    assert last == times[-1][1]
    assert longest == (FULL_NS if len(times) > 1 else last) >= max(item[1] for item in times)


def _frame(transport: str) -> Frame:
    text = LINK.replace("transport: udp", f"transport: {transport}")
    found = dse.loads(text).space.buses[0].fixed_ns
    assert isinstance(found, Frame)
    return found


def test_a_link_by_hand() -> None:
    """Steering waits for a frame of 1,500 B that has begun; scans and images of one priority wait for each other."""
    found = dse.analyse(dse.loads(LINK), {"image.priority": "4"})
    steer, scan, image, logs = found.messages["link"]
    assert [item.priority for item in (steer, scan, image, logs)] == [6, 4, 4, 0]
    own = (64 + 28 + 42) * 80
    assert (steer.blocking_ns, steer.response_ns) == (FULL_NS, FULL_NS + own)
    assert scan.response_ns == image.response_ns
    assert [(item.name, item.jobs) for item in scan.interference] == [("image", 1), ("steer", 3)]
    assert logs.blocking_ns == 0
    assert arbitration_words(found.space) == "Waiting for link (by priority, equal ones as they come) is counted."
    lower = dse.analyse(dse.loads(LINK), {"image.priority": "3"}).messages["link"]
    assert scan.response_ns is not None
    assert lower[1].response_ns is not None
    assert lower[1].response_ns < scan.response_ns


def test_a_priority_is_a_decision() -> None:
    result = dse.solve(dse.loads(LINK))
    assert [point.decisions["image.priority"] for point in result.front] == ["3"]
    assert not dse.verify(result).findings
    chosen = dse.loads(dse.export(result, 1))
    assert dse.analyse(chosen).messages["link"][2].priority == 3
    assert not dse.simulate(chosen, runs=3).contradictions


def test_a_message_without_priority_leaves_the_link_uncounted() -> None:
    text = LINK.replace(", priority: 0", "")
    assert bus_words(dse.loads(text).space) == "Waiting for link (no `priority` of logs) is not counted."


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (("vlan: true, ", ""), "needs `vlan: true`"),
        (("priority: 6", "priority: 8"), "at most 7"),
        (("arbitration: priority", "arbitration: fifo"), "a priority is that of a message on Ethernet"),
        (("bus: link, priority: 0", "priority: 0"), "a priority is that of a message on Ethernet"),
        (("arbitration: priority", "arbitration: priority, fault_interval: 1 s"), "only CAN repeats a frame"),
    ],
)
def test_mistakes(edit: tuple[str, str], message: str) -> None:
    assert edit[0] in LINK
    with pytest.raises(ProblemError, match=message):
        dse.loads(LINK.replace(*edit))


@pytest.mark.parametrize(
    ("deadline", "said"),
    [
        ("1 ms", "; in time with priority 5"),
        ("0.12 ms", "; late with every priority while the others keep theirs"),
    ],
)
def test_the_priority_that_would_do(deadline: str, said: str) -> None:
    """Behind images of its priority steering is late; above them it waits for one frame, which is too long for some."""
    text = LINK.replace("priority: 6, deadline: 1 ms", f"priority: 4, deadline: {deadline}").replace("[4, 3]", "4")
    (late,) = dse.explain(dse.loads(text)).conflicts[0].members[0][1].late_messages
    assert late_message_words(late).startswith("steer (priority 4) ends ")
    assert late_message_words(late).endswith(said)


def test_a_higher_priority_may_make_another_message_late() -> None:
    text = LINK.replace("priority: 4}", "priority: 4, deadline: 2 ms}").replace("[4, 3]", "3, deadline: 11 ms")
    text = text.replace("priority: 0}", "priority: 2, deadline: 1 ms}")
    late = [
        one
        for part in dse.explain(dse.loads(text)).conflicts[0].members
        for one in part[1].late_messages
        if one.message.name == "logs"
    ]
    assert late_message_words(late[0]).endswith("; in time with priority 5, but then scan would be late")


def test_what_stays_on_one_processor_may_state_a_priority() -> None:
    text = LINK.replace("devices:", "processor_types: {c: {cores: 1}}\nprocessors: {p: {type: c}}\ndevices:")
    threads = "threads:\n  one: {processor: p, period: 9 ms}\n  other: {processor: p}\nconnections:\n"
    inner = "  inner: {from: one, to: other, data_size: 1 B, bus: link, priority: 1}\n"
    found = dse.analyse(dse.loads(text.replace("connections:\n", threads + inner)), {"image.priority": "3"})
    assert [item.name for item in found.messages["link"]] == ["steer", "scan", "image", "logs"]


def test_two_links_in_a_row() -> None:
    """What the first link leaves is jitter on the second one: all but the shortest time there, and in the switch."""
    recipe = (DOCS / "recipes.md").read_text(encoding="utf-8").split("## Count the waiting on switched Ethernet")[1]
    problem = dse.loads("dse: 1\nname: two links\n" + recipe.split("```yaml")[1].split("```")[0])
    found = dse.analyse(problem, {"image.priority": "3"})
    (steer, _), (steer_on, _) = found.messages["to_switch"], found.messages["from_switch"]
    frame, longest = (64 + 28 + 42) * 80, (1000 + 28 + 42) * 80
    assert steer.response_ns == frame + longest
    assert steer_on.releases is not None
    assert [item.jitter_ns for item in steer_on.releases] == [longest + 12 * 80 + 8000]  # a gap, and the switch
    assert found.metrics["latency of steering"] == 2 * (frame + longest) + 12_000
    assert not dse.simulate(problem, {"image.priority": "3"}, runs=4).contradictions
    result = dse.solve(problem)
    assert [point.decisions["image.priority"] for point in result.front] == ["3"]
    assert not dse.verify(result).findings
