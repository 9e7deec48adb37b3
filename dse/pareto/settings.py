"""CP-SAT's settings: the bare ones first, heavier means for what proves hard (decision records 8 and 9)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ortools.sat.python import cp_model

from dse.pareto.answer import Answer, Unfinished

Settings = Callable[[Any], None]
"""Sets the parameters of a solver."""

TRY_AGAIN = 8
"""Settings that were too weak for two calls in a row are left out, but for one call in so many."""


def sound_solver(seed: int = 0) -> cp_model.CpSolver:
    """A solver with one worker that leaves Ctrl-C to us, without the steps of OR-tools 9.15 that are wrong.

    Presolve loses solutions where it combines linear with at-most-one constraints (google/or-tools issue 5293). The
    detection of variables above at least one of several conditional bounds refutes models that have solutions, when a
    bound has two conditions. Both are off (decision record 9).
    """
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = seed
    solver.parameters.catch_sigint_signal = False
    solver.parameters.cp_model_presolve = False
    solver.parameters.symmetry_level = 0
    solver.parameters.auto_detect_greater_than_at_least_one_of = False
    return solver


def bare(parameters: Any) -> None:
    """Nothing but propagation and clause learning: the models are small and tight, and most calls take milliseconds."""
    parameters.max_deterministic_time = 0.25
    parameters.use_sat_inprocessing = False
    parameters.linearization_level = 0


def brief(parameters: Any) -> None:
    """Bare settings for a moment: what they can do they do at once, the rest needs linear relaxation."""
    bare(parameters)
    parameters.max_deterministic_time = 0.05


def relaxed(parameters: Any) -> None:
    """A linear relaxation that has the clauses too, for sums at the edge of their limits."""
    parameters.max_deterministic_time = 1.0
    parameters.use_sat_inprocessing = False
    parameters.linearization_level = 2


def thorough(parameters: Any) -> None:
    """The same with inprocessing, without a limit."""
    parameters.linearization_level = 2


WHOLE: Sequence[Settings] = (bare, relaxed, thorough)
"""For a model as a whole: each longer than the one before, the last without a limit."""
APART: Sequence[Settings] = (brief, relaxed, thorough)
"""For a part of it."""


def in_order(parameters: Any, work: float, linear: int) -> None:
    """Depth first in the order of the decision strategy, with linear relaxation at a level."""
    parameters.use_sat_inprocessing = False
    parameters.linearization_level = linear
    parameters.search_branching = type(parameters.search_branching).FIXED_SEARCH
    parameters.max_deterministic_time = work


class Ladder:
    """Which settings to begin with: those that were too weak twice in a row are left out for a while."""

    def __init__(self) -> None:
        self.first = 0
        self._climbs = 0
        self._too_weak = 0

    def climb(self, attempts: Sequence[Callable[[], Answer]], is_over: Callable[[], bool]) -> Answer:
        """The first answer that an attempt gives; unfinished when the time is over."""
        self._climbs += 1
        start = 0 if self._climbs % TRY_AGAIN == 0 else min(self.first, len(attempts) - 1)
        for level in range(start, len(attempts)):
            answer = attempts[level]()
            if not isinstance(answer, Unfinished):
                if level == start:
                    self.first, self._too_weak = level, 0
                return answer
            if is_over():
                return answer
            if level == self.first:
                self._too_weak += 1
                if self._too_weak == 2:
                    self.first, self._too_weak = level + 1, 0
        return Unfinished()
