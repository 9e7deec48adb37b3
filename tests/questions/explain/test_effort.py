"""What an explanation does where questions are hard: models of their own, an end to the effort, and who hears of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from dse.answers.explanation import Demand
from dse.encode.scheduling.contention import Contention
from dse.questions.explain import explain
from dse.questions.explain.explain import Explainer, Listener, Wishes, explain_asked
from dse.questions.problem import Problem, load, loads
from dse.search.feasibility import guarded_model, oracle
from tests.helpers.conflicting import infeasible
from tests.helpers.effort import FIRST, count

INMARK_CAN = Path(__file__).parents[3] / "problems" / "inmark_can.yaml"
TEXT = """
dse: 1
name: two that clash
processor_types: {cpu: {}}
processors: {computer: {type: cpu}}
threads:
  a: {processor: computer, period: [10 ms, 20 ms], compute_execution_time: 1 ms}
  b: {processor: computer, period: [10 ms, 20 ms], compute_execution_time: 1 ms}
rules: [a.period == b.period, a.period != b.period, a.period == 10 ms, a.period == 20 ms]
"""
PAIRS = [
    ("a.period == b.period", "a.period != b.period"),
    ("a.period == 10 ms", "a.period == 20 ms"),
]


def pairs_of(conflicts: Sequence[Sequence[Demand]]) -> list[tuple[str, ...]]:
    return sorted(tuple(item.text.removeprefix("rule ") for item in found) for found in conflicts)


def test_conflicts_are_heard_of_as_soon_as_they_are_known() -> None:
    asked: list[str] = []
    heard: list[Sequence[Demand]] = []
    found = explain_asked(loads(TEXT), Wishes(every=True), Listener(asked.append, heard.append))
    assert pairs_of(heard) == pairs_of([[demand for demand, _ in item.members] for item in found.conflicts])
    assert pairs_of(heard) == sorted(PAIRS)
    assert asked[0].startswith("5 demands without a design") and asked[-1] == "looking for what makes it feasible"
    assert any(text.startswith("2 demands without a design") for text in asked)


@pytest.mark.parametrize(
    ("wishes", "is_whole"), [(Wishes(), False), (Wishes(every=True), True), (Wishes(time_limit_s=99.0), True)]
)
def test_without_a_limit_of_time_hard_questions_are_left(
    wishes: Wishes, is_whole: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(explain, "EFFORT", 0.0)
    found = explain_asked(loads(TEXT), wishes)
    assert found.status == "infeasible" and found.exit_code == (4 if is_whole else 5)
    assert found.complete == is_whole and bool(found.left_open) != is_whole
    assert bool(found.reduced) != is_whole and bool(found.conflicts) == is_whole


def conflicts_of(problem: Problem) -> list[tuple[str, ...]]:
    found = Explainer.of(problem, Wishes(every=True), 0.0).explanation()
    assert found.complete
    return pairs_of([[demand for demand, _ in item.members] for item in found.conflicts])


def test_models_of_their_own_find_the_same_conflicts(monkeypatch: pytest.MonkeyPatch) -> None:
    apart = 0
    own = oracle.Oracle._apart

    def counting(*arguments: object) -> object:
        nonlocal apart
        apart += 1
        return own(*arguments)  # type: ignore[arg-type]

    drawn = [found[0] for seed in range(FIRST, FIRST + count(30)) if (found := infeasible(seed)) is not None]
    assert drawn
    shared = [conflicts_of(problem) for problem in drawn]
    monkeypatch.setattr(oracle, "SHARED_WORK", 0.0)
    monkeypatch.setattr(oracle.Oracle, "_apart", counting)
    assert [conflicts_of(problem) for problem in drawn] == shared
    assert apart > len(drawn)


def test_response_times_of_demands_that_are_switched_off_are_not_learnt(monkeypatch: pytest.MonkeyPatch) -> None:
    """A design that meets what is asked is the answer, however low the solver has other response times."""
    learnt = 0
    own = Contention.raised

    def counting(*arguments: Any) -> bool:
        nonlocal learnt
        learnt += 1
        return own(*arguments)

    monkeypatch.setattr(Contention, "raised", counting)
    answering = oracle.Oracle(load(INMARK_CAN).ask(max_jitter="11.5 ms").space)
    assert answering.find(frozenset()) is not None
    assert learnt == 0


def test_rounds_of_learning_are_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Weighing designs takes most of the time of a question that the solver hardly works at."""
    asked = load(INMARK_CAN).ask(max_jitter="10.85 ms")
    monkeypatch.setattr(guarded_model, "ROUND", 1.0)
    found = explain_asked(asked, Wishes())
    assert found.status == "infeasible" and found.exit_code == 5 and found.left_open
