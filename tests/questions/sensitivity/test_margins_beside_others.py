"""Margins of execution times beside executors, reservations and segments, by what an oracle of its own says of them.

Of each problem a few inputs are looked at: a value that is the last to hold keeps every requirement of the
edited file, the first that does not breaks one, and halfway to it none is broken.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator
from fractions import Fraction

import pytest

import dse
from dse.questions.problem import Problem, loads
from dse.questions.sensitivity.design_function import DesignFunction, OutputComparison
from dse.questions.sensitivity.inputs import Variable
from dse.questions.sensitivity.margins import _held, _margin, reaches
from dse.questions.sweep.inputs_of_file import Inputs, copied, effective_text, merged_data
from dse.support.errors import ProblemError, TooLargeError
from dse.support.timelimit import OutOfTime, TimeLimit, until
from tests.helpers.effort import cases
from tests.oracle import evaluator as oracle
from tests.oracle.generator import random_problem
from tests.questions.sensitivity.test_margins import function_of, value_text

MOST_LOOKED_AT = 4
"""Inputs of a problem."""
PATIENCE_S = 20.0
"""Where a core is all but full a busy period has a hundred thousand steps: such margins are left out."""


FIRST = {"grouped": 201, "reserved": 202, "segmented": 205, "hosted": 111}


@pytest.mark.parametrize("size", FIRST)
def test_margins_are_those_of_the_oracle(size: str) -> None:
    looked = Counter[str]()
    seeds = cases(5, FIRST[size])
    for seed in seeds:
        try:
            drawn = dse.loads(random_problem(seed, size))
            front = dse.solve(drawn, workers=1).front
        except (ProblemError, TooLargeError):
            continue
        if front:
            looked += _looked_at(drawn, dict(front[0].decisions), random.Random(seed))
    assert looked["inputs"] > 0


def _looked_at(drawn: Problem, decisions: dict[str, str], rng: random.Random) -> Counter[str]:
    """How many inputs and breaks of a design of a problem were looked at; margins are about its requirements."""
    problem = loads(effective_text({**merged_data(drawn), "rules": []}))
    names = {item.name for item in problem.space.decisions}
    function = function_of(problem, {name: text for name, text in decisions.items() if name in names})
    assert not _broken(problem, decisions, {})
    found = list(_execution_times(function))
    seen = Counter[str]()
    for variable, bounds in rng.sample(found, min(len(found), MOST_LOOKED_AT)):
        try:
            with until(TimeLimit.after(PATIENCE_S)):
                margin = _margin(function, variable, bounds)
        except OutOfTime:
            continue
        seen["inputs"] += 1
        for side in (margin.below, margin.above):
            if side is not None:
                seen["breaks"] += 1
                first = side.last + (1 if side.last > margin.nominal else -1) if side.first is None else side.first
                halfway = Fraction(round((margin.nominal + side.last) / 2))
                for value, good in ((side.last, True), (halfway, True), (first, False)):
                    said = _broken(problem, decisions, {margin.path: value_text(margin, value)})
                    assert bool(said) != good, (margin, value, said)
            elif margin.searched[1] > margin.nominal and side is margin.above:
                value = min(margin.searched[1], margin.nominal * 1000)
                assert not _broken(problem, decisions, {margin.path: value_text(margin, value)}), margin
    return seen


def _execution_times(function: DesignFunction) -> Iterator[tuple[Variable, tuple[OutputComparison, ...]]]:
    """Those of threads that are not among alternatives, with the comparisons that they have a part in."""
    of = reaches(function, _held(function))
    for variable in function.inputs.variables:
        path = variable.path.replace("segments[", "")
        if path.startswith("threads.") and "execution_time" in path and "execution_time[" not in path:
            bounds = of(variable)
            if bounds and not path.rpartition("execution_time")[2].count("["):
                yield variable, bounds


def _broken(problem: Problem, decisions: dict[str, str], texts: dict[str, str]) -> list[str]:
    """The requirements that the oracle sees broken by a design, with some values edited."""
    data = merged_data(problem)
    inputs, changed = Inputs(data), copied(data)
    for path, text in texts.items():
        inputs.set(changed, path, text)
    edited = oracle.load_text(effective_text(changed))
    design = {name: decisions.get(name) for name in oracle.decisions(edited)}
    found: list[str] = oracle.evaluate(edited, design)["violations"]
    return found
