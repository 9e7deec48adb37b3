"""What the verifications of many results of one question share, so that a test pays for it once."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from functools import cache
from typing import Any

import pytest

from dse.analysis.evaluate import Evaluator
from dse.api import completeness
from dse.api.problem import Problem
from dse.space.types import Space
from dse.study import verify
from dse.study.verify import RobustWitness
from dse.verification.prover import AllDesigns, Method, Prover, make_prover
from dse.verification.tables import Tables


def all_designs_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All designs of a question are looked at when the first of its results is verified, not for each of them again."""
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
