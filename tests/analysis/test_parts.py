"""The parts of a response time add up to it, in what a report says of it and in JSON."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from pathlib import Path

import pytest

import dse
from dse.analysis.diagnosis.reservation_budgets import budget_of
from dse.analysis.diagnosis.timelines import worst_busy_period
from dse.analysis.evaluate import Evaluator
from dse.analysis.messages.stages import counted_buses
from dse.analysis.messages.waits import message_responses
from dse.analysis.scheduling.busy_window import TaskKey
from dse.analysis.scheduling.chained import chain_of, chain_wait_ns, least_cut
from dse.analysis.scheduling.fixed_point import Solution, Windows
from dse.analysis.scheduling.responses import UNBOUNDED_NS, Response, messages_of, processor_responses, solution_of
from dse.analysis.scheduling.tasks import longest_alone_ns
from dse.analysis.scheduling.waits import Waits, stated_name
from dse.analysis.views import View
from dse.cli.main import run
from dse.space.model.space import Space
from tests.helpers import chained_callbacks, core_chains
from tests.helpers.bus_systems import draw_bus_problem
from tests.helpers.effort import cases
from tests.helpers.joins import draw_join
from tests.helpers.packing_systems import draw_packing_problem
from tests.helpers.polled_callbacks import draw_polled
from tests.helpers.thread_segments import draw as draw_segments
from tests.helpers.thread_segments import text_of as segments_text
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
ENDLESS = """
dse: 1
name: more than one core has
processing: response_time
deadlines: none
processor_types: {P: {}}
processors: {p: {type: P}, q: {type: P}}
threads:
  first: {processor: p, priority: 9, period: 10 ms, compute_execution_time: 6 ms}
  full: {processor: p, priority: 1, period: 10 ms, compute_execution_time: 5 ms}
  empty: {processor: q, priority: 2, dispatch_protocol: aperiodic, compute_execution_time: 0 ms}
  last: {processor: q, priority: 1, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections: {a: {from: full, to: empty}, b: {from: empty, to: last}}
objectives: [minimise response time of last]
"""
TAKEN = """
dse: 1
name: a chain on a core
processing: response_time
processor_types: {P: {}}
processors: {cpu: {type: P}}
threads:
  a: {processor: cpu, period: 20 ms, compute_execution_time: 5 ms, priority: 3}
  b: {processor: cpu, dispatch_protocol: aperiodic, compute_execution_time: 3 ms, deadline: 12 ms, priority: 1}
  c: {processor: cpu, period: 10 ms, compute_execution_time: 2 ms, priority: 2}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
objectives: [minimise latency of f]
"""
MS = 10**6


def of_core_chains(seed: int) -> str:
    """Chains of threads on one core or two, some of them overloaded."""
    rng = random.Random(seed)
    drawn = core_chains.draw(rng, rng.randint(1, 2), rng.choice((0.4, 0.6, 0.8, 1.02)), by_rate=rng.random() < 0.5)
    return json.dumps(core_chains.problem_of(drawn))


SYSTEMS: dict[str, Callable[[int], str]] = {
    **{kind: partial(lambda kind, seed: text_of(draw(seed, kind=kind)), kind) for kind in KINDS},
    "callbacks": lambda seed: chained_callbacks.text_of(chained_callbacks.draw(random.Random(seed))),
    "core chains": of_core_chains,
    "polled": draw_polled,
    "joins": lambda seed: draw_join(seed, options=True),
    "segments": lambda seed: segments_text(draw_segments(seed)),
    "messages": lambda seed: draw_bus_problem(seed, responses=True),
    "packed messages": draw_packing_problem,
}
"""Problems of every kind of system, by seed."""


def designs_of(space: Space, most: int = 8) -> Iterator[View]:
    """Valid designs, drawn at random."""
    rng, evaluator = random.Random(space.name), Evaluator(space)
    drawn = (tuple(rng.randrange(len(item.options)) for item in space.decisions) for _ in range(40))
    return map(View, islice((one for one in drawn if not evaluator.invalid(one)), most))


def responses_in(space: Space, view: View) -> Iterator[Response]:
    for number in range(len(space.processors)):
        yield from processor_responses(space, number, view)


def has_grown(solution: Solution, key: TaskKey) -> bool:
    """Whether a stage was told to have no bound because it would end beyond the horizon."""
    loss = solution.loss_of(key)
    assert loss is not None, key
    window = Windows(solution.system, loss.ends, loss=loss).of(loss.resource, loss.position)
    end = None if window is None else window.response_ns()
    return end is not None and end > solution.system.horizon_ns


@pytest.mark.parametrize("kind", SYSTEMS)
@pytest.mark.parametrize("seed", cases(15))
def test_parts_of_response_times_add_up(seed: int, kind: str) -> None:
    """In tables, in explanations and on timelines, where a job is played to its end."""
    space = dse.loads(SYSTEMS[kind](seed)).space
    for view in designs_of(space):
        solution = solution_of(space, view)
        waits = Waits(space, solution.system, solution.ends)
        for item in responses_in(space, view):
            told = waits.of_thread((item.component, item.part))
            if item.response_ns is None:
                continue
            assert item.before_ns + item.task.worst_ns + item.parts.waited_ns == item.response_ns, item
            assert all(delay.jobs and delay.work_ns for delay in item.delays)
            assert bool(item.blocked_ns) == bool(item.blocked_by)
            assert told is not None and sum(one.response_ns for one in told) == item.response_ns, item
            busy = worst_busy_period(item.core, [item])
            assert busy is None or busy.is_segment or busy.end_ns - busy.released_ns == item.response_ns, item


@pytest.mark.parametrize("kind", ["chained", "blocked", "late", "mixed", "core chains", "messages", "joins"])
@pytest.mark.parametrize("seed", cases(15))
def test_parts_of_chains_add_up(seed: int, kind: str) -> None:
    """Threads of a flow that wait together: their own work and what they wait for are all that they take."""
    space = dse.loads(SYSTEMS[kind](seed)).space
    steps = [step for flow in space.flows for step in flow.steps if step.kind == "component" and step.chain]
    for view in designs_of(space):
        solution = solution_of(space, view)
        waits = Waits(space, solution.system, solution.ends)
        for chain in {chain_of(step) for step in steps if solution.system.place((step.index, "thread")) is not None}:
            for part in least_cut(space, chain, view):
                told, waited = waits.of_part(part), chain_wait_ns(space, part, view)
                alone = sum(longest_alone_ns(space, number, "thread", view) for number in part.threads)
                if waited + alone < UNBOUNDED_NS:
                    assert told is not None and sum(one.response_ns for one in told) == waited + alone, part


@pytest.mark.parametrize("kind", ["messages", "packed messages"])
@pytest.mark.parametrize("seed", cases(25))
def test_parts_of_messages_add_up(seed: int, kind: str) -> None:
    space = dse.loads(SYSTEMS[kind](seed)).space
    for view in designs_of(space):
        for item in (one for bus in counted_buses(space) for one in message_responses(space, bus, view)):
            if item.response_ns is not None:
                assert item.transmission_ns[1] + item.parts.waited_ns == item.response_ns, item
                assert bool(item.blocking_ns) == bool(item.blocked_by)
            elif not item.because and item.needed_ppm is None:
                names = [connection.name for connection in space.connections]
                assert has_grown(messages_of(space, view), (names.index(item.name), "message")), item


@pytest.mark.parametrize("kind", SYSTEMS)
@pytest.mark.parametrize("seed", cases(15))
def test_each_response_time_without_a_bound_has_a_cause(seed: int, kind: str) -> None:
    """Others without a bound, a core that is full, a budget that is not there, a late piece, or jitter that grows."""
    space = dse.loads(SYSTEMS[kind](seed)).space
    for view in designs_of(space):
        solution = solution_of(space, view)
        for item in responses_in(space, view):
            if item.response_ns is not None:
                assert not item.because and item.needed_ppm is None
                continue
            budget = budget_of(space, item.component, view, bool)
            if item.because:
                endless = {stated_name(space, key) for key in solution.tasks if solution.ends[key] is None}
                assert endless >= set(item.because)
            elif not item.is_piece and item.needed_ppm is None and (budget is None or budget.is_served):
                assert has_grown(solution, (item.component, item.part)), item


def test_no_bound_is_followed_through_threads_that_take_no_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """C waits for nobody and ends with its release, but comes as late as full, which needs 110 % of its core."""
    path = tmp_path / "endless.yaml"
    path.write_text(ENDLESS)
    run(["analyse", str(path), "--response-times", "--json", "-"])
    found = json.loads(capsys.readouterr().out)["response_times"]
    rows = {row["thread"]: row for rows in found.values() for row in rows}
    assert {name: (row["response_ns"], row.get("because"), row.get("needed_ppm")) for name, row in rows.items()} == {
        "first": (6 * MS, None, None),
        "full": (None, None, 1_100_000),
        "empty": (0, None, None),
        "last": (None, ["full"], None),
    }
    run(["analyse", str(path), "--response-times"])
    printed = " ".join(capsys.readouterr().out.split())
    assert "no bound: with work of higher priority it needs 110 % of the core" in printed
    assert "no bound, for full has none" in printed


def test_a_timeline_is_left_out_where_it_would_say_another_response_time() -> None:
    """B is over 3 + 2 ms after its release by a: how long a took is known, and not when."""
    space = dse.loads(TAKEN).space
    found = processor_responses(space, 0, View(()))
    assert {item.name: item.response_ns for item in found} == {"a": 5 * MS, "b": 5 * MS, "c": 7 * MS}
    assert worst_busy_period(1, [item for item in found if item.name == "b"]) is None
    assert worst_busy_period(1, [item for item in found if item.name == "c"]) is not None


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
    page = tmp_path / "page.md"
    run(["analyse", str(path), "--response-times", "--report", str(page)])
    printed = page.read_text(encoding="utf-8")
    for words in ("4 earlier jobs (248 ms)", "8 jobs of a", "400 ms are over when it is released"):
        assert words in printed
