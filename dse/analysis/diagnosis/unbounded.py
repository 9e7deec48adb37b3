"""Which response times have no bound: `UNBOUNDED_NS` stands for them in sums, and is never shown to people."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.latency.contributors import flow_rows
from dse.analysis.latency.joined_inputs import may_wait_for_inputs
from dse.analysis.latency.metrics import flow_figure_ns
from dse.analysis.latency.rows import counts_responses, has_no_bound
from dse.analysis.latency.stored_inputs import may_be_stored
from dse.analysis.measures import display_unit
from dse.analysis.messages.stages import counted_buses, may_wait_for
from dse.analysis.rates import NS_PER_S
from dse.analysis.scheduling.responses import UNBOUNDED_NS, bounded_response_ns, message_waits_ns
from dse.analysis.views import View
from dse.space.model.criteria import Metric
from dse.space.model.metric_kinds import flows_in, metric_dimension, parts_of
from dse.space.model.space import Component, Space
from dse.space.model.trees import leaves


def unbounded_in(space: Space, metric: Metric, view: View) -> tuple[str, ...]:
    """The threads in a metric of a design whose response time has no bound, in the order of the flow.

    Empty for a metric that counts no response times, and where all of them are bounded.
    """
    if metric.operands:
        return _unbounded_extreme(space, metric, view)
    if metric.kind == "derived":
        inner = (item for _, item in _terms(space, metric))
        return tuple(dict.fromkeys(name for item in inner for name in unbounded_in(space, item, view)))
    if metric.kind in ("latency", "jitter"):
        figure_ns = flow_figure_ns(space, metric, view)
        if figure_ns is not None and figure_ns < UNBOUNDED_NS:
            return ()
        rows = flow_rows(space, space.flows[metric.index or 0], view)
        return tuple(dict.fromkeys(row.contributor for row in rows if has_no_bound(row)))
    if metric.kind == "message response":
        number = metric.index or 0
        is_unbounded = message_waits_ns(space, number, view) >= UNBOUNDED_NS
        return (space.connections[number].name,) if is_unbounded else ()
    if metric.kind == "response time":
        number = metric.index or 0
        if bounded_response_ns(space, number, "thread", view) >= UNBOUNDED_NS:
            return (space.components[number].name,)
    return ()


def _unbounded_extreme(space: Space, metric: Metric, view: View) -> tuple[str, ...]:
    """The threads without a bound in the greatest or least of several sums; a sum that is not picked has none."""
    wanted = 1 if metric.kind == "max" else -1
    picked: list[tuple[list[str], set[int]]] = []
    others: list[tuple[list[str], set[int]]] = []
    for terms in metric.operands:
        extremes = [(times.value, unbounded_in(space, inner, view)) for times, inner in terms if times.value]
        names = [name for _, names in extremes for name in names]
        ways = {1 if times > 0 else -1 for times, unbounded in extremes if unbounded}
        (picked if wanted in ways else others).append((names, ways))
    if picked:
        return tuple(dict.fromkeys(name for names, _ in picked for name in names))
    if all(ways for _, ways in others):
        return tuple(dict.fromkeys(name for names, _ in others for name in names))
    return ()


def may_be_unbounded(space: Space, metric: Metric) -> bool:
    """Whether a metric may have no bound: response times count in it, or data wait for a dispatch or other inputs.

    Judged for the space, not for one design; recursive over derived metrics.
    """
    if metric.operands or metric.kind == "derived":
        return any(may_be_unbounded(space, inner) for _, inner in _terms(space, metric))
    if metric.kind == "message response":
        return bool(may_wait_for(space, metric.index or 0))
    if metric.kind not in ("latency", "jitter"):
        return metric.kind == "response time"
    steps = space.flows[metric.index or 0].steps
    waits = any(step.kind == "connection" and may_wait_for(space, step.index) for step in steps)
    return (
        waits
        or counts_responses(space)
        or any(may_be_stored(space, step) or may_wait_for_inputs(space, step) for step in steps)
    )


def unbounded_from(space: Space, metric: Metric) -> Fraction:
    """A metric, in its base unit, with one response time without a bound in it is no less than twice this.

    Values from here on are shown as *unbounded*, since every finite value is far below.
    """
    dimension = metric_dimension(space, metric)
    shown = display_unit(dimension)[1] if dimension is not None else Fraction(1)
    return Fraction(UNBOUNDED_NS, 2 * NS_PER_S) * _least_weight(space, metric) * shown


def _least_weight(space: Space, metric: Metric) -> Fraction:
    """The least weight with which the response times of a metric count in it, in coherent units."""
    terms = _terms(space, metric)
    return min((abs(times) * _least_weight(space, inner) for times, inner in terms), default=Fraction(1))


def _terms(space: Space, metric: Metric) -> list[tuple[Fraction, Metric]]:
    """The terms of a derived metric, or of the sums that an extreme is taken of, that are there."""
    return [(times.value, inner) for times, inner in parts_of(space, metric) if times.value]


# What may be late because a processor is overloaded: whatever the design, and so perhaps more than in a given one.


Place: TypeAlias = tuple[int, int | None]
"""A processor, and a core of it where that is stated; None stands for any of them."""


def delayed_by(space: Space, processors: Iterable[int]) -> frozenset[int]:
    """The components, by number, that may wait for what runs on some processors, by number.

    They are those that may run there, those that one of them triggers, the other pieces of their threads, and what may
    share a core with the latter two. Where messages wait for buses that may be any.
    """
    if counted_buses(space):
        return frozenset(range(len(space.components)))
    reached: set[Place] = {(processor, None) for processor in processors}
    delayed = set[int]()
    while True:
        more = {number for number, item in enumerate(space.components) if _meet(_places(item), reached)}
        led_to = {number for number in range(len(space.components)) if _follows(space, number, more | delayed)}
        places = {place for number in led_to for place in _places(space.components[number])}
        if more | led_to <= delayed and places <= reached:
            return frozenset(delayed)
        delayed |= more | led_to
        reached |= places


def _meet(places: set[Place], others: set[Place]) -> bool:
    """Whether some of these places may be the same."""
    return any(
        one == another and (core is None or other is None or core == other)
        for one, core in places
        for another, other in others
    )


def may_be_delayed(space: Space, metric: Metric, components: frozenset[int]) -> bool:
    """Whether response times of some components, by number, count in a metric.

    Recursive over derived metrics and extremes.
    """
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
