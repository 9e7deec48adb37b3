"""Models of cores that are nearly full: rows of levels, numbers of cores, and bounds."""

from __future__ import annotations

import pytest

from dse.analysis.evaluate import Evaluator
from dse.encode.linear import set_domain
from dse.encode.model import encode
from dse.search.regions import RefutedRegions
from dse.search.solver.pooled_cores import unnumbered
from dse.search.solver.settings import OPTIONS_FIRST, POOLING, RELAXED, sound_solver
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Found, Unfinished
from tests.benchmarks.cases import nearly_full
from tests.helpers.support import space_of


def solver_of(evaluator: Evaluator) -> Strategy:
    """A solver that minimises the latency, and whose model has learnt rows from a design that fits no cores."""
    strategy = Strategy(encode(evaluator))
    full = tuple(0 for _ in evaluator.space.decisions)
    assert strategy.encoded.settled(full, lambda _: 0) is None
    assert strategy.encoded.contention is not None
    assert strategy.encoded.contention.known
    strategy.encoded.model.minimize(strategy.encoded.objectives[1].variable)
    return strategy


def crowded(threads: int, cores: int, seed: int) -> Evaluator:
    return Evaluator(space_of(nearly_full(threads, cores, 0.8, seed)))


def test_cores_may_be_numbered_in_any_order() -> None:
    """Of equal cores the search numbers those first whose threads come first; pooled cores need not."""
    encoded = solver_of(crowded(6, 2, 1)).encoded
    assert encoded.contention is not None
    places, model = encoded.contention.places, unnumbered(encoded)
    processor = encoded.contention.known.copy().pop()
    last = places.on(processor)[0].cores[processor][-1]
    for asked, is_there in ((encoded.model, False), (model, True)):
        set_domain(asked.proto.variables[last], 1, 1)
        run = sound_solver()
        status = run.solve(asked)
        assert (run.status_name(status) != "INFEASIBLE") == is_there


def test_an_optimum_that_fits_no_cores_is_a_bound() -> None:
    """Before a model has rows its optimum is too low; no design is below it all the same."""
    evaluator = crowded(9, 3, 1)
    strategy = Strategy(encode(evaluator))
    regions, weights = [strategy.encoded.everywhere], [0, 1]
    strategy._set_objective(weights)
    bounds = []
    for part in strategy.parts.all:
        answer = strategy.solve_part(part, (RELAXED, 10.0), weights, regions, None)
        assert not isinstance(answer, Unfinished) or answer.bound
        pooled = strategy.solve_part(part, (POOLING, 10.0), weights, regions, None)
        if isinstance(pooled, Found) and isinstance(answer, Unfinished):
            bounds.append((answer.bound, pooled.point[1]))
    assert bounds
    assert all(bound is not None and bound <= value for bound, value in bounds)


@pytest.mark.parametrize("late", [False, True])
def test_rows_of_levels_hold_without_a_condition_where_all_must_be_in_time(late: bool) -> None:
    """Where one that is more urgent may be late, a level without a thread says nothing of those above it."""
    text = nearly_full(9, 3, 0.8, 1)
    if late:
        text = text.replace("deadlines: all", "deadlines: stated").replace(", period:", ", deadline: 40 ms, period:", 8)
    encoded = solver_of(Evaluator(space_of(text))).encoded
    constraints = encoded.model.proto.constraints
    rooms = {index for item in constraints if item.has_linear() for index in item.enforcement_literal}
    clauses = [list(item.bool_or.literals) for item in constraints if item.has_bool_or()]
    choices = [literals for literals in clauses if len(rooms.intersection(literals)) > 1]
    assert choices
    assert any(min(literals) < 0 for literals in choices) is late


def test_rates_before_cores_give_the_same_answer() -> None:
    """And the model is left without an order of decisions."""
    evaluator = crowded(9, 3, 1)
    strategy = Strategy(encode(evaluator))
    regions, weights = [strategy.encoded.everywhere], [0, 1]
    strategy._set_objective(weights)
    for part in strategy.parts.all:
        answers = []
        for settings in (RELAXED, OPTIONS_FIRST):
            strategy.solve_part(part, (POOLING, 10.0), weights, regions, None)  # so that there are rows
            part.refuted, part.found = RefutedRegions(), []
            answers.append(strategy.solve_part(part, (settings, 10.0), weights, regions, None))
            assert not strategy.encoded.model.proto.search_strategy
        one, other = answers
        assert type(one) is type(other)
        assert not isinstance(one, Found) or (isinstance(other, Found) and one.point[1] == other.point[1])
        assert not isinstance(one, Unfinished)
