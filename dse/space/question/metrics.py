"""Metrics by name: what ``METRIC [of NAME]`` means, and of which kind it is.

The same functions serve the problem file (mistakes become diagnostics) and the command line (they become usage errors).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import permutations
from typing import Literal

from dse.space.architecture.carriers import by_type, carriers
from dse.space.architecture.clocks import is_always_timed
from dse.space.architecture.joins import may_join
from dse.space.model.criteria import Derived, Metric
from dse.space.model.flows import Flow, Step
from dse.space.model.metric_kinds import (
    BUILT_IN,
    EXACT_METRICS,
    KINDS,
    SYSTEM_METRICS,
    metric_dimension,
    plugged_metric,
    total_unit,
)
from dse.space.model.space import EMPTY, UNKNOWN_TYPE, Component, Space
from dse.space.model.trees import leaves
from dse.space.properties import closest
from dse.spec.language.expressions import DerivedExpr, ExtremeRef, MetricExpr, MetricRef
from dse.spec.language.grammar import parse_derived
from dse.spec.language.scan import unquoted
from dse.support.errors import Suggestion
from dse.support.timelimit import in_time
from dse.support.units import DIMENSIONLESS, Quantity, shown

MOST_REACH = 10**100
"""Factors of metrics make no more than this together, so that every figure can be written and read back."""
MOST_TERMS = 100_000
"""No derived metric adds more metrics, each counted as often as it is used."""
_CORE = re.compile(r"(?:core\s+(?P<core>[0-9]{1,9})|each\s+core)\s+of\s+(?P<processor>.+)", re.DOTALL)
_MEANT = {
    "cost": "price", "delay": "latency", "cpu": "utilisation", "cpu load": "utilisation",
    "cpu usage": "utilisation", "usage": "utilisation", "bandwidth": "load", "energy": "power", "variation": "jitter",
    "occupancy": "busy", "busy time": "busy", "bus utilisation": "busy",
}  # fmt: skip


class QuestionError(ValueError):
    """A question that does not fit the architecture: an unknown name, a unit of the wrong kind.

    `unknown` is the name that nothing has, where that is what is wrong.
    """

    def __init__(self, message: str, hint: str = "", *, unknown: str = "") -> None:
        super().__init__(f"{message} ({hint})" if hint else message)
        self.message, self.hint, self.unknown = message, hint, unknown


def resolve_metrics(space: Space, ref: MetricExpr) -> tuple[Metric, ...]:
    """Resolve ``METRIC [of NAME]``; several metrics where NAME is left out and there are several candidates.

    Raises
    ------
    QuestionError
        for an unknown metric or name.
    """
    if isinstance(ref, ExtremeRef):
        return (_extreme(space, ref),)
    kind = ref.metric
    if kind in _FINDERS:
        return _FINDERS[kind](space, ref.of)
    if kind in KINDS and KINDS[kind].of:
        return _indexed(space, kind, ref.of, KINDS[kind].of)
    declared = [*space.totals, *(item.name for item in space.derived)]
    if kind not in (*SYSTEM_METRICS, *declared):  # several blanks in a name are one in an expression
        kind = next((name for name in declared if " ".join(name.split()) == kind), kind)
    if kind in SYSTEM_METRICS or kind in space.totals:
        return (_system_metric(space, replace(ref, metric=kind)),)
    for number, derived in enumerate(space.derived):
        if derived.name == kind:
            if ref.of is not None:
                raise QuestionError(f"the derived metric {shown(kind)} has no `of`")
            return (Metric(kind, "derived", number),)
    plugin = plugged_metric(kind)
    if plugin is not None and plugin.of:
        return _indexed(space, kind, ref.of, plugin.of)
    if plugin is not None:
        if ref.of is not None:
            raise QuestionError(f"{shown(kind)} is a metric of the whole system: leave the `of` out")
        return (Metric(kind, kind),)
    known = [*BUILT_IN, *declared]
    meant = _MEANT.get(kind.lower())
    hint = f'did you mean "{meant}"?' if meant else closest(kind, known) or "known: " + ", ".join(known)
    raise QuestionError(f"unknown metric {shown(kind)}", Suggestion(hint), unknown=kind)


def _changes(space: Space, of: str | None) -> tuple[Metric, ...]:
    """How many decisions differ from the baseline, or what they cost."""
    if of is not None:
        raise QuestionError("changes are counted in the whole system: leave the `of` out")
    if not space.states_baseline:
        hint = 'such as "baseline: {my_thread: {period: 10 ms}}"'
        raise QuestionError("changes are counted from the baseline, and the problem states none", hint)
    return (Metric("changes", "changes"),)


def _system_metric(space: Space, ref: MetricRef) -> Metric:
    """A price, a power or a declared total: of a component, or of the whole system."""
    if ref.of is not None:
        named = [item.name for item in (*space.processors, *space.buses)]
        named += [item.name for item in space.components]
        if ref.of not in named:
            raise QuestionError(f"no component is called {shown(ref.of)}", closest(ref.of, named))
    kind = ref.metric if ref.metric in SYSTEM_METRICS else "total"
    return Metric(str(ref), kind, None, ref.metric, ref.of or "")


def _indexed(space: Space, kind: str, of: str | None, what: str) -> tuple[Metric, ...]:
    groups = {
        "flow": [item.name for item in space.flows],
        "processor": [item.name for item in space.processors],
        "bus": [item.name for item in space.buses],
        "component": [item.name for item in space.components],
    }
    names = groups[what]
    if of is None:
        if not names:
            raise QuestionError(f"there is no {what} to measure the {kind} of")
        return tuple(Metric(f"{kind} of {name}", kind, number) for number, name in enumerate(names))
    if of in names:
        return (Metric(f"{kind} of {of}", kind, names.index(of)),)
    other = next((word for word, others in groups.items() if of in others), None)
    if other is not None:
        raise QuestionError(f"{shown(of)} is a {other}, {kind} is measured of a {what}", closest(of, names))
    raise QuestionError(f"no {what} is called {shown(of)}", closest(of, names))


def _data_ages(space: Space, of: str | None) -> tuple[Metric, ...]:
    """The age of data of a flow whose first component samples, or of every such one."""
    metrics = _indexed(space, "data age", of, "flow")
    kept = tuple(metric for metric in metrics if has_age(space, space.flows[metric.index or 0]))
    if not kept:
        name = space.flows[metrics[0].index or 0].name
        raise QuestionError(f"the data age of {shown(name)} is not known: its first component may not be periodic")
    return kept


def _exact(kind: str, space: Space, of: str | None) -> tuple[Metric, ...]:
    """An exact figure of a flow, or of every one where it is defined: joins of all take messages of other flows."""
    metrics = _indexed(space, kind, of, "flow")
    kept = tuple(metric for metric in metrics if has_exact(space, space.flows[metric.index or 0]))
    if not kept:
        flow = space.flows[metrics[0].index or 0]
        name = next(space.components[step.index].stated_as for step in flow.steps if _joins(space, step))
        message = (
            f"the {kind} of {shown(flow.name)} is not defined: {shown(name)} waits for messages of other flows, too"
        )
        raise QuestionError(message, f"{kind.removeprefix('exact ')} of {flow.name} is a safe bound")
    return kept


def has_exact(space: Space, flow: Flow) -> bool:
    """Whether the exact latency of a flow is defined: no component on it waits for messages of other flows.

    Joins of several flows have no exact chain analysis.
    """
    return not any(_joins(space, step) for step in flow.steps)


def _joins(space: Space, step: Step) -> bool:
    return step.kind == "component" and step.via is not None and may_join(space.components[step.index])


def has_age(space: Space, flow: Flow) -> bool:
    """Whether a flow begins with a component that a timer releases, whatever the design.

    Data ages are measured from the release of that component.
    """
    first = flow.steps[0] if flow.steps else None
    if first is None or first.kind != "component":
        return False
    return is_always_timed(space.components[first.index])


def disparities(space: Space, of: str | None) -> tuple[Metric, ...]:
    """The disparity of the inputs of a fusion, or of every one: the largest difference of age of two flows that meet.

    It is the greatest, over each two of them, of the oldest input by the one less the newest by the other.

    Raises
    ------
    QuestionError
        where no two flows, which timers begin, meet at the component, or no timer releases it.
    """
    if space.profile != "dse":
        raise QuestionError("the disparity of inputs is defined under profile dse alone")
    names = [item.name for item in space.components]
    if of is not None and of not in names:
        raise QuestionError(f"no component is called {shown(of)}", closest(of, names))
    metrics = all_disparities(space, range(len(names)) if of is None else [names.index(of)])
    if not metrics:
        where = "at any component" if of is None else f"at {shown(of)}"
        hint = "two flows that begin with timers in every design have to lead there by different ways"
        hint += ", and a timer has to read them"
        if of is not None and not is_always_timed(space.components[names.index(of)]):
            hint = f"no timer releases {shown(of)} in every design"
        raise QuestionError(f"no two inputs whose ages can be compared meet {where}", hint)
    return metrics


def all_disparities(space: Space, numbers: Iterable[int]) -> tuple[Metric, ...]:
    """The disparities of those of some components at which flows meet, under the profile that defines them.

    One metric for each component with at least two flows; only under the profile *dse*.
    """
    if space.profile != "dse":
        return ()
    places: dict[int, dict[int, int]] = {}
    for index, flow in enumerate(space.flows):
        for at, step in enumerate(flow.steps):
            if step.kind == "component":
                places.setdefault(step.index, {}).setdefault(index, at)
    metrics = (_disparity(space, number, places[number]) for number in in_time(numbers) if number in places)
    return tuple(metric for metric in metrics if metric is not None)


def _disparity(space: Space, number: int, places: Mapping[int, int]) -> Metric | None:
    """The disparity of a component, with the place of its first step in each flow that passes it."""
    component, one = space.components[number], Quantity(Fraction(1), DIMENSIONLESS, "")
    ways: dict[tuple[tuple[str, int], ...], int] = {}
    for index, at in places.items():
        if at and has_age(space, space.flows[index]):
            ways.setdefault(tuple((step.kind, step.index) for step in space.flows[index].steps[:at]), index)
    if len(ways) < 2 or not is_always_timed(component):
        return None

    def part(sign: int, kind: str, flow: int) -> tuple[Quantity, Metric]:
        name = f"{kind} of {component.name} by {space.flows[flow].name}"
        return replace(one, value=Fraction(sign)), Metric(name, kind, flow, str(number))

    pairs = permutations(ways.values(), 2)
    operands = tuple((part(1, "oldest input", older), part(-1, "newest input", newer)) for older, newer in pairs)
    return Metric(f"disparity of {component.name}", "max", operands=operands)


def _core_metrics(space: Space, of: str | None) -> tuple[Metric, ...]:
    """The utilisation of ``core N of P``, or of ``each core of P``; nothing where `of` says no such thing.

    A core is used by the threads whose core is stated or chosen: asking for it makes open cores decisions.

    Raises
    ------
    QuestionError
        for a processor or core that is not there, or where first-fit puts a thread on some core.
    """
    names = [item.name for item in space.processors]
    match = _CORE.fullmatch(of) if of is not None and of not in names else None
    if match is None:
        return ()
    wanted, name = match["core"], unquoted(match["processor"])
    if name not in names:
        raise QuestionError(f"no processor is called {shown(name)}", closest(name, names))
    processor = names.index(name)
    count = most_cores(space, processor)
    if wanted is not None and not 1 <= int(wanted) <= count:
        raise QuestionError(f"core {wanted} of {shown(name)} does not exist: there are {count} at most")
    for item in by_first_fit(space, processor):
        hint = "state its core, or leave it open with `core: any`"
        raise QuestionError(f"on which core of {shown(name)} {shown(item.name)} runs is first-fit's to say", hint)
    cores = range(1, count + 1) if wanted is None else (int(wanted),)
    return tuple(core_metric(space, processor, core) for core in cores)


def core_metric(space: Space, processor: int, core: int) -> Metric:
    """The utilisation of a core, from 1.

    In ppm of the core; `processor` is an index, `core` counts from 1.
    """
    name = f"utilisation of core {core} of {space.processors[processor].name}"
    return Metric(name, "core utilisation", processor, str(core))


def most_cores(space: Space, processor: int) -> int:
    """The most cores that a processor may have.

    Over all types that the processor may have; at least 1.
    """
    return max([1, *map(int, leaves(space.processors[processor].cores))])


def by_first_fit(space: Space, processor: int) -> Iterator[Component]:
    """The threads that may run on a processor of several cores, and whose core is neither stated nor open.

    `Component` objects in the order of the file; nothing for a processor whose types all have one core.
    """
    is_open = {item.component for item in space.open_cores}
    for number, item in enumerate(space.components) if most_cores(space, processor) > 1 else ():
        may_run = item.processor is not None and processor in set(leaves(item.processor))
        if may_run and item.core is None and number not in is_open:
            yield item


def _busy(space: Space, of: str | None) -> tuple[Metric, ...]:
    """The busy time of a bus, or of every one where it can be computed."""
    metrics = _indexed(space, "busy", of, "bus")
    obstacles = [busy_obstacle(space, metric.index or 0) for metric in metrics]
    kept = tuple(metric for metric, obstacle in zip(metrics, obstacles, strict=True) if not obstacle)
    if not kept:
        raise QuestionError(f"the busy time of {shown(space.buses[metrics[0].index or 0].name)} {obstacles[0]}")
    return kept


def busy_obstacle(space: Space, number: int) -> str:
    """The reason why the busy time of a bus is not computable, as a predicate of its name; "" where it is.

    Middleware, a type without transmission times, or a connection that states a data rate alone.
    """
    bus = space.buses[number]
    if bus.virtual:
        return "is not computable: it is middleware, which runs on many cores"
    for name, has in by_type(bus, bus.fixed_ns):
        if not has and name not in (EMPTY, UNKNOWN_TYPE):
            return f"is not computable: its type {shown(name)} states no transmission time"
    for item in space.connections:
        if item.data_rate is not None and item.size_bytes is None and number in carriers(space.buses, item):
            return f"is not computable: {shown(item.name)} states a data rate, but no message size"
    return ""


def _response_times(space: Space, of: str | None) -> tuple[Metric, ...]:
    """The response time of a thread or of a connection's message, or of every thread that runs on a processor."""
    threads = {
        item.name: Metric(f"response time of {item.name}", "response time", number)
        for number, item in enumerate(space.components)
        if item.processor is not None and space.is_last_piece(number)
    }
    if of is None:
        if not threads:
            raise QuestionError("no thread runs on a processor: there is no response time")
        return tuple(threads.values())
    wire = next((number for number, item in enumerate(space.connections) if item.name == of), None)
    if wire is not None and of not in threads:
        return (Metric(f"response time of {of}", "message response", wire),)
    if of not in threads:
        if any(item.name == of for item in space.components):
            raise QuestionError(f"{shown(of)} runs on no processor: it has no response time", closest(of, threads))
        raise QuestionError(f"no thread or connection is called {shown(of)}", closest(of, threads))
    return (threads[of],)


