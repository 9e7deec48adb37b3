"""A limit that is stated once, of every flow or processor, is relaxed as one."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.analysis.limits import build_limit, needed_share
from dse.analysis.views import View
from dse.search.feasibility.oracle import Oracle
from dse.search.feasibility.relaxations import closest_limit
from dse.space.model.criteria import Requirement
from dse.space.model.space import Space
from tests.helpers.conflicting import infeasible, structural_designs
from tests.helpers.effort import FIRST, count

TWO = """
dse: 1
name: Two computers
processor_types: {slow: {price: 10 EUR}, fast: {price: 30 EUR}}
processors: {front: {type: [slow, fast]}, rear: {type: [slow, fast]}}
threads:
  look: {processor: front, period: 10 ms, compute_execution_time: {slow: 6 ms, fast: 3 ms}}
  act: {processor: rear, period: 10 ms, compute_execution_time: {slow: 4 ms, fast: 2 ms}}
requirements: [STATED]
objectives: [minimise price]
"""
# front uses 60 % (slow) or 30 % (fast) of its core, rear 40 % or 20 %; both fast cost 60 EUR.


MOST_DESIGNS = 200


def stating(*stated: str) -> dse.Problem:
    return dse.loads(TWO.replace("STATED", ", ".join(stated)), "two.yaml")


def test_one_option_for_all_flows_is_one_requirement(tmp_path: Path) -> None:
    file = dse.example_path("inmark")
    found = dse.explain(file, max_jitter="5 ms")
    (item,) = found.relaxations
    assert (item.demand.text, item.helps, item.closest) == ("jitter <= 5 ms", True, 10_724_753)
    assert item.text == "jitter <= 10.724753 ms"
    assert item.together == ("jitter of gnss_to_sprayer <= 5 ms", "jitter of software_chain <= 5 ms")
    assert found.give_up is not None and found.give_up.members[0].demand == item.demand
    assert dse.explain(file, max_jitter="10.724753 ms").status == "feasible"
    assert dse.explain(file, max_jitter="10.724752 ms").status == "infeasible"
    assert all(row["requirement"] == item.text for row in found.frame().to_dict("records"))
    path = tmp_path / "r.json"
    result = dse.solve(file, max_jitter="5 ms")
    path.write_text(result.to_json(), encoding="utf-8")
    assert [(clash.text, clash.closest) for clash in result.give_up] == [("jitter <= 5 ms", 10_724_753)]
    assert dse.verify(path).status == "verified"
    assert dse.reopen(path).give_up == result.give_up


def test_a_closest_limit_of_a_statement_that_is_not_true_is_refuted() -> None:
    data = dse.solve(dse.loads(TWO.replace("STATED", "utilisation <= 10 %"))).to_dict()
    (stated,) = data["give_up"]
    for closest, said in ((290_000, "is not enough"), (310_000, "is not the closest")):
        data["give_up"] = [{**stated, "closest": closest, "miss": closest - 100_000}]
        found = dse.verify(data)
        assert found.status == "rejected"
        assert [item for item in found.findings if said in item.text]
    data["give_up"] = [{**stated, "text": "utilisation <= 11 %"}]
    assert dse.verify(data).findings[0].text == "nothing in the question says 'utilisation <= 11 %'"


@pytest.mark.parametrize(
    ("stated", "closest", "written"),
    [
        ("utilisation <= 10 %", 300_000, "utilisation <= 30 %"),
        ("utilisation < 30 %", 300_000, "utilisation <= 30 %"),
        ("utilisation >= 70 %", 400_000, "utilisation >= 40 %"),
    ],
)
def test_a_statement_of_the_file(stated: str, closest: int, written: str) -> None:
    (item,) = dse.explain(stating(stated)).relaxations
    assert (item.demand.text, item.demand.origin) == (stated, "two.yaml:9")
    assert (item.helps, item.closest, item.text) == (True, closest, written)


def test_what_is_given_up_counts_statements() -> None:
    found = dse.explain(stating("utilisation <= 10 %", "price <= 5 EUR"))
    assert found.give_up is not None
    figures = [(item.demand.text, item.closest) for item in found.give_up.members]
    assert figures == [("utilisation <= 10 %", 300_000), ("price <= 5 EUR", 2000)]


def test_two_statements_are_relaxed_by_themselves() -> None:
    """The processor in the rear needs 20 % at least, and 20 % are allowed: only the other has to move."""
    found = dse.explain(stating("utilisation of front <= 20 %", "utilisation of rear <= 20 %"))
    assert [(item.demand.text, item.closest) for item in found.relaxations] == [
        ("utilisation of front <= 20 %", 300_000)
    ]
    found = dse.explain(stating("utilisation of front <= 20 %"), max_utilisation="20 %")
    assert [(item.demand.origin, item.closest) for item in found.relaxations] == [("two.yaml:9", 300_000)]


def test_random_statements_against_every_design() -> None:
    """The least limit of all flows, or processors, is the least that some design needs of the worst of them."""
    seen = 0
    for seed in range(FIRST, FIRST + 400):
        if seen >= count(20):
            break
        found = infeasible(seed)
        if found is None:
            continue
        problem, _ = found
        for asked in ({"max_latency": "1 ns"}, {"max_utilisation": "0.0001 %"}):
            space = problem.ask(**asked).space
            oracle, designs = Oracle(space), structural_designs(space)
            if not 0 < len(designs) <= MOST_DESIGNS:
                continue
            for statement in oracle.statements:
                if len(statement) == 1:
                    continue
                members = [item for number in statement if isinstance(item := oracle.members[number], Requirement)]
                rest = oracle.met_by(designs[seed % len(designs)]) - {*statement}
                closest = closest_limit(oracle, rest, *members)
                left = [View(design) for design in designs if rest <= oracle.met_by(design)]
                needed = [max(_needed(space, item, view) for item in members) for view in left]
                assert closest is not None and closest.limit == min(needed), (seed, asked)
                seen += 1
    assert seen >= count(20)


def _needed(space: Space, item: Requirement, view: View) -> Fraction:
    one = build_limit(space, replace(item, limit=replace(item.limit, value=Fraction(1))), is_asked=False)
    return needed_share(one, view)[0]
