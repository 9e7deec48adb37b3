"""The region algorithm on its own: given exact answers it finds the non-dominated set, and proves that it did."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dse.search.regions import (
    Bound,
    Question,
    SearchRegions,
    capped,
    inside,
    local_upper_bounds,
    strictly_inside,
)
from tests.helpers.support import dominates

Points = list[tuple[int, ...]]


def point_sets(dimension: int, high: int, most: int) -> st.SearchStrategy[Points]:
    """Sets of points with coordinates from 0 to `high`."""
    return st.lists(st.tuples(*[st.integers(0, high)] * dimension), max_size=most, unique=True)


any_points = st.integers(1, 5).flatmap(
    lambda dimension: st.tuples(st.just(dimension), point_sets(dimension, 6 if dimension < 4 else 3, 14))
)


def best_in(points: Points, regions: Sequence[Bound], axis: int) -> tuple[int, ...] | None:
    """What an exact solver answers: the least of one objective, then of the sum of the others, inside the regions."""
    within = [point for point in points if any(strictly_inside(point, region) for region in regions)]
    return min(within, key=lambda point: (point[axis], sum(point), point), default=None)


def take(held: SearchRegions, question: Question, point: tuple[int, ...] | None) -> None:
    """What the search does with an answer."""
    regions, axis = question
    for region in regions:
        held.refute(region if point is None else capped(region, axis, point))
    if point is not None:
        held.cut(point)


def search(
    points: Points, start: Bound, stop_after: int | None = None, most: int = 1
) -> tuple[SearchRegions, list[tuple[int, ...]]]:
    """The loop of the search, with a list of points in place of a model."""
    held, found = SearchRegions(start), []
    calls = 0
    while held.open and calls != stop_after:
        calls += 1
        question = held.next_question(most=most)
        assert question is not None
        assert len(set(question[0])) == len(question[0]) <= most
        point = best_in(points, *question)
        take(held, question, point)
        found += [point] if point is not None else []
    return held, found


def non_dominated(points: Points) -> set[tuple[int, ...]]:
    return {point for point in points if not any(dominates(other, point) for other in points)}


@given(any_points, st.integers(1, 4))
def test_exactly_the_non_dominated_points_are_found_once(drawn: tuple[int, Points], most: int) -> None:
    dimension, points = drawn
    _, found = search(points, (7,) * dimension, most=most)
    assert len(found) == len(set(found))
    assert set(found) == non_dominated(points)


@given(any_points, st.integers(1, 4))
def test_refuted_regions_and_dominated_regions_cover_everything(drawn: tuple[int, Points], most: int) -> None:
    dimension, points = drawn
    high = 4 if dimension > 3 else 7
    held, found = search(points, (high,) * dimension, most=most)
    assert not any(strictly_inside(point, region) for region in held.refuted for point in points)
    for cell in product(range(high), repeat=dimension):
        covered = any(strictly_inside(cell, region) for region in held.refuted)
        assert covered or any(point == cell or dominates(point, cell) for point in found)


@given(any_points, st.integers(0, 12))
def test_a_search_that_stops_early_leaves_what_it_does_not_know_open(drawn: tuple[int, Points], calls: int) -> None:
    dimension, points = drawn
    held, found = search(points, (7,) * dimension, stop_after=calls)
    assert set(found) <= non_dominated(points)
    for missing in non_dominated(points) - set(found):
        assert any(strictly_inside(missing, region) for region in held.open)


@given(any_points, st.integers(0, 12))
def test_nothing_lies_below_the_floor_of_an_open_region(drawn: tuple[int, Points], calls: int) -> None:
    dimension, points = drawn
    held, _ = search(points, (7,) * dimension, stop_after=calls)
    for region in held.open:
        within = [point for point in points if strictly_inside(point, region)]
        assert all(
            least <= value for point in within for least, value in zip(held.refuted.floor(region), point, strict=True)
        )


@given(any_points)
def test_the_certificate_depends_on_the_front_alone_and_covers_everything(drawn: tuple[int, Points]) -> None:
    dimension, points = drawn
    high = 4 if dimension > 3 else 7
    front = sorted(non_dominated(points))
    regions = local_upper_bounds((high,) * dimension, front, 10_000)
    assert regions == local_upper_bounds((high,) * dimension, front[::-1], 10_000)
    assert regions is not None
    assert not any(strictly_inside(point, region) for region in regions for point in points)
    assert not any(inside(one, other) for one in regions for other in regions if one != other)
    for cell in product(range(high), repeat=dimension):
        covered = any(strictly_inside(cell, region) for region in regions)
        assert covered or any(point == cell or dominates(point, cell) for point in front)


def test_a_certificate_that_grows_too_large_is_given_up() -> None:
    points = [(0, 3, 3), (3, 0, 3), (3, 3, 0), (2, 2, 2)]
    assert local_upper_bounds((9, 9, 9), points, 3) is None
    assert local_upper_bounds((9, 9, 9), points, 30) is not None


@given(any_points, st.integers(2, 4), st.integers(1, 4))
def test_several_searchers_at_a_time_find_the_same(drawn: tuple[int, Points], searchers: int, most: int) -> None:
    """Each takes a choice that nobody has; answers come back in another order than they were asked."""
    dimension, points = drawn
    held, found = SearchRegions((7,) * dimension), set()
    taken: list[Any] = []
    while held.open or taken:
        while len(taken) < searchers and (question := held.next_question(taken, most)) is not None:
            taken.append(question)
        question = taken.pop()
        point = best_in(points, *question)
        take(held, question, point)
        found |= {point} if point is not None else set()
    assert found == non_dominated(points)


@given(any_points)
def test_no_open_region_is_contained_in_another_or_in_a_refuted_one(drawn: tuple[int, Points]) -> None:
    dimension, points = drawn
    for calls in range(1, 6):
        held, _ = search(points, (7,) * dimension, stop_after=calls)
        for region in held.open:
            assert not any(inside(region, other) for other in held.open if other is not region)
            assert not any(inside(region, other) for other in held.refuted)
        for region in held.refuted:
            assert not any(inside(region, other) for other in held.refuted if other is not region)


def test_the_largest_projection_is_searched_first() -> None:
    held = SearchRegions((4, 10, 3))
    assert held.next_question() == (((4, 10, 3),), 2)
    held.open = [(4, 10, 3), (2, 2, 30)]
    assert held.next_question() == (((2, 2, 30),), 0)


def test_an_objective_that_is_rather_minimised_comes_first_while_one_is_left() -> None:
    held = SearchRegions((4, 10, 3))
    assert held.next_question(rather={1}) == (((4, 10, 3),), 1)
    held.open = [(4, 10, 3), (2, 2, 30)]
    assert held.next_question(rather={1}) == (((2, 2, 30),), 1)
    taken = [(((2, 2, 30),), 1), (((4, 10, 3),), 1)]
    assert held.next_question(taken, rather={1}) == (((2, 2, 30),), 0)


def test_the_nearest_regions_join_a_question() -> None:
    """Distances are shares of the range, without the objective that is minimised."""
    held = SearchRegions((100, 10, 10))
    held.open = [(100, 3, 3), (30, 9, 3), (60, 4, 4), (99, 3, 2)]
    assert held.next_question(most=3) == (((100, 3, 3), (99, 3, 2), (60, 4, 4)), 1)
    taken = [(((99, 3, 2),), 0)]
    assert held.next_question(taken, most=3) == (((100, 3, 3), (60, 4, 4), (30, 9, 3)), 1)


def test_cutting_where_nothing_is_open_changes_nothing() -> None:
    held = SearchRegions((3, 3))
    held.cut((1, 1))
    before = list(held.open)
    held.cut((2, 2))
    assert held.open == before == [(1, 3), (3, 1)]


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [((1, 2), (1, 2), False), ((1, 2), (1, 3), True), ((1, 3), (2, 2), False), ((2, 2), (1, 2), False)],
)
def test_dominance(one: tuple[int, ...], other: tuple[int, ...], expected: bool) -> None:
    assert dominates(one, other) is expected
