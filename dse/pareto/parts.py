"""The parts of a space: one for each combination of options of the decisions that most sums hang on.

With these given, sums of execution times and loads are plain sums, whose linear relaxation is tight; and what is proved
of a part stays true in later questions: many parts need not be asked again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import cached_property
from itertools import product, repeat
from math import prod

from dse.encode.model import EncodedSpace
from dse.pareto.answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.pareto.grid import EVERY, Grid, grids_of
from dse.pareto.knapsack import Knapsacks, knapsacks_of
from dse.pareto.regions import Bound, RefutedRegions, strictly_inside
from dse.space.types import Design

MOST_PARTS = 64
TABLES_AFTER = 0.1
"""Work from which on what the sums have without the limits is looked up in tables, which have to be made first."""


class Part:
    """One combination of shared options, and what is known of it.

    `literals` are the variables that are true in it, `grids` the values that each objective may have, `refuted` the
    regions without a design of this part, `found` some of its designs. Its hardest question so far was answered in
    `round`: where threads wait for each other the next one is given as much work at once.
    """

    def __init__(self, literals: tuple[int, ...], grids: tuple[Grid, ...] = ()) -> None:
        self.literals, self.grids = literals, grids
        self.refuted = RefutedRegions()
        self.found: list[Found] = []
        self.round = 0

    def open(self, regions: Iterable[Bound]) -> list[Bound]:
        """The regions in which the part may have a design."""
        return [region for region in regions if not self.refuted.cover(region)]

    def floor(self, regions: Sequence[Bound]) -> Bound:
        """For each objective the least value that a design of this part may have in one of the regions."""
        return tuple(map(min, zip(*map(self.refuted.floor, regions), strict=True)))

    def learn(self, answer: Answer, weights: Sequence[int], regions: Iterable[Bound], better_than: int | None) -> None:
        """What the answer to a question tells about later ones.

        The question was for the design in one of the `regions` with the least weighted sum, below `better_than`.
        """
        if isinstance(answer, Found):
            least: int | None = weighted(weights, answer.point)
            self.found.append(answer)
        elif isinstance(answer, Unfinished):
            least = answer.bound
            self.found += [answer.best] if answer.best is not None else []
        else:
            least = better_than
        for region in regions:
            if isinstance(answer, NoSuchDesign) and better_than is None:
                self.refuted.add(region)
            elif least is not None:
                for axis, bound in enumerate(_below(least, weights, region, self.grids)):
                    if bound > 0:
                        self.refuted.add((*region[:axis], bound, *region[axis + 1 :]))

    def forget(self, design: Design) -> None:
        """The design is not wanted any more."""
        self.found = [known for known in self.found if known.design != design]


def _below(least: int, weights: Sequence[int], region: Bound, grids: Sequence[Grid]) -> list[int]:
    """For each axis a bound below which nothing in the region has a weighted sum of `least` or more.

    Whatever the other objectives are within the region, as far as their `grids` go:
    weight[axis] * value + the most of the others < least.
    """
    tops = [bound - 1 for bound in region]
    most = [weight * grid.down(top) for weight, grid, top in zip(weights, grids or repeat(EVERY), tops, strict=False)]
    bounds = []
    for axis, (weight, bound) in enumerate(zip(weights, region, strict=True)):
        others = sum(most) - most[axis]
        bounds.append(min(bound, max(0, -((others - least) // weight))) if weight else 0)
    return bounds


class Parts:
    """All parts of a space, in the order of the file; one alone where nothing is shared."""

    def __init__(self, encoded: EncodedSpace) -> None:
        combinations = _combinations(encoded)
        every = {index for one in combinations for index in one}
        self.all = [Part(one, grids_of(encoded.objectives, one, every.difference(one))) for one in combinations]
        self._encoded: EncodedSpace | None = encoded

    def __len__(self) -> int:
        return len(self.all)

    def forget(self, design: Design) -> None:
        """The design is not wanted any more."""
        for part in self.all:
            part.forget(design)
        self._encoded, self.knapsacks = None, None

    @cached_property
    def knapsacks(self) -> Knapsacks | None:
        """The tables of the parts without what is forbidden; None where there are none, or designs are not wanted."""
        return None if self._encoded is None else knapsacks_of(self._encoded, [part.literals for part in self.all])

    def bounded(
        self, weights: Sequence[int], regions: Sequence[Bound], work: float
    ) -> tuple[Answer | None, int | None]:
        """What the tables tell of the least weighted sum in a region: an answer, or a bound (and the parts learn).

        Nothing before a search has done so much `work` that making them pays.
        """
        if work < TABLES_AFTER or len(regions) > 1 or not any(weights) or self.knapsacks is None:
            return None, None
        [region] = regions
        bounds = [table.least(weights, region) for table in self.knapsacks.tables]
        known = [(least.weighted, number, least.point) for number, least in enumerate(bounds) if least is not None]
        if not known:
            return NoSuchDesign(), None
        least, number, point = min(known)
        design = self.knapsacks.design(number, point)
        if design is not None:
            return Found(point, design), None
        for part, bound in zip(self.all, bounds, strict=True):
            if bound is None:
                part.refuted.add(region)
            else:
                part.learn(Unfinished(bound.weighted), weights, [region], None)
        return None, least

    def first(self, point: Bound) -> Design | None:
        """The first design in the order of the file that has a point, where the tables tell."""
        return None if self.knapsacks is None else self.knapsacks.first(point)

    def best(self, weights: Sequence[int], regions: Collection[Bound]) -> Found | None:
        """The known design in one of the regions that has the least weighted sum."""
        known = [
            found
            for part in self.all
            for found in part.found
            if any(strictly_inside(found.point, region) for region in regions)
        ]
        return min(known, key=lambda found: (weighted(weights, found.point), found.design), default=None)


def _combinations(encoded: EncodedSpace) -> list[tuple[int, ...]]:
    """The literals of each combination, of as many shared decisions as make no more than `MOST_PARTS`."""
    shared = [decision for decision in encoded.shared if len(encoded.options[decision]) > 1]
    if encoded.is_loose and encoded.space is not None:  # most of what is proved there is the same on any bus
        types = {slot.type_decision for slot in encoded.space.processors}
        shared = [decision for decision in shared if decision in types]
    choices = [[literal.index for literal in encoded.options[decision]] for decision in shared]
    while prod(map(len, choices)) > MOST_PARTS:
        choices.pop()
    return list(product(*choices))
