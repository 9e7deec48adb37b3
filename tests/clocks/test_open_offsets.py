"""Offsets as decisions: fronts equal exhaustion, each proved again by formulas that share nothing with the search."""

from __future__ import annotations

import json
import random
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency import contributors, metrics
from dse.report.words.reasons import proof_words
from dse.search.front import SearchLimits, search_front
from dse.search.solver.settings import SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer
from tests.clocks import let
from tests.helpers.effort import cases
from tests.helpers.support import counted_down, dominates, evaluated
from tests.oracle.generator import to_yaml
from tests.properties.pair import Pair
from tests.properties.test_against_oracle import fronts_agree


def drawn(rng: random.Random) -> dict[str, Any]:
    """Three or four timers on one or two clocks, their offsets open, some periods too, and two flows through them."""
    names = ["a", "b", "c", "d"][: rng.randint(3, 4)]
    threads: dict[str, Any] = {}
    for name in names:
        body: dict[str, Any] = {"processor": rng.choice(["left", "left", "right"])}
        body["period"] = rng.choice(["4 ms", "6 ms", "8 ms", "12 ms"])
        body["offset"] = rng.choice(["any", "any", ["0 ms", "3 ms"], "1 ms"])
        body["compute_execution_time"] = rng.choice(["1 ms", "500 us .. 1700 us", "1 ms .. 5 ms"])
        if rng.random() < 0.6:
            body["communication"] = rng.choice(["let", "let", ["let", "implicit"]])
        threads[name] = body
    threads[names[0]]["period"] = rng.choice([["4 ms", "12 ms"], "6 ms"])
    if rng.random() < 0.3:
        threads[names[1]]["processor"] = ["left", "right"]
    shared = {"clock": "k"} if rng.random() < 0.5 else {}
    error = {"synchronisation_error": "200 us"} if rng.random() < 0.3 else {"source": "none"}
    data: dict[str, Any] = {
        "dse": "1", "name": "offsets", "offset_grid": "2 ms", "overload": "allowed", "clocks": {"k": error},
        "processor_types": {"small": {"price": "5 EUR", "cores": "4"}},
        "processors": {side: {"type": "small", **shared, "optional": "true"} for side in ("left", "right")},
        "threads": threads, "connections": {}, "flows": {},
    }  # fmt: skip
    for number in range(2):
        path = sorted(rng.sample(names, rng.randint(2, len(names))))
        data["flows"][f"f{number}"] = {"path": path}
        for one, other in pairwise(path):
            data["connections"][f"{one}{other}"] = {"from": one, "to": other}
    kinds = ["latency", "min latency", "jitter", "run jitter", "reaction time", "data age"]
    asked = [f"{rng.choice(kinds)} of f{rng.randrange(2)}" for _ in range(2)]
    objectives = [f"{rng.choice(['minimise', 'minimise', 'maximise'])} {metric}" for metric in dict.fromkeys(asked)]
    data["objectives"] = [*objectives, rng.choice(["minimise price", "minimise max(latency)", "minimise utilisation"])]
    if rng.random() < 0.5:
        data["requirements"] = [f"{rng.choice(kinds[:4])} of f0 <= {rng.randint(8, 30)} ms"]
    return data


@pytest.mark.parametrize("seed", cases(25))
def test_fronts_equal_exhaustion(seed: int) -> None:
    pair = Pair(to_yaml(drawn(random.Random(f"offsets {seed}"))))
    found = search_front(pair.evaluator)
    assert found.is_complete
    fronts_agree(pair, found.points)


@pytest.mark.parametrize("seed", cases(4))
def test_they_are_proved_again(seed: int, tmp_path: Path) -> None:
    text = to_yaml(drawn(random.Random(f"offsets {seed}")))
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
    result = dse.solve(tmp_path / "p.yaml")
    (tmp_path / "r.json").write_text(result.to_json(), encoding="utf-8")
    for method in ("exhaustion", "model"):
        assert dse.verify(tmp_path / "r.json", method=method).status == "verified", method


