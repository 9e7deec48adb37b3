"""What is asked of the architecture: metrics, requirements, rules, objectives and the baseline, with names resolved.

The same functions serve the problem file (mistakes become diagnostics) and the command line (they become usage errors).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from difflib import get_close_matches
from fractions import Fraction
from typing import Any, TypeVar

from dse.space.figures import Ledger, Path, closest
from dse.space.types import (
    EMPTY,
    Atom,
    Derived,
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
    MetricRef,
    MultipleOf,
    Not,
    OneOf,
    Or,
    Ref,
    Used,
)
from dse.spec.grammar import ExpressionError, parse_derived, parse_objective, parse_requirement, parse_rule
from dse.spec.model import Spec
from dse.units import (
    DATA_RATE,
    DIMENSIONLESS,
    MONEY,
    POWER,
    TIME,
    Dimension,
    Quantity,
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
)

PARSERS: Mapping[str, Callable[[str], Any]] = {
    "duration": parse_period_ns,
    "time range": parse_time_range_ns,
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
SYSTEM_METRICS = {"price": MONEY, "power": POWER}
FLOW_METRICS = ("latency", "min latency", "jitter")
EXAMPLES = {TIME: "20 ms", DATA_RATE: "5 KB/s", MONEY: "500 EUR", POWER: "10 W", DIMENSIONLESS: "70 %"}

T = TypeVar("T")


class QuestionError(ValueError):
    """A question that does not fit the architecture: an unknown name, a unit of the wrong kind."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(f"{message} ({hint})" if hint else message)
        self.message, self.hint = message, hint


def with_questions(ledger: Ledger, space: Space, spec: Spec) -> Space:
    """The space with everything that the problem file asks; mistakes go to the ledger."""

    def attempt(path: Path, make: Callable[[], T]) -> list[T]:
        try:
            return [make()]
        except (QuestionError, ExpressionError) as error:
            ledger.error(path, error.message, error.hint)
            return []

    for name, text in spec.metrics.items():
        found = attempt(("metrics", name), lambda name=name, text=text: read_derived(space, name, text))  # type: ignore[misc]
        space = replace(space, derived=(*space.derived, *found))
    requirements: list[Requirement] = []
    for number, flow in enumerate(space.flows):
        if flow.required_ns is not None:
            text = f"latency of {flow.name} <= {format_duration(flow.required_ns[1])}"
            metric = Metric(f"latency of {flow.name}", "latency", number)
            limit = Quantity(Fraction(flow.required_ns[1], 10**9), TIME, "s")
            origin = ledger.origin(("flows", flow.name, "latency"))
            requirements.append(Requirement(text, metric, "<=", limit, origin))
    for number, text in enumerate(spec.requirements):
        path: Path = ("requirements", number)
        for more in attempt(path, lambda text=text, path=path: read_requirements(space, text, ledger.origin(path))):  # type: ignore[misc]
            requirements.extend(more)
    objectives: list[Objective] = []
    for number, text in enumerate(spec.objectives):
        found_one = attempt(("objectives", number), lambda text=text: read_objective(space, text))  # type: ignore[misc]
        for objective in found_one:
            if any(objective.metric == other.metric for other in objectives):
                ledger.error(("objectives", number), f"{objective.metric.name!r} is already an objective")
            else:
                objectives.append(objective)
    rules: list[Rule] = []
    for number, text in enumerate(spec.rules):
        path = ("rules", number)
        rules += attempt(path, lambda text=text, path=path: read_rule(space, text, ledger.origin(path)))  # type: ignore[misc]
    space = replace(space, requirements=tuple(requirements), objectives=tuple(objectives), rules=tuple(rules))
    return replace(space, baseline=_baseline(ledger, space, spec))


def _baseline(ledger: Ledger, space: Space, spec: Spec) -> dict[int, int]:
    result: dict[int, int] = {}
    components = {name.rsplit(".", 1)[0]: None for name in space.references}
    known = [item.name for group in (space.processors, space.buses, space.components, space.connections) for item in group]
    for component, fields in spec.baseline.items():
        if component not in known:
            ledger.unknown(("baseline", component), "component", component, components)
            continue
        for field_name, value in fields.items():
            try:
                decision, option = read_option(space, f"{component}.{field_name}", str(value))
            except QuestionError as error:
                ledger.error(("baseline", component, field_name), error.message, error.hint)
                continue
            if decision is not None:
                result[decision] = option
    return result


def read_option(space: Space, name: str, text: str) -> tuple[int | None, int]:
    """The decision called `name` and its option `text`; (None, 0) for a fixed field that has this very value.

    Raises
    ------
    QuestionError
        when there is no such field, or it has no such option.
    """
    reference = space.references.get(name)
    if reference is None:
        raise QuestionError(f"nothing is called {name!r}", closest(name, space.references))
    value = read_value(reference, text)
    if value not in reference.texts:
        options = ", ".join(str(option) for option in reference.texts.values())
        raise QuestionError(f"{name} = {text} is not among its options", f"options: {options}")
    decision = space.decision_index(name)
    return (None, 0) if decision is None else (decision, space.decisions[decision].values.index(value))


