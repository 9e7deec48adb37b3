"""The part of the objective space that may still hold a non-dominated point, as a set of search regions.

Local upper bounds after Klamroth, Lacour and Vanderpooten, "On the representation of the search region in
multi-objective optimization", EJOR 245 (2015): a region (there: a search zone) is the set of points strictly below its
bound in every objective. Together with the refuted regions the open ones are the proof of completeness: when none is
left, every point is dominated by a found one, equal to it, or proved to belong to no design.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from heapq import nsmallest
from math import prod
from operator import le, lt
from typing import TYPE_CHECKING, TypeAlias

from dse.encode.linear import EXACT_LIMIT, set_domain

if TYPE_CHECKING:
    from ortools.sat.python import cp_model

    from dse.encode.model import EncodedSpace

Bound: TypeAlias = tuple[int, ...]
Question: TypeAlias = tuple[tuple[Bound, ...], int]
"""Regions, and the objective to minimise in their union."""


def inside(inner: Bound, outer: Bound) -> bool:
    """Whether the region of `inner` is contained in that of `outer`.

    Regions are given by their upper corners; all objectives are minimised.
    """
    return all(map(le, inner, outer))


def strictly_inside(point: Bound, region: Bound) -> bool:
    """Whether a point lies in a region.

    The upper corner itself is outside: a region holds what is better in every objective.
    """
    return all(map(lt, point, region))


def capped(region: Bound, axis: int, point: Bound) -> Bound:
    """The part of a region that lies below a point in one objective.

    `axis` is the index of the objective.
    """
    return tuple(min(bound, point[axis]) if index == axis else bound for index, bound in enumerate(region))


class RefutedRegions:
    """Regions strictly below whose bounds no design lies; none of them inside another.

    Objectives are counted from 0 upwards.
    """

    def __init__(self, regions: Iterable[Bound] = ()) -> None:
        self.regions = list(regions)

    def __iter__(self) -> Iterator[Bound]:
        return iter(self.regions)

    def cover(self, region: Bound) -> bool:
        """Whether a region is refuted as a whole.

        True where a known refuted region contains it.
        """
        return any(inside(region, known) for known in self.regions)

    def add(self, region: Bound) -> None:
        """Record that no design lies strictly below `region`.

        Regions that the new one contains are dropped.
        """
        if not self.cover(region):
            self.regions = [known for known in self.regions if not inside(known, region)] + [region]

    def floor(self, region: Bound, least: Bound | None = None) -> Bound:
        """For each objective the least value that a design in `region` may still have, as far as it is proved.

        It is at least `least`, or 0.
        """
        result = []
        for axis in range(len(region)):
            covering = [
                known[axis]
                for known in self.regions
                if all(known[other] >= region[other] for other in range(len(region)) if other != axis)
            ]
            result.append(max([*covering, 0 if least is None else least[axis]]))
        return tuple(result)


class SearchRegions:
    """The open regions, and the refuted regions with which they shrink.

    Regions are upper corners (Klamroth, Lacour and Vanderpooten 2015); the front is complete when none is open.
    """

    def __init__(self, start: Bound) -> None:
        self.start = start
        self.open: list[Bound] = [start]
        self.refuted = RefutedRegions()

    def refute(self, region: Bound) -> None:
        """Record that no design lies strictly below `region`, and drop every open region inside.

        Proved by a solver call, or known from the bounds of objectives.
        """
        self.refuted.add(region)
        self.open = [known for known in self.open if not inside(known, region)]

    def cut(self, point: Bound) -> None:
        """A design has `point`: points that it dominates or equals are no longer of interest.

        Each region that contains the point is replaced by one for each objective, bounded by the point in it; regions
        inside others are dropped.
        """
        hit = [region for region in self.open if strictly_inside(point, region)]
        if not hit:
            return
        kept = [region for region in self.open if not strictly_inside(point, region)]
        children: set[Bound] = set()
        for region in hit:
            for axis, value in enumerate(point):
                child = (*region[:axis], value, *region[axis + 1 :])
                if value == 0:  # nothing is below the least value that the terms can sum to
                    self.refute(child)
                elif not self.refuted.cover(child):
                    children.add(child)
        ordered = sorted(children)
        maximal = [
            child
            for child in ordered
            if not any(child != other and inside(child, other) for other in ordered)
            and not any(inside(child, region) for region in kept)
        ]
        self.open = kept + maximal

    def next_question(
        self, taken: Collection[Question] = (), most: int = 1, rather: Collection[int] = ()
    ) -> Question | None:
        """The regions to search next, up to `most`, and the objective to minimise; None when all choices are `taken`.

        An objective of those in `rather` is minimised where one is left.

        The largest projection wins (Tamby and Vanderpooten, "Enumeration of the nondominated set of multiobjective
        discrete optimization problems", INFORMS Journal on Computing 33, 2021); regions that nobody searches come
        first. The nearest of these join it.
        """
        busy = {region for regions, _ in taken for region in regions}
        first = {(regions[0], axis) for regions, axis in taken}
        best: tuple[bool, bool, int, Bound, int] | None = None
        for region in self.open:
            volume = prod(region)
            for axis, extent in enumerate(region or (1,)):  # without objectives: one region, and no axis to choose
                candidate = (region in busy, axis not in rather, -(volume // extent), region, axis)
                if (best is None or candidate < best) and (region, axis) not in first:
                    best = candidate
        if best is None:
            return None
        region, axis = best[3:]
        others = (other for other in self.open if other != region and other not in busy)
        nearest = nsmallest(most - 1, others, key=lambda other: (self._distance(region, other, axis), other))
        return (region, *nearest), axis

    def _distance(self, one: Bound, other: Bound, axis: int) -> int:
        """How far two regions are apart but for one objective: the sum of differences, in millionths of the range."""
        triples = enumerate(zip(one, other, self.start, strict=True))
        return sum(abs(a - b) * 10**6 // size for index, (a, b, size) in triples if index != axis)


def local_upper_bounds(start: Bound, points: Iterable[Bound], most: int) -> list[Bound] | None:
    """The maximal regions below `start` that hold no point and none that a point dominates; None beyond `most` regions.

    They depend on the points alone: the shortest certificate of a complete front.
    """
    regions = SearchRegions(start)
    for point in points:
        regions.cut(point)
        if len(regions.open) > most:
            return None
    return sorted({*regions.open, *regions.refuted})


def restrict(encoded: EncodedSpace, regions: Sequence[Bound], floor: Bound | None = None) -> None:
    """Restrict the model to designs in one of the regions, with objectives of at least `floor`.

    Sets domains of the model's objective variables and switches; nothing is added to the model.
    """
    assert len(regions) <= max(1, len(encoded.regions)), "more regions than the model has switches"
    proto = encoded.model.proto
    for number, objective in enumerate(encoded.objectives):
        high = min(max(region[number] for region in regions) - 1, objective.size)
        set_domain(proto.variables[objective.variable.index], floor[number] if floor is not None else 0, high)
    for number, switch in enumerate(encoded.regions):
        set_domain(proto.variables[switch.literal.index], 0, int(number < len(regions)))
    for switch, region in zip(encoded.regions, regions, strict=False):  # as many as there are regions
        for constraint, bound in zip(switch.constraints, region, strict=True):
            set_domain(proto.constraints[constraint].linear, 0, bound - 1)


@contextmanager
def valued(model: cp_model.CpModel, least: int | None, most: int | None) -> Iterator[None]:
    """Limit the minimised objective to values from `least` to `most`, as far as they are known.

    Bounds of the objective in solver steps; the domain is cleared at the end.
    """
    if least is None and most is None:
        yield  # without a look at the objective, which would make one where there is none
        return
    domain = model.proto.objective.domain
    domain.extend([0 if least is None else least, EXACT_LIMIT if most is None else most])
    try:
        yield
    finally:
        domain.clear()


@contextmanager
def held(model: cp_model.CpModel, literals: Sequence[int]) -> Iterator[bool]:
    """Literals (by index) are true; yields whether all of them may be, where some are false already nothing changes.

    Domains are restored at the end.
    """
    variables = model.proto.variables
    before = [tuple(variables[index].domain) for index in literals]
    may_be = all(high for _, high in before)
    try:
        for index in literals if may_be else ():
            set_domain(variables[index], 1, 1)
        yield may_be
    finally:
        for index, (low, high) in zip(literals, before, strict=True):
            set_domain(variables[index], low, high)
