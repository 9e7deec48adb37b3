"""Numbers that remember how they were made.

A design's figures as functions of its inputs, made by the analysis' own formulas.

A `Traced` number is an exact fraction with the expression it comes from. The formulas of `dse.analysis`, given traced
figures, compute their usual values and leave expressions behind, which a `Program` evaluates again for other inputs:
exactly, or for many samples at once. A comparison that a formula makes on the way is noted as a guard: where other
inputs would decide it otherwise, the expressions do not apply, and the formulas are run again.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy

Number = Any  # an exact fraction, or an array of floats


@dataclass(frozen=True, eq=False, slots=True)
class Node:
    """An expression: ``var`` (`value` is its index), ``const`` (`value`), or an operation on other nodes."""

    operation: str
    parts: tuple[Node, ...] = ()
    value: Any = None


@dataclass(frozen=True, slots=True)
class Guard:
    """A comparison that was made: `operation` of left and right had `outcome`."""

    operation: str
    left: Node
    right: Node
    outcome: bool


OPERATIONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
COMPARISONS: Mapping[str, Callable[[Any, Any], Any]] = {"<": operator.lt, "<=": operator.le, "==": operator.eq}
_guards: list[list[Guard]] = []


@contextmanager
def watching() -> Any:
    """Note the guards of what is computed inside."""
    found: list[Guard] = []
    _guards.append(found)
    try:
        yield found
    finally:
        _guards.pop()


def _node(number: Any) -> Node:
    return number.node if isinstance(number, Traced) else Node("const", (), Fraction(number))


def _noted(operation: str, left: Any, right: Any, outcome: bool) -> bool:
    if _guards:
        _guards[-1].append(Guard(operation, _node(left), _node(right), outcome))
    return outcome


def _binary(sign: str, *, swapped: bool = False) -> Callable[[Any, Any], Any]:
    compute = OPERATIONS[sign]

    def method(self: Traced, other: Any) -> Any:
        if not isinstance(other, int | Fraction):
            return NotImplemented
        left, right = (other, self) if swapped else (self, other)
        value = compute(Fraction(left), Fraction(right))
        neutral = 0 if sign in "+-" else 1
        if (not swapped or sign in "+*") and not isinstance(other, Traced) and other == neutral:
            return Traced(value, self.node)
        return Traced(value, Node(sign, (_node(left), _node(right))))

    return method


def _integer(compute: Callable[..., Any]) -> Callable[..., Any]:
    """An operation that makes an integer of a number: its outcome is known for this very number only."""

    def method(self: Traced, *others: Any) -> Any:
        for number in (self, *others):
            if isinstance(number, Traced):
                _noted("==", number, Fraction(number), True)
        return compute(Fraction(self), *(Fraction(other) if isinstance(other, Fraction) else other for other in others))

    return method


def _whole(value: Fraction) -> int:
    """A number of cores or items as what counts and repeats."""
    if value.denominator != 1:
        raise TypeError(f"{value} is no whole number")
    return value.numerator


class Traced(Fraction):
    """An exact fraction with the expression that made it; equal to, and hashed like, the plain number."""

    __slots__ = ("node",)
    node: Node

    def __new__(cls, value: Any, node: Node) -> Traced:
        """A number with the expression that made it."""
        made = super().__new__(cls, value)
        made.node = node
        return made

    __add__, __radd__ = _binary("+"), _binary("+", swapped=True)
    __sub__, __rsub__ = _binary("-"), _binary("-", swapped=True)
    __mul__, __rmul__ = _binary("*"), _binary("*", swapped=True)
    __truediv__, __rtruediv__ = _binary("/"), _binary("/", swapped=True)
    __floordiv__, __mod__, __divmod__ = _integer(operator.floordiv), _integer(operator.mod), _integer(divmod)
    __rfloordiv__ = _integer(lambda self, other: other // self)
    __rmod__ = _integer(lambda self, other: other % self)
    __floor__, __ceil__ = _integer(lambda self: self.__floor__()), _integer(lambda self: self.__ceil__())
    __trunc__, __int__ = _integer(int), _integer(int)
    __index__ = _integer(lambda self: _whole(self))
    __round__, __float__ = _integer(round), _integer(float)
    __hash__ = Fraction.__hash__

    def __neg__(self) -> Any:
        return 0 - self

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return -self if self < 0 else self

    def __bool__(self) -> bool:
        return not _noted("==", self, 0, self.numerator == 0)

    def __eq__(self, other: object) -> bool:
        same = Fraction(self) == other
        return _noted("==", self, other, same) if isinstance(other, int | Fraction) else same

    def __lt__(self, other: Any) -> bool:
        return _noted("<", self, other, Fraction(self) < Fraction(other))

    def __le__(self, other: Any) -> bool:
        return _noted("<=", self, other, Fraction(self) <= Fraction(other))

    def __gt__(self, other: Any) -> bool:
        return not _noted("<=", self, other, Fraction(self) <= Fraction(other))

    def __ge__(self, other: Any) -> bool:
        return not _noted("<", self, other, Fraction(self) < Fraction(other))

    def __reduce__(self) -> Any:
        return Fraction, (self.numerator, self.denominator)

    def __format__(self, spec: str) -> str:
        return (
            format(int(Fraction(self)), spec) if spec and self.denominator == 1 else format(str(Fraction(self)), spec)
        )


class Program:
    """Expressions in the order of evaluation, each once, with their outputs and guards by number."""

    def __init__(self, outputs: Sequence[Fraction], guards: Sequence[Guard]) -> None:
        self.steps: list[tuple[str, Any, int]] = []
        self._numbers: dict[int, int] = {}
        self._known: dict[tuple[str, Any, int], int] = {}
        self._kept: list[Node] = []
        self.outputs = [self._number(_node(output)) for output in outputs]
        listed = {
            (guard.operation, self._number(guard.left), self._number(guard.right), guard.outcome) for guard in guards
        }
        self.guards = [item for item in sorted(listed) if self._depends(item[1]) or self._depends(item[2])]
        self._numbers.clear()
        self._kept.clear()

    def _number(self, node: Node) -> int:
        """The number of a node's step; adds the steps that it needs, children first."""
        stack = [node]
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

    @property
    def has_steps(self) -> bool:
        """Whether some figure was made an integer on the way: the expressions then hold for very few inputs."""
        return any(
            sign == "==" and outcome and self.steps[right][:2] != ("const", 0)
            for sign, _, right, outcome in self.guards
        )

    def variables(self, number: int) -> frozenset[int]:
        """The variables that a step depends on."""
        found, stack, seen = set(), [number], set()
        while stack:
            at = stack.pop()
            if at in seen:
                continue
            seen.add(at)
            operation, left, right = self.steps[at]
            if operation == "var":
                found.add(left)
            elif operation != "const":
                stack += [left, right]
        return frozenset(found)

    def _depends(self, number: int) -> bool:
        return bool(self.variables(number))

    def run(self, inputs: Sequence[Number]) -> list[Number]:
        """The value of every step: exact for fractions; arrays of floats go through as arrays."""
        values: list[Number] = []
        vectors = any(isinstance(item, numpy.ndarray) for item in inputs)
        for operation, left, right in self.steps:
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
        for operation, left, right, outcome in self.guards:
            good = good & (COMPARISONS[operation](values[left], values[right]) == outcome)
        return good
