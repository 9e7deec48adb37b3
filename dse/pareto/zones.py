"""The part of the objective space that may still hold a non-dominated point, as a set of search zones.

Local upper bounds after Klamroth, Lacour and Vanderpooten, "On the representation of the search region in
multi-objective optimization", EJOR 245 (2015): a zone is the set of points strictly below its bound in every objective.
Together with the boxes that the solver has refuted the zones are the proof of completeness: when none is left, every
point is dominated by a found one, equal to it, or proved to belong to no design.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from heapq import nsmallest
from math import prod
from operator import le, lt
from typing import TypeAlias

Bound: TypeAlias = tuple[int, ...]
Question: TypeAlias = tuple[tuple[Bound, ...], int]
"""Zones, and the objective to minimise in their union."""


def inside(inner: Bound, outer: Bound) -> bool:
    """Whether the zone of `inner` is contained in that of `outer`."""
    return all(map(le, inner, outer))


def strictly_inside(point: Bound, zone: Bound) -> bool:
    """Whether a point lies in a zone."""
    return all(map(lt, point, zone))


def capped(zone: Bound, axis: int, point: Bound) -> Bound:
    """The part of a zone that lies below a point in one objective."""
    return tuple(min(bound, point[axis]) if index == axis else bound for index, bound in enumerate(zone))


class RefutedBoxes:
    """Boxes strictly below whose bounds no design lies; none of them inside another.

    Objectives are counted from 0 upwards.
    """

    def __init__(self, boxes: Iterable[Bound] = ()) -> None:
        self.boxes = list(boxes)

    def __iter__(self) -> Iterator[Bound]:
        return iter(self.boxes)

    def cover(self, zone: Bound) -> bool:
        """Whether a zone is refuted as a whole."""
        return any(inside(zone, box) for box in self.boxes)

    def add(self, box: Bound) -> None:
        """No design lies strictly below `box`."""
        if not self.cover(box):
            self.boxes = [known for known in self.boxes if not inside(known, box)] + [box]

    def floor(self, zone: Bound) -> Bound:
        """For each objective the least value that a design in `zone` may still have, as far as it is proved."""
        result = []
        for axis in range(len(zone)):
            covering = [
                box[axis]
                for box in self.boxes
                if all(box[other] >= zone[other] for other in range(len(zone)) if other != axis)
            ]
            result.append(max(covering, default=0))
        return tuple(result)


class SearchRegion:
    """The open zones, and the refuted boxes with which they shrink."""

    def __init__(self, start: Bound) -> None:
        self.start = start
        self.open: list[Bound] = [start]
        self.refuted = RefutedBoxes()

    def refute(self, box: Bound) -> None:
        """No design lies strictly below `box`; drop every zone inside."""
        self.refuted.add(box)
        self.open = [zone for zone in self.open if not inside(zone, box)]

    def cut(self, point: Bound) -> None:
        """A design has `point`: points that it dominates or equals are no longer of interest."""
        hit = [zone for zone in self.open if strictly_inside(point, zone)]
        if not hit:
            return
        kept = [zone for zone in self.open if not strictly_inside(point, zone)]
        children: set[Bound] = set()
        for zone in hit:
            for axis, value in enumerate(point):
                child = (*zone[:axis], value, *zone[axis + 1 :])
                if value == 0:  # nothing is below the least value that the terms can sum to
                    self.refute(child)
                elif not self.refuted.cover(child):
                    children.add(child)
        ordered = sorted(children)
        maximal = [
            child
            for child in ordered
            if not any(child != other and inside(child, other) for other in ordered)
            and not any(inside(child, zone) for zone in kept)
        ]
        self.open = kept + maximal

    def next_question(self, taken: Collection[Question] = (), most: int = 1) -> Question | None:
        """The zones to search next, up to `most`, and the objective to minimise; None when all choices are `taken`.

        The largest projection wins (Tamby and Vanderpooten, "Enumeration of the nondominated set of multiobjective
        discrete optimization problems", INFORMS Journal on Computing 33, 2021); zones that nobody searches come first.
        The nearest of these join it.
        """
        busy = {zone for zones, _ in taken for zone in zones}
        first = {(zones[0], axis) for zones, axis in taken}
        best: tuple[bool, int, Bound, int] | None = None
        for zone in self.open:
            volume = prod(zone)
            for axis, extent in enumerate(zone or (1,)):  # without objectives there is one zone, and no axis to choose
                candidate = (zone in busy, -(volume // extent), zone, axis)
                if (best is None or candidate < best) and (zone, axis) not in first:
                    best = candidate
        if best is None:
            return None
        zone, axis = best[2:]
        others = (other for other in self.open if other != zone and other not in busy)
        nearest = nsmallest(most - 1, others, key=lambda other: (self._distance(zone, other, axis), other))
        return (zone, *nearest), axis

    def _distance(self, one: Bound, other: Bound, axis: int) -> int:
        """How far two zones are apart but for one objective: the sum of differences, in millionths of the range."""
        triples = enumerate(zip(one, other, self.start, strict=True))
        return sum(abs(a - b) * 10**6 // size for index, (a, b, size) in triples if index != axis)


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
