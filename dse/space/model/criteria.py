"""The criteria for a design: metrics, requirements, rules and objectives, with names resolved."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Literal, TypeAlias

from dse.space.model.trees import Tree
from dse.spec.language.expressions import And, Not, Operator, Or
from dse.support.units import DIMENSIONLESS, Quantity


@dataclass(frozen=True)
class Metric:
    """A resolved metric: `kind` and the index (or component name) it is of.

    `kind` is ``latency``, ``min latency``, ``jitter`` (of a flow), ``utilisation`` (of a processor), ``core
    utilisation`` (of the core of a processor that `key` states, from 1), ``load`` and ``busy`` (of a bus), ``response
    time`` (of a thread) and ``message response`` (of a connection; of both `key` is ``deadline`` where its own is the
    limit), ``price``, ``power``, ``total`` (`key` names
    it; `of` a component, or all), ``oldest input`` and ``newest input`` (of a flow at the component whose number `key`
    is), ``changes``, ``derived``, or an extreme: ``max`` and ``min`` are the greatest and
    the least of `operands`, each a sum of metrics times constants.
    """

    name: str
    kind: str
    index: int | None = None
    key: str = ""
    of: str = ""
    operands: tuple[tuple[tuple[Quantity, Metric], ...], ...] = ()


@dataclass(frozen=True)
class ValueTest:
    """A figure compared with a value, or (``in``) with several; unknown where the figure is inactive.

    `tree` gives the figure in a design, `value` has its base unit; operators are those of rules.
    """

    tree: Tree
    operator: str
    value: Any


@dataclass(frozen=True)
class PairTest:
    """Two figures compared; unknown where either is inactive.

    Both trees have values of one kind, in one base unit.
    """

    left: Tree
    operator: str
    right: Tree


@dataclass(frozen=True)
class MultipleTest:
    """Whether the left period is an integer multiple of the right one; unknown where either is inactive.

    Exact integers in ns.
    """

    left: Tree
    right: Tree


@dataclass(frozen=True)
class UsedTest:
    """Whether any of the type figures has one of the names beside it (of a binding: one of the slots, by index).

    Pairs of a tree and the names (or slot indices) that make the test true.
    """

    types: tuple[tuple[Tree, tuple[str | int, ...]], ...]


Atom: TypeAlias = ValueTest | PairTest | MultipleTest | UsedTest


ResolvedCondition: TypeAlias = Atom | Not["ResolvedCondition"] | And["ResolvedCondition"] | Or["ResolvedCondition"]


@dataclass(frozen=True)
class Requirement:
    """``metric operator limit``; a ratio limits utilisation or load by the capacity of the processor or bus.

    `text` is the user's own, `origin` its place in the file (or the command line). One that is `implied` nobody states
    (`dse.space.question.implied`). `stated` is the whole statement where that is of several metrics, such as ``jitter
    <= 5 ms`` of every flow: there is a requirement for each.
    """

    text: str
    metric: Metric
    operator: Operator
    limit: Quantity
    origin: str = ""
    implied: bool = False
    stated: str = field(default="", compare=False)

    @property
    def is_upper(self) -> bool:
        """Whether it is an upper limit: ``<=`` or ``<``."""
        return self.operator in ("<=", "<")

    @property
    def is_deadline(self) -> bool:
        """Whether the requirement is an upper limit on a response time.

        Other requirements on response times, such as lower limits, are none.
        """
        return self.metric.kind == "response time" and self.is_upper

    @property
    def is_share(self) -> bool:
        """Whether the limit is a share of what the processor or the bus has.

        Then the limit is dimensionless: of the capacity of the chosen type, which can differ between designs.
        """
        return self.metric.kind in ("utilisation", "load") and self.limit.dimension == DIMENSIONLESS

    @property
    def shown(self) -> str:
        """The text; an implied requirement is marked as such."""
        return f"{self.text} (implied)" if self.implied else self.text


@dataclass(frozen=True)
class Rule:
    """A rule between decisions, in the user's words and as a tree of tests.

    `origin` is ``FILE:LINE`` or ``command line``.
    """

    text: str
    verb: Literal["require", "forbid"]
    condition: ResolvedCondition
    origin: str = ""


@dataclass(frozen=True)
class Objective:
    """An objective: a metric to minimise or maximise; `origin` is its place in the file (or the command line).

    Two objectives are equal when text, sense and metric are.
    """

    text: str
    sense: Literal["minimise", "maximise"]
    metric: Metric
    origin: str = field(default="", compare=False)


@dataclass(frozen=True)
class Derived:
    """A derived metric: terms of (coefficient in coherent units, metric).

    `reach` is how many times the greatest metric of the file its figure may be at most, `size` how many such metrics it
    adds or compares.
    """

    name: str
    text: str
    terms: tuple[tuple[Quantity, Metric], ...]
    reach: Fraction = Fraction(1)
    size: int = 1
