"""Numbers that remember how they were made.

A design's figures as functions of its inputs, made by the analysis' own formulas.

A `Traced` number is an exact fraction with the expression it comes from. The formulas of `dse.analysis`, given traced
figures, compute their usual values and leave expressions behind, which a `Program` evaluates again for other inputs:
exactly, or for many samples at once. A comparison that a formula makes on the way is noted as a guard: where other
inputs would decide it otherwise, the expressions do not apply, and the formulas are run again.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partialmethod
from typing import Any

import numpy

from dse.analysis.scheduling.growth import Line
from dse.support.timelimit import look_at_the_clock
from dse.support.units import is_unbounded

Number = Any  # an exact fraction, or an array of floats


def _extreme(kind: str, one: Number, other: Number) -> Number:
    """The greater or the less of two numbers, or of two in each place."""
    if isinstance(one, numpy.ndarray) or isinstance(other, numpy.ndarray):
        return numpy.maximum(one, other) if kind == "max" else numpy.minimum(one, other)
    return max(one, other) if kind == "max" else min(one, other)


@dataclass(frozen=True, eq=False, slots=True)
class ExpressionNode:
    """An expression: ``var`` (`value` is its index), ``const`` (`value`), or an operation on other nodes.

    A directed acyclic graph: nodes are shared, and `Program` numbers each once.
    """

    operation: str
    parts: tuple[ExpressionNode, ...] = ()
    value: Any = None


@dataclass(frozen=True, slots=True)
class TracedComparison:
    """A comparison that was made: `operation` of left and right had `outcome`.

    It becomes a guard of the program: the expressions of all outputs are only right where each guard has the outcome
    that was noted.
    """

    operation: str
    left: ExpressionNode
    right: ExpressionNode
    outcome: bool


OPERATIONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "//": operator.floordiv,
    "max": lambda one, other: _extreme("max", one, other),
    "min": lambda one, other: _extreme("min", one, other),
}
COMPARISONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt,
    "<=": operator.le,
    "==": operator.eq,
    "floor": lambda value, whole: (whole <= value) & (value < whole + 1),
    "ceil": lambda value, whole: (whole - 1 < value) & (value <= whole),
}
STEPS = ("floor", "ceil")
"""Guards at whose borders a figure jumps."""
STEPS_A_LOOK = 4096
"""The number of steps, some milliseconds, between two looks at the clock."""
MOST_GUARDS = 5_000
"""Figures that need more comparisons (busy periods of thousands of jobs) are quicker computed than remembered."""


class Guards(list[TracedComparison]):
    """The comparisons that were made; more than `most` (where it is set) are an error.

    A list in the order in which the formulas compared; `TooManyGuardsError` stops a formula that compares without end,
    such as a loop over many periods.
    """

    most: int | None = None


_guards: list[Guards] = []


class TooManyGuardsError(Exception):
    """A figure takes more comparisons than are worth remembering.

    The caller then evaluates the analysis itself at each value, without a program.
    """


@contextmanager
def watching() -> Any:
    """Note the guards of what is computed inside.

    Raises
    ------
    TooManyGuardsError
        when there are more than the list's `most`.
    """
    guards = Guards()
    _guards.append(guards)
    try:
        yield guards
    finally:
        _guards.pop()


def _node(number: Any) -> ExpressionNode:
    if isinstance(number, Traced):
        return number.node
    return ExpressionNode("const", (), number if is_unbounded(number) else Fraction(number))


def untraced(number: Any) -> Any:
    """A number without its expression.

    The plain `Fraction` of a `Traced`; any other number is returned as it is.
    """
    return number.plain if isinstance(number, Traced) else number


def _noted(operation: str, left: Any, right: Any, outcome: bool) -> bool:
    if _guards:
        _guards[-1].append(TracedComparison(operation, _node(left), _node(right), outcome))
        if _guards[-1].most is not None and len(_guards[-1]) > _guards[-1].most:
            raise TooManyGuardsError
    return outcome


def _binary(sign: str, *, swapped: bool = False) -> Callable[[Any, Any], Any]:
    compute = OPERATIONS[sign]

    def method(self: Traced, other: Any) -> Any:
        if not isinstance(other, int | Fraction):
            return NotImplemented
        left, right = (other, self) if swapped else (self, other)
        value = compute(untraced(left), untraced(right))  # one of them is a fraction
        neutral = 0 if sign in "+-" else 1
        if (not swapped or sign in "+*") and not isinstance(other, Traced) and other == neutral:
            return Traced(value, self.node)
        return Traced(value, ExpressionNode(sign, (_node(left), _node(right))))

    return method


def _comparison(sign: str, *, turned: bool) -> Callable[[Any, Any], Any]:
    """A comparison by `sign`, or that it is not so; lines (`dse.analysis.scheduling.growth`) make it themselves."""
    compare = COMPARISONS[sign]

    def method(self: Traced, other: Any) -> Any:
        if isinstance(other, Line):
            return NotImplemented
        return _noted(sign, self, other, compare(self.plain, untraced(other))) != turned

    return method


def _integer(compute: Callable[..., Any]) -> Callable[..., Any]:
    """An operation that makes an integer of a number: its outcome is known for this very number only."""

    def method(self: Traced, *others: Any) -> Any:
        for number in (self, *others):
            if isinstance(number, Traced):
                _noted("==", number, number.plain, True)
        return compute(self.plain, *map(untraced, others))

    return method


def _rounded(operation: str, number: Any) -> int:
    """A number rounded down or up: the same integer for all numbers between it and the next."""
    whole: int = math.floor(untraced(number)) if operation == "floor" else math.ceil(untraced(number))
    if isinstance(number, Traced):
        _noted(operation, number, whole, True)
    return whole


def _rounding(self: Traced, operation: str) -> int:
    return _rounded(operation, self)


def _quotient(self: Traced, other: Any, *, swapped: bool = False) -> Any:
    if not isinstance(other, int | Fraction):
        return NotImplemented
    return _rounded("floor", other / self if swapped else self / other)


def _whole(value: Fraction) -> int:
    """A number of cores or items as what counts and repeats."""
    if value.denominator != 1:
        raise TypeError(f"{value} is no whole number")
    return value.numerator


class Traced(Fraction):
    """An exact fraction with the expression that made it; equal to, and hashed like, the plain number.

    Arithmetic gives `Traced` numbers, comparisons give plain booleans and note a guard. The formulas of the analysis
    run on them unchanged.
    """

    __slots__ = ("node", "plain")
    node: ExpressionNode
    plain: Fraction

    def __new__(cls, value: Any, node: ExpressionNode) -> Traced:
        """A number with the expression that made it."""
        plain = Fraction(untraced(value))
        made = super().__new__(cls, plain)
        made.node, made.plain = node, plain
        return made

    @property
    def numerator(self) -> int:
        """Asked for by whoever takes the number apart: what is made of that is known for this very number only.

        A guard ``== value`` is noted, because whoever reads the integer may use it in ways that no expression can
        follow.
        """
        _noted("==", self, self.plain, True)
        return self.plain.numerator

    @property
    def denominator(self) -> int:
        """The denominator of the plain number.

        A guard ``== value`` is noted, because whoever reads the integer may use it in ways that no expression can
        follow.
        """
        _noted("==", self, self.plain, True)
        return self.plain.denominator

    __add__, __radd__ = _binary("+"), _binary("+", swapped=True)
    __sub__, __rsub__ = _binary("-"), _binary("-", swapped=True)
    __mul__, __rmul__ = _binary("*"), _binary("*", swapped=True)
    __truediv__, __rtruediv__ = _binary("/"), _binary("/", swapped=True)
    __floordiv__, __rfloordiv__ = _quotient, partialmethod(_quotient, swapped=True)
    __mod__, __divmod__ = _integer(operator.mod), _integer(divmod)
    __rmod__ = _integer(lambda self, other: other % self)
    __floor__, __ceil__ = partialmethod(_rounding, "floor"), partialmethod(_rounding, "ceil")
    __trunc__, __int__ = _integer(int), _integer(int)
    __index__ = _integer(lambda self: _whole(self))
    __round__, __float__ = _integer(round), _integer(float)
    __hash__ = Fraction.__hash__

    def picked(self, kind: str, other: Any) -> Traced:
        """The greater (`kind` ``max``) or the less (``min``) of two numbers: an expression, no guard.

        A node ``max`` or ``min`` over both expressions; no guard is needed, because the expression is right whichever
        number is the greater.
        """
        value = _extreme(kind, self.plain, untraced(other))
        return Traced(value, ExpressionNode(kind, (self.node, _node(other))))

    def whole_steps(self, step: Any) -> Traced:
        """The number of whole steps in the value, as an expression that jumps, without a guard.

        The floor of the quotient as a node ``//``; right for every value, unlike a rounding that is noted as a guard.
        """
        value = self.plain // untraced(step)
        return Traced(value, ExpressionNode("//", (self.node, _node(step))))

    def __neg__(self) -> Any:
        return 0 - self

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return -self if self < 0 else self

    def __bool__(self) -> bool:
        return not _noted("==", self, 0, self.plain == 0)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Line):
            return NotImplemented
        same = self.plain == untraced(other)
        return _noted("==", self, other, same) if isinstance(other, int | Fraction) else same

    __lt__, __gt__ = _comparison("<", turned=False), _comparison("<=", turned=True)
    __le__, __ge__ = _comparison("<=", turned=False), _comparison("<", turned=True)

    def __reduce__(self) -> Any:
        return Fraction, (self.plain.numerator, self.plain.denominator)

    def __str__(self) -> str:
        return str(self.plain)

    def __format__(self, spec: str) -> str:
        whole = spec and self.plain.denominator == 1
        return format(int(self.plain), spec) if whole else format(str(self.plain), spec)


class Program:
    """Expressions in the order of evaluation, each once, with their outputs and guards by number.

    A step is (operation, left, right): numbers of earlier steps, a variable's index, or a constant. Guards are
    (operation, left, right, outcome).
    """

    def __init__(self, outputs: Sequence[Fraction], guards: Sequence[TracedComparison]) -> None:
        self.steps: list[tuple[str, Any, int]] = []
        self._numbers: dict[int, int] = {}
        self._known: dict[tuple[str, Any, int], int] = {}
        self._kept: list[ExpressionNode] = []
        self.outputs = [self._number(_node(output)) for output in outputs]
        listed = {
            (guard.operation, self._number(guard.left), self._number(guard.right), guard.outcome) for guard in guards
        }
        varying = self.reached(frozenset(value for operation, value, _ in self.steps if operation == "var"))
        self.guards = [
            (operation, left, right, outcome)
            for operation, left, right, outcome in sorted(listed)
            if left != right and (varying[left] or varying[right])  # a step is always equal to itself
        ]
        self._numbers.clear()
        self._kept.clear()

    def _number(self, node: ExpressionNode) -> int:
        """The number of a node's step; adds the steps that it needs, children first."""
        stack = [node]
        look_at_the_clock()
        while stack:
            top = stack[-1]
            if id(top) in self._numbers:
                stack.pop()
                continue
            missing = [part for part in top.parts if id(part) not in self._numbers]
            if missing:
                stack.extend(missing)
                continue
            stack.pop()
            if top.parts:
                left, right = (self._numbers[id(part)] for part in top.parts)
                step = (top.operation, left, right)
            else:
                step = (top.operation, top.value, 0)
            if step not in self._known:
                self._known[step] = len(self.steps)
                self.steps.append(step)
            self._numbers[id(top)] = self._known[step]
            self._kept.append(top)
        return self._numbers[id(node)]

    def reached(self, moving: frozenset[int]) -> list[bool]:
        """For each step whether it depends on some of these variables.

        A list of booleans as long as `steps`; `moving` are indices of variables.
        """
        is_reached: list[bool] = []
        for operation, left, right in self.steps:
            if operation in ("var", "const"):
                is_reached.append(operation == "var" and left in moving)
            else:
                is_reached.append(is_reached[left] or is_reached[right])
        return is_reached

    def needed(self, ends: Sequence[int]) -> list[int]:
        """The steps that some steps are made of, themselves among them, in the order of evaluation.

        Ascending numbers of steps: the transitive operands of `ends`. What is not in the list need not be evaluated.
        """
        numbers: set[int] = set()
        stack = list(ends)
        while stack:
            number = stack.pop()
            if number in numbers:
                continue
            numbers.add(number)
            operation, left, right = self.steps[number]
            if operation not in ("var", "const"):
                stack += [left, right]
        return sorted(numbers)

    def variables(self, number: int) -> frozenset[int]:
        """The variables that a step depends on.

        Indices of variables among all operands of step `number`.
        """
        steps = (self.steps[at] for at in self.needed([number]))
        return frozenset(value for operation, value, _ in steps if operation == "var")

    @cached_property
    def deciding(self) -> frozenset[int]:
        """The variables that the guards depend on.

        Indices of variables. Inputs outside the set cannot invalidate the program, however far they move.
        """
        sides = [side for _, left, right, _ in self.guards for side in (left, right)]
        steps = (self.steps[at] for at in self.needed(sides))
        return frozenset(value for operation, value, _ in steps if operation == "var")

    def run(self, inputs: Sequence[Number]) -> list[Number]:
        """The value of every step: exact for fractions; arrays of floats go through as arrays.

        `inputs` by index of variable. A long program looks at the time limit now and then (`OutOfTime`).
        """
        values: list[Number] = []
        vectors = any(isinstance(item, numpy.ndarray) for item in inputs)
        for number, (operation, left, right) in enumerate(self.steps):
            if not number % STEPS_A_LOOK:
                look_at_the_clock()
            if operation == "var":
                values.append(inputs[left])
            elif operation == "const":
                values.append(float(left) if vectors else left)
            else:
                values.append(OPERATIONS[operation](values[left], values[right]))
        return values

    def holds(self, values: Sequence[Number]) -> Any:
        """Whether every guard is decided as it was when the expressions were made.

        A truth value, or an array of them.
        """
        good: Any = True
        for number, (operation, left, right, outcome) in enumerate(self.guards):
            if not number % STEPS_A_LOOK:
                look_at_the_clock()
            good = good & (COMPARISONS[operation](values[left], values[right]) == outcome)
        return good
