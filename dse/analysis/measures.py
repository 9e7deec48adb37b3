"""Metrics as sums of terms: CPU utilisation, bus load and busy time, latency, price, power, totals, derived metrics.

A `Measure` is a sum of `Term`s; evaluating a design adds their values, the search tabulates them, and a report prints
them: there is one formula for all three. Values are exact; `Measure.integer` counts them in units of 1 / `scale`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from math import lcm
from typing import Literal

from dse.analysis.binding import bit_times_ns, bus_stack, byte_times_ns
from dse.analysis.chains import exact_range_ns
from dse.analysis.changes import change_terms
from dse.analysis.clocks import LET
from dse.analysis.latency import element_rows, elements_of, phased_parts, run_spread_ns
from dse.analysis.memo import Recall
from dse.analysis.osate import Place, place_rows, place_step, rivals, waiting_for_ns
from dse.analysis.rates import is_periodic
from dse.analysis.resources import (
    busy_scale,
    busy_terms,
    load_scale,
    load_terms,
    reachable_buses,
    utilisation_scale,
    utilisation_terms,
)
from dse.analysis.rows import counts_responses
from dse.analysis.scheduling import UNBOUNDED_NS, bounded_response_ns
from dse.analysis.tasks import longest_alone_ns
from dse.analysis.terms import (
    PPM,
    SCALE_LIMIT,
    ZERO,
    Extreme,
    Measure,
    Phased,
    Sampled,
    Term,
    exact_sum,
    extreme_term,
    scaled_term,
)
from dse.analysis.views import View
from dse.space.clocks import is_always_timed
from dse.space.cores import tells_cores_apart
from dse.space.criteria import Metric
from dse.space.frames import Frame
from dse.space.metric_kinds import (
    CHAIN_METRICS,
    FLOW_METRICS,
    INPUT_METRICS,
    asks_for_changes,
    metric_dimension,
    total_unit,
)
from dse.space.metrics import busy_obstacle, core_metric, has_age, most_cores
from dse.space.slots import wrapping
from dse.space.trees import FROM_BANDWIDTH, Choice, PerProcessorType, Tree, at, leaves
from dse.space.types import Bus, Component, Flow, Slot, Space, Step
from dse.units import DATA, DATA_RATE, DIMENSIONLESS, FREQUENCY, LENGTH, MONEY, POWER, TIME, Dimension, Exact, Quantity

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

EXACT_KINDS = {"exact latency": "latency", "exact min latency": "min latency", "exact jitter": "jitter"}
TIME_SCALE_LIMIT = 1000
"""The finest unit of times, which are counted in ps at the finest: sums of hours of them are exact for the solver."""
RESPONSE_SCALE_LIMIT = 10
"""The same where response times are in them, for which `UNBOUNDED_NS` may stand."""

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

    Unless it is to be `counted` in whole units, sums of shares and rates are spared the search for a common
    denominator: only exact values may be asked of them.
    """
    if metric.kind in (*FLOW_METRICS, *CHAIN_METRICS):
        flow = space.flows[metric.index or 0]
        return _scaled(metric, "ns", tuple(_flow_terms(space, flow, metric.kind)), *_latency_scale(space, flow))
    number = metric.index or 0
    if metric.kind in INPUT_METRICS:
        flow = _up_to(space.flows[number], int(metric.key))
        return _scaled(metric, "ns", tuple(_input_terms(space, flow, metric.kind)), *_latency_scale(space, flow))
    if metric.kind in ("utilisation", "core utilisation"):
        terms = utilisation_terms(space, number, int(metric.key) if metric.key else None)
        return _scaled(metric, "ppm", terms, utilisation_scale(space, terms) if counted else 1)
    if metric.kind == "load":
        terms = load_terms(space, number)
        return _scaled(metric, "B/s", terms, load_scale(space, metric.index or 0, terms) if counted else 1)
    if metric.kind == "busy":
        terms = busy_terms(space, number)
        return _scaled(metric, "ppm", terms, busy_scale(space, number, terms) if counted else 1)
    if metric.kind == "response time":
        return _scaled(metric, "ns", (_response_term(space, number),), _whole_time_scale(space), RESPONSE_SCALE_LIMIT)
    if metric.kind == "changes":
        return Measure(metric, "", change_terms(space))
    if metric.kind == "derived":
        return _sum(space, metric, space.derived[metric.index or 0].terms)
    if metric.kind in ("max", "min"):
        return _extreme(space, metric)
    unit = {"price": "ct", "power": "mW"}.get(metric.kind, space.totals.get(metric.key, ""))
    trees = list(_figure_trees(space, metric))
    scale = lcm(*(Fraction(leaf).denominator for _, tree in trees for leaf in leaves(tree) if leaf is not None))
    return _scaled(metric, unit, tuple(_figure_term(space, item, tree) for item, tree in trees), scale)


