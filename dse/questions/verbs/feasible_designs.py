"""Every feasible design of a small problem, to show a front among them."""

from __future__ import annotations

from dataclasses import dataclass

from dse.analysis.evaluate import Evaluator
from dse.answers.result import Result
from dse.answers.tables.display import without_stand_in
from dse.verification.diagrams import TooLarge
from dse.verification.exhaustion import TooMany, exhaust
from dse.verification.tables import build_tables

MOST_DESIGNS = 100_000
"""The greatest number of combinations of options that are looked at."""
MOST_ROWS = 200_000
MOST_JUDGED = 500
"""The greatest number of designs where the analysis has to judge each: a fraction of a second."""
MOST_VECTORS = 5_000
"""More are no points in a plot but a surface, and too much to carry in a page."""


@dataclass(frozen=True)
class Feasible:
    """All feasible designs of a question: how many, and their objectives in the units of the front, each once.

    The vectors are in counting units of the objectives; several designs may share one, so that there can be fewer
    vectors than designs.
    """

    count: int
    vectors: tuple[tuple[int, ...], ...]


def feasible_designs(result: Result) -> Feasible | None:
    """All feasible designs of a result's problem; None where there are too many designs to look at each.

    Found by the exhaustion of `dse verify`, which shares the formulas with the search, and nothing else.
    """
    if not result.front or result.search.space_size > MOST_DESIGNS:
        return None
    try:
        tables = build_tables(Evaluator(result.space))
        is_judged = tables.waits is not None or not tables.bounds_are_exact
        exhaustion = exhaust(tables, MOST_JUDGED if is_judged else MOST_ROWS)
    except (TooLarge, TooMany):
        return None
    signs = [1 if objective.sense == "minimise" else -1 for objective in result.objectives]
    rows = {
        tuple(
            without_stand_in(result.space, info.metric, objective.unit, sign * int(value))
            for info, objective, sign, value in zip(result.space.objectives, result.objectives, signs, row, strict=True)
        )
        for row in exhaustion.vectors
    }
    front = {tuple(point.objectives[info.name] for info in result.objectives) for point in result.front}
    if len(rows) > MOST_VECTORS or not front <= rows:  # a robust front has the worst figures of its designs
        return None
    return Feasible(len(exhaustion.designs), tuple(sorted(rows)))
