"""One solver call: whether there is a design in a part of the objective space, and which is the best one.

Every question the search asks goes through `Solver.minimise`, which answers with a design, a refutation, or neither.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.forms import EXACT_LIMIT
from dse.encode.model import EncodedSpace
from dse.pareto.answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.pareto.parts import Part, Parts
from dse.pareto.settings import APART, WHOLE, Ladder, Settings, brief, in_order, sound_solver
from dse.pareto.zones import Bound
from dse.space.types import Design

ORDERED_SEARCH = ((0.01, 0), (0.05, 2))
"""Deterministic time, and linearisation level, of the attempts to find a canonical design."""
ORDERED_TO_THE_END = ((0.01, 0), (2.0, 2))
"""The same where nothing else tells one design from the others."""
FEW_VARIABLES = 1_000
"""In larger models the linear relaxation costs more than it helps a depth-first search."""


class Solver:
    """A model with its search settings, a deadline and a stop switch.

    `calls` counts the questions asked. Same model, same seed, same answers: one CP-SAT worker, and limits in
    deterministic time. Solving releases the GIL: several solvers, each with a model of its own, can work in threads
    (see `dse.pareto.crew`), and share what is known of the `parts` of the space. Between questions the model may only
    become stricter, by `exclude`.
    """

    def __init__(
        self, encoded: EncodedSpace, *, seed: int = 0, deadline: float | None = None, parts: Parts | None = None
    ) -> None:
        self.encoded = encoded
        self.seed = seed
        self.deadline = deadline
        self.parts = parts if parts is not None else Parts(encoded)
        self.calls = 0
        self.stopped = False
        self._whole = Ladder()
        self._apart = Ladder()
        self._running: cp_model.CpSolver | None = None

    def stop(self) -> None:
        """End the running call and refuse further ones."""
        self.stopped = True
        if self._running is not None:
            self._running.stop_search()

    @property
    def is_hard(self) -> bool:
        """Whether the last questions were too hard for bare settings."""
        return self._whole.first > 0

    def exclude(self, design: Design, *, unless: Sequence[Any] = ()) -> None:
        """Forbid one design: at least one decision differs, or one of the literals `unless` is true."""
        self.encoded.model.add_bool_or([*self.encoded.differs_from(design), *unless])
        self.parts.forget(design)

    def minimise(self, weights: Sequence[int], zones: Sequence[Bound], hint: Design | None = None) -> Answer:
        """The design in one of the `zones` with the least weighted sum of counted objectives.

        A zone is the region strictly below a bound in every objective. `weights` must not be negative; the weighted
        sum must stay below 2**53. Bare settings come first; what is too hard for them is solved part by part.
        """
        zones = [zone for zone in zones if all(bound > 0 for bound in zone)]
        if not zones:
            return NoSuchDesign()
        self.calls += 1
        self._restrict(zones)
        model = self.encoded.model
        model.clear_objective()
        if any(weights):
            variables = [objective.variable for objective in self.encoded.objectives]
            model.minimize(cp_model.LinearExpr.weighted_sum(variables, list(weights)))
        most = [max(bounds) - 1 for bounds in zip(*zones, strict=True)]
        assert weighted(weights, most) < EXACT_LIMIT, "weights leave exact arithmetic"
        self.hint(hint)
        attempts: list[Callable[[], Answer]] = [partial(self._solve_whole, settings) for settings in WHOLE]
        if len(self.parts) > 1:
            attempts[1:] = [partial(self._solve_apart, weights, zones)]
        return self._whole.climb(attempts, self._out_of_time)

    def ask(self) -> Answer:
        """Solve the model as it stands."""
        self.calls += 1
        return self._whole.climb([partial(self._solve_whole, settings) for settings in WHOLE], self._out_of_time)

    def set_point(self, point: Bound) -> None:
        """Fix the objectives."""
        self._restrict([tuple(value + 1 for value in point)], point)

    def _restrict(self, zones: Sequence[Bound], floor: Bound | None = None) -> None:
        """Only designs in one of the zones, with objectives of at least `floor`."""
        encoded = self.encoded
        assert len(zones) <= max(1, len(encoded.zones)), "more zones than the model has switches"
        proto = encoded.model.proto
        for number, objective in enumerate(encoded.objectives):
            high = min(max(zone[number] for zone in zones) - 1, objective.size)
            _set_domain(proto.variables[objective.variable.index], floor[number] if floor is not None else 0, high)
        for number, switch in enumerate(encoded.zones):
            _set_domain(proto.variables[switch.literal.index], 0, int(number < len(zones)))
        for switch, zone in zip(encoded.zones, zones, strict=False):  # as many as there are zones
            for constraint, bound in zip(switch.constraints, zone, strict=True):
                _set_domain(proto.constraints[constraint].linear, 0, bound - 1)

    def _solve_whole(self, configure: Settings) -> Answer:
        return self._run(configure)

    def _solve_apart(self, weights: Sequence[int], zones: Sequence[Bound]) -> Answer:
        """The best of all parts: each for a moment, then with heavier settings those that may hold something better.

        What is found in one part limits the others, and what earlier questions proved of a part may answer for it.
        """
        best = self.parts.best(weights, zones)
        waiting = [
            (weighted(weights, part.floor(open_zones)), number)
            for number, part in enumerate(self.parts.all)
            if (open_zones := part.open(zones))
        ]

        def attempt(configure: Settings) -> Answer:
            nonlocal best, waiting
            left = []
            for bound, number in sorted(waiting):
                if best is not None and bound >= weighted(weights, best.point):
                    continue
                answer = self._solve_part(self.parts.all[number], configure, weights, zones, best)
                if isinstance(answer, Found):
                    best = answer
                elif isinstance(answer, Unfinished):
                    if self._out_of_time():
                        return answer
                    best = answer.best or best
                    left.append((bound if answer.bound is None else max(bound, answer.bound), number))
            waiting = left
            return Unfinished() if left else best or NoSuchDesign()

        return self._apart.climb([partial(attempt, settings) for settings in APART], self._out_of_time)

    def _solve_part(
        self, part: Part, configure: Settings, weights: Sequence[int], zones: Sequence[Bound], best: Found | None
    ) -> Answer:
        """A better design than `best` in a part of the space."""
        zones = part.open(zones)
        if not zones or (best is not None and not any(weights)):
            return NoSuchDesign()
        better_than = None if best is None else weighted(weights, best.point)
        self._restrict(zones, part.floor(zones))
        objective = self.encoded.model.proto.objective
        if better_than is not None:
            objective.domain.extend([-EXACT_LIMIT, better_than - 1])
        try:
            answer = self._within(part, configure)
        finally:
            objective.domain.clear()
        part.learn(answer, weights, zones, better_than)
        return answer

    def _within(self, part: Part, configure: Settings) -> Answer:
        """One run of the solver in a part of the space."""
        variables = self.encoded.model.proto.variables
        before = [list(variables[index].domain) for index in part.literals]
        for index in part.literals:
            _set_domain(variables[index], 1, 1)
        try:
            return self._run(configure)
        finally:
            for index, (low, high) in zip(part.literals, before, strict=True):
                _set_domain(variables[index], low, high)

    def hint(self, hint: Design | None) -> None:
        """Suggest a design to start from."""
        self.encoded.model.clear_hints()
        if hint is None:
            return
        values: dict[int, int] = {}
        for literals, inactive, chosen in zip(self.encoded.options, self.encoded.inactive, hint, strict=True):
            if len(literals) > 1:
                for option, literal in enumerate(literals):
                    values.setdefault(literal.index, int(option == chosen))
            if inactive is not None:
                values.setdefault(inactive.index, int(chosen < 0))
        suggestion = self.encoded.model.proto.solution_hint
        suggestion.vars.extend(values.keys())
        suggestion.values.extend(values.values())

    def _out_of_time(self) -> bool:
        return self.stopped or (self.deadline is not None and time.monotonic() >= self.deadline)

    def first_in_order(self, *, to_the_end: bool = False) -> Answer:
        """The first solution in the order of the model's decision strategy; unfinished when that takes too long.

        The strategy is followed strictly (fixed search), linear relaxation only refutes branches; `to_the_end` tries
        longer.
        """
        self.calls += 1
        is_large = len(self.encoded.model.proto.variables) > FEW_VARIABLES
        for work, linear in ORDERED_TO_THE_END if to_the_end else ORDERED_SEARCH:
            if linear and is_large and not to_the_end:
                break
            answer = self._run(partial(in_order, work=work, linear=linear))
            if not isinstance(answer, Unfinished):
                return answer
        return Unfinished()

    def any_solution(self, point: Bound) -> Answer:
        """A solution with the point that `set_point` fixed, the same one whatever was asked before.

        What is hard as a whole is asked part by part, in their order; those proved not to have it are left out.
        """
        self.calls += 1
        answer = self._run(brief)
        if not isinstance(answer, Unfinished):
            return answer
        zone = tuple(value + 1 for value in point)
        for part in self.parts.all:
            if part.open([zone]):
                for configure in APART if len(self.parts) > 1 else APART[1:]:
                    answer = self._within(part, configure)
                    if isinstance(answer, Found) or self._out_of_time():
                        return answer
                    if isinstance(answer, NoSuchDesign):
                        break
        return NoSuchDesign()

    def _run(self, configure: Settings) -> Answer:
        """One run of the solver, or several until the solution's open terms are exact."""
        while True:
            answer = self._once(configure)
            if answer is not None:
                return answer
            if self.encoded.contention is not None and self.encoded.contention.is_stuck:
                return Unfinished()

    def _once(self, configure: Settings) -> Answer | None:
        """One run of the solver; None where its solution was not exact, and the model is sharper now."""
        if self._out_of_time():
            return Unfinished()
        solver = sound_solver(self.seed)
        parameters: Any = solver.parameters
        configure(parameters)
        if self.deadline is not None:
            parameters.max_time_in_seconds = max(0.01, self.deadline - time.monotonic())
        self._running = solver
        status = solver.solve(self.encoded.model)
        self._running = None
        assert status != cp_model.MODEL_INVALID, "the model is invalid"
        if status == cp_model.INFEASIBLE:
            return NoSuchDesign()
        found = None
        if status in (cp_model.OPTIMAL, cp_model.FEASIBLE):
            point = tuple(solver.value(objective.variable) for objective in self.encoded.objectives)
            design = self.encoded.design(solver.boolean_value)
            settled = self.encoded.settled(design, solver.value)
            if settled is None:
                return None
            found = Found(point, settled)
            if status == cp_model.OPTIMAL:
                return found
        has_bound = self.encoded.model.has_objective()
        return Unfinished(solver.response_proto.inner_objective_lower_bound if has_bound else None, found)


def _set_domain(bounded: Any, low: int, high: int) -> None:
    """The domain of a variable or of a linear constraint."""
    bounded.domain.clear()
    bounded.domain.extend([low, high])
