"""`dse.compare`: results, designs of results, and baselines against each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TypeAlias

from dse.analysis.evaluate import Evaluator
from dse.answers.analysis import Analysis, analyse_design
from dse.answers.comparison import DesignComparison, ResultComparison, compare_designs, compare_results
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.questions.complete_design import baseline_design
from dse.questions.named_design import design_reference
from dse.questions.reopen import reopen
from dse.questions.verbs.export import find_design
from dse.space.model.space import Space
from dse.support import arguments
from dse.support.errors import UsageError, about

BASELINE = "baseline"


Side: TypeAlias = Result | RobustResult | Analysis | str | Path
"""What is compared: a result or an analysis, or text that names one."""


@arguments.checked(problem=arguments.optional_path)
def compare(one: Side, other: Side, problem: str | Path | None = None) -> DesignComparison | ResultComparison:
    """Two results, two designs, or a design and the baseline.

    Parameters
    ----------
    one, other
        two results (their fronts are compared) or two analyses (of one design each), as `dse.solve` and `dse.analyse`
        return them; or as text ``RESULT.json``, ``RESULT.json#ID`` (a design), or ``baseline`` (today's design of the
        problem that the other side is about).
    problem
        the problem file of both, where it is no longer where the results say.

    Raises
    ------
    UsageError
        when a result or design does not exist, or the two cannot be compared.

    Examples
    --------
    >>> import dse
    >>> found = dse.compare(dse.solve("pump.yaml"), dse.solve("pump.yaml", max_jitter="10 ms"))
    >>> {line.name: (line.one, line.other) for line in found.facts if line.differs}["points"]
    ('4', '2')
    """
    first, second = _read(one, problem), _read(other, problem)
    names = _name(one), _name(other)
    if first is None and second is None:
        raise UsageError("one side must be a result or a design of one")
    if isinstance(first, Result) and isinstance(second, Result):
        try:
            return replace(compare_results(names, first, second), carried=_carried(first, second))
        except ValueError as error:
            raise UsageError(str(error)) from error
    if isinstance(first, Result) or isinstance(second, Result):
        raise UsageError("a whole result compares with a result; name a design of it (RESULT.json#ID)")
    comparison = compare_designs(names, _analysis(first, second), _analysis(second, first))
    return replace(
        comparison, carried=_carried(*(side.result for side in (first, second) if isinstance(side, _ComparedDesign)))
    )


@dataclass(frozen=True)
class _ComparedDesign:
    """A design of a result, by its id."""

    path: str
    number: str
    result: Result


def _read(side: Side, problem: str | Path | None) -> Result | Analysis | _ComparedDesign | None:
    """The result or design that a side names; None for the baseline of the other side's problem."""
    if isinstance(side, Result | Analysis):
        return side
    if isinstance(side, RobustResult):
        return side.robust
    if not isinstance(side, str | PathLike):
        raise UsageError(
            f"expected a result, an analysis (of a point: dse.analyse(result, point)), RESULT.json#ID or {BASELINE}; "
            f"got a {type(side).__name__}"
        )
    if str(side) == BASELINE:
        return None
    if (reference := design_reference(str(side))) is not None:
        path, number = reference
        return _ComparedDesign(path, number, reopen(path, problem))
    return reopen(side, problem)


def _carried(*results: Result) -> tuple[str, ...]:
    """The problem files that were not there, for which the results' own texts stand."""
    return tuple(dict.fromkeys(item.problem.file for item in results if item.problem.is_carried))


def _name(side: Side) -> str:
    """The name of a side in titles."""
    if isinstance(side, Result | RobustResult):
        return side.problem.name
    return f"a design of {side.space.name}" if isinstance(side, Analysis) else str(side)


def _analysis(side: Analysis | _ComparedDesign | None, other: Analysis | _ComparedDesign | None) -> Analysis:
    """The analysis of a design; of the baseline of the other side's problem where there is none."""
    if isinstance(side, Analysis):
        return side
    if side is not None:
        with about(side.path):
            return analyse_design(Evaluator(side.result.space), find_design(side.result, side.number).design)
    assert other is not None
    space = other.space if isinstance(other, Analysis) else other.result.space
    with about(other.path if isinstance(other, _ComparedDesign) else space.name):
        return _baseline(space)


def _baseline(space: Space) -> Analysis:
    base = baseline_design(space)
    if base is None:
        raise UsageError(f"{space.name}: the problem states no complete baseline")
    analysis = analyse_design(Evaluator(replace(space, fixed={})), base)
    if analysis.breaches:
        raise UsageError(f"{space.name}: the baseline is not a valid design: {'; '.join(analysis.breaches)}")
    return analysis
