"""What `dse check` says that no design can meet, against looking at every design; where it stands, and both figures."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest

import dse
from dse.analysis.bounds import Ends, best_possible, impossible
from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import build_limit
from dse.analysis.views import View
from dse.questions.problem import loads
from dse.report.content.explain import impossible_words
from dse.space.model.criteria import Requirement
from dse.space.model.space import Space
from dse.space.question.settings import deadline_requirements
from dse.support.errors import ProblemError
from tests.helpers.effort import cases, count
from tests.helpers.support import evaluated
from tests.oracle.generator import random_problem

PROBLEM = """dse: 1
name: bounds
thread_types:
  quick: {compute_execution_time: 1 ms .. 3 ms, deadline: 4 ms}
  slow: {compute_execution_time: 5 ms .. 9 ms, deadline: 8 ms}
  late: {compute_execution_time: 2 ms .. 6 ms, deadline: 5 ms}
processor_types: {cpu: {price: 5 EUR}}
processors: {p: {type: cpu}}
devices: {sensor: {period: 50 ms, deadline: 1 ms}}
threads:
  a: {processor: p, period: [20 ms, 40 ms], type: [quick, slow]}
  b: {processor: p, period: 20 ms, type: [slow, late]}
  c: {processor: p, period: 20 ms, compute_execution_time: 2 ms .. 7 ms, deadline: 6 ms}
connections: {in: {from: sensor, to: a}, ab: {from: a, to: b}, bc: {from: b, to: c}}
flows: {f: {path: [a, b, c], latency: 0 ms .. 40 ms}}
requirements:
  - jitter of f <= 70 ms
  - latency of f >= 200 ms
  - price <= 4 EUR
objectives: [minimise latency of f]
processing: execution_time
"""


def tightened(space: Space, rng: random.Random) -> list[Requirement]:
    """The requirements of a space with their limits moved to and fro."""
    found = []
    for item in space.requirements:
        factor = rng.choice([1, 2, 4, 20]) if item.operator[0] == "<" else rng.choice([1, 2, 10])
        value = item.limit.value / factor if item.operator[0] == "<" else item.limit.value * factor
        found.append(replace(item, limit=replace(item.limit, value=value)))
    return found


@pytest.mark.parametrize("seed", cases(30))
def test_no_design_meets_what_is_called_impossible(seed: int) -> None:
    """Requirements of every kind and operator, and deadlines, with contention counted and without."""
    rng = random.Random(seed)
    try:
        space = loads(random_problem(seed, "tiny")).space
    except ProblemError:
        return
    space = replace(space, processing=rng.choice(["execution_time", "response_time"]), deadlines="all", open_cores=())
    wanted = (*tightened(space, rng), *deadline_requirements(space, lambda _: ""))
    asked = replace(space, requirements=wanted, objectives=())
    called = [item.requirement for item in impossible(Evaluator(asked).limits, Ends(asked))]
    seen = [item for item in evaluated(Evaluator(asked)).values() if not item.breaches]
    for evaluation in seen:
        for verdict in evaluation.verdicts:
            assert not (verdict.holds and any(verdict.requirement is item for item in called)), verdict
    for found in impossible(Evaluator(asked).limits, Ends(asked)):
        limit = build_limit(asked, found.requirement)  # a verdict has the figures of the core that decides
        values = [limit.measure.value(View(item.design)) for item in seen]
        assert all(found.value <= value if found.side == "least" else found.value >= value for value in values)


def test_random_requirements_are_of_both_kinds() -> None:
    counts = [0, 0]
    for seed in cases(120):
        try:
            space = loads(random_problem(seed, "tiny")).space
        except ProblemError:
            continue
        wanted = tightened(space, random.Random(seed))
        called = list(
            impossible(Evaluator(limited := replace(space, requirements=tuple(wanted))).limits, Ends(limited))
        )
        counts[0] += len(called)
        counts[1] += len(wanted) - len(called)
    assert min(counts) >= max(1, count(120) // 2)


def test_each_is_said_with_its_place_and_both_figures(tmp_path: Path) -> None:
    """Thread c needs 7 ms and has 6, b is late in either type; a is not where it is quick."""
    file = tmp_path / "p.yaml"
    file.write_text(PROBLEM, encoding="utf-8")
    found = dse.check(file)
    alone, over = "its own work takes", "the deadline is"
    parts = "c 27 ms, b 26 ms, a 3 ms", "b 29 ms, c 27 ms, a 9 ms"
    said = [impossible_words(item, "EUR").replace(str(file), "p.yaml") for item in found.impossible]
    assert said == [
        f"no design meets latency of f <= 40 ms (p.yaml:15): it is at least 56 ms, the limit is 40 ms: {parts[0]}",
        f"no design meets response time of b <= its deadline (p.yaml:12): {alone} 9 ms at its longest, {over} 8 ms",
        f"no design meets response time of c <= its deadline (p.yaml:13): {alone} 7 ms at its longest, {over} 6 ms",
        f"no design meets latency of f >= 200 ms (p.yaml:18): it is at most 65 ms, the limit is 200 ms: {parts[1]}",
        "no design meets price <= 4 EUR (p.yaml:19): it is at least 5 EUR, the limit is 4 EUR: p 5 EUR",
    ]
    data = found.to_dict()["impossible"]
    assert data[0] == {"requirement": "latency of f <= 40 ms", "origin": f"{file}:15", "unit": "ns"} | {
        "least": "56000000", "limit": "40000000",
    }  # fmt: skip
    assert "most" in data[3]


def test_settings_that_change_what_is_stated_are_remarked() -> None:
    def remarks(more: str = "", **settings: str) -> str:
        return " | ".join(dse.check(loads(PROBLEM + more), **settings).remarks)

    assert "no deadline counts of what runs on no processor: sensor" in remarks()
    assert "changes nothing" in remarks(profile="osate-2.2", processing="response_time")
    assert "changes nothing" not in remarks(processing="response_time")
    assert not dse.check(loads(PROBLEM), deadlines="none").impossible[3:]


@pytest.mark.parametrize("seed", cases(30, 6))
def test_no_design_is_better_than_the_best_possible(seed: int) -> None:
    """Of every metric, whichever sense it is asked in."""
    try:
        space = loads(random_problem(seed, "tiny")).space
    except ProblemError:
        return
    evaluator = Evaluator(space)
    designs = [View(item.design) for item in evaluated(evaluator).values() if not item.breaches]
    for measure in (*evaluator.metrics, *evaluator.objectives):
        values = [measure.integer(design) for design in designs]
        least, most = (best_possible(space, measure, sense) for sense in ("minimise", "maximise"))
        assert least is not None and all(least <= value for value in values)
        assert most is not None and all(value <= most for value in values)
