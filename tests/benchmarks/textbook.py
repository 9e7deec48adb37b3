"""The textbook loops: CP-SAT with its default parameters, no hints, no tightened domains, on a plain model or on ours.

MiniZinc's solvers run the same loops on the plain model (`minizinc.py`).

The plain model is what a textbook would write for the same problem: a literal for every case of a table and for every
pair of a coefficient and a rate (our encoder with the reductions of decision record 6 off). Neither model has the
switches for several regions (decision record 4). Only the two steps that lose solutions are off for the peer too, or
its fronts would be wrong.

* One objective: minimise it.
* Two: the lexicographic epsilon-constraint method (Chankong and Haimes 1983; Mavrotas 2009 for why lexicographic):
  minimise the first, then the second at that value, then ask for better values of the second; two calls for each
  point, one to end.
* Three and more: minimise the sum of the objectives; cut off what the point dominates by a clause over one literal per
  objective (guided improvement and P-minimal search without their refinements); one call for each point, one to end.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.encode.model import EncodedSpace, encode
from dse.encode.tuning import AdditiveTables, ModelTuning, RegionUnions, SharedForms

from .asking import Ask, OutOfTime, Vector

PLAIN = ModelTuning(SharedForms(is_on=False), AdditiveTables(is_on=False), RegionUnions(is_on=False))
OURS = ModelTuning(region_unions=RegionUnions(is_on=False))


def textbook_front(
    evaluator: Evaluator,
    limit_s: float,
    ask: Ask,
    model: str = "our",
    also: Callable[[Ask, EncodedSpace], Ask] = lambda ask, _: ask,
) -> dict[str, Any]:
    """The front as minimised values, whether it is proved, the number of calls, and the seconds with encoding.

    `also` may add to the model, and to how it is asked.
    """
    started = time.perf_counter()
    encoded = encode(evaluator, PLAIN if model == "plain" else OURS)
    ask = also(ask, encoded)
    variables = [objective.variable for objective in encoded.objectives]
    points: list[Vector] = []
    calls = 0

    def solve(objective: Any) -> Vector | None:
        nonlocal calls
        calls += 1
        left = limit_s - (time.perf_counter() - started)
        if left <= 0:
            raise OutOfTime
        encoded.model.minimize(objective)
        return ask(encoded.model, variables, left)

    loop = _by_two if len(variables) == 2 else _by_sum
    try:
        loop(encoded.model, variables, solve, points)
        is_complete = True
    except OutOfTime:
        is_complete = False
    elapsed_s = time.perf_counter() - started
    values = [
        tuple(item.offset + item.step * value for item, value in zip(encoded.objectives, point, strict=True))
        for point in points
    ]
    return {"front": sorted(values), "is_complete": is_complete, "calls": calls, "seconds": elapsed_s}


def _by_two(model: Any, variables: list[Any], solve: Callable[[Any], Vector | None], points: list[Vector]) -> None:
    one, other = variables
    while (first := solve(one)) is not None:
        domain = model.proto.variables[one.index].domain
        before = list(domain)
        _set(domain, [first[0], first[0]])
        point = solve(other)
        assert point is not None
        points.append(point)
        _set(domain, before)
        model.add(other <= point[1] - 1)


def _set(domain: Any, bounds: list[int]) -> None:
    domain.clear()
    domain.extend(bounds)


def _by_sum(model: Any, variables: list[Any], solve: Callable[[Any], Vector | None], points: list[Vector]) -> None:
    while (point := solve(sum(variables))) is not None:
        points.append(point)
        better = []
        for variable, value in zip(variables, point, strict=True):
            literal = model.new_bool_var("")
            model.add(variable <= value - 1).only_enforce_if(literal)
            better.append(literal)
        model.add_bool_or(better)