def _one_metric(space: Space, ref: MetricExpr) -> Metric:
    """The single metric that the words mean."""
    metrics = resolve_metrics(space, ref)
    if len(metrics) > 1:
        names = ", ".join(metric.name for metric in metrics)
        raise QuestionError(f"{ref} could be several", f"say which: {names}, or max({ref})")
    return metrics[0]


def worst_metric(space: Space, ref: MetricExpr, sense: Literal["minimise", "maximise"]) -> Metric:
    """The metric of an objective: the worst of several candidates, which is the greatest where it is minimised.

    One `Metric`, or an extreme over all candidates. Raises `QuestionError` for an unknown name.
    """
    metrics = resolve_metrics(space, ref)
    return metrics[0] if len(metrics) == 1 else worst_of(str(ref), metrics, "<=" if sense == "minimise" else ">=")


def worst_of(name: str, metrics: Sequence[Metric], operator: str) -> Metric:
    """The extreme of several metrics with one name that an upper or a lower limit applies to.

    The maximum for ``<=`` and ``<``, the minimum for ``>=`` and ``>``.
    """
    kind, one = "max" if operator[0] == "<" else "min", Quantity(Fraction(1), DIMENSIONLESS, "")
    return Metric(f"{kind}({name})", kind, operands=tuple(((one, metric),) for metric in metrics))


