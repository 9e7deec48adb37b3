"""Taking up a stopped search from the result file that it left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dse.api.problem import Problem, load
from dse.api.recalling import named_design, restated
from dse.errors import UsageError
from dse.pareto.front import FrontSearch
from dse.results.reading import check_form, read_result
from dse.space.types import Space


def read_search(path: str | Path, problem: str | Path | None = None) -> tuple[Problem, FrontSearch]:
    """The problem, asked as the result at `path` says, and the state of its search.

    Raises
    ------
    UsageError
        when the file is no result, or the problem is not found or has changed since.
    """
    data = read_result(path)
    check_form(data, path)
    try:
        asked = restated(load(_problem_file(data, Path(path), problem)), data["problem"]["effective"])
        _check_unchanged(asked, data["problem"])
        return asked, _search(asked.space, data)
    except (KeyError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        raise UsageError(f"{path}: is not a whole result: {error!r}") from error


def _problem_file(data: Mapping[str, Any], result: Path, given: str | Path | None) -> Path:
    """The problem file as given, as the result names it, or beside the result."""
    if given is not None:
        return Path(given)
    named = Path(data["problem"]["file"])
    candidates = [named, result.parent / named, result.parent / named.name]
    found = next((candidate for candidate in candidates if candidate.is_file()), None)
    if found is None:
        raise UsageError(f"{result}: its problem file {named} is not there; name it")
    return found


def _check_unchanged(asked: Problem, stated: Mapping[str, Any]) -> None:
    """The problem's files must have the very content that the result was computed from."""
    loaded = asked.loaded
    now = [loaded.sha256, *(digest for _, digest in loaded.includes)]
    then = [stated["sha256"], *(item["sha256"] for item in stated["includes"])]
    if now != then:
        raise UsageError(f"{loaded.path} has changed since the result was written")


def _search(space: Space, data: Mapping[str, Any]) -> FrontSearch:
    signs = {item.metric.name: -1 if item.sense == "maximise" else 1 for item in space.objectives}
    points = {}
    for point in data["front"]:
        vector = tuple(int(point["objectives"][name]) for name in signs)
        points[vector] = named_design(space, point["decisions"])
    return FrontSearch(
        points=points,
        unexplored=tuple(_bound(region, signs) for region in data["unexplored"]),
        refuted=tuple(_bound(region, signs) for region in data["refuted"]),
        calls=int(data["search"]["solver_calls"]),
        elapsed_s=0.0,
    )


def _bound(region: Mapping[str, int], signs: Mapping[str, int]) -> tuple[int, ...]:
    """A region as an exclusive upper bound of minimised objectives."""
    return tuple(sign * int(region[name]) for name, sign in signs.items())
