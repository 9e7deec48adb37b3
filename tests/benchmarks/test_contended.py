"""The peers for deadlines have our front, and so has our search with their ways."""

from __future__ import annotations

from fractions import Fraction

import pytest

from dse.analysis.evaluate import Evaluator
from dse.questions.problem import loads
from dse.search.front import SearchLimits, search_front

from .cases import Case
from .contended import PEERS, WAYS, contended_front, ends_late, in_our_search

FULL = Case("full", threads=4, objectives=2, seed=1, deadlines=True, cores=2, load=0.9)
CHAINED = Case("chained", "robot", 5, 2, 3, deadlines=True)
"""Some of its threads are dispatched by events: their jitter is not in the peers' rows and cores."""


def front(case: Case) -> list[tuple[int, ...]]:
    return sorted(search_front(Evaluator(loads(case.text()).space), SearchLimits()).points)


@pytest.mark.parametrize("case", [FULL, CHAINED], ids=lambda case: case.name)
def test_every_peer_has_the_same_front(case: Case) -> None:
    expected, refused = front(case), {}
    for peer in PEERS:
        found = contended_front(Evaluator(loads(case.text()).space), 60.0, peer)
        assert (found["front"], found["is_complete"]) == (expected, True), peer
        refused[peer] = found["refused"]
    if case is FULL:  # rows leave nothing open, and cores teach more than designs
        assert 0 == refused["rows per thread"] < refused["unschedulability cores"] < refused["referee loop"]
    for way in WAYS:
        with in_our_search(way):
            assert front(case) == expected, way


def test_a_peer_that_has_no_time_says_so() -> None:
    found = contended_front(Evaluator(loads(FULL.text()).space), 0.0, "referee loop")
    assert not found["is_complete"]


def test_published_response_times() -> None:
    """J. P. Lehoczky's first job, 1990: C / T of 26 / 70 and 62 / 100, which ends after 114."""
    urgent = [(26, Fraction(10**9, 70))]
    assert [ends_late(62, urgent, latest) for latest in (113, 114)] == [True, False]