def _scaled(metric: Metric, unit: str, terms: tuple[Term, ...], scale: int, limit: int | None = None) -> Measure:
    finest = SCALE_LIMIT if limit is None else limit
    return Measure(metric, unit, terms, min(scale, finest), rounded=scale > finest)


def _latency_scale(space: Space, flow: Flow) -> tuple[int, int]:
    """A denominator of every latency that the flow may have, and the finest in which it is counted.

    A response time depends on whatever releases and delays a thread, anywhere.
    """
    if space.processing == "response_time":
        return _whole_time_scale(space), RESPONSE_SCALE_LIMIT
    if space.profile != "dse":  # what waits, and what rounds up, consults others
        return _whole_time_scale(space), TIME_SCALE_LIMIT
    numbers = {kind: [step.index for step in flow.steps if step.kind == kind] for kind in ("component", "connection")}
    return _time_scale(space, numbers["component"], numbers["connection"]), TIME_SCALE_LIMIT


_SCALES: Recall[int] = Recall()


def _whole_time_scale(space: Space) -> int:
    """A common denominator of all times of a space, whatever the design; many metrics ask for it."""

    def scale(space: Space, _: object, __: View) -> int:
        return _time_scale(space, range(len(space.components)), range(len(space.connections)))

    return _SCALES.recall(space, "time", View(()), scale)


def _time_scale(space: Space, components: Iterable[int], connections: Iterable[int]) -> int:
    """A common denominator, in ns, of sums of the times of components and connections.

    Times of the file are whole but for what messages and their bytes take. Where inputs are uncertain, a space has all
    kinds of figures (`dse.study.functions`).
    """
    found = 1
    for component in (space.components[number] for number in components):
        times = (
            component.period_ns, component.execution_ns, component.callback_ns, component.latency_ns,
            component.deadline_ns, component.response_ns, component.stated_period_ns, component.offset_ns,
        )  # fmt: skip
        errors = [leaf.error_ns for leaf in leaves(component.clock) if leaf is not None]
        found = lcm(found, *(Fraction(error).denominator for error in errors))
        found = lcm(found, _denominator(*times) * _denominator(component.queue_size))
    for connection in (space.connections[number] for number in connections):
        anywhere = replace(connection, bus=connection.stated_bus)
        carried = reachable_buses(space, connection) | reachable_buses(space, anywhere)
        carried |= wrapping(space.buses, connection.protocols, carried)
        buses = [space.buses[number] for number in carried]
        times = (connection.latency_ns, *(tree for bus in buses for tree in (bus.fixed_ns, bus.latency_ns)))
        sizes = set(_numbers(connection.size_bytes, *(bus.overhead_bytes for bus in buses)))
        each = set(_numbers(*(bus.per_byte_ns for bus in buses))).union(*map(byte_times_ns, buses))
        found = lcm(found, _denominator(*times), *((one * size).denominator for one in each for size in sizes))
        found = lcm(found, *(unit.denominator for bus in buses for unit in bit_times_ns(bus)))
    return found


def _denominator(*trees: Tree) -> int:
    """The common denominator of all numbers in trees of numbers and time ranges."""
    return lcm(1, *(number.denominator for number in _numbers(*trees)))


def _numbers(*trees: Tree) -> Iterator[Fraction]:
    """Every number in trees of numbers and time ranges."""
    for leaf in (leaf for tree in trees for leaf in leaves(tree)):
        if isinstance(leaf, PerProcessorType):
            yield from _numbers(*leaf.by_type.values())
        elif leaf is not None and leaf is not FROM_BANDWIDTH and not isinstance(leaf, Frame):
            yield from map(Fraction, leaf if isinstance(leaf, tuple) else (leaf,))


