"""Calls of the solver in the second proof: settings other than those of the search, in turns with limits that double.

No settings are the best for all questions: what one pair of them proves in half a second another does not in half a
minute (decision record 10). So several take turns, each for a while that is counted in steps, not in seconds.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any, Literal, NamedTuple, TypeAlias

from ortools.sat.python import cp_model

from dse.space.model.space import Design

FIRST_LIMIT = 0.3
"""Deterministic time of the first attempts at a question; a second of work is one to three units."""
SECONDS_A_UNIT = 20.0
"""An attempt takes so many seconds for a unit of its limit at most: some steps of the solver hardly count."""
SEED = 982_451_653
SHARE_OF_REFUTING = 4
"""The smaller question before an attempt may take so many times its limit: it mostly answers for all of them."""
SHARE_OF_OTHERS = 0.25
"""Where one way is favoured each other has this share of its limit."""
MOST_STOPS = 500
"""The greatest number of times that a call is told to stop, every 10 ms."""


class SolverWay(NamedTuple):
    """The branching of a solver, its amount of linear relaxation, and whether it makes cuts.

    One that is `plain` does nothing before it branches, nor in between: where a question is easy that is most of it.
    """

    branching: Any
    linearization: int
    cuts: int
    plain: bool = False


Ways: TypeAlias = Sequence[SolverWay]
"""The attempts at a question take turns with these."""
WAYS: Ways = (
    SolverWay(cp_model.AUTOMATIC_SEARCH, 0, 1),
    SolverWay(cp_model.AUTOMATIC_SEARCH, 1, 1),
    SolverWay(cp_model.PORTFOLIO_WITH_QUICK_RESTART_SEARCH, 0, 1),
    SolverWay(cp_model.AUTOMATIC_SEARCH, 2, 1),
)
IN_ORDER: Ways = (SolverWay(cp_model.FIXED_SEARCH, 0, 0, plain=True), *WAYS)
"""Ways where a model has an order of decisions: what is asked for first is tried, or refuted, first."""
BY_ROWS: Ways = (SolverWay(cp_model.AUTOMATIC_SEARCH, 0, 1, plain=True), *WAYS)
"""Ways where rows mostly refute a question at once."""
BY_RELAXATION: Ways = (SolverWay(cp_model.AUTOMATIC_SEARCH, 2, 0, plain=True),)
"""The way where figures are plain sums: what rows leave together the relaxation tells, without a cut."""
WAITING: Ways = (
    SolverWay(cp_model.AUTOMATIC_SEARCH, 0, 1, plain=True),
    SolverWay(cp_model.AUTOMATIC_SEARCH, 1, 0, plain=True),
)
"""Ways where threads wait for each other: what a solver does before it branches takes longer than most answers."""
PACKING: Ways = (SolverWay(cp_model.AUTOMATIC_SEARCH, 2, 0), SolverWay(cp_model.AUTOMATIC_SEARCH, 2, 1))
"""Ways where threads are put on cores: of what fills them to the brim only the relaxation tells (record 10)."""
ON_BUSES: Ways = PACKING
"""Ways where messages are limited: what all of them need of a bus the relaxation tells at once."""

Outcome: TypeAlias = tuple[Any, cp_model.CpSolver | None]
"""A status, and the solver that has values for it."""


@dataclass(frozen=True)
class Reply:
    """``none`` is a proof that there is no such design; the analysis accepts `design`; ``unknown`` is no answer."""

    answer: Literal["design", "none", "unknown"]
    design: Design = ()


def ask(
    model: cp_model.CpModel,
    deadline: float | None,
    is_refuted: Callable[[float], bool] | None = None,
    ways: Ways = WAYS,
    first: int = 0,
    *,
    is_favoured: bool = False,
    most: int | None = None,
) -> tuple[Outcome, int]:
    """An answer of the solver, unknown at the deadline or after `most` attempts only, and which attempt gave it.

    Before each attempt `is_refuted` is asked, with some times that attempt's limit, whether it can show that there
    is no solution. A question that is nearly one of before begins with the attempt that answered that, its `first`.
    Where the first way `is_favoured` each other has `SHARE_OF_OTHERS` of its limit.
    """
    for attempt in count(first):
        if most is not None and attempt >= most:
            return (cp_model.UNKNOWN, None), attempt
        limit = FIRST_LIMIT * 2 ** (attempt // len(ways))
        if is_refuted is not None and is_refuted(SHARE_OF_REFUTING * limit):
            return (cp_model.INFEASIBLE, None), attempt
        limit *= SHARE_OF_OTHERS if is_favoured and attempt % len(ways) else 1
        outcome = attempted(model, deadline, limit, attempt, ways)
        if outcome[0] != cp_model.UNKNOWN or is_over(deadline):
            return outcome, attempt
    raise AssertionError("attempts have no end")


def attempted(
    model: cp_model.CpModel,
    deadline: float | None,
    limit: float,
    attempt: int = 0,
    ways: Ways = WAYS,
) -> Outcome:
    """One attempt at a model, with settings and a seed of its own, for a given deterministic time; may be unknown.

    A pair of the solver's status and, with a solution, the solver.
    """
    if is_over(deadline):
        return cp_model.UNKNOWN, None
    way = ways[attempt % len(ways)]
    solver = other_solver()
    parameters: Any = solver.parameters
    parameters.search_branching = way.branching
    parameters.linearization_level, parameters.cut_level = way.linearization, way.cuts
    if way.plain:
        parameters.cp_model_probing_level = parameters.symmetry_level = 0
        parameters.use_sat_inprocessing = False
    parameters.random_seed = SEED + attempt
    parameters.max_deterministic_time = limit
    seconds = 1.0 + SECONDS_A_UNIT * limit
    parameters.max_time_in_seconds = seconds if deadline is None else min(seconds, deadline - time.monotonic())
    status = _in_a_thread(solver, model, deadline)
    assert status != cp_model.MODEL_INVALID, "the model is invalid"
    return status, solver if status in (cp_model.OPTIMAL, cp_model.FEASIBLE) else None


def other_solver() -> cp_model.CpSolver:
    """A solver with settings of its own, without the steps of OR-tools 9.15 that are wrong (decision record 6).

    One worker, fixed seed, no presolve: settings that the search does not use.
    """
    solver = cp_model.CpSolver()
    parameters: Any = solver.parameters
    parameters.num_workers = 1
    parameters.random_seed = SEED
    parameters.catch_sigint_signal = False
    parameters.cp_model_presolve = False
    parameters.auto_detect_greater_than_at_least_one_of = False
    return solver


def is_over(deadline: float | None) -> bool:
    """Whether there is no time left."""
    return deadline is not None and time.monotonic() >= deadline


def _in_a_thread(solver: cp_model.CpSolver, model: cp_model.CpModel, deadline: float | None) -> Any:
    """Solve while this thread waits in short steps: Ctrl-C ends it, and the deadline if its own clock does not."""
    results: list[Any] = []
    done = threading.Event()

    def work() -> None:
        try:
            results.append(solver.solve(model))
        finally:
            done.set()

    thread = threading.Thread(target=work, daemon=True)
    try:
        thread.start()
        while not done.wait(0.2):
            if is_over(deadline):
                solver.stop_search()
    except KeyboardInterrupt:
        for _ in range(MOST_STOPS):
            solver.stop_search()  # again, for a call that was about to begin
            if done.wait(0.01):
                break
        raise
    return results[0]
