"""The parts of a space: one for each combination of options of the decisions that most sums hang on.

With these given, sums of execution times and loads are plain sums, whose linear relaxation is tight; and what is proved
of a part stays true in later questions: many parts need not be asked again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from itertools import product
from math import prod

from dse.encode.model import EncodedSpace
from dse.pareto.answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.pareto.grid import Grid, grids_of
from dse.pareto.regions import Bound, RefutedRegions, strictly_inside
from dse.space.types import Design

MOST_PARTS = 64


class Part:
    """One combination of shared options, and what is known of it.

    `literals` are the variables that are true in it, `grids` the values that each objective may have, `refuted` the
    regions without a design of this part, `found` some of its designs.
    """

    def __init__(self, literals: tuple[int, ...], grids: tuple[Grid, ...] = ()) -> None:
        self.literals, self.grids = literals, grids
        self.refuted = RefutedRegions()
        self.found: list[Found] = []

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
                for axis, bound in enumerate(_below(least, weights, region)):
                    if bound > 0:
                        self.refuted.add((*region[:axis], bound, *region[axis + 1 :]))

    def forget(self, design: Design) -> None:
        """The design is not wanted any more."""
        self.found = [known for known in self.found if known.design != design]


def _below(least: int, weights: Sequence[int], region: Bound) -> list[int]:
    """For each axis a bound below which nothing in the region has a weighted sum of `least` or more.

    Whatever the other objectives are within the region: weight[axis] * value + the most of the others < least.
    """
    most = weighted(weights, [bound - 1 for bound in region])
    bounds = []
    for weight, bound in zip(weights, region, strict=True):
        others = most - weight * (bound - 1)
        bounds.append(min(bound, max(0, -((others - least) // weight))) if weight else 0)
    return bounds


class Parts:
    """All parts of a space, in the order of the file; one alone where nothing is shared."""

    def __init__(self, encoded: EncodedSpace) -> None:
        combinations = _combinations(encoded)
        every = {index for one in combinations for index in one}
        self.all = [Part(one, grids_of(encoded.objectives, one, every.difference(one))) for one in combinations]

    def __len__(self) -> int:
        return len(self.all)

    def forget(self, design: Design) -> None:
        """The design is not wanted any more."""
        for part in self.all:
            part.forget(design)

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
    choices = [
        [literal.index for literal in encoded.options[decision]]
        for decision in encoded.shared
        if len(encoded.options[decision]) > 1
    ]
    while prod(map(len, choices)) > MOST_PARTS:
        choices.pop()
    return list(product(*choices))
