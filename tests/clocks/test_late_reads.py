"""Jobs that read when they begin: minima, jitter and ages against simulation, and fronts against exhaustion."""

from __future__ import annotations

import json
import random
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.encode.scheduling import waiting_forms
from dse.search.front import search_front
from tests.clocks import let
from tests.clocks.test_disparity import fusion
from tests.helpers.effort import cases
from tests.helpers.support import counted_down, dominates, evaluated


def contend(rng: random.Random, data: dict[str, Any]) -> dict[str, Any]:
    """Threads of different urgency on one core, most of which read when they begin."""
    for thread in data["threads"].values():
        if rng.random() < 0.8:
            thread["communication"] = rng.choice(["implicit", "implicit", "implicit", "at_dispatch"])
        most = rng.randint(1, max(1, int(thread["period"].split()[0]) * 700 // len(data["threads"])))
        thread["compute_execution_time"] = f"{rng.randint(0, most)} us .. {most} us"
        thread["priority"] = rng.randint(1, 4)
        if rng.random() < 0.15:
            thread["offset"] = "unknown"
        if rng.random() < 0.2:
            thread["non_preemptive"] = f"{most // 2 + 1} us"
    return data | {"clocks": {"k": {}}, "processing": "response_time", "deadlines": "none", "overload": "allowed"}


@pytest.mark.parametrize("seed", cases(14, 3_000))
def test_no_simulation_leaves_the_bounds(seed: int) -> None:
    """Nor the exact ones. 93 of 600 such chains were below their minima when jobs were taken to read at releases."""
    rng = random.Random(f"begin {seed}")
    data = contend(rng, let.problem(let.drawn(rng)) if rng.random() < 0.7 else fusion(rng)[0])
    found = dse.simulate(data, runs=4, contention=True, offsets="worst", seed=seed)
    assert not found.contradictions, (data, found.contradictions)
    space = dse.load(data).space
    exact = Evaluator(space).metric_values(tuple(0 for _ in space.decisions))
    for flow in found.flows:
        if flow.latencies and not flow.excuse:
            assert exact[f"min latency of {flow.name}"] <= exact[f"exact min latency of {flow.name}"]
            assert exact[f"exact min latency of {flow.name}"] <= min(flow.latencies), data
            assert exact[f"exact latency of {flow.name}"] >= max(flow.latencies), data


def test_what_comes_before_a_job_begins_is_read_by_it() -> None:
    """B is released with a, behind it on one core: what a makes after 1 to 2 ms is there when b begins."""
    data = let.problem([(0, 20, 20), (0, 20, 20)]) | {"processing": "response_time"}
    for thread in data["threads"].values():
        thread["compute_execution_time"] = "1 ms .. 2 ms"
    bounds = {}
    for kind in ("implicit", "at_dispatch", "let"):
        data["threads"]["t0"]["communication"] = "implicit"
        data["threads"]["t1"]["communication"] = kind
        [flow] = dse.simulate(data, runs=4, seed=1).flows
        bounds[kind] = tuple(int(end) // 1_000_000 for end in flow.bounds_ns)
        assert min(flow.latencies) < 6_000_000 if kind == "implicit" else min(flow.latencies) >= 21_000_000
    assert bounds == {"implicit": (2, 24), "at_dispatch": (21, 24), "let": (40, 40)}


def timers(rng: random.Random, names: list[str]) -> dict[str, Any]:
    """Timers, some offsets and one place open; response times are stated of some."""
    threads: dict[str, Any] = {}
    for name in names:
        body: dict[str, Any] = {"processor": rng.choice(["left", "left", "right", ["left", "right"]])}
        body["period"] = rng.choice(["4 ms", "6 ms", "8 ms", "12 ms"])
        body["offset"] = rng.choice([["0 ms", "3 ms"], ["0 ms", "1 ms", "2500 us"], "1 ms", "unknown"])
        body["compute_execution_time"] = rng.choice(["1 ms", "500 us .. 1700 us", "1 ms .. 2 ms"])
        if rng.random() < 0.3:
            body["communication"] = rng.choice(["let", ["let", "implicit"], "at_dispatch", ["at_dispatch", "implicit"]])
        if rng.random() < 0.2:
            body["response_time"] = rng.choice(["2 ms .. 3 ms", "4500 us .. 4500 us"])
        if rng.random() < 0.25:
            body["priority"] = rng.randint(1, 5)
        threads[name] = body
    for name in [name for name in names if isinstance(threads[name]["offset"], list)][2:]:
        threads[name]["offset"] = "2 ms"
    for name in [name for name in names if isinstance(threads[name]["processor"], list)][1:]:
        threads[name]["processor"] = "left"
    if rng.random() < 0.2:
        threads[rng.choice(names)]["offset"] = "any"
    return threads


def drawn(rng: random.Random) -> dict[str, Any]:
    """Timers on one or two computers in two flows, whose response times may count."""
    names = ["a", "b", "c", "d"][: rng.randint(3, 4)]
    threads = timers(rng, names)
    shared = {"clock": "k"} if rng.random() < 0.5 else {}
    error = {"synchronisation_error": "200 us"} if rng.random() < 0.3 else {"source": "none"}
    data: dict[str, Any] = {
        "dse": 1, "name": "late", "offset_grid": "2 ms", "overload": "allowed", "clocks": {"k": error},
        "deadlines": "none", "processing": rng.choice(["response_time", "response_time", "execution_time"]),
        "processor_types": {"small": {"price": "5 EUR", "cores": rng.choice([1, 1, 2])}},
        "processors": {side: {"type": "small", **shared, "optional": True} for side in ("left", "right")},
        "threads": threads, "connections": {}, "flows": {},
        "metrics": {
            "mixed": "latency of f0 - 2 * min latency of f0", "slack": "jitter of f1 - 2 * latency of f1",
        },
    }  # fmt: skip
    for number in range(2):
        path = sorted(rng.sample(names, rng.randint(2, len(names))))
        data["flows"][f"f{number}"] = {"path": path}
        for one, other in pairwise(path):
            data["connections"][f"{one}{other}"] = {"from": one, "to": other}
    kinds = ["latency", "min latency", "jitter", "run jitter", "exact min latency", "exact jitter", "data age"]
    asked = [f"{rng.choice(['minimise', 'maximise'])} {rng.choice(kinds)} of f{rng.randrange(2)}" for _ in range(2)]
    if rng.random() < 0.2:
        asked[1] = "minimise mixed"
    if rng.random() < 0.2:
        asked[0] = "maximise slack"
    data["objectives"] = list({text.split(" ", 1)[1]: text for text in asked}.values())
    if rng.random() < 0.5:
        bound = f"{rng.choice(['<=', '>='])} {rng.randint(2, 30)} ms"
        data["requirements"] = [f"{rng.choice(kinds[:5])} of f0 {bound}"]
    return data


LOST = json.loads((Path(__file__).parent / "falling_terms.json").read_text(encoding="utf-8"))
"""A problem whose front lacked designs where what waits less for longer response times was taken to wait more."""


@pytest.mark.parametrize("data", [*LOST, *(drawn(random.Random(f"late {seed}")) for seed in cases(10, 3_000))])
def test_fronts_equal_exhaustion(data: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """With response times learnt, too: data that come later wait less, so that terms may fall where these grow."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    evaluator = Evaluator(dse.load(data).space)
    found = search_front(evaluator)
    assert found.is_complete
    feasible = {item.objectives for item in evaluated(evaluator).values() if item.is_feasible}
    points = {vector: counted_down(evaluator.space, vector) for vector in feasible}
    assert set(found.points) == {
        one for one, mine in points.items() if not any(dominates(other, mine) for other in points.values())
    }


@pytest.mark.parametrize("seed", [*cases(2, 200), 904_007])
@pytest.mark.parametrize("method", ["exhaustion", "model"])
def test_they_are_proved_again(seed: int, method: Literal["exhaustion", "model"], tmp_path: Path) -> None:
    """The front of the last has two points without a bound in anything: of different sums, so that none is better."""
    (tmp_path / "p.json").write_text(json.dumps(drawn(random.Random(f"late again {seed}"))), encoding="utf-8")
    result = dse.solve(tmp_path / "p.json")
    (tmp_path / "r.json").write_text(result.to_json(), encoding="utf-8")
    assert dse.verify(tmp_path / "r.json", method=method).status == "verified"
