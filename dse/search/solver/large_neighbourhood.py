"""Other designs than solutions: on other cores, better ones near a design, or with the objectives of a solution.

Where threads wait longer than the model knew, the placement heuristics search cores on which no thread is late. Where
an optimum fills its cores to the brim, a design with the same objectives and lower utilisation is searched (decision
record 8).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations

from ortools.sat.python import cp_model

from dse.analysis.views import View
from dse.encode.linear import set_domain
from dse.encode.model import EncodedSpace
from dse.encode.scheduling.roomy import least_used
from dse.search.regions import Bound
from dse.search.solver.call import Call
from dse.search.solver.settings import BARE, READING, RELAXED
from dse.search.solver_answer import Found, weighted
from dse.space.model.space import Design, Space
from dse.space.model.trees import at


def _best_around(
    call: Call,
    design: Design,
    free: Collection[int],
    work: float,
    best: Found | None,
    most: int | None = None,
) -> Found | None:
    """The best design known, after decisions that are `free` had other options than a design, and all others the same.

    Each of up to `most_moves` calls may do a given amount of work, and ends with a lesson or an answer; `most` as in
    `Call.once`.
    """
    proved = call.least
    with all_but(call.encoded, design, free):
        for _ in range(call.tuning.improving.most_moves):
            answer, best = call.once(BARE, work, best, most)
            best = answer if isinstance(answer, Found) else best
            if answer is not None:
                break
    call.least = proved  # what was proved since is true of these options only
    return best


def packed(call: Call, packings: set[Design], design: Design, value: Callable[[cp_model.IntVar], int]) -> Found | None:
    """A design that is wanted where none is known: one that was refused, on cores where no thread is late.

    Each choice of everything but cores is tried once, and is among the `packings` then.
    """
    contention, space, tuning = call.encoded.contention, call.encoded.space, call.tuning.other_cores
    if not tuning.is_on or contention is None or space is None or not space.open_cores or call.weights is None:
        return None
    cores = {item.index for item in space.open_cores}
    rest = tuple(option for index, option in enumerate(design) if index not in cores)
    if rest in packings or len(packings) >= tuning.most:
        return None
    packings.add(rest)
    weights = call.weights
    weighed = [(call.encoded.weigh(other), other) for other in contention.elsewhere(design, value)]
    better = [Found(exact, other) for exact, other in weighed if exact is not None and call.is_wanted(exact, None)]
    return min(better, key=lambda one: weighted(weights, one.point), default=None)


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


# A design made better where threads wait for each other: other options for the threads of a few cores at a time.
#
# A large-neighbourhood search (Shaw, "Using constraint programming and local search methods to solve vehicle routing
# problems", CP 1998): what all other threads have is held, and clause learning finds the best of what is left, or that
# there is nothing better, in a moment. Near the least value of what is minimised a question about all threads takes as
# long with an answer as without one, so that the search should know a design there, and only ask once whether there is
# a better one (decision record 9).


def improved(call: Call, best: Found) -> Found:
    """A design at least as good as a known one, by what is minimised, in the part of the space that is asked about.

    The threads of two cores have other options and cores as long as that makes something better, then those of three,
    with limited work. The model learns from solutions that are none, and is left as it was else.
    """
    space, contention, tuning = call.encoded.space, call.encoded.contention, call.tuning.improving
    if not tuning.is_on or space is None or contention is None or not space.open_cores or call.weights is None:
        return best
    tried: set[frozenset[str]] = set()
    end = call.work + tuning.most_work
    with contention.any_numbers():
        while call.work < end and not call.out_of_time():
            free, work = next(_neighbourhoods(space, best.design, tried, tuning.work), (None, 0.0))
            if free is None:
                break
            tried.add(free)
            call.work += READING * len(call.encoded.model.proto.variables)
            best = _best_around(call, best.design, _free_decisions(space, free), work, best) or best
    return best


def _neighbourhoods(
    space: Space, design: Design, tried: set[frozenset[str]], works: Sequence[tuple[int, float]]
) -> Iterator[tuple[frozenset[str], float]]:
    """The names of the threads of two cores, then of three, that were not tried together; and the work for them."""
    on_core = _threads_by_core(space, design)
    for size, work in works:
        for cores in combinations(sorted(on_core), size) if len(on_core) > size else ():
            free = frozenset().union(*(on_core[core] for core in cores))
            if free not in tried:
                yield free, work


def _threads_by_core(space: Space, design: Design) -> dict[tuple[int, int], set[str]]:
    """The names, as stated in the file, of the threads whose core is a decision, by processor and option."""
    view = View(design)
    threads_of: dict[tuple[int, int], set[str]] = {}
    for item in space.open_cores:
        if design[item.index] >= 0:
            for number in item.threads:
                component = space.components[number]
                core = int(at(component.processor, view)), design[item.index]
                threads_of.setdefault(core, set()).add(component.stated_as)
    return threads_of


def _free_decisions(space: Space, free: frozenset[str]) -> set[int]:
    """The decisions of these threads, their cores, and what belongs to no thread."""
    held = {item.stated_as for item in space.components if item.processor is not None} - free
    is_held = {index: decision.component in held for index, decision in enumerate(space.decisions)}
    for item in space.open_cores:  # which may be named for an executor, and are those of all its threads
        is_held[item.index] = free.isdisjoint(space.components[number].stated_as for number in item.threads)
    return {index for index, is_kept in is_held.items() if not is_kept}


# Another design with the figures of a solution, for whose threads there are cores where there are none for its own.


def roomier(call: Call, design: Design, point: Bound) -> Design | None:
    """A design with the objectives `point` that leaves its processors so much room that cores are found for it.

    None where none is found within some work, and where designs with the same figures are not all as good. `design` is
    a solution of the solver's model.
    """
    encoded, tuning = call.encoded, call.tuning.least_used
    if not tuning.is_on or encoded.contention is None or encoded.open_terms or not encoded.contention.may_move:
        return None
    model = least_used(encoded, design, point)
    for work in tuning.work:
        if call.out_of_time():
            return None
        sharper = call.limited(RELAXED, work)
        status = call.solved(sharper, model, RELAXED)
        if status == cp_model.INFEASIBLE:
            return None
        if status != cp_model.UNKNOWN:
            other = encoded.design(list(sharper.response_proto.solution))
            settled = encoded.settled(other, sharper.value, is_best=False)
            if settled is not None or status == cp_model.OPTIMAL:
                return settled
    return None
