"""Deadlines that hold for all execution times that are stated, against looking at every design at every corner."""

from __future__ import annotations

import random
from collections.abc import Iterator
from fractions import Fraction
from itertools import count, product
from math import ceil, prod
from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.validity import canonical
from dse.analysis.views import View
from dse.encode.scheduling import waiting_forms
from dse.questions.problem import load
from dse.questions.robust.corner_demands import RobustQuestion
from dse.questions.robust.robust import solve_robust
from dse.questions.robust.worst_case import Box
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.uncertainty import read_uncertainties
from dse.search.front import search_front
from tests.helpers.effort import cases
from tests.helpers.support import counted_down, dominates
from tests.helpers.thread_systems import KINDS, draw, text_of
from tests.properties import chained

OBJECTIVES = (
    ("minimise price", "minimise latency of f"),
    ("minimise price", "minimise jitter of f"),
    ("minimise price", "maximise latency of f", "minimise min latency of f"),
)
MOST_DESIGNS = 200
FACTORS = ("1 .. 1.3", "0.7 .. 1.2", "0.5 .. 2")


def places(inputs: InputSpace, box: Box) -> Iterator[list[Fraction]]:
    """The values of all inputs at every corner, and at three places inside."""
    for corner in product((0, 1), repeat=len(box.ends)):
        yield box.values(inputs.nominal, corner)
    source = random.Random(0)
    for _ in range(3):
        values = list(inputs.nominal)
        for item, (low, high) in zip(box.uncertain, box.ends, strict=True):
            item.set(values, low + (high - low) * Fraction(source.randrange(1001), 1000))
        yield values


def expected(problem: dse.Problem) -> set[tuple[int, ...]]:
    """The vectors of designs that are in time at the figures of the file, at every corner and at places inside."""
    inputs = InputSpace(problem)
    box = Box(read_uncertainties(problem, inputs))
    evaluators = [Evaluator(space) for space in (problem.space, *map(inputs.at, places(inputs, box)))]
    found = set()
    raws = product(*(range(len(item.options)) for item in problem.space.decisions))
    for raw in {canonical(problem.space, raw): raw for raw in raws}.values():
        judged = [item.evaluate(raw) for item in evaluators]
        if all(item.is_feasible for item in judged):
            found.add(judged[0].objectives)
    points = {vector: counted_down(problem.space, vector) for vector in found}
    return {vector for vector in found if not any(dominates(other, points[vector]) for other in points.values())}


def drawn(seed: int, kind: str, file: Path) -> Iterator[dse.Problem]:
    """Problems of a kind, two of whose threads may take longer or less."""
    for number in count(1_000 * seed):
        rng = random.Random(f"robust {number} {kind}")
        stated = [f"'threads.t{item}.compute_execution_time': {{factor: {rng.choice(FACTORS)}}}" for item in (0, 1)]
        counted = "response_time" if rng.random() < 0.8 else "execution_time"
        text = text_of(draw(number, kind=kind), rng.choice(OBJECTIVES))
        text = text.replace("processing: execution_time", f"processing: {counted}")
        file.write_text(f"{text}uncertainty: {{{', '.join(stated)}}}\n", "utf-8")
        yield load(file)


def designs(problem: dse.Problem) -> int:
    """How many combinations of options there are."""
    return prod(len(item.options) for item in problem.space.decisions)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(3))
