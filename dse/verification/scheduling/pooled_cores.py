"""Interchangeable cores counted together in the second proof: rows without the symmetry of cores.

Cores whose work must fit until the same times are of one kind. The rows of such cores (`schedulability.py`) are added
up, and of a thread only the kind of its core is asked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.verification.scheduling.schedulability import WHOLE, Demand, by_level

MOST_KINDS = 6
"""A period with several times is left out where cores would be of more kinds than this."""

MOST_COMPARED = 60
"""Where times of a period make more kinds than this none is looked for any more that implies them."""


def add_pools(model: Any, uses: Sequence[Mapping[Demand, Any]]) -> None:
    """Add the sum of the rows of `add_levels` over all cores of one kind, whose work must fit until the same times.

    Such cores are of one kind. Of a thread only the kind of its core is asked: nothing tells cores of a kind apart.
    """
    processors: dict[int, list[tuple[int, int, Any]]] = {}
    most: dict[int, int] = {}
    for use in uses:
        for (processor, count, period, work), is_so in use.items():
            processors.setdefault(processor, []).append((period, work, is_so))
            most[processor] = max(most.get(processor, 0), count)
    for processor, held in processors.items():
        kinds = _kinds(held)
        counts = [model.new_int_var(0, most[processor], "") for _ in kinds]
        model.add(sum(counts) <= most[processor])
        sums: list[list[Any]] = [[0] * len(kind) for kind in kinds]
        for period, work, is_so in held:
            here = [model.new_bool_var("") for _ in kinds] if len(kinds) > 1 else [is_so]
            if len(kinds) > 1:
                model.add(sum(here) == is_so)
            for number, (kind, literal) in enumerate(zip(kinds, here, strict=True)):
                for place, row in enumerate(kind):
                    sums[number][place] += row.needed(period, work) * literal
        for kind, count, totals in zip(kinds, counts, sums, strict=True):
            for row, total in zip(kind, totals, strict=True):
                model.add(total <= row.room * count)


@dataclass(frozen=True)
class Fit:
    """The capacity of a core: work of periods up to `longest` until time `point`; without one, shares of a whole."""

    point: int | None = None
    longest: int = 0

    @property
    def room(self) -> int:
        """The capacity of a core in the unit of the fit."""
        return WHOLE if self.point is None else self.point

    def needed(self, period: int, work: int) -> int:
        """The part of the capacity that a thread takes."""
        if self.point is None:
            return WHOLE * work // period
        return -(-self.point // period) * work if period <= self.longest else 0

    def part(self, period: int) -> Fraction:
        """The largest share of the capacity that a unit of work of a period takes."""
        if self.point is None:
            return Fraction(1, period)
        return Fraction(-(-self.point // period), self.point) if period <= self.longest else Fraction(0)


class _Order:
    """Which ways to fit follow from others, found once for each two."""

    def __init__(self, periods: Sequence[int]) -> None:
        self._periods = periods
        self._parts: dict[Fit, list[Fraction]] = {}
        self._known: dict[tuple[Fit, Fit], bool] = {}

    def follows(self, one: Fit, other: Fit) -> bool:
        """Whether what fits the other way fits this way, too: no thread takes a larger part of the room."""
        if (one, other) not in self._known:
            parts = zip(self._parts_of(one), self._parts_of(other), strict=True)
            self._known[one, other] = all(own <= its for own, its in parts)
        return self._known[one, other]

    def _parts_of(self, fit: Fit) -> list[Fraction]:
        if fit not in self._parts:
            self._parts[fit] = [fit.part(period) for period in self._periods]
        return self._parts[fit]

    def independent(self, fits: Sequence[Fit]) -> list[Fit]:
        """The fits that do not follow from another one."""
        kept = list(fits)
        for fit in fits:
            if any(other is not fit and self.follows(fit, other) for other in kept):
                kept.remove(fit)
        return kept

    def is_implied(self, one: Sequence[Fit], other: Sequence[Fit]) -> bool:
        """Whether a core of the other kind is of this one, too."""
        return all(any(self.follows(fit, known) for known in other) for fit in one)


def _kinds(held: Sequence[tuple[int, int, Any]]) -> list[list[Fit]]:
    """One time for each period, as far as these are few; without what follows from the rest."""
    order = _Order(sorted({period for period, _, _ in held}))
    kinds = [[Fit()]]
    for shorter, points in by_level(held):
        longest = max(period for period, _, _ in shorter)
        finer: list[list[Fit]] = []
        for kind in kinds:
            for point in points:
                kept = order.independent([*kind, Fit(point, longest)])
                if not any(order.is_implied(known, kept) for known in finer):
                    finer = [known for known in finer if not order.is_implied(kept, known)]
                    finer.append(kept)
            if len(finer) > MOST_COMPARED:
                break
        if len(finer) <= max(MOST_KINDS, len(kinds)):
            kinds = finer
    return kinds
