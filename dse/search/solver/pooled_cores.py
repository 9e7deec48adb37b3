"""The best design where cores are nearly full, by way of a model in which interchangeable cores are pooled.

There (`dse.encode.scheduling.pooled_cores`, decision record 8) a bound takes a fraction of a second, as there is no
symmetry of cores, and is mostly the truth. Of the solutions at the bound the one that leaves its pools most room tells
rates and pools; what is left is to put the threads of each pool on its cores, which the search's own model does. What
comes of that is a design like any other, which the analysis weighs; where it is at the bound nothing is better.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from ortools.sat.python import cp_model

from dse.encode.linear import set_domain
from dse.encode.model import EncodedSpace
from dse.encode.scheduling.pooled_cores import Pool, add_pools, classes_of
from dse.search.regions import valued
from dse.search.solver.call import Call
from dse.search.solver.settings import CUTTING, RELAXED
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.search.tuning import PooledCores


class Pools:
    """The model of an encoded space in which the cores of the processors in `known` are pooled.

    `tried` has the questions whose bound is known, and no design at it.
    """

    def __init__(self, encoded: EncodedSpace, tuning: PooledCores) -> None:
        contention = encoded.contention
        assert contention is not None and contention.without_rows is not None, "no core is full"
        self.known = frozenset(contention.known)
        self.tried: set[tuple[object, ...]] = set()
        self._shared = len(contention.without_rows.proto.variables)  # so many it has in common with the space's own
        self._base = contention.without_rows.clone()
        self._base.clear_hints()
        self._base.clear_objective()
        self._classes = [
            item
            for processor in sorted(self.known)
            for item in classes_of(self._base, contention, processor, few=tuning.few_kinds, most=tuning.most_kinds)
        ]
        self._build()

    def _build(self) -> None:
        self.model = self._base.clone()
        self.all: list[Pool] = [pool for item in self._classes for pool in add_pools(self.model, item)]

    def split(self, solution: Sequence[int]) -> bool:
        """Make kinds of cores finer where a solution takes more room than there is; whether there were any.

        True where the model was built anew and is worth another question.
        """
        finer = False
        for item in self._classes:
            used = [pool for pool in self.all if pool.of is item and solution[pool.count.index]]
            finer |= item.kinds.split({pool.kind: partial(pool.share, solution) for pool in used})
        if finer:
            self._build()
        return finer

    def follow(self, encoded: EncodedSpace, weights: Sequence[int]) -> None:
        """Ask what is asked of the space: the same regions, objective, and domains of all variables that it has.

        Domains are copied, so that pools answer exactly the question that was asked of the space.
        """
        mine, proto = self.model.proto, encoded.model.proto
        for index in range(self._shared):  # whatever was fixed when the model was kept
            known, wanted = mine.variables[index].domain, list(proto.variables[index].domain)
            if list(known) != wanted:
                known.clear()
                known.extend(wanted)
        for switch in encoded.regions:
            for constraint in switch.constraints:
                low, *_, high = proto.constraints[constraint].linear.domain
                set_domain(mine.constraints[constraint].linear, low, high)
        self.model.minimize(self._sum(encoded, weights))

    def _roomiest(self, encoded: EncodedSpace, weights: Sequence[int], most: int) -> cp_model.CpModel:
        """The solutions with a weighted sum of at most `most`, those first that leave most room."""
        model = self.model.clone()
        model.add(self._sum(encoded, weights) <= most)
        model.maximize(sum(pool.room for pool in self.all))
        return model

    def _sum(self, encoded: EncodedSpace, weights: Sequence[int]) -> cp_model.LinearExprT:
        return cp_model.LinearExpr.weighted_sum([item.variable for item in encoded.objectives], list(weights))

    def _placing(self, encoded: EncodedSpace, solution: Sequence[int]) -> cp_model.CpModel:
        """The space's own model, its decisions but for cores as in a solution, each thread on a core of its pool."""
        contention = encoded.contention
        assert contention is not None, "no core is full"
        model = unnumbered(encoded)
        model.clear_objective()
        variables = model.proto.variables
        for decision, option in enumerate(encoded.design(solution)):
            if option >= 0 and decision not in contention.moved:
                set_domain(variables[encoded.options[decision][option].index], 1, 1)
        cores_of_class: Counter[int] = Counter()  # how many cores of a class
        true = contention.places.true
        for pool in self.all:
            start = cores_of_class[id(pool.of)]
            mine = pool.of.cores[start : start + solution[pool.count.index]]
            cores_of_class[id(pool.of)] += len(mine)
            for number in pool.threads(solution):
                columns = contention.places.threads[number].cores[pool.of.rows.processor]
                for core, index in enumerate(columns, start=1):
                    if core not in mine and index not in (true, -true - 1):
                        set_domain(variables[index if index >= 0 else -index - 1], int(index < 0), int(index < 0))
        return model


@dataclass
class PoolMemory:
    """The pools of one model, made when its cores are known to be full, and anew when more of them are.

    Building pools takes longer than most questions, so that one model is kept.
    """

    pools: Pools | None = None

    def of(self, encoded: EncodedSpace, tuning: PooledCores) -> Pools:
        """The pools of the model as it stands.

        Built anew when more clauses about full cores are known.
        """
        assert encoded.contention is not None, "no core is full"
        if self.pools is None or self.pools.known != encoded.contention.known:
            self.pools = Pools(encoded, tuning)
        return self.pools


