"""Conflicts, corrections and relaxed limits of random infeasible problems, against every design of their structure."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import combinations

import pytest

from dse.analysis.limits import build_limit, judge
from dse.analysis.rates import NS_PER_S
from dse.analysis.views import View
from dse.questions.explain.explain import Explainer, Wishes
from dse.questions.problem import Problem
from dse.search.feasibility.conflicts import find_conflicts
from dse.search.feasibility.oracle import Oracle
from dse.search.feasibility.relaxations import closest_limit
from dse.space.model.criteria import Requirement
from dse.space.model.space import Design, Space
from dse.spec.language.expressions import Operator
from dse.support.units import DIMENSIONLESS
from tests.helpers.conflicting import infeasible
from tests.helpers.effort import FIRST, count

WANTED = max(12, count(60))
PARTS = 4


@pytest.mark.parametrize("part", range(PARTS))
def test_conflicts_are_minimal_and_limits_exact(part: int, record_property: Callable[[str, object], None]) -> None:
    wanted = -(-WANTED // PARTS)
    seen: Counter[str] = Counter()
    for seed in range(FIRST + part, FIRST + 10 * WANTED, PARTS):
        if seen["problems"] == wanted:
            break
        found = infeasible(seed)
        if found is not None:
            problem, designs = found
            check(problem, designs, seen, seed)
            seen["problems"] += 1
    record_property("seen", dict(seen))
    assert seen["problems"] == wanted
    assert seen["conflicts of several"] and seen["limits"]


def check(problem: Problem, designs: list[Design], seen: Counter[str], seed: int) -> None:
    space = problem.space
    oracle = Oracle(space)
    met = {design: oracle.met_by(design) for design in designs}
    found = find_conflicts(oracle, every=True)
    assert found.all_conflicts and not found.stopped
    assert {frozenset(item.members) for item in found.conflicts} == all_minimal_conflicts(oracle, set(met.values())), (
        seed
    )
    for item in found.conflicts:
        for number in item.members:
            assert set(item.members) - {number} <= met[item.witnesses[number]], seed
        seen["conflicts"] += 1
        seen["conflicts of several"] += len(item.members) > 1
        seen["rules"] += any(number >= len(space.requirements) for number in item.members)
    seen["fixed"] += bool(space.fixed)
    corrections = {oracle.everything - kept for kept in met.values()}
    assert found.smallest is not None
    assert len(found.smallest.members) == min(map(len, corrections))
    assert {frozenset(item.members) for item in found.corrections} == {
        item for item in corrections if not any(other < item for other in corrections)
    }
    for number in sorted({number for item in found.conflicts for number in item.members}):
        check_limit(oracle, number, met, seen, seed)
    explanation = Explainer.of(problem, Wishes(every=True), time.monotonic()).explanation()
    assert explanation.status == "infeasible" and explanation.complete and explanation.exit_code == 4
    helping = {item.demand.text for item in explanation.relaxations if item.helps}
    assert helping == {oracle.members[number].text for item in corrections if len(item) == 1 for number in item}


def all_minimal_conflicts(oracle: Oracle, met: set[frozenset[int]]) -> set[frozenset[int]]:
    """By looking at every set of members, smallest first."""
    minimal: set[frozenset[int]] = set()
    for size in range(len(oracle.members) + 1):
        for group in map(frozenset, combinations(range(len(oracle.members)), size)):
            if not any(known <= group for known in minimal) and not any(group <= kept for kept in met):
                minimal.add(group)
    return minimal


def check_limit(oracle: Oracle, number: int, met: dict[Design, frozenset[int]], seen: Counter[str], seed: int) -> None:
    """At the limit found the others leave a design, strictly before it none; nor one counting unit less."""
    member = oracle.members[number]
    rest = oracle.everything - {number}
    left = [View(design) for design, kept in met.items() if rest <= kept]
    if not isinstance(member, Requirement):
        return
    closest = closest_limit(oracle, rest, member)
    if not left:
        assert closest is None, seed
        return
    assert closest is not None and rest <= met[closest.witness], seed
    seen["limits"] += 1
    seen["threads"] += bool(closest.thread)
    if member.metric.key == "deadline":  # the limit is how much later than its deadline the thread may end
        own = build_limit(oracle.space, member)
        assert closest.limit * NS_PER_S == min(own.measure.value(view) - own.bound(view) for view in left), seed
        return
    if member.operator == "==":
        distance = abs(closest.limit - member.limit.value)
        needed = [values_at(oracle.space, member, view) for view in left]
        assert distance == min(abs(limit - member.limit.value) for limit in needed), seed
        return
    up = member.operator in ("<=", "<")
    loose: Operator = "<=" if up else ">="
    strict: Operator = "<" if up else ">"
    space = oracle.space

    def holds(operator: Operator, limit: Fraction) -> bool:
        moved = replace(member, operator=operator, limit=replace(member.limit, value=limit))
        return any(judge(build_limit(space, moved), view).holds for view in left)

    unit = Fraction(1, 10**6) if member.limit.dimension == DIMENSIONLESS else counting_unit(space, member)
    assert holds(loose, closest.limit), seed
    assert not holds(strict, closest.limit), seed
    assert not holds(loose, closest.limit - unit if up else closest.limit + unit), seed


def values_at(space: Space, member: Requirement, view: View) -> Fraction:
    one = build_limit(space, replace(member, limit=replace(member.limit, value=Fraction(1))))
    return one.measure.value(view) / one.bound(view)


def counting_unit(space: Space, member: Requirement) -> Fraction:
    one = build_limit(space, replace(member, limit=replace(member.limit, value=Fraction(1))))
    return 1 / (one.bound(View(())) * one.measure.scale)
