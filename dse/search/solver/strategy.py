"""The strategy: which settings and heuristics a question is asked with, and what earlier questions have shown.

Every question the search asks goes through `Strategy.minimise`, which answers with a design, a refutation, or neither.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeAlias

from ortools.sat.python import cp_model

from dse.encode.linear import EXACT_LIMIT
from dse.encode.model import EncodedSpace
from dse.search.regions import Bound, held
from dse.search.solver.bounding import Narrowing, lowest, narrowed
from dse.search.solver.call import Call
from dse.search.solver.pooled_cores import PoolMemory
from dse.search.solver.portfolio import Attempt, Portfolio
from dse.search.solver.repair import packed, roomier
from dse.search.solver.settings import WAYS, WAYS_WITH_WAITING, SolverSettings
from dse.search.solver.subspaces import AllSubspaces, Apart, Subspace
from dse.search.solver.value_grid import EVERY, weighted_grid
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.search.tuning import Tuning
from dse.space.model.space import Design

Portfolios: TypeAlias = dict[tuple[tuple[SolverSettings, ...], bool], Portfolio]
"""The portfolios of questions as a whole, by the settings that they know, and whether the space has one part only."""


class Strategy(Call):
    """A call of one model, with the heuristics that decide its settings and what earlier questions have shown.

    `calls` counts the questions asked. Several strategies share what is known of the `parts` of the space, and
    strategies of different models the `portfolios`: which settings answered. Between questions the model may only
    become stricter, by `exclude`.
    """

    def __init__(
        self,
        encoded: EncodedSpace,
        *,
        seed: int = 0,
        deadline: float | None = None,
        parts: AllSubspaces | None = None,
        tuning: Tuning | None = None,
        portfolios: Portfolios | None = None,
    ) -> None:
        super().__init__(encoded, seed=seed, deadline=deadline, tuning=tuning)
        tuning = self.tuning
        self.parts = parts if parts is not None else AllSubspaces(encoded, tuning)
        self.calls = 0
        self._ways = WAYS_WITH_WAITING if encoded.is_loose and tuning.bounding.is_on else WAYS
        expected = [settings.least_work(encoded.model) for settings in self._ways]
        first = tuning.subspaces.first_work
        self._whole = Portfolio(
            expected if len(self.parts) == 1 else [first / tuning.portfolio.patience, first], tuning.portfolio
        )
        if portfolios is not None:
            self._whole = portfolios.setdefault((tuple(self._ways), len(self.parts) == 1), self._whole)
        self._asked = Portfolio([settings.least_work(encoded.model) for settings in WAYS], tuning.portfolio)
        self.relaxed_first: set[int] = set()  # numbers of parts
        self.missed_briefly: Counter[int] = Counter()  # how often in a row, by number of part
        self.pools = PoolMemory()
        self.narrowing = Narrowing(tuning.bounding.first, tuning.bounding.quick)
        self.packings: set[Design] = set()  # what was tried on other cores (`dse.search.solver.repair`)

    @property
    def most_regions(self) -> int:
        """The number of regions to ask about at once: fewer where relaxation matters, because a union weakens it.

        At least 1; measured costs decide between a union of regions and single ones.
        """
        most = max(1, len(self.encoded.regions))
        if len(self.parts) > 1:
            return 1 if self._has_relaxed or self._whole.favourite else most
        return most if self._whole.favourite == 0 else min(self.tuning.model.region_unions.most_relaxed, most)

    def exclude(self, design: Design, *, unless: Sequence[Any] = ()) -> None:
        """Forbid one design: at least one decision differs, or one of the literals `unless` is true.

        The design is removed from what is known of the parts, too.
        """
        self.encoded.model.add_bool_or([*self.encoded.differs_from(design), *unless])
        self.parts.forget(design)
        self.incumbent = None

    def minimise(self, weights: Sequence[int], regions: Sequence[Bound], hint: Design | None = None) -> Answer:
        """The design in one of the `regions` with the least weighted sum of counted objectives.

        A region is what lies strictly below a bound in every objective. `weights` must not be negative; the weighted
        sum must stay below 2**53. Bare settings come first; what is too hard for them is solved part by part.
        """
        regions = [region for region in regions if all(bound > 0 for bound in region)]
        if not regions:
            return NoSuchDesign()
        self.calls += 1
        known, least = self.parts.bounded(weights, regions, self.work)
        if known is not None:
            return known
        self._has_relaxed, self.least = False, least
        self.narrowing.begin()
        self._set_objective(weights)
        most = [max(bounds) - 1 for bounds in zip(*regions, strict=True)]
        assert weighted(weights, most) < EXACT_LIMIT, "weights leave exact arithmetic"
        self.hint(hint)
        attempts: list[Attempt] = [partial(self.solve_in, regions, settings) for settings in self._ways]
        if len(self.parts) > 1:
            attempts[1:] = [Apart(self, weights, regions).attempt]
            attempts[0] = attempts[1] if self._rows() else attempts[0]
        return self._whole.answer(attempts, lambda: self.work, self.out_of_time)

    def ask(self) -> Answer:
        """Solve the model as it stands.

        Settings are tried in the order of their measured costs until one answers, the time is over, or no progress is
        possible.
        """
        self.calls += 1
        ways = [partial(self._solve_whole, settings) for settings in WAYS]
        return self._asked.answer(ways, lambda: self.work, lambda: self.out_of_time() or self._is_stuck())

    def solve_in(self, regions: Sequence[Bound], settings: SolverSettings, work: float) -> Answer:
        """Attempt a question as a whole, once.

        A lower bound of an unfinished attempt is kept for loose models.
        """
        self._restrict(regions)  # anew: an attempt part by part may have come before
        answer = self._solve_whole(settings, work)
        if self.encoded.is_loose and isinstance(answer, Unfinished):
            self.raise_least(answer.bound or 0)
        return answer

    def _solve_whole(self, settings: SolverSettings, work: float) -> Answer:
        answer = self.run(settings, work)
        if isinstance(answer, Unfinished) and answer.best is not None:
            self.hint(answer.best.design)
        return answer

    def solve_part(
        self,
        part: Subspace,
        way: tuple[SolverSettings, float],
        weights: Sequence[int],
        regions: Sequence[Bound],
        best: Found | None,
        least: int = 0,
    ) -> Answer:
        """A better design than `best` in a part of the space where none is below `least`, with a given amount of work.

        `way` has settings and work; what the answer proves is stored with the part.
        """
        regions = part.open(regions)
        if not regions or (best is not None and not any(weights)):
            return NoSuchDesign()
        self.within = part.literals
        self._ceiling = better_than = None if best is None else weighted(weights, best.point)
        self._restrict(regions, part.floor(regions))
        try:
            answer = self.run_within(part, *way, least=least)
        finally:
            self._ceiling, self.within = None, ()
        part.learn(answer, weights, regions, better_than)
        return answer

    def run_within(self, part: Subspace, settings: SolverSettings, work: float, least: int = 0) -> Answer:
        """Run the solver once in a part of the space; `NoSuchDesign` where fixed decisions leave nothing of the part.

        Literals of the part are held true meanwhile; the grid of values is that of the part.
        """
        known = self.least  # which is of the whole
        self._grid = EVERY if self.weights is None else weighted_grid(part.grids, self.weights)
        self.least = self._grid.up(least) if least else None
        try:
            with held(self.encoded.model, part.literals) as may_be:
                return self.run(settings, work) if may_be else NoSuchDesign()
        finally:
            self.least, self._grid = known, EVERY

    def run(self, settings: SolverSettings, work: float, best: Found | None = None, most: int | None = None) -> Answer:
        """Run the solver once, or the heuristic that the settings name: alternating bounds, or lowest values first.

        An `Answer`; settings that stand for a heuristic call it instead of the solver.
        """
        if settings.narrows and self.weights is not None:
            return narrowed(self, self.narrowing, work)
        if settings.lowest and self.weights is not None and self.tuning.lowest_first.is_on:
            return lowest(self, work, self.pools if settings.pools else None)
        return super().run(settings, work, best, most)

    def on_other_cores(self, design: Design, value: Callable[[cp_model.IntVar], int]) -> Found | None:
        """A refused design on other cores, each choice of everything but cores once.

        By the placement heuristics; the design that is returned was accepted by the analysis.
        """
        return packed(self, self.packings, design, value)

    def used_less(self, design: Design, point: Bound) -> Design | None:
        """A design with given objectives that uses its processors less.

        Its threads are then easier to place on cores.
        """
        return roomier(self, design, point)