@pytest.mark.parametrize("seed", cases(5))
def test_stopped_fixed_and_by_several(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same front where a search goes on after a stop; that of an offset which is fixed; by several workers."""
    rng = random.Random(f"offsets {seed}")
    problem = dse.load(to_yaml(drawn(rng)))
    whole = dse.solve(problem)
    stop, solve, asked = rng.randint(1, 4), Strategy._solve_whole, list[bool]()

    def stopping(self: Strategy, settings: SolverSettings, work: float) -> Answer:
        asked.append(True)
        if len(asked) >= stop:
            self.stop()
        return solve(self, settings, work)

    with monkeypatch.context() as changed:
        changed.setattr(Strategy, "_solve_whole", stopping)
        (tmp_path / "r.json").write_text(dse.solve(problem).to_json(), encoding="utf-8")
    again = dse.resume(tmp_path / "r.json", workers=2)
    assert isinstance(again, dse.Result)
    assert (again.status, again.front, again.refuted) == (whole.status, whole.front, whole.refuted)
    offsets = [item for item in problem.space.decisions if item.name.endswith(".offset") and item.is_open]
    for item in offsets[:1]:
        fixed = problem.ask(fix=f"{item.name} = {rng.choice(item.options)}")
        found = search_front(Evaluator(fixed.space), SearchLimits(workers=2))
        allowed = fixed.space.fixed
        expected = {
            evaluation.objectives
            for design, evaluation in evaluated(Evaluator(problem.space)).items()
            if evaluation.is_feasible and all(design[number] in (option, -1) for number, option in allowed.items())
        }
        points = {vector: counted_down(problem.space, vector) for vector in expected}
        assert set(found.points) == {
            one for one, mine in points.items() if not any(dominates(other, mine) for other in points.values())
        }


@pytest.mark.parametrize("method", ["exhaustion", "model"])
def test_a_wrong_wait_is_seen_by_the_second_proof(
    method: Literal["exhaustion", "model"], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The analysis counts a period where a read is met; the releases say otherwise."""
    data = let.problem([(0, 20, 20), (0, 20, 20)]) | {"objectives": ["minimise latency of chain"]}
    data["threads"]["t1"]["offset"] = ["0 ms", "4 ms"]
    (tmp_path / "p.yaml").write_text(json.dumps(data), encoding="utf-8")
    right = contributors.wait_ns
    monkeypatch.setattr(contributors, "wait_ns", lambda pair, *ends: (right(pair, *ends)[0], pair.receiver_ns))
    monkeypatch.setattr(metrics, "phased_of", lambda *_: None)
    (tmp_path / "r.json").write_text(dse.solve(tmp_path / "p.yaml").to_json(), encoding="utf-8")
    found = dse.verify(tmp_path / "r.json", method=method)
    assert found.status == "rejected"
    assert "60000000 ns by the analysis, but 40000000 release by release" in found.findings[0].text


def test_what_is_proved_is_proved_on_the_grid() -> None:
    data = let.problem([(0, 20, 20), (0, 20, 20)]) | {
        "offset_grid": "1 ms",
        "objectives": ["minimise latency of chain"],
    }
    assert proof_words(dse.solve(data)) == "Pareto front, proved complete: 1 non-dominated design."
    data["threads"]["t1"]["offset"] = "any"
    said = "Pareto front, proved complete: 1 non-dominated design, offsets on a grid of 1 ms."
    assert proof_words(dse.solve(data)) == said


def many(seed: int = 0) -> dict[str, Any]:
    """30 threads on two computers with a clock each, six flows of six, offsets on a grid of 1 ms."""
    rng = random.Random(seed)
    threads: dict[str, Any] = {}
    for number in range(30):
        period = [f"{time} ms" for time in rng.sample([5, 10, 20, 40], 2 if number % 3 == 0 else 1)]
        threads[f"t{number}"] = {
            "processor": "left" if number < 15 else "right", "period": period, "offset": "any", "communication": "let",
            "compute_execution_time": f"{rng.randint(50, 150)} us",
        }  # fmt: skip
    flows = {f"f{k}": {"path": [f"t{number}" for number in sorted(rng.sample(range(30), 6))]} for k in range(6)}
    pairs = {pair for flow in flows.values() for pair in pairwise(flow["path"])}
    return {
        "dse": 1, "name": "many", "offset_grid": "1 ms", "processor_types": {"small": {}},
        "processors": {"left": {"type": "small"}, "right": {"type": "small"}}, "threads": threads, "flows": flows,
        "connections": {f"{one}_{other}": {"from": one, "to": other} for one, other in sorted(pairs)},
        "objectives": ["minimise max(latency)", "minimise max(utilisation)"],
    }  # fmt: skip


def test_thirty_threads_and_six_flows_are_proved() -> None:
    problem = dse.load(many())
    found = search_front(Evaluator(problem.space))
    assert found.is_complete and len(found.points) > 1
    asynchronous = json.loads(json.dumps(many()).replace('"any"', '"unknown"'))
    other = search_front(Evaluator(dse.load(asynchronous).space))
    assert min(found.points) < min(other.points)
