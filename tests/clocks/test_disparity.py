"""The disparity of a fusion's inputs, against chains that are followed job by job, and against exhaustion."""

from __future__ import annotations

import json
import random
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from math import lcm
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.measures import Measure, build_measure, scaled_term
from dse.analysis.views import View
from dse.questions.verbs import simulate as simulated
from dse.report.content.simulate import simulation_page
from dse.report.page import Table
from dse.search.front import search_front
from dse.space.question.metrics import QuestionError, disparities
from tests.clocks import let
from tests.helpers.effort import cases
from tests.oracle.generator import to_yaml
from tests.properties.pair import Pair
from tests.properties.test_against_oracle import figures_agree, fronts_agree

Job = tuple[int, int]


def fusion(rng: random.Random) -> tuple[dict[str, Any], list[list[str]]]:
    """Two chains under logical execution time, from a sensor each or from one, that meet at one reader."""
    chain = let.drawn(rng) + let.drawn(rng)
    data = let.problem(chain)
    names = list(data["threads"])
    reader, others = names[-1], names[:-1]
    cut = rng.randint(1, len(others) - 1)
    ways = [[*others[:cut], reader], [*others[cut:], reader]]
    if rng.random() < 0.3 and len(ways[1]) > 2:
        ways[1] = [ways[0][0], *ways[1][1:]]
    used = {name for way in ways for name in way}
    data["threads"] = {name: body for name, body in data["threads"].items() if name in used}
    pairs = dict.fromkeys((one, other) for way in ways for one, other in pairwise(way))
    data["connections"] = {f"{one}_{other}": {"from": one, "to": other} for one, other in pairs}
    data["flows"] = {f"way{number}": {"path": way} for number, way in enumerate(ways)}
    return data, ways


def ages(data: dict[str, Any], way: list[str], until: int, warm: int) -> dict[int, int]:
    """For each release of the last component from `warm` on, how old the sample is that it reads."""

    def read(name: str, key: str) -> int:
        return int(data["threads"][name][key].split()[0])

    written: list[Job] = []  # when, and of which sample
    for position, name in enumerate(way):
        offset, period, deadline = (read(name, key) for key in ("offset", "period", "deadline"))
        found: list[Job] = []
        reads: dict[int, int] = {}
        at = 0
        for release in range(offset, until, period):
            if position:
                while at < len(written) and written[at][0] <= release:
                    at += 1
                if not at:
                    continue
                reads[release] = release - written[at - 1][1]
            found.append((release + deadline, written[at - 1][1] if position else release))
        written = found
    return {release: age for release, age in reads.items() if release >= warm}


@pytest.mark.parametrize("seed", cases(30))
def test_no_observation_exceeds_it(seed: int) -> None:
    data, ways = fusion(random.Random(f"fusion {seed}"))
    problem = dse.load(data)
    try:
        [metric] = disparities(problem.space, ways[0][-1])
    except QuestionError:
        assert ways[0][:-1] == ways[1][:-1]
        return
    view = View([0] * len(problem.space.decisions))
    bound = build_measure(problem.space, metric).value(view) / 10**6
    times = [int(body["period"].split()[0]) for body in data["threads"].values()]
    warm = 40 * max(times)
    until = warm + 2 * lcm(*times)
    one, other = (ages(data, way, until, warm) for way in ways)
    observed = max(abs(one[release] - other[release]) for release in one)
    assert observed <= bound
    if all(len(way) == 2 for way in ways):
        spans = [[max(found.values()), min(found.values())] for found in (one, other)]
        assert bound == max(spans[0][0] - spans[1][1], spans[1][0] - spans[0][1])


def test_it_is_the_difference_of_the_oldest_and_the_newest(tmp_path: Path) -> None:
    """A camera of 30 ms and a radar of 20 ms, read every 60 ms at 5 ms: 30 + 5 at most, 5 at least, and so on."""
    data = let.problem([(0, 30, 10), (0, 20, 3), (5, 60, 60)])
    data["connections"] = {"camera": {"from": "t0", "to": "t2"}, "radar": {"from": "t1", "to": "t2"}}
    data["flows"] = {"camera": {"path": ["t0", "t2"]}, "radar": {"path": ["t1", "t2"]}}
    data["objectives"] = ["minimise disparity of t2"]
    data["threads"]["t2"]["offset"] = ["5 ms", "15 ms"]
    data["requirements"] = ["disparity of t2 <= 40 ms"]
    (tmp_path / "p.yaml").write_text(json.dumps(data), encoding="utf-8")
    found = dse.solve(tmp_path / "p.yaml")
    # at 15 ms: the camera's frame is 15 ms old (released at 0, there at 10), the radar's 15 ms (there at 3)
    # at 5 ms: the camera's is 35 ms old, the radar's 5 ms
    assert [(point.decisions, dict(point.objectives)) for point in found.front] == [
        ({"t2.offset": "15 ms"}, {"disparity of t2": 0})
    ]
    assert dse.verify(found).status == "verified"


