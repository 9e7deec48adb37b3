"""Interval arithmetic over the steps of a program: values, derivatives and degrees over a box of inputs, exact."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from typing import Any

from dse.questions.sensitivity.traced_numbers import Program
from dse.questions.sensitivity.uncertainty import Uncertain
from dse.support.errors import UsageError

Interval = tuple[Fraction, Fraction]
ZERO = (Fraction(0), Fraction(0))
INFINITE: Any = inf
"""The slope of a jump; all others are exact fractions."""
EXTREMES: dict[str, Callable[..., Fraction]] = {"max": max, "min": min}


@dataclass(frozen=True)
class Further:
    """A variable that follows from the inputs: its values over the box, and its slopes in each uncertain input.

    A response time is such a variable: bounded at both ends of the box and known to be monotonic, but without an
    expression of its own.
    """

    range: Interval
    slopes: tuple[Interval, ...]


class NotProvedError(UsageError):
    """A requirement is neither proved nor refuted over the whole box of inputs.

    Raised where interval arithmetic is too coarse or a formula leaves its domain; the message names the reason. The
    robust front then refuses the input.
    """


def seeds_of(
    uncertain: Sequence[Uncertain], first: int = 0, further: Sequence[Further] = ()
) -> list[dict[int, Interval]]:
    """The slopes of the variables that move with each uncertain input; `further` variables are numbered from `first`.

    One mapping for each uncertain input: variable index to the interval of its derivative (1 for the input itself, the
    nominal value for a factor).
    """
    seeds: list[dict[int, Interval]] = []
    for number, item in enumerate(uncertain):
        slopes = {variable.index: variable.nominal if item.is_factor else Fraction(1) for variable in item.variables}
        moved = {first + place: other.slopes[number] for place, other in enumerate(further)}
        seeds.append({index: (slope, slope) for index, slope in slopes.items()} | moved)
    return seeds


def is_zero_test(program: Program, number: int) -> bool:
    """Whether a step is the constant 0, which a guard compares with."""
    operation, value, _ = program.steps[number]
    return operation == "const" and value == 0


def undecided_over(program: Program, ranges: Sequence[Interval]) -> list[tuple[int, int, str, bool]]:
    """The guards that do not hold in the whole box: both sides' numbers, operation, outcome.

    The program is exact in the whole box only if the list is empty. An outcome is decided when both intervals lie on
    one side of the comparison, or of the whole number that a rounding gave.
    """
    values = values_over(program, ranges)
    undecided = []
    for operation, left, right, outcome in program.guards:
        (low, high), (least, most) = values[left], values[right]
        if operation == "<":
            decided = high < least if outcome else low >= most
        elif operation == "<=":
            decided = high <= least if outcome else low > most
        elif operation == "floor":
            decided = least <= low and high < least + 1
        elif operation == "ceil":
            decided = least - 1 < low and high <= least
        else:
            decided = low == high == least == most if outcome else high < least or low > most
        if not decided:
            undecided.append((left, right, operation, outcome))
    return undecided


def values_over(program: Program, ranges: Sequence[Interval]) -> list[Interval]:
    """The interval of each step.

    Pairs (low, high) in the order of the steps, by interval arithmetic: the true range is inside, and may be narrower
    (Moore 1966).

    Raises `NotProvedError` for a division by an interval that contains 0.
    """
    values: list[Interval] = []
    for operation, left, right in program.steps:
        if operation == "var":
            values.append(ranges[left])
        elif operation == "const":
            values.append((left, left))
        else:
            values.append(combined(operation, values[left], values[right]))
    return values


def combined(operation: str, one: Interval, other: Interval) -> Interval:
    """An operation on two intervals.

    Exact ends of ``one operation other`` for ``+ - * / //``, ``min`` and ``max``.

    Raises `NotProvedError` when the divisor's interval contains 0, or a whole division has a divisor that is not
    constant.
    """
    if operation == "+":
        return one[0] + other[0], one[1] + other[1]
    if operation == "-":
        return one[0] - other[1], one[1] - other[0]
    if operation == "*":
        ends = [_times(a, b) for a in one for b in other]
        return min(ends), max(ends)
    if operation == "//":
        if other[0] != other[1]:
            raise NotProvedError("the periods of timers on one clock move within the stated ranges")
        return Fraction(one[0] // other[0]), Fraction(one[1] // other[0])
    if operation in EXTREMES:
        pick = EXTREMES[operation]
        return pick(one[0], other[0]), pick(one[1], other[1])
    if other[0] <= 0 <= other[1]:
        raise NotProvedError("a stated range reaches 0 where a formula divides by it")
    ends = [a / b for a in one for b in other]
    return min(ends), max(ends)


def _times(one: Fraction, other: Fraction) -> Fraction:
    """A product; what jumps (`INFINITE`) does not where it is taken 0 times."""
    return one * other if one and other else Fraction(0)


def slopes_over(program: Program, values: Sequence[Interval], seeds: Mapping[int, Interval]) -> list[Interval]:
    """The derivative of each step over the box, by interval arithmetic: infinite where it jumps.

    Forward differentiation: `seeds` are the derivatives of the variables in one uncertain input, `values` the steps'
    intervals from `values_over`. A step whose interval has one sign is monotonic over the box.
    """
    slopes: list[Interval] = []
    for operation, left, right in program.steps:
        if operation in ("var", "const"):
            slopes.append(seeds.get(left, ZERO) if operation == "var" else ZERO)
        elif slopes[left] == ZERO and slopes[right] == ZERO:
            slopes.append(ZERO)
        elif operation in EXTREMES:
            slopes.append(_slope_of_extreme(operation, (values[left], values[right]), (slopes[left], slopes[right])))
        elif operation == "//":
            slopes.append(_slope_of_steps(values[len(slopes)], slopes[left]))
        elif operation in "+-":
            slopes.append(combined(operation, slopes[left], slopes[right]))
        else:
            first, second = combined("*", slopes[left], values[right]), combined("*", values[left], slopes[right])
            if operation == "*":
                slopes.append(combined("+", first, second))
            else:
                slopes.append(combined("/", combined("-", first, second), combined("*", values[right], values[right])))
    return slopes


def _slope_of_extreme(operation: str, values: tuple[Interval, Interval], slopes: tuple[Interval, Interval]) -> Interval:
    """The slope of the number that counts, where it is decided which that is; else the hull of both slopes."""
    for this, that in ((0, 1), (1, 0)):
        low, high = values[this], values[that]
        if (low[0] >= high[1]) if operation == "max" else (low[1] <= high[0]):
            return slopes[this]
    return min(slopes[0][0], slopes[1][0]), max(slopes[0][1], slopes[1][1])


def _slope_of_steps(values: Interval, slope: Interval) -> Interval:
    """Whole steps jump the way that what they count moves; where there are as many everywhere they do not move."""
    if values[0] == values[1]:
        return ZERO
    return -INFINITE if slope[0] < 0 else ZERO[0], INFINITE if slope[1] > 0 else ZERO[1]


def degrees_over(program: Program, values: Sequence[Interval], seeds: Mapping[int, Interval]) -> list[int]:
    """The degree of each step in an input; 2 stands for anything that is not linear.

    0 for a constant, 1 for an affine step, 2 for anything else; from the rules of sums and products. Extremes of a step
    of degree 1 are at ends of the box, whatever the other inputs are.
    """
    degrees: list[int] = []
    for operation, left, right in program.steps:
        if operation in ("var", "const"):
            low, high = seeds.get(left, ZERO) if operation == "var" else ZERO
            degrees.append(0 if low == high == 0 else 1 if low == high else 2)
        elif operation in EXTREMES:
            degrees.append(2 if degrees[left] or degrees[right] else 0)
        elif operation == "//":
            low, high = values[len(degrees)]
            degrees.append(2 if degrees[left] and low != high else 0)
        elif operation in "+-":
            degrees.append(max(degrees[left], degrees[right]))
        elif operation == "*":
            degrees.append(min(2, degrees[left] + degrees[right]))
        else:
            degrees.append(degrees[left] if degrees[right] == 0 else 2)
    return degrees
