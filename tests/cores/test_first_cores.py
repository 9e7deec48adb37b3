"""The first cores on which threads of two computers meet their limits, against a look at all cores in their order."""

from __future__ import annotations

import random
from itertools import product

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import build_limit
from dse.analysis.placement.heuristics import core_limits
from dse.analysis.placement.lexicographic import first_placement
from dse.space.model.space import Design
from tests.helpers.effort import cases
from tests.helpers.support import space_of

SURE = range(20)
"""The seeds of which looking is not given up, as it is where what threads pass on between computers decides."""
PROBLEM = """
dse: 1
name: first cores
deadlines: all
processor_types: {duo: {cores: 2}}
processors: {p: {type: duo}, q: {type: duo}}
threads:
%s
connections: {%s}
flows: {f: {path: [t0]}}
requirements: ['utilisation of p <= %d %%', 'utilisation of q <= %d %%']
objectives: [minimise latency of f]
"""


def drawn(rng: random.Random) -> str:
    """Three or four threads on each of two computers, some of them released by others, with little room."""
    lines, wires = [], []
    for number in range(rng.randint(6, 8)):
        period = rng.choice((5, 8, 10, 20))
        fields = [f"processor: {'pq'[number % 2]}", f"compute_execution_time: {rng.randint(3, 9) * period * 40} us"]
        if number and rng.random() < 0.4:
            fields += ["dispatch_protocol: aperiodic"]
            if rng.random() < 0.7:
                fields += [f"deadline: {rng.randint(8, 25)} ms"]
            wires.append(f"w{number}: {{from: t{rng.randrange(number)}, to: t{number}}}")
        else:
            fields += [f"period: {period} ms"]
        if rng.random() < 0.15:
            fields += [f"core: {rng.randint(1, 2)}"]
        lines.append(f"  t{number}: {{{', '.join(fields)}}}")
    return PROBLEM % ("\n".join(lines), ", ".join(wires), rng.randint(50, 80), rng.randint(50, 80))


def first_of_all(evaluator: Evaluator, design: Design) -> Design | None:
    places = [item.index for item in evaluator.space.open_cores]
    for cores in product((0, 1), repeat=len(places)):
        made = list(design)
        for place, core in zip(places, cores, strict=True):
            made[place] = core
        if evaluator.evaluate(tuple(made)).is_feasible:
            return tuple(made)
    return None


@pytest.mark.parametrize("seed", cases(100))
def test_they_are_the_first_of_all(seed: int) -> None:
    rng = random.Random(seed)
    evaluator = Evaluator(space_of(drawn(rng)))
    space = evaluator.space
    design: Design = tuple(0 for _ in space.decisions)
    beside = [build_limit(space, item) for item in space.requirements if item.metric.kind == "utilisation"]
    found, is_sure = first_placement(space, design, space.open_cores, core_limits(space), beside)
    assert found is not None or not is_sure or first_of_all(evaluator, design) is None
    assert found is None or found == first_of_all(evaluator, design)
    assert is_sure or seed not in SURE


def test_the_random_systems_are_worth_it() -> None:
    """Some have no cores at all, and the first are seldom the first of each computer alone without limits."""
    outcomes = set()
    for seed in range(12):
        evaluator = Evaluator(space_of(drawn(random.Random(seed))))
        found = first_of_all(evaluator, tuple(0 for _ in evaluator.space.decisions))
        outcomes.add(None if found is None else any(found))
    assert outcomes == {None, True}
