"""What is asked of the architecture: metrics, requirements, rules, objectives and the baseline, with names resolved.

The same functions serve the problem file (mistakes become diagnostics) and the command line (they become usage errors).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from fractions import Fraction
from functools import partial
from graphlib import CycleError, TopologicalSorter
from typing import Any, TypeVar

from dse.space.cores import open_cores, with_open_cores
from dse.space.implied import with_implied
from dse.space.metrics import (
    RESERVED,
    QuestionError,
    is_share,
    metric_dimension,
    own_limit,
    read_derived,
    resolve_metrics,
    states_bandwidth,
    worst_metric,
)
from dse.space.properties import Ledger, Path, closest
from dse.space.settings import with_deadlines
from dse.space.trees import Tree, leaves
from dse.space.types import (
    EMPTY,
    Atom,
    Component,
    Metric,
    MultipleTest,
    Objective,
    PairTest,
    Reference,
    Requirement,
    ResolvedCondition,
    Rule,
    Space,
    UsedTest,
    ValueTest,
)
from dse.spec.expressions import (
    And,
    Compare,
    Condition,
    DerivedExpr,
    ExtremeRef,
    MultipleOf,
    Not,
    OneOf,
    Or,
    Ref,
    Used,
)
from dse.spec.grammar import ExpressionError, parse_derived, parse_objective, parse_requirement, parse_rule
from dse.spec.model import Spec
from dse.spec.scan import CALL
from dse.spec.totals import in_unit_of
from dse.units import (
    TIME,
    Quantity,
    Total,
    UnitError,
    format_duration,
    parse_bandwidth_bps,
    parse_data_rate,
    parse_money,
    parse_period_ns,
    parse_power_mw,
    parse_rate_hz,
    parse_size_bytes,
    parse_time_range_ns,
    parse_total,
    parse_transmission_ns,
    shown,
)

__all__ = [
    "QuestionError",
    "metric_dimension",
    "read_objective",
    "read_option",
    "read_requirements",
    "read_rule",
    "resolve_metrics",
    "with_questions",
]

SHOWN_OPTIONS = 12
MOST_FAILURES = 200
PARSERS: Mapping[str, Callable[[str], Any]] = {
    "duration": parse_period_ns,
    "time range": parse_time_range_ns,
    "transmission time": parse_transmission_ns,
    "data size": parse_size_bytes,
    "bandwidth": parse_bandwidth_bps,
    "data rate": parse_data_rate,
    "rate": parse_rate_hz,
    "money": parse_money,
    "power": parse_power_mw,
    "total": parse_total,
    "count": int,
}
ORDERED = ("duration", "data size", "bandwidth", "data rate", "rate", "money", "power", "total", "count")
T = TypeVar("T")


def with_questions(ledger: Ledger, space: Space, spec: Spec) -> Space:
    """The space with everything that the problem file asks; mistakes go to the ledger."""
    space = _with_cores(ledger, space, spec)
    baseline, costs = _baseline(ledger, space, spec), _costs(ledger, space, spec)
    space = replace(space, baseline=baseline, states_baseline=bool(spec.baseline), cost_of_change=costs)
    space = _with_derived(ledger, space, spec)
    space = replace(space, requirements=tuple(_required_latencies(ledger, space)))
    requirements = list(with_deadlines(space, partial(_deadline_origin, ledger, spec)).requirements)
    for number, text in enumerate(spec.requirements):
        path: Path = ("requirements", number)
        origin = ledger.origin(path)
        for found in _attempt(ledger, path, text, partial(read_requirements, space, text, origin)):
            requirements.extend(found)
    rules: list[Rule] = []
    for number, text in enumerate(spec.rules):
        path = ("rules", number)
        origin = ledger.origin(path)
        rules += _attempt(ledger, path, text, partial(read_rule, space, text, origin))
    objectives = _objectives(ledger, space, spec)
    space = replace(space, requirements=tuple(requirements), objectives=tuple(objectives), rules=tuple(rules))
    return with_open_cores(with_implied(space))


def _with_cores(ledger: Ledger, space: Space, spec: Spec) -> Space:
    """The space with every open core as a decision, so that rules and the baseline can speak of them."""
    found = open_cores(ledger, spec, space)
    components = list(space.components)
    for item in found:
        components[item.component] = replace(components[item.component], core=item.decision.home)
    decisions = (*space.decisions, *(item.decision for item in found))
    return replace(space, components=tuple(components), decisions=decisions, open_cores=found)


def _attempt(ledger: Ledger, path: Path, text: str, make: Callable[[], T]) -> list[T]:
    """What `make` gives, or nothing when it fails; a failure is noted unless it follows from one that is.

    After very many failures nothing is attempted: in a large problem each takes a while.
    """
    if ledger.failures >= MOST_FAILURES:
        return []
    try:
        return [make()]
    except (QuestionError, ExpressionError) as error:
        ledger.failures += 1
        if ledger.failures == MOST_FAILURES:
            ledger.error(path, f"{MOST_FAILURES} questions cannot be read; those behind this one were not looked at")
        if not ledger.mentions_doubt(path, text):
            ledger.error(path, error.message, error.hint)
        return []


def _with_derived(ledger: Ledger, space: Space, spec: Spec) -> Space:
    """The space with its derived metrics; each may use any other, in whatever order they stand."""
    graph = {name: _metrics_used(text) & set(spec.metrics) for name, text in spec.metrics.items()}
    while True:
        try:
            order = list(TopologicalSorter(graph).static_order())
            break
        except CycleError as error:
            circle: list[str] = error.args[1]
            ledger.error(("metrics", circle[-1]), f"defined by itself: {' -> '.join(reversed(circle))}")
            ledger.doubt_metric(circle[-1])
            graph = {name: used - {circle[-1]} for name, used in graph.items() if name != circle[-1]}
    for name in order:
        path: Path = ("metrics", name)
        text = spec.metrics[name]
        if name in RESERVED or CALL.match(name):
            ledger.error(path, f"{shown(name)} is a metric already: choose another name", at_key=True)
            continue
        found = _attempt(ledger, path, text, partial(read_derived, space, name, text))
        if not found:
            ledger.doubt_metric(name)
        space = replace(space, derived=(*space.derived, *found))
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
    found = []
    for number, flow in enumerate(space.flows):
        if flow.required_ns is not None:
            text = f"latency of {flow.name} <= {format_duration(flow.required_ns[1])}"
            metric = Metric(f"latency of {flow.name}", "latency", number)
            limit = Quantity(Fraction(flow.required_ns[1]) / 10**9, TIME, "s")
            found.append(Requirement(text, metric, "<=", limit, ledger.origin(("flows", flow.name, "latency"))))
    return found


def _deadline_origin(ledger: Ledger, spec: Spec, component: Component) -> str:
    """Where a deadline is asked for: the setting, where the file has it, else the thread."""
    return ledger.origin(("deadlines",) if spec.deadlines is not None else (component.section, component.name))


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
    """What a section states of fields, with the place and the full name of each; unknown components are noted."""
    known = [item.name for item in (*space.processors, *space.buses)]
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
    """What changing each decision costs, where that is stated; a field that is fixed costs nothing."""
    result: dict[int, int] = {}
    for path, name, cost in _stated(ledger, space, "cost_of_change", spec.cost_of_change):
        decision = space.decision_index(name)
        if decision is not None and space.decisions[decision].field == "core":
            ledger.error(path, "on which core a thread runs is not counted as a change", at_key=True)
        elif decision is not None:
            result[decision] = cost
        elif name not in space.references and not ledger.is_doubtful(str(path[1]), name):
            ledger.error(path, *_unknown_field(space, name), at_key=True)
    return result


def _unknown_field(space: Space, name: str) -> tuple[str, str]:
    """What is wrong with a name that no field has, and which come close."""
    fields = [item for item in space.references if item.rpartition(".")[0] == name.rpartition(".")[0]]
    return f"nothing is called {shown(name)}", closest(name, fields or space.references)


def read_option(space: Space, name: str, text: str) -> tuple[int | None, int]:
    """The decision called `name` and its option `text`; (None, 0) for a fixed field that has this very value.

    A type may go by the name of its component alone, as it does in tables.

    Raises
    ------
    QuestionError
        when there is no such field, or it has no such option.
    """
    name = name if name in space.references else f"{name}.type" if f"{name}.type" in space.references else name
    reference = space.references.get(name)
    if reference is None:
        raise QuestionError(*_unknown_field(space, name))
    value = offered_value(reference, text)
    decision = space.decision_index(name)
    if decision is None:
        return None, 0
    if value not in space.decisions[decision].values:
        options = ", ".join(space.decisions[decision].options)
        message = f"{name} is {reference.texts[value]} only where a type does not state it: there is nothing to choose"
        raise QuestionError(message, f"options: {options}")
    return decision, space.decisions[decision].values.index(value)


def offered_value(reference: Reference, text: str) -> Any:
    """The value that `text` means, which must be one of the options."""
    value = read_value(reference, text)
    if value not in reference.texts:
        raise _never(reference, text)
    return value


def read_value(reference: Reference, text: str) -> Any:
    """The value that `text` means for a reference of its kind."""
    if reference.kind in PARSERS:
        try:
            value = PARSERS[reference.kind](text)
            return in_unit_of(reference.texts, value) if isinstance(value, Total) else value
        except UnitError as error:
            raise QuestionError(f"{reference.name}: {error.message}", error.hint) from error
        except ValueError as error:
            raise QuestionError(f"{reference.name}: expected a {reference.kind}, got {shown(text)}") from error
    by_text = {str(option): value for value, option in reference.texts.items()}
    if text in by_text:
        return by_text[text]
    if reference.kind == "type" and text == EMPTY:
        return EMPTY
    raise _never(reference, text)


def _never(reference: Reference, text: str) -> QuestionError:
    """A field that has no such option: the options, shortened where there are many."""
    options = list(dict.fromkeys(str(option) for option in reference.texts.values()))
    if len(options) == 1:
        return QuestionError(f"{reference.name} is always {options[0]}, never {shown(text)}")
    match = get_close_matches(text, options, n=1) if reference.kind not in PARSERS else []
    shortened = options[:SHOWN_OPTIONS] + ["..."] * (len(options) > SHOWN_OPTIONS)
    hint = f'did you mean "{match[0]}"?' if match else f"options: {', '.join(shortened)}"
    return QuestionError(f"{reference.name} is never {shown(text)}", hint)


def read_requirements(space: Space, text: str, origin: str = "") -> tuple[Requirement, ...]:
    """The requirements that one text states: several where the name is left out.

    A share of the bandwidth is then asked of the buses that have one.
    """
    expression = parse_requirement(text)
    metrics = resolve_metrics(space, expression.metric)
    result = []
    for metric in _with_bandwidth(space, metrics, expression.limit):
        own = own_limit(space, metric, expression.limit)
        shown = expression.text
        if len(metrics) > 1:
            limit = expression.text.split(expression.operator, 1)[-1].strip()
            shown = f"{metric.name} {expression.operator} {limit}"
        result.append(Requirement(shown, metric, expression.operator, own, origin))
    return tuple(result)


def _with_bandwidth(space: Space, metrics: tuple[Metric, ...], limit: Quantity) -> tuple[Metric, ...]:
    """Without the loads of middleware that has no bandwidth, unless nothing else has."""
    kept = tuple(
        item for item in metrics if not is_share(item, limit) or states_bandwidth(space.buses[item.index or 0])
    )
    return kept or metrics


def read_objective(space: Space, text: str, origin: str = "") -> Objective:
    """What to minimise or maximise; without ``of`` the worst of all candidates."""
    expression = parse_objective(text)
    return Objective(text, expression.sense, worst_metric(space, expression.metric, expression.sense), origin)


def read_rule(space: Space, text: str, origin: str = "") -> Rule:
    """A rule with its names resolved."""
    expression = parse_rule(text, list(space.references), _bare_names(space))
    return Rule(text, expression.verb, _resolve(space, expression.condition), origin)


def _bare_names(space: Space) -> list[str]:
    slots = [slot.name for slot in (*space.processors, *space.buses)]
    types = [str(text) for item in space.references.values() if item.kind == "type" for text in item.texts.values()]
    types += [name for names in space.catalogue.values() for name in names]
    return [*slots, *(name for name in dict.fromkeys(types) if name != EMPTY)]


def unoffered_types(space: Space) -> list[str]:
    """The types of the catalogues that nothing may have."""
    offered = {str(text) for item in space.references.values() if item.kind == "type" for text in item.texts.values()}
    return [name for names in space.catalogue.values() for name in names if name not in offered]


def _compared_value(space: Space, reference: Reference, text: str) -> Any:
    """The value that a rule compares with: an option, or a type of the catalogue that is none (any more)."""
    if reference.kind == "type":
        owner = reference.name.removesuffix(".type")
        sections = {item.name: "processor_types" for item in space.processors}
        sections |= {item.name: "bus_types" for item in space.buses}
        sections |= {item.name: f"{item.section.removesuffix('s')}_types" for item in space.components}
        if text in space.catalogue.get(sections.get(owner, ""), ()):
            return text
    return offered_value(reference, text)


def _resolve(space: Space, condition: Condition) -> ResolvedCondition:
    if isinstance(condition, Not):
        return Not(_resolve(space, condition.operand))
    if isinstance(condition, And | Or):
        operands = tuple(_resolve(space, item) for item in condition.operands)
        return And(operands) if isinstance(condition, And) else Or(operands)
    return _atom(space, condition)


def _atom(space: Space, condition: Condition) -> Atom:
    references = space.references
    if isinstance(condition, Used):
        return _used(space, condition.name)
    if isinstance(condition, OneOf):
        reference = references[condition.ref.name]
        return ValueTest(
            reference.tree, "in", tuple(_compared_value(space, reference, text) for text in condition.values)
        )
    if isinstance(condition, MultipleOf):
        left, right = references[condition.left.name], references[condition.right.name]
        if left.kind != "duration" or right.kind != "duration":
            raise QuestionError("only a period can be a multiple of a period")
        return MultipleTest(left.tree, right.tree)
    assert isinstance(condition, Compare)
    left = references[condition.left.name]
    ordered = condition.operator not in ("==", "!=")
    if ordered and left.kind not in ORDERED:
        raise QuestionError(f"{left.name} has no order: compare it with == or !=")
    if isinstance(condition.right, Ref):
        right = references[condition.right.name]
        if right.kind != left.kind:
            raise QuestionError(f"{left.name} and {right.name} are of different kinds")
        return PairTest(left.tree, condition.operator, right.tree)
    if condition.operator == "==" or left.kind == "type":
        return ValueTest(left.tree, condition.operator, _compared_value(space, left, condition.right))
    return ValueTest(left.tree, condition.operator, read_value(left, condition.right))


def _used(space: Space, name: str) -> UsedTest:
    """A slot that is not empty, or a type that some slot or component has, or to which something is bound directly.

    A type of the catalogue that nothing may have is used in no design.
    """
    slots = {slot.name: slot for slot in (*space.processors, *space.buses)}
    if name in slots and name not in slots[name].types:
        reference = space.references[f"{name}.type"]
        return UsedTest(((reference.tree, tuple(item for item in slots[name].types if item != EMPTY)),))
    direct = [number for number, bus in enumerate(space.buses) if bus.direct and bus.name == name]
    own = {f"{name}.type"} if direct else set()
    having = [item for item in space.references.values() if item.kind == "type" and name in item.texts]
    if not having and not any(name in names for names in space.catalogue.values()):
        match = get_close_matches(name, _bare_names(space), n=1)
        raise QuestionError(f"nothing is called {shown(name)}", f'did you mean "{match[0]}"?' if match else "")
    bindings = [*(item.bus for item in space.connections), *(item.carrier for item in space.buses)]
    bound: list[tuple[Tree, tuple[int, ...]]] = [
        (tree, (number,)) for number in direct for tree in bindings if number in set(leaves(tree))
    ]
    return UsedTest((*((item.tree, (name,)) for item in having if item.name not in own), *bound))
