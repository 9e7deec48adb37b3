"""Calls against the problem without calls, in which every job and message of theirs is written out.

The oracle, which knows nothing of calls, judges what is written out by exhaustion.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from tests.helpers.calls import random_calls, written_out
from tests.helpers.effort import cases
from tests.oracle import evaluator as oracle

PPM = 10**6


def text(document: dict[str, Any]) -> str:
    return yaml.safe_dump(document, sort_keys=False)


def vectors(document: dict[str, Any]) -> list[tuple[Fraction, ...]]:
    found = dse.solve(dse.loads(text(document)))
    assert found.status == "complete"
    return [tuple(map(Fraction, point.objectives.values())) for point in found.front]


@pytest.mark.parametrize("seed", cases(6, 5))
def test_a_call_is_its_requests_replies_and_jobs(seed: int) -> None:
    document = random_calls(seed)
    assert vectors(document) == vectors(written_out(document))


@pytest.mark.parametrize("seed", cases(8, 21))
def test_the_oracle_finds_the_same_front(seed: int) -> None:
    """Response times of many jobs in executors take it a while: they are in the test above."""
    document = {**random_calls(seed), "processing": "execution_time"}
    judged = oracle.evaluated(oracle.load_text(text(written_out(document))))
    front = oracle.non_dominated({figures["objectives"] for _, figures in judged if not figures["violations"]})
    assert vectors(document) == sorted((first, second * PPM, third) for first, second, third in front)


@pytest.mark.parametrize("seed", cases(3, 41))
def test_calls_are_proved_again_and_simulated_within_their_bounds(seed: int, tmp_path: Path) -> None:
    path = tmp_path / "calls.yaml"
    path.write_text(text({**random_calls(seed), "processing": "response_time"}), encoding="utf-8")
    found = dse.solve(path)
    assert dse.verify(found)
    for point in found.front[:1]:
        assert not dse.simulate(path, point, runs=3, seed=seed).outside
