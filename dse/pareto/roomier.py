"""Another design with the figures of a solution, for whose threads there are cores where there are none for its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ortools.sat.python import cp_model

from dse.encode.roomy import least_used
from dse.pareto.regions import Bound
from dse.pareto.settings import RELAXED, ROOMY_WORK
from dse.space.types import Design

if TYPE_CHECKING:
    from dse.pareto.subproblem import Solver


def roomier(solver: Solver, design: Design, point: Bound) -> Design | None:
    """A design with the objectives `point` that leaves its processors so much room that cores are found for it.

    None where none is found within some work, and where designs with the same figures are not all as good. `design` is
    a solution of the solver's model.
    """
    encoded = solver.encoded
    if encoded.contention is None or encoded.open_terms or not encoded.contention.may_move:
        return None
    model = least_used(encoded, design, point)
    for work in ROOMY_WORK:
        if solver.out_of_time():
            return None
        found = solver.limited(RELAXED, work)
        status = solver.solved(found, model, RELAXED)
        if status == cp_model.INFEASIBLE:
            return None
        if status != cp_model.UNKNOWN:
            other = encoded.design(list(found.response_proto.solution))
            settled = encoded.settled(other, found.value, is_best=False)
            if settled is not None or status == cp_model.OPTIMAL:
                return settled
    return None
