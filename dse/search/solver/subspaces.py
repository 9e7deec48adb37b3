"""The parts of a space: one for each combination of options of the decisions that most sums depend on.

With these given, sums of execution times and loads are plain sums, whose linear relaxation is tight; and what is proved
of a part stays true in later questions: many parts need not be asked again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from functools import cached_property
from itertools import product, repeat
from math import prod
from typing import Protocol

from dse.encode.model import EncodedSpace
from dse.search.regions import Bound, RefutedRegions, strictly_inside
from dse.search.solver.knapsack import Knapsacks, knapsacks_of
from dse.search.solver.settings import NARROWING, READING, SolverSettings
from dse.search.solver.value_grid import EVERY, Grid, grids_of
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.search.tuning import Tuning
from dse.space.model.space import Design


class Subspace:
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
        """The regions in which the part may have a design.

        Upper corners that no refuted region of the part contains.
        """
        return [region for region in regions if not self.refuted.cover(region)]

    def floor(self, regions: Sequence[Bound]) -> Bound:
        """For each objective the least value that a design of this part may have in one of the regions.

        In solver steps; from refuted regions.
        """
        return tuple(map(min, zip(*map(self.refuted.floor, regions), strict=True)))

    def learn(self, answer: Answer, weights: Sequence[int], regions: Iterable[Bound], better_than: int | None) -> None:
        """Record the answer to a question for later questions.

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
        """The design is not wanted any more.

        Called when the design is excluded from the model.
        """
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


class AllSubspaces:
    """All parts of a space, in the order of the file; one alone where nothing is shared.

    Built from the decisions that most sums depend on; at most `Subspaces.most` combinations.
    """

    def __init__(self, encoded: EncodedSpace, tuning: Tuning) -> None:
        combinations = _combinations(encoded, tuning.subspaces.most if tuning.subspaces.is_on else 1)
        every = {index for one in combinations for index in one}
        self._tuning = tuning.knapsack_tables
        self.all = [
            Subspace(
                one,
                grids_of(encoded.objectives, one, every.difference(one))
                if tuning.value_grid.is_on
                else tuple(EVERY for _ in encoded.objectives),
            )
            for one in combinations
        ]
        self._encoded: EncodedSpace | None = encoded

    def __len__(self) -> int:
        return len(self.all)

    def forget(self, design: Design) -> None:
        """The design is not wanted any more.

        Tables of dynamic programming are dropped, because they would find the design again.
        """
        for part in self.all:
            part.forget(design)
        self._encoded, self.knapsacks = None, None

    @cached_property
    def knapsacks(self) -> Knapsacks | None:
        """The tables of the parts without what is forbidden; None where there are none, or designs are not wanted.

        Built on first use.
        """
        return (
            None
            if self._encoded is None
            else knapsacks_of(self._encoded, [part.literals for part in self.all], self._tuning)
        )

    def bounded(
        self, weights: Sequence[int], regions: Sequence[Bound], work: float
    ) -> tuple[Answer | None, int | None]:
        """The answer of the tables on the least weighted sum in a region, or a bound of it (which the parts record).

        Nothing before a search has done a given amount of `work` that making them pays.
        """
        if work < self._tuning.after or len(regions) > 1 or not any(weights) or self.knapsacks is None:
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
        """The first design in the order of the file that has a point, where the tables tell.

        None, too, where there are no tables.
        """
        return None if self.knapsacks is None else self.knapsacks.first(point)

    def best(self, weights: Sequence[int], regions: Collection[Bound]) -> Found | None:
        """The known design in one of the regions that has the least weighted sum.

        None where no known design is in a region; ties by the design, so that results are reproducible.
        """
        known = [
            better
            for part in self.all
            for better in part.found
            if any(strictly_inside(better.point, region) for region in regions)
        ]
        return min(known, key=lambda better: (weighted(weights, better.point), better.design), default=None)


def _combinations(encoded: EncodedSpace, most: int) -> list[tuple[int, ...]]:
    """The literals of each combination, of as many shared decisions as make no more than `most`."""
    shared = [decision for decision in encoded.shared if len(encoded.options[decision]) > 1]
    if encoded.is_loose and encoded.space is not None:  # most of what is proved there is the same on any bus
        types = {slot.type_decision for slot in encoded.space.processors}
        shared = [decision for decision in shared if decision in types]
    choices = [[literal.index for literal in encoded.options[decision]] for decision in shared]
    while prod(map(len, choices)) > most:
        choices.pop()
    return list(product(*choices))


# A question asked part by part, where it is too hard as a whole.


