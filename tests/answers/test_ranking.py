"""Rank orders worked out by hand; ties are ties; other units change nothing."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dse.answers.ranking.ranking import METHODS, Ranking, rank, split_names, trade_off
from dse.support.errors import UsageError

TWO = [("jitter of a", "minimise"), ("price", "minimise")]
# scaled to the range of the front: (0, 1), (0.1, 0.5), (0.5, 0.1), (1, 0)
FRONT = [(0, 110), (10, 60), (50, 20), (100, 10)]


@pytest.mark.parametrize(
    ("method", "ranks"),
    [
        ("ideal", (3, 1, 1, 3)),  # 1, sqrt(0.26), sqrt(0.26), 1
        ("ideal:price=2,jitter=1", (4, 3, 1, 2)),  # 2, sqrt(1.01), sqrt(0.29), 1
        ("weights:1,1", (3, 1, 1, 3)),  # 1, 0.6, 0.6, 1
        ("weights:jitter=3,price=1", (2, 1, 3, 4)),  # 1, 0.8, 1.6, 3
        ("weights:price=1", (4, 3, 2, 1)),
        ("order:price", (4, 3, 2, 1)),
        ("order:jitter of a, price", (1, 2, 3, 4)),
        # least trade-offs: 1: to 2 it loses 0.1 and gains 0.5; 2: to 3 it loses 0.4 and gains 0.4; 3: to 2 the same; 4:
        # to 3, 0.1 / 0.5
        ("knee", (3, 1, 1, 3)),
        # jitter / sqrt(12600), price / sqrt(16200); squared near / far of each: (10000/16200) / (10000/12600) = 0.78;
        # (100/12600 + 2500/16200) / (8100/12600 + 2500/16200) = 0.203; (2500/12600 + 100/16200) / (2500/12600 +
        # 8100/16200) = 0.293;
        # (10000/12600) / (10000/16200) = 1.29
        ("topsis", (3, 1, 2, 4)),
        ("baseline", (4, 1, 1, 3)),  # 3, 0, 0, 2 changes
    ],
)
def test_hand_computed_orders(method: str, ranks: tuple[int, ...]) -> None:
    assert rank(method, FRONT, TWO, [3, 0, 0, 2]).ranks == ranks


def test_scores_and_parameters_are_said() -> None:
    found = rank("weights:jitter=3,price=1", FRONT, TWO)
    assert found.words == (
        "weighted sum of the objectives, each scaled to its range on the front (weights: jitter of a 3, price 1)"
    )
    assert found.scores == ("1.000", "0.800", "1.600", "3.000")
    assert rank("order:price", FRONT, TWO).words == "order of objectives: price, then jitter of a"
    assert rank("ideal", FRONT, TWO).tied == frozenset({1, 3})


def test_maximised_objectives_count_the_other_way() -> None:
    senses = [("jitter of a", "minimise"), ("price", "maximise")]
    assert rank("order:price", [(0, 1), (1, 2)], senses).ranks == (2, 1)
    assert rank("weights:price=1", [(0, 1), (1, 2)], senses).ranks == (2, 1)


@pytest.mark.parametrize("method", ["ideal", "topsis", "knee", "weights:1,1", "order:price"])
def test_a_single_point_and_an_empty_front(method: str) -> None:
    assert rank(method, [(5, 5)], TWO).ranks == (1,)
    assert rank(method, [], TWO).ranks == ()


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("closest", "expected one of ideal"),
        ("weights", "needs parameters"),
        ("order", "needs parameters"),
        ("weights:cost=1", "no such objective"),
        ("weights:price=x", "NAME=NUMBER"),
        ("weights:price=1,price=2", "two weights"),
        ("weights:price=0", "one is positive"),
        ("weights:price=-1", "not negative"),
        ("order:price,price", "named twice"),
        ("knee:1", "takes no parameters"),
        ("baseline", "no complete baseline"),
    ],
)
def test_what_cannot_be_ranked_is_said(method: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        rank(method, FRONT, TWO)


def test_ambiguous_beginnings_are_refused() -> None:
    with pytest.raises(UsageError, match="several objectives begin so"):
        rank("order:jitter", [(1, 2)], [("jitter of a", "minimise"), ("jitter of b", "minimise")])


def test_names_with_commas_and_quotes() -> None:
    assert split_names("price=1, \"a, b\"=2,'c=d'=3") == ["price=1", '"a, b"=2', "'c=d'=3"]
    names = [("jitter of a, b", "minimise"), ("load of x=y", "minimise")]
    assert rank('weights:"jitter of a, b"=2,load of x=y=1', [(1, 2), (2, 1)], names).ranks == (1, 2)


def test_trade_off() -> None:
    assert trade_off([Fraction(0), Fraction(1)], [Fraction(1, 4), Fraction(1, 2)]) == Fraction(1, 2)
    assert trade_off([Fraction(0)], [Fraction(1)]) is None


METHODS_WITH = [
    name if name not in ("weights", "order") else f"{name}:{'1,2' if name == 'weights' else 'price'}"
    for name in METHODS
]


@given(
    points=st.lists(st.tuples(st.integers(0, 10**12), st.integers(0, 10**12)), min_size=1, max_size=8, unique=True),
    factors=st.tuples(st.integers(1, 10**9), st.integers(1, 10**9)),
)
def test_ranks_do_not_change_with_units_or_order(points: list[tuple[int, int]], factors: tuple[int, int]) -> None:
    scaled = [(a * factors[0], b * factors[1]) for a, b in points]
    changes = [a % 5 for a, _ in points]
    for method in METHODS_WITH:
        here, there = rank(method, points, TWO, changes), rank(method, scaled, TWO, changes)
        assert here.ranks == there.ranks
        assert here.scores == there.scores
        turned = rank(method, points[::-1], TWO, changes[::-1])
        assert turned.ranks == here.ranks[::-1]
        assert_competition(here)


def assert_competition(ranking: Ranking) -> None:
    """Rank k means that k - 1 points rank better: nobody is left out."""
    assert all(sum(other < value for other in ranking.ranks) == value - 1 for value in ranking.ranks)


def test_scores_that_differ_are_not_printed_alike() -> None:
    near = [(0, 10_000), (10_000, 0), (4_000, 4_000), (4_001, 3_998), (4_002, 3_996)]
    for method in ("ideal", "topsis", "knee", "weights:2,1"):
        found = rank(method, near, [("a", "minimise"), ("b", "minimise")])
        for one in range(len(near)):
            for other in range(len(near)):
                assert (found.scores[one] == found.scores[other]) == (found.ranks[one] == found.ranks[other])
