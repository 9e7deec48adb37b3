"""CP-SAT's settings: from nothing but clause learning to a linear relaxation with cuts (decision record 6)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ortools.sat.python import cp_model

INPROCESSING_FROM = 2.0
"""Work from which on simplifying the clauses in between pays."""

HINTED_CONFLICTS = 100
"""How many conflicts a solver may have while it completes the design that it is given to start from, ..."""
HINTED_CONFLICTS_RELAXED = 10
"""... and where each of them is followed by a linear program."""
CONFLICTS_IN_ORDER = 200_000
"""The greatest number of conflicts of a depth-first search that are a unit of work.

Deterministic time hardly counts the values that it tries one by one: 0.05 units took 38,000 conflicts and 1.9 CPU
seconds, where searches that find their design have some 1,000 conflicts in 0.01.
"""


@dataclass(frozen=True)
class SolverSettings:
    """The amount of linear relaxation that a call uses.

    `weight` is how much work a unit of deterministic time is: linear programming takes longer than the solver counts.
    `per_variable` is how much work a call takes at least for each variable of the model. With `in_order` the search is
    depth first in the order of the model's decision strategy; with `options_first` it decides in that order, but starts
    anew and goes on as it likes where that says no more. With `from_below` it proves bounds of the objective, the least
    value first; it `narrows` where such bounds and good designs take turns (`dse.search.solver.bounding`), or asks for
    the `lowest` values first, where it `pools` with a question to pooled cores in between. Long calls get simpler
    clauses on the way where it `simplifies`; a model is probed as it is read where it `probes`. With `any_value` the
    first solution is the answer, whatever its value in the range that is asked for. With `only_finds` the solver
    presolves and repairs the hint: what it finds counts, that there is none does not (see `sound_solver`).
    """

    linearization_level: int
    has_cuts: bool
    weight: float
    per_variable: float = 0.0
    in_order: bool = False
    options_first: bool = False
    from_below: bool = False
    narrows: bool = False
    lowest: bool = False
    pools: bool = False
    simplifies: bool = True
    only_finds: bool = False
    any_value: bool = False
    probes: bool = False

    def least_work(self, model: cp_model.CpModel) -> float:
        """The least work that a call can be expected to take.

        In deterministic time, proportional to the number of variables.
        """
        return self.per_variable * len(model.proto.variables)

    def apply(self, parameters: Any, work: float) -> None:
        """Set the parameters of a solver that is to do a given amount of work at most.

        `parameters` is CP-SAT's parameter message; `work` is in deterministic time.
        """
        parameters.linearization_level = self.linearization_level
        parameters.cut_level = int(self.has_cuts)
        parameters.cp_model_probing_level = 2 if self.probes else 0
        if self.linearization_level and not self.only_finds:
            parameters.hint_conflict_limit = HINTED_CONFLICTS_RELAXED
        parameters.use_objective_lb_search = self.from_below
        parameters.stop_after_first_solution = self.any_value
        parameters.use_sat_inprocessing = self.simplifies and work >= INPROCESSING_FROM and not self.in_order
        parameters.max_deterministic_time = work / self.weight
        parameters.cp_model_presolve = parameters.repair_hint = self.only_finds
        if self.options_first:
            parameters.search_branching = type(parameters.search_branching).PARTIAL_FIXED_SEARCH
        if self.in_order:
            parameters.search_branching = type(parameters.search_branching).FIXED_SEARCH
            parameters.max_number_of_conflicts = max(1, round(work * CONFLICTS_IN_ORDER))


BARE = SolverSettings(0, has_cuts=False, weight=1.0)
"""Nothing but propagation and clause learning: the models are small and tight, and most calls take milliseconds."""
RELAXED = SolverSettings(2, has_cuts=False, weight=1.8, per_variable=4e-5)
"""A linear relaxation of the sums and the clauses: for many summands and few rules, as in a knapsack."""
LOWEST = SolverSettings(2, has_cuts=False, weight=1.8, lowest=True)
"""A linear relaxation that asks for the lowest value that is not refuted: for cores that are nearly full."""
POOLING = SolverSettings(2, has_cuts=False, weight=1.8, lowest=True, pools=True)
"""A linear relaxation of the lowest value that asks pooled cores where it does not find a design at once."""
OPTIONS_FIRST = SolverSettings(2, has_cuts=False, weight=1.8, options_first=True)
"""A linear relaxation that decides rates before cores: where cores are so full that few rates are left."""
CUTTING = SolverSettings(2, has_cuts=True, weight=1.5, per_variable=6e-5)
"""A linear relaxation with cuts: for sums at the edge of their limits under conditions."""
WAYS = (BARE, RELAXED, CUTTING)
FROM_BELOW = SolverSettings(0, has_cuts=False, weight=1.0, from_below=True)
"""Whether the objective can be at its bound, and where it cannot, what bound follows."""
CLOSING = SolverSettings(1, has_cuts=False, weight=2.0, simplifies=False, probes=True)
"""A relaxation of what holds without conditions: who is on which core, and at which rate (decision record 9)."""
CLOSING_RANGE = replace(CLOSING, any_value=True)
"""`CLOSING` for any design in a range of values: what is left to ask about lies below it."""
FINDING = SolverSettings(1, has_cuts=False, weight=2.0, only_finds=True)
"""For a design that has given figures: presolve leaves little of such a question, and the hint is nearly one."""
NARROWING = SolverSettings(1, has_cuts=False, weight=1.0, narrows=True)
"""Bounds and designs in turns, for sums of waiting times, which no relaxation bounds well (decision record 9)."""
WAYS_WITH_WAITING = (BARE, NARROWING, CUTTING)
BARE_IN_ORDER = SolverSettings(0, has_cuts=False, weight=1.0, in_order=True)
RELAXED_IN_ORDER = SolverSettings(2, has_cuts=False, weight=1.0, in_order=True)
CUTTING_IN_ORDER = SolverSettings(2, has_cuts=True, weight=1.0, in_order=True)
BRIEF = (BARE, 0.05)
"""The first attempt at a part: what bare settings can do they do at once, the rest needs linear relaxation."""
ANY = (BRIEF, (FINDING, 1.0), (CUTTING, 0.5), (RELAXED, 1.0), (CUTTING, 1.5), (RELAXED, 6.0), (CUTTING, 100.0))
"""Attempts to find any design, one after the other: fixed, so that it does not depend on earlier questions.