def test_no_design_is_lost_that_is_in_time_at_every_corner(
    kind: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Limits at corners are of other figures: what the search learns of them names all that they hang on."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    problem = next(item for item in drawn(seed, kind, tmp_path / "drawn.yaml") if designs(item) <= MOST_DESIGNS)
    wanted = expected(problem)
    result = solve_robust(problem)
    assert {tuple(point.objectives.values()) for point in result.robust.front} == wanted
    question = RobustQuestion(problem)
    for point in result.robust.front:
        question.expect(point.design)
    again = search_front(question.evaluator())
    assert again.is_complete
    assert wanted <= set(again.points) or not wanted
    if kind in ("chained", "mixed"):
        assert dse.verify(result).status == "verified"


BOUND_AT_SHORTER_TIMES_ONLY = """
dse: 1
name: no bound as stated
overload: allowed
deadlines: all
processor_types:
  slow: {cores: 1, price: 10 EUR}
  fast: {cores: 1, price: 30 EUR}
processors: {c: {type: [slow, fast]}}
devices: {sensor: {period: 3 ms}}
threads:
  t0: {processor: c, compute_execution_time: {slow: 4 ms, fast: 2 ms}, period: 10 ms}
  t1: {processor: c, compute_execution_time: {slow: 4 ms, fast: 3 ms}, dispatch_protocol: [periodic, aperiodic],
       period: 10 ms}
  t2: {processor: c, compute_execution_time: {slow: 2 ms, fast: 1 ms}, period: 8 ms}
connections: {w: {from: sensor, to: t0}, w1: {from: t0, to: t1}, w2: {from: t1, to: t2}}
flows: {f: {path: [sensor, t0, t1, t2]}}
objectives: [minimise price, maximise latency of f, minimise min latency of f]
uncertainty:
  threads.t0.compute_execution_time: {factor: 0.7 .. 1.2}
  threads.t1.compute_execution_time: {factor: 1 .. 1.3}
"""


def test_what_has_no_bound_as_stated_and_one_elsewhere_is_judged() -> None:
    """Before, the robust search gave up: expressions made where nothing is bounded were held against places beside."""
    problem = dse.loads(BOUND_AT_SHORTER_TIMES_ONLY)
    found = solve_robust(problem)
    assert {tuple(point.objectives.values()) for point in found.robust.front} == expected(problem) != set()
    assert dse.verify(found, problem=problem).status == "verified"


def chain_question(seed: int) -> tuple[dict[str, Any], str] | None:
    """A drawn problem of threads that release each other, two of which vary, with a figure of one flow; or None."""
    rng = random.Random(f"robust chains {seed}")
    document = yaml.safe_load(chained.draw(seed))
    del document["metrics"]
    executing = [name for name, body in document["threads"].items() if "compute_execution_time" in body]
    if len(executing) < 2:
        return None
    flow, varied = rng.choice(list(document["flows"])), rng.sample(executing, 2)
    document["flows"] = {flow: document["flows"][flow]}
    document["uncertainty"] = {
        f"threads.{name}.compute_execution_time": {"factor": rng.choice(FACTORS)} for name in varied
    }
    figure = f"{rng.choice(('latency', 'jitter'))} of '{flow}'"
    document["objectives"] = [f"minimise {figure}"]
    return document, figure


def robust_status(document: dict[str, Any], requirement: str) -> str:
    """``complete``, ``infeasible``, or ``refused`` where no proof over the ranges is had."""
    try:
        return solve_robust(dse.loads(yaml.safe_dump({**document, "requirements": [requirement]}))).robust.status
    except dse.UsageError as error:
        assert any(words in str(error) for words in ("rise and fall", "moves in steps", "more comparisons than"))
        return "refused"


@pytest.mark.parametrize("seed", cases(40, 1_000))
def test_a_figure_of_a_chain_is_proved_at_its_greatest(seed: int) -> None:
    """The greatest figure over all corners and some places inside is a limit that holds, and 1 ns less is none."""
    drawn_question = chain_question(seed)
    if drawn_question is None:
        return
    document, figure = drawn_question
    problem = dse.loads(yaml.safe_dump(document))
    if any(len(item.options) > 1 for item in problem.space.decisions):
        return
    inputs = InputSpace(problem)
    box = Box(read_uncertainties(problem, inputs))
    design = tuple(0 for _ in problem.space.decisions)
    spaces = map(inputs.at, places(inputs, box))
    greatest = max(Evaluator(space).objectives[0].value(View(design)) for space in spaces)
    if greatest >= UNBOUNDED_NS / 2:
        return
    assert robust_status(document, f"{figure} <= {ceil(greatest)} ns") in ("complete", "refused")
    assert robust_status(document, f"{figure} <= {ceil(greatest) - 1} ns") in ("infeasible", "refused")


CHAIN = """
dse: 1
name: robust chain
processor_types: {slow: {cores: 1, price: 10 EUR}, fast: {cores: 1, price: 30 EUR}}
processors: {cpu: {type: [slow, fast]}}
threads:
  tick: {processor: cpu, period: 10 ms, compute_execution_time: {slow: 1 ms .. 2 ms, fast: 500 us .. 1 ms}}
  a: {processor: cpu, period: 20 ms, compute_execution_time: {slow: 1 ms, fast: 500 us}}
  b: {processor: cpu, dispatch_protocol: aperiodic, compute_execution_time: {slow: 2 ms, fast: 1 ms}}
  c: {processor: cpu, dispatch_protocol: aperiodic, compute_execution_time: {slow: 1 ms .. 2 ms, fast: 1 ms}}
connections: {ab: {from: a, to: b, latency: 100 us .. 200 us}, bc: {from: b, to: c}}
flows: {f: {path: [a, ab, b, bc, c]}}
objectives: [minimise jitter of f, minimise price]
uncertainty:
  threads.tick.compute_execution_time: {factor: 0.8 .. 1.2}
  threads.b.compute_execution_time: {factor: 0.8 .. 1.2}
"""


def test_threads_that_release_each_other_vary() -> None:
    """On the slow computer 1 + 2.4 + 2 ms of their own, 2.4 ms of the timer and 0.2 ms on the way: 8 ms."""
    fronts = []
    for most in ("8 ms", "7.999 ms"):
        problem = dse.loads(f"{CHAIN}requirements: ['latency of f <= {most}']")
        result = solve_robust(problem)
        assert dse.verify(result, problem=problem).status == "verified"
        fronts.append({point.decisions["cpu.type"] for point in result.robust.front})
    assert fronts == [{"slow", "fast"}, {"fast"}]


LOST_INPUT = """
dse: 1
name: a join that loses an input
overload: allowed
processor_types: {c: {cores: 2, price: 10 EUR}}
processors: {p: {type: c}}
devices: {d0: {period: 100 ms}, d1: {period: 30 ms}}
threads:
  hog: {processor: p, core: 1, priority: 9, period: 20 ms, compute_execution_time: 1 ms .. 10 ms}
  slow: {processor: p, core: 1, priority: 1, dispatch_protocol: aperiodic, compute_execution_time: 1 ms .. 40 ms}
  both: {processor: p, core: 2, priority: 5, dispatch_protocol: aperiodic, join: all, queue_size: 1,
         compute_execution_time: 4 ms}
  low: {processor: p, core: 2, priority: 1, period: 200 ms, compute_execution_time: 10 ms}
connections: {c0: {from: d0, to: slow}, c1: {from: slow, to: both}, c2: {from: d1, to: both}}
flows: {f: {path: [low]}}
requirements: [latency of f <= LIMIT]
objectives: [minimise latency of f]
uncertainty: {threads.hog.compute_execution_time.max: {range: 10 ms .. MOST}}
"""


def test_a_join_that_loses_an_input_is_refused() -> None:
    """With 12 ms of `hog` the slow input is late by up to 100 ms, so that `both` runs thrice before `low` has ended.

    With 13 ms it has no bound: the other input counts the jobs of `both`, and `low` responds within 18 ms as with 10.
    """
    for most, limit, status in (("12 ms", "22 ms", "complete"), ("12 ms", "21 ms", "infeasible")):
        text = LOST_INPUT.replace("MOST", most).replace("LIMIT", limit)
        assert solve_robust(dse.loads(text)).robust.status == status
    with pytest.raises(dse.UsageError, match="has no bound in part of the stated ranges, where the jobs of a thread"):
        solve_robust(dse.loads(LOST_INPUT.replace("MOST", "13 ms").replace("LIMIT", "21 ms")))


def test_an_order_that_may_change_with_a_period_is_refused() -> None:
    """By its rate `a` goes first while its period is below 10 ms, else `b`: `a` responds within 1 or 3 ms."""
    text = """
dse: 1
name: an order that changes
deadlines: none
processor_types: {c: {cores: 1, price: 10 EUR}}
processors: {p: {type: c}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 1 ms}
  b: {processor: p, period: 10 ms, compute_execution_time: 2 ms}
flows: {f: {path: [a]}}
requirements: [latency of f <= 2.5 ms]
objectives: [minimise latency of f]
uncertainty: {threads.a.period: {range: 7 ms .. PERIOD}}
"""
    assert (
        solve_robust(
            dse.loads(
                text.replace("10 ms, compute_execution_time: 1 ms", "9 ms, compute_execution_time: 1 ms").replace(
                    "PERIOD", "9 ms"
                )
            )
        ).robust.status
        == "complete"
    )
    with pytest.raises(dse.UsageError, match=r"moves in steps .* one value of threads\.a\.period"):
        solve_robust(dse.loads(text.replace("PERIOD", "12 ms").replace("2.5 ms]", "4 ms]")))
