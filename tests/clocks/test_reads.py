"""Flows over readers on one clock beside response times: the search counts from read to read."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.encode.scheduling import waiting_forms
from dse.questions.robust.robust import solve_robust
from dse.search.front import ANYTHING, FrontSearch, SearchLimits, search_front
from dse.support.errors import UsageError
from dse.verification import tables
from tests.helpers.documents import ROOT
from tests.helpers.effort import cases
from tests.helpers.support import counted_down, dominates, evaluated
from tests.scheduling.test_robust import MOST_DESIGNS, designs, expected

KINDS = ("latency", "jitter")


def drawn(rng: random.Random) -> dict[str, Any]:
    """A chain of threads on one or two cores, most of them timers with open offsets; some released by events."""
    names = [f"t{number}" for number in range(rng.randint(3, 5))]
    threads: dict[str, Any] = {}
    for name in names:
        least, most = sorted(rng.choices(range(200, 2200, 100), k=2))
        body: dict[str, Any] = {"processor": "computer", "compute_execution_time": f"{least} us .. {most} us"}
        if name != names[0] and rng.random() < 0.3:
            body["dispatch_protocol"] = "aperiodic"
        else:
            body["period"] = rng.choice(["6 ms", "8 ms", ["6 ms", "12 ms"], "12 ms", "20 ms", ["10 ms", "20 ms"]])
            grid = sorted(rng.sample(range(6), rng.randint(1, 3)))
            body["offset"] = rng.choice([*([[f"{at} ms" for at in grid]] * 4), "1 ms", "unknown"])
            if name != names[0] and rng.random() < 0.25:
                body["dispatch_protocol"] = ["periodic", "aperiodic"]
            if rng.random() < 0.3:
                body["communication"] = rng.choice(
                    ["let", "at_dispatch", ["at_dispatch", "implicit"], ["let", "implicit"]]
                )
        if rng.random() < 0.2:
            body["core"] = rng.choice(["any", 1])
        if rng.random() < 0.2:
            body["priority"] = rng.randint(1, 5)
        threads[name] = body
    many = [name for name in names if isinstance(threads[name].get("offset"), list)]
    for name in many[3:]:
        threads[name]["offset"] = "2 ms"
    kinds = [f"{kind} of f" for kind in KINDS]
    asked = [f"minimise {rng.choice([*kinds, 'error'])}"]
    asked += rng.sample(["minimise utilisation of computer", "minimise both", f"minimise {rng.choice(kinds)}"], 1)
    return {
        "dse": 1, "name": "reads", "overload": "allowed", "deadlines": rng.choice(["none", "stated"]),
        "processing": "response_time",
        "processor_types": {"one": {"cores": rng.choice([1, 1, 2])}, "other": {"cores": 1, "price": "1 EUR"}},
        "processors": {"computer": {"type": rng.choice(["one", ["one", "other"]])}},
        "threads": threads,
        "connections": {f"{one}_{other}": {"from": one, "to": other} for one, other in pairwise(names)},
        "flows": {"f": {"path": names}, "g": {"path": names[1:]}},
        "metrics": {
            "error": f"jitter of f * {rng.choice(['0.5', '0.6 m/s', '2'])}",
            "both": "latency of f + 2 * latency of g",
        },
        "requirements": [f"{rng.choice(KINDS)} of {rng.choice('fg')} <= {rng.randint(5, 60)} ms"][: rng.randint(0, 1)],
        "objectives": list(dict.fromkeys(asked)),
    }  # fmt: skip


def alternating(rng: random.Random) -> dict[str, Any]:
    """The same with logical execution time as one of several ways to communicate, for most timers."""
    data = drawn(rng)
    for body in data["threads"].values():
        if "offset" in body and rng.random() < 0.7:
            ways = [["let", "implicit"], ["at_dispatch", "let"], ["at_dispatch", "implicit", "let"]]
            body["communication"] = rng.choice(ways)
    return data


def front(space: Any) -> set[tuple[int, ...]]:
    """The non-dominated points, by looking at every design."""
    evaluator = Evaluator(space)
    feasible = {item.objectives for item in evaluated(evaluator).values() if item.is_feasible}
    points = {vector: counted_down(space, vector) for vector in feasible}
    return {one for one, mine in points.items() if not any(dominates(other, mine) for other in points.values())}


@pytest.mark.parametrize(
    ("draw", "seed"),
    [
        *((drawn, f"reads {seed}") for seed in cases(30, 5_000)),
        *((alternating, f"let {seed}") for seed in cases(20, 5_000)),
    ],
)
def test_fronts_equal_exhaustion(
    draw: Callable[[random.Random], dict[str, Any]], seed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No figure as a table: what passes between reads has rows, and what these leave open is learnt.

    Also of threads that are LET in some designs: their waiting counts in the others only.
    """
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    space = dse.load(draw(random.Random(seed))).space
    found = search_front(Evaluator(space))
    assert found.is_complete
    assert set(found.points) == front(space)


