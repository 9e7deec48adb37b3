"""Numbers that grow in a straight line, to follow slow growth in one step.

Response times that are raised round by round may grow by the same little each time, thousands of times, before they
stand still or exceed what counts as bounded. A `Line` is such a number after t more rounds, ``at`` + ``slope`` t. The
formulas of `dse.analysis`, given lines, make the comparisons and roundings that they make just after t = 0, and the
lines' `Reach` notes until when each of them comes out the same. So long what the formulas found is found for each t
between, exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from fractions import Fraction
from math import ceil
from typing import Any, ClassVar

from dse.support.units import Exact

Known = Mapping[Hashable, "Exact | None"]


MOST_SUMS = 20_000
"""Formulas that take more sums of lines, some ten milliseconds, are quicker computed than followed."""


class TooLongError(Exception):
    """Formulas take more than `MOST_SUMS`.

    The rounds are then made one by one.
    """


class Reach:
    """Until which t the comparisons that were made come out the same; None for ever.

    Shared by all lines of one computation; each comparison may shorten it.
    """

    until: Exact | None = None
    sums = 0

    def _ends_at(self, time: Exact) -> None:
        """Some comparison comes out otherwise from then on."""
        if self.until is None or time < self.until:
            self.until = time


class Line:
    """The number ``at + slope * t`` for t greater than 0 and below its `reach`.

    Arithmetic and comparisons of such numbers give the steps for which the fixed point grows by equal amounts.
    """

    __slots__ = ("at", "reach", "slope")
    __hash__: ClassVar[None]  # type: ignore[assignment]

    def __init__(self, at: Exact, slope: Exact, reach: Reach) -> None:
        self.at, self.slope, self.reach = at, slope, reach

    def _sum(self, other: Any, sign: int) -> Line:
        self.reach.sums += 1
        if self.reach.sums > MOST_SUMS:
            raise TooLongError
        if isinstance(other, Line):
            return Line(self.at + sign * other.at, self.slope + sign * other.slope, self.reach)
        return Line(self.at + sign * other, self.slope, self.reach)

    def __add__(self, other: Any) -> Line:
        return self._sum(other, 1)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Line:
        return self._sum(other, -1)

    def __rsub__(self, other: Any) -> Line:
        return (-self)._sum(other, 1)

    def __neg__(self) -> Line:
        return Line(-self.at, -self.slope, self.reach)

    def __mul__(self, factor: Exact) -> Line:
        return Line(self.at * factor, self.slope * factor, self.reach)

    __rmul__ = __mul__

    def __truediv__(self, divisor: Exact) -> Line:
        return Line(Fraction(1) * self.at / divisor, Fraction(1) * self.slope / divisor, self.reach)

    def __floordiv__(self, step: Exact) -> Any:
        """How many whole steps, of more than 0, are in it."""
        whole = self.at // step
        if self.slope < 0 and whole * step == self.at:
            whole -= 1
        if self.slope:
            border = (whole + 1) * step if self.slope > 0 else whole * step
            self.reach._ends_at(Fraction(1) * (border - self.at) / self.slope)
        return whole

    def _sign(self, other: Any) -> int:
        """Whether it is less than a number (-1), the same for each t (0), or greater (1)."""
        apart = self._sum(other, -1)
        if apart.at == 0:
            return int(apart.slope > 0) - int(apart.slope < 0)
        if apart.slope and (apart.at < 0) == (apart.slope > 0):
            self.reach._ends_at(Fraction(1) * -apart.at / apart.slope)
        return int(apart.at > 0) - int(apart.at < 0)

    def __lt__(self, other: Any) -> bool:
        return self._sign(other) < 0

    def __le__(self, other: Any) -> bool:
        return self._sign(other) <= 0

    def __gt__(self, other: Any) -> bool:
        return self._sign(other) > 0

    def __ge__(self, other: Any) -> bool:
        return self._sign(other) >= 0

    def __eq__(self, other: object) -> bool:
        return other is not None and self._sign(other) == 0

    def __bool__(self) -> bool:
        return self._sign(0) != 0

    def _is_raised(self, other: Any) -> bool:
        """Whether a number, or a line, is this line a round later."""
        if other is None:
            return False
        found = other if isinstance(other, Line) else Line(other, 0, self.reach)
        return bool(found.at == self.at + self.slope and found.slope == self.slope)


def growth(history: Sequence[Known]) -> tuple[int, dict[Hashable, Exact]] | None:
    """After how many rounds all that is known, as a history tells, has grown by the same again, and by how much each.

    None where it has not.

    >>> growth([{"a": 1, "b": None}, {"a": 3, "b": None}, {"a": 5, "b": None}])
    (1, {'a': 2})
    >>> growth([{"a": 1}, {"a": 3}, {"a": 4}, {"a": 6}, {"a": 7}])
    (2, {'a': 3})
    """
    last = history[-1]
    for rounds in range(1, (len(history) + 1) // 2):
        earlier, first = history[-1 - rounds], history[-1 - 2 * rounds]
        if all(_as_before(last.get(key), earlier.get(key), first.get(key)) for key in last):
            raised = {key: value - earlier[key] for key, value in last.items() if value is not None}  # type: ignore[operator]
            grown = {key: value for key, value in raised.items() if value}
            return (rounds, grown) if grown else None
    return None


def _as_before(last: Exact | None, earlier: Exact | None, first: Exact | None) -> bool:
    if last is None or earlier is None or first is None:
        return last is None and earlier is None
    return bool(last - earlier == earlier - first)


def steps_along(known: Known, grown: Mapping[Hashable, Exact], raise_all: Callable[[dict[Any, Any]], Known]) -> int:
    """How often all that is known grows by the same, if `raise_all` makes of it what is known after that.

    Raises
    ------
    TooLongError
        when that takes more than it would save.

    Examples
    --------
    A number that grows to the next but one multiple of 10, and then no more.

    >>> steps_along({"a": 7}, {"a": 2}, lambda known: {"a": known["a"] + 2 - 2 * (known["a"] // 17)})
    5
    >>> steps_along({"a": 7}, {"a": 2}, lambda known: {"a": known["a"] + 1})
    0
    """
    reach = Reach()
    lines = {key: Line(known[key], slope, reach) for key, slope in grown.items()}  # type: ignore[arg-type]
    given: dict[Any, Any] = {**known, **lines}
    found = raise_all(dict(given))
    for key, value in given.items():
        if value is None and found[key] is None:
            continue
        if value is None or not (value if isinstance(value, Line) else Line(value, 0, reach))._is_raised(found[key]):
            return 0
    return ceil(reach.until) if reach.until is not None else 0
