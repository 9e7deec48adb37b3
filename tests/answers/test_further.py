"""Exact ties and near-optimal designs, against all designs of small spaces."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import combinations

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.answers.ranking.changes import changes_between
from dse.answers.result import Result
from dse.examples.shipped import example_path
from dse.questions.verbs.alternatives import read_share, with_further_designs
from dse.report.words.reasons import dominated_words, others_words
from dse.search.alternatives import Finder
from dse.support.errors import UsageError

# Price and utilisation depend on the processor alone; bus and `spare` are free: each point has 2 * 3 = 6 designs.
PROBLEM = """
dse: 1
name: Ties
processor_types: {slow: {price: 100 EUR}, fast: {price: 104 EUR}, lavish: {price: 103 EUR}}
bus_types:
  one: {bandwidth: 100 kbit/s}
  two: {bandwidth: 200 kbit/s}
processors: {cpu: {type: [slow, fast, lavish]}}
buses: {net: {type: [one, two]}}
devices: {source: {period: 10 ms}}
threads:
  worker:
    processor: cpu
    dispatch_protocol: periodic
    period: 10 ms
    deadline: [7 ms, 8 ms, 9 ms]
    compute_execution_time: {slow: 0 ns .. 4 ms, fast: 0 ns .. 1 ms, lavish: 0 ns .. 4 ms}
connections: {wire: {from: source, to: worker, data_size: 8 B, bus: net}}
flows: {main: {path: [source, worker]}}
objectives: [minimise jitter of main, minimise price]
"""


@pytest.fixture(scope="module")
def result() -> Result:
    return dse.solve(dse.loads(PROBLEM))


def test_ties_are_all_found_and_nothing_else(result: Result) -> None:
    evaluator = Evaluator(result.space)
    finder = Finder(evaluator)
    for point in result.front:
        vector = tuple(point.objectives.values())
        found = finder.near(vector, point.design, 100)
        assert found.more is False
        assert {objectives for _, objectives in found.designs} == {vector}
        designs = {design for design, _ in found.designs}
        assert len(designs) == len(found.designs) == 5
        assert point.design not in designs


def test_nothing_is_added_to_a_search_that_ctrl_c_ended(result: Result) -> None:
    assert with_further_designs(replace(result, interrupted=True), 1).others == ()


def test_the_first_differs_most_and_the_rest_is_admitted(result: Result) -> None:
    found = with_further_designs(result, 1)
    for others in found.others:
        assert others.more is True
        assert others.within == 0
        [sibling] = others.designs
        assert sibling.different == 2  # the bus and the deadline: all that is free
        assert sibling.dominated_by == ()
        assert sibling.id == f"{others.of}.1"
        assert dominated_words(sibling, found) == ""
        assert others_words(others) == (
            "1 other design with exactly the same objectives, chosen to differ; there are more."
        )


def test_near_designs_are_marked_as_dominated(result: Result) -> None:
    # `lavish` is as slow as `slow` and costs 3 % more: within 3 % of #slow, not within 2 %
    slow = next(point for point in result.front if point.decisions["cpu.type"] == "slow")
    found = with_further_designs(result, 10, "3%")
    near = next(item for item in found.others if item.of == slow.id and item.within)
    assert near.within == Fraction(3, 100)
    assert {item.decisions["cpu.type"] for item in near.designs} == {"lavish"}
    assert len(near.designs) == 6
    assert near.more is False
    assert all(item.dominated_by == (slow.id,) for item in near.designs)
    assert dominated_words(near.designs[0], found) == f" (dominated by #{slow.id})"
    closer = with_further_designs(result, 10, "2%")
    assert [len(item.designs) for item in closer.others if item.within] == [0, 0]


def test_top_limits_the_points_that_are_looked_at(result: Result) -> None:
    assert [item.of for item in with_further_designs(result, 1, top=1).others] == [result.front[0].id]


def test_an_early_stop_is_said(result: Result) -> None:
    found = with_further_designs(result, 1, time_limit_s=1e-9)
    assert [item.more for item in found.others] == [None, None]
    assert others_words(found.others[0]) == (
        "No other design with exactly the same objectives was found before the search stopped."
    )


@pytest.mark.parametrize(("text", "share"), [("5%", Fraction(1, 20)), ("0.5 %", Fraction(1, 200))])
def test_shares(text: str, share: Fraction) -> None:
    assert read_share(text) == share


@pytest.mark.parametrize("text", ["5", "-5%", "0%", "5 ms", "much"])
def test_what_is_no_share_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="within"):
        read_share(text)


TIES = """
dse: 1
name: ties
threads:
  t: {price: [100 EUR, 103 EUR], power: [10 W, 9.9 W]}
  u: {period: [10 ms, 20 ms], price: 1 EUR}
rules: ["t.price == 100 EUR implies t.power == 10 W"]
objectives: [minimise price, minimise power]
"""


def test_near_designs_with_the_objectives_of_another_point_are_not_dominated() -> None:
    """Within 5 % of either point: the other one and its tie, which nothing dominates, and 104 EUR with 10 W."""
    found = with_further_designs(dse.solve(dse.loads(TIES)), 9, "5 %")
    assert len(found.front) == 2
    for others in (item for item in found.others if item.within):
        other = next(point.id for point in found.front if point.id != others.of)
        said = [dominated_words(sibling, found) for sibling in others.designs]
        assert sorted(said) == [" (dominated by #1 and #2)"] * 2 + [f" (the objectives of #{other})"]
        assert others_words(others).startswith("3 other designs with each objective at most 5 % worse")
    ties = [sibling for item in found.others if not item.within for sibling in item.designs]
    assert [dominated_words(sibling, found) for sibling in ties] == ["", ""]


def test_a_swap_of_equal_cores_is_no_further_design() -> None:
    """The robot's first point has designs of the same objectives that differ in the numbers of its cores alone."""
    result = with_further_designs(dse.solve(example_path("inmark"), max_jitter="20 ms"), 2, top=1)
    (group,) = result.others
    designs = [result.front[0].design, *(item.design for item in group.designs)]
    assert len(designs) == 3 and all(
        changes_between(result.space, one, other) for one, other in combinations(designs, 2)
    )
