"""What is known where the time was up before anything was searched: a design to start from, and bounds."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from dse.analysis.bounds import best_possible
from dse.analysis.evaluate import Evaluator
from dse.pareto.best import signed
from dse.pareto.outcome import FrontSearch
from dse.pareto.regions import Bound, RefutedRegions
from dse.space.types import Design
from dse.timelimit import OutOfTime, TimeLimit, until


def started_from(evaluator: Evaluator, known: FrontSearch, start: Design | None, limit: TimeLimit) -> FrontSearch:
    """What is known before anything was searched: where that is no design, the one to start from, if it is feasible.

    And what no design is better than.
    """
    if known.is_complete:
        return known
    known = replace(known, floors=_floors(evaluator, known, limit))
    if start is None or known.points:
        return known
    with until(limit.for_what_is_needed()), suppress(OutOfTime):
        found = evaluator.evaluate(start)
        if found.is_feasible:
            evaluator.weigh(start)
            return replace(known, points={found.objectives: found.design}, not_first=frozenset({found.objectives}))
    return known


def _floors(evaluator: Evaluator, known: FrontSearch, limit: TimeLimit) -> tuple[Bound, ...]:
    """The least that each objective may have in each open region, by its summands; none where one has no bound."""
    with until(limit.for_the_last_steps()):
        pairs = list(zip(evaluator.objectives, evaluator.space.objectives, strict=True))
        ends = [best_possible(evaluator.space, measure, objective.sense) for measure, objective in pairs]
    if None in ends:
        return ()
    least = signed(evaluator, tuple(end for end in ends if end is not None))
    refuted = RefutedRegions(known.refuted)
    return tuple(refuted.floor(region, least) for region in known.unexplored)
