"""pymoo's NSGA-II and NSGA-III on the vectorised evaluation function.

Set up as pymoo's documentation says for integers: SBX and polynomial mutation with rounding, duplicates removed. In its
favour: the baseline is in the first population, so that feasible designs are known from the start; the clock starts
after imports and tables; every feasible non-dominated design ever evaluated counts, not only the last population.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from dse.analysis.evaluate import Evaluator
from tests.benchmarks.vectorised import VectorisedEvaluator

from .fronts import non_dominated

POPULATION = 100


def genetic_front(evaluator: Evaluator, limit_s: float, seed: int, algorithm: str) -> dict[str, Any]:
    """What ``nsga2`` or ``nsga3`` finds in a time limit: minimised values, number of evaluated designs."""
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize
    from pymoo.termination import get_termination

    space = evaluator.space
    tables = VectorisedEvaluator(evaluator)
    open_decisions = [index for index, item in enumerate(space.decisions) if item.is_open]
    signs = np.array([-1 if item.sense == "maximise" else 1 for item in space.objectives])
    start = np.array([[space.baseline.get(index, 0) for index in open_decisions]])
    archive: list[Any] = []
    evaluated = 0

    class Designs(Problem):  # type: ignore[misc, unused-ignore]
        def __init__(self) -> None:
            most = [len(space.decisions[index].options) - 1 for index in open_decisions]
            super().__init__(
                n_var=len(open_decisions), n_obj=len(signs), n_ieq_constr=2, xl=0, xu=np.array(most), vtype=int
            )

        def _evaluate(self, x: Any, out: dict[str, Any], *_: Any, **__: Any) -> None:
            nonlocal evaluated
            evaluated += len(x)
            designs = np.zeros((len(x), len(space.decisions)), dtype=np.int64)
            designs[:, open_decisions] = x
            batch = tables.evaluate(designs)
            values = batch.objectives * signs
            feasible = batch.is_feasible
            if feasible.any():
                archive.append(non_dominated(values[feasible]))
            excess = batch.excess.astype(float)
            scale = np.maximum(1.0, excess.max(axis=0, initial=0.0))
            out["F"] = values.astype(float)
            out["G"] = np.stack([(~batch.is_valid).astype(float), (excess / scale).sum(axis=1)], axis=1)

    made = _algorithm(algorithm, len(signs), start, seed)
    started = time.perf_counter()
    minimize(Designs(), made, get_termination("time", limit_s), seed=seed, verbose=False)
    seconds = time.perf_counter() - started
    front = non_dominated(np.concatenate(archive)) if archive else np.zeros((0, len(signs)), dtype=np.int64)
    return {"front": [tuple(map(int, row)) for row in front], "seconds": seconds, "designs": evaluated}


def _algorithm(name: str, objectives: int, start: Any, seed: int) -> Any:
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.algorithms.moo.nsga3 import NSGA3
    from pymoo.core.sampling import Sampling
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.operators.mutation.pm import PM
    from pymoo.operators.repair.rounding import RoundingRepair
    from pymoo.operators.sampling.rnd import IntegerRandomSampling
    from pymoo.util.ref_dirs import get_reference_directions

    class WithBaseline(Sampling):  # type: ignore[misc, unused-ignore]
        def _do(self, problem: Any, n_samples: int, **kwargs: Any) -> Any:
            drawn = IntegerRandomSampling()._do(problem, n_samples, **kwargs)
            drawn[0] = start[0]
            return drawn

    operators = {
        "sampling": WithBaseline(),
        "crossover": SBX(prob=1.0, eta=3.0, vtype=float, repair=RoundingRepair()),
        "mutation": PM(prob=1.0, eta=3.0, vtype=float, repair=RoundingRepair()),
        "eliminate_duplicates": True,
    }
    if name == "nsga2":
        return NSGA2(pop_size=POPULATION, **operators)
    directions = get_reference_directions("energy", objectives, POPULATION - 8, seed=seed)
    return NSGA3(ref_dirs=directions, pop_size=POPULATION, **operators)
