"""One call of the solver: a model, what is asked of it, limits on time and work, and what its solutions say.

A `Call` knows settings, not heuristics. Where the analysis refuses a solution it asks two hooks, which a strategy
overrides (`dse.search.solver.strategy`): for the design on other cores, and for one with the objectives of the
solution.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from math import inf
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.model import EncodedSpace
from dse.encode.search_order import searched_by
from dse.search import tuning as tuned
from dse.search.regions import Bound, restrict, strictly_inside, valued
from dse.search.solver.settings import SolverSettings, sound_solver
from dse.search.solver.value_grid import EVERY
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.search.tuning import Tuning
from dse.space.model.space import Design


class Call:
    """A model, and what is asked of it: weights, regions, part of the space, values that are left.

    `work` is what all runs took (`dse.search.solver.settings`); after `most_work` there is no time left. Same model,
    same seed, same answers: one CP-SAT worker, and limits in deterministic time. Solving releases the GIL: several
    calls, each with a model of its own, can work in threads (see `dse.search.workers`).
    """

    def __init__(
        self,
        encoded: EncodedSpace,
        *,
        seed: int = 0,
        deadline: float | None = None,
        tuning: Tuning | None = None,
    ) -> None:
        self.tuning = tuning or tuned.DEFAULT
        self.encoded, self.seed, self.deadline = encoded, seed, deadline
        self.work = 0.0
        self.most_work = inf
        self.rounds, self.most_rounds = 0, inf  # in which the model learnt from a solution that the analysis refused
        self.stopped = False
        self.weights: Sequence[int] | None = None  # of the objectives, in what is minimised
        self.within: tuple[int, ...] = ()  # the literals of the part that is asked about
        self.least: int | None = None  # of the values on the grid
        self.incumbent: Found | None = None  # what a search that is stopped at any moment has come across
        self._regions: Sequence[Bound] | None = None
        self._ceiling: int | None = None
        self._grid = EVERY
        self._has_relaxed = False
        self._running: cp_model.CpSolver | None = None

    def on_other_cores(self, design: Design, value: Callable[[cp_model.IntVar], int]) -> Found | None:
        """Hook: a refused design on other cores, where no design is known; `value` is that of the solution.

        The base class has no heuristic and returns None.
        """
        return None

    def used_less(self, design: Design, point: Bound) -> Design | None:
        """Hook: a design with the objectives of an optimum for whose threads there are no cores.

        The base class has no heuristic and returns None.
        """
        return None

    def _keep(self, best: Found | None) -> None:
        """Keep the best design that was met, by what is minimised now: a search may be stopped at any moment."""
        if best is not None and (weights := self.weights) is not None:
            solutions = [best] if self.incumbent is None else [self.incumbent, best]
            self.incumbent = min(solutions, key=lambda one: weighted(weights, one.point))

    def stop(self) -> None:
        """End the running call and refuse further ones.

        May be called from another thread; the running call answers that it is unfinished.
        """
        self.stopped = True
        if self._running is not None:
            self._running.stop_search()

    def _restrict(self, regions: Sequence[Bound], floor: Bound | None = None) -> None:
        """Only designs in one of the regions, with objectives of at least `floor`."""
        self._regions = regions
        restrict(self.encoded, regions, floor)

    def set_point(self, point: Bound) -> None:
        """Fix the objectives.

        Only designs with exactly these objectives, in solver steps, are left.
        """
        self.set_box(point, point)

    def set_box(self, least: Bound, most: Bound) -> None:
        """Restrict the model to designs with objectives from `least` to `most`, without minimising.

        Bounds in solver steps, both included; nothing is minimised.
        """
        self.weights = None
        self._restrict([tuple(value + 1 for value in most)], least)

    def _set_objective(self, weights: Sequence[int]) -> None:
        """Minimise the weighted sum of the objectives, if there is one."""
        model = self.encoded.model
        model.clear_objective()
        self.weights = weights if any(weights) else None
        if any(weights):
            variables = [objective.variable for objective in self.encoded.objectives]
            model.minimize(cp_model.LinearExpr.weighted_sum(variables, list(weights)))

    def any_design(self, ways: Sequence[tuple[SolverSettings, float]]) -> Answer:
        """Find any design in the regions, without minimising, by the settings and work limits of `ways` in turn.

        An `Answer`: a design, a proof of none, or unfinished. The objective is set again at the end.
        """
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

    def hint(self, hint: Design | None) -> None:
        """Suggest a design to start from.

        None clears the suggestion.
        """
        self.encoded.suggest(hint)

    def out_of_time(self) -> bool:
        """Whether there is no time left, or the search was stopped.

        By the monotonic clock, or because `most_work` or `most_rounds` was done.
        """
        return (
            self.stopped
            or self.work >= self.most_work
            or self.rounds >= self.most_rounds
            or (self.deadline is not None and time.monotonic() >= self.deadline)
        )

    def run(self, settings: SolverSettings, work: float, best: Found | None = None, most: int | None = None) -> Answer:
        """One run of the solver, or several until the solution's open terms are exact, or as good as they can be.

        The designs of solutions on the way are weighed by the analysis: once no solution is better than the `best` of
        these, it is the answer. With `most` only what is no more than that is looked for, and `best` is no answer.
        """
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
        """Record a proved lower bound of the minimised objective; returns the least value that is left.

        In solver steps, rounded up to a value that the objective can have.
        """
        self.least = self._grid.up(max(bound, self.least or 0))
        return self.least

    def below(self, value: int) -> int:
        """The greatest value of what is minimised that is less.

        In solver steps, on the grid of values that the objective can have.
        """
        return self._grid.down(value - 1)

    def above(self, value: int) -> int:
        """The least value of what is minimised that is greater.

        In solver steps, on the grid of values that the objective can have.
        """
        return self._grid.up(value + 1)

    def most(self, best: Found | None) -> int | None:
        """The greatest weighted sum of a design better than `best`, or than the known ceiling; None without either.

        In solver steps of the weighted sum.
        """
        if best is None or self.weights is None:
            return None if self._ceiling is None else self.below(self._ceiling)
        return self.below(weighted(self.weights, best.point))

    def once(
        self, settings: SolverSettings, work: float, best: Found | None, most: int | None
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

    def limited(self, settings: SolverSettings, work: float) -> cp_model.CpSolver:
        """A solver that is to do a given amount of work, and no longer than there is time.

        `work` is in deterministic time, which does not depend on the machine; the deadline is in seconds.
        """
        solver = sound_solver(self.seed)
        parameters: Any = solver.parameters
        settings.apply(parameters, work)
        if self.deadline is not None:
            parameters.max_time_in_seconds = max(0.01, self.deadline - time.monotonic())
        return solver

    def solved(self, solver: cp_model.CpSolver, model: cp_model.CpModel, settings: SolverSettings) -> Any:
        """The status with which a solver of `limited` ends on a model; what it takes counts.

        The running solver is known to `stop`. The work done is added to `work`, weighted by the setting.
        """
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
        self, solver: cp_model.CpSolver, settings: SolverSettings, best: Found | None, *, is_optimal: bool
    ) -> tuple[Answer | None, Found | None]:
        """The answer that a solution gives; None where the model has learnt from it."""
        point = tuple(solver.value(objective.variable) for objective in self.encoded.objectives)
        solution = list(solver.response_proto.solution)
        design, found_design = self.encoded.design(solution), None
        is_loose, is_last = self.encoded.is_loose, is_optimal or settings.any_value
        if is_loose:
            exact = self.encoded.weigh(design)
            found_design = Found(exact, design) if exact is not None and self.is_wanted(exact, best) else None
            if self.weights is None and found_design is not None:
                return (found_design if is_optimal else Unfinished(self._bound(solver), found_design)), best
            best = found_design or best or self.on_other_cores(design, solver.value)
            self._keep(best)
            if is_optimal and self._is_reached(best, point):
                return best, best
        known = len(self.encoded.model.proto.constraints)
        settled = self.encoded.settled(design, solver.value, is_best=False)
        has_learnt = len(self.encoded.model.proto.constraints) > known
        self.rounds += has_learnt
        if settled is None and is_last and not has_learnt:
            settled = self._other(design, point) or self.encoded.settled(design, solver.value)
        if is_loose and has_learnt and settings.linearization_level and not settings.in_order:
            _begin_from(self.encoded.model, solution)
        if settled is None and (is_last or (has_learnt and not is_loose)):
            if is_optimal and self.weights is not None:  # of a question that now is stricter
                self.raise_least(self._bound(solver) or 0)
            is_found = found_design is not None and not is_optimal
            return (Unfinished(self._bound(solver), best) if is_found else None), best
        if is_optimal and settled is not None:
            return Found(point, settled), best
        if settled is not None and (not is_loose or (is_last and best is None)):  # else it may be larger than need be
            best = Found(point, settled)
            self._keep(best)
        return Unfinished(self._bound(solver), best), best

    def _other(self, design: Design, point: Bound) -> Design | None:
        """One as good as a design for whose threads there are no cores."""
        is_as_good = self.weights is not None or not self.encoded.model.has_objective()
        return self.used_less(design, point) if is_as_good else None

    def _is_reached(self, best: Found | None, point: Bound) -> bool:
        """Whether the best design is as good as a point that none is better than."""
        if best is None or self.weights is None:
            return False
        return weighted(self.weights, best.point) <= weighted(self.weights, point)

    def is_wanted(self, point: Bound, best: Found | None) -> bool:
        """Whether a point is one that the solver was asked for, and better than the best one.

        A point outside of the asked regions is refused, even if it is optimal for the relaxed question.
        """
        if self._regions is not None and not any(strictly_inside(point, region) for region in self._regions):
            return False
        most = self.most(best)
        return most is None or self.weights is None or weighted(self.weights, point) <= most


def _begin_from(model: cp_model.CpModel, solution: Sequence[int]) -> None:
    """Let the next solver start where the last one ended: it only has to repair what the model did not know then."""
    model.clear_hints()
    model.proto.solution_hint.vars.extend(range(len(solution)))
    model.proto.solution_hint.values.extend(solution)
