"""Other cores for a solution whose threads wait longer than the model knew.

Such a solution has cost a search with linear relaxation, and the rows that it teaches mostly only say that its threads
should share other cores. With its options held the rest is easy for clause learning: threads are moved until a design
is as good as it looked, or until no cores will do. Either way the model has learnt more than from one solution.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ortools.sat.python import cp_model

from dse.encode.linear import set_domain
from dse.encode.model import EncodedSpace
from dse.pareto.answer import Found, weighted
from dse.pareto.settings import BARE
from dse.space.types import Design

if TYPE_CHECKING:
    from dse.pareto.subproblem import Solver

MOVING = 0.1
"""Work to find other cores."""
MOST_PACKINGS = 32
"""So many refused designs are tried on other cores in a row, until one is known."""
MOST_MOVES = 20
"""So many times, each with what was learnt from the one before."""


def moved(solver: Solver, design: Design, best: Found | None, most: int | None) -> Found | None:
    """The best design known, after threads of `design` were tried on other cores."""
    space = solver.encoded.space
    if space is None or not space.open_cores:
        return best
    return best_around(solver, design, {item.index for item in space.open_cores}, MOVING, best, most)


def best_around(
    solver: Solver,
    design: Design,
    free: Collection[int],
    work: float,
    best: Found | None,
    most: int | None = None,
) -> Found | None:
    """The best design known, after decisions that are `free` had other options than a design, and all others the same.

    Each of up to `MOST_MOVES` calls may do so much work, and ends with a lesson or an answer; `most` as in
    `Solver.once`.
    """
    proved = solver.least
    with all_but(solver.encoded, design, free):
        for _ in range(MOST_MOVES):
            answer, best = solver.once(BARE, work, best, most)
            best = answer if isinstance(answer, Found) else best
            if answer is not None:
                break
    solver.least = proved  # what was proved since is true of these options only
    return best


def packed(solver: Solver, design: Design, value: Callable[[cp_model.IntVar], int]) -> Found | None:
    """A design that is wanted where none is known: one that was refused, on cores where nobody is late.

    Each choice of everything but cores is tried once, as far as these are `MOST_PACKINGS`.
    """
    contention, space = solver.encoded.contention, solver.encoded.space
    if contention is None or space is None or not space.open_cores or solver.weights is None:
        return None
    cores = {item.index for item in space.open_cores}
    rest = tuple(option for index, option in enumerate(design) if index not in cores)
    if rest in solver.packings or len(solver.packings) >= MOST_PACKINGS:
        return None
    solver.packings.add(rest)
    weights = solver.weights
    weighed = [(solver.encoded.weigh(other), other) for other in contention.elsewhere(design, value)]
    found = [Found(exact, other) for exact, other in weighed if exact is not None and solver.is_wanted(exact, None)]
    return min(found, key=lambda one: weighted(weights, one.point), default=None)


def keep(solver: Solver, best: Found | None) -> None:
    """Keep the best design that was come across, by what is minimised now: a search may be stopped at any moment."""
    if best is not None and (weights := solver.weights) is not None:
        found = [best] if solver.incumbent is None else [solver.incumbent, best]
        solver.incumbent = min(found, key=lambda one: weighted(weights, one.point))


def begin_from(model: cp_model.CpModel, solution: Sequence[int]) -> None:
    """Let the next solver start where the last one ended: it only has to mend what the model did not know then."""
    model.clear_hints()
    model.proto.solution_hint.vars.extend(range(len(solution)))
    model.proto.solution_hint.values.extend(solution)


@contextmanager
def all_but(encoded: EncodedSpace, design: Design, free: Collection[int]) -> Iterator[None]:
    """All options of a design are given, but those of the decisions that are `free`."""
    variables = encoded.model.proto.variables
    held = {
        literals[option].index: list(variables[literals[option].index].domain)
        for number, (literals, option) in enumerate(zip(encoded.options, design, strict=True))
        if option >= 0 and number not in free
    }
    for index in held:
        set_domain(variables[index], 1, 1)
    try:
        yield
    finally:
        for index, (low, high) in held.items():
            set_domain(variables[index], low, high)