class Asks(Protocol):
    """The interface through which a question that is solved part by part calls the solver.

    Implemented by `Strategy`; declared here so that files do not import each other in a circle.
    """

    parts: AllSubspaces
    tuning: Tuning
    encoded: EncodedSpace
    work: float
    relaxed_first: set[int]
    missed_briefly: Counter[int]

    def out_of_time(self) -> bool:
        """Whether there is no time left."""
        ...

    def solve_part(
        self,
        part: Subspace,
        way: tuple[SolverSettings, float],
        weights: Sequence[int],
        regions: Sequence[Bound],
        best: Found | None,
        least: int = 0,
    ) -> Answer:
        """One attempt at a part of the space."""
        ...


class Apart:
    """A question asked part by part: in rounds, those first whose bound leaves most room for something better.

    What is found in one part limits the others, and what earlier questions proved of a part may answer for it.
    """

    def __init__(self, strategy: Asks, weights: Sequence[int], regions: Sequence[Bound]) -> None:
        self.strategy = strategy
        self.tuning = strategy.tuning.subspaces
        self.weights = weights
        self.regions = regions
        self.best = strategy.parts.best(weights, regions)

    @cached_property
    def waiting(self) -> list[tuple[int, int, int]]:
        """Turn, bound and number of each part that may hold something; most questions are answered as a whole.

        Ordered by turn, then by the least value that the part may have.
        """
        return [
            (int(number in self.strategy.relaxed_first), weighted(self.weights, part.floor(open_regions)), number)
            for number, part in enumerate(self.strategy.parts.all)
            if (open_regions := part.open(self.regions))
        ]

    def attempt(self, work: float) -> Answer:
        """Go on for a given amount of work, and more: what was done is not lost; with rows of cores to the end.

        Parts that cannot improve on the best design are dropped; the answer is proved when none waits.
        """
        strategy = self.strategy
        end = strategy.work + self.tuning.factor * work
        while self.waiting:
            turn, bound, number = self.waiting.pop(self.waiting.index(min(self.waiting)))
            if self.best is not None and bound >= weighted(self.weights, self.best.point):
                continue
            was_full = self._is_full
            answer = self._ask(number, turn, bound)
            strategy.work += READING * len(strategy.encoded.model.proto.variables)
            if isinstance(answer, Found):
                self.best = answer
            elif isinstance(answer, Unfinished):
                self.best = answer.best or self.best
                self.waiting.append((turn + 1, bound if answer.bound is None else max(bound, answer.bound), number))
                if self._is_full and not was_full:  # other settings are better from now on: their turns begin
                    self.waiting = [(min(turn, 1), bound, number) for turn, bound, number in self.waiting]
            if self.waiting and (strategy.out_of_time() or (strategy.work >= end and not self._is_full)):
                return Unfinished(best=self.best)
        return self.best or NoSuchDesign()

    @property
    def _is_full(self) -> bool:
        """Whether the model has rows of cores."""
        return self.strategy.encoded.contention is not None and bool(self.strategy.encoded.contention.known)

    def _ways(self) -> Sequence[SolverSettings]:
        if self.strategy.encoded.contention is None:
            return self.tuning.ways
        return self.tuning.full_ways if self._is_full else self.tuning.sharing_ways

    def _ask(self, number: int, turn: int, least: int) -> Answer:
        """One attempt at a part: bare settings for a moment, then linear relaxation with limits that double.

        No design of it has a weighted sum below `least`.
        """
        strategy, part, tuning = self.strategy, self.strategy.parts.all[number], self.tuning
        if turn == 0:
            attempt = tuning.brief
        else:
            ways = self._ways()
            rounds, way = divmod(turn - 1, len(ways))
            attempt = ways[way], tuning.work * 2**rounds
            if strategy.encoded.is_loose and strategy.tuning.bounding.is_on:
                first = tuning.work if self.waiting else tuning.last_work
                attempt = NARROWING, first * 2 ** (max(turn, part.round) - 1)
        before = strategy.work
        answer = strategy.solve_part(part, attempt, self.weights, self.regions, self.best, least)
        if turn and not isinstance(answer, Unfinished):
            part.round = max(turn, part.round)
        if turn == 0 and isinstance(answer, Unfinished):
            strategy.missed_briefly[number] += 1
        elif turn == 0:
            strategy.missed_briefly[number] = 0
        is_hard = strategy.encoded.contention is None and strategy.missed_briefly[number] >= tuning.most_missed
        if is_hard or (turn == 1 and strategy.work - before <= tuning.cheap):
            strategy.relaxed_first.add(number)
        else:
            strategy.relaxed_first.discard(number)
        return answer
