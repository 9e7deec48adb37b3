"""What the verifications of many results of one question share, so that a test pays for it once."""

from __future__ import annotations

import pickle
from typing import Any

import pytest

from dse.analysis.evaluate import Evaluator
from dse.api import completeness
from dse.space.types import Space
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


def copied(data: dict[str, Any]) -> dict[str, Any]:
    """A result of its own to change: `copy.deepcopy` of what JSON can say takes ten times as long."""
    found: dict[str, Any] = pickle.loads(pickle.dumps(data))
    return found
