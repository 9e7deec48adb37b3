"""`dse.resume`: a stopped search goes on from the result that it left, as the question that it was: robust or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from dse.api.resume import read_search, search_in, search_of
from dse.api.solve import Watcher, solve_asked
from dse.api.stated import restated
from dse.errors import UsageError, about
from dse.pareto.front import Budget, Progress
from dse.results.reading import read_result
from dse.results.robust import RobustResult
from dse.results.solve import Result
from dse.study.corners import RobustQuestion
from dse.study.robust import RobustSearch, RobustWatcher, solve_question
from dse.timelimit import TimeLimit


def resume(
    path: str | Path,
    *,
    problem: str | Path | None = None,
    time_limit_s: float | None = None,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> Result | RobustResult:
    """Go on with a search that was stopped, to the same front as an undisturbed one.

    Parameters
    ----------
    path
        the incomplete result that `Result.to_json` or ``dse solve --json`` wrote, also with ``--robust``.
    problem
        the problem file, where it is no longer where the result says.
    time_limit_s, seed, workers, progress
        as for `solve`.

    Raises
    ------
    UsageError
        when the file is no result, of another problem (which means something else since), or its question is not the
        one that was searched.

    Examples
    --------
    >>> import dse
    >>> import pathlib
    >>> stopped = dse.solve("pump.yaml", time_limit_s=60).to_json()
    >>> written = pathlib.Path("stopped.json").write_text(stopped, encoding="utf-8")
    >>> dse.resume("stopped.json").status
    'complete'
    """
    budget = Budget(TimeLimit.after(time_limit_s), seed, workers)
    asked, earlier = read_search(path, problem)
    with about(path):
        if asked.robust:
            return resume_robust(path, problem, budget, RobustWatcher(progress))
        return solve_asked(asked, budget, Watcher(progress), earlier)


def resume_robust(path: str | Path, problem: str | Path | None, budget: Budget, watcher: RobustWatcher) -> RobustResult:
    """Go on with a robust search; see `resume`."""
    question, earlier = read_robust(path, problem)
    return solve_question(question, budget, watcher, earlier)


def read_robust(path: str | Path, problem: str | Path | None) -> tuple[RobustQuestion, RobustSearch]:
    """The question of a robust result, and where its search stands.

    Raises
    ------
    UsageError
        as for `resume`.
    """
    data = read_result(path)
    asked, robust = search_of(data, path, problem)
    effective: Mapping[str, Any] = data["problem"]["effective"]
    question = RobustQuestion(asked, partial(restated, effective=effective))
    if question.words != data["robust"]["inputs"]:
        raise UsageError(f"{path}: what it says may vary is not what the problem says")
    with about(path):
        return question, RobustSearch(search_in(asked.space, nominal_data(data)), robust)


def nominal_data(data: Mapping[str, Any]) -> dict[str, Any]:
    """What a robust result says of the nominal front, in the form of a result."""
    found = data["robust"]
    problem = {**data["problem"], "effective": {**data["problem"]["effective"], "robust": False}}
    return {**data, "problem": problem, "front": found["nominal_front"], **found["nominal"]}
