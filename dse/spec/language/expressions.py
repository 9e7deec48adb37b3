"""The syntax trees of the expression language: requirements, objectives, derived metrics and rules.

`dse.spec.language.grammar` makes them from text; names are not resolved here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Literal, TypeAlias, TypeVar

from dse.support.units import Quantity

Operator: TypeAlias = Literal["<=", "<", ">=", ">", "==", "!="]
Operand = TypeVar("Operand", covariant=True)
"""The type of the operands of a connective: conditions as written, or resolved ones."""


@dataclass(frozen=True)
class MetricRef:
    """``METRIC [of NAME]``.

    `metric` is ``latency``, ``min latency``, ``jitter``, ``utilisation``, ``load``, ``price``, ``power``, or the name
    of a declared total or derived metric.
    """

    metric: str
    of: str | None = None

    def __str__(self) -> str:
        return f"{self.metric} of {self.of}" if self.of is not None else self.metric


@dataclass(frozen=True)
class ExtremeRef:
    """``max(A, B, …)`` or ``min(…)`` of sums of metrics; a metric without ``of`` stands for all of its kind.

    In a derived metric or an objective, such as ``minimise max(latency)``; each operand is a sum of metrics.
    """

    kind: Literal["max", "min"]
    operands: tuple[DerivedExpr, ...]

    def __str__(self) -> str:
        return f"{self.kind}({', '.join(item.text for item in self.operands)})"


MetricExpr: TypeAlias = MetricRef | ExtremeRef


@dataclass(frozen=True)
class RequirementExpr:
    """``METRIC [of NAME] OP QUANTITY``.

    The text as written, a metric by name, one of ``<= < >= > ==``, and a limit with its unit.
    """

    text: str
    metric: MetricExpr
    operator: Operator
    limit: Quantity


@dataclass(frozen=True)
class ObjectiveExpr:
    """``minimise METRIC [of NAME]`` or ``maximise …``."""

    text: str
    sense: Literal["minimise", "maximise"]
    metric: MetricExpr


@dataclass(frozen=True)
class DerivedExpr:
    """A sum of metrics, each times an exact constant (in coherent units, see `dse.support.units`).

    Such as ``2 * latency of a + latency of b``; the constants may carry units, so that terms of different kinds can be
    added.
    """

    text: str
    terms: tuple[tuple[Quantity, MetricExpr], ...]


@dataclass(frozen=True)
class Ref:
    """``COMPONENT.FIELD``, as known to the space: the full name of a decision."""

    name: str


@dataclass(frozen=True)
class Compare:
    """A decision compared with a literal (its text, or for ``in`` several) or with another decision.

    Options are compared by their text, ordered ones by value; ``right`` is the literal or the other decision.
    """

    left: Ref
    operator: Operator
    right: Ref | str


@dataclass(frozen=True)
class OneOf:
    """``REF in [a, b, …]``."""

    ref: Ref
    values: tuple[str, ...]


@dataclass(frozen=True)
class MultipleOf:
    """``REF is a multiple of REF``: integer multiple, 1 included.

    Used for harmonic periods: 20 ms is a multiple of 10 ms and of 20 ms, not of 15 ms.
    """

    left: Ref
    right: Ref


@dataclass(frozen=True)
class Used:
    """A bare name: a type that some slot or component has, or a slot that is not empty.

    The condition is true in designs where the type is chosen, or the slot is filled.
    """

    name: str


@dataclass(frozen=True)
class Not(Generic[Operand]):
    """Negation."""

    operand: Operand


@dataclass(frozen=True)
class And(Generic[Operand]):
    """Conjunction of two or more conditions."""

    operands: tuple[Operand, ...]


@dataclass(frozen=True)
class Or(Generic[Operand]):
    """Disjunction of two or more conditions; ``A implies B`` is ``not A or B``."""

    operands: tuple[Operand, ...]


Condition: TypeAlias = Compare | OneOf | MultipleOf | Used | Not["Condition"] | And["Condition"] | Or["Condition"]


@dataclass(frozen=True)
class RuleExpr:
    """``require CONDITION`` (broken when false) or ``forbid CONDITION`` (broken when true).

    Conditions are trees of `And`, `Or`, `Not`, comparisons and names.
    """

    text: str
    verb: Literal["require", "forbid"]
    condition: Condition
