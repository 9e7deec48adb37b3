"""Ranking of a front: distance to the ideal point, each objective scaled to its range on the front.

Squared Euclidean distances are compared as exact fractions, so that ties are real ones and a change of units changes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

METHOD = "distance to the ideal point, objectives scaled to their range on the front"


def ideal_distances(points: Sequence[Sequence[int]], senses: Sequence[str]) -> list[Fraction]:
    """The squared distance of each point to the ideal point (the best value of every objective on the front).

    >>> ideal_distances([(0, 10), (4, 0)], ["minimise", "minimise"])
    [Fraction(1, 1), Fraction(1, 1)]
    """
    if not points:
        return []
    columns = list(zip(*points, strict=True))
    distances = [Fraction(0)] * len(points)
    for column, sense in zip(columns, senses, strict=True):
        low, high = min(column), max(column)
        if low == high:
            continue
        best = low if sense == "minimise" else high
        for row, value in enumerate(column):
            distances[row] += Fraction(value - best, high - low) ** 2
    return distances


def ranks(distances: Sequence[Fraction]) -> list[int]:
    """Competition ranks, from 1; equal distances share a rank."""
    ordered = sorted(distances)
    return [ordered.index(distance) + 1 for distance in distances]
