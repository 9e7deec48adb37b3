"""A good design of a part of the space, built step by step, where cores are nearly full (decision record 26).

There the least value of an objective is known almost at once, and what takes long is to find a design that has it. A
large-neighbourhood search finds one: it starts from the rates that use least of the processors, and lets the threads of
two cores choose their rates and cores anew for as long as that makes something better, then those of three. What it
ends with is a design like any other, of which nothing is proved; the analysis weighs it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING

from ortools.sat.python import cp_model

from dse.encode.model import EncodedSpace
from dse.encode.scheduling.neighbourhoods import Core, least_demanding, neighbourhood, threads_by_core, unnumbered
from dse.search.solver.settings import NEIGHBOUR_WORK, RELAXED, START_WORK
from dse.search.solver_answer import Found

if TYPE_CHECKING:
    from dse.search.solver.solver import Solver


@dataclass(frozen=True)
class Nearby:
    """Where the search in a part of the space ended: a solution (None: there is no start), and what it has `tried`.

    Of the threads in `tried` no other rates and cores were found that are better for the objective with factors `goal`.
    """

    solution: Sequence[int] | None
    tried: set[frozenset[int]] = field(default_factory=set)
    goal: tuple[int, ...] = ()


def neighbour(solver: Solver, least: int, work: float) -> Found | None:
    """A design of the model as it stands with a low value of what is minimised, in about so much work.

    None where threads share no cores of which the model has rows, or where none is found. Once it is no more than
    `least` nothing better is looked for.
    """
    encoded = solver.encoded
    contention = encoded.contention
    if contention is None or encoded.open_terms or not contention.may_move or not contention.known:
        return None
    places, end, model = contention.places, solver.work + work, unnumbered(encoded)
    known = solver.nearby.get(solver.within) or Nearby(_start(solver, model))
    goal = tuple(model.proto.objective.coeffs)
    solution, tried = known.solution, known.tried if known.goal == goal else set()
    if solution is None:
        solver.nearby[solver.within] = known
        return None
    for size, most_work in NEIGHBOUR_WORK:
        while solver.work < end and not solver.out_of_time():
            value = _value(model, solution)
            around = _next(threads_by_core(places, solution), contention.known, size, tried) if value > least else None
            if around is None:
                break
            cores, free = around
            near = neighbourhood(places, model, solution, cores, free)
            near.proto.objective.domain.extend([least, value - 1])
            run = solver.limited(RELAXED, most_work)
            run.parameters.cp_model_presolve = True
            status = solver.solved(run, near, RELAXED)
            if status in (cp_model.OPTIMAL, cp_model.FEASIBLE):
                solution = list(run.response_proto.solution)
            tried.add(free)
    solver.nearby[solver.within] = Nearby(solution, tried, goal)
    return judged(encoded, solution)


def judged(encoded: EncodedSpace, solution: Sequence[int]) -> Found | None:
    """The design of a solution with its figures, as the analysis accepts it."""
    point = tuple(solution[objective.variable.index] for objective in encoded.objectives)
    settled = encoded.settled(encoded.design(solution), lambda variable: solution[variable.index], is_best=False)
    return None if settled is None else Found(point, settled)


def _start(solver: Solver, model: cp_model.CpModel) -> list[int] | None:
    """A solution whose threads use little of their processors."""
    contention = solver.encoded.contention
    assert contention is not None, "nothing is asked about response times"
    run = solver.limited(RELAXED, START_WORK)
    run.parameters.stop_after_first_solution = True
    status = solver.solved(run, least_demanding(contention.places, model), RELAXED)
    return list(run.response_proto.solution) if status in (cp_model.OPTIMAL, cp_model.FEASIBLE) else None


def _value(model: cp_model.CpModel, solution: Sequence[int]) -> int:
    """What is minimised."""
    objective = model.proto.objective
    return sum(int(factor) * solution[index] for index, factor in zip(objective.vars, objective.coeffs, strict=True))


def _next(
    threads: dict[Core, frozenset[int]], known: set[int], size: int, tried: set[frozenset[int]]
) -> tuple[tuple[Core, ...], frozenset[int]] | None:
    """So many cores of a processor whose threads have not been tried together, with these threads; None if all have."""
    for processor in sorted(known):
        cores = [core for core in threads if core[0] == processor]
        for chosen in combinations(cores, size) if len(cores) > size or size == 2 else ():
            free = frozenset().union(*(threads[core] for core in chosen))
            if free and free not in tried:
                return chosen, free
    return None
