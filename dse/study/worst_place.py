"""The worst place of a requirement over a box of inputs, proved for one design.

Where every partial derivative keeps its sign over the box (shown by interval arithmetic in exact fractions), the
worst place is a corner that the signs name. Where one does not, the figure must be at most linear in that input: then
the worst is at a corner too, and both ends are tried. A comparison that a formula makes (the smaller of two rates)
may be decided one way in part of the box and the other way elsewhere: the figure is continuous there, so that signs
which agree in every part hold for the whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from math import inf
from typing import Any

from dse.errors import UsageError
from dse.study.functions import Bound, DesignFunction
from dse.study.trace import STEPS, Program, TooManyGuardsError
from dse.study.uncertainty import Uncertain

MOST_FREE = 10
"""So many inputs without a proved direction are tried at both ends together."""
Interval = tuple[Fraction, Fraction]
ZERO = (Fraction(0), Fraction(0))
INFINITE: Any = inf
"""The slope of a jump; all others are exact fractions."""
EXTREMES: dict[str, Callable[..., Fraction]] = {"max": max, "min": min}
Corner = tuple[int, ...]
"""For each uncertain input its end: 0 low, 1 high."""


class NotProvedError(UsageError):
    """Nothing certain can be said of a requirement over the whole box."""


@dataclass(frozen=True)
class Worst:
    """The worst corner of a comparison: both sides there."""

    corner: Corner
    value: Fraction
    limit: Fraction


class Box:
    """The stated bounds of uncertain inputs."""

    def __init__(self, uncertain: Sequence[Uncertain]) -> None:
        self.uncertain = tuple(uncertain)
        self.ends = [item.ends() for item in uncertain]
        self._last: tuple[object, list[Fraction]] = (None, [])

    def values(self, nominal: Sequence[Fraction], corner: Corner) -> list[Fraction]:
        """The values of all variables at a corner."""
        values = list(nominal)
        for item, ends, end in zip(self.uncertain, self.ends, corner, strict=True):
            item.set(values, ends[end])
        return values

    def worsts(self, function: DesignFunction) -> list[tuple[Bound, Worst]]:
        """For each comparison of a design the corner at which it is missed most, or met most narrowly.

        Raises
        ------
        NotProvedError
            when no corner is proved to be the worst of some comparison.
        """
        if not function.applies:
            raise NotProvedError("the figures of the analysis cannot be followed over a range of inputs")
        ranges = self._ranges(function)
        parts = [_Part(program, ranges, self.uncertain) for program in self._programs(function, ranges)]
        found = [(bound, self._worst(function, parts, bound)) for bound in function.outputs.bounds]
        return found + self._fullest_cores(function, parts)

    def _fullest_cores(self, function: DesignFunction, parts: Sequence[_Part]) -> list[tuple[Bound, Worst]]:
        """The fullest core of each limited processor at its worst.

        Every thread uses more or less in the same direction of each input; where that is so, a core is used most where
        the whole processor is, and a partition that does there does everywhere.
        """
        found: dict[int, tuple[Bound, Worst]] = {}
        for number in function.core_sides(function.inputs.nominal):
            whole, *threads = (bound for bound in function.outputs.bounds if bound.requirement == number)
            text = function.outputs.texts[number]
            directions = self._directions(parts, whole, text)
            for bound in threads:
                for item, all_, one in zip(
                    self.uncertain, directions, self._directions(parts, bound, text), strict=True
                ):
                    if one not in (0, all_):
                        raise NotProvedError(f"{text}: with {item.path} some threads use more and others less")
            for corner in self._corners(directions, 1):
                value, limit, core = function.core_sides(self.values(function.inputs.nominal, corner), number)[number]
                if number not in found or value - limit > found[number][1].value - found[number][1].limit:
                    found[number] = (Bound(number, whole.value, whole.limit, core), Worst(corner, value, limit))
        return list(found.values())

    @staticmethod
    def _corners(directions: Sequence[int | None], sign: int) -> Iterator[Corner]:
        """The corners that may be the worst where a value rises (`sign` 1) or falls with the directions."""
        free = [number for number, direction in enumerate(directions) if direction is None]
        for chosen in product((0, 1), repeat=len(free)):
            picked = dict(zip(free, chosen, strict=True))
            yield tuple(
                picked[number] if direction is None else int(direction * sign > 0)
                for number, direction in enumerate(directions)
            )

    def _worst(self, function: DesignFunction, parts: Sequence[_Part], bound: Bound) -> Worst:
        text, operator = function.outputs.texts[bound.requirement], function.outputs.operators[bound.requirement]
        directions = self._directions(parts, bound, text)
        signs = {"<": (1,), ">": (-1,), "=": (1, -1)}[operator[0]]  # an equality is missed above or below
        found = []
        for sign in signs:
            for corner in self._corners(directions, sign):
                value, limit = self._sides(function, bound, corner)
                found.append((sign * (limit - value), corner, value, limit))
        _, corner, value, limit = min(found, key=lambda item: (item[0], item[1]))
        return Worst(corner, value, limit)

    def _sides(self, function: DesignFunction, bound: Bound, corner: Corner) -> tuple[Fraction, Fraction]:
        key = (id(function), corner)
        if self._last[0] != key:
            self._last = (key, function.exact(self.values(function.inputs.nominal, corner)))
        outputs = self._last[1]
        return outputs[bound.value], outputs[bound.limit]

    def _directions(self, parts: Sequence[_Part], bound: Bound, text: str) -> list[int | None]:
        """For each input 1 where value - limit rises with it, -1 where it falls, 0 where it does neither.

        None where both ends matter.
        """
        found: list[int | None] = []
        for number, item in enumerate(self.uncertain):
            signs = {part.direction(number, bound) for part in parts}
            signs -= {0} if len(signs) > 1 else set()
            if len(signs) == 1 and None not in signs:
                found.append(signs.pop())
            elif len(parts) == 1 and parts[0].degree(number, bound) <= 1:
                found.append(None)
            else:
                raise NotProvedError(f"{text}: it may rise and fall with {item.path}; no end of its range is the worst")
        if found.count(None) > MOST_FREE:
            raise NotProvedError(f"{text}: more than {MOST_FREE} inputs whose worst end depends on the others")
        return found

    def _ranges(self, function: DesignFunction) -> list[Interval]:
        ranges = [(value, value) for value in function.inputs.nominal]
        for item in self.uncertain:
            for variable in item.variables:
                ranges[variable.index] = item.range_of(variable)
        return ranges

    def _programs(self, function: DesignFunction, ranges: Sequence[Interval]) -> list[Program]:
        """The programs that apply somewhere in the box: one, unless a comparison is undecided."""
        try:
            return self._applicable(function, ranges)
        except TooManyGuardsError:
            raise NotProvedError("a figure takes more comparisons than are looked at") from None

    def _applicable(self, function: DesignFunction, ranges: Sequence[Interval]) -> list[Program]:
        program, _ = function.program_at([low for low, _ in ranges])
        undecided = _undecided(program, ranges)
        if not undecided:
            return [program]
        jumps = [
            item
            for item in undecided
            if item[2] in STEPS or (item[2] == "==" and item[3] and not _is_zero_test(program, item[1]))
        ]
        if jumps:
            names = self._behind(program, [side for item in jumps for side in item[:2]])
            raise NotProvedError(
                f"a figure moves in steps within the stated ranges, of which nothing can be proved (with {names}), "
                "as response times may: state one value, or leave response times out "
                "(deadlines: none, processing: execution_time)"
            )
        if len(self.uncertain) > MOST_FREE:
            raise NotProvedError(f"too many uncertain inputs ({len(self.uncertain)}) around a comparison")
        corners = product((0, 1), repeat=len(self.uncertain))
        found = [function.program_at(self.values(function.inputs.nominal, corner))[0] for corner in corners]
        return list({id(item): item for item in found}.values())

    def _behind(self, program: Program, steps: Sequence[int]) -> str:
        """The uncertain inputs that some steps depend on."""
        inside = frozenset().union(*map(program.variables, steps))
        return ", ".join(
            item.path for item in self.uncertain if inside & {variable.index for variable in item.variables}
        )


class _Part:
    """A program over a box: the interval of each step and, for each uncertain input, of its derivative."""

    def __init__(self, program: Program, ranges: Sequence[Interval], uncertain: Sequence[Uncertain]) -> None:
        self.program = program
        self.seeds = [
            {variable.index: (variable.nominal if item.is_factor else Fraction(1)) for variable in item.variables}
            for item in uncertain
        ]
        values = _intervals(program, ranges)
        self.slopes = [_slopes(program, values, seeds) for seeds in self.seeds]
        self.degrees = [_degrees(program, values, seeds) for seeds in self.seeds]

    def direction(self, number: int, bound: Bound) -> int | None:
        """The sign of the derivative of value - limit over the box; None when it is not proved."""
        slopes = self.slopes[number]
        low, high = _combined("-", *(slopes[self.program.outputs[side]] for side in (bound.value, bound.limit)))
        if low == high == 0:
            return 0
        return 1 if low >= 0 else -1 if high <= 0 else None

    def degree(self, number: int, bound: Bound) -> int:
        """The degree of a comparison in an input; 2 stands for anything that is not linear."""
        return max(self.degrees[number][self.program.outputs[side]] for side in (bound.value, bound.limit))


def _is_zero_test(program: Program, number: int) -> bool:
    operation, value, _ = program.steps[number]
    return operation == "const" and value == 0


def _undecided(program: Program, ranges: Sequence[Interval]) -> list[tuple[int, int, str, bool]]:
    """The guards that do not hold in the whole box: both sides' numbers, operation, outcome."""
    values = _intervals(program, ranges)
    found = []
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
            found.append((left, right, operation, outcome))
    return found


