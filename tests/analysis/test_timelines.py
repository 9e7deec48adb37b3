"""The busy period of a core where it is tightest: played, it ends as the analysis says, and three writers show it."""

from __future__ import annotations

import base64
import gzip
import io
import random
import re
from itertools import count, pairwise
from pathlib import Path

import pytest
from rich.console import Console

import dse
from dse.analysis.diagnosis.timelines import SECTION, played, worst_busy_period
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.busy_window import Stream, Task, most_jobs, response_time_ns, worst_job_ns
from dse.analysis.scheduling.responses import processor_responses
from dse.analysis.views import View
from dse.cli.main import run
from dse.report.content.analyse import analysis_page
from dse.report.page import Lane, Timeline
from dse.report.plots.deadlines import WIDEST, deadline_records
from dse.report.terminal import print_block
from tests.helpers.effort import cases
from tests.helpers.thread_segments import draw as draw_segments
from tests.helpers.thread_segments import text_of as segments_text
from tests.helpers.thread_systems import draw, text_of


@pytest.mark.parametrize("seed", cases(100))
def test_a_played_busy_period_has_no_gaps_and_ends_with_the_response_time(seed: int) -> None:
    rng = random.Random(seed)
    tasks = []
    for number in range(rng.randint(1, 4)):
        period = rng.randint(4, 30)
        streams = tuple(Stream(period, rng.choice((0, 0, rng.randint(1, 40)))) for _ in range(rng.choice((1, 1, 2))))
        separation = rng.choice((None, None, period // 2))
        tasks.append(Task(f"t{number}", rng.randint(1, max(1, period // 3)), streams, separation))
    *rivals, task = tasks
    blocked = rng.choice((0, 0, rng.randint(1, 9)))
    found, response = worst_job_ns(task, rivals, blocked), response_time_ns(task, rivals, blocked)
    if found is None:
        assert response is None
        return
    pieces = played(task, rivals, blocked, found)
    assert [item.start_ns for item in pieces] == [0, *(item.end_ns for item in pieces[:-1])]
    assert (pieces[-1].name, pieces[-1].end_ns - found[0]) == (task.name, response)
    assert all((one.name, one.job) != (other.name, other.job) for one, other in pairwise(pieces))
    for item in rivals:
        took = sum(piece.end_ns - piece.start_ns for piece in pieces if piece.name == item.name)
        assert took == most_jobs(item, found[1]) * item.worst_ns
    assert sum(piece.end_ns - piece.start_ns for piece in pieces if piece.name == SECTION) == blocked


LEHOCZKY = """
dse: 1
name: lehoczky
deadlines: all
processor_types: {cpu: {price: 1 EUR}, big: {cores: 2, price: 5 EUR}}
processors: {p: {type: [cpu, big]}}
threads:
  a: {processor: p, period: 100 ms, compute_execution_time: 52 ms, priority: 2}
  b: {processor: p, period: 140 ms, compute_execution_time: 52 ms, priority: 1, deadline: 160 ms}
objectives: [minimise price]
"""


def test_the_busy_period_of_lehoczkys_example() -> None:
    """52 of a, 48 of b, 52 of a again, and the last 4 of b end at 156 ms (RTSS 1990)."""
    analysis = dse.analyse(dse.loads(LEHOCZKY), ["p.type = cpu", "a.core = 1", "b.core = 1"])
    busy = worst_busy_period(1, analysis.responses["p"])
    assert busy is not None and (busy.name, busy.deadline_ns) == ("b", 160_000_000)
    assert [(item.name, item.end_ns // 10**6) for item in busy.pieces] == [
        ("a", 52),
        ("b", 100),
        ("a", 152),
        ("b", 156),
    ]


EXECUTED = """
dse: 1
name: a node behind another thread
processor_types: {cpu: {}}
processors: {p: {type: cpu}}
executors: {node: {kind: KIND, processor: p, priority: 1}}
threads:
  timer: {executor: node, period: 10 ms, compute_execution_time: 1 ms}
  callback: {executor: node, period: 40 ms, compute_execution_time: 3 ms}
  other: {processor: p, period: 5 ms, compute_execution_time: 2 ms, priority: 2}
objectives: [minimise price]
"""


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("fifo", [("other", 2), ("callback", 5), ("other", 7), ("timer", 8)]),
        ("callback_group", [("other", 2), ("callback", 5), ("other", 7), ("timer", 8)]),
    ],
)
def test_the_busy_period_of_an_executor(kind: str, expected: list[tuple[str, int]]) -> None:
    """The callback came with the timer, or had begun before; what preempts the node runs at 0 and 5 ms."""
    found = dse.analyse(dse.loads(EXECUTED.replace("KIND", kind)), response_times=True).responses["p"]
    timer = next(item for item in found if item.name == "timer")
    assert {item.name: item.jobs for item in timer.delays} == {"other": 2, "callback": 1}
    busy = worst_busy_period(1, [timer])
    assert busy is not None and (busy.name, busy.end_ns) == ("timer", 8 * 10**6)
    assert [(item.name, item.end_ns // 10**6) for item in busy.pieces] == expected


SEGMENTS = """
dse: 1
name: a core of segments alone
deadlines: all
processing: response_time
processor_types: {cpu: {cores: 2}, gpu: {serves: fifo}}
processors: {p: {type: cpu}, g: {type: gpu}}
threads:
  a: {processor: p, core: 1, period: 20 ms, segments: [
    {compute_execution_time: 2 ms}, {processor: g, compute_execution_time: 8 ms}, {compute_execution_time: 1 ms}]}
  b: {processor: p, core: 1, period: 50 ms, segments: [
    {compute_execution_time: 4 ms}, {processor: g, compute_execution_time: 5 ms}]}
objectives: [minimise price]
"""


def test_a_core_of_segments_alone_shows_the_one_that_takes_longest() -> None:
    """The first segment of b waits for one job of each segment of a: 2 + 1 + 4 ms; an accelerator has no core."""
    analysis = dse.analyse(dse.loads(SEGMENTS), response_times=True)
    busy = worst_busy_period(1, analysis.responses["p"])
    assert busy is not None and busy.is_segment and busy.deadline_ns is None
    assert [(item.name, item.end_ns // 10**6) for item in busy.pieces] == [
        ("a (piece 1)", 2),
        ("a", 3),
        ("b (piece 1)", 7),
    ]
    assert worst_busy_period(1, analysis.responses["g"]) is None
    sections = analysis_page(analysis).sections
    captions = [block.caption for section in sections for block in section.blocks if hasattr(block, "caption")]
    assert "Response times on g, which serves one job at a time" in captions
    ends = "b (piece 1) ends at most 7 ms after its own release, with all interference"
    assert f"Core 1 of p where a segment takes longest: {ends}" in captions
    assert {item["where"] for item in deadline_records(analysis.responses, analysis.messages)} == {"core 1 of p", "g"}


@pytest.mark.parametrize("seed", cases(20))
def test_what_is_played_of_segments_takes_no_longer_than_their_bound(seed: int) -> None:
    """The bound counts from the release of the thread; the segment executes at least what it takes alone."""
    space, rng = dse.loads(segments_text(draw_segments(seed))).space, random.Random(seed)
    evaluator = Evaluator(space)
    drawn = (tuple(rng.randrange(len(item.options)) for item in space.decisions) for _ in count())
    design = next(design for design in drawn if not evaluator.invalid(design))
    for item in processor_responses(space, 0, View(evaluator.evaluate(design).design)):
        busy = worst_busy_period(item.core, [item])
        if busy is not None and busy.is_segment:
            assert busy.pieces[-1].name == item.name and busy.pieces[0].start_ns == 0
            assert item.response_ns is not None and item.worst_ns <= busy.end_ns <= item.response_ns
            assert all(one.end_ns == next_one.start_ns for one, next_one in pairwise(busy.pieces))


@pytest.mark.parametrize("kind", ["grouped", "joined", "reserved"])
@pytest.mark.parametrize("seed", cases(20))
def test_what_is_played_ends_with_the_response_time(kind: str, seed: int) -> None:
    space, rng = dse.loads(text_of(draw(seed, kind=kind))).space, random.Random(seed)
    evaluator = Evaluator(space)
    drawn = (tuple(rng.randrange(len(item.options)) for item in space.decisions) for _ in count())
    design = next(design for design in drawn if not evaluator.invalid(design))
    for item in processor_responses(space, 0, View(evaluator.evaluate(design).design)):
        busy = worst_busy_period(item.core, [item])
        if busy is not None:
            assert busy.pieces[-1].name == item.name and busy.pieces[0].start_ns == 0
            assert busy.end_ns - busy.released_ns == item.response_ns and busy.pieces[-1].end_ns == busy.end_ns
            assert all(one.end_ns == next_one.start_ns for one, next_one in pairwise(busy.pieces))


def test_response_times_are_drawn_against_their_deadlines() -> None:
    """52 of 100 ms and 156 of 160 ms: the nearest first; a late one stands out, and none is wider."""
    analysis = dse.analyse(dse.loads(LEHOCZKY), ["p.type = cpu", "a.core = 1", "b.core = 1"], response_times=True)
    records = deadline_records(analysis.responses, analysis.messages)
    assert [(item["label"], item["end"], item["late"], item["row"]) for item in records] == [
        ("b", 97.5, False, 1),
        ("a", 52.0, False, 2),
    ]
    assert records[0]["title"] == "b, core 1 · 156 ms of 160 ms"
    tight = dse.analyse(dse.loads(LEHOCZKY.replace("160 ms", "50 ms")), ["p.type = cpu"], response_times=True)
    late = deadline_records(tight.responses, tight.messages)[0]
    assert late["late"] and late["end"] == WIDEST
    [section] = [item for item in analysis_page(analysis).sections if item.name == "responses"]
    assert [plot.name for plot in section.plots] == ["deadlines"]


def test_reports_have_response_times_and_the_tightest_busy_period(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(LEHOCZKY, encoding="utf-8")
    assert run(["solve", str(file), "-q", "--report", "-o", str(tmp_path / "out")]) == 0
    said = "Core 1 of p where it is tightest: b ends 156 ms after its release, 4 ms before its deadline"
    page = (tmp_path / "out" / "p.html").read_text(encoding="utf-8")
    packed = re.findall(r'<script type="application/gzip"[^>]*>([^<]+)<', page)
    parts = "".join(gzip.decompress(base64.b64decode(item)).decode() for item in packed)
    assert run(["analyse", str(file), "--design", "p.type = cpu", "--report", str(tmp_path / "a.html")]) == 0
    for text in (
        (tmp_path / "out" / "p.md").read_text(encoding="utf-8"),
        (tmp_path / "a.html").read_text(encoding="utf-8"),
        parts,
    ):
        assert "Response times on p, by core and priority" in text
        assert said in text
    assert 'class=\\"track\\"' in parts
    console = Console(file=io.StringIO(), width=60)
    print_block(console, Timeline("who has it", (Lane("a", ((0.0, 0.5),)), Lane("b", ((0.5, 1.0),))), ("0", "4 ms")))
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert [line.count("#") for line in lines[1:3]] == [29, 29]
    assert lines[-1].split() == ["0", "4", "ms"]
