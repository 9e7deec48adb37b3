"""The busy period of a bus where it is tightest: played frame by frame, it ends as the analysis says."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

import dse
from dse.analysis.diagnosis.bus_timelines import played_on_bus, worst_bus_period
from dse.analysis.diagnosis.timelines import SECTION
from dse.analysis.scheduling.busy_window import Stream, Task, most_jobs
from dse.analysis.scheduling.policies.buses import Arbitrated
from dse.report.content.analyse import analysis_page
from dse.report.page import Timeline
from dse.report.plots.deadlines import deadline_records
from dse.report.words.messages import bus_timelines
from dse.report.words.scheduling import MOST_LANES
from tests.buses.test_faults import FAULTY
from tests.buses.test_messages import SYNC, car_bus
from tests.helpers.bus_systems import draw_bus_problem
from tests.helpers.effort import cases


@pytest.mark.parametrize("seed", cases(100))
def test_a_played_busy_period_has_no_gaps_and_ends_with_the_response_time(seed: int) -> None:
    rng = Random(seed)
    tasks = []
    for number in range(rng.randint(1, 4)):
        period = rng.randint(4, 30)
        streams = tuple(Stream(period, rng.choice((0, 0, rng.randint(1, 40)))) for _ in range(rng.choice((1, 1, 2))))
        tasks.append(Task(f"m{number}", rng.randint(1, max(1, period // 3)), streams))
    *urgent, own = tasks
    faults = Task("faults", rng.randint(2, 5), (Stream(rng.randint(20, 90), rng.choice((0, 50))),))
    last, blocked, bit = rng.randint(1, own.worst_ns), rng.choice((0, rng.randint(1, 9))), rng.choice((0, 1, 1))
    window = Arbitrated(own, tuple(urgent), blocked, last, bit, rng.choice((None, faults)))
    found, parts = window.worst_job(), window.parts()
    if found is None or parts is None:
        assert window.response_ns() is None
        return
    pieces = played_on_bus(window, found)
    assert [item.start_ns for item in pieces] == [0, *(item.end_ns for item in pieces[:-1])]
    assert (pieces[-1].name, pieces[-1].end_ns - found[0]) == (own.name, window.response_ns())
    assert all((one.name, one.job) != (other.name, other.job) for one, other in pairwise(pieces))
    took = {name: sum(one.end_ns - one.start_ns for one in pieces if one.name == name) for name in (SECTION, "faults")}
    assert took == {SECTION: blocked, "faults": parts.faults_ns}
    for item in window.of_wire:
        assert took["faults"] == most_jobs(item, found[1]) * item.worst_ns


@pytest.mark.parametrize("seed", cases(40))
def test_of_drawn_problems(seed: int) -> None:
    text = draw_bus_problem(seed, decisions=0)
    for messages in dse.analyse(dse.loads(text)).messages.values():
        for item in messages:
            busy = worst_bus_period([item])
            if busy is not None:
                assert busy.end_ns - busy.released_ns == item.response_ns
                assert busy.pieces[-1].name == item.name


def test_the_message_nearest_to_its_deadline_is_shown() -> None:
    """As a timeline with its faults, and as a bar with the threads."""
    found = dse.analyse(dse.loads(FAULTY.replace("identifier: 0x181", "identifier: 0x181, deadline: 0.5 ms")))
    (shown,) = [
        block
        for section in analysis_page(found).sections
        for block in section.blocks
        if isinstance(block, Timeline) and block.caption.startswith("Bus can0")
    ]
    assert [lane.name for lane in shown.lanes] == ["sync", "faults", "pdo"]
    assert (
        shown.caption
        == "Bus can0 where it is tightest: pdo ends 0.522 ms after its release, 0.022 ms after its deadline"
    )
    assert [(item["where"], item["late"]) for item in deadline_records(found.responses, found.messages)] == [
        ("can0", True)
    ]


@pytest.mark.parametrize("kind", ["fifo", "none", "round_robin"])
def test_lines_are_shown_and_safe_bounds_are_not(kind: str) -> None:
    text = SYNC.replace("frame: can", f"frame: can, arbitration: {kind}")
    busy = worst_bus_period(dse.analyse(dse.loads(text)).messages["can0"])
    names = None if busy is None else [piece.name for piece in busy.pieces]
    assert names == {"fifo": ["pdo", "sync"], "none": ["pdo"], "round_robin": None}[kind]


def test_the_tightest_message_of_the_public_cars_bus() -> None:
    messages = dse.analyse(dse.loads(car_bus())).messages["b"]
    busy = worst_bus_period(messages)
    slack = min(item.deadline_ns - item.response_ns for item in messages if item.deadline_ns and item.response_ns)
    assert busy is not None
    assert busy.deadline_ns is not None
    assert busy.deadline_ns - (busy.end_ns - busy.released_ns) == slack < 0
    (shown,) = bus_timelines({"b": messages})
    assert len(shown.lanes) == MOST_LANES
    assert (shown.lanes[0].name, shown.lanes[-1].name) == (SECTION, busy.name)
    assert shown.lanes[-2].name == f"{len({piece.name for piece in busy.pieces}) - MOST_LANES + 1} more"
    drawn = sorted(piece for lane in shown.lanes for piece in lane.pieces)
    assert all(one[1] == other[0] for one, other in pairwise(drawn))