def read_value(reference: Reference, text: str) -> Any:
    """The value that `text` means for a reference of its kind."""
    if reference.kind in PARSERS:
        try:
            return PARSERS[reference.kind](text)
        except UnitError as error:
            raise QuestionError(f"{reference.name}: {error.message}", error.hint) from error
        except ValueError as error:
            raise QuestionError(f"{reference.name}: expected a {reference.kind}, got {text!r}") from error
    by_text = {str(option): value for value, option in reference.texts.items()}
    if text in by_text:
        return by_text[text]
    if reference.kind == "type" and text == EMPTY:
        return EMPTY
    raise QuestionError(f"{reference.name} is never {text!r}", closest(text, by_text))


def resolve_metrics(space: Space, ref: MetricRef) -> tuple[Metric, ...]:
    """What ``METRIC [of NAME]`` means; several metrics where NAME is left out and there are several candidates.

    Raises
    ------
    QuestionError
        for an unknown metric or name.
    """
    kind = ref.metric
    if kind in FLOW_METRICS:
        return _indexed(kind, ref.of, "flow", [flow.name for flow in space.flows])
    if kind == "utilisation":
        return _indexed(kind, ref.of, "processor", [slot.name for slot in space.processors])
    if kind == "load":
        return _indexed(kind, ref.of, "bus", [bus.name for bus in space.buses])
    if kind in SYSTEM_METRICS or kind in space.totals:
        if ref.of is not None:
            named = [item.name for group in (space.processors, space.buses, space.components) for item in group]
            if ref.of not in named:
                raise QuestionError(f"no component is called {ref.of!r}", closest(ref.of, named))
        name, of = str(ref), ref.of or ""
        return (Metric(name, kind if kind in SYSTEM_METRICS else "total", None, kind, of),)
    for number, derived in enumerate(space.derived):
        if derived.name == kind:
            if ref.of is not None:
                raise QuestionError(f"the derived metric {kind!r} has no `of`")
            return (Metric(kind, "derived", number),)
    known = [*FLOW_METRICS, "utilisation", "load", *SYSTEM_METRICS, *space.totals, *(item.name for item in space.derived)]
    raise QuestionError(f"unknown metric {kind!r}", closest(kind, known) or "known: " + ", ".join(known))


def _indexed(kind: str, of: str | None, what: str, names: list[str]) -> tuple[Metric, ...]:
    if of is None:
        if not names:
            raise QuestionError(f"there is no {what} to measure the {kind} of")
        return tuple(Metric(f"{kind} of {name}", kind, number) for number, name in enumerate(names))
    if of not in names:
        raise QuestionError(f"no {what} is called {of!r}", closest(of, names))
    return (Metric(f"{kind} of {of}", kind, names.index(of)),)


def metric_dimension(space: Space, metric: Metric) -> Dimension | None:
    """The dimension of a metric; None for a declared total, whose unit is the user's own."""
    if metric.kind == "derived":
        coefficient, inner = space.derived[metric.index or 0].terms[0]
        inner_dimension = metric_dimension(space, inner)
        if inner_dimension is None or coefficient.dimension is None:
            return None
        return coefficient.dimension.times(inner_dimension)
    if metric.kind == "total":
        return None
    return {"utilisation": DIMENSIONLESS, "load": DATA_RATE, **SYSTEM_METRICS}.get(metric.kind, TIME)


def _one_metric(space: Space, ref: MetricRef) -> Metric:
    metrics = resolve_metrics(space, ref)
    if len(metrics) > 1:
        names = ", ".join(metric.name for metric in metrics)
        raise QuestionError(f"{ref} could be several", f"say which: {names}")
    return metrics[0]


def read_derived(space: Space, name: str, text: str) -> Derived:
    """A derived metric; all its terms must have one dimension."""
    expression: DerivedExpr = parse_derived(text)
    terms = tuple((coefficient, _one_metric(space, ref)) for coefficient, ref in expression.terms)
    dimensions = set()
    for coefficient, metric in terms:
        inner = metric_dimension(space, metric)
        if inner is None and coefficient.dimension != DIMENSIONLESS:
            raise QuestionError(f"{metric.name} can only be multiplied by plain numbers")
        dimensions.add(
            (metric.key,) if inner is None else (coefficient.dimension or DIMENSIONLESS).times(inner)
        )
    if len(dimensions) > 1:
        raise QuestionError(f"the terms of {text!r} are of different kinds and cannot be added")
    return Derived(name, text, terms)


