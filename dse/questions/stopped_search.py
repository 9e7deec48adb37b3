"""Taking up a stopped search from the result file that it left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.answers.reading import read_result
from dse.questions.problem import Problem, origin_of, restated
from dse.questions.result_problem import problem_of
from dse.questions.result_question import named_design
from dse.search.front import ANYTHING, FrontSearch
from dse.space.model.space import Space
from dse.support.errors import UsageError, about


def read_search(path: str | Path, problem: str | Path | None = None) -> tuple[Problem, FrontSearch]:
    """The problem, asked as the result at `path` says, and the state of its search.

    Raises
    ------
    UsageError
        when the file is no result, or the problem is not found or means something else now.
    """
    return search_of(read_result(path), path, problem)


def search_of(data: Mapping[str, Any], path: str | Path, problem: str | Path | None) -> tuple[Problem, FrontSearch]:
    """The problem, asked as a result that was read from `path` says, and the state of its search.

    `problem` replaces the file that the result names.

    Raises `UsageError` where the result's question does not belong to the problem, `ProblemError` for a mistake in the
    file.
    """
    with about(path):
        problem_asked = restated(problem_of(data, path, problem), data["problem"]["effective"])
        if origin_of(problem_asked).question != data["problem"]["question"]:
            raise UsageError("what it says of its question is not what was searched: they do not belong together")
        return problem_asked, search_in(problem_asked.space, data)


def search_in(space: Space, data: Mapping[str, Any]) -> FrontSearch:
    """The state of the search that a whole result holds: points, open and refuted regions.

    Raises
    ------
    UsageError
        when it names decisions or options that the space does not have.
    """
    signs = {item.metric.name: -1 if item.sense == "maximise" else 1 for item in space.objectives}
    anywhere = {name: sign * ANYTHING for name, sign in signs.items()}  # where nothing is known of an objective
    points = {}
    evaluator: Evaluator | None = None
    for point in data["front"]:
        design = named_design(space, point["decisions"])
        vector = tuple(point["objectives"][name] for name in signs)
        if None in vector:  # unbounded: the search counts with what stands for it
            evaluator = evaluator or Evaluator(space)
            vector = tuple(map(int, evaluator.evaluate(design).objectives))
        points[vector] = design
    return FrontSearch(
        points=points,
        unexplored=tuple(_bound({**anywhere, **region}, signs) for region in data["unexplored"]),
        refuted=tuple(_bound(region, signs) for region in data["refuted"]),
        calls=data["search"]["solver_calls"],
        elapsed_s=0.0,
        not_first=frozenset(
            vector for vector, point in zip(points, data["front"], strict=True) if point.get("is_first") is False
        ),
    )


def _bound(region: Mapping[str, int], signs: Mapping[str, int]) -> tuple[int, ...]:
    """A region as an exclusive upper bound of minimised objectives."""
    return tuple(sign * region[name] for name, sign in signs.items())
