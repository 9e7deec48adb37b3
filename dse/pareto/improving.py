"""A design made better where threads wait for each other: other options for the threads of a few cores at a time.

A large-neighbourhood search (Shaw, "Using constraint programming and local search methods to solve vehicle routing
problems", CP 1998): what all other threads have is held, and clause learning finds the best of what is left, or that
there is nothing better, in a moment. Near the least value of what is minimised a question about all threads takes as
long with an answer as without one, so that the search should know a design there, and only ask once whether there is a
better one (decision record 42).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

from dse.analysis.views import View
from dse.pareto.answer import Found
from dse.pareto.moving import best_around
from dse.pareto.settings import IMPROVE_WORK, MOST_IMPROVING, READING
from dse.space.trees import at
from dse.space.types import Design, Space

if TYPE_CHECKING:
    from dse.pareto.subproblem import Solver


def improved(solver: Solver, best: Found) -> Found:
    """A design at least as good as a known one, by what is minimised, in the part of the space that is asked about.

    The threads of two cores have other options and cores as long as that makes something better, then those of three,
    with `MOST_IMPROVING` work at most. The model learns from solutions that are none, and is left as it was else.
    """
    space, contention = solver.encoded.space, solver.encoded.contention
    if space is None or contention is None or not space.open_cores or solver.weights is None:
        return best
    tried: set[frozenset[str]] = set()
    end = solver.work + MOST_IMPROVING
    with contention.any_numbers():
        while solver.work < end and not solver.out_of_time():
            free, work = next(_neighbourhoods(space, best.design, tried), (None, 0.0))
            if free is None:
                break
            tried.add(free)
            solver.work += READING * len(solver.encoded.model.proto.variables)
            best = best_around(solver, best.design, _free_decisions(space, free), work, best) or best
    return best


def _neighbourhoods(space: Space, design: Design, tried: set[frozenset[str]]) -> Iterator[tuple[frozenset[str], float]]:
    """The names of the threads of two cores, then of three, that were not tried together; and the work for them."""
    on_core = _threads_by_core(space, design)
    for size, work in IMPROVE_WORK:
        for cores in combinations(sorted(on_core), size) if len(on_core) > size else ():
            free = frozenset().union(*(on_core[core] for core in cores))
            if free not in tried:
                yield free, work


def _threads_by_core(space: Space, design: Design) -> dict[tuple[int, int], set[str]]:
    """The names, as stated in the file, of the threads whose core is a decision, by processor and option."""
    view = View(design)
    found: dict[tuple[int, int], set[str]] = {}
    for item in space.open_cores:
        if design[item.index] >= 0:
            for number in item.threads:
                component = space.components[number]
                core = int(at(component.processor, view)), design[item.index]
                found.setdefault(core, set()).add(component.stated_as)
    return found


def _free_decisions(space: Space, free: frozenset[str]) -> set[int]:
    """The decisions of these threads, their cores, and what belongs to no thread."""
    held = {item.stated_as for item in space.components if item.processor is not None} - free
    is_held = {index: decision.component in held for index, decision in enumerate(space.decisions)}
    for item in space.open_cores:  # which may be named for an executor, and are those of all its threads
        is_held[item.index] = free.isdisjoint(space.components[number].stated_as for number in item.threads)
    return {index for index, is_kept in is_held.items() if not is_kept}
