"""Good designs of cores that are nearly full, which are built from others."""

from __future__ import annotations

import pytest

from dse.analysis.evaluate import Evaluator
from dse.encode.linear import set_domain
from dse.encode.model import encode
from dse.encode.scheduling.neighbourhoods import neighbourhood, threads_by_core, unnumbered
from dse.search.front import search_front
from dse.search.lexicographic import claimed_by
from dse.search.regions import RefutedRegions
from dse.search.solver import bounding, subspaces
from dse.search.solver import solver as subproblem
from dse.search.solver.neighbours import neighbour
from dse.search.solver.settings import BARE, BUILD_WORK, BUILDING, OPTIONS_FIRST, RELAXED, Settings, sound_solver
from dse.search.solver.solver import Solver
from dse.search.solver_answer import Answer, Found, Unfinished
from tests.benchmarks.cases import nearly_full
from tests.helpers.effort import cases
from tests.helpers.support import space_of


def solver_of(evaluator: Evaluator) -> Solver:
    """A solver that minimises the latency, and whose model has learnt rows from a design that fits no cores."""
    solver = Solver(encode(evaluator))
    full = tuple(0 for _ in evaluator.space.decisions)
    assert solver.encoded.settled(full, lambda _: 0) is None
    assert solver.encoded.contention is not None
    assert solver.encoded.contention.known
    solver.encoded.model.minimize(solver.encoded.objectives[1].variable)
    return solver


def crowded(threads: int, cores: int, seed: int) -> Evaluator:
    return Evaluator(space_of(nearly_full(threads, cores, 0.8, seed)))


@pytest.mark.parametrize("seed", cases(2, first=1))
def test_what_is_built_is_a_design(seed: int) -> None:
    """It has the figures that it is said to have, meets its deadlines, and is no better than the front."""
    evaluator = crowded(9, 3, seed)
    solver = solver_of(evaluator)
    found = neighbour(solver, 0, BUILD_WORK)
    assert found is not None
    evaluation = evaluator.evaluate(found.design)
    assert evaluation.is_feasible
    assert evaluation.objectives == claimed_by(evaluator, solver.encoded, found.point)
    assert evaluation.objectives[1] >= min(point[1] for point in search_front(evaluator).points)


def test_what_was_built_is_not_built_again() -> None:
    solver = solver_of(crowded(9, 3, 1))
    first, before = neighbour(solver, 0, BUILD_WORK), solver.work
    assert neighbour(solver, 0, BUILD_WORK) == first
    assert solver.work == before
    assert first is not None
    solver.exclude(first.design)
    again = neighbour(solver, 0, BUILD_WORK)
    assert solver.work > before
    assert again is None or again.design != first.design


def test_the_others_stay_as_they_are() -> None:
    """Only the threads of two cores get other rates, and no others come to these."""
    solver = solver_of(crowded(9, 3, 1))
    contention = solver.encoded.contention
    assert contention is not None
    model, places = unnumbered(solver.encoded), contention.places
    run = sound_solver()
    run.solve(model)
    solution = list(run.response_proto.solution)
    threads = threads_by_core(places, solution)
    cores = [core for core, members in threads.items() if members][:2]
    free = threads[cores[0]] | threads[cores[1]]
    run.solve(neighbourhood(places, model, solution, cores, free))
    other = list(run.response_proto.solution)
    moved = threads_by_core(places, other)
    assert moved[cores[0]] | moved[cores[1]] == free
    assert all(moved[core] == threads[core] for core in threads if core not in cores)
    for number in places.threads.keys() - free:
        assert all(solution[index] == other[index] for index, _ in places.threads[number].rates or ())


def test_cores_may_be_numbered_in_any_order() -> None:
    """Of equal cores the search numbers those first whose threads come first; what is built need not."""
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
    solver = Solver(encode(evaluator))
    regions, weights = [solver.encoded.everywhere], [0, 1]
    solver._set_objective(weights)
    bounds = []
    for part in solver.parts.all:
        answer = solver.solve_part(part, (RELAXED, 10.0), weights, regions, None)
        assert not isinstance(answer, Unfinished) or answer.bound
        built = solver.solve_part(part, (BUILDING, 10.0), weights, regions, None)
        if isinstance(built, Found) and isinstance(answer, Unfinished):
            bounds.append((answer.bound, built.point[1]))
    assert bounds
    assert all(bound is not None and bound <= value for bound, value in bounds)


HURRIED = 1e-6
"""Work in which nothing is answered."""


@pytest.mark.parametrize("seed", cases(1, first=1))
def test_the_front_is_that_without(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a design is built for each range of values that a part is asked for."""
    evaluator = crowded(8, 2, seed)
    expected = search_front(evaluator).points.keys()
    once, built = Solver.once, []

    def hurried(
        self: Solver, settings: Settings, work: float, best: Found | None, most: int | None
    ) -> tuple[Answer | None, Found | None]:
        return (Unfinished(best=best), best) if work <= HURRIED else once(self, settings, work, best, most)

    def noted(solver: Solver, least: int, work: float) -> Found | None:
        found = neighbour(solver, least, work)
        built.append(found)
        return found

    monkeypatch.setattr(Solver, "once", hurried)
    monkeypatch.setattr(bounding, "AT_ONCE", HURRIED)
    monkeypatch.setattr(bounding, "neighbour", noted)
    monkeypatch.setattr(bounding, "pooled", lambda _, best: Unfinished(best=best))
    monkeypatch.setattr(subproblem, "BARE_FIRST", HURRIED)
    monkeypatch.setattr(subspaces, "BRIEF", (BARE, HURRIED))
    monkeypatch.setattr(subspaces, "PACKING_WAYS", (RELAXED,))
    assert search_front(evaluator).points.keys() == expected
    assert any(built)


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
    solver = Solver(encode(evaluator))
    regions, weights = [solver.encoded.everywhere], [0, 1]
    solver._set_objective(weights)
    for part in solver.parts.all:
        answers = []
        for settings in (RELAXED, OPTIONS_FIRST):
            solver.solve_part(part, (BUILDING, 10.0), weights, regions, None)  # so that there are rows
            part.refuted, part.found = RefutedRegions(), []
            answers.append(solver.solve_part(part, (settings, 10.0), weights, regions, None))
            assert not solver.encoded.model.proto.search_strategy
        one, other = answers
        assert type(one) is type(other)
        assert not isinstance(one, Found) or (isinstance(other, Found) and one.point[1] == other.point[1])
        assert not isinstance(one, Unfinished)