def _flow_terms(space: Space, flow: Flow, kind: str) -> Iterator[Term]:
    """The summands of a metric of a flow (docs/semantics.md, sections 3.1 and 3.6)."""
    if kind in EXACT_KINDS:
        yield _exact_term(space, flow, EXACT_KINDS[kind])
        return
    yield from _latency_terms(space, flow, "latency" if kind in ("reaction time", "data age") else kind)
    if kind in ("reaction time", "data age"):
        yield Term(f"first period of {flow.name}", lambda view: ZERO + first_period_ns(space, flow, view))
    if kind == "data age":
        yield Term(f"last period of {flow.name}", lambda view: ZERO - last_period_ns(space, flow, view))


def _up_to(flow: Flow, number: int) -> Flow:
    """A flow until a component reads what came to it."""
    place = next(at for at, step in enumerate(flow.steps) if (step.kind, step.index) == ("component", number))
    return replace(flow, steps=(*flow.steps[:place], replace(flow.steps[place], only_reads=True)))


def _input_terms(space: Space, flow: Flow, kind: str) -> Iterator[Term]:
    """The age of what the last component of a flow reads, at most or at least (docs/semantics.md, section 3.6).

    At most that is the reduced latency and the first period, less that of the reader: what is read is the newest there.
    """
    if kind == "newest input":
        yield from _latency_terms(space, flow, "min latency")
        return
    yield from _latency_terms(space, flow, "latency")
    yield Term(f"first period of {flow.name}", lambda view: ZERO + first_period_ns(space, flow, view))
    yield Term(f"last period of {flow.name}", lambda view: ZERO - last_period_ns(space, flow, view))


def _exact_term(space: Space, flow: Flow, kind: str) -> Term:
    """The exact latency, minimum latency or jitter of a flow, from everything that is on it at once."""
    name = space.components[flow.steps[-1].index].name if flow.steps[-1].kind == "component" else ""

    def value(view: View) -> Fraction:
        return ZERO + _figure_of(kind, exact_range_ns(space, flow, view))

    def ends(view: View) -> tuple[Fraction, Fraction]:
        alone = replace(space, processing="execution_time")
        ranges = [_element_range_ns(alone, element, view) for element in elements_of(space, flow)]
        least, most = (sum((found[end] for found in ranges), ZERO) for end in (0, 1))
        jobs = sum(2 + _queue_size(space, step, view) for step in flow.steps if step.kind == "component")
        waits = sum(at(space.components[step.index].period_ns, view) or 0 for step in flow.steps if step.since)
        low = ZERO if kind == "jitter" else ZERO + least
        return low, ZERO + most + waits + jobs * UNBOUNDED_NS

    waits_for_cores = counts_responses(space) and kind != "min latency"
    return Term(flow.name, value, component=name, ends=ends if waits_for_cores else None)


def _latency_terms(space: Space, flow: Flow, kind: str) -> Iterator[Term]:
    """Sums over the rows of each element: maxima, minima, or maximum minus minimum (jitter)."""
    alone = replace(space, processing="execution_time")
    for element, step in zip(elements_of(space, flow), flow.steps, strict=True):
        names = space.components if step.kind == "component" else space.connections
        name = names[step.index].name
        if isinstance(element, Place):
            yield from _placed_terms(space, element, name, kind)
            continue

        def value(view: View, step: Step = step, space: Space = space) -> Fraction:
            figure: Fraction = ZERO + _figure_of(kind, _element_range_ns(space, step, view))
            if kind == "run jitter":
                figure += _run_excess_ns(space, step, view)
            return figure

        def ends(view: View, step: Step = step, value: Callable[..., Fraction] = value) -> tuple[Fraction, Fraction]:
            """Response times are no shorter than execution times; each counts for its job and for those queued."""
            least = value(view, step, alone)
            most = least + (2 + _queue_size(space, step, view)) * UNBOUNDED_NS
            if not _may_move(space, step, kind):
                return least, most
            period = at(space.components[step.index].period_ns, view) or 0  # how far sampling on one clock may move
            return least - period, most + period

        is_scheduled = step.kind == "component" and counts_responses(space) and kind != "min latency"
        is_scheduled = is_scheduled and _may_wait(space, step)
        counts = is_scheduled and not step.only_reads and _counts_waiting(space, step.index)
        waits = (step.index, Fraction(1)) if counts else None
        yield Term(
            name,
            value,
            ends=ends if is_scheduled else None,
            waits=waits,
            only_waits=waits is not None and not _may_move(space, step, kind) and _counts_waiting_once(space, step),
            phased=None if is_scheduled else _phased(space, step, kind),
            sampled=Sampled(space, step, kind) if step.since and step.kind == "component" else None,
        )


