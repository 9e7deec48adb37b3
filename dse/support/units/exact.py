"""Exact numbers of times: integers and fractions, rounded ones, and what stands for a time without a bound.

Sums, differences and multiples of a number without a bound have none either, and whatever shows or writes figures asks
`is_unbounded` and says so in place of the number. As a number it is like any other: it may be compared, and counts for
what it stands for.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, TypeAlias

Exact: TypeAlias = int | Fraction
"""An exact number: an integer wherever it is whole."""


class Rounded(int):
    """An integer that a text was rounded to; `note` says so in words: ``"1.9 bit/s" counts as 1 bit/s``.

    `exact` is the value before.
    """

    note: str
    exact: Fraction

    def __new__(cls, value: int, note: str, exact: Fraction) -> Rounded:
        """The integer with its note, and the value that was rounded."""
        made = super().__new__(cls, value)
        made.note, made.exact = note, exact
        return made

    def __reduce__(self) -> tuple[type[Rounded], tuple[int, str, Fraction]]:
        return Rounded, (int(self), self.note, self.exact)


def unrounded(value: Exact) -> Exact:
    """A figure as it was stated, before it was rounded to an integer.

    A `Rounded` integer gives its exact fraction, every other number itself.
    """
    return value.exact if isinstance(value, Rounded) else value


def picked(kind: str, one: Any, other: Any) -> Any:
    """The greater or the less of two numbers, which remember it where they remember how they were made.

    `kind` is ``max`` or ``min``; traced numbers return a traced result.
    """
    if type(one) is not int or type(other) is not int:
        remembers = next((number for number in (one, other) if hasattr(number, "picked")), None)
        if remembers is not None:
            return remembers.picked(kind, other if remembers is one else one)
    return max(one, other) if kind == "max" else min(one, other)


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
