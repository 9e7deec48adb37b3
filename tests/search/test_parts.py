"""Questions answered part by part, with what earlier ones proved, have the answers that they have as a whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import product
from operator import le
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dse.analysis.evaluate import Evaluator
from dse.encode.model import EncodedSpace, encode
from dse.questions.problem import loads
from dse.search import tuning
from dse.search.front import search_front
from dse.search.lexicographic import signed
from dse.search.regions import Bound, strictly_inside
from dse.search.solver import strategy
from dse.search.solver.bounding import lowest
from dse.search.solver.call import Call
from dse.search.solver.pooled_cores import PoolMemory
from dse.search.solver.settings import BARE, CUTTING, LOWEST, SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver.subspaces import AllSubspaces, Apart, Subspace
from dse.search.solver.value_grid import EVERY, Grid, weighted_grid
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from tests.benchmarks.cases import nearly_full
from tests.helpers.effort import cases
from tests.helpers.support import PROBLEMS, load_space, raw_designs
from tests.helpers.tuned import tune

BY_NAME = {path.stem: path for path in PROBLEMS}
Point = tuple[int, ...]


def evaluator_with_parts(name: str, monkeypatch: pytest.MonkeyPatch) -> Evaluator:
    tune(monkeypatch, shared_forms={"shared_by": 1})
    evaluator = Evaluator(load_space(BY_NAME[name]))
    assert len(AllSubspaces(encode(evaluator), tuning.DEFAULT)) > 1
    return evaluator


def too_hard_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """No settings ever finish on a question to be minimised as a whole."""
    monkeypatch.setattr(Strategy, "_solve_whole", lambda self, settings, work: Unfinished())


@pytest.mark.parametrize("is_brief_too_short", [False, True])
@pytest.mark.parametrize("name", ["types", "protocols", "derived"])
def test_the_front_is_the_same_part_by_part(
    name: str, is_brief_too_short: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluator = evaluator_with_parts(name, monkeypatch)
    expected = search_front(evaluator)
    within, asked = Strategy.run_within, []

    def part(self: Strategy, part: Subspace, settings: SolverSettings, work: float, least: int = 0) -> Answer:
        asked.append(part)
        answer = within(self, part, settings, work, least)
        if is_brief_too_short and settings is BARE and work < 1:
            return Unfinished(best=answer if isinstance(answer, Found) else None)
        return answer

    too_hard_as_a_whole(monkeypatch)
    monkeypatch.setattr(Strategy, "run_within", part)
    search = search_front(evaluator)
    assert asked
    assert search.points == expected.points
    assert search.is_complete


def test_the_model_is_left_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    encoded = encode(evaluator_with_parts("types", monkeypatch))
    solver = Strategy(encoded)
    weights = [1] * len(encoded.objectives)
    whole = solver.minimise(weights, [encoded.everywhere])
    before = encoded.model.clone()
    too_hard_as_a_whole(monkeypatch)
    subspaces = solver.minimise(weights, [encoded.everywhere])
    assert isinstance(whole, Found)
    assert isinstance(subspaces, Found)
    assert sum(subspaces.point) == sum(whole.point)
    encoded.model.clear_hints()  # each question has its own
    assert str(encoded.model.proto) == str(before.proto)


def test_what_is_known_of_the_parts_answers_without_the_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same question again; and one for a smaller region that still has the answer."""
    encoded = encode(evaluator_with_parts("types", monkeypatch))
    too_hard_as_a_whole(monkeypatch)
    solver = Strategy(encoded)
    first = solver.minimise([1, 0, 0], [encoded.everywhere])
    assert isinstance(first, Found)
    runs = count_runs(monkeypatch)
    assert solver.minimise([1, 0, 0], [encoded.everywhere]) == first
    smaller = tuple(value + 1 for value in first.point)
    assert solver.minimise([1, 0, 0], [smaller]) == first
    assert not runs


def test_an_excluded_design_is_not_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    encoded = encode(evaluator_with_parts("types", monkeypatch))
    too_hard_as_a_whole(monkeypatch)
    solver = Strategy(encoded)
    designs = []
    while isinstance(answer := solver.minimise([1, 1, 1], [encoded.everywhere]), Found):
        designs.append(answer.design)
        solver.exclude(answer.design)
    assert len(designs) == len(set(designs)) > 1


def count_runs(monkeypatch: pytest.MonkeyPatch) -> list[SolverSettings]:
    runs: list[SolverSettings] = []
    run = Strategy.run

    def counted(self: Strategy, settings: SolverSettings, work: float, *further: Any) -> Answer:
        runs.append(settings)
        return run(self, settings, work, *further)

    monkeypatch.setattr(Strategy, "run", counted)
    return runs


# --- several regions in one question ---------------------------------------------------------------------------------