def read_derived(space: Space, name: str, text: str) -> Derived:
    """A derived metric; all its terms must have one dimension.

    Raises `QuestionError` or `ExpressionError` for text that cannot be read, unknown metrics, or terms of different
    dimensions.
    """
    expression: DerivedExpr = parse_derived(text)
    terms = tuple((coefficient, _one_metric(space, ref)) for coefficient, ref in expression.terms)
    _check_kinds(space, text, terms)
    return Derived(name, text, terms, *_check_extent(space, text, [terms]))


def _extreme(space: Space, ref: ExtremeRef) -> Metric:
    """The greatest or least of several sums; a metric that stands alone, without ``of``, is all of its kind."""
    operands: list[tuple[tuple[Quantity, Metric], ...]] = []
    for expression in ref.operands:
        if len(expression.terms) == 1:
            coefficient, inner = expression.terms[0]
            operands += [((coefficient, metric),) for metric in resolve_metrics(space, inner)]
        else:
            operands.append(tuple((coefficient, _one_metric(space, inner)) for coefficient, inner in expression.terms))
    _check_kinds(space, str(ref), [part for operand in operands for part in operand])
    _check_extent(space, str(ref), operands)
    return Metric(str(ref), ref.kind, operands=tuple(operands))


def _check_kinds(space: Space, text: str, terms: Sequence[tuple[Quantity, Metric]]) -> None:
    """Check that added or compared metrics have one dimension, or one declared unit."""
    kinds: set[object] = set()
    for coefficient, metric in terms:
        inner = metric_dimension(space, metric)
        if inner is None and coefficient.dimension != DIMENSIONLESS:
            raise QuestionError(f"{metric.name} can only be multiplied by plain numbers")
        scale = coefficient.dimension or DIMENSIONLESS
        kinds.add((total_unit(space, metric),) if inner is None else scale.times(inner))
    if len(kinds) > 1:
        raise QuestionError(f"the terms of {shown(text)} are of different kinds: they cannot be added or compared")