def _placed_terms(space: Space, place: Place, name: str, kind: str) -> Iterator[Term]:
    """The rows of an element in its place in a flow; what its message waits for each other connection is apart."""

    def value(view: View) -> Fraction:
        rows = place_rows(space, place, view, queues=False)
        sums = sum((row.min_ns for row in rows), ZERO), sum((row.max_ns for row in rows), ZERO)
        figure: Fraction = ZERO + _figure_of(kind, sums)
        return figure

    yield Term(name, value)
    if kind == "min latency" or place_step(space, place).kind == "component":
        return
    for other in rivals(space, place):

        def waiting(view: View, other: int = other) -> Fraction:
            return ZERO + waiting_for_ns(space, place, other, view)

        yield Term(name, waiting)


def _phased(space: Space, step: Step, kind: str) -> Phased | None:
    """Sampling on one clock taken apart, where both timers and their offsets are there in every design.

    Where clocks may be wrong the wait is cut at both ends, and stays whole.
    """
    earlier = [item.index for item in step.since if item.kind == "component"]
    if not earlier or space.profile != "dse":
        return None
    pair = [space.components[number] for number in (earlier[-1], step.index)]
    open_offsets = [isinstance(item.offset_ns, Choice) for item in pair]
    if not any(open_offsets) or not all(
        is_always_timed(item) and None not in set(leaves(item.offset_ns)) and not _may_be_wrong(item) for item in pair
    ):
        return None

    def parts(view: View) -> tuple[Fraction, tuple[tuple[Fraction, Exact, Exact], ...]]:
        (least, most), wait = phased_parts(space, step, view)
        base = ZERO + _figure_of(kind, (least, most))
        if wait is None:
            return base, ()
        soonest, latest, width = wait
        if kind == "min latency":
            return base, ((Fraction(1), soonest, width),)
        if kind == "latency":
            return base, ((Fraction(1), latest, width),)
        if (soonest - latest) % width == 0:
            return base, ()
        return base, ((Fraction(1), latest, width), (Fraction(-1), soonest, width))

    return Phased(earlier[-1], step.index, parts)


def _may_be_wrong(component: Component) -> bool:
    """Whether the clock of a component may be another than that of some others by an error."""
    return any(leaf is not None and leaf.error_ns for leaf in leaves(component.clock))


def _counts_waiting(space: Space, number: int) -> bool:
    """Whether the longest processing of a thread is its response time, whatever the design."""
    component = space.components[number]
    if component.processor is None:
        return False
    executes = all(leaf is not None for leaf in leaves(component.execution_ns))
    is_logical = LET in set(leaves(component.communication))
    return space.profile == "dse" and component.response_ns is None and executes and not is_logical


def _may_wait(space: Space, step: Step) -> bool:
    """Whether what an element of a flow adds may hang on response times: its own, or those before it on its clock."""
    here = space.components[step.index]
    if space.profile != "dse" or here.callback_ns is not None:
        return True
    asked = [here]
    for earlier in (space.components[item.index] for item in reversed(step.since) if item.kind == "component"):
        asked.append(earlier)
        if is_always_timed(earlier):
            break
    return any(set(leaves(item.communication)) != {LET} for item in asked)


def _may_move(space: Space, step: Step, kind: str) -> bool:
    """Whether sampling on one clock may be cut or spread by what is before an element of a flow."""
    return bool(step.since) and (kind == "run jitter" or space.components[step.index].offset_ns is not None)


def _counts_waiting_once(space: Space, step: Step) -> bool:
    """Whether an element of a flow has no rows that count a response time but that of processing."""
    component = space.components[step.index]
    sizes = [component.queue_size]
    if step.via is not None:
        sizes.append(space.connections[step.via].queue_size)
    is_hybrid = "hybrid" in set(leaves(component.protocol)) and component.callback_ns is not None
    return not is_hybrid and all(leaf is None for size in sizes for leaf in leaves(size))


def _figure_of(kind: str, range_ns: tuple[int | Fraction, int | Fraction]) -> int | Fraction:
    """The figure of a flow, or of an element of one, in ns."""
    least, most = range_ns
    return least if kind == "min latency" else most if kind == "latency" else most - least


_RANGES: Recall[tuple[int | Fraction, int | Fraction]] = Recall()


