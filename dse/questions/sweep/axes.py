"""What ``--vary`` says: ``PATH=1ms,2ms``, ``PATH=*0.5..2 step 0.1``, ``METRIC of NAME=5ms..100ms``.

With or without a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Literal

from dse.questions.problem import Problem
from dse.questions.sweep.inputs_of_file import Inputs, copied, quantity_text
from dse.space.model.criteria import Metric, Requirement
from dse.space.model.metric_kinds import BUILT_IN
from dse.space.model.space import Space
from dse.space.question.implied import with_implied
from dse.space.question.metrics import QuestionError, worst_of
from dse.space.question.open_cores import with_open_cores
from dse.space.question.reading import read_requirements
from dse.spec.language.grammar import ExpressionError
from dse.spec.language.scan import CALL
from dse.spec.quantities.quantities import read_value
from dse.spec.schema.fields import COUNT
from dse.spec.schema.quantity_fields import TOTAL
from dse.support.errors import UsageError, nearest
from dse.support.units import DIMENSIONLESS, Quantity, UnitError, format_number, parse_quantity, unit_ratio

MOST_VALUES = 100_000
ORIGIN = "--vary"
Comparison = Literal["<=", ">="]


@dataclass(frozen=True)
class LimitAxis:
    """A limit that varies: over a whole interval (`values` empty, `low` and `high` given), or over a list.

    It is a limit on each of `metrics`, and takes the place of every limit of the same direction that the problem states
    for them. `metric` is the worst of them: the limit holds for all where it holds for that (but for a share, which is
    one of what each has). Ends and values are requirements, one for each metric.
    """

    name: str
    metrics: tuple[Metric, ...]
    metric: Metric
    operator: Comparison
    low: tuple[Requirement, ...] = ()
    high: tuple[Requirement, ...] = ()
    interval: str = ""
    values: tuple[tuple[Requirement, ...], ...] = ()
    labels: tuple[str, ...] = ()

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """All limits that the axis may set.

        The limits for the low end, the high end and each value. Building all of them at the start reports a mistake
        before the first run.
        """
        return (*self.low, *self.high, *(item for one in self.values for item in one))

    @property
    def is_exact(self) -> bool:
        """Whether every break-point in an interval is asked for, rather than the front for each of some values.

        True for an interval such as ``5ms..100ms`` without a step: the sweep then returns the exact limits at which the
        front changes.
        """
        return not self.values

    def shipped(self, number: int | None) -> tuple[str, str]:
        """Metric and values as a run has them: value `number`, or the whole interval.

        A pair of texts that `read_limit_axis` reads in the process that solves the run, for example ``("latency of f",
        "<= 20 ms")``.
        """
        values = self.interval if number is None else self.labels[number]
        return self.name, f"{self.operator} {values}"


@dataclass(frozen=True)
class InputAxis:
    """A quantity of the problem file that varies: absolute values as text, or factors.

    Exactly one of `texts` and `factors` has entries, as many as `labels`.
    """

    name: str
    labels: tuple[str, ...]
    texts: tuple[str, ...] = ()
    factors: tuple[Fraction, ...] = ()

    def write(self, inputs: Inputs, data: dict[str, Any], number: int) -> None:
        """Put value `number` into `data`.

        `data` is the plain data of the problem file, changed in place.
        """
        if self.factors:
            inputs.scale(data, self.name, self.factors[number])
        else:
            inputs.set(data, self.name, self.texts[number])


Axis = LimitAxis | InputAxis


def limited(space: Space, requirements: Sequence[Requirement]) -> Space:
    """The space with these limits in the place of all limits of the same direction on the same metrics.

    A new space: limits of the file that compare the swept metrics in the same direction are dropped, those that are
    implied and open cores are computed again.
    """
    replaced = {(item.metric, item.operator[0]) for item in requirements}
    kept = [item for item in space.requirements if (item.metric, item.operator[0]) not in replaced]
    return with_open_cores(with_implied(replace(space, requirements=(*kept, *requirements))))


def read_axis(problem: Problem, inputs: Inputs, text: str) -> Axis:
    """One ``--vary``.

    Raises
    ------
    UsageError
        for an unknown path or metric, a wrong unit, an empty range, a step that leads nowhere.
    """
    name, operator, values = _split(text)
    if not values:
        raise UsageError(f"--vary {text!r}: no values (PATH=a,b,c or METRIC of NAME=a..b)")
    try:
        if name in inputs.groups:
            if operator != "=":
                raise UsageError(f"an input has a value, not a limit: write {name}={values}")
            return _input_axis(inputs, name, values)
        if _names_metric(problem.space, name):
            return _limit_axis(problem.space, name, "<=" if operator == "=" else operator, values)
        inputs.at(name)
    except (UsageError, QuestionError, ExpressionError, UnitError) as error:
        raise UsageError(f"--vary {text!r}: {error}") from error
    raise AssertionError("unreachable")


def _split(text: str) -> tuple[str, Any, str]:
    for sign in ("<=", ">=", "="):
        left, mark, right = text.partition(sign)
        if mark and "=" not in left:
            return left.strip(), sign, right.strip()
    raise UsageError(
        f'--vary {text!r}: expected PATH=VALUES or METRIC of NAME=VALUES, such as "price=100 EUR..900 EUR"'
    )


def _names_metric(space: Space, name: str) -> bool:
    """Whether the words are meant as a metric: a known one, or something ``of`` something, and no path."""
    kind = name.partition(" of ")[0].strip()
    known = [*BUILT_IN, *space.totals, *(item.name for item in space.derived)]
    if kind in known or " of " in name or CALL.match(name):
        return True
    return "." not in name and bool(nearest(name, known))


# --- limits -------------------------------------------------------------------------------------------------------


def read_limit_axis(space: Space, name: str, values: str) -> LimitAxis:
    """A limit on a metric as a run has it: ``<= 5ms..100ms`` or ``<= 20ms``.

    The inverse of `LimitAxis.shipped`. Raises `UsageError` for an unknown metric or a value with a wrong unit.
    """
    return _limit_axis(space, name, "<=" if values.startswith("<=") else ">=", values[2:].strip())


def _limit_axis(space: Space, name: str, operator: Comparison, values: str) -> LimitAxis:
    if ".." in values and not _step(values)[1]:
        low_text, high_text = _ends(values)
        low, high = (_requirements(space, name, operator, text) for text in (low_text, high_text))
        if low[0].limit.value > high[0].limit.value:
            raise UsageError(f"the range is empty: {low_text} is above {high_text}")
        return LimitAxis(*_limited(name, low), operator, low, high, f"{low_text} .. {high_text}")
    texts = _grid(values, None)
    requirements = tuple(_requirements(space, name, operator, text) for text in texts)
    return LimitAxis(*_limited(name, requirements[0]), operator, values=requirements, labels=tuple(texts))


def _requirements(space: Space, name: str, operator: str, quantity: str) -> tuple[Requirement, ...]:
    """The limit on each metric that the words mean."""
    metric, of, item = name.partition(" of ")
    is_plain = of and not item.strip().startswith(("'", '"')) and not CALL.match(name)
    quoted = f'{metric} of "{item.strip()}"' if is_plain else name
    requirements = read_requirements(space, f"{quoted} {operator} {quantity}", ORIGIN)
    return tuple(replace(one, text=f"{one.metric.name} {operator} {quantity}") for one in requirements)


def _limited(name: str, requirements: Sequence[Requirement]) -> tuple[str, tuple[Metric, ...], Metric]:
    """How the axis is called, what is limited, and the worst of that."""
    metrics = tuple(item.metric for item in requirements)
    if len(metrics) == 1:
        return metrics[0].name, metrics, metrics[0]
    return " ".join(name.split()), metrics, worst_of(" ".join(name.split()), metrics, requirements[0].operator)


def limit_requirements(axis: LimitAxis, limit: Quantity, operator: Any) -> tuple[Requirement, ...]:
    """The axis' metrics against a limit, strictly or not.

    A `Requirement` for each metric of the axis; `operator` is one of ``<= < >= >``.
    """
    return tuple(Requirement("", metric, operator, limit, ORIGIN) for metric in axis.metrics)


# --- inputs -------------------------------------------------------------------------------------------------------


def _input_axis(inputs: Inputs, path: str, values: str) -> InputAxis:
    if values.startswith("*"):
        texts = _grid(values[1:].strip(), DIMENSIONLESS)
        factors = tuple(parse_quantity(text).value for text in texts)
        if any(factor < 0 for factor in factors):
            raise UsageError("a factor must not be negative")
        for factor in (min(factors), max(factors)):
            inputs.scale(copied(inputs.data), path, factor)
        return InputAxis(path, tuple(f"*{text}" for text in texts), factors=factors)
    items = inputs.at(path)
    kind = items[0].kind
    if ".." in values and not _step(values)[1]:
        _ends(values)
        raise UsageError(
            "an input needs values to solve for: give a step (a..b step c) or a list (a,b,c); "
            "only a limit has exact break-points"
        )
    texts = _grid(values, None)
    quantities = [read_value(text, kind, path) for text in texts]
    written = [
        text if kind in (COUNT, TOTAL) else quantity_text(item, kind)
        for text, item in zip(texts, quantities, strict=True)
    ]
    inputs.set(copied(inputs.data), path, written[0])
    return InputAxis(path, tuple(texts), texts=tuple(written))


# --- values -------------------------------------------------------------------------------------------------------


def _step(values: str) -> tuple[str, str]:
    """The part before ``step``, and the step ("" when there is none)."""
    head, _, step = values.partition(" step ")
    if not step and values.rstrip().endswith(" step"):
        raise UsageError("a step is missing after `step`")
    return head.strip(), step.strip()


def _ends(values: str) -> tuple[str, str]:
    low, _, high = (part.strip() for part in values.partition(".."))
    if not low or not high or ".." in high:
        raise UsageError(f"expected LOW..HIGH, got {values!r}")
    first, last = parse_quantity(low), parse_quantity(high)
    if not first.unit and last.unit:
        low = f"{low} {last.unit}"
        first = parse_quantity(low)
    alike = _like(first, last)
    if alike is None:
        raise UsageError(f"the ends of the range are of different kinds: {low}, {high}")
    if alike.value > last.value:
        raise UsageError(f"the range is empty: {low} is above {high}")
    return low, high


def _grid(values: str, dimension: Any) -> list[str]:
    """The texts of ``a,b,c`` or ``a..b step c``; `dimension` is that of all, where it is known."""
    head, step_text = _step(values)
    if not step_text and ".." not in head:
        texts = [part.strip() for part in values.split(",")]
        if not all(texts):
            raise UsageError("an empty value")
        for text in texts:
            _check_dimension(parse_quantity(text), dimension)
        quantities = [parse_quantity(text) for text in texts]
        if len({(_like(quantity, quantities[0]) or quantity).value for quantity in quantities}) < len(texts):
            raise UsageError("a value is given twice")
        return texts
    if not step_text:
        raise UsageError("give a step (a..b step c), or a list (a,b,c)")
    low_text, high_text = _ends(head)
    low, high, step = (parse_quantity(text) for text in (low_text, high_text, step_text))
    for quantity in (low, high):
        _check_dimension(quantity, dimension)
    low, stride = _like(low, high) or low, _like(step, high)
    if stride is None:
        raise UsageError(f"the step {step_text} is not of the kind of {high_text}")
    step = stride
    if step.value <= 0:
        raise UsageError(f"a step must be above 0, got {step_text}")
    count = (high.value - low.value) // step.value + 1
    if count > MOST_VALUES:
        raise UsageError(f"{count} values: at most {MOST_VALUES}")
    return [_text(low.value + number * step.value, high) for number in range(int(count))]


def _like(quantity: Quantity, other: Quantity) -> Quantity | None:
    """A quantity beside another: where units are a total's own, in the other's unit; None where the kinds differ."""
    if quantity.dimension != other.dimension:
        return None
    ratio = Fraction(1) if quantity.dimension is not None else unit_ratio(quantity.unit, other.unit)
    return None if ratio is None else replace(quantity, value=quantity.value * ratio, unit=other.unit)


def _check_dimension(quantity: Quantity, dimension: Any) -> None:
    if dimension is not None and (quantity.dimension != dimension or quantity.unit not in ("", "%")):
        raise UsageError(f"a factor is a plain number, got {quantity.unit!r}")


def _text(value: Fraction, like: Quantity) -> str:
    one = parse_quantity(f"1 {like.unit}").value if like.unit and like.dimension is not None else Fraction(1)
    return f"{format_number(value / one)} {like.unit}".strip()


def grid_points(axes: Sequence[Axis]) -> list[tuple[int, ...]]:
    """The product of the axes' values, the last axis fastest.

    Raises
    ------
    UsageError
        when there are too many.
    """
    points: list[tuple[int, ...]] = [()]
    for axis in axes:
        if len(points) * len(axis.labels) > MOST_VALUES:
            raise UsageError(f"more than {MOST_VALUES} combinations of values")
        points = [(*point, number) for point in points for number in range(len(axis.labels))]
    return points
