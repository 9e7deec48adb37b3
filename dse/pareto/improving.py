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
from dse.pareto.moving import all_but
from dse.pareto.settings import BARE, IMPROVE_WORK, MOST_IMPROVING, READING
from dse.space.trees import at
from dse.space.types import Design, Space

if TYPE_CHECKING:
    from dse.pareto.subproblem import Solver

MOST_LESSONS = 20
"""So often the same cores are looked at again, each time with what was learnt from a solution that is none."""


def improved(solver: Solver, best: Found) -> Found:
    """A design at least as good as a known one, by what is minimised, in the part of the space that is asked about.

    The threads of two cores have other options and cores as long as that makes something better, then those of three,
    with so much work at most.
    The model learns from solutions that are none, and is left as it was else.
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
            best = _best_near(solver, best, _free_decisions(space, free), work)
    return best


def _best_near(solver: Solver, best: Found, free: set[int], work: float) -> Found:
    """The best design in which decisions that are not `free` are as in a known one, as far as so much work shows."""
    proved = solver.least
    with all_but(solver.encoded, best.design, free):
        for _ in range(MOST_LESSONS):
            solver.work += READING * len(solver.encoded.model.proto.variables)
            answer, found = solver.once(BARE, work, best, solver.most(best))
            best = answer if isinstance(answer, Found) else found or best
            if answer is not None:
                break
    solver.least = proved  # what was proved since is true of these options only
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
    threads = {item.stated_as for item in space.components if item.processor is not None}
    cores = {
        item.index
        for item in space.open_cores
        if any(space.components[number].stated_as in free for number in item.threads)
    }
    of_others = {index for index, decision in enumerate(space.decisions) if decision.component in threads - free} | {
        item.index for item in space.open_cores
    }
    return set(range(len(space.decisions))) - of_others | cores
