"""Executors that poll: rounds bound what an overloaded one drops (docs/semantics.md, section 4.6)."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.answers.result import decisions_of
from dse.cli.main import run
from dse.examples.shipped import example_path
from dse.questions.problem import load, loads
from dse.questions.verbs.simulate import simulate
from dse.search.front import search_front
from dse.support.errors import ProblemError
from tests.helpers.effort import cases
from tests.helpers.polled_callbacks import draw_polled
from tests.properties.pair import Pair
from tests.properties.test_against_oracle import figures_agree, fronts_agree

MS = 10**6
ASYNCHRONOUS = {"pc.type": "asynchronous"}
QUICK = {"tracking.period": "1 ms", "planning.period": "1 ms"}
MESSAGES_FIRST = {"tracking.priority": "1", "planning.priority": "1"}
FILE = """
dse: 1
name: a planner that takes longer than its period
processing: response_time
deadlines: none
overload: allowed
processor_types: {A: {}}
processors: {p: {type: A}}
executors: {node: {kind: polling, processor: p}}
devices: {source: {period: 50 ms}}
threads:
  store: {executor: node, compute_execution_time: 1 ms}
  plan: {executor: node, period: 75 ms, compute_execution_time: 110 ms%s}
connections:
  message: {from: source, to: store, queue_size: 1}
  stored: {from: store, to: plan, port: data}
flows: {whole: {path: [store, plan]}}
objectives: [minimise latency of whole]
"""


def test_the_example_of_the_document() -> None:
    """docs/semantics.md, section 4.6: two rounds of 111 ms; 75 + 222 - 110 ms from what is stored to the plan."""
    found = dse.analyse(loads(FILE % ""))
    assert {item.name: item.response_ns for item in found.responses["p"]} == {"store": 222 * MS, "plan": 222 * MS}
    assert found.metrics["latency of whole"] == (222 + 187) * MS
    assert any("plan may skip 1 of 2 releases" in text for text in found.warnings)
    assert any("store may drop messages" in text and "keeps the last" in text for text in found.warnings)


@pytest.mark.parametrize(("callback", "timer", "expected"), [(2, 1, (112, 221, 187)), (1, 2, (221, 221, 186))])
def test_priorities_order_a_round(callback: int, timer: int, expected: tuple[int, int, int]) -> None:
    """docs/semantics.md, section 4.6: callback first, and timer first."""
    text = (
        (FILE % "")
        .replace("store: {", f"store: {{priority: {callback}, ")
        .replace("plan: {", f"plan: {{priority: {timer}, ")
    )
    found = dse.analyse(loads(text))
    store, plan, stored = (time * MS for time in expected)
    assert {item.name: item.response_ns for item in found.responses["p"]} == {"store": store, "plan": plan}
    assert found.metrics["latency of whole"] == store + stored


def test_what_all_waits_for_has_no_bound_in_an_overloaded_executor() -> None:
    found = dse.analyse(loads((FILE % "").replace(", queue_size: 1", "")))
    assert {item.name: item.response_ns for item in found.responses["p"]} == {"store": None, "plan": 222 * MS}


def test_data_that_pass_at_a_release_do_not_go_with_releases_that_are_skipped() -> None:
    with pytest.raises(ProblemError, match='jobs of an executor that polls read when they begin, those of "plan"'):
        loads(FILE % ", communication: let")


def test_no_corner_is_called_the_worst_of_an_executor_that_may_be_overloaded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where it begins to be, a timer's own job is taken off: the latency falls there."""
    text = FILE.replace("objectives:", "requirements: [latency of whole <= 500 ms]\nobjectives:")
    text += "uncertainty: {threads.plan.compute_execution_time.max: {range: 60 ms .. 120 ms, distribution: uniform}}\n"
    path = tmp_path / "problem.yaml"
    path.write_text((text % "").replace("compute_execution_time: 110 ms", "compute_execution_time: 50 ms .. 110 ms"))
    assert run(["solve", str(path), "--robust"]) == 2
    assert "begins to be overloaded" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("design", "published_ns", "bound_ns"),
    [
        ({}, 835_837_000, 739_554_648),
        ({"ground.executor": "exact_time_node"}, 832_429_000, 739_554_648),
        (ASYNCHRONOUS, 696_045_000, 617_354_815),
        (QUICK, 668_146_000, 619_613_648),
        (MESSAGES_FIRST, 665_084_000, 573_492_534),
        ({**QUICK, **MESSAGES_FIRST, "ground.executor": "exact_time_node"}, 493_984_000, 453_551_534),
        ({**ASYNCHRONOUS, **QUICK, **MESSAGES_FIRST}, 416_177_000, 392_411_416),
    ],
)
def test_no_bound_of_the_racing_stack_is_longer_than_the_published_one(
    design: dict[str, str], published_ns: int, bound_ns: int
) -> None:
    found = dse.analyse(load(example_path("racing_stack")), {"pc.type": "synchronous", **design})
    assert found.metrics["latency of filter_to_control"] == bound_ns < published_ns


@pytest.mark.parametrize("seed", cases(12, 300))
def test_figures_and_fronts_are_those_of_the_oracle(seed: int) -> None:
    pair = Pair(draw_polled(seed))
    figures_agree(pair)
    found = search_front(pair.evaluator)
    assert found.is_complete
    fronts_agree(pair, found.points)


@pytest.mark.parametrize("seed", [161, *cases(12, 400)])
def test_nothing_that_is_played_leaves_its_bound(seed: int) -> None:
    problem = loads(draw_polled(seed))
    space, rng = problem.space, random.Random(seed)
    for _ in range(3):
        design = tuple(rng.randrange(len(decision.options)) for decision in space.decisions)
        if not Evaluator(space).invalid(design):
            found = simulate(problem, decisions_of(space, design), runs=8, contention=True, seed=seed)
            assert not found.contradictions
