"""The question to the architecture: metrics, requirements, rules, objectives and the baseline, with names resolved.

The same functions serve the problem file (mistakes become diagnostics) and the command line (they become usage errors).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from graphlib import CycleError, TopologicalSorter
from typing import TypeVar

from dse.space.model.criteria import Metric, Objective, Requirement, Rule
from dse.space.model.metric_kinds import RESERVED
from dse.space.model.space import Component, Connection, Space
from dse.space.options import read_option, unknown_field
from dse.space.properties import Ledger, Path
from dse.space.question.implied import with_implied
from dse.space.question.limits import is_share, own_limit, states_bandwidth
from dse.space.question.metrics import QuestionError, read_derived, resolve_metrics, worst_metric
from dse.space.question.open_cores import open_cores, with_all_cores, with_open_cores, with_times_of_cores
from dse.space.question.open_priorities import open_priorities
from dse.space.question.rules import read_rule, rule_names
from dse.space.question.settings import with_deadlines
from dse.spec.language.expressions import DerivedExpr, ExtremeRef
from dse.spec.language.grammar import ExpressionError, parse_derived, parse_objective, parse_requirement
from dse.spec.language.scan import CALL
from dse.spec.schema.model import Spec
from dse.support.units import TIME, Quantity, format_duration, shown

MOST_FAILURES = 200
T = TypeVar("T")


def with_questions(ledger: Ledger, space: Space, spec: Spec) -> Space:
    """The space with everything that the problem file asks; mistakes go to the ledger.

    Requirements, rules, objectives, derived metrics and the baseline, each with its place. Names that are unknown or in
    doubt are reported once.
    """
    space = _with_cores(ledger, space, spec)
    baseline, costs = _baseline(ledger, space, spec), _costs(ledger, space, spec)
    space = replace(space, baseline=baseline, states_baseline=bool(spec.baseline), cost_of_change=costs)
    space = _with_derived(ledger, space, spec)
    space = replace(space, requirements=tuple(_required_latencies(ledger, space)))
    requirements = list(with_deadlines(space, partial(_deadline_origin, ledger, spec)).requirements)
    for number, text in enumerate(spec.requirements):
        path: Path = ("requirements", number)
        origin = ledger.origin(path)
        for requirement in _attempt(ledger, path, text, partial(read_requirements, space, text, origin)):
            requirements.extend(requirement)
    rules: list[Rule] = []
    names = rule_names(space)
    for number, text in enumerate(spec.rules):
        path = ("rules", number)
        origin = ledger.origin(path)
        rules += _attempt(ledger, path, text, partial(read_rule, space, text, origin, names))
    objectives = _objectives(ledger, space, spec)
    space = replace(space, requirements=tuple(requirements), objectives=tuple(objectives), rules=tuple(rules))
    return with_open_cores(with_implied(space))


def _with_cores(ledger: Ledger, space: Space, spec: Spec) -> Space:
    """The space with every open core and order as a decision, so that rules and the baseline can speak of them."""
    cores = open_cores(ledger, spec, space)
    orders = open_priorities(ledger, spec, space, len(space.decisions) + len(cores))
    return with_times_of_cores(ledger, spec, with_all_cores(replace(space, open_cores=cores, open_priorities=orders)))


def _attempt(ledger: Ledger, path: Path, text: str, make: Callable[[], T]) -> list[T]:
    """The result of `make`, or an empty one when it fails; a failure is noted unless it follows from one that is.

    After very many failures nothing is attempted: in a large problem each takes a while.
    """
    ledger.work.go_on(10)
    if ledger.failures >= MOST_FAILURES:
        return []
    try:
        return [make()]
    except (QuestionError, ExpressionError) as error:
        ledger.failures += 1
        if ledger.failures == MOST_FAILURES:
            ledger.error(path, f"{MOST_FAILURES} questions cannot be read; the rest of them was not read")
        if not ledger.mentions_doubt(path, text):
            ledger.error(path, error.message, error.hint, unknown=error.unknown)
        return []


def _with_derived(ledger: Ledger, space: Space, spec: Spec) -> Space:
    """The space with its derived metrics; each may use any other, in whatever order they stand."""
    graph = {name: _metrics_used(text) & set(spec.metrics) for name, text in spec.metrics.items()}
    while True:
        try:
            order = list(TopologicalSorter(graph).static_order())
            break
        except CycleError as error:
            cycle: list[str] = error.args[1]
            ledger.error(("metrics", cycle[-1]), f"defined by itself: {' -> '.join(reversed(cycle))}")
            ledger.doubt_metric(cycle[-1])
            graph = {name: used - {cycle[-1]} for name, used in graph.items() if name != cycle[-1]}
    for name in order:
        path: Path = ("metrics", name)
        text = spec.metrics[name]
        if name in RESERVED or CALL.match(name):
            ledger.error(path, f"{shown(name)} is a metric already: choose another name", at_key=True)
            continue
        derived = _attempt(ledger, path, text, partial(read_derived, space, name, text))
        if not derived:
            ledger.doubt_metric(name)
        space = replace(space, derived=(*space.derived, *derived))
    return space


def _metrics_used(text: str) -> set[str]:
    try:
        return set(_names_in(parse_derived(text)))
    except ExpressionError:
        return set()


def _names_in(expression: DerivedExpr) -> Iterator[str]:
    for _, ref in expression.terms:
        if isinstance(ref, ExtremeRef):
            for operand in ref.operands:
                yield from _names_in(operand)
        else:
            yield ref.metric


def _required_latencies(ledger: Ledger, space: Space) -> list[Requirement]:
    """The latency that a flow itself states: its maximum is a requirement."""
    requirements = []
    for number, flow in enumerate(space.flows):
        if flow.required_ns is not None:
            text = f"latency of {flow.name} <= {format_duration(flow.required_ns[1])}"
            metric = Metric(f"latency of {flow.name}", "latency", number)
            limit = Quantity(Fraction(flow.required_ns[1]) / 10**9, TIME, "s")
            requirements.append(Requirement(text, metric, "<=", limit, ledger.origin(("flows", flow.name, "latency"))))
    return requirements


def _deadline_origin(ledger: Ledger, spec: Spec, component: Component | Connection) -> str:
    """Where a deadline is asked for: at the thread or connection, or by the setting where it states none."""
    if isinstance(component, Connection):
        return ledger.origin(("connections", component.name, "deadline"))
    if spec.deadlines == "all" and component.deadline_ns is None:
        return ledger.origin(("deadlines",))
    return ledger.origin((component.section, component.stated_as, "deadline"))


def _objectives(ledger: Ledger, space: Space, spec: Spec) -> list[Objective]:
    objectives: list[Objective] = []
    for number, text in enumerate(spec.objectives):
        path: Path = ("objectives", number)
        for objective in _attempt(ledger, path, text, partial(read_objective, space, text, ledger.origin(path))):
            if any(objective.metric == other.metric for other in objectives):
                ledger.error(path, f"{shown(objective.metric.name)} is already an objective")
            else:
                objectives.append(objective)
    return objectives


def _stated(
    ledger: Ledger, space: Space, section: str, content: Mapping[str, Mapping[str, T]]
) -> Iterator[tuple[Path, str, T]]:
    """The fields that a section states, with the place and the full name of each; unknown components are noted."""
    known = [item.name for item in (*space.processors, *space.buses)] + [item.name for item in space.executors]
    known += [item.name for item in space.reservations]
    known += [item.name for item in space.components] + [item.name for item in space.connections]
    for component, fields in content.items():
        if component not in known:
            ledger.unknown((section, component), "component", component, known)
            continue
        for field_name, value in fields.items():
            yield (section, component, field_name), f"{component}.{field_name}", value


def _baseline(ledger: Ledger, space: Space, spec: Spec) -> dict[int, int]:
    result: dict[int, int] = {}
    for path, name, value in _stated(ledger, space, "baseline", spec.baseline):
        try:
            decision, option = read_option(space, name, str(value))
        except QuestionError as error:
            if not ledger.is_doubtful(str(path[1]), name):
                ledger.error(path, error.message, error.hint, at_key=name not in space.references)
            continue
        if decision is not None:
            result[decision] = option
    return result


def _costs(ledger: Ledger, space: Space, spec: Spec) -> dict[int, int]:
    """The stated cost of changing each decision; a field that is fixed costs nothing."""
    result: dict[int, int] = {}
    for path, name, cost in _stated(ledger, space, "cost_of_change", spec.cost_of_change):
        decision = space.decision_index(name)
        if decision is not None and decision >= space.first_open:
            what = "on which core" if space.decisions[decision].field == "core" else "in which order"
            ledger.error(path, f"{what} a thread runs is not counted as a change", at_key=True)
        elif decision is not None:
            result[decision] = cost
        elif name not in space.references and not ledger.is_doubtful(str(path[1]), name):
            ledger.error(path, *unknown_field(space, name), at_key=True)
    return result


def read_requirements(space: Space, text: str, origin: str = "") -> tuple[Requirement, ...]:
    """The requirements that one text states: several where the name is left out.

    A share of the bandwidth is then asked of the buses that have one.
    """
    expression = parse_requirement(text)
    metrics = resolve_metrics(space, expression.metric)
    result = []
    for metric in _with_bandwidth(space, metrics, expression.limit):
        own = own_limit(space, metric, expression.limit)
        shown, stated = expression.text, ""
        if len(metrics) > 1:
            limit = expression.text.split(expression.operator, 1)[-1].strip()
            shown, stated = f"{metric.name} {expression.operator} {limit}", expression.text
        result.append(Requirement(shown, metric, expression.operator, own, origin, stated=stated))
    return tuple(result)


def _with_bandwidth(space: Space, metrics: tuple[Metric, ...], limit: Quantity) -> tuple[Metric, ...]:
    """Without the loads of middleware that has no bandwidth, unless nothing else has."""
    kept = tuple(
        item for item in metrics if not is_share(item, limit) or states_bandwidth(space.buses[item.index or 0])
    )
    return kept or metrics


def read_objective(space: Space, text: str, origin: str = "") -> Objective:
    """Read an objective from text; without ``of`` its metric is the worst of all candidates.

    Raises `ExpressionError` or `QuestionError` with the place in the text. `origin` is shown with the objective.
    """
    expression = parse_objective(text)
    return Objective(text, expression.sense, worst_metric(space, expression.metric, expression.sense), origin)
