"""The worst place of a requirement over a box of inputs, proved for one design.

Where every partial derivative keeps its sign over the box (shown by interval arithmetic in exact fractions), the worst place is a corner
that the signs name. Where one does not, the figure must be at most linear in that input: then the worst is at a corner too, and both ends are
tried. A comparison that a formula makes (the smaller of two rates) may be decided one way in part of the box and the other way elsewhere: the
figure is continuous there, so that signs which agree in every part hold for the whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from dse.errors import UsageError
from dse.study.functions import Bound, DesignFunction
from dse.study.trace import Program
from dse.study.uncertainty import Uncertain

MOST_FREE = 10
"""So many inputs without a proved direction are tried at both ends together."""
Interval = tuple[Fraction, Fraction]
ZERO = (Fraction(0), Fraction(0))
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

    def values(self, nominal: Sequence[Fraction], corner: Corner) -> list[Fraction]:
        """The values of all variables at a corner."""
        values = list(nominal)
        for item, ends, end in zip(self.uncertain, self.ends, corner, strict=True):
            item.set(values, ends[end])
        return values

    def worst(self, function: DesignFunction, bound: Bound) -> Worst:
        """The corner at which the comparison is missed most, or met most narrowly.

        Raises
        ------
        NotProvedError
            when no corner is proved to be the worst.
        """
        sign = -1 if function.outputs.operators[bound.requirement][0] == ">" else 1
        if function.outputs.operators[bound.requirement] == "==":
            raise NotProvedError(f"{function.outputs.texts[bound.requirement]}: an equality cannot hold for a whole range")
        directions = self._directions(function, bound)
        free = [number for number, direction in enumerate(directions) if direction is None]
        corners = []
        for chosen in product((0, 1), repeat=len(free)):
            picked = dict(zip(free, chosen, strict=True))
            corner = tuple(
                picked[number] if direction is None else int(direction * sign > 0) for number, direction in enumerate(directions)
            )
            outputs = function.exact(self.values(function.inputs.nominal, corner))
            corners.append((sign * (outputs[bound.limit] - outputs[bound.value]), corner, outputs))
        _, corner, outputs = min(corners, key=lambda item: (item[0], item[1]))
        return Worst(corner, outputs[bound.value], outputs[bound.limit])

    def _directions(self, function: DesignFunction, bound: Bound) -> list[int | None]:
        """For each input 1 where value - limit rises with it, -1 where it falls, 0 where it does neither, None where both ends matter."""
        text = function.outputs.texts[bound.requirement]
        if not function.applies:
            raise NotProvedError(f"{text}: its figures cannot be followed over a range of inputs")
        ranges = self._ranges(function)
        programs = self._programs(function, ranges, text)
        found: list[int | None] = []
        for number, item in enumerate(self.uncertain):
            seeds = {variable.index: (variable.nominal if item.is_factor else Fraction(1)) for variable in item.variables}
            signs = {_direction(program, ranges, seeds, bound) for program in programs}
            signs -= {0} if len(signs) > 1 else set()
            if len(signs) == 1 and None not in signs:
                found.append(signs.pop())
            elif len(programs) == 1 and _degree(programs[0], seeds, bound) <= 1:
                found.append(None)
            else:
                raise NotProvedError(f"{text}: it may rise and fall with {self.uncertain[number].path}; no end of its range is the worst")
        if found.count(None) > MOST_FREE:
            raise NotProvedError(f"{text}: more than {MOST_FREE} inputs whose worst end depends on the others")
        return found

    def _ranges(self, function: DesignFunction) -> list[Interval]:
        ranges = [(value, value) for value in function.inputs.nominal]
        for item, (low, high) in zip(self.uncertain, self.ends, strict=True):
            for variable in item.variables:
                scale = variable.nominal if item.is_factor else Fraction(1)
                ranges[variable.index] = (low * scale, high * scale)
        return ranges

    def _programs(self, function: DesignFunction, ranges: Sequence[Interval], text: str) -> list[Program]:
        """The programs that apply somewhere in the box: one, unless a comparison is undecided."""
        program, _ = function.program_at([low for low, _ in ranges])
        undecided = _undecided(program, ranges)
        if not undecided:
            return [program]
        if any(operation == "==" and outcome and not _is_zero_test(program, number) for number, operation, outcome in undecided):
            raise NotProvedError(f"{text}: a figure moves in steps within the stated ranges, which nothing can be proved of")
        if len(self.uncertain) > MOST_FREE:
            raise NotProvedError(f"{text}: too many uncertain inputs ({len(self.uncertain)}) around a comparison")
        corners = product((0, 1), repeat=len(self.uncertain))
        found = [function.program_at(self.values(function.inputs.nominal, corner))[0] for corner in corners]
        return list({id(item): item for item in found}.values())


def _is_zero_test(program: Program, number: int) -> bool:
    operation, value, _ = program.steps[number]
    return operation == "const" and value == 0


def _undecided(program: Program, ranges: Sequence[Interval]) -> list[tuple[int, str, bool]]:
    """The guards that do not hold in the whole box: number of the right side, operation, outcome."""
    values = _intervals(program, ranges)
    found = []
    for operation, left, right, outcome in program.guards:
        (low, high), (least, most) = values[left], values[right]
        if operation == "<":
            decided = high < least if outcome else low >= most
        elif operation == "<=":
            decided = high <= least if outcome else low > most
        else:
            decided = low == high == least == most if outcome else high < least or low > most
        if not decided:
            found.append((right, operation, outcome))
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
        ends = [a * b for a in one for b in other]
        return min(ends), max(ends)
    if other[0] <= 0 <= other[1]:
        raise NotProvedError("a stated range reaches 0 where a formula divides by it")
    ends = [a / b for a in one for b in other]
    return min(ends), max(ends)


def _direction(program: Program, ranges: Sequence[Interval], seeds: dict[int, Fraction], bound: Bound) -> int | None:
    """The sign of the derivative of value - limit over the box, by interval arithmetic; None when it is not proved."""
    values = _intervals(program, ranges)
    slopes: list[Interval] = []
    for operation, left, right in program.steps:
        if operation in ("var", "const"):
            slope = seeds.get(left, Fraction(0)) if operation == "var" else Fraction(0)
            slopes.append((slope, slope))
        elif operation in "+-":
            slopes.append(_combined(operation, slopes[left], slopes[right]))
        elif operation == "*":
            parts = _combined("*", slopes[left], values[right]), _combined("*", values[left], slopes[right])
            slopes.append(_combined("+", *parts))
        else:
            top = _combined("*", slopes[left], values[right]), _combined("*", values[left], slopes[right])
            square = _combined("*", values[right], values[right])
            slopes.append(ZERO if slopes[left] == slopes[right] == ZERO else _combined("/", _combined("-", *top), square))
    low, high = _combined("-", slopes[program.outputs[bound.value]], slopes[program.outputs[bound.limit]])
    if low == high == 0:
        return 0
    return 1 if low >= 0 else -1 if high <= 0 else None


def _degree(program: Program, seeds: dict[int, Fraction], bound: Bound) -> int:
    """The degree of a comparison in an input; 2 stands for anything that is not linear."""
    degrees: list[int] = []
    for operation, left, right in program.steps:
        if operation in ("var", "const"):
            degrees.append(int(operation == "var" and left in seeds))
        elif operation in "+-":
            degrees.append(max(degrees[left], degrees[right]))
        elif operation == "*":
            degrees.append(min(2, degrees[left] + degrees[right]))
        else:
            degrees.append(degrees[left] if degrees[right] == 0 else 2)
    return max(degrees[program.outputs[bound.value]], degrees[program.outputs[bound.limit]])