def _check_extent(
    space: Space, text: str, operands: Sequence[Sequence[tuple[Quantity, Metric]]]
) -> tuple[Fraction, int]:
    """How many times the greatest metric of the file a sum of `operands` is at most, and how many metrics they add.

    Raises
    ------
    QuestionError
        where results cannot state figures of that size, or the sums are too long to evaluate.
    """
    reach, size = Fraction(0), 0
    for terms in operands:
        inner = [(coefficient.value, *_extent(space, metric)) for coefficient, metric in terms]
        reach = max(reach, sum((abs(factor) * most for factor, most, _ in inner), Fraction(0)))
        size += sum(count for _, _, count in inner)
    if reach > MOST_REACH:
        power = len(str(MOST_REACH)) - 1
        raise QuestionError(f"the factors of {shown(text)} make more than 10^{power} together", "use smaller factors")
    if size > MOST_TERMS:
        raise QuestionError(f"{shown(text)} adds more than {MOST_TERMS:,} metrics, with those that it is made of")
    return reach, size


def _extent(space: Space, metric: Metric) -> tuple[Fraction, int]:
    """The range and scale of a metric, for `_check_extent`."""
    if metric.kind == "derived":
        derived = space.derived[metric.index or 0]
        return derived.reach, derived.size
    return _check_extent(space, metric.name, metric.operands) if metric.operands else (Fraction(1), 1)


_FINDERS: Mapping[str, Callable[[Space, str | None], tuple[Metric, ...]]] = {
    "utilisation": lambda space, of: _core_metrics(space, of) or _indexed(space, "utilisation", of, "processor"),
    "busy": _busy,
    "changes": _changes,
    "data age": _data_ages,
    **{kind: partial(_exact, kind) for kind in EXACT_METRICS},
    "response time": _response_times,
    "disparity": disparities,
}
"""Functions that find the metrics of a kind, of a name or of all, where not every element with the name has one."""
