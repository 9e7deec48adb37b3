"""A stopped search keeps its worth: what it wrote is readable at any moment, and goes on to the same front."""

from __future__ import annotations

import io
import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

import dse
from dse.answers.ranking.optimality_gap import outlooks_of
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.cli.main import run
from dse.examples.random import random_problem
from dse.report.content.front.document import Document
from dse.report.content.front.pages import printed_page
from dse.report.terminal import print_page
from dse.report.words.missing import missing_words
from dse.search import front
from dse.search.solver.settings import SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Unfinished
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime
from tests.helpers.effort import count
from tests.helpers.support import PROBLEMS

BY_NAME = {path.stem: path for path in PROBLEMS}
INMARK = Path(__file__).parents[2] / "problems" / "inmark.yaml"
KILLS = count(3)
OBJECTIVES = ["jitter of gnss_to_sprayer", "price", "utilisation of computer", "power", "load of canbus0"]


def comparable(text: str) -> dict[str, Any]:
    """A result without what tells of the run itself."""
    data: dict[str, Any] = json.loads(text)
    data.pop("search")
    return data


@pytest.mark.parametrize("name", ["types", "protocols", "bindings"])
def test_a_search_stopped_at_any_call_goes_on_to_the_same_front(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = dse.solve(BY_NAME[name], workers=1)
    solve = Strategy._solve_whole
    for stop in range(1, 8):
        asked: list[bool] = []

        def failing(
            self: Strategy, settings: SolverSettings, work: float, asked: list[bool] = asked, stop: int = stop
        ) -> Answer:
            asked.append(True)
            if len(asked) >= stop:
                self.stop()
            return solve(self, settings, work)

        monkeypatch.setattr(Strategy, "_solve_whole", failing)
        stopped = dse.solve(BY_NAME[name], workers=1)
        monkeypatch.setattr(Strategy, "_solve_whole", solve)
        if stopped.status == "complete":
            break
        assert stopped.status == "incomplete"
        assert stopped.unexplored
        assert set(stopped.potential) == {item.name for item in stopped.objectives}
        path = tmp_path / "stopped.json"
        path.write_text(stopped.to_json(), encoding="utf-8")
        assert comparable(dse.resume(path).to_json()) == comparable(expected.to_json())


def stopped_after(calls: int, monkeypatch: pytest.MonkeyPatch, **asked: Any) -> Result:
    """The robot's front when the search is stopped after so many calls."""
    answered: list[Answer] = []
    minimise = Strategy.minimise

    def failing(self: Strategy, *arguments: Any, **more: Any) -> Answer:
        if len(answered) >= calls:
            return Unfinished()
        answered.append(minimise(self, *arguments, **more))
        return answered[-1]

    with monkeypatch.context() as patch:
        patch.setattr(Strategy, "minimise", failing)
        return dse.solve(INMARK, workers=1, **asked)


def missing_from(stopped: Result, whole: Result) -> list[dict[str, int]]:
    """The objectives of the points that a stopped search did not find."""
    found = [point.objectives for point in stopped.front]
    return [dict(point.objectives) for point in whole.front if point.objectives not in found]


def test_potential_bounds_what_is_still_to_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """No point of the whole front is better, in any objective, than what the stopped search says is still possible."""
    whole = dse.solve(INMARK, workers=1)
    for calls in (0, 3, 6, 20):
        stopped = stopped_after(calls, monkeypatch)
        assert stopped.status == "incomplete" and missing_from(stopped, whole)
        for objectives in missing_from(stopped, whole):
            assert all(objectives[name] >= bound for name, bound in stopped.potential.items())


ASKED: list[dict[str, Any]] = [
    {},
    {"minimise": ["price", "jitter of gnss_to_sprayer"], "maximise": ["utilisation of computer"]},
]


@pytest.mark.parametrize("asked", ASKED)
def test_a_search_that_had_no_time_says_what_no_design_is_better_than(
    asked: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The time was up before there was a model: bounds come from the summands alone, and hold."""
    whole = dse.solve(INMARK, workers=1, **asked)

    def too_slow(*_: Any) -> Any:
        raise OutOfTime

    monkeypatch.setattr(front, "encode", too_slow)
    stopped = dse.solve(INMARK, workers=1, **asked)
    assert stopped.status == "incomplete" and not stopped.search.solver_calls
    outlooks = {item.name: item for item in outlooks_of(stopped)}
    assert set(outlooks) == {item.name for item in whole.objectives}
    for point in whole.front:
        for name, value in point.objectives.items():
            bound = outlooks[name].bound
            assert bound <= value if outlooks[name].sense == "minimise" else value <= bound
    assert any(outlook.bound for outlook in outlooks.values())
    assert sum("no less than" in text or "no more than" in text for text in missing_words(stopped)) == len(outlooks)
    file = tmp_path / "stopped.json"
    file.write_text(stopped.to_json(), encoding="utf-8")
    monkeypatch.undo()
    assert not dse.verify(file, problem=INMARK).findings


@pytest.mark.parametrize("asked", ASKED)
def test_what_may_be_missing_is_told_in_numbers(asked: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped after any call: no missing point is better than its bounds, and some found one is as near as is said."""
    whole = dse.solve(INMARK, workers=1, **asked)
    assert not outlooks_of(whole)
    for calls in (1, 2, 4, 7, 11):
        stopped = stopped_after(calls, monkeypatch, **asked)
        if stopped.status == "complete":
            assert calls > 4
            break
        outlooks, missing = outlooks_of(stopped), missing_from(stopped, whole)
        assert stopped.front and len(outlooks) == len(whole.objectives)
        assert missing or calls > 1
        signs = {item.name: 1 if item.sense == "minimise" else -1 for item in outlooks}

        def is_near(point: dict[str, int], other: dict[str, int], signs: dict[str, int], outlooks: Any) -> bool:
            return all(signs[item.name] * (point[item.name] - other[item.name]) <= item.near for item in outlooks)

        for objectives in missing:
            for item in outlooks:
                sign, value = signs[item.name], objectives[item.name]
                assert sign * (value - item.bound) >= 0
                assert item.best is not None and sign * (item.best - value) <= item.possible_gain
            assert any(is_near(dict(point.objectives), objectives, signs, outlooks) for point in stopped.front)
        text = terminal(stopped)
        assert "Proved of every design that may be missing:" in text and "some design found is worse by at most" in text
        assert text.count(": no less than ") + text.count(": no more than ") == len(outlooks)


def test_bounds_are_told_where_nothing_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped = stopped_after(0, monkeypatch, max_jitter="20 ms")  # which today's design does not keep
    assert not stopped.front
    text = terminal(stopped)
    assert "price: no less than 290 EUR; nothing was found yet;" in text and "is worse by" not in text


def terminal(result: Result) -> str:
    printed = io.StringIO()
    print_page(Console(file=printed, width=300), printed_page(Document(result), 1))
    return " ".join(printed.getvalue().split())


def test_a_changed_problem_is_not_resumed(tmp_path: Path) -> None:
    problem = tmp_path / "starter.yaml"
    problem.write_text((INMARK.parent / "starter.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    path = tmp_path / "result.json"
    path.write_text(dse.solve(problem).to_json(), encoding="utf-8")
    problem.write_text(problem.read_text(encoding="utf-8").replace("60 EUR", "61 EUR"), encoding="utf-8")
    with pytest.raises(UsageError, match="has changed since"):
        dse.resume(path)


def test_a_killed_search_leaves_a_whole_state_that_goes_on_to_the_same_front(tmp_path: Path) -> None:
    """Killed with SIGKILL at random moments."""
    expected = comparable(dse.solve(INMARK, minimise=OBJECTIVES).to_json())
    path = tmp_path / "result.json"
    command = [sys.executable, "-c", "from dse.cli.entry import main; main()", "solve", str(INMARK), "-q"]
    command += [word for objective in OBJECTIVES for word in ("--minimise", objective)]
    moments = random.Random(1)
    for _ in range(KILLS):
        path.unlink(missing_ok=True)
        process = subprocess.Popen([*command, "--json", str(path)])
        while not path.exists() and process.poll() is None:
            time.sleep(0.01)
        time.sleep(moments.uniform(0, 1))
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert json.loads(path.read_text(encoding="utf-8"))["status"] in ("incomplete", "complete")
        assert comparable(dse.resume(path).to_json()) == expected


# --- the first design ----------------------------------------------------------------------------------------------


def stopped_at_once(path: Path, monkeypatch: pytest.MonkeyPatch) -> Result:
    """A result of a search that the solver gave no answer to."""
    with monkeypatch.context() as patch:
        patch.setattr(Strategy, "minimise", lambda *_, **__: Unfinished())
        return dse.solve(path, workers=1)


def test_a_search_without_an_answer_shows_the_baseline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A feasible one is better than nothing, and is no more than that: the search that goes on finds the same front."""
    problem = tmp_path / "problem.yaml"
    problem.write_text(random_problem(6, 2, 2, "automotive"), encoding="utf-8")
    whole, stopped = dse.solve(problem, workers=1), stopped_at_once(problem, monkeypatch)
    assert stopped.status == "incomplete" and stopped.baseline is not None
    assert [point.design for point in stopped.front] == [stopped.baseline]
    assert "the design shown meets every requirement" in terminal(stopped) and "non-dominated" not in terminal(stopped)
    path = tmp_path / "stopped.json"
    path.write_text(stopped.to_json(), encoding="utf-8")
    assert comparable(dse.resume(path).to_json()) == comparable(whole.to_json())
    assert stopped.front[0].objectives not in [point.objectives for point in whole.front]


def test_a_baseline_that_breaks_a_limit_is_not_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "problem.yaml"
    path.write_text(random_problem(6, 2, 2, "automotive"), encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(Strategy, "minimise", lambda *_, **__: Unfinished())
        assert not dse.solve(path, workers=1, max_price="1 EUR").front


def test_a_search_stopped_before_its_model_was_made_shows_the_baseline(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def slow(*_: object) -> None:
        raise OutOfTime

    with monkeypatch.context() as patch:
        patch.setattr(front, "encode", slow)
        stopped = dse.solve(INMARK)
    assert (stopped.status, stopped.search.solver_calls) == ("incomplete", 0)
    assert [point.objectives for point in stopped.front] == [
        {"jitter of gnss_to_sprayer": 68_684_904, "price": 29_000, "utilisation of computer": 526_162}
    ]
    out = io.StringIO()
    print_page(Console(file=out, width=200), printed_page(Document(stopped)))
    assert "Stopped before the first point was proved" in out.getvalue()
    written = tmp_path / "stopped.json"
    written.write_text(stopped.to_json(), encoding="utf-8")
    assert dse.verify(written).status == "verified"
    assert run(["solve", "--resume", str(written), "-q"]) == 0


def test_an_infeasible_baseline_is_not_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    def slow(*_: object) -> None:
        raise OutOfTime

    monkeypatch.setattr(front, "encode", slow)
    assert dse.solve(dse.load(INMARK).ask(max_jitter="20 ms")).front == ()


def test_a_robust_search_that_has_ended_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Decisions that a design does not use are not among those of its file: they stay unused."""
    problem, out = tmp_path / "problem.yaml", tmp_path / "r.json"
    lines = [
        "dse: 1\nname: unused\nprocessor_types: {P: {}}\nprocessors: {p: {type: P}}\ndevices: {s: {period: 7 ms}}",
        "threads:\n  t: {processor: p, dispatch_protocol: [aperiodic, periodic], period: [10 ms, 5 ms],",
        "      compute_execution_time: 1 ms}",
        "connections: {c: {from: s, to: t}}\nflows: {f: {path: [s, t]}}\nobjectives: [minimise latency of f]",
        "uncertainty: {threads.t.compute_execution_time: {factor: 1 .. 2}}\n",
    ]
    problem.write_text("\n".join(lines), encoding="utf-8")
    whole = dse.solve_robust(problem)
    out.write_text(whole.to_json(), encoding="utf-8")
    again = dse.resume(out)
    assert isinstance(again, RobustResult)
    for one, other in ((whole.nominal, again.nominal), (whole.robust, again.robust)):
        assert [point.decisions for point in one.front] == [{"t.dispatch_protocol": "aperiodic"}]
        assert [point.decisions for point in other.front] == [point.decisions for point in one.front]