def flow_figure_ns(space: Space, metric: Metric, view: View) -> int | Fraction | None:
    """The latency, minimum latency or jitter of a flow at once; None for other metrics.

    The same as the measure's value. What an element of a flow adds depends on few decisions, and is remembered from
    design to design.
    """
    if metric.kind not in ("latency", "min latency", "jitter"):
        return None
    flow = space.flows[metric.index or 0]
    key = ("flow", metric.index)
    found: tuple[int | Fraction, int | Fraction] | None = view.memo.get(key)
    if found is None:
        ranges = [_RANGES.recall(space, item, view, _element_range_ns) for item in elements_of(space, flow)]
        found = view.memo[key] = (sum(least for least, _ in ranges), sum(most for _, most in ranges))
    return _figure_of(metric.kind, found)


def _queue_size(space: Space, step: Step, view: View) -> int:
    """The most jobs that a flow's queuing row may count for a step (OSATE counts one where no size is stated)."""
    sizes = [at(space.components[step.index].queue_size, view)]
    if step.via is not None:
        sizes.append(at(space.connections[step.via].queue_size, view))
    return max(1, *(int(size or 0) for size in sizes))


def _element_range_ns(space: Space, element: Step | Place, view: View) -> tuple[Exact, Exact]:
    """The least and most that an element of a flow adds; many flows and metrics ask for the same one."""
    key = ("element", element, space.processing)
    found: tuple[Exact, Exact] | None = view.memo.get(key)
    if found is None:
        rows = element_rows(space, element, view)
        found = (sum((row.min_ns for row in rows), ZERO), sum((row.max_ns for row in rows), ZERO))
        view.memo[key] = found
    return found


def _run_excess_ns(space: Space, step: Step, view: View) -> Exact:
    """How much less than the jitter over all runs an element of a flow adds to that of one run; not above 0."""
    spread = run_spread_ns(space, step, view) if step.kind == "component" else None
    return 0 if spread is None else spread - at(space.components[step.index].period_ns, view)


def first_period_ns(space: Space, flow: Flow, view: View) -> Exact:
    """The period of a flow's first component, 0 where no timer releases it: what is sensed waits for its release."""
    first = flow.steps[0]
    if first.kind != "component" or not is_periodic(space.components[first.index], view):
        return 0
    found: Exact = at(space.components[first.index].period_ns, view)
    return found


def last_period_ns(space: Space, flow: Flow, view: View) -> Exact:
    """The period of the last component of a flow that a timer releases, at which its output is renewed."""
    for step in reversed(flow.steps):
        if step.kind == "component" and is_periodic(space.components[step.index], view):
            found: Exact = at(space.components[step.index].period_ns, view)
            return found
    return 0


def _response_term(space: Space, number: int) -> Term:
    """The worst response time of a thread, or of its timer where it is hybrid."""
    name = space.components[number].name

    def value(view: View) -> Fraction:
        return ZERO + bounded_response_ns(space, number, "thread", view)

    executes = all(leaf is not None for leaf in leaves(space.components[number].execution_ns))

    def ends(view: View) -> tuple[Fraction, Fraction]:
        least = ZERO + longest_alone_ns(space, number, "thread", view)
        return least, least + UNBOUNDED_NS

    return Term(
        name, value, component=name, ends=ends, waits=(number, Fraction(1)) if executes else None, only_waits=executes
    )


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
    term = extreme_term(metric.name, Extreme(kind, sums))
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
    """The unit in which results count a dimension, and how many of it make one coherent unit."""
    if dimension in DISPLAY:
        return DISPLAY[dimension]
    bases = ("s", "m", "B", "ct", "W")
    return " ".join(f"{base}^{power}" for base, power in zip(bases, dimension, strict=True) if power), Fraction(1)


def all_metrics(space: Space) -> tuple[Metric, ...]:
    """Every metric that a result lists: flows, processors, buses, system totals, derived metrics, changes if asked."""
    metrics: list[Metric] = []
    for number, flow in enumerate(space.flows):
        kinds = (*FLOW_METRICS, *CHAIN_METRICS) if any(step.since for step in flow.steps) else FLOW_METRICS
        aged = has_age(space, flow)
        metrics += [Metric(f"{kind} of {flow.name}", kind, number) for kind in kinds if kind != "data age" or aged]
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
    """The buses, without types of virtual buses that only wrap messages: nothing is ever bound to them."""
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
