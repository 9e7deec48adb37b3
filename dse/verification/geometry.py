"""The objective space in whole numbers (to be minimised): what regions and points leave uncovered. No solver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from dse.support.timelimit import look_at_the_clock

Bound: TypeAlias = tuple[int, ...]
"""Exclusive upper bounds: the points strictly below it in every objective."""


def uncovered(points: Sequence[Bound], regions: Sequence[Bound], outer: Bound) -> Bound | None:
    """A part of everything below `outer` that lies in no region and that no point covers; None when nothing is left.

    A point covers what is as bad as itself, or worse, in every objective. Each point in turn cuts the parts that are
    still open; a part within a region is dropped at once. The part returned is that below the bound, and its far
    corner is surely not covered.
    """
    return min(open_parts(points, regions, outer), default=None)


def open_parts(points: Sequence[Bound], regions: Sequence[Bound], outer: Bound) -> list[Bound]:
    """The maximal parts of everything below `outer` that lie in no region and that no point covers.

    Upper corners, in counting units; an empty list means that points and regions cover everything.
    """
    parts = [] if _within(outer, regions) else [outer]
    for point in points:
        look_at_the_clock()
        hit = [part for part in parts if _strictly_below(point, part)]
        if not hit:
            continue
        kept = [part for part in parts if not _strictly_below(point, part)]
        cut = {(*part[:axis], value, *part[axis + 1 :]) for part in hit for axis, value in enumerate(point)}
        fresh = [part for part in sorted(cut) if not _within(part, regions)]
        kept += [
            part
            for part in fresh
            if not _within(part, kept) and not any(part != other and _below(part, other) for other in fresh)
        ]
        parts = kept
    return parts


def inside(point: Bound, region: Bound) -> bool:
    """Whether a point lies in a region."""
    return _strictly_below(point, region)


def covers(one: Bound, other: Bound) -> bool:
    """Whether `one` is as good as `other`, or better, in every objective.

    Weak dominance; equal points cover each other.
    """
    return _below(one, other)


def _within(part: Bound, regions: Sequence[Bound]) -> bool:
    return any(_below(part, region) for region in regions)


def _below(one: Bound, other: Bound) -> bool:
    return all(a <= b for a, b in zip(one, other, strict=True))


def _strictly_below(one: Bound, other: Bound) -> bool:
    return all(a < b for a, b in zip(one, other, strict=True))
