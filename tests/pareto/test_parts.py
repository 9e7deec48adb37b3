"""Calls that are solved part by part give what they give as a whole."""

from __future__ import annotations

import pytest
from support import PROBLEMS, load_space

from dse.analysis.evaluate import Evaluator
from dse.encode import sums
from dse.encode.model import encode
from dse.pareto.front import search_front
from dse.pareto.subproblem import Answer, Found, Solver, Unfinished, parts_of
from dse.space.types import Space

BY_NAME = {path.stem: path for path in PROBLEMS}


def with_parts(name: str, monkeypatch: pytest.MonkeyPatch) -> Space:
    monkeypatch.setattr(sums, "SHARED_BY", 1)
    space = load_space(BY_NAME[name])
    assert len(list(parts_of(encode(Evaluator(space))))) > 1
    return space


@pytest.mark.parametrize("is_brief_too_short", [False, True])
@pytest.mark.parametrize("name", ["types", "protocols", "derived"])
def test_the_front_is_the_same_part_by_part(
    name: str, is_brief_too_short: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluator = Evaluator(with_parts(name, monkeypatch))
    expected = search_front(evaluator)
    solve, solve_part, asked = Solver._solve, Solver._solve_part, []

    def part(self: Solver, *given: object) -> Answer:
        asked.append(given)
        answer = solve_part(self, *given)  # type: ignore[arg-type]
        is_brief = given[1].__name__ == "_briefly"  # type: ignore[attr-defined]
        return (
            Unfinished(best=answer if isinstance(answer, Found) else None)
            if is_brief_too_short and is_brief
            else answer
        )

    monkeypatch.setattr(Solver, "_solve", lambda self, level: Unfinished() if level == 0 else solve(self, level))
    monkeypatch.setattr(Solver, "_solve_part", part)
    search = search_front(evaluator)
    assert asked
    assert search.points == expected.points
    assert search.is_complete


def test_the_model_is_left_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    encoded = encode(Evaluator(with_parts("types", monkeypatch)))
    solver = Solver(encoded)
    sizes = [item.size for item in encoded.objectives]
    whole = solver.minimise([1] * len(sizes), sizes)
    before = encoded.model.clone()
    monkeypatch.setattr(Solver, "_solve", lambda self, level: Unfinished())
    apart = solver.minimise([1] * len(sizes), sizes)
    assert isinstance(whole, Found)
    assert isinstance(apart, Found)
    assert sum(apart.point) == sum(whole.point)
    assert str(encoded.model.proto) == str(before.proto)
