"""`dse.compare`: results, designs of results, and baselines against each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from dse.analysis.evaluate import Evaluator
from dse.api.exporting import find_design
from dse.api.reopening import reopen
from dse.errors import UsageError, about
from dse.results.analysis import Analysis
from dse.results.compare import DesignComparison, ResultComparison, compare_designs, compare_results
from dse.results.result import Result
from dse.results.tables import analyse_design

BASELINE = "baseline"


def compare(one: str, other: str, problem: str | Path | None = None) -> DesignComparison | ResultComparison:
    """Two results, two designs, or a design and the baseline.

    Parameters
    ----------
    one, other
        ``RESULT.json`` (both: fronts are compared), ``RESULT.json#ID`` (a design), or ``baseline`` (today's design of
        the problem that the other side is about).
    problem
        the problem file of both, where it is no longer where the results say.

    Raises
    ------
    UsageError
        when a result or design does not exist, or the two cannot be compared.
    """
    sides = [_side(text) for text in (one, other)]
    if all(path is None for path, _ in sides):
        raise UsageError("one side must be a result or a design of one")
    results = [None if path is None else reopen(path, problem) for path, _ in sides]
    filled = [result or next(item for item in results if item is not None) for result in results]
    wholes = [path is not None and number is None for path, number in sides]
    if all(wholes):
        try:
            return compare_results((one, other), filled[0], filled[1])
        except ValueError as error:
            raise UsageError(str(error)) from error
    if any(wholes):
        raise UsageError("a whole result compares with a result; name a design of it (RESULT.json#ID)")
    analyses = []
    source = next(path for path, _ in sides if path is not None)
    for result, (path, number) in zip(filled, sides, strict=True):
        with about(path or source):
            analyses.append(_analysis(result, number))
    return compare_designs((one, other), analyses[0], analyses[1])


def _side(text: str) -> tuple[str | None, str | None]:
    """(path, id): the path is None for the baseline, the id for a whole result."""
    if text == BASELINE:
        return None, None
    path, mark, number = text.rpartition("#")
    if mark and path.endswith(".json"):
        return path, number
    return text, None


def _analysis(result: Result, number: str | None) -> Analysis:
    if number is not None:
        return analyse_design(Evaluator(result.space), find_design(result, number).design)
    if result.baseline is None:
        raise UsageError(f"{result.problem.name}: the problem states no complete baseline")
    analysis = analyse_design(Evaluator(replace(result.space, fixed={})), result.baseline)
    if analysis.breaches:
        raise UsageError(f"{result.problem.name}: the baseline is not a valid design: {'; '.join(analysis.breaches)}")
    return analysis
