"""One solver call: whether there is a design in a part of the objective space, and which is the best one.

Every question the search asks goes through `Solver.minimise`, which answers with a design, a refutation, or neither.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.linear import EXACT_LIMIT
from dse.encode.model import EncodedSpace
from dse.encode.search_order import searched_by
from dse.search import tuning as tuned
from dse.search.regions import Bound, held, restrict, strictly_inside, valued
from dse.search.solver.bounding import Narrowing, lowest, narrowed
from dse.search.solver.large_neighbourhood import begin_from, keep, packed, roomier
from dse.search.solver.pooled_cores import Pools
from dse.search.solver.portfolio import Attempt, Portfolio
from dse.search.solver.settings import WAYS, WAYS_WITH_WAITING, Settings, sound_solver
from dse.search.solver.subspaces import Apart, Part, Parts, as_a_whole
from dse.search.solver.value_grid import EVERY, weighted_grid
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.search.tuning import Tuning
from dse.space.model.space import Design


class Solver:
    """A model with what is known of the settings for it, a deadline and a stop switch.

    `calls` counts the questions asked, `work` what they took (`dse.search.solver.settings`). Same model, same seed,
    same answers: one CP-SAT worker, and limits in deterministic time. Solving releases the GIL: several solvers, each
    with a model of its own, can work in threads (see `dse.search.workers`), and share what is known of the `parts` of
    the space. Between questions the model may only become stricter, by `exclude`.
    """

    def __init__(
        self,
        encoded: EncodedSpace,
        *,
        seed: int = 0,
        deadline: float | None = None,
        parts: Parts | None = None,
        tuning: Tuning | None = None,
    ) -> None:
        self.tuning = tuning = tuning or tuned.DEFAULT
        self.encoded, self.seed, self.deadline = encoded, seed, deadline
        self.parts = parts if parts is not None else Parts(encoded, tuning)
        self.calls, self.work = 0, 0.0
        self.stopped = False
        self._ways = WAYS_WITH_WAITING if encoded.is_loose and tuning.bounding.is_on else WAYS
        expected = [settings.least_work(encoded.model) for settings in self._ways]
        first = tuning.subspaces.first_work
        self._whole = Portfolio(
            expected if len(self.parts) == 1 else [first / tuning.portfolio.patience, first], tuning.portfolio
        )
        self._asked = Portfolio([settings.least_work(encoded.model) for settings in WAYS], tuning.portfolio)
        self._has_looked_for_any = False
        self._has_relaxed = False
        self.relaxed_first: set[int] = set()  # numbers of parts
        self.missed_briefly: Counter[int] = Counter()  # how often in a row, by number of part, or `WHOLE`
        self.weights: Sequence[int] | None = None  # of the objectives, in what is minimised
        self._regions: Sequence[Bound] | None = None
        self._ceiling: int | None = None
        self.within: tuple[int, ...] = ()  # the literals of the part that is asked about, ...
        self.start: Found | None = None  # ... and the design that is to be bettered there, maybe one of another part
        self.pools: Pools | None = None  # where cores are full
        self.least: int | None = None  # of the values on the grid
        self._grid = EVERY
        self.narrowing = Narrowing(tuning.bounding.first, tuning.bounding.quick)
        self.incumbent: Found | None = None  # what a search that is stopped at any moment has come across
        self.packings: set[Design] = set()  # what was tried on other cores (`dse.search.solver.large_neighbourhood`)
        self._running: cp_model.CpSolver | None = None

    def stop(self) -> None:
        """End the running call and refuse further ones."""
        self.stopped = True
        if self._running is not None:
            self._running.stop_search()

    @property
    def most_regions(self) -> int:
        """How many regions a question should be about: fewer where relaxation matters, which a union makes weak."""
        most = max(1, len(self.encoded.regions))
        if len(self.parts) > 1:
            return 1 if self._has_relaxed or self._whole.favourite else most
        return most if self._whole.favourite == 0 else min(self.tuning.model.region_unions.most_relaxed, most)

    def exclude(self, design: Design, *, unless: Sequence[Any] = ()) -> None:
        """Forbid one design: at least one decision differs, or one of the literals `unless` is true."""
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
        if self._rows() and (answer := as_a_whole(self, weights, regions)) is not None:
            return answer
        attempts: list[Attempt] = [partial(self.solve_in, regions, settings) for settings in self._ways]
        if len(self.parts) > 1:
            attempts[1:] = [Apart(self, weights, regions).attempt]
            attempts[0] = attempts[1] if self._rows() else attempts[0]
        return self._whole.answer(attempts, lambda: self.work, self.out_of_time)

    def ask(self) -> Answer:
        """Solve the model as it stands."""
        self.calls += 1
        ways = [partial(self._solve_whole, settings) for settings in WAYS]
        return self._asked.answer(ways, lambda: self.work, lambda: self.out_of_time() or self._is_stuck())

    def set_point(self, point: Bound) -> None:
        """Fix the objectives."""
        self.set_box(point, point)

    def set_box(self, least: Bound, most: Bound) -> None:
        """Only designs with objectives from `least` to `most`, whatever solutions say of them."""
        self.weights = None
        self._restrict([tuple(value + 1 for value in most)], least)

    def _restrict(self, regions: Sequence[Bound], floor: Bound | None = None) -> None:
        """Only designs in one of the regions, with objectives of at least `floor`."""
        self._regions = regions
        restrict(self.encoded, regions, floor)

    def solve_in(self, regions: Sequence[Bound], settings: Settings, work: float) -> Answer:
        """One attempt at a question as a whole; where the first one finds nothing, any design is looked for."""
        self._restrict(regions)  # anew: an attempt part by part may have come before
        answer = self._solve_whole(settings, work)
        if self.encoded.is_loose and isinstance(answer, Unfinished):
            self.raise_least(answer.bound or 0)
        is_first = self.tuning.any_design.is_on and not self._has_looked_for_any
        if isinstance(answer, Unfinished) and answer.best is None and is_first:
            self._has_looked_for_any = True
            found = self.any_design(self.tuning.any_design.ways)
            if not isinstance(found, Found):
                return found if isinstance(found, NoSuchDesign) else answer
            self.hint(found.design)
            return Unfinished(answer.bound, found)
        return answer

    def _set_objective(self, weights: Sequence[int]) -> None:
        """Minimise the weighted sum of the objectives, if there is one."""
        model = self.encoded.model
        model.clear_objective()
        self.weights = weights if any(weights) else None
        if any(weights):
            variables = [objective.variable for objective in self.encoded.objectives]
            model.minimize(cp_model.LinearExpr.weighted_sum(variables, list(weights)))

    def any_design(self, ways: Sequence[tuple[Settings, float]]) -> Answer:
        """Some design in the regions, whatever is minimised: with settings, and so much work, one after the other."""
        weights = self.weights or ()
        self.encoded.model.clear_objective()
        self.weights = None
        answer: Answer = Unfinished()
        try:
            for settings, work in ways:
                answer = self.run(settings, work)
                if not isinstance(answer, Unfinished):
                    break
        finally:
            self._set_objective(weights)
        return answer

    def _solve_whole(self, settings: Settings, work: float) -> Answer:
        answer = self.run(settings, work)
        if isinstance(answer, Unfinished) and answer.best is not None:
            self.hint(answer.best.design)
        return answer

    def solve_part(
        self,
        part: Part,
        way: tuple[Settings, float],
        weights: Sequence[int],
        regions: Sequence[Bound],
        best: Found | None,
        least: int = 0,
    ) -> Answer:
        """A better design than `best` in a part of the space where none is below `least`, with so much work."""
        regions = part.open(regions)
        if not regions or (best is not None and not any(weights)):
            return NoSuchDesign()
        self.within, self.start = part.literals, best
        self._ceiling = better_than = None if best is None else weighted(weights, best.point)
        self._restrict(regions, part.floor(regions))
        try:
            answer = self.run_within(part, *way, least=least)
        finally:
            self._ceiling, self.within, self.start = None, (), None
        part.learn(answer, weights, regions, better_than)
        return answer

    def run_within(self, part: Part, settings: Settings, work: float, least: int = 0) -> Answer:
        """One run of the solver in a part of the space; none of it may be left where decisions are fixed."""
        known = self.least  # which is of the whole
        self._grid = EVERY if self.weights is None else weighted_grid(part.grids, self.weights)
        self.least = self._grid.up(least) if least else None
        try:
            with held(self.encoded.model, part.literals) as may_be:
                return self.run(settings, work) if may_be else NoSuchDesign()
        finally:
            self.least, self._grid = known, EVERY

    def hint(self, hint: Design | None) -> None:
        """Suggest a design to start from."""
        self.encoded.suggest(hint)

    def out_of_time(self) -> bool:
        """Whether there is no time left, or the search was stopped."""
        return self.stopped or (self.deadline is not None and time.monotonic() >= self.deadline)

    def run(self, settings: Settings, work: float, best: Found | None = None, most: int | None = None) -> Answer:
        """One run of the solver, or several until the solution's open terms are exact, or as good as they can be.

        The designs of solutions on the way are weighed by the analysis: once no solution is better than the `best` of
        these, it is the answer. With `most` only what is no more than that is looked for, and `best` is no answer.
        """
        if settings.narrows and self.weights is not None:
            return narrowed(self, work)
        if settings.lowest and self.weights is not None and self.tuning.lowest_first.is_on:
            return lowest(self, work, pools=settings.pools)
        known, start = self._rows(), best
        while True:
            answer, best = self.once(settings, work, best, most)
            if answer is not None:
                return answer
            if settings.any_value and best is not start:
                return Unfinished(self.least, best)
            if self._is_stuck() or (self.within and self._rows() > known):
                return Unfinished(self.least, best)

    def _rows(self) -> int:
        """Of how many processors the model has rows: with the first of them other settings are better for a part."""
        return 0 if self.encoded.contention is None else len(self.encoded.contention.known)

    def _is_stuck(self) -> bool:
        return self.encoded.contention is not None and self.encoded.contention.is_stuck

    def raise_least(self, bound: int) -> int:
        """What is minimised is proved to be no less than a bound; returns the least value that is left."""
        self.least = self._grid.up(max(bound, self.least or 0))
        return self.least

    def below(self, value: int) -> int:
        """The greatest value of what is minimised that is less."""
        return self._grid.down(value - 1)

    def above(self, value: int) -> int:
        """The least value of what is minimised that is greater."""
        return self._grid.up(value + 1)

    def most(self, best: Found | None) -> int | None:
        """No more than this has what is better than a design, or than what is known; None where nothing is known."""
        if best is None or self.weights is None:
            return None if self._ceiling is None else self.below(self._ceiling)
        return self.below(weighted(self.weights, best.point))

    def once(
        self, settings: Settings, work: float, best: Found | None, most: int | None
    ) -> tuple[Answer | None, Found | None]:
        """One run of the solver for something better than `best`; no answer where the model is sharper now.

        With the best design that is known so far.
        """
        if self.out_of_time():
            return Unfinished(best=best), best
        refuted, top = (best or NoSuchDesign(), self.most(best)) if most is None else (NoSuchDesign(), most)
        if top is not None and top < (self.least or 0):
            return refuted, best
        self._has_relaxed |= settings.linearization_level > 0
        solver = self.limited(settings, work)
        with valued(self.encoded.model, *((None, None) if self.weights is None else (self.least, top))):
            status = self.solved(solver, self.encoded.model, settings)
        if status == cp_model.INFEASIBLE and not settings.only_finds:
            return refuted, best
        if status in (cp_model.OPTIMAL, cp_model.FEASIBLE):
            return self._judged(solver, settings, best, is_optimal=status == cp_model.OPTIMAL)
        return Unfinished(self._bound(solver), best), best

    def limited(self, settings: Settings, work: float) -> cp_model.CpSolver:
        """A solver that is to do so much work, and no longer than there is time."""
        solver = sound_solver(self.seed)
        parameters: Any = solver.parameters
        settings.apply(parameters, work)
        if self.deadline is not None:
            parameters.max_time_in_seconds = max(0.01, self.deadline - time.monotonic())
        return solver

    def solved(self, solver: cp_model.CpSolver, model: cp_model.CpModel, settings: Settings) -> Any:
        """The status with which a solver of `limited` ends on a model; what it takes counts."""
        self._running = solver
        is_ordered = settings.in_order or settings.options_first
        with searched_by(model, self.encoded.in_order() if is_ordered else ()):
            status = solver.solve(model)
        self._running = None
        self.work += solver.response_proto.deterministic_time * settings.weight
        assert status != cp_model.MODEL_INVALID, "the model is invalid"
        return status

    def _bound(self, solver: cp_model.CpSolver) -> int | None:
        return solver.response_proto.inner_objective_lower_bound if self.encoded.model.has_objective() else None

    def _judged(
        self, solver: cp_model.CpSolver, settings: Settings, best: Found | None, *, is_optimal: bool
    ) -> tuple[Answer | None, Found | None]:
        """What a solution says; no answer where the model has learnt from it."""
        point = tuple(solver.value(objective.variable) for objective in self.encoded.objectives)
        solution = list(solver.response_proto.solution)
        design, found = self.encoded.design(solution), None
        is_loose, is_last = self.encoded.is_loose, is_optimal or settings.any_value
        if is_loose:
            exact = self.encoded.weigh(design)
            found = Found(exact, design) if exact is not None and self.is_wanted(exact, best) else None
            if self.weights is None and found is not None:
                return (found if is_optimal else Unfinished(self._bound(solver), found)), best
            best = found or best or packed(self, design, solver.value)
            keep(self, best)
            if is_optimal and self._is_reached(best, point):
                return best, best
        known = len(self.encoded.model.proto.constraints)
        settled = self.encoded.settled(design, solver.value, is_best=False)
        has_learnt = len(self.encoded.model.proto.constraints) > known
        if settled is None and is_last and not has_learnt:
            settled = self._other(design, point) or self.encoded.settled(design, solver.value)
        if is_loose and has_learnt and settings.linearization_level and not settings.in_order:
            begin_from(self.encoded.model, solution)
        if settled is None and (is_last or (has_learnt and not is_loose)):
            if is_optimal and self.weights is not None:  # of a question that now is stricter
                self.raise_least(self._bound(solver) or 0)
            is_found = found is not None and not is_optimal
            return (Unfinished(self._bound(solver), best) if is_found else None), best
        if is_optimal and settled is not None:
            return Found(point, settled), best
        if settled is not None and (not is_loose or (is_last and best is None)):  # else it may be larger than need be
            best = Found(point, settled)
            keep(self, best)
        return Unfinished(self._bound(solver), best), best

    def _other(self, design: Design, point: Bound) -> Design | None:
        """One as good as a design for whose threads there are no cores."""
        is_as_good = self.weights is not None or not self.encoded.model.has_objective()
        return roomier(self, design, point) if is_as_good else None

    def _is_reached(self, best: Found | None, point: Bound) -> bool:
        """Whether the best design is as good as a point that none is better than."""
        if best is None or self.weights is None:
            return False
        return weighted(self.weights, best.point) <= weighted(self.weights, point)

    def is_wanted(self, point: Bound, best: Found | None) -> bool:
        """Whether a point is one that the solver was asked for, and better than the best one."""
        if self._regions is not None and not any(strictly_inside(point, region) for region in self._regions):
            return False
        most = self.most(best)
        return most is None or self.weights is None or weighted(self.weights, point) <= most
