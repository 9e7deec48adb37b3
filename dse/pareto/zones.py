"""The part of the objective space that may still hold a non-dominated point, as a set of search zones.

Local upper bounds after Klamroth, Lacour and Vanderpooten, "On the representation of the search region in
multi-objective optimization", EJOR 245 (2015): a zone is the set of points strictly below its bound in every objective.
Together with the boxes that the solver has refuted the zones are the proof of completeness: when none is left, every
point is dominated by a found one, equal to it, or proved to belong to no design.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from math import prod
from typing import TypeAlias

Bound: TypeAlias = tuple[int, ...]


def inside(inner: Bound, outer: Bound) -> bool:
    """Whether the zone of `inner` is contained in that of `outer`."""
    return all(one <= other for one, other in zip(inner, outer, strict=True))


class SearchRegion:
    """The open zones, and the refuted boxes with which they shrink.

    Objectives are counted from 0 upwards.
    """

    def __init__(self, start: Bound) -> None:
        self.open: list[Bound] = [start]
        self.refuted: list[Bound] = []

    def refute(self, box: Bound) -> None:
        """No design lies strictly below `box`; drop every zone inside."""
        if any(inside(box, known) for known in self.refuted):
            return
        self.refuted = [known for known in self.refuted if not inside(known, box)] + [box]
        self.open = [zone for zone in self.open if not inside(zone, box)]

    def cut(self, point: Bound) -> None:
        """A design has `point`: points that it dominates or equals are no longer of interest."""
        hit = [zone for zone in self.open if all(value < bound for value, bound in zip(point, zone, strict=True))]
        if not hit:
            return
        kept = [zone for zone in self.open if zone not in set(hit)]
        children: set[Bound] = set()
        for zone in hit:
            for axis, value in enumerate(point):
                child = (*zone[:axis], value, *zone[axis + 1 :])
                if value == 0:  # nothing is below the least value that the terms can sum to
                    self.refute(child)
                elif not any(inside(child, box) for box in self.refuted):
                    children.add(child)
        ordered = sorted(children)
        maximal = [
            child
            for child in ordered
            if not any(child != other and inside(child, other) for other in ordered)
            and not any(inside(child, zone) for zone in kept)
        ]
        self.open = kept + maximal

    def next_zone(self, taken: Collection[tuple[Bound, int]] = ()) -> tuple[Bound, int] | None:
        """The zone to search next and the objective to minimise in it; None when every choice is `taken` already.

        The largest projection wins (Tamby and Vanderpooten, "Enumeration of the nondominated set of multiobjective
        discrete optimization problems", INFORMS Journal on Computing 33, 2021); zones that nobody searches come first.
        """
        busy = {zone for zone, _ in taken}
        best: tuple[bool, int, Bound, int] | None = None
        for zone in self.open:
            volume = prod(zone)
            for axis, extent in enumerate(zone or (1,)):  # without objectives there is one zone, and no axis to choose
                candidate = (zone in busy, -(volume // extent), zone, axis)
                if (best is None or candidate < best) and (zone, axis) not in taken:
                    best = candidate
        return None if best is None else (best[2], best[3])

    def floor(self, zone: Bound) -> Bound:
        """For each objective the least value that a design in `zone` may still have, as far as it is proved."""
        result = []
        for axis in range(len(zone)):
            covering = [
                box[axis]
                for box in self.refuted
                if all(box[other] >= zone[other] for other in range(len(zone)) if other != axis)
            ]
            result.append(max(covering, default=0))
        return tuple(result)


def local_upper_bounds(start: Bound, points: Iterable[Bound], most: int) -> list[Bound] | None:
    """The maximal boxes below `start` that hold no point and none that a point dominates; None beyond `most` boxes.

    They depend on the points alone: the shortest certificate of a complete front.
    """
    region = SearchRegion(start)
    for point in points:
        region.cut(point)
        if len(region.open) > most:
            return None
    return sorted({*region.open, *region.refuted})


def dominates(one: Sequence[int], other: Sequence[int]) -> bool:
    """Whether `one` is no worse in every objective (minimised) and better in at least one."""
    return tuple(one) != tuple(other) and all(a <= b for a, b in zip(one, other, strict=True))
