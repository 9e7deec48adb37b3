"""The best design where cores are nearly full, by way of a model in which interchangeable cores are pooled.

There (`dse.encode.pooled`, decision record 32) a bound takes a fraction of a second, as there is no symmetry of cores,
and is mostly the truth. Of the solutions at the bound the one that leaves its pools most room tells rates and pools;
what is left is to put the threads of each pool on its cores, which the search's own model does. What comes of that is a
design like any other, which the analysis weighs; where it is at the bound nothing is better.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ortools.sat.python import cp_model

from dse.encode.linear import set_domain
from dse.encode.model import EncodedSpace
from dse.encode.neighbourhood import unnumbered
from dse.encode.pooled import Pool, add_pools
from dse.pareto.answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.pareto.neighbours import judged
from dse.pareto.regions import valued
from dse.pareto.settings import CUTTING, PLACE_WORK, POOL_WORK, RELAXED, ROOM_WORK

if TYPE_CHECKING:
    from dse.pareto.subproblem import Solver


class Pools:
    """The model of an encoded space in which the cores of the processors in `known` are pooled."""

    def __init__(self, encoded: EncodedSpace) -> None:
        contention = encoded.contention
        assert contention is not None and contention.without_rows is not None, "no core is full"
        self.known = frozenset(contention.known)
        self.model = contention.without_rows.clone()
        self.model.clear_hints()
        self.model.clear_objective()
        self.all: list[Pool] = []
        for processor in sorted(self.known):
            self.all += add_pools(self.model, contention, processor)

    def follow(self, encoded: EncodedSpace, weights: Sequence[int]) -> None:
        """Ask what is asked of the space: the same regions, options and objective."""
        mine, asked = self.model.proto, encoded.model.proto
        variables = [objective.variable for objective in encoded.objectives]
        switches = [switch.literal for switch in encoded.regions]
        options = [literal for literals in encoded.options for literal in literals]
        for variable in (*variables, *switches, *options):
            low, *_, high = asked.variables[variable.index].domain
            set_domain(mine.variables[variable.index], low, high)
        for switch in encoded.regions:
            for constraint in switch.constraints:
                low, *_, high = asked.constraints[constraint].linear.domain
                set_domain(mine.constraints[constraint].linear, low, high)
        self.model.minimize(self._sum(encoded, weights))

    def roomiest(self, encoded: EncodedSpace, weights: Sequence[int], most: int) -> cp_model.CpModel:
        """The solutions with a weighted sum of at most `most`, those first that leave most room."""
        model = self.model.clone()
        model.add(self._sum(encoded, weights) <= most)
        model.maximize(sum(pool.room for pool in self.all))
        return model

    def _sum(self, encoded: EncodedSpace, weights: Sequence[int]) -> cp_model.LinearExprT:
        return cp_model.LinearExpr.weighted_sum([item.variable for item in encoded.objectives], list(weights))

    def placing(self, encoded: EncodedSpace, solution: Sequence[int]) -> cp_model.CpModel:
        """The space's own model, its decisions but for cores as in a solution, each thread on a core of its pool."""
        contention = encoded.contention
        assert contention is not None, "no core is full"
        model = unnumbered(encoded)
        model.clear_objective()
        variables = model.proto.variables
        for decision, option in enumerate(encoded.design(solution)):
            if option >= 0 and decision not in contention.moved:
                set_domain(variables[encoded.options[decision][option].index], 1, 1)
        first: dict[tuple[int, ...], int] = {}  # which cores of a class are given to a pool already
        for pool in self.all:
            start = first.get(pool.cores, 0)
            mine = pool.cores[start : start + solution[pool.count.index]]
            first[pool.cores] = start + len(mine)
            for number, literals in pool.inside.items():
                if any(_is_true(solution, literal) for literal in literals):
                    for core, index in enumerate(contention.places.threads[number].cores[pool.processor], start=1):
                        if core not in mine and index not in (contention.places.true, -contention.places.true - 1):
                            set_domain(variables[index if index >= 0 else -index - 1], int(index < 0), int(index < 0))
        return model


def pooled(solver: Solver, best: Found | None) -> Answer:
    """The best design of the model as it stands, if pooled cores tell; what is proved is a bound of the solver, too.

    Better than `best`, which is the answer where nothing is.
    """
    encoded, weights = solver.encoded, solver.weights
    contention = encoded.contention
    if contention is None or contention.without_rows is None or weights is None or not contention.may_move:
        return Unfinished(best=best)
    if solver.pools is None or solver.pools.known != contention.known:
        solver.pools = Pools(encoded)
    pools = solver.pools
    if not pools.all:
        return Unfinished(best=best)
    pools.follow(encoded, weights)
    solution, is_refuted = _least(solver, pools, best)
    if is_refuted:
        return best or NoSuchDesign()
    if solution is None:
        return Unfinished(solver.least, best)
    most = _value(encoded, weights, solution)
    solution = _sketched(solver, pools.roomiest(encoded, weights, most), ROOM_WORK) or solution
    placed = _sketched(solver, pools.placing(encoded, solution), PLACE_WORK)
    found = None if placed is None else judged(encoded, placed)
    if found is None or not solver.is_wanted(found.point, best):
        return Unfinished(solver.least, best)
    return found if most <= (solver.least or 0) else Unfinished(solver.least, found)


def _least(solver: Solver, pools: Pools, best: Found | None) -> tuple[Sequence[int] | None, bool]:
    """The best solution of the pools that is better than `best`, and whether it is proved that there is none.

    A solver with presolve, in which solutions may be lost, finds one; one without proves that no better one is left.
    """
    assert solver.weights is not None, "nothing is minimised"
    top = solver.most(best)
    with valued(pools.model, solver.least, top):
        solution = _sketched(solver, pools.model, POOL_WORK)
    if solution is not None:
        top = solver.below(_value(solver.encoded, solver.weights, solution))
    if top is not None and top < (solver.least or 0):
        return solution, solution is None
    proof = solver.limited(RELAXED, POOL_WORK)
    with valued(pools.model, solver.least, top):
        status = solver.solved(proof, pools.model, RELAXED)
    if status == cp_model.INFEASIBLE:
        if solution is not None and top is not None:
            solver.raise_least(top + 1)
        return solution, solution is None
    solver.raise_least(proof.response_proto.inner_objective_lower_bound)
    return (solution if status == cp_model.UNKNOWN else list(proof.response_proto.solution)), False


def _sketched(solver: Solver, model: cp_model.CpModel, work: float) -> list[int] | None:
    """A good solution of a model, of which nothing is believed but that it is one."""
    run = solver.limited(CUTTING, work)
    run.parameters.cp_model_presolve = True
    status = solver.solved(run, model, CUTTING)
    return list(run.response_proto.solution) if status in (cp_model.OPTIMAL, cp_model.FEASIBLE) else None


def _value(encoded: EncodedSpace, weights: Sequence[int], solution: Sequence[int]) -> int:
    """The weighted sum of the objectives of a solution."""
    return weighted(weights, [solution[objective.variable.index] for objective in encoded.objectives])


def _is_true(solution: Sequence[int], literal: Any) -> bool:
    """Whether a literal, perhaps a negated one, is true in a solution."""
    index = literal.index
    return bool(solution[index]) if index >= 0 else not solution[-index - 1]