def pooled(call: Call, memory: PoolMemory, best: Found | None) -> Answer:
    """The best design of the model as it stands, if pooled cores tell; what is proved is a bound of the solver, too.

    Better than `best`, which is the answer where nothing is.
    """
    encoded, weights, tuning = call.encoded, call.weights, call.tuning.pooled_cores
    contention = encoded.contention
    if not tuning.is_on or contention is None or contention.without_rows is None or weights is None:
        return Unfinished(best=best)
    if not contention.may_move:
        return Unfinished(best=best)
    pools = memory.of(encoded, tuning)
    question = (tuple(weights), call.within, call.least, call.most(best))
    if not pools.all or question in pools.tried:
        return Unfinished(call.least, best)
    for _ in range(tuning.most_rounds):
        pools.follow(encoded, weights)
        solution, is_refuted = _least(call, pools, best)
        if is_refuted:
            return best or NoSuchDesign()
        if solution is None or call.out_of_time():
            return Unfinished(call.least, best)
        least = _value(encoded, weights, solution)
        solution = _sketched(call, pools._roomiest(encoded, weights, least), tuning.room_work) or solution
        if least > (call.least or 0) or not pools.split(solution):  # what is hard enough is not made harder
            break
    else:
        pools.follow(encoded, weights)
        solution = None
    better = _placed(call, pools, least, solution, best)
    if better is None or weighted(weights, better.point) > (call.least or 0):
        pools.tried.add((tuple(weights), call.within, call.least, call.most(better or best)))
        return Unfinished(call.least, better or best)
    return better


def _placed(call: Call, pools: Pools, least: int, known: Sequence[int] | None, best: Found | None) -> Found | None:
    """A design whose threads are put on the cores of their pools, with the least value if there is one, else one near.

    The more its value may be above the least, the more room there is; `known` is the solution that leaves most at it.
    """
    encoded, weights, top, tuning = call.encoded, call.weights, call.most(best), call.tuning.pooled_cores
    assert weights is not None, "nothing is minimised"
    step = max(call.above(least) - least, least // tuning.finest)
    for more in tuning.more_steps:
        most = least + more * step
        if call.out_of_time() or (top is not None and most > top):
            return None
        solution, known = known or _sketched(call, pools._roomiest(encoded, weights, most), tuning.room_work), None
        placed = None if solution is None else _sketched(call, pools._placing(encoded, solution), tuning.place_work)
        judged = None if placed is None else _judged(encoded, placed)
        if placed is not None and judged is not None and call.is_wanted(judged.point, best):
            return judged
    return None


def unnumbered(encoded: EncodedSpace) -> cp_model.CpModel:
    """The model as it stands, wherever its objectives lie, and with the cores of a processor in any order.

    A copy without symmetry breaking between cores and without bounds of objectives, from which pools are made.
    """
    assert encoded.contention is not None, "nothing is asked about response times"
    model = encoded.model.clone()
    model.clear_hints()
    for clause in encoded.contention.numbering:
        model.proto.constraints[clause].bool_or.literals.append(encoded.contention.places.true)
    for objective in encoded.objectives:
        set_domain(model.proto.variables[objective.variable.index], 0, objective.size)
    for switch in encoded.regions:
        for constraint, objective in zip(switch.constraints, encoded.objectives, strict=True):
            set_domain(model.proto.constraints[constraint].linear, 0, objective.size)
    return model


def _judged(encoded: EncodedSpace, solution: Sequence[int]) -> Found | None:
    """The design of a solution with its figures, as the analysis accepts it."""
    point = tuple(solution[objective.variable.index] for objective in encoded.objectives)
    settled = encoded.settled(encoded.design(solution), lambda variable: solution[variable.index], is_best=False)
    return None if settled is None else Found(point, settled)


def _least(call: Call, pools: Pools, best: Found | None) -> tuple[Sequence[int] | None, bool]:
    """The best solution of the pools that is better than `best`, and whether it is proved that there is none.

    A solver with presolve, in which solutions may be lost, finds one; one without proves that no better one is left.
    """
    assert call.weights is not None, "nothing is minimised"
    top, work = call.most(best), call.tuning.pooled_cores.solve_work
    if top is not None and top < (call.least or 0):
        return None, True
    with valued(pools.model, call.least, top):
        solution = _sketched(call, pools.model, work)
    if solution is not None:
        top = call.below(_value(call.encoded, call.weights, solution))
    if top is not None and top < (call.least or 0):
        return solution, solution is None
    proof = call.limited(RELAXED, work)
    with valued(pools.model, call.least, top):
        status = call.solved(proof, pools.model, RELAXED)
    if status == cp_model.INFEASIBLE:
        if solution is not None and top is not None:
            call.raise_least(top + 1)
        return solution, solution is None
    call.raise_least(proof.response_proto.inner_objective_lower_bound)
    return (solution if status == cp_model.UNKNOWN else list(proof.response_proto.solution)), False


def _sketched(call: Call, model: cp_model.CpModel, work: float) -> list[int] | None:
    """A good solution of a model, of which nothing is believed but that it is one."""
    run = call.limited(CUTTING, work)
    run.parameters.cp_model_presolve = True
    status = call.solved(run, model, CUTTING)
    return list(run.response_proto.solution) if status in (cp_model.OPTIMAL, cp_model.FEASIBLE) else None


def _value(encoded: EncodedSpace, weights: Sequence[int], solution: Sequence[int]) -> int:
    """The weighted sum of the objectives of a solution."""
    return weighted(weights, [solution[objective.variable.index] for objective in encoded.objectives])
