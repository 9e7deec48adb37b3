"""What is kept while a search goes on is a result like any other: it can be read, checked, and gone on with."""

from __future__ import annotations

import json
from pathlib import Path
from threading import Event
from typing import Any

import pytest

import dse
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.examples.random import random_problem
from dse.questions.robust.corner_demands import RobustQuestion
from dse.questions.robust.robust import RobustWatcher, solve_question
from dse.questions.verbs.solve import Watcher, solve_asked
from dse.search import workers
from dse.search.front import SearchLimits
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, Unfinished
from dse.support.errors import UsageError
from tests.helpers.effort import few
from tests.helpers.support import PROBLEMS

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
BY_NAME = {path.stem: path for path in PROBLEMS}


@pytest.fixture
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """A checkpoint whenever the solver has answered."""
    monkeypatch.setattr(workers, "CHECKPOINT_S", 0.0)
    monkeypatch.setattr(workers, "SHARE", 1e9)
    monkeypatch.setattr(workers, "SECOND", 1e9)


def written(state: Result | RobustResult, path: Path) -> dict[str, Any]:
    path.write_text(state.to_json(), encoding="utf-8")
    data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return data


def comparable(result: Result | RobustResult) -> dict[str, Any]:
    return {**result.to_dict(), "search": None}


@pytest.mark.usefixtures("often")
@pytest.mark.parametrize(
    ("name", "processing"),
    few(
        [
            ("types", "response_time"),
            ("bindings", "execution_time"),
            ("types", "execution_time"),
            ("bindings", "response_time"),
            ("many-buses", "execution_time"),
        ],
        2,
    ),
)
def test_what_is_kept_is_a_result(name: str, processing: str, tmp_path: Path) -> None:
    problem, kept = tmp_path / "p.yaml", tmp_path / "kept.json"
    text = BY_NAME[name].read_text(encoding="utf-8") if name in BY_NAME else random_problem(6, 3, 2, name)
    problem.write_text(text, encoding="utf-8")
    asked = dse.load(problem).ask(processing=processing)
    states: list[Result] = []
    expected = solve_asked(asked, SearchLimits(), Watcher(checkpoint=states.append))
    assert states and expected.front and not expected.under_way
    for state in (states[0], states[len(states) // 2], states[-1]):
        data = written(state, kept)
        assert data["under_way"] and all(point["decisions"] and not point["metrics"] for point in data["front"])
        found = dse.verify(kept)
        assert found.status == "verified", found.findings
        again = dse.reopen(kept)
        assert not again.under_way and again.status == state.status
        assert [point.decisions for point in again.front] == [point.decisions for point in state.front]
        assert all(set(point.metrics) == set(expected.metric_units) for point in again.front)
        assert comparable(dse.resume(kept)) == comparable(expected)
        if data["front"]:
            objective = data["objectives"][0]["name"]
            data["front"][-1]["objectives"][objective] += 1
            kept.write_text(json.dumps(data), encoding="utf-8")
            assert dse.verify(kept).status == "rejected"
            with pytest.raises(UsageError, match="it has others"):
                dse.resume(kept)


@pytest.mark.usefixtures("often")
def test_what_is_kept_of_a_robust_search_is_a_result(tmp_path: Path) -> None:
    problem, kept = tmp_path / "p.yaml", tmp_path / "kept.json"
    text = PUMP.read_text(encoding="utf-8")
    text += "uncertainty: {threads.filter.compute_execution_time: {factor: 0.9 .. 1.5}}"
    problem.write_text(text, encoding="utf-8")
    states: list[RobustResult] = []
    question = RobustQuestion(dse.load(problem))
    expected = solve_question(question, SearchLimits(), RobustWatcher(checkpoint=states.append))
    assert states
    for state in (states[0], states[len(states) // 2], states[-1]):
        assert written(state, kept)["under_way"]
        found = dse.verify(kept)
        assert found.status in ("verified", "unfinished"), found.findings
        assert dse.reopen_robust(kept).robust.status == state.robust.status
        assert comparable(dse.resume(kept)) == comparable(expected)


@pytest.mark.usefixtures("often")
def test_a_design_is_kept_while_the_first_question_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first question may take as long as all others; what it comes across is kept before it ends."""
    asked = dse.load(BY_NAME["types"])
    point = dse.solve(asked).front[0]
    states: list[Result] = []
    is_kept = Event()

    def watching(state: Result) -> None:
        states.append(state)
        if state.front:
            is_kept.set()

    def answering(self: Strategy, *_: object, **__: object) -> Answer:
        counted = zip(point.objectives.values(), self.encoded.objectives, strict=True)
        self.incumbent = Found(tuple((value - item.offset) // item.step for value, item in counted), point.design)
        assert is_kept.wait(60)
        return Unfinished()

    assert all(item.sense == "minimise" for item in asked.space.objectives)
    monkeypatch.setattr(Strategy, "minimise", answering)
    solve_asked(asked, SearchLimits(), Watcher(checkpoint=watching))
    assert states[-1].front[0].decisions == point.decisions