def written(seed: int, tmp_path: Path) -> Path:
    """A drawn problem as a file, solved without tables of response times; the path of its result."""
    path, made = tmp_path / "p.json", tmp_path / "r.json"
    path.write_text(json.dumps(drawn(random.Random(f"reads {seed}"))), encoding="utf-8")
    made.write_text(dse.solve(path).to_json(), encoding="utf-8")
    return made


@pytest.mark.parametrize("seed", cases(10, 5_000))
def test_they_are_proved_again(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the second model, which has no tables of response times either."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    monkeypatch.setattr(tables, "FEW_LEAVES", 1)
    made = written(seed, tmp_path)
    found = dse.verify(made, method="model")
    assert found.status == "verified", found
    result = json.loads(made.read_text(encoding="utf-8"))
    if not result["front"]:
        return
    short = result | {"front": result["front"][:-1]}
    made.write_text(json.dumps(short), encoding="utf-8")
    assert dse.verify(made, method="model").status == "rejected"


def test_the_robot_holds_its_limit_on_the_cheap_computer_where_offsets_are_chosen() -> None:
    """What docs/recipes.md says of `inmark_clock.yaml`: with waiting for the core 17.553 ms at 86.57 % of the RT101."""
    chosen = {
        "computer.type": "RT101",
        "canbus0.type": "can_125k",
        "eth0.type": "none",
        "nav_controller.period": "10 ms",
    }
    asked = dse.load(ROOT / "problems" / "inmark_clock.yaml").ask(max_jitter="20 ms", processing="response_time")
    found = dse.solve(asked, fix=chosen, max_utilisation="90 %")
    assert found.status == "complete"
    assert (17_553_360, 29_000, 865_697) in [tuple(item.objectives.values()) for item in found.front]


@pytest.mark.parametrize("seed", cases(15, 5_000))
@pytest.mark.parametrize("way", ["workers", "resumed", "fixed"])
def test_the_same_front_another_way(way: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With two workers, from a search that was stopped, and with a decision fixed."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    rng = random.Random(f"reads {way} {seed}")
    asked = dse.load(drawn(rng))
    if way == "fixed" and (free := [item for item in asked.space.decisions if item.is_open]):
        decision = rng.choice(free)
        asked = asked.ask(fix=f"{decision.name} = {rng.choice(decision.options)}")
    evaluator = Evaluator(asked.space)
    wanted = front(asked.space)
    earlier = None
    if way == "resumed":
        whole = search_front(evaluator)
        known = {point: whole.points[point] for point in sorted(whole.points)[::2]}
        earlier = FrontSearch(known, (tuple(ANYTHING for _ in evaluator.objectives),), (), 1, 0.0)
    monkeypatch.setattr("dse.search.front.HELP_AFTER_S", 0.0)
    found = search_front(Evaluator(asked.space), SearchLimits(workers=1 + (way == "workers")), earlier=earlier)
    assert found.is_complete
    assert set(found.points) == wanted


def uncertain(seed: int, path: Path) -> Iterator[dse.Problem]:
    """Drawn problems in which one thread may take longer."""
    for number in count(1_000 * seed):
        rng = random.Random(f"reads robust {number}")
        data = drawn(rng)
        name = rng.choice(list(data["threads"]))
        data["requirements"] = [f"latency of f <= {rng.randint(10, 60)} ms"]
        data["uncertainty"] = {f"threads.{name}.compute_execution_time": {"factor": "1 .. 1.4"}}
        path.write_text(json.dumps(data), encoding="utf-8")
        yield dse.load(path)


@pytest.mark.parametrize("seed", cases(10, 5_000))
def test_robust_fronts_equal_brute_force(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Limits at corners are of other figures, which no row of the nominal ones bounds."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    problem = next(item for item in uncertain(seed, tmp_path / "p.json") if designs(item) <= MOST_DESIGNS)
    try:
        found = solve_robust(problem)
    except UsageError as error:
        assert "rise and fall" in str(error) or "moves in steps" in str(error)
        return
    assert {tuple(point.objectives.values()) for point in found.robust.front} == expected(problem)
    assert dse.verify(found).status == "verified"


def test_figures_of_any_scale_share_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """A length of 0.6 m/s * jitter counts in fifths of a nanometre, a latency in ns: none stays whole for that."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    thread = {
        "processor": "cpu",
        "period": "10 ms",
        "offset": ["0 ms", "2 ms"],
        "compute_execution_time": "1 ms .. 2 ms",
    }
    threads = {"a": thread, "b": thread}
    data = {
        "dse": 1, "name": "scales", "processing": "response_time", "processors": {"cpu": {"type": "p"}},
        "processor_types": {"p": {}}, "threads": threads, "connections": {"ab": {"from": "a", "to": "b"}},
        "flows": {"f": {"path": ["a", "b"]}}, "metrics": {"line": "jitter of f * 0.6 m/s"},
        "objectives": ["minimise line", "minimise latency of f"],
    }  # fmt: skip
    encoded = encode(Evaluator(dse.load(data).space))
    assert encoded.open_terms and not any(term.may_fall for term in encoded.open_terms)
