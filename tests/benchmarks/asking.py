"""How the peers ask CP-SAT: its default parameters, no hints, and what they are stopped by."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from ortools.sat.python import cp_model

Vector = tuple[int, ...]
Ask = Callable[[Any, Sequence[Any], float], Vector | None]
"""Minimises a model within so many seconds: the values of some expressions, None where it has no solution."""


class OutOfTime(Exception):
    """The time limit is reached."""


def avoid_lost_solutions(parameters: Any) -> None:
    """Leave out the two steps of OR-tools 9.15 that lose solutions (decision record 6)."""
    parameters.presolve_inclusion_work_limit = 0
    parameters.auto_detect_greater_than_at_least_one_of = False


def by_cp_sat(workers: int) -> Ask:
    """CP-SAT with its default parameters."""

    def ask(model: Any, expressions: Sequence[Any], left_s: float) -> Vector | None:
        solver = cp_model.CpSolver()
        solver.parameters.num_workers = workers
        avoid_lost_solutions(solver.parameters)
        solver.parameters.max_time_in_seconds = left_s
        status = solver.solve(model)
        if status == cp_model.INFEASIBLE:
            return None
        if status != cp_model.OPTIMAL:
            raise OutOfTime
        return tuple(solver.value(expression) for expression in expressions)

    return ask


def within_processor_time(limit_s: float, level: int | None = None) -> Ask:
    """CP-SAT with its default parameters and one worker, stopped when the process has worked so long since now.

    With `level`, another `linearization_level` than the default.
    """
    end = time.process_time() + limit_s

    def ask(model: Any, expressions: Sequence[Any], left_s: float) -> Vector | None:
        solver = cp_model.CpSolver()
        solver.parameters.num_workers = 1
        if level is not None:
            solver.parameters.linearization_level = level
        avoid_lost_solutions(solver.parameters)
        over = threading.Event()

        def watch() -> None:
            while not over.wait(0.1):
                if time.process_time() > end:
                    solver.stop_search()

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            status = solver.solve(model)
        finally:
            over.set()
            watcher.join()
        if status == cp_model.INFEASIBLE:
            return None
        if status != cp_model.OPTIMAL or time.process_time() > end:
            raise OutOfTime
        return tuple(solver.value(expression) for expression in expressions)

    return ask