def _intervals(program: Program, ranges: Sequence[Interval]) -> list[Interval]:
    values: list[Interval] = []
    for operation, left, right in program.steps:
        if operation == "var":
            values.append(ranges[left])
        elif operation == "const":
            values.append((left, left))
        else:
            values.append(_combined(operation, values[left], values[right]))
    return values


def _combined(operation: str, one: Interval, other: Interval) -> Interval:
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


def _slopes(program: Program, values: Sequence[Interval], seeds: dict[int, Fraction]) -> list[Interval]:
    """The derivative of each step over the box, by interval arithmetic: infinite where it jumps."""
    slopes: list[Interval] = []
    for operation, left, right in program.steps:
        if operation in ("var", "const"):
            slope = seeds.get(left, Fraction(0)) if operation == "var" else Fraction(0)
            slopes.append((slope, slope))
        elif slopes[left] == ZERO and slopes[right] == ZERO:
            slopes.append(ZERO)
        elif operation in EXTREMES:
            slopes.append(_slope_of_extreme(operation, (values[left], values[right]), (slopes[left], slopes[right])))
        elif operation == "//":
            slopes.append(_slope_of_steps(values[len(slopes)], slopes[left]))
        elif operation in "+-":
            slopes.append(_combined(operation, slopes[left], slopes[right]))
        else:
            first, second = _combined("*", slopes[left], values[right]), _combined("*", values[left], slopes[right])
            if operation == "*":
                slopes.append(_combined("+", first, second))
            else:
                slopes.append(
                    _combined("/", _combined("-", first, second), _combined("*", values[right], values[right]))
                )
    return slopes


def _slope_of_extreme(operation: str, values: tuple[Interval, Interval], slopes: tuple[Interval, Interval]) -> Interval:
    """That of the number that counts, where it is decided which that is; else anything that both slopes span."""
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


def _degrees(program: Program, values: Sequence[Interval], seeds: dict[int, Fraction]) -> list[int]:
    degrees: list[int] = []
    for operation, left, right in program.steps:
        if operation in ("var", "const"):
            degrees.append(int(operation == "var" and left in seeds))
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
