"""Which response times have no bound: `UNBOUNDED_NS` stands for them in sums, and is never shown to people."""

from __future__ import annotations

from fractions import Fraction

from dse.analysis.latency import flow_rows
from dse.analysis.measures import display_unit
from dse.analysis.rates import NS_PER_S
from dse.analysis.rows import UNBOUNDED_METHOD, counts_responses
from dse.analysis.scheduling import UNBOUNDED_NS, bounded_response_ns
from dse.analysis.views import View
from dse.space.metrics import metric_dimension
from dse.space.types import Metric, Space


def unbounded_in(space: Space, metric: Metric, view: View) -> tuple[str, ...]:
    """The threads in a metric of a design whose response time has no bound, in the order of the flow.

    Empty for a metric that counts no response times, and where all of them are bounded.
    """
    if metric.kind == "derived":
        inner = (item for _, item in _terms(space, metric))
        return tuple(dict.fromkeys(name for item in inner for name in unbounded_in(space, item, view)))
    if metric.kind in ("latency", "jitter"):
        rows = flow_rows(space, space.flows[metric.index or 0], view)
        return tuple(dict.fromkeys(row.contributor for row in rows if row.max_method == UNBOUNDED_METHOD))
    if metric.kind == "response time":
        number = metric.index or 0
        if bounded_response_ns(space, number, "thread", view) >= UNBOUNDED_NS:
            return (space.components[number].name,)
    return ()


def may_be_unbounded(space: Space, metric: Metric) -> bool:
    """Whether response times count in a metric."""
    if metric.kind == "derived":
        return any(may_be_unbounded(space, inner) for times, inner in _terms(space, metric))
    return metric.kind == "response time" or (metric.kind in ("latency", "jitter") and counts_responses(space))


def unbounded_from(space: Space, metric: Metric) -> Fraction:
    """A metric, in its base unit, with one response time without a bound in it is no less than twice this."""
    dimension = metric_dimension(space, metric)
    shown = display_unit(dimension)[1] if dimension is not None else Fraction(1)
    return Fraction(UNBOUNDED_NS, 2 * NS_PER_S) * _least_weight(space, metric) * shown


def _least_weight(space: Space, metric: Metric) -> Fraction:
    """The least weight with which the response times of a metric count in it, in coherent units."""
    if metric.kind != "derived":
        return Fraction(1)
    return min(abs(times) * _least_weight(space, inner) for times, inner in _terms(space, metric))


def _terms(space: Space, metric: Metric) -> list[tuple[Fraction, Metric]]:
    """The terms of a derived metric that are there."""
    return [(times.value, inner) for times, inner in space.derived[metric.index or 0].terms if times.value]
