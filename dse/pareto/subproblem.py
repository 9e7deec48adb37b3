"""One solver call: whether there is a design in a part of the objective space, and which is the best one.

Every question the search asks goes through `Solver.minimise`, which answers with a design, a refutation, or neither.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from math import prod
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.forms import EXACT_LIMIT
from dse.encode.model import EncodedSpace
from dse.space.types import Design

ORDERED_SEARCH = ((0.01, None), (0.05, 1))
"""Deterministic time, and linearisation level (None: no presolve), of the attempts to find a canonical design."""
ORDERED_TO_THE_END = ((0.01, None), (0.1, 0), (2.0, 2))
"""The same where nothing else tells one design from the others."""
FEW_VARIABLES = 1_000
"""In larger models the linear relaxation costs more than it helps a depth-first search."""
BARE_AGAIN = 8
"""After two calls in a row that proved too hard for some settings, they are tried again only every so many calls."""


@dataclass(frozen=True)
class Found:
    """An optimal solution: the counted objectives (steps above each offset) and the design."""

    point: tuple[int, ...]
    design: Design


@dataclass(frozen=True)
class NoSuchDesign:
    """The solver proved that there is no design in the region."""


@dataclass(frozen=True)
class Unfinished:
    """The solver was stopped before it could tell; says nothing about the region.

    What it minimised is at least `bound`; `best` is the best solution so far.
    """

    bound: int | None = None
    best: Found | None = None


Answer = Found | NoSuchDesign | Unfinished

Part = tuple[int, ...]
"""The variables of options that are chosen everywhere in a part of the space."""
MOST_PARTS = 64


def parts_of(encoded: EncodedSpace) -> Iterator[Part]:
    """The combinations of options of the shared decisions: with these given, sums are plain sums."""
    open_options = [
        [literal.index for literal in encoded.options[decision]]
        for decision in encoded.shared
        if len(encoded.options[decision]) > 1
    ]
    while prod(map(len, open_options)) > MOST_PARTS:
        open_options.pop()
    return product(*open_options)


class Solver:
    """A model with its search settings, a deadline and a stop switch.

    `calls` counts the questions asked. Same model, same seed, same answers: one CP-SAT worker, and limits in
    deterministic time. Solving releases the GIL: several solvers, each with a model of its own, can work in threads
    (see `dse.pareto.crew`).
    """

    def __init__(self, encoded: EncodedSpace, *, seed: int = 0, deadline: float | None = None) -> None:
        self.encoded = encoded
        self.seed = seed
        self.deadline = deadline
        self.calls = 0
        self.stopped = False
        self._first = 0
        self._too_hard = 0
        self._parts = list(parts_of(encoded))
        self._running: cp_model.CpSolver | None = None

    def stop(self) -> None:
        """End the running call and refuse further ones."""
        self.stopped = True
        if self._running is not None:
            self._running.stop_search()

    def minimise(
        self,
        weights: Sequence[int],
        upper: Sequence[int],
        lower: Sequence[int] | None = None,
        hint: Design | None = None,
    ) -> Answer:
        """A design with counted objectives in [lower, upper] that minimises their weighted sum.

        `weights` must not be negative; the sum of weight * upper must stay below 2**53.
        """
        objectives = self.encoded.objectives
        if any(high < 0 for high in upper):
            return NoSuchDesign()
        model = self.encoded.model
        bottom = lower if lower is not None else [0] * len(objectives)
        for objective, low, high in zip(objectives, bottom, upper, strict=True):
            domain = model.proto.variables[objective.variable.index].domain
            domain.clear()
            domain.extend([low, min(high, objective.size)])
            if low > min(high, objective.size):
                return NoSuchDesign()
        total = sum(weight * high for weight, high in zip(weights, upper, strict=True))
        assert total < EXACT_LIMIT, "weights leave exact arithmetic"
        model.clear_objective()
        if any(weights):
            variables = [objective.variable for objective in objectives]
            model.minimize(cp_model.LinearExpr.weighted_sum(variables, list(weights)))
        self.hint(hint)
        return self.ask(weights)

    def ask(self, weights: Sequence[int] | None = None) -> Answer:
        """Solve the model as it stands: bare settings first, heavier means for what proves hard.

        Where the model minimises the sum of the objectives times `weights`, the parts of the space with the same shared
        options are solved apart before it is tried as a whole with relaxation.
        """
        self.calls += 1
        levels: list[Callable[[], Answer]] = [partial(self._solve, level) for level in range(len(SETTINGS))]
        if weights is not None and len(self._parts) > 1:
            levels[1] = partial(self._solve_apart, weights)
        first = 0 if self.calls % BARE_AGAIN == 0 else self._first
        for level in range(first, len(levels)):
            answer = levels[level]()
            if not isinstance(answer, Unfinished):
                if level == first:
                    self._first, self._too_hard = first, 0
                return answer
            if self._out_of_time():
                return answer
            if level == self._first:
                self._too_hard += 1
                if self._too_hard == 2:
                    self._first, self._too_hard = level + 1, 0
        return Unfinished()

    def _solve_apart(self, weights: Sequence[int]) -> Answer:
        """The best of all parts: each for a moment, then with heavier settings those that may hold something better.

        What is found in one part limits the others; the last settings go on to the end.
        """
        best: Found | None = None
        waiting: list[tuple[int, int]] = []
        for number, part in enumerate(self._parts):
            answer = self._solve_part(part, _briefly, weights, best)
            if isinstance(answer, Unfinished):
                if self._out_of_time():
                    return Unfinished()
                best = answer.best or best
                waiting.append((answer.bound if answer.bound is not None else -EXACT_LIMIT, number))
            elif isinstance(answer, Found):
                best = answer
        for configure in SETTINGS[1:]:
            left: list[tuple[int, int]] = []
            for bound, number in sorted(waiting):
                if best is not None and bound >= _weighted(weights, best):
                    continue
                answer = self._solve_part(self._parts[number], configure, weights, best)
                if isinstance(answer, Unfinished):
                    if self._out_of_time():
                        return Unfinished()
                    best = answer.best or best
                    left.append((bound if answer.bound is None else max(bound, answer.bound), number))
                elif isinstance(answer, Found):
                    best = answer
            waiting = left
        return best or NoSuchDesign()

    def _solve_part(
        self, part: Part, configure: Callable[[Any], None], weights: Sequence[int], best: Found | None
    ) -> Answer:
        """A better design than `best` in a part of the space."""
        proto = self.encoded.model.proto
        if best is not None:
            if not any(weights):
                return NoSuchDesign()  # any design will do
            proto.objective.domain.extend([-EXACT_LIMIT, _weighted(weights, best) - 1])
        before = [list(proto.variables[index].domain) for index in part]
        for index in part:
            _set_domain(proto, index, [1, 1])
        try:
            return self._run(configure)
        finally:
            for index, domain in zip(part, before, strict=True):
                _set_domain(proto, index, domain)
            proto.objective.domain.clear()

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

        The strategy is followed strictly (fixed search, presolve that keeps every solution); linear relaxation only
        refutes branches. `to_the_end` tries longer.
        """
        self.calls += 1
        is_large = len(self.encoded.model.proto.variables) > FEW_VARIABLES
        for work, linear in ORDERED_TO_THE_END if to_the_end else ORDERED_SEARCH:
            if linear and is_large and not to_the_end:
                break
            answer = self._run(lambda p, work=work, linear=linear: _in_order(p, work, linear))  # type: ignore[misc]
            if not isinstance(answer, Unfinished):
                return answer
        return Unfinished()

    def any_solution(self) -> Answer:
        """A solution of the model, the same one whatever was asked before."""
        self.calls += 1
        for configure in (_briefly, *SETTINGS[1:]):
            answer = self._run(configure)
            if not isinstance(answer, Unfinished) or self._out_of_time():
                return answer
        return Unfinished()

    def _solve(self, level: int) -> Answer:
        return self._run(SETTINGS[level])

    def _run(self, configure: Callable[[Any], None]) -> Answer:
        """One run of the solver, or several until the solution's open terms are exact."""
        while True:
            answer = self._once(configure)
            if answer is not None:
                return answer

    def _once(self, configure: Callable[[Any], None]) -> Answer | None:
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
            if self.encoded.open_terms and self.encoded.sharpen(design, solver.value):
                return None
            found = Found(point, design)
            if status == cp_model.OPTIMAL:
                return found
        has_bound = self.encoded.model.has_objective()
        return Unfinished(solver.response_proto.inner_objective_lower_bound if has_bound else None, found)


