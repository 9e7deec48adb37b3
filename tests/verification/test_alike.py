"""Alike cores of the second model are numbered: no region with a design is refuted, whatever tells cores apart."""

from __future__ import annotations

import random

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.space.model.space import Space
from dse.space.question.open_cores import decided_cores
from dse.verification import tables
from dse.verification.exhaustion import TooMany, exhaust
from dse.verification.model import SecondModel
from dse.verification.scheduling.core_symmetry import alike_cores
from tests.helpers.effort import cases
from tests.helpers.thread_systems import KINDS, draw, text_of

FEW = 3_000
ASKED = {
    "deadlines": lambda text: text,
    "flow": lambda text: text.replace("deadlines: all\nprocessing: execution_time", "processing: response_time"),
    "both": lambda text: text.replace("processing: execution_time", "processing: response_time"),
}


def space_of(text: str) -> Space:
    return dse.loads(text).space


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(10, 40_000))
def test_every_vector_of_every_design_is_found(
    seed: int, kind: str, asked: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And with an option of some decision, cores among them, exactly where some design has it."""
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)  # no response time is tabulated
    made = tables.build_tables(Evaluator(space_of(ASKED[asked](text_of(draw(seed, kind=kind))))))
    try:
        found = exhaust(made, FEW)
    except TooMany:
        return
    model, rng = SecondModel(made), random.Random(seed)
    vectors = sorted(set(map(tuple, found.vectors.tolist())))
    for vector in rng.sample(vectors, min(6, len(vectors))):
        below = [value + 1 for value in vector]
        assert model.in_region(below).answer == "design"
        if not any(total.is_open for total, _ in made.objectives):
            assert model.in_region(below, vector).answer == "design"
        is_there = (found.vectors < below).all(axis=1)
        decision = rng.randrange(len(made.allowed))
        option = rng.choice(list(made.allowed[decision]))
        has_it = is_there & ((found.designs[:, decision] == option) | (found.designs[:, decision] == -1))
        assert model.in_region(below, None, (decision, option)).answer == ("design" if has_it.any() else "none")
    assert model.in_region([min(column) for column in zip(*vectors, strict=True)]).answer == "none" if vectors else True


def classes(
    threads: str, processors: str = "p: {type: t}", types: str = "t: {cores: 4}", more: str = ""
) -> list[list[int]]:
    text = f"""
dse: 1
name: Alike
processor_types: {{{types}}}
processors: {{{processors}}}
threads:
{threads}
deadlines: all
{more}
"""
    made = tables.build_tables(Evaluator(space_of(text)))
    assert decided_cores(made.space)
    return alike_cores(made)


ANY = "  {}: {{processor: p, period: 10 ms, compute_execution_time: 3 ms, core: {}}}"


def listed(*cores: str) -> str:
    return "\n".join(ANY.format(name, core) for name, core in zip("abcdefgh", cores, strict=False))


def test_what_tells_cores_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    assert classes(listed("any", "any", "any")) == [[1, 2, 3, 4]]
    assert classes(listed("any", "[1, 3]", "any")) == [[1, 3], [2, 4]]
    assert classes(listed("any", "2", "any")) == [[1, 3, 4]]
    assert classes(listed("any", "first_fit", "any")) == []
    assert classes(listed("any", "any"), more="rules: ['require a.core != 2']") == []
    assert classes(listed("any", "any"), more="requirements: ['utilisation of core 2 of p <= 40 %']") == []
    few = "t: {cores: 4}, u: {cores: 2}"
    assert classes(listed("any", "any", "any"), "p: {type: [t, u]}", few) == [[1, 2, 3, 4]]
    assert classes(listed("any", "2", "any"), "p: {type: [t, u]}", few) == [[1, 3, 4]]
    groups = "t: {cores: {big: 2, small: 2}}"
    slow = "  a: {processor: p, period: 10 ms, compute_execution_time: {t/big: 1 ms, t/small: 2 ms}}"
    assert classes(slow, types=groups) == []
