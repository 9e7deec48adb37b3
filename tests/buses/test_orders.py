"""Lessons of the search on the order of messages with chosen identifiers, against all designs of drawn buses."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import pytest

import dse
from dse.analysis.messages.burdens import burdens
from dse.analysis.messages.conflicts import Conflict, conflicts
from dse.analysis.messages.precedence import (
    earlier_on_flows,
    is_idler_alike,
    nested,
    soonest,
    waits_behind_ns,
)
from dse.analysis.messages.stages import bus_of, candidates_of
from dse.analysis.scheduling.resolve import released_undelayed, resolve_buses
from dse.analysis.scheduling.responses import NO_BOUND, message_waits_ns
from dse.analysis.views import View
from dse.encode.messages.reasons import conflict_conditions
from dse.space.model.space import Design, Space
from dse.space.model.trees import at
from dse.support.units import Exact
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


def soonest_wait(space: Space, number: int, view: View, held: frozenset[int]) -> tuple[frozenset[int], Exact] | None:
    """The messages before one in its most urgent place, and how long it waits there; None without a bound."""
    found = soonest(space, number, view, held)
    waits = None if found is None else waits_behind_ns(found, space, view, has_source=False)
    return None if found is None or waits is None else (frozenset(found.group), waits)


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
                    least = soonest_wait(space, number, View(design), held)
                    if least is None:  # on a bus that is more than full
                        assert message_waits_ns(space, number, View(design)) == NO_BOUND
                        continue
                    assert least[0] <= order
                    assert least[1] <= message_waits_ns(space, number, View(design))
                    there = soonest_wait(space, number, View(other), held)
                    assert there is None or there[0] <= least[0]
                    assert there is None or there[1] <= least[1]
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


def is_told(conflict: Conflict, space: Space, view: View) -> bool:
    """Whether a conflict says of a design, too, that its group goes before its last message."""
    kept = conflict.kept_from_last(space, view)
    if kept is None:
        return False
    for number, bound, is_most in conflict.bounds(kept):
        own = at(space.connections[number].identifier, view)
        if not isinstance(own, int) or (own > bound if is_most else own < bound):
            return False
    return True


@pytest.mark.parametrize("seed", cases(600))
def test_what_no_order_has_behind_a_message_is_before_it_in_other_designs_of_which_that_is_told(seed: int) -> None:
    """With as long a wait at least; in the design itself it is told of all that goes before the message at soonest."""
    rng = Random(seed)
    space = replace(dse.loads(draw_identifier_problem(seed, decisions=9)).ask().space, processing="execution_time")
    designs = [tuple(rng.randrange(len(item.options)) for item in space.decisions) for _ in range(12)]
    for design in designs[:4]:
        for number in range(len(space.connections)):
            if bus_of(space, number, View(design)) is None:
                continue
            kept = earlier_on_flows(space, number, View(design))
            for held in {frozenset[int](), kept}:
                whole = soonest(space, number, View(design), held)
                if whole is None:
                    continue
                told = list(nested(space, View(design), whole))
                assert all(is_told(item, space, View(design)) for item in told)
                assert told[-1] == whole
                for other in designs:
                    order = before(space, number, View(other)) if bus_of(space, number, View(other)) == 0 else None
                    if order is None or not held <= order:
                        continue
                    for item in told:
                        if is_told(item, space, View(other)):
                            assert order >= {*item.group}
                            waits = waits_behind_ns(item, space, View(other), has_source=False)
                            seen = message_waits_ns(space, number, View(other))
                            assert seen == NO_BOUND if waits is None else waits <= seen


@pytest.mark.parametrize("seed", cases(300))
def test_a_lesson_on_messages_that_are_late_asks_for_identifiers_of_those_that_these_order_alone(seed: int) -> None:
    """Not for those of messages that may have any, whose number decides nothing."""
    rng = Random(seed)
    space = replace(dse.loads(draw_identifier_problem(seed, decisions=9)).ask().space, processing="execution_time")
    for _ in range(8):
        view = View(tuple(rng.randrange(len(item.options)) for item in space.decisions))
        for conflict in conflicts(space, 0, view):
            found = conflict_conditions(space, lambda index, option: 1000 * index + option, conflict, view)
            asked = {space.decisions[literals[0] // 1000] for literals in found}
            wires = [space.connections[number].name for number in conflict.numbers]
            assert {item.component for item in asked if item.field == "identifier"} <= {*wires}