def asked(rng: random.Random) -> dict[str, Any]:
    """A fusion with offsets to choose, some unknown, parts that events dispatch, and a second clock."""
    data, ways = fusion(rng)
    names = list(data["threads"])
    for name in rng.sample(names, 2):
        data["threads"][name]["offset"] = "any"
    for name in rng.sample(names, 2):
        if rng.random() < 0.3:
            data["threads"][name]["offset"] = "unknown"
    body = data["threads"][rng.choice(names)]
    body["communication"] = ["let", "implicit"]
    body["compute_execution_time"] = "1 ms .. 2 ms"
    inner = [name for way in ways for name in way[1:-1]]
    if inner and rng.random() < 0.5:
        thread = data["threads"][rng.choice(inner)]
        for key in ("period", "offset", "communication", "deadline"):
            thread.pop(key, None)
        thread |= {"dispatch_protocol": "aperiodic", "compute_execution_time": "300 us .. 2 ms"}
    if rng.random() < 0.5:
        data["processors"] |= {"other": {"type": "any", "clock": "k"}}
        data["processors"]["computer"]["clock"] = rng.choice(["k", "k", "l"])
        data["threads"][rng.choice(names)]["processor"] = "other"
    data["clocks"] = {"k": {"synchronisation_error": rng.choice(["0 ns", "100 us"])}, "l": {}}
    data |= {"offset_grid": "3 ms", "overload": "allowed", "deadlines": "none"}
    data["objectives"] = [f"minimise disparity of {ways[0][-1]}", "minimise max(latency)"]
    if rng.random() < 0.5:
        data["requirements"] = [f"disparity of {ways[0][-1]} <= {rng.randint(5, 60)} ms"]
    return data


@pytest.mark.parametrize("seed", cases(12))
def test_figures_and_fronts_equal_exhaustion_by_the_oracle(seed: int, tmp_path: Path) -> None:
    """Each design's figures, the front, and what the second proofs say of it."""
    data = asked(random.Random(f"fusions {seed}"))
    text = to_yaml(texts(data))
    try:
        pair = Pair(text)
    except dse.ProblemError as error:
        assert "meet" in str(error)  # both ways are one
        return
    if pair.combinations > 3000:
        return
    figures_agree(pair)
    found = search_front(pair.evaluator)
    assert found.is_complete
    fronts_agree(pair, found.points)
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
    result = dse.solve(tmp_path / "p.yaml")
    for method in ("exhaustion", "model"):
        assert dse.verify(result, method=method).status == "verified"


def texts(data: Any) -> Any:
    """A document of texts, as the oracle reads it."""
    if isinstance(data, dict):
        return {key: texts(value) for key, value in data.items()}
    return list(map(texts, data)) if isinstance(data, list) else str(data)


def test_where_nothing_meets_it_is_refused() -> None:
    data = let.problem([(0, 20, 20), (0, 20, 20)])
    for text in ("disparity", "disparity of t1"):
        with pytest.raises(dse.ProblemError, match="inputs whose ages can be compared meet"):
            dse.load(data | {"objectives": [f"minimise {text}"]})
    data["threads"]["t1"] |= {"dispatch_protocol": ["periodic", "aperiodic"], "communication": "implicit"}
    with pytest.raises(dse.ProblemError, match='no timer releases "t1" in every design'):
        dse.load(data | {"objectives": ["minimise disparity of t1"]})


@pytest.mark.parametrize("seed", cases(12))
def test_no_simulation_exceeds_it(seed: int) -> None:
    """A second witness: implicit parts, unknown offsets, shared cores or drifting clocks."""
    rng = random.Random(f"witness {seed}")
    data, _ = fusion(rng)
    for thread in data["threads"].values():
        if rng.random() < 0.4:
            del thread["communication"]
            most = rng.randint(0, int(thread["period"].split()[0]) * 300)
            thread["compute_execution_time"] = f"{rng.randint(0, most)} us .. {most} us"
        if rng.random() < 0.3:
            thread["offset"] = "unknown"
    data |= {"clocks": {"k": {}}, "overload": "allowed", "deadlines": "none"}
    contended = rng.random() < 0.5
    drift = 0 if contended else rng.choice([0, 200])
    found = dse.simulate(data, runs=6, contention=contended, offsets="random", seed=seed, drift_ppm=drift)
    assert not found.contradictions, (data, found.contradictions)


def test_what_a_simulation_sees_is_told_and_refutes_a_bound_that_is_too_small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera of 30 ms and a radar of 20 ms, read every 60 ms: 30 ms apart at 5 ms, whatever their times."""
    data = let.problem([(0, 30, 10), (0, 20, 3), (5, 60, 60)])
    data["connections"] = {"camera": {"from": "t0", "to": "t2"}, "radar": {"from": "t1", "to": "t2"}}
    data["flows"] = {"camera": {"path": ["t0", "t2"]}, "radar": {"path": ["t1", "t2"]}}
    found = dse.simulate(data, runs=2)
    [seen] = found.disparities
    assert (seen.name, seen.observed_ns, seen.bound_ns, found.contradictions) == ("t2", 30_000_000, 30_000_000, ())
    assert found.to_dict()["disparities"]["t2"]["observed_ns"] == 30_000_000
    tables = [block for block in simulation_page(found).sections[0].blocks if isinstance(block, Table)]
    assert ("t2", "30 ms", "30 ms", "within") in [tuple(row) for table in tables for row in table.rows]
    right = simulated.build_measure
    monkeypatch.setattr(simulated, "build_measure", lambda space, metric: scaled(right(space, metric)))
    assert dse.simulate(data, runs=2).contradictions == ("disparity of t2: observed 30000000 ns, analysed 15000000 ns",)


def scaled(measure: Measure) -> Measure:
    """Half of it."""
    return replace(measure, terms=tuple(scaled_term(term, Fraction(1, 2)) for term in measure.terms))
