"""The parts of a response time add up to it, in what a report says of it and in JSON."""

from __future__ import annotations

import json
import random
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import Response, processor_responses
from dse.analysis.views import View
from dse.cli.main import run
from dse.space.model.space import Space
from tests.helpers import chained_callbacks
from tests.helpers.effort import cases
from tests.helpers.thread_systems import KINDS, draw, text_of

BLOCKED = """
dse: 1
name: a section, or a callback that has begun
processor_types: {P: {}}
processors: {cpu: {type: P}}
executors: {ex: {kind: callback_group, processor: cpu, priority: 5}}
threads:
  urgent: {executor: ex, period: 20 ms, priority: 2, compute_execution_time: 2 ms}
  slow: {executor: ex, period: 50 ms, priority: 1, compute_execution_time: 5 ms}
  log: {processor: cpu, priority: 1, period: 100 ms, compute_execution_time: 3 ms, non_preemptive: 700 us}
objectives: [minimise response time of urgent]
"""
LATER = """
dse: 1
name: the fifth job of b responds last
deadlines: none
processor_types: {P: {}}
processors: {cpu: {type: P}}
threads:
  a: {processor: cpu, period: 70 ms, compute_execution_time: 26 ms, priority: 2}
  b: {processor: cpu, period: 100 ms, compute_execution_time: 62 ms, priority: 1}
objectives: [minimise response time of b]
"""
MS = 10**6


def assert_parts_add_up(responses: Iterable[Response]) -> None:
    for item in responses:
        if item.response_ns is not None:
            assert item.before_ns + item.task.worst_ns + item.parts.waited_ns == item.response_ns, item
            assert all(delay.jobs and delay.work_ns for delay in item.delays)
            assert bool(item.blocked_ns) == bool(item.blocked_by)


def of_designs(space: Space, most: int = 8) -> Iterable[Response]:
    """The responses of valid designs, drawn at random."""
    rng, evaluator = random.Random(space.name), Evaluator(space)
    drawn = (tuple(rng.randrange(len(item.options)) for item in space.decisions) for _ in range(40))
    for design in islice((one for one in drawn if not evaluator.invalid(one)), most):
        for number in range(len(space.processors)):
            yield from processor_responses(space, number, View(design))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(30))
def test_of_random_systems(seed: int, kind: str) -> None:
    assert_parts_add_up(of_designs(dse.loads(text_of(draw(seed, kind=kind))).space))


@pytest.mark.parametrize("seed", cases(100))
def test_of_chains_of_callbacks(seed: int) -> None:
    assert_parts_add_up(
        of_designs(dse.loads(chained_callbacks.text_of(chained_callbacks.draw(random.Random(seed)))).space)
    )


def test_a_section_counts_only_where_it_takes_longer_than_what_has_begun(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Urgent waits for slow, 5 ms, or the section of log, 0.7 ms; slow waits for the section and for urgent."""
    path = tmp_path / "blocked.yaml"
    path.write_text(BLOCKED)
    assert run(["analyse", str(path), "--response-times", "--json", "-"]) == 0
    rows = {row["thread"]: row for row in json.loads(capsys.readouterr().out)["response_times"]["cpu"]}
    assert {name: row["response_ns"] for name, row in rows.items()} == {
        "urgent": 7 * MS,
        "slow": 7_700_000,
        "log": 10 * MS,
    }
    assert {name: row["blocking_ns"] for name, row in rows.items()} == {"urgent": 0, "slow": 700_000, "log": 0}
    assert [row.get("blocked_by", "") for row in rows.values()] == ["", "log", ""]
    assert run(["analyse", str(path), "--response-times"]) == 0
    printed = capsys.readouterr().out
    assert printed.count("by log") == 1


def test_earlier_jobs_and_what_is_over_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """62 + 4 * 62 + 8 * 26 - 400 ms = 118 ms (the job that is released at 400 ms ends at 518)."""
    path = tmp_path / "later.yaml"
    path.write_text(LATER)
    run(["analyse", str(path), "--response-times", "--json", "-"])
    row = json.loads(capsys.readouterr().out)["response_times"]["cpu"][1]
    assert (row["response_ns"], row["earlier_ns"], row["over_ns"]) == (118 * MS, 248 * MS, 400 * MS)
    assert row["interference"] == [{"thread": "a", "jobs": 8, "work_ns": 208 * MS}]
    run(["analyse", str(path), "--response-times"])
    printed = " ".join(capsys.readouterr().out.split())
    for words in ("4 earlier jobs (248 ms)", "8 x a", "400 ms are over when it is released"):
        assert words in printed
