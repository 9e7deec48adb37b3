"""What may be late because a processor is overloaded: whatever the design, and so perhaps more than in a given one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from dse.analysis.unbounded import may_be_unbounded
from dse.space.criteria import Metric
from dse.space.metric_kinds import flows_in, parts_of
from dse.space.trees import leaves
from dse.space.types import Component, Space

Place: TypeAlias = tuple[int, int | None]
"""A processor, and a core of it where that is stated; None stands for any of them."""


def delayed_by(space: Space, processors: Iterable[int]) -> frozenset[int]:
    """The components, by number, that may wait for what runs on some processors, by number.

    They are those that may run there, those that one of them triggers, the other pieces of their threads, and what may
    share a core with the latter two.
    """
    reached: set[Place] = {(processor, None) for processor in processors}
    found = set[int]()
    while True:
        more = {number for number, item in enumerate(space.components) if _meet(_places(item), reached)}
        led_to = {number for number in range(len(space.components)) if _follows(space, number, more | found)}
        places = {place for number in led_to for place in _places(space.components[number])}
        if more | led_to <= found and places <= reached:
            return frozenset(found)
        found |= more | led_to
        reached |= places


def _meet(places: set[Place], others: set[Place]) -> bool:
    """Whether some of these places may be the same."""
    return any(
        one == another and (core is None or other is None or core == other)
        for one, core in places
        for another, other in others
    )


def may_be_delayed(space: Space, metric: Metric, components: frozenset[int]) -> bool:
    """Whether response times of some components, by number, count in a metric."""
    parts = parts_of(space, metric)
    if parts:
        return any(may_be_delayed(space, inner, components) for _, inner in parts)
    if not may_be_unbounded(space, metric):
        return False
    if metric.kind == "response time":
        return (metric.index or 0) in components
    flows = [flow for flow in space.flows if flow.name in flows_in(space, metric)]
    return any(step.kind == "component" and step.index in components for flow in flows for step in flow.steps)


def _places(component: Component) -> set[Place]:
    """Where a component may run; on an accelerator that serves one job at a time all meet."""
    core = component.core if isinstance(component.core, int) else None
    return {(leaf, core) for leaf in leaves(component.processor) if leaf is not None}


def _follows(space: Space, number: int, components: set[int]) -> bool:
    """Whether a component is triggered by one of these, or a piece of the same thread."""
    component = space.components[number]
    pieces = component.pieces.members if component.pieces is not None else ()
    triggers = (space.connections[wire].sender for wire in component.triggers)
    return any(item in components for item in (*pieces, *triggers) if item != number)
