"""Designs made better near a known one where threads wait for each other, against looking at every design there."""

from __future__ import annotations

from itertools import product
from random import Random

import pytest

from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.encode.scheduling import waiting_forms
from dse.search.solver.large_neighbourhood import improved
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Found
from dse.space.model.space import Design
from tests.helpers.effort import cases
from tests.helpers.support import space_of
from tests.helpers.thread_systems import draw, text_of
from tests.helpers.tuned import tune


def neighbours(evaluator: Evaluator, design: Design, core: int) -> list[Design]:
    """The designs in which threads on other cores than one have what they have in a design.

    Written anew from the names of the decisions: ``thread.core`` and the like.
    """
    space = evaluator.space
    held = {
        decision.component
        for decision, option in zip(space.decisions, design, strict=True)
        if decision.field == "core" and option != core
    }
    options = [
        [option] if decision.component in held else range(len(decision.options))
        for decision, option in zip(space.decisions, design, strict=True)
    ]
    return list(product(*options))


def test_the_best_of_the_neighbours_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of several systems, some of which have threads on more than one core."""
    assert sum(compared_neighbours(seed, monkeypatch) for seed in cases(8)) > 0


def compared_neighbours(seed: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """One core at a time: the best design is as good as the best neighbour of each core, asked in this order.

    And nothing that is true of these only is left behind: no bound, and no option that is held.
    """
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    tune(monkeypatch, improving={"work": ((1, 10.0),)})
    text = text_of(draw(seed, kind="chained")).replace("processing: execution_time", "processing: response_time")
    evaluator = Evaluator(space_of(text))
    encoded, rng = encode(evaluator), Random(seed)
    latency = len(encoded.objectives) - 1
    strategy = Strategy(encoded)
    strategy.weights = [int(number == latency) for number in range(len(encoded.objectives))]
    encoded.model.minimize(encoded.objectives[latency].variable)
    domains = [list(variable.domain) for variable in encoded.model.proto.variables]
    compared = 0
    for _ in range(200):
        design = tuple(rng.randrange(len(decision.options)) for decision in evaluator.space.decisions)
        point = encoded.weigh(design)
        if point is None or not evaluator.space.open_cores:
            continue
        found = improved(strategy, Found(point, design))
        assert encoded.weigh(found.design) == found.point
        assert found.point[latency] <= point[latency]
        cores = sorted({design[item.index] for item in evaluator.space.open_cores})
        if len(cores) > 1:
            near = [encoded.weigh(other) for other in neighbours(evaluator, design, cores[0])]
            assert found.point[latency] <= min(other[latency] for other in near if other is not None)
            compared += 1
        assert strategy.least is None
        assert [list(variable.domain) for variable in encoded.model.proto.variables][: len(domains)] == domains
        if compared > 3:
            break
    return compared
