"""The worst place of a requirement over a box of inputs, proved for one design.

Where every partial derivative keeps its sign over the box (shown by interval arithmetic in exact fractions), the
worst place is a corner that the signs name. Where one does not, the figure must be at most linear in that input: then
the worst is at a corner too, and both ends are tried. A comparison that a formula makes (the smaller of two rates)
may be decided one way in part of the box and the other way elsewhere: the figure is continuous there, so that signs
which agree in every part hold for the whole.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from dse.analysis.latency.rows import counts_responses
from dse.analysis.messages.stages import counted_buses
from dse.analysis.rates import may_poll
from dse.questions.sensitivity.design_function import DesignFunction, OutputComparison
from dse.questions.sensitivity.intervals import (
    ZERO,
    Interval,
    NotProvedError,
    combined,
    degrees_over,
    is_zero_test,
    seeds_of,
    slopes_over,
    undecided_over,
    values_over,
)
from dse.questions.sensitivity.traced_numbers import STEPS, Program, TooManyGuardsError
from dse.questions.sensitivity.uncertainty import Uncertain
from dse.space.model.space import Space
from dse.space.question.metrics import by_first_fit
from dse.support.units import is_unbounded

MOST_FREE = 10
"""The greatest number of inputs without a proved direction that are tried at both ends together."""
Corner = tuple[int, ...]
"""For each uncertain input its end: 0 low, 1 high."""


@dataclass(frozen=True)
class Worst:
    """The worst corner of a comparison: both sides there.

    `corner` has 0 (low end) or 1 (high end) for each uncertain input; `value` and `limit` are exact, in the base unit
    of the metric.
    """

    corner: Corner
    value: Fraction
    limit: Fraction


class Box:
    """The stated bounds of uncertain inputs.

    A product of closed intervals, one for each uncertain input, in the order of the file. Inputs may move several
    variables together (a factor on all execution times, say).
    """

    def __init__(self, uncertain: Sequence[Uncertain]) -> None:
        self.uncertain = tuple(uncertain)
        self.ends = [item.ends() for item in uncertain]
        self._last: tuple[DesignFunction | None, Corner, list[Fraction]] = (None, (), [])

    def values(self, nominal: Sequence[Fraction], corner: Corner) -> list[Fraction]:
        """The values of all variables at a corner.

        A new list in the order of the variables: `nominal`, with uncertain inputs at their low or high end. Base units.
        """
        values = list(nominal)
        for item, ends, end in zip(self.uncertain, self.ends, corner, strict=True):
            item.set(values, ends[end])
        return values

    def worsts(self, function: DesignFunction, *, may_jump: bool = False) -> list[tuple[OutputComparison, Worst]]:
        """For each comparison of a design the corner at which it is missed most, or met most narrowly.

        A function that `may_jump` follows response times by their formulas: what decides an order, or how many jobs
        there are, moves figures in steps.

        Raises
        ------
        NotProvedError
            when no corner is proved to be the worst of some comparison.
        """
        if not function.applies:
            raise NotProvedError("the figures of the analysis cannot be followed over a range of inputs")
        space = function.inputs.problem.space
        if counts_responses(space) and any(may_poll(space, item) for item in space.components):
            raise NotProvedError("latencies may fall where an executor of kind `polling` begins to be overloaded")
        ranges = [*self.ranges(function.inputs.nominal), *(item.range for item in function.further)]
        seeds = seeds_of(self.uncertain, len(function.inputs.nominal), function.further)
        parts = [_BoxedProgram(program, ranges, seeds) for program in self._programs(function, ranges, may_jump)]
        worsts = [(bound, self._worst(function, parts, bound)) for bound in function.outputs.bounds]
        return worsts + self._fullest_cores(function, parts)

    def broken_corner(self, function: DesignFunction) -> list[tuple[OutputComparison, Worst]]:
        """The comparisons at the first corner where the analysis finds one broken: such a design is not robust.

        Empty where all hold at every corner, or there are too many corners to look at; nothing is proved then.
        """
        if len(self.uncertain) > MOST_FREE:
            return []
        for corner in product((0, 1), repeat=len(self.uncertain)):
            outputs = function.analysed(self.values(function.inputs.nominal, corner))
            if function.broken(outputs):
                bounds = function.outputs.bounds
                return [(bound, Worst(corner, outputs[bound.value], outputs[bound.limit])) for bound in bounds]
        return []

    def _fullest_cores(
        self, function: DesignFunction, parts: Sequence[_BoxedProgram]
    ) -> list[tuple[OutputComparison, Worst]]:
        """The fullest core of each limited processor at its worst.

        Every thread uses more or less in the same direction of each input; where that is so, a core is used most where
        the whole processor is, and a partition that does there does everywhere.
        """
        fullest: dict[int, tuple[OutputComparison, Worst]] = {}
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
                if number not in fullest or value - limit > fullest[number][1].value - fullest[number][1].limit:
                    fullest[number] = (
                        OutputComparison(number, whole.value, whole.limit, core),
                        Worst(corner, value, limit),
                    )
        return list(fullest.values())

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

    def _worst(self, function: DesignFunction, parts: Sequence[_BoxedProgram], bound: OutputComparison) -> Worst:
        text, operator = function.outputs.texts[bound.requirement], function.outputs.operators[bound.requirement]
        directions = self._directions(parts, bound, text)
        self._check_endless(function, parts, bound, directions)
        signs = {"<": (1,), ">": (-1,), "=": (1, -1)}[operator[0]]  # an equality is missed above or below
        worst = []
        for sign in signs:
            for corner in self._corners(directions, sign):
                value, limit = self._sides(function, bound, corner)
                worst.append((sign * (limit - value), corner, value, limit))
        _, corner, value, limit = min(worst, key=lambda item: (item[0], item[1]))
        return Worst(corner, value, limit)

    @staticmethod
    def _check_endless(
        function: DesignFunction,
        parts: Sequence[_BoxedProgram],
        bound: OutputComparison,
        directions: Sequence[int | None],
    ) -> None:
        """What has no bound in part of the box jumps up where it loses it: figures that fall with it are not covered.

        Raises
        ------
        NotProvedError
            when a comparison depends on such a thing, and may fall where that rises.
        """
        for number, item in enumerate(function.further, len(function.inputs.nominal)):
            if not is_unbounded(item.range[1]) or not any(part.reaches(number, bound) for part in parts):
                continue
            for slope, direction in zip(item.slopes, directions, strict=True):
                if slope != ZERO and (direction is None or direction * (1 if slope[0] >= 0 else -1) < 0):
                    raise NotProvedError("a response time has no bound in part of the stated ranges")

    def _sides(self, function: DesignFunction, bound: OutputComparison, corner: Corner) -> tuple[Fraction, Fraction]:
        known, place, outputs = self._last
        if known is not function or place != corner:  # kept, so that no other function has its id
            outputs = function.exact(self.values(function.inputs.nominal, corner))
            self._last = function, corner, outputs
        return outputs[bound.value], outputs[bound.limit]

    def _directions(self, parts: Sequence[_BoxedProgram], bound: OutputComparison, text: str) -> list[int | None]:
        """For each input 1 where value - limit rises with it, -1 where it falls, 0 where it does neither.

        None where both ends matter.
        """
        directions: list[int | None] = []
        for number, item in enumerate(self.uncertain):
            signs = {part.direction(number, bound) for part in parts}
            signs -= {0} if len(signs) > 1 else set()
            if len(signs) == 1 and None not in signs:
                directions.append(signs.pop())
            elif len(parts) == 1 and parts[0].degree(number, bound) <= 1:
                directions.append(None)
            else:
                raise NotProvedError(f"{text}: it may rise and fall with {item.path}; no end of its range is the worst")
        if directions.count(None) > MOST_FREE:
            raise NotProvedError(f"{text}: more than {MOST_FREE} inputs whose worst end depends on the others")
        return directions

    def ranges(self, nominal: Sequence[Fraction]) -> list[Interval]:
        """The range of each variable.

        A pair (low, high) for each variable, in base units; both ends are the nominal value for what is not uncertain.
        """
        ranges = [(value, value) for value in nominal]
        for item in self.uncertain:
            for variable in item.variables:
                ranges[variable.index] = item.range_of(variable)
        return ranges

    def _programs(self, function: DesignFunction, ranges: Sequence[Interval], may_jump: bool) -> list[Program]:
        """The programs that apply somewhere in the box: one, unless a comparison is undecided."""
        try:
            return self._applicable(function, ranges, may_jump)
        except TooManyGuardsError:
            raise NotProvedError("a figure takes more comparisons than are looked at") from None

    def _applicable(self, function: DesignFunction, ranges: Sequence[Interval], may_jump: bool) -> list[Program]:
        program, _ = function.program_at([low for low, _ in self.ranges(function.inputs.nominal)])
        undecided = undecided_over(program, ranges)
        if not undecided:
            return [program]
        jumps = [
            item
            for item in undecided
            if may_jump or item[2] in STEPS or (item[2] == "==" and item[3] and not is_zero_test(program, item[1]))
        ]
        if jumps:
            names = self._behind(program, [side for item in jumps for side in item[:2]])
            raise NotProvedError(
                f"a figure moves in steps within the stated ranges, of which nothing can be proved: state one value of "
                f"{names}{remedies_of(function.inputs.problem.space)}"
            )
        if len(self.uncertain) > MOST_FREE:
            raise NotProvedError(f"too many uncertain inputs ({len(self.uncertain)}) around a comparison")
        corners = product((0, 1), repeat=len(self.uncertain))
        programs = [function.program_at(self.values(function.inputs.nominal, corner))[0] for corner in corners]
        return list({id(item): item for item in programs}.values())

    def _behind(self, program: Program, steps: Sequence[int]) -> str:
        """The uncertain inputs that some steps depend on."""
        inside = frozenset().union(*map(program.variables, steps))
        return ", ".join(
            item.path for item in self.uncertain if inside & {variable.index for variable in item.variables}
        )


def remedies_of(space: Space) -> str:
    """The settings of a problem without which times do not wait, in words; empty where none of them is left."""
    settings = [
        "deadlines: none" if space.deadlines != "none" else "",
        "processing: execution_time" if space.processing == "response_time" else "",
        "bus_queuing: not_counted" if counted_buses(space) else "",
    ]
    cores = any(any(by_first_fit(space, number)) for number in range(len(space.processors)))
    found = ["cores stated for all threads"] * cores + list(filter(None, settings))
    return f" (where it is a response time or a wait that moves, this may help as well: {', '.join(found)})" * bool(
        found
    )


class _BoxedProgram:
    """A program over a box: the interval of each step and, for each uncertain input, of its derivative."""

    def __init__(self, program: Program, ranges: Sequence[Interval], seeds: Sequence[Mapping[int, Interval]]) -> None:
        self.program = program
        values = values_over(program, ranges)
        self.slopes = [slopes_over(program, values, one) for one in seeds]
        self.degrees = [degrees_over(program, values, one) for one in seeds]

    def direction(self, number: int, bound: OutputComparison) -> int | None:
        """The sign of the derivative of value - limit over the box; None when it is not proved."""
        slopes = self.slopes[number]
        low, high = combined("-", *(slopes[self.program.outputs[side]] for side in (bound.value, bound.limit)))
        if low == high == 0:
            return 0
        return 1 if low >= 0 else -1 if high <= 0 else None

    def reaches(self, variable: int, bound: OutputComparison) -> bool:
        """Whether a comparison depends on a variable."""
        sides = (self.program.outputs[bound.value], self.program.outputs[bound.limit])
        return any(variable in self.program.variables(side) for side in sides)

    def degree(self, number: int, bound: OutputComparison) -> int:
        """The degree of a comparison in an input; 2 stands for anything that is not linear."""
        return max(self.degrees[number][self.program.outputs[side]] for side in (bound.value, bound.limit))
