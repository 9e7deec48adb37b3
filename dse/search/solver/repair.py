"""Repair of solutions that the analysis refuses: other cores for their threads, or other options with their objectives.

Where threads wait longer than the model knew, the placement heuristics search cores on which no thread is late. Where
an optimum fills its cores to the brim, a design with the same objectives and lower utilisation is searched (decision
record 8).
"""

from __future__ import annotations

from collections.abc import Callable

from ortools.sat.python import cp_model

from dse.encode.scheduling.roomy import least_used
from dse.search.regions import Bound
from dse.search.solver.call import Call
from dse.search.solver.settings import RELAXED
from dse.search.solver_answer import Found, weighted
from dse.space.model.space import Design


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