Where a design keeps limits with nothing to spare, one relaxation may take a hundred times as long as the other.
"""
ANY_WITH_WAITING = (BRIEF, (CLOSING, 10.0), (CLOSING, 100.0))
"""Attempts to find any design where threads wait for each other."""
ANY_PACKING = (BRIEF, (RELAXED, 0.1))
"""Attempts to find any design where threads share cores; what they do not find is as hard as the search."""


def ways_to_any(*, waits: bool, shares: bool) -> tuple[tuple[SolverSettings, float], ...]:
    """The attempts to find any design: by whether response times are in what is asked, and whether threads share cores.

    Pairs of settings and work in deterministic time, tried one after the other.
    """
    return ANY_WITH_WAITING if waits else ANY_PACKING if shares else ANY


READING = 6e-6
"""Work to read a model, for each variable: the solver does not count it, and it is read again for each part."""


def sound_solver(seed: int = 0) -> cp_model.CpSolver:
    """A solver with one worker that leaves Ctrl-C to us, without the steps of OR-tools 9.15 that are wrong or too dear.

    Presolve loses solutions where it combines linear with at-most-one constraints (google/or-tools issue 5293). The
    detection of variables above at least one of several conditional bounds refutes models that have solutions, when a
    bound has two conditions. Both are off (decision record 6). Probing, which is done as a model is
    read, costs more than most of our calls, and branching on the best value of an objective first makes conflicts
    (decision record 6).
    """
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = seed
    solver.parameters.catch_sigint_signal = False
    solver.parameters.cp_model_presolve = False
    solver.parameters.cp_model_probing_level = 0
    solver.parameters.symmetry_level = 0
    solver.parameters.auto_detect_greater_than_at_least_one_of = False
    solver.parameters.exploit_objective = False
    solver.parameters.hint_conflict_limit = HINTED_CONFLICTS
    return solver
