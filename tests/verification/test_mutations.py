"""True results are accepted, results with one thing wrong rejected: on every shipped problem and on random ones."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Literal

import pytest

import dse
from dse.examples.shipped import example_files
from dse.questions.problem import Problem
from dse.support.errors import ProblemError, TooLargeError
from tests.helpers.effort import LONG, cases
from tests.helpers.small import quick
from tests.helpers.support import ENUMERABLE, PARTS
from tests.oracle.generator import random_problem
from tests.verification.mutations import mutations
from tests.verification.shared import all_designs_once

DRAWN = {
    "exhaustion": {"tiny": (20, 0), "reserved": (5, 3), "segmented": (5, 6), "hosted": (5, 109)},
    "model": {"tiny": (10, 304), "reserved": (5, 3), "segmented": (5, 7), "hosted": (5, 111)},
}
SEEDS = {
    method: [(size, seed) for size, drawn in sizes.items() for seed in cases(*drawn)] for method, sizes in DRAWN.items()
}
TOO_LARGE = "some figures are so large that a solver could not add them exactly"
OF_EACH = 20 if LONG else 2
LARGE = ("inmark", "autoware_reference", "perception")
SMALL = [path.stem for path in example_files() if LONG or path.stem not in LARGE]


SLOW = {"inmark_clock": "exhaustion", "perception": "exhaustion"}
"""Problems whose proofs take long: one is enough for each."""


@cache
def found_in(path: Path) -> str:
    """The result of a problem, or of a part of it."""
    result = dse.solve(quick(dse.load(path)), fix={} if LONG else PARTS.get(path.stem, {}))
    assert len(result.front) > 1
    return result.to_json()


@pytest.mark.parametrize(
    ("method", "path"),
    [
        pytest.param(method, path, id=f"{method}-{path.stem}")
        for path in example_files()  # one after the other: each is solved once
        for method in ("exhaustion", "model")
        if LONG or SLOW.get(path.stem, method) == method
    ],
)
def test_true_results_of_shipped_problems_are_accepted(
    path: Path, method: Literal["exhaustion", "model"], tmp_path: Path
) -> None:
    file = tmp_path / "result.json"
    file.write_text(found_in(path), encoding="utf-8")
    found = dse.verify(file, problem=path, method=method)
    assert found.status == "verified", found.findings


@pytest.mark.parametrize(
    "path", [path for path in ENUMERABLE if LONG or path.stem != "perception"], ids=lambda path: path.stem
)
def test_wrong_results_of_shipped_problems_are_rejected(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = quick(dse.load(path))
    all_designs_once(monkeypatch)
    data = solved(problem)
    assert not accepted(data, problem, seed=1, method="exhaustion", most=OF_EACH if path.stem in SMALL else 1)


@pytest.mark.parametrize("method", ["exhaustion", "model"])
def test_random_problems(
    method: Literal["exhaustion", "model"],
    record_property: Callable[[str, object], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    all_designs_once(monkeypatch)
    seen: Counter[str] = Counter()
    for size, seed in SEEDS[method]:
        try:
            problem = dse.loads(random_problem(seed, size))
            data = solved(problem)
        except (ProblemError, TooLargeError):  # sums of response times without a bound, of a reservation that has none
            continue
        found = dse.verify(data, problem=problem, method=method)
        if method == "model" and any(TOO_LARGE in text for text in found.left_open):
            continue
        assert found.status == "verified", (size, seed, found.findings, found.left_open)
        wrong = accepted(data, problem, seed, method, seen)
        assert not wrong, (size, seed, wrong)
    record_property("rejected", seen["rejected"])
    assert seen["rejected"] >= 10 * len(SEEDS[method])


def solved(problem: Problem) -> dict[str, Any]:
    """A result as a program would read it."""
    data: dict[str, Any] = json.loads(dse.solve(problem, workers=1).to_json())
    return data


def accepted(
    data: dict[str, Any],
    problem: Problem,
    seed: int,
    method: Literal["exhaustion", "model"],
    seen: Counter[str] | None = None,
    most: int = OF_EACH,
) -> list[str]:
    """The mutations that `verify` does not reject; the second model may leave open, and say so, what it cannot tell."""
    wrong = []
    for name, mutated in mutations(data, problem, seed, most):
        found = dse.verify(mutated, problem=problem, method=method)
        if method == "model" and found.status == "unfinished" and found.left_open:
            continue
        if found.status != "rejected" or not found.findings:
            wrong.append(name)
        elif seen is not None:
            seen["rejected"] += 1
    return wrong
