"""The kinds of metrics: their names, their dimensions, and what those made of others are made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from dse.space.model.criteria import Metric
from dse.space.model.space import Space
from dse.support.errors import UsageError
from dse.support.plugins import plugged
from dse.support.units import DATA_RATE, DIMENSIONLESS, MONEY, POWER, TIME, Dimension, Quantity


class MetricKind(NamedTuple):
    """The element that a metric is about (flow, processor, bus, component, thread; "": the system) and its dimension.

    A count has no dimension.
    """

    of: str
    dimension: Dimension | None


FLOW_METRICS = ("latency", "min latency", "jitter")
EXACT_METRICS = ("exact latency", "exact min latency", "exact jitter")
CHAIN_METRICS = ("run jitter", "reaction time", "data age", *EXACT_METRICS)
"""Of flows, too: listed where a problem speaks of clocks, and wherever they are asked for."""
INPUT_METRICS = ("oldest input", "newest input")
"""How old what a component reads at the end of a flow is at most and at least: of these disparities are made."""
KINDS: Mapping[str, MetricKind] = {
    **dict.fromkeys((*FLOW_METRICS, *CHAIN_METRICS), MetricKind("flow", TIME)),
    "disparity": MetricKind("component", TIME),
    "utilisation": MetricKind("processor", DIMENSIONLESS),
    "load": MetricKind("bus", DATA_RATE),
    "busy": MetricKind("bus", DIMENSIONLESS),
    "response time": MetricKind("thread", TIME),
    "price": MetricKind("", MONEY),
    "power": MetricKind("", POWER),
    "changes": MetricKind("", None),
}
"""The metrics that a file may ask for, by name, besides those that it makes itself; how a design has them is a formula
of `dse.analysis.measures`."""
INNER = {
    **dict.fromkeys(INPUT_METRICS, KINDS["latency"]),
    "core utilisation": KINDS["utilisation"],
    "message response": MetricKind("connection", TIME),
}
"""Kinds that are asked for in other words."""
MADE = ("total", "derived", "max", "min")
"""Kinds of metrics that a problem file makes itself."""
BUILT_IN = tuple(KINDS)
SHARES = tuple(name for name, kind in {**KINDS, **INNER}.items() if kind.dimension == DIMENSIONLESS)
SYSTEM_METRICS = ("price", "power")
"""Figures that every part may have."""
RESERVED = (*BUILT_IN, "utilization", "max latency", "maximum latency", "minimum latency")


@dataclass(frozen=True)
class MetricPlugin:
    """A metric of another package, to which an entry point ``dse.metrics`` leads.

    `name` is what problem files call it, `of` what it is measured of (``flow``, ``processor``, ``bus``, ``component``,
    or "" for the whole system), `dimension` that of its values (None: it counts). `measure` gives the
    `dse.analysis.measures.Measure` of the metric in a space: terms that are added up, their unit, and a denominator
    in which they are whole numbers.
    """

    name: str
    of: str
    dimension: Dimension | None
    measure: Callable[[Space, Metric], Any]


def plugged_metric(name: str) -> MetricPlugin | None:
    """The metric of another package that has this name.

    Raises
    ------
    UsageError
        when an entry point leads to something else, or to a metric that dse has itself.
    """
    plugin = None
    for point, item in plugged("dse.metrics"):
        if not isinstance(item, MetricPlugin):
            raise UsageError(f"plug-in {point!r}: expected a dse.space.model.metric_kinds.MetricPlugin; got {item!r}")
        if item.name in RESERVED:
            raise UsageError(f"plug-in {point!r}: there is a metric {item.name!r} already")
        plugin = item if item.name == name else plugin
    return plugin


def metric_dimension(space: Space, metric: Metric) -> Dimension | None:
    """The dimension of a metric; None for a declared total, whose unit is the user's own, and for a count.

    For a sum the product of the first term's constant and metric; all terms have one dimension.
    """
    parts = parts_of(space, metric)
    if parts:
        coefficient, inner = parts[0]
        inner_dimension = metric_dimension(space, inner)
        if inner_dimension is None or coefficient.dimension is None:
            return None
        return coefficient.dimension.times(inner_dimension)
    kind = KINDS.get(metric.kind) or INNER.get(metric.kind)
    if kind is None and metric.kind not in MADE:
        plugin = plugged_metric(metric.kind)
        return plugin.dimension if plugin is not None else None
    return kind.dimension if kind is not None else None


def parts_of(space: Space, metric: Metric) -> Sequence[tuple[Quantity, Metric]]:
    """The metrics that a derived one or an extreme is made of, with their constants; nothing for others.

    Pairs of a constant with its unit and a metric.
    """
    if metric.kind == "derived":
        return space.derived[metric.index or 0].terms
    return [part for operand in metric.operands for part in operand]


def flows_in(space: Space, metric: Metric) -> frozenset[str]:
    """The flows of which a metric is, or of which some are that it is made of.

    Names; recursive over derived metrics and extremes.
    """
    if metric.kind in (*FLOW_METRICS, *CHAIN_METRICS, *INPUT_METRICS):
        return frozenset({space.flows[metric.index or 0].name})
    return frozenset(name for _, inner in parts_of(space, metric) for name in flows_in(space, inner))


def is_of_message(space: Space, metric: Metric) -> bool:
    """Whether a metric is the response time of a message, or is made of some.

    Recursive over derived metrics and extremes.
    """
    return metric.kind == "message response" or any(is_of_message(space, inner) for _, inner in parts_of(space, metric))


def counts_changes(space: Space, metric: Metric) -> bool:
    """Whether a metric counts, or is made of what counts, changes against the baseline.

    Recursive over derived metrics and extremes.
    """
    return metric.kind == "changes" or any(counts_changes(space, inner) for _, inner in parts_of(space, metric))


def asks_for_changes(space: Space) -> bool:
    """Whether a requirement, an objective or a derived metric counts changes against the baseline.

    Only then costs of changes are computed and shown.
    """
    metrics = [item.metric for item in space.requirements] + [item.metric for item in space.objectives]
    derived = [inner for item in space.derived for _, inner in item.terms]
    return any(counts_changes(space, metric) for metric in (*metrics, *derived))


def total_unit(space: Space, metric: Metric) -> str:
    """The unit of a declared total, or of a metric made of such; a count has none.

    Text as declared in ``totals`` of the file.
    """
    while parts := parts_of(space, metric):
        metric = parts[0][1]
    return space.totals.get(metric.key, "")