def answers(encoded: EncodedSpace, regions: Sequence[Bound], weights: Sequence[int]) -> int | None:
    """The least weighted sum in the regions by one question for each."""
    solver = Strategy(encoded)
    found = [solver.minimise(weights, [region]) for region in regions]
    return min((weighted(weights, item.point) for item in found if isinstance(item, Found)), default=None)


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("name", ["types", "protocols", "bindings"])
def test_a_question_about_several_regions_has_the_best_answer_of_any(
    name: str, apart: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluator = evaluator_with_parts(name, monkeypatch) if apart else Evaluator(load_space(BY_NAME[name]))
    encoded = encode(evaluator)
    if len(encoded.objectives) < 3:
        pytest.skip("questions with few objectives are about one region")
    points = [item.point for item in all_points(encoded)]
    regions = [tuple(value + 1 for value in point) for point in points[:3]] + [tuple(value for value in points[0])]
    plain = encode(evaluator)
    if apart:
        too_hard_as_a_whole(monkeypatch)
    solver = Strategy(encoded)
    for asked in ([encoded.everywhere] * 4, regions, regions[:2], regions[2:], regions[:1], [regions[3]]):
        for weights in ([1, 1, 1], [1, 0, 0], [0, 1, 5]):
            answer = solver.minimise(weights, asked)
            assert not isinstance(answer, Unfinished)
            least = weighted(weights, answer.point) if isinstance(answer, Found) else None
            assert least == answers(plain, asked, weights)
            if isinstance(answer, Found):
                assert any(strictly_inside(answer.point, region) for region in asked)


def all_points(encoded: EncodedSpace) -> list[Found]:
    """Some designs with different points."""
    solver, found = Strategy(encoded.copy()), []
    for weights in ([9, 1, 1], [1, 9, 1], [1, 1, 9]):
        answer = solver.minimise(weights, [encoded.everywhere])
        assert isinstance(answer, Found)
        found.append(answer)
    return found


# --- what a part learns --------------------------------------------------------------------------------------------

numbers = st.integers(0, 6)
regions = st.lists(st.tuples(*[st.integers(1, 7)] * 3), min_size=1, max_size=3)


def best(points: Sequence[Point], weights: Sequence[int], asked: Sequence[Bound]) -> Point | None:
    inside = [point for point in points if any(strictly_inside(point, region) for region in asked)]
    return min(inside, key=lambda point: (weighted(weights, point), point), default=None)


def told(points: Sequence[Point], weights: Sequence[int], asked: Sequence[Bound], better_than: int | None) -> Answer:
    """The answer of an exact solver to a question about a part with these points."""
    point = best(points, weights, asked)
    if point is None or (better_than is not None and weighted(weights, point) >= better_than):
        return NoSuchDesign()
    return Found(point, ())


def stopped(answer: Answer, weights: Sequence[int]) -> Answer:
    """The same answer, but the solver was stopped just before."""
    return Unfinished(weighted(weights, answer.point), answer) if isinstance(answer, Found) else answer


@given(
    st.tuples(*[st.builds(Grid, st.integers(0, 3), st.integers(0, 3))] * 3),
    st.lists(st.tuples(numbers, numbers, numbers), max_size=8),
    st.lists(
        st.tuples(
            st.tuples(*[st.integers(0, 20)] * 3),
            regions,
            st.one_of(st.none(), st.integers(0, 60)),
            st.sampled_from([told, lambda *given: stopped(told(*given), given[1])]),
        ),
        max_size=5,
    ),
    regions,
)
def test_a_part_refutes_nothing_that_it_has(
    grids: tuple[Grid, ...],
    drawn: list[Point],
    questions: list[tuple[Point, list[Bound], int | None, Callable[..., Answer]]],
    later: list[Bound],
) -> None:
    points = [
        tuple(grid.start + grid.step * value for grid, value in zip(grids, point, strict=True)) for point in drawn
    ]
    part = Subspace((), grids)
    for weights, asked, better_than, answer in questions:
        part.learn(answer(points, weights, asked, better_than), weights, asked, better_than)
    for point in points:
        assert not any(strictly_inside(point, box) for box in part.refuted)
    open_regions = part.open(later)
    inside = [point for point in points if any(strictly_inside(point, region) for region in later)]
    assert all(any(strictly_inside(point, region) for region in open_regions) for point in inside)
    if open_regions:
        floor = part.floor(open_regions)
        assert all(low <= value for point in inside for low, value in zip(floor, point, strict=True))


def test_a_part_learns_what_the_least_sum_leaves_no_room_for() -> None:
    """Least 10 * a + b + c = 52 in the region a < 9, b < 4, c < 4: no design has a <= 4, as 46 are not enough."""
    part = Subspace(())
    part.learn(Found((5, 1, 1), ()), (10, 1, 1), [(9, 4, 4)], None)
    assert list(part.refuted) == [(5, 4, 4)]
    assert part.open([(5, 4, 4), (6, 2, 2)]) == [(6, 2, 2)]
    assert part.floor([(6, 2, 2)]) == (5, 0, 0)
    part.learn(NoSuchDesign(), (10, 1, 1), [(6, 2, 2)], None)
    assert part.open([(6, 2, 2)]) == []


def test_what_a_part_has_one_value_of_leaves_no_room() -> None:
    """Least 100 * price + latency = 52 where the price is 0: no design has a latency below 52, whatever it may cost."""
    part = Subspace((), (Grid(0, 0), EVERY))
    part.learn(Found((0, 52), ()), (100, 1), [(9, 100)], None)
    assert part.open([(9, 52), (9, 53)]) == [(9, 53)]


STEPS = """
dse: 1
name: steps
processor_types: {slow: {price: 10 EUR}, fast: {price: 31 EUR}}
processors: {p: {type: [slow, fast]}}
devices: {s: {period: 10 ms}}
threads:
  a: {processor: p, period: [5 ms, 10 ms], compute_execution_time: {slow: 1003 us, fast: 707 us}}
  b: {processor: p, period: [5 ms, 20 ms], compute_execution_time: {slow: 2001 us, fast: 999 us}}
connections: {c: {from: s, to: a}, d: {from: a, to: b}}
flows: {f: {path: [s, a, b]}}
objectives: [minimise price, minimise latency of f]
processing: execution_time
"""


def test_what_a_design_has_is_on_the_grid_of_its_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the type given the latency grows in steps of 5 ms, over both types in less."""
    tune(monkeypatch, shared_forms={"shared_by": 1})
    evaluator = Evaluator(loads(STEPS).space)
    encoded = encode(evaluator)
    parts, seen = AllSubspaces(encoded, tuning.DEFAULT).all, set()
    for options in product(*(range(len(item.options)) for item in evaluator.space.decisions)):
        found = evaluator.evaluate(options)
        if not found.is_feasible:
            continue
        literals = {encoded.options[index][option].index for index, option in enumerate(options)}
        (part,) = [item for item in parts if literals.issuperset(item.literals)]
        vector = signed(evaluator, found.objectives)
        point = [(value - item.offset) // item.step for value, item in zip(vector, encoded.objectives, strict=True)]
        for weights in ([1] * len(point), [3, *([1] * (len(point) - 1))]):
            grid, value = weighted_grid(part.grids, weights), weighted(weights, point)
            assert grid.up(value) == value == grid.down(value)
            seen.add(grid.step)
    assert seen == {5_000_000 // encoded.objectives[1].step}


@pytest.mark.parametrize("seed", cases(8))
def test_cores_that_are_nearly_full_are_filled_from_the_bound_on(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Part by part, with the lowest values first: the points of every design, one after the other."""
    asked = []

    def counted(solver: Call, work: float, pools: PoolMemory | None) -> Answer:
        asked.append(work)
        return lowest(solver, work, pools)

    tune(monkeypatch, shared_forms={"shared_by": 1})
    monkeypatch.setattr(strategy, "lowest", counted)
    tune(monkeypatch, subspaces={"sharing_ways": (LOWEST,), "brief": (BARE, 0.0)})
    too_hard_as_a_whole(monkeypatch)
    evaluator = Evaluator(loads(nearly_full(3, 2, 0.9, seed)).space)
    search = search_front(evaluator)
    assert asked
    every = (evaluator.evaluate(design) for design in raw_designs(evaluator.space))
    kept = {found.objectives for found in every if found.is_feasible}
    least = {one for one in kept if not any(other != one and all(map(le, other, one)) for other in kept)}
    assert set(search.points) == least


@pytest.mark.parametrize("shares_cores", [False, True])
def test_a_part_that_bare_settings_leave_open_again_and_again_is_spared_them(shares_cores: bool) -> None:
    """Though relaxation takes longer than what makes a part cheap; not where threads share cores."""
    asked: list[SolverSettings] = []

    class Stub(SimpleNamespace):
        def solve_part(self, part: Subspace, attempt: tuple[SolverSettings, float], *_: Any) -> Answer:
            asked.append(attempt[0])
            self.work += 2 * tuning.Subspaces.cheap
            return Unfinished() if attempt[0] is BARE else Found((0,), (0,))

    model = SimpleNamespace(proto=SimpleNamespace(variables=[]))
    solver: Any = Stub(
        parts=SimpleNamespace(all=[Subspace(())], best=lambda *_: None),
        encoded=SimpleNamespace(
            contention=SimpleNamespace(known=()) if shares_cores else None, is_loose=False, model=model
        ),
        relaxed_first=set(),
        missed_briefly=Counter(),
        out_of_time=lambda: False,
        work=0.0,
        tuning=tuning.DEFAULT,
    )
    for _ in range(8):
        assert isinstance(Apart(solver, (1,), [(5,)]).attempt(1.0), Found)
    assert asked.count(BARE) == (8 if shares_cores else tuning.Subspaces.most_missed)
    assert asked.count(CUTTING) == 8