def _weighted(weights: Sequence[int], found: Found) -> int:
    return sum(weight * value for weight, value in zip(weights, found.point, strict=True))


def _set_domain(proto: Any, index: int, bounds: Sequence[int]) -> None:
    domain = proto.variables[index].domain
    domain.clear()
    domain.extend(bounds)


def sound_solver(seed: int = 0) -> cp_model.CpSolver:
    """A solver with one worker that leaves Ctrl-C to us, without the presolve step that is wrong.

    The step that combines linear constraints with at-most-one constraints can lose solutions in OR-tools 9.15
    (google/or-tools issue 5293): it calls a worse solution optimal. The work limit of 0 switches it off.
    """
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = seed
    solver.parameters.catch_sigint_signal = False
    solver.parameters.presolve_inclusion_work_limit = 0
    return solver


def _bare(parameters: Any) -> None:
    """Nothing but propagation and clause learning: the models are small and tight, and most calls take milliseconds."""
    parameters.max_deterministic_time = 0.25
    parameters.cp_model_presolve = False
    parameters.use_sat_inprocessing = False
    parameters.linearization_level = 0
    parameters.symmetry_level = 0


def _briefly(parameters: Any) -> None:
    """Bare settings for a moment: a design with a given point is found at once, or needs linear relaxation."""
    _bare(parameters)
    parameters.max_deterministic_time = 0.05


def _relaxed(parameters: Any) -> None:
    """Little presolve, and linear relaxation for sums at the edge of their limits."""
    parameters.max_deterministic_time = 1.0
    parameters.linearization_level = 1
    parameters.cp_model_probing_level = 0
    parameters.symmetry_level = 0
    parameters.max_presolve_iterations = 1


def _as_is(parameters: Any) -> None:
    """CP-SAT's own settings."""


SETTINGS: tuple[Callable[[Any], None], ...] = (_bare, _relaxed, _as_is)
"""Each for a longer time than the one before; the last without a limit."""


def _in_order(parameters: Any, work: float, linear: int | None) -> None:
    """Depth first in the order of the decision strategy; without presolve, or with linear relaxation at a level."""
    if linear is None:
        _bare(parameters)
    else:
        _relaxed(parameters)
        parameters.linearization_level = linear
        parameters.keep_all_feasible_solutions_in_presolve = True
    parameters.search_branching = type(parameters.search_branching).FIXED_SEARCH
    parameters.max_deterministic_time = work
