"""The optimality gap of an incomplete front: how much better a missing design can be, by the proved bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dse.answers.designs import Point
from dse.answers.result import Result

UNBOUNDED = 2**62
"""Stands for the bound of a region in an objective in which it has none."""
MOST_AT_ONCE = 10**6
"""Maximum number of figures that are compared in one step."""


@dataclass(frozen=True)
class Outlook:
    """An objective of a stopped search, in its counting unit.

    `bound` is what no missing design is better than, `best` the best value found (None: nothing was found). For every
    missing design some design found is worse by at most `near` in this objective, and by at most that of each other
    objective there.
    """

    name: str
    sense: str
    unit: str
    bound: int
    best: int | None
    near: int | None

    @property
    def possible_gain(self) -> int:
        """By how much a missing design can be better than everything found; 0 where it cannot.

        In the counting unit of the objective: the distance between the best value found and the proved bound.
        """
        if self.best is None:
            return 0
        return max(0, self.best - self.bound if self.sense == "minimise" else self.bound - self.best)


def is_proved(result: Result, point: Point) -> bool:
    """Whether a point is proved to be non-dominated: it is in none of the regions that may hold something better.

    A search that is stopped before its first point shows the best design that it has found.
    """
    signs = {info.name: 1 if info.sense == "minimise" else -1 for info in result.objectives}
    return not any(
        all(sign * point.objectives[name] < sign * region[name] for name, sign in signs.items() if name in region)
        for region in result.unexplored
    )


def outlooks_of(result: Result) -> tuple[Outlook, ...]:
    """The bounds that a stopped search proved on designs that it did not find; empty for a finished search.

    The refuted regions that reach across an open region give it a floor in each objective: no design in it is better.
    Of the points found the one nearest to that floor counts (in the additive sense of Zitzler et al., IEEE Trans.
    Evol. Comput. 7, 2003: least in the objective where it is furthest off, of the range from the bound to the worst
    value found).
    """
    names = [info.name for info in result.objectives]
    if result.status != "incomplete" or not all(name in result.potential for name in names):
        return ()
    import numpy

    signs = [1 if info.sense == "minimise" else -1 for info in result.objectives]

    def vectors(rows: Sequence[Mapping[str, int]]) -> Any:
        columns = [
            [sign * row[name] if name in row else UNBOUNDED for name, sign in zip(names, signs, strict=True)]
            for row in rows
        ]
        return numpy.array(columns, dtype=numpy.int64).reshape(-1, len(names))

    least, points = vectors([result.potential])[0], vectors([point.objectives for point in result.front])
    near: list[int | None] = [None] * len(names)
    best: list[int | None] = [None] * len(names)
    if len(points):
        floors = _floors(vectors(result.unexplored), vectors(result.refuted), least)
        near = [int(value) for value in _distances(points, floors, least)]
        best = [sign * int(value) for sign, value in zip(signs, points.min(axis=0), strict=True)]
    return tuple(
        Outlook(info.name, info.sense, info.unit, result.potential[info.name], best[axis], near[axis])
        for axis, info in enumerate(result.objectives)
    )


def _floors(open_: Any, refuted: Any, least: Any) -> Any:
    """For each open region the least value of each objective: the furthest refuted region that spans all the others."""
    import numpy

    floors = numpy.tile(least, (len(open_), 1))
    step = max(1, MOST_AT_ONCE // max(1, len(refuted)))
    for start in range(0, len(open_), step):
        regions = open_[start : start + step]
        spans = refuted[None, :, :] >= regions[:, None, :]
        for axis in range(len(least)):
            across = numpy.delete(spans, axis, axis=2).all(axis=2)
            reach = numpy.where(across, refuted[None, :, axis], least[axis])
            floors[start : start + step, axis] = reach.max(axis=1, initial=least[axis])
    return floors


def _distances(points: Any, floors: Any, least: Any) -> Any:
    """For each objective how far the nearest point is from a floor, where it is furthest."""
    import numpy

    scale = numpy.maximum(points.max(axis=0) - numpy.minimum(points.min(axis=0), least), 1)
    worst = numpy.zeros(len(least), dtype=numpy.int64)
    for floor in floors:
        away = points - floor
        worst = numpy.maximum(worst, away[(away / scale).max(axis=1).argmin()])
    return worst
