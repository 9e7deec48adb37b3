"""What the verifications of many results of one question share, so that a test pays for it once."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import pytest

from dse.analysis.evaluate import Evaluator
from dse.questions import result_problem
from dse.questions.problem import Problem
from dse.questions.verify import alternatives, completeness, contention, contention_claims, points, verify
from dse.questions.verify import verify as verifying
from dse.questions.verify.verify import RobustWitness
from dse.space.model.space import Space
from dse.verification.prover import AllDesigns, Method, Prover, make_prover
from dse.verification.tables import Tables


def all_designs_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All designs of a question are looked at when the first of its results is verified, not for each of them again.

    Not for robust questions: what their evaluators hold against designs grows.
    """
    question_once(monkeypatch)
    known: list[tuple[Space, tuple[Prover, Tables]]] = []

    def prover(evaluator: Evaluator, method: Method = "auto", deadline: float | None = None) -> tuple[Prover, Tables]:
        found = [answer for space, answer in known if method != "model" and space == evaluator.space]
        if found:
            return found[0]
        made = make_prover(evaluator, method, deadline)
        if isinstance(made[0], AllDesigns):
            known[:] = [(evaluator.space, made)]
        return made

    monkeypatch.setattr(completeness, "make_prover", prover)


def question_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """What does not depend on what a result lists is found when the first result of a question is verified.

    The problem that results carry is read once, and what the analysis knows of a design is remembered. A result that
    states another question, or carries another problem, has everything of its own.
    """
    monkeypatch.setattr(result_problem, "load_carried", once(result_problem.load_carried))
    monkeypatch.setattr(verifying, "restated", once(verifying.restated))
    evaluator_of = once(Evaluator)
    for module in (points, alternatives, contention, contention_claims, completeness):
        monkeypatch.setattr(module, "Evaluator", evaluator_of)
    for name in ("ContentionReferee", "judge"):
        monkeypatch.setattr(contention, name, once(getattr(contention, name)))
    for name in ("with_contention", "CoreJury"):
        monkeypatch.setattr(contention_claims, name, once(getattr(contention_claims, name)))


MOST = 50
"""So many answers of a function are remembered."""


def once(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that is asked once about the same: plain data with the same content, or the very same object."""
    known: dict[Any, tuple[tuple[Any, ...], Any]] = {}

    def remembering(*given: Any, **named: Any) -> Any:
        if named:
            return function(*given, **named)
        key = tuple(json.dumps(part) if isinstance(part, str | tuple | dict) else id(part) for part in given)
        if key not in known:
            if len(known) >= MOST:
                known.clear()
            known[key] = (given, function(*given))  # which keeps what is known by its identity
        return known[key][1]

    return remembering


def robustness_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether a design is robust is proved and looked at once for each question, not for each result that shows it."""
    known: dict[str, RobustWitness] = {}

    class Remembering(RobustWitness):
        broken = cache(RobustWitness.broken)

    def witness(problem: Problem, effective: Mapping[str, Any]) -> RobustWitness:
        asked = json.dumps([problem.loaded.sha256, effective], sort_keys=True)
        if asked not in known:
            known[asked] = Remembering(problem, effective)
        return known[asked]

    monkeypatch.setattr(verify, "RobustWitness", witness)


def copied(data: dict[str, Any]) -> dict[str, Any]:
    """A result of its own to change: `copy.deepcopy` of what JSON can say takes ten times as long."""
    found: dict[str, Any] = pickle.loads(pickle.dumps(data))
    return found
