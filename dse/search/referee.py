"""The referee's word on what the solver finds: no design leaves the search that the analysis has not recomputed.

The model admits exactly what the analysis does, but for limits on measures that are rounded (`Measure.rounded`): of
those exact comparison may refuse a design that the model takes. Any other disagreement is a fault of this program, and
ends the run with both sides of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from dse.analysis.evaluate import Evaluation, Evaluator
from dse.analysis.limits import Limit, judge
from dse.analysis.views import View
from dse.search.certificate import FrontSearch
from dse.space.model.space import Design
from dse.support.errors import RefereeError, UsageError


def may_refuse(evaluator: Evaluator) -> bool:
    """Whether exact comparison may refuse what the model admits: where some limit is on a rounded measure.

    The model rounds such sums to the safe side of feasibility, so that a design may be refused and excluded.
    """
    return any(limit.measure.rounded for limit in evaluator.limits)


def refused(evaluator: Evaluator, design: Design, limits: Sequence[Limit]) -> list[int]:
    """The positions of those `limits` that exact comparison refuses in the solver's design, and rounding let pass.

    Raises
    ------
    RefereeError
        when the design is none, or breaks a limit of a measure that is not rounded.
    """
    reasons = evaluator.invalid(design)
    view = View(design)
    broken = [] if reasons else [at for at, limit in enumerate(limits) if not judge(limit, view).holds]
    _blame([*reasons, *(limits[at].requirement.text for at in broken if not limits[at].measure.rounded)])
    return broken


def accepted(evaluator: Evaluator, design: Design, claimed: Sequence[int] | None = None) -> Evaluation | None:
    """The evaluation of the solver's design; None where exact comparison refuses what rounding let pass.

    Parameters
    ----------
    evaluator
        the analysis of the question that the solver was asked.
    design
        what the solver found.
    claimed
        the objectives that the solver says it has, in counting units and the objectives' own sense; None where it
        claims none.

    Raises
    ------
    RefereeError
        when the analysis finds other objectives than those claimed, or another reason to refuse the design.
    """
    evaluation = evaluator.evaluate(design)
    verdicts = zip(evaluator.limits, evaluation.verdicts, strict=not evaluation.breaches)
    broken = [limit for limit, verdict in verdicts if not verdict.holds]
    _blame([*evaluation.breaches, *(limit.requirement.text for limit in broken if not limit.measure.rounded)])
    if claimed is not None and evaluation.objectives != tuple(claimed):
        raise RefereeError(f"the solver claims {tuple(claimed)}, the analysis finds {evaluation}")
    return None if broken else evaluation


def confirmed(evaluator: Evaluator, design: Design, claimed: Sequence[int]) -> Design:
    """The design, canonical, of which the analysis finds what the solver claims, every requirement met exactly.

    Raises
    ------
    RefereeError
        when it does not.
    """
    evaluation = accepted(evaluator, design, claimed)
    if evaluation is None:
        raise RefereeError(f"the solver claims {tuple(claimed)}, the analysis finds {evaluator.evaluate(design)}")
    return evaluation.design


def checked(evaluator: Evaluator, earlier: FrontSearch) -> FrontSearch:
    """A stopped search, after the referee has looked at its points.

    Raises
    ------
    UsageError
        when it has a point that is none of this space.
    OutOfTime
        when there was no time to look at them all.
    """
    points: dict[tuple[int, ...], Design] = {}
    for vector, design in earlier.points.items():
        evaluation = evaluator.evaluate(design)
        if not evaluation.is_feasible or evaluation.objectives != vector:
            raise UsageError(f"the search to go on with has a design with the figures {vector}; it has others")
        points[vector] = evaluation.design
    return replace(earlier, points=points)


def _blame(reasons: Sequence[str]) -> None:
    if reasons:
        raise RefereeError(f"the solver's design is refused by the analysis: {'; '.join(reasons)}")
