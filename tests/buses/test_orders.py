"""Lessons of the search on the order of messages with chosen identifiers, against all designs of drawn buses."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import pytest

import dse
from dse.analysis.memo import looked_at
from dse.analysis.messages.burdens import burdens
from dse.analysis.messages.conflicts import earlier_on_flows, is_idler_alike, soonest
from dse.analysis.messages.stages import bus_of, candidates_of
from dse.analysis.scheduling.resolve import released_undelayed, resolve_buses
from dse.analysis.scheduling.responses import NO_BOUND, message_waits_ns
from dse.analysis.views import View
from dse.encode.messages import reasons
from dse.space.model.space import Design, Space
from tests.buses.test_random import front_of
from tests.helpers.effort import cases
from tests.helpers.identifier_systems import draw_identifier_problem
from tests.helpers.tuned import learn_instead_of_tabulating


def busy(space: Space, index: int) -> list[int]:
    """A number for each option of a decision, the greater the busier the bus, or the fewer orders; none: unknown."""
    decision = space.decisions[index]
    if decision.field == "identifier":
        return [int(isinstance(value, int)) for value in decision.values]
    return list(burdens(space, index) or ())


def idler(space: Space, design: Design, rng: Random) -> Design:
    """A design in which nothing is busier, no message has a number that may have any here, those of flows as here."""
    found = list(design)
    for index, option in enumerate(design):
        levels = busy(space, index)
        if levels and is_idler_alike(space, index):
            found[index] = rng.choice([one for one, level in enumerate(levels) if level <= levels[option]])
    return tuple(found)


def before(space: Space, number: int, view: View) -> frozenset[int] | None:
    """The messages before one in the order that is chosen; None where some are late."""
    (resource,) = resolve_buses(space, view).resources
    limits = candidates_of(space, 0, view, lambda keys: released_undelayed(space, view, keys))
    for one, item in zip(sorted(entry.key[0] for entry in resource.entries), limits, strict=True):
        waited = message_waits_ns(space, one, view)
        if item.limit_ns is not None and item.task is not None and waited + item.task.worst_ns > item.limit_ns:
            return None
    keys = [entry.key[0] for entry in resource.entries]
    return frozenset(keys[: keys.index(number)])


@pytest.mark.parametrize("seed", cases(600))
def test_what_goes_before_a_message_does_so_in_designs_as_busy_and_what_the_rule_has_before_in_idler_ones(
    seed: int,
) -> None:
    rng = Random(seed)
    space = replace(dse.loads(draw_identifier_problem(seed, decisions=9)).ask().space, processing="execution_time")
    for _ in range(8):
        design = tuple(rng.randrange(len(item.options)) for item in space.decisions)
        other = idler(space, design, rng)
        for number in range(len(space.connections)):
            if bus_of(space, number, View(design)) is None:  # between threads of one processor
                continue
            order, order_there = (before(space, number, View(item)) for item in (design, other))
            kept = earlier_on_flows(space, number, View(design))
            if order is not None:
                assert kept <= order
                for held in {frozenset[int](), kept}:
                    least = soonest(space, number, View(design), held)
                    if least is None:  # on a bus that is more than full
                        assert message_waits_ns(space, number, View(design)) == NO_BOUND
                        continue
                    assert least.before <= order
                    assert least.waits_ns <= message_waits_ns(space, number, View(design))
                    there = soonest(space, number, View(other), held)
                    assert there is None or there.before <= least.before
                    assert there is None or there.waits_ns <= least.waits_ns
            if order_there is not None:
                assert kept <= order_there


@pytest.mark.parametrize("seed", cases(60, 500))
def test_fronts_are_those_of_all_designs(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where figures are learnt from what the referee says of solutions."""
    learn_instead_of_tabulating(monkeypatch)
    problem = dse.loads(draw_identifier_problem(seed))
    result = dse.solve(problem)
    assert {tuple(point.objectives.values()) for point in result.front} == front_of(result.space)
    assert not dse.verify(result, problem=problem).findings


def test_who_goes_before_a_message_in_a_design_is_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each message that may go before it asks for much the same designs; what is read of one is noted each time."""
    space = replace(dse.loads(draw_identifier_problem(3, decisions=9)).ask().space, processing="execution_time")
    design, number = tuple(0 for _ in space.decisions), 0
    asked = list[View]()

    def counting(space: Space, number: int, view: View, before: frozenset[int]) -> object:
        asked.append(view)
        return soonest(space, number, view, before)

    monkeypatch.setattr(reasons, "soonest", counting)
    looks = reasons._Before(space, number, frozenset())
    assert looks.in_design(design) == looks.in_design(design)
    assert len(asked) == 1
    noted = [looked_at(design, lambda whole: looks.in_design(whole.design)) for _ in range(2)]
    assert noted[0] == noted[1] == (looks.in_design(design), noted[0][1])
    assert len(asked) == 3 and noted[0][1]