def read_requirements(space: Space, text: str, origin: str = "") -> tuple[Requirement, ...]:
    """The requirements that one text states: several where the name is left out."""
    expression = parse_requirement(text)
    metrics = resolve_metrics(space, expression.metric)
    result = []
    for metric in metrics:
        check_limit(space, metric, expression.limit)
        shown = expression.text
        if len(metrics) > 1:
            limit = expression.text.split(expression.operator, 1)[-1].strip()
            shown = f"{metric.name} {expression.operator} {limit}"
        result.append(Requirement(shown, metric, expression.operator, expression.limit, origin))
    return tuple(result)


def check_limit(space: Space, metric: Metric, limit: Quantity) -> None:
    """A limit must be of its metric's kind; a load may also be limited by a share of the bandwidth."""
    wanted = metric_dimension(space, metric)
    if wanted is None:
        unit = space.totals.get(metric.key, "")
        if limit.unit != unit:
            raise QuestionError(f"expected a limit in {unit} for {metric.name}, got {limit.unit or 'a bare number'}")
        return
    is_share = metric.kind == "load" and limit.dimension == DIMENSIONLESS
    if limit.unit == "" and wanted != DIMENSIONLESS or limit.unit == "" and metric.kind == "utilisation":
        example = EXAMPLES.get(wanted, "a quantity with its unit")
        raise QuestionError(f"expected a limit with its unit for {metric.name}, got a bare number", f"such as {example}")
    if limit.dimension != wanted and not is_share:
        example = EXAMPLES.get(wanted, "a quantity of its kind")
        raise QuestionError(f"{limit.unit!r} is no unit of {metric.name}", f"expected something like {example}")
    if wanted == MONEY and limit.unit != space.currency:
        raise QuestionError(f"prices are in {space.currency}, got {limit.unit}")
    if is_share:
        bus = space.buses[metric.index or 0]
        unlimited = [name for name, has in _bandwidths(bus) if not has and name != EMPTY]
        if unlimited:
            raise QuestionError(f"{bus.name!r} has no bandwidth to take a share of", f"type {unlimited[0]!r} states none")


def _bandwidths(bus: Any) -> list[tuple[str, bool]]:
    tree = bus.bandwidth_bps
    if hasattr(tree, "decision") and tree.decision == bus.type_decision:
        return [(name, branch is not None) for name, branch in zip(bus.types, tree.branches, strict=True)]
    return [(name, tree is not None) for name in bus.types]


def read_objective(space: Space, text: str) -> Objective:
    """What to minimise or maximise; without ``of`` there must be one candidate only."""
    expression = parse_objective(text)
    return Objective(text, expression.sense, _one_metric(space, expression.metric))


def read_rule(space: Space, text: str, origin: str = "") -> Rule:
    """A rule with its names resolved."""
    expression = parse_rule(text, list(space.references), _bare_names(space))
    return Rule(text, expression.verb, _resolve(space, expression.condition), origin)


def _bare_names(space: Space) -> list[str]:
    slots = [slot.name for slot in (*space.processors, *space.buses)]
    types = [str(text) for item in space.references.values() if item.kind == "type" for text in item.texts.values()]
    return [*slots, *(name for name in dict.fromkeys(types) if name != EMPTY)]


def _resolve(space: Space, condition: Condition) -> ResolvedCondition:
    if isinstance(condition, Not):
        return Not(_resolve(space, condition.operand))  # type: ignore[arg-type]
    if isinstance(condition, And | Or):
        operands = tuple(_resolve(space, item) for item in condition.operands)
        return type(condition)(operands)  # type: ignore[arg-type]
    return _atom(space, condition)


def _atom(space: Space, condition: Condition) -> Atom:
    references = space.references
    if isinstance(condition, Used):
        return _used(space, condition.name)
    if isinstance(condition, OneOf):
        reference = references[condition.ref.name]
        return ValueTest(reference.tree, "in", tuple(read_value(reference, text) for text in condition.values))
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
    return ValueTest(left.tree, condition.operator, read_value(left, condition.right))


def _used(space: Space, name: str) -> UsedTest:
    """A slot that is not empty, or a type that some slot or component has."""
    slots = {slot.name: slot for slot in (*space.processors, *space.buses)}
    if name in slots and name not in slots[name].types:
        reference = space.references[f"{name}.type"]
        return UsedTest(((reference.tree, tuple(item for item in slots[name].types if item != EMPTY)),))
    having = [item for item in space.references.values() if item.kind == "type" and name in item.texts]
    if not having:
        match = get_close_matches(name, _bare_names(space), n=1)
        raise QuestionError(f"nothing is called {name!r}", f'did you mean "{match[0]}"?' if match else "")
    return UsedTest(tuple((item.tree, (name,)) for item in having))
