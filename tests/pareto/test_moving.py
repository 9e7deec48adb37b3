"""Threads on other cores, where the response times of a solution were longer than its model knew."""

from __future__ import annotations

from itertools import product
from random import Random

import pytest
from effort import cases
from support import space_of
from thread_systems import draw, text_of

from dse.analysis.evaluate import Evaluator
from dse.encode import scheduled
from dse.encode.model import encode
from dse.pareto.moving import moved
from dse.pareto.subproblem import Solver
from dse.space.types import Design


def with_options_of(evaluator: Evaluator, design: Design) -> list[Design]:
    """The design on all cores."""
    cores = {item.index for item in evaluator.space.open_cores}
    decisions = enumerate(evaluator.space.decisions)
    return list(product(*(range(len(one.options)) if at in cores else [design[at]] for at, one in decisions)))


@pytest.mark.parametrize("seed", cases(6))
def test_the_best_cores_for_given_options_are_found(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """And nothing that is true of these options only is left behind: no bound, and no option that is held."""
    monkeypatch.setattr(scheduled, "SCHEDULE_CASE_LIMIT", 1)
    text = text_of(draw(seed)).replace("deadlines: all", "deadlines: all\nprocessing: response_time")
    evaluator = Evaluator(space_of(text))
    encoded, rng = encode(evaluator), Random(seed)
    assert encoded.is_loose
    solver = Solver(encoded)
    latency = len(encoded.objectives) - 1
    solver.weights = [int(number == latency) for number in range(len(encoded.objectives))]
    encoded.model.minimize(encoded.objectives[latency].variable)
    domains = [list(variable.domain) for variable in encoded.model.proto.variables]
    for _ in range(5):
        design = tuple(rng.randrange(len(decision.options)) for decision in evaluator.space.decisions)
        known = [encoded.weigh(other) for other in with_options_of(evaluator, design)]
        best = min((point[latency] for point in known if point is not None), default=None)
        best = best if evaluator.space.open_cores else None  # with one core there is nothing to move
        found = moved(solver, design, None, None)
        assert (found and found.point[latency]) == best
        assert solver.least is None
        assert [list(variable.domain) for variable in encoded.model.proto.variables][: len(domains)] == domains
