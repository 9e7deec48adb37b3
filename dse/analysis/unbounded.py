"""Which response times have no bound: `UNBOUNDED_NS` stands for them in sums, and is never shown to people."""

from __future__ import annotations

from fractions import Fraction

from dse.analysis.flow_terms import flow_figure_ns
from dse.analysis.latency import flow_rows
from dse.analysis.measures import display_unit
from dse.analysis.rates import NS_PER_S
from dse.analysis.rows import UNBOUNDED_METHOD, counts_responses
from dse.analysis.scheduling import UNBOUNDED_NS, bounded_response_ns
from dse.analysis.views import View
from dse.space.criteria import Metric
from dse.space.metric_kinds import metric_dimension, parts_of
from dse.space.types import Space


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
        return tuple(dict.fromkeys(row.contributor for row in rows if row.max_method == UNBOUNDED_METHOD))
    if metric.kind == "response time":
        number = metric.index or 0
        if bounded_response_ns(space, number, "thread", view) >= UNBOUNDED_NS:
            return (space.components[number].name,)
    return ()


def _unbounded_extreme(space: Space, metric: Metric, view: View) -> tuple[str, ...]:
    """The same of the greatest or least of several sums: one that has no bound the other way is not what is picked."""
    wanted = 1 if metric.kind == "max" else -1
    picked: list[tuple[list[str], set[int]]] = []
    others: list[tuple[list[str], set[int]]] = []
    for terms in metric.operands:
        found = [(times.value, unbounded_in(space, inner, view)) for times, inner in terms if times.value]
        names = [name for _, names in found for name in names]
        ways = {1 if times > 0 else -1 for times, unbounded in found if unbounded}
        (picked if wanted in ways else others).append((names, ways))
    if picked:
        return tuple(dict.fromkeys(name for names, _ in picked for name in names))
    if all(ways for _, ways in others):
        return tuple(dict.fromkeys(name for names, _ in others for name in names))
    return ()


def may_be_unbounded(space: Space, metric: Metric) -> bool:
    """Whether response times count in a metric."""
    if metric.operands or metric.kind == "derived":
        return any(may_be_unbounded(space, inner) for _, inner in _terms(space, metric))
    return metric.kind == "response time" or (metric.kind in ("latency", "jitter") and counts_responses(space))


def unbounded_from(space: Space, metric: Metric) -> Fraction:
    """A metric, in its base unit, with one response time without a bound in it is no less than twice this."""
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
