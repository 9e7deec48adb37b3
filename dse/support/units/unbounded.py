"""A time without a bound: a number that stands for it in sums, and does not pass for a figure.

Sums, differences and multiples of such a number are such numbers, and whatever shows or writes figures asks
`is_unbounded` and says so in place of the number. As a number it is like any other: it may be compared, and counts for
what it stands for.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any


def _lasting(compute: Callable[..., Any]) -> Callable[..., Any]:
    """An operation of fractions whose outcome, where it is one, is unbounded as well; nothing is left of 0 times it."""

    def method(self: Unbounded, *others: Any) -> Any:
        if any(type(other) not in (int, Fraction, Unbounded) and isinstance(other, Fraction) for other in others):
            return NotImplemented  # traced numbers do what they do with any number
        result = compute(self, *others)
        if not isinstance(result, int | Fraction) or (compute in _PRODUCTS and not result):
            return result
        return Unbounded(result)

    return method


_PRODUCTS = (Fraction.__mul__, Fraction.__rmul__)


class Unbounded(Fraction):
    """Stands for a time without a bound.

    >>> Unbounded(10) - 3, Fraction(1, 2) * Unbounded(10), 0 * Unbounded(10)
    (Unbounded(7, 1), Unbounded(5, 1), Fraction(0, 1))
    """

    __slots__ = ()

    __add__, __radd__ = _lasting(Fraction.__add__), _lasting(Fraction.__radd__)
    __sub__, __rsub__ = _lasting(Fraction.__sub__), _lasting(Fraction.__rsub__)
    __mul__, __rmul__ = _lasting(Fraction.__mul__), _lasting(Fraction.__rmul__)
    __truediv__ = _lasting(Fraction.__truediv__)
    __neg__, __abs__ = _lasting(Fraction.__neg__), _lasting(Fraction.__abs__)
    __ceil__ = _lasting(Fraction.__ceil__)
    __hash__ = Fraction.__hash__


def is_unbounded(value: Any) -> bool:
    """Whether a number stands for a time without a bound.

    False for every finite number, however large.
    """
    return isinstance(value, Unbounded)
