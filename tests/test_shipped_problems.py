"""Every shipped problem has the front that is written down for it, and brute force finds the same vectors.

After a change that is meant to change a front, or the way it is written, look at every difference that this leaves::

    python -m tests.test_shipped_problems
    git diff tests/expected

Brute force is that of the oracle, of the quick question (`processing: execution_time`) where the file does not say what
counts: with each core a decision there are too many designs. Where the file says it, it is the analysis on each design.
"""

from __future__ import annotations

import csv
import re
from fractions import Fraction
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.answers.forms.registry import mistakes_in
from tests.helpers.effort import LONG
from tests.helpers.small import quick, without_waiting
from tests.helpers.support import TOO_MANY
from tests.oracle import evaluator as oracle
from tests.properties.pair import PER_UNIT

HERE = Path(__file__).parent
SHIPPED = sorted((HERE.parent / "problems").glob("*.yaml"))
EXPECTED = HERE / "expected"
STRICTER = {"inmark": {"max_jitter": "20 ms"}}
"""Problems that are solved with a further limit as well: the keyword arguments of `dse.solve`."""
QUESTIONS: list[tuple[str, dict[str, Any]]] = [(path.stem, {}) for path in SHIPPED] + list(STRICTER.items())

Vector = tuple[Fraction, ...]


def question_name(question: tuple[str, dict[str, str]]) -> str:
    """``inmark`` or ``inmark_max_jitter_20_ms``."""
    name, changes = question
    return "_".join([name, *(f"{key}_{value.replace(' ', '_')}" for key, value in changes.items())])


def problem_path(name: str) -> Path:
    return HERE.parent / "problems" / f"{name}.yaml"


def front_of(name: str, changes: dict[str, Any]) -> str:
    """The front as the command line writes it to a file.

    A field that a result, a description or an analysis gains has its place in `dse.answers.forms` too.
    """
    problem = dse.load(HERE.parent / "problems" / f"{name}.yaml")
    result = dse.solve(problem, **changes)
    assert result.status == "complete"
    assert list(map(str, mistakes_in("result", result.to_dict()))) == []
    checked = dse.check(problem)
    assert list(map(str, mistakes_in("check", checked.to_dict()))) == []
    assert not [text for text in checked.remarks if "too large" in text]  # of what is solved
    if problem.space.baseline:
        assert list(map(str, mistakes_in("analysis", dse.analyse(problem).to_dict()))) == []
    return result.to_csv()


def expected_vectors(question: tuple[str, dict[str, Any]]) -> set[Vector]:
    """The objective vectors of an expected front, in the oracle's units; maximised ones negated."""
    problem = quick(dse.load(problem_path(question[0])))
    objectives, written = problem.space.objectives, (EXPECTED / f"{question_name(question)}.csv")
    is_quick = not problem.loaded.spec.processing and problem.space.profile == "dse"
    text = dse.solve(problem, **question[1]).to_csv() if is_quick else written.read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    vectors = set()
    for row in rows:
        found = []
        for objective in objectives:
            column = next(key for key in row if key.startswith(f"{objective.metric.name} ["))
            sign = 1 if objective.sense == "minimise" else -1
            found.append(sign * int(row[column]) * one_unit(column.rpartition("[")[2].removesuffix("]")))
        vectors.add(tuple(found))
    return vectors


def one_unit(text: str) -> Fraction:
    """What a number in a column counts, in the oracle's unit: ``1/3 ppm`` is a three-millionth of a core."""
    part, _, unit = text.rpartition(" ")
    return Fraction(part or 1) / PER_UNIT.get(unit, 1)


@cache
def brute_force(name: str) -> tuple[tuple[Vector, tuple[Fraction, ...]], ...]:
    """The vector and the jitters of every design that meets the requirements of the file."""
    space = quick(dse.load(problem_path(name))).space
    found = set()
    if space.profile == "dse" and space.processing == "execution_time":
        path = problem_path(name)
        problem = oracle.load_text(without_waiting(path.read_text(encoding="utf-8")), path.parent)
        for _, figures in oracle.evaluated(problem):
            if not figures["violations"]:
                jitters = tuple(Fraction(flow["jitter"]) for flow in figures["flows"].values())
                found.add((figures["objectives"], jitters))
        return tuple(found)
    evaluator = Evaluator(space)
    senses = [1 if objective.sense == "minimise" else -1 for objective in space.objectives]
    units = [one_unit(measure.counting_unit) for measure in evaluator.objectives]
    for raw in product(*(range(len(decision.options)) for decision in space.decisions)):
        evaluation = evaluator.evaluate(raw)
        if evaluation.is_feasible:
            counted = zip(senses, evaluation.objectives, units, strict=True)
            found.add((tuple(sign * value * unit for sign, value, unit in counted), ()))
    return tuple(found)


def test_every_problem_has_its_expected_front() -> None:
    assert {path.name for path in EXPECTED.glob("*")} == {f"{question_name(item)}.csv" for item in QUESTIONS}


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_limits_and_offered_periods_are_called_assumptions(path: Path) -> None:
    """What no source states is said to be ours, where the report prints it."""
    problem = dse.load(path).space
    said = " ".join(problem.assumptions).lower()
    assert "limit" in said
    offered = [name for name in (item.name for item in problem.decisions) if name.endswith(".period")]
    assert not offered or re.search("period|timer", said)


@pytest.mark.parametrize("question", QUESTIONS, ids=question_name)
def test_the_front_is_the_expected_one_and_of_its_form(question: tuple[str, dict[str, str]]) -> None:
    expected = (EXPECTED / f"{question_name(question)}.csv").read_text(encoding="utf-8")
    assert front_of(*question) == expected


VERIFIED = () if LONG else ("autoware_reference", "inmark_can", "perception")
"""Problems that the oracle does not know, or looks at for minutes: tests/verification/test_mutations.py has them, too.
"""


@pytest.mark.parametrize("name", [path.stem for path in SHIPPED if path.stem not in (*TOO_MANY, *VERIFIED)])
def test_brute_force_finds_the_same_vectors(name: str) -> None:
    found = brute_force(name)
    assert expected_vectors((name, {})) == oracle.non_dominated({vector for vector, _ in found})
    if name in STRICTER:
        steady = {vector for vector, jitters in found if max(jitters) <= 20_000_000}
        assert expected_vectors((name, STRICTER[name])) == oracle.non_dominated(steady)


def write() -> None:
    """Write every expected front."""
    EXPECTED.mkdir(exist_ok=True)
    for question in QUESTIONS:
        (EXPECTED / f"{question_name(question)}.csv").write_text(front_of(*question), encoding="utf-8")


if __name__ == "__main__":
    write()
