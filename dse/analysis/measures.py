"""Metrics as sums of terms: CPU utilisation, bus load and busy time, latency, price, power, totals, derived metrics.

A `Measure` is a sum of `Term`s; evaluating a design adds their values, the search tabulates them, and a report prints
them: there is one formula for all three. Values are exact; `Measure.integer` counts them in units of 1 / `scale`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from math import lcm
from typing import Literal

from dse.analysis.binding import bus_stack
from dse.analysis.latency.metrics import flow_terms, input_terms, message_term, up_to
from dse.analysis.scheduling.responses import UNBOUNDED_NS, bounded_response_ns
from dse.analysis.scheduling.tasks import always_executes, elapsed_ns
from dse.analysis.terms import (
    PPM,
    SCALE_LIMIT,
    ZERO,
    ExtremeOfSums,
    Measure,
    Term,
    exact_sum,
    extreme_term,
    scaled_term,
)
from dse.analysis.timescale import RESPONSE_SCALE_LIMIT, latency_scale, whole_time_scale
from dse.analysis.usage import (
    busy_scale,
    busy_terms,
    load_scale,
    load_terms,
    reachable_buses,
    utilisation_scale,
    utilisation_terms,
)
from dse.analysis.views import View, is_met
from dse.space.model.criteria import Metric
from dse.space.model.metric_kinds import (
    CHAIN_METRICS,
    EXACT_METRICS,
    FLOW_METRICS,
    INPUT_METRICS,
    SYSTEM_METRICS,
    asks_for_changes,
    metric_dimension,
    plugged_metric,
    total_unit,
)
from dse.space.model.space import Bus, Component, Decision, Slot, Space
from dse.space.model.trees import Tree, at, leaves
from dse.space.question.metrics import all_disparities, busy_obstacle, core_metric, has_age, has_exact, most_cores
from dse.space.question.open_cores import tells_cores_apart
from dse.support.units import (
    BASES,
    DATA,
    DATA_RATE,
    DIMENSIONLESS,
    FREQUENCY,
    LENGTH,
    MONEY,
    POWER,
    TIME,
    Dimension,
    Quantity,
)

__all__ = [
    "PPM",
    "SCALE_LIMIT",
    "ZERO",
    "Measure",
    "Term",
    "all_metrics",
    "build_measure",
    "display_unit",
    "exact_sum",
    "load_terms",
    "reachable_buses",
    "scaled_term",
    "utilisation_terms",
]


DISPLAY: dict[Dimension, tuple[str, Fraction]] = {
    TIME: ("ns", Fraction(10**9)),
    LENGTH: ("nm", Fraction(10**9)),
    DATA: ("B", Fraction(1)),
    DATA_RATE: ("B/s", Fraction(1)),
    FREQUENCY: ("Hz", Fraction(1)),
    MONEY: ("ct", Fraction(1)),
    POWER: ("mW", Fraction(1000)),
    DIMENSIONLESS: ("ppm", Fraction(PPM)),
}


def build_measure(space: Space, metric: Metric, *, counted: bool = True) -> Measure:
    """The measure of a resolved metric.

    Unless it is to be `counted` in whole units, sums of shares, rates and times are spared the search for a common
    denominator: only exact values may be asked of them.
    """
    formula = FORMULAS.get(metric.kind)
    if formula is not None:
        return formula(space, metric, counted)
    plugin = plugged_metric(metric.kind)
    assert plugin is not None  # whoever read the metric has found it
    measure = plugin.measure(space, metric)
    assert isinstance(measure, Measure)
    return measure


def _of_flow(space: Space, metric: Metric, counted: bool) -> Measure:
    flow = space.flows[metric.index or 0]
    scale = latency_scale(space, flow) if counted else (1,)
    return _scaled(metric, "ns", tuple(flow_terms(space, flow, metric.kind)), *scale)


def _of_input(space: Space, metric: Metric, counted: bool) -> Measure:
    flow = up_to(space.flows[metric.index or 0], int(metric.key))
    scale = latency_scale(space, flow) if counted else (1,)
    return _scaled(metric, "ns", tuple(input_terms(space, flow, metric.kind)), *scale)


def _utilisation(space: Space, metric: Metric, counted: bool) -> Measure:
    terms = utilisation_terms(space, metric.index or 0, int(metric.key) if metric.key else None)
    return _scaled(metric, "ppm", terms, utilisation_scale(space, terms) if counted else 1)


def _of_bus(space: Space, metric: Metric, counted: bool) -> Measure:
    """The load of a bus in B/s, or the share of time in which it is busy in ppm."""
    is_load, number = metric.kind == "load", metric.index or 0
    terms = (load_terms if is_load else busy_terms)(space, number)
    scale = (load_scale if is_load else busy_scale)(space, number, terms) if counted else 1
    return _scaled(metric, "B/s" if is_load else "ppm", terms, scale)


def _response_time(space: Space, metric: Metric, counted: bool) -> Measure:
    term = _response_term(space, metric.index or 0)
    return _scaled(metric, "ns", (term,), whole_time_scale(space) if counted else 1, RESPONSE_SCALE_LIMIT)


def _message_response(space: Space, metric: Metric, counted: bool) -> Measure:
    terms, scale = (message_term(space, metric.index or 0),), whole_time_scale(space) if counted else 1
    return _scaled(metric, "ns", terms, scale, RESPONSE_SCALE_LIMIT)


def _figures(space: Space, metric: Metric, _: bool) -> Measure:
    """Price, power and declared totals."""
    unit = {"price": "ct", "power": "mW"}.get(metric.kind, space.totals.get(metric.key, ""))
    trees = list(_figure_trees(space, metric))
    scale = lcm(*(Fraction(leaf).denominator for _, tree in trees for leaf in leaves(tree) if leaf is not None))
    return _scaled(metric, unit, tuple(_figure_term(space, item, tree) for item, tree in trees), scale)


def _scaled(metric: Metric, unit: str, terms: tuple[Term, ...], scale: int, limit: int | None = None) -> Measure:
    finest = SCALE_LIMIT if limit is None else limit
    return Measure(metric, unit, terms, min(scale, finest), rounded=scale > finest)


def _response_term(space: Space, number: int) -> Term:
    """The worst response time of a thread, or of its timer where it is hybrid."""
    name = space.components[number].name

    def value(view: View) -> Fraction:
        return ZERO + bounded_response_ns(space, number, "thread", view)

    executes = always_executes(space, number)

    def ends(view: View) -> tuple[Fraction, Fraction]:
        least = ZERO + elapsed_ns(space, number, view)[1]
        return least, least + UNBOUNDED_NS

    waits = (number, Fraction(1)) if executes else None
    return Term(name, value, component=name, ends=ends, waits=waits, only_waits=executes, grows=True)


def _figure_trees(space: Space, metric: Metric) -> Iterator[tuple[Slot | Component, Tree]]:
    """The figures that a price, power or total sums: of every slot and component, or of the one that `of` names.

    Source: docs/semantics.md, section 6.
    """
    items: Sequence[Slot | Component] = (*space.processors, *space.buses, *space.components)
    for item in items:
        figures = item.figures
        if metric.of and metric.of != item.name:
            continue
        tree = {"price": figures.price_ct, "power": figures.power_mw}.get(metric.kind)
        if metric.kind == "total":
            tree = figures.totals.get(metric.key)
        if tree is not None:
            yield item, tree


def _figure_term(space: Space, item: Slot | Component, tree: Tree) -> Term:
    """A figure of a slot or component; a virtual bus type used directly has it where something is bound to it."""
    if not (isinstance(item, Bus) and item.direct):
        return Term(item.name, lambda view: ZERO + (at(tree, view) or 0))
    number = space.buses.index(item)
    users = [wire for wire in space.connections if number in reachable_buses(space, wire)]

    def value(view: View) -> Fraction:
        used = any(number in bus_stack(space, wire, view) for wire in users)
        return ZERO + (at(tree, view) or 0) if used else ZERO

    return Term(item.name, value)


def _extreme(space: Space, metric: Metric) -> Measure:
    """The greatest or least of several sums of metrics, counted in the unit of them all."""
    measures = [_sum(space, metric, operand) for operand in metric.operands]
    sums = tuple(measure.terms for measure in measures)
    scale = lcm(*(measure.scale if not measure.rounded else SCALE_LIMIT + 1 for measure in measures))
    kind: Literal["max", "min"] = "max" if metric.kind == "max" else "min"
    term = extreme_term(metric.name, ExtremeOfSums(kind, sums))
    return _scaled(metric, measures[0].unit, (term,) if len(sums) > 1 else sums[0], scale)


def _sum(space: Space, metric: Metric, parts: Sequence[tuple[Quantity, Metric]]) -> Measure:
    """A sum of metrics, each times an exact constant."""
    dimension = metric_dimension(space, metric)
    unit, factor = display_unit(dimension) if dimension is not None else (total_unit(space, metric), Fraction(1))
    terms: list[Term] = []
    scale = 1
    for coefficient, inner_metric in parts:
        inner = build_measure(space, inner_metric)
        inner_dimension = metric_dimension(space, inner_metric)
        inner_factor = display_unit(inner_dimension)[1] if inner_dimension is not None else Fraction(1)
        times = coefficient.value * factor / inner_factor
        terms += [scaled_term(term, times) for term in inner.terms]
        scale = lcm(scale, inner.scale * times.denominator) if not inner.rounded else SCALE_LIMIT + 1
    return _scaled(metric, unit, tuple(terms), scale)


def display_unit(dimension: Dimension) -> tuple[str, Fraction]:
    """The unit in which results count a dimension, and how many of it make one coherent unit.

    A pair (name, number), such as ``("ns", 10⁹)`` for times. Other dimensions get a product of base units.
    """
    if dimension in DISPLAY:
        return DISPLAY[dimension]
    return " ".join(f"{base}^{power}" for base, power in zip(BASES, dimension, strict=True) if power), Fraction(1)


def all_metrics(space: Space) -> tuple[Metric, ...]:
    """Every metric that a result lists: flows, processors, buses, system totals, derived metrics, changes if asked.

    In the order in which results list them. Ages and exact latencies are left out for flows where they are not defined.
    """
    metrics: list[Metric] = []
    for number, flow in enumerate(space.flows):
        kinds = (*FLOW_METRICS, *CHAIN_METRICS) if any(step.since for step in flow.steps) else FLOW_METRICS
        left_out = {
            *(() if has_age(space, flow) else ("data age",)),
            *(() if has_exact(space, flow) else EXACT_METRICS),
        }
        metrics += [Metric(f"{kind} of {flow.name}", kind, number) for kind in kinds if kind not in left_out]
    if any(step.since for flow in space.flows for step in flow.steps):
        metrics += all_disparities(space, range(len(space.components)))
    metrics += [Metric(f"utilisation of {slot.name}", "utilisation", n) for n, slot in enumerate(space.processors)]
    metrics += _core_metrics(space)
    metrics += [Metric(f"load of {space.buses[n].name}", "load", n) for n in loaded_buses(space)]
    metrics += [
        Metric(f"busy of {bus.name}", "busy", n) for n, bus in enumerate(space.buses) if not busy_obstacle(space, n)
    ]
    metrics += [Metric("price", "price", None, "price"), Metric("power", "power", None, "power")]
    metrics += [Metric(name, "total", None, name) for name in space.totals]
    metrics += [Metric(item.name, "derived", number) for number, item in enumerate(space.derived)]
    if asks_for_changes(space):
        metrics.append(Metric("changes", "changes"))
    return tuple(metrics)


def loaded_buses(space: Space) -> list[int]:
    """The buses, without types of virtual buses that only wrap messages: nothing is ever bound to them.

    Indices of buses, in their order.
    """
    wraps = {one for bus in space.buses for protocols in leaves(bus.protocols) for one in protocols}
    wraps |= {one for item in space.connections for one in item.protocols}
    wraps -= {number for item in space.connections for number in reachable_buses(space, item)}
    return [number for number, bus in enumerate(space.buses) if not bus.direct or number not in wraps]


def _core_metrics(space: Space) -> Iterator[Metric]:
    """The utilisation of each core of processors with several where the core of every thread there is stated.

    Or chosen, where something tells cores apart; else equal cores may change places, and their figures with them.
    """
    apart = tells_cores_apart(space)
    for number in range(len(space.processors)):
        here = [item for item in space.components if item.processor is not None and number in leaves(item.processor)]
        is_told = all(isinstance(item.core, int) or (apart and item.core is not None) for item in here)
        if here and is_told and most_cores(space, number) > 1:
            yield from (core_metric(space, number, core) for core in range(1, most_cores(space, number) + 1))


FORMULAS: Mapping[str, Callable[[Space, Metric, bool], Measure]] = {
    **dict.fromkeys((*FLOW_METRICS, *CHAIN_METRICS), _of_flow),
    **dict.fromkeys(INPUT_METRICS, _of_input),
    **dict.fromkeys(("utilisation", "core utilisation"), _utilisation),
    "load": _of_bus,
    "busy": _of_bus,
    "response time": _response_time,
    "message response": _message_response,
    **dict.fromkeys((*SYSTEM_METRICS, "total"), _figures),
    "changes": lambda space, metric, _: Measure(metric, "", _change_terms(space)),
    "derived": lambda space, metric, _: _sum(space, metric, space.derived[metric.index or 0].terms),
    **dict.fromkeys(("max", "min"), lambda space, metric, _: _extreme(space, metric)),
}
"""How a design has a metric of each kind: its measure, counted in whole units if so asked."""


# What a design changes against the baseline that the problem file states (docs/semantics.md, section 6.1).


def counted_decisions(space: Space) -> Iterator[tuple[int, Decision, int]]:
    """The open decisions that the baseline states, each with its index and the option that the baseline has.

    What the baseline leaves out is not counted, nor on which core of its processor a thread runs,
    and in which order where the best one is asked for.
    """
    for index, decision in enumerate(space.decisions[: space.first_open]):
        if index in space.baseline and decision.is_open:
            yield index, decision, space.baseline[index]


def _change_terms(space: Space) -> tuple[Term, ...]:
    """A summand for each decision: what it costs where a design uses it and has another option than the baseline."""
    return tuple(
        _term(index, decision, option, space.cost_of_change.get(index, 1))
        for index, decision, option in counted_decisions(space)
    )


def _term(index: int, decision: Decision, option: int, cost: int) -> Term:
    def value(view: View) -> Fraction:
        return Fraction(cost if _differs(decision, index, option, view) else 0)

    return Term(decision.name, value, component=decision.component)


def _differs(decision: Decision, index: int, option: int, view: View) -> bool:
    return is_met(decision, index, view) and view[index] != option


def changed_decisions(space: Space, view: View) -> dict[str, int]:
    """The names of the decisions that a design changes, each with its cost, in the order of the file.

    A change costs 1 where the file states no `cost_of_change` for it.
    """
    return {
        decision.name: space.cost_of_change.get(index, 1)
        for index, decision, option in counted_decisions(space)
        if _differs(decision, index, option, view)
    }


def cost_of_changes(space: Space, view: View) -> int:
    """The figure of ``changes`` for a design.

    The sum over changed decisions of the baseline, 1 for each unless `cost_of_change` says otherwise.
    """
    return sum(changed_decisions(space, view).values())
