"""`dse.resume`: a stopped search goes on from the result that it left, as the question that it was: robust or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from dse.answers.forms.codec import read_as
from dse.answers.reading import read_result
from dse.answers.result import Result
from dse.answers.robust import Failure, RobustResult
from dse.questions.problem import restated
from dse.questions.reopen import found_again
from dse.questions.robust.corner_demands import RobustQuestion
from dse.questions.robust.robust import RobustSearch, RobustWatcher, solve_question
from dse.questions.stopped_search import read_search, search_in, search_of
from dse.questions.verbs.solve import Watcher, solve_asked
from dse.search.front import Progress, SearchLimits
from dse.support import arguments
from dse.support.errors import UsageError, about


@arguments.checked(
    path=arguments.path,
    problem=arguments.optional_path,
    time_limit_s=arguments.span,
    seed=arguments.SEED,
    workers=arguments.Whole(1, 64),
    progress=arguments.call,
)
def resume(
    path: str | Path,
    *,
    problem: str | Path | None = None,
    time_limit_s: arguments.Span | None = None,
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
    budget = SearchLimits(arguments.time_limit(time_limit_s), seed, workers)
    problem_asked, earlier = read_search(path, problem)
    with about(path):
        if problem_asked.robust:
            return resume_robust(path, problem, budget, RobustWatcher(progress))
        return solve_asked(problem_asked, budget, Watcher(progress), earlier)


@arguments.checked(path=arguments.path, problem=arguments.optional_path)
def reopen_robust(path: str | Path, problem: str | Path | None = None) -> RobustResult:
    """The robust result at `path`, as `dse.solve_robust` returned it.

    Both fronts are computed anew and compared; why designs of the nominal one are not robust is as it was written.

    Parameters
    ----------
    path
        what ``dse solve --robust --json`` wrote.
    problem
        the problem file, where it is no longer where the result says.

    Raises
    ------
    UsageError
        when the file is no robust result, its problem is not found or means something else now, or a figure is not the
        one that the analysis finds.

    Examples
    --------
    >>> import dse, pathlib
    >>> text = pathlib.Path("pump.yaml").read_text(encoding="utf-8")
    >>> text += "uncertainty: {threads.filter.compute_execution_time: {factor: 0.9 .. 1.5}}"
    >>> written = pathlib.Path("robust.json").write_text(dse.solve_robust(text).to_json(), encoding="utf-8")
    >>> dse.reopen_robust("robust.json").price["price"]
    (6000, 6000)
    """
    data = read_result(path)
    if "robust" not in data:
        raise UsageError(f"{path}: is no result of `dse solve --robust`")
    with about(path):
        problem_asked, search = search_of(data, path, problem)
        robust = found_again(data, problem_asked, search, path)
        alone = {**nominal_data(data), "conflicts": [], "give_up": [], "others": [], "insisting": None}
        nominal = found_again(alone, replace(problem_asked, robust=False), search_in(problem_asked.space, alone), path)
        said = data["robust"]
        failures = tuple(read_as(Failure, item) for item in said["lost"])
    return RobustResult(robust, nominal, said["inputs"], said["corners"], failures, tuple(said.get("unjudged", ())))


def resume_robust(
    path: str | Path, problem: str | Path | None, budget: SearchLimits, watcher: RobustWatcher
) -> RobustResult:
    """Go on with a robust search; see `resume`.

    Reads the stopped result at `path`, checks that it belongs to `problem` (its own file when None), and searches
    within a new budget. Raises what `resume` raises.
    """
    question, earlier = _read_robust(path, problem)
    return solve_question(question, budget, watcher, earlier)


def _read_robust(path: str | Path, problem: str | Path | None) -> tuple[RobustQuestion, RobustSearch]:
    """The question of a robust result, and where its search stands.

    Raises
    ------
    UsageError
        as for `resume`.
    """
    data = read_result(path)
    problem_asked, robust = search_of(data, path, problem)
    effective: Mapping[str, Any] = data["problem"]["effective"]
    question = RobustQuestion(problem_asked, partial(restated, effective=effective))
    if question.words != data["robust"]["inputs"]:
        raise UsageError(f"{path}: what it says may vary is not what the problem says")
    with about(path):
        return question, RobustSearch(search_in(problem_asked.space, nominal_data(data)), robust)


def nominal_data(data: Mapping[str, Any]) -> dict[str, Any]:
    """The nominal front of a robust result, in the form of a result.

    A mapping in the form of a plain result, so that its checks can be used for the nominal front. `data` is not
    modified.
    """
    robust = data["robust"]
    problem = {**data["problem"], "effective": {**data["problem"]["effective"], "robust": False}}
    return {**data, "problem": problem, "front": robust["nominal_front"], **robust["nominal"]}
