"""A design along one way through its inputs: some of them move with one number, the rest stays as stated.

Only the steps that what moves can reach are computed anew, which is what makes a margin of each input affordable.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property

from dse.analysis.binding import own_core
from dse.analysis.limits import EachCore, core_comparison, on_processor
from dse.analysis.placement.partition import asks_for_first_fit, core_count
from dse.analysis.terms import PPM
from dse.analysis.views import View
from dse.questions.sensitivity.design_function import DesignFunction, NearbyProgram, OutputComparison
from dse.questions.sensitivity.traced_numbers import COMPARISONS, OPERATIONS, Program
from dse.spec.schema.fields import COUNT

MOST_PARTITIONS = 8
"""The number of known partitions of threads on cores that are tried before another is looked for."""


class LineComparisons:
    """Comparisons of a design where the input with index i has the value ``moving[i] * place``, for every i there.

    `bounds` are the comparisons that are looked at.
    """

    def __init__(
        self, function: DesignFunction, moving: Mapping[int, Fraction], bounds: Sequence[OutputComparison]
    ) -> None:
        self.function, self.moving, self.bounds = function, moving, tuple(bounds)
        full = {function.core_bound(number) for number in {bound.requirement for bound in bounds}}
        sums = [bound for bound in bounds if bound not in full]
        cores = [bound for bound in bounds if bound in full]
        self._sides: list[_Sides | FullestCores] = [_Sides(function, moving, sums)] if sums else []
        self._sides += [FullestCores(function, moving, bound) for bound in cores]
        self._known: dict[Fraction, dict[int, Fraction]] = {}

    def values(self, place: Fraction) -> list[Fraction]:
        """The values of all inputs at a place on the line.

        Exact values in base units, in the order of the variables: `scale · place` for those that move, the file's value
        for the others.
        """
        values = list(self.function.inputs.nominal)
        for index, scale in self.moving.items():
            values[index] = scale * place
        return values

    def broken(self, place: Fraction) -> list[OutputComparison]:
        """The comparisons that do not hold at a place.

        `place` is the number with which the inputs move, 1 for the values of the file. Empty where every comparison
        holds.
        """
        return self.function.broken(self._at(place), self.bounds)

    def gap(self, place: Fraction, bound: OutputComparison) -> Fraction:
        """Limit less value of a comparison at a place.

        Positive where an upper limit is kept with a margin; in the base unit of the metric.
        """
        distance = self._at(place)
        return distance[bound.limit] - distance[bound.value]

    def _at(self, place: Fraction) -> dict[int, Fraction]:
        """The outputs that the comparisons need, by number."""
        if place not in self._known:
            values = self.values(place)
            self._known[place] = {side: value for part in self._sides for side, value in part.at(values, place).items()}
        return self._known[place]


class _Sides:
    """Both sides of some comparisons along a way, by the expressions where they apply, else by the analysis.

    Expressions of another place, where response times count other jobs, take as long to make as many analyses.
    """

    def __init__(
        self,
        function: DesignFunction,
        moving: Mapping[int, Fraction],
        bounds: Sequence[OutputComparison],
        nearby: NearbyProgram | None = None,
    ) -> None:
        """`nearby` has the expressions of these comparisons, where that is not the program of all outputs."""
        self.function, self.moving, self.bounds, self._nearby = function, moving, bounds, nearby

    @cached_property
    def _reached(self) -> ReachedSteps:
        numbers = [number for bound in self.bounds for number in (bound.value, bound.limit)]
        return reached_steps(self._nearby or self.function.around_cores, frozenset(self.moving), numbers)

    def at(self, values: Sequence[Fraction], place: Fraction) -> dict[int, Fraction]:
        """The sides by the number of their output, where all inputs are `values` at a place."""
        known = None
        if self.function.applies:
            known = self._reached.run({index: scale * place for index, scale in self.moving.items()})
        return self.function.compared(values, self.bounds) if known is None else known


class FullestCores:
    """The load of the fullest core of a processor, and its limit, along a way.

    Threads stay on the cores that they were last found to have while these keep the limit: another partition is looked
    for where they do not. Where there is none the load is the least that a known partition has: so it grows with what
    moves, without a jump where the limit is met.
    """

    def __init__(self, function: DesignFunction, moving: Mapping[int, Fraction], bound: OutputComparison) -> None:
        self.function, self.bound = function, bound
        self._limit = function.inputs.limits(function.inputs.nominal, [bound.requirement])[bound.requirement]
        variables = function.inputs.variables
        self._is_analysed = any(variables[index].kind is COUNT for index in moving)  # it may be the number of cores
        self._threads = function.bounds_of(bound.requirement)[1:-1]
        self._loads = None
        if self._threads:
            self._loads = _Sides(function, moving, self._threads, function.loads_alone(bound.requirement))
        self._known = function.partitions.setdefault(bound.requirement, deque(maxlen=MOST_PARTITIONS))

    def at(self, values: Sequence[Fraction], place: Fraction) -> dict[int, Fraction]:
        """Both sides of the comparison by the number of their output, for the inputs `values` at a place on the line.

        Numbers of outputs to values: the load of the fullest core and its limit. By expressions where they hold at that
        place, else by the analysis.
        """
        if self._is_analysed or self._loads is None or not self.function.applies:
            gaps = self.function.compared(values, [self.bound])
            return {number: gaps[number] for number in (self.bound.value, self.bound.limit)}
        sides = self._loads.at(values, place)
        loads = {bound.thread: sides[bound.value] for bound in self._threads}
        cores = self._limit.cores
        assert cores is not None
        cores = replace(cores, most=sides[self._threads[0].limit])
        return {self.bound.value: self._fullest(cores, loads), self.bound.limit: cores.most}

    def _fullest(self, cores: EachCore, loads: Mapping[str, Fraction]) -> Fraction:
        view = View(self.function.design)
        used = on_processor(cores.space, cores.processor, loads, view)
        least: Fraction | None = None
        for known in reversed(self._known):
            peak = _peak(used, known)
            if cores.room.fits(peak):
                return peak * PPM
            least = peak if least is None else min(peak, least)
        comparison = core_comparison(cores, loads, view)
        assert comparison.spread is not None
        if comparison.spread.status == "none" and least is not None:
            return least * PPM
        if comparison.spread.status == "found" and not self._is_first_fit(cores, used, view):
            self._known.append(comparison.spread.cores)
        return comparison.value

    @staticmethod
    def _is_first_fit(cores: EachCore, used: Iterable[int], view: View) -> bool:
        """Whether the cores of some threads are those that first-fit gives them, whatever else would keep the limit."""
        count = core_count(cores.space, cores.processor, view)
        return asks_for_first_fit(
            cores.space, [number for number in used if own_core(cores.space, number, view, count) is None]
        )


def _peak(used: Mapping[int, Fraction], cores: Mapping[int, int]) -> Fraction:
    """The load of the fullest core, where each thread has one."""
    loads: dict[int, Fraction] = {}
    for number, share in used.items():
        loads[cores[number]] = loads.get(cores[number], Fraction(0)) + share
    return max(loads.values(), default=Fraction(0))


def reached_steps(nearby: NearbyProgram, moving: frozenset[int], numbers: Iterable[int]) -> ReachedSteps:
    """The steps to compute for some outputs where only some inputs move.

    `moving` are indices of variables, `numbers` the wanted outputs. Bisection along a line evaluates only these steps.
    """
    return ReachedSteps(nearby.program, nearby.steps, moving, {number: nearby.outputs[number] for number in numbers})


class ReachedSteps:
    """The steps of a program to compute where only some inputs move: those that depend on them and are needed.

    Steps that no moving input reaches keep their value at the file's inputs, which saves most of the work on large
    problems.
    """

    def __init__(
        self, program: Program, stated: Sequence[Fraction] | None, moving: frozenset[int], outputs: Mapping[int, int]
    ) -> None:
        self.program, self.stated, self.outputs = program, stated, outputs
        reached = program.reached(moving)
        self.guards = [item for item in program.guards if reached[item[1]] or reached[item[2]]]
        others = [item for item in program.guards if not (reached[item[1]] or reached[item[2]])]
        self.applies = stated is not None and all(_is_kept(item, stated) for item in others)
        ends = list(outputs.values())
        ends += [side for _, left, right, _ in self.guards for side in (left, right)]
        self.steps = [number for number in program.needed(ends) if reached[number]] if self.applies else []

    def run(self, moved: Mapping[int, Fraction]) -> dict[int, Fraction] | None:
        """The outputs by number; None where the program does not apply.

        `moved` are the values of the moving variables by index. None, too, where a guard has another outcome there or a
        formula divides by 0; then the analysis must be asked.
        """
        if not self.applies or self.stated is None:
            return None
        values = list(self.stated)
        listed = self.program.steps
        try:
            for number in self.steps:
                operation, left, right = listed[number]
                values[number] = (
                    moved[left] if operation == "var" else OPERATIONS[operation](values[left], values[right])
                )
        except ZeroDivisionError:  # a formula that would not be asked there: a guard stands before it
            return None
        if not all(_is_kept(item, values) for item in self.guards):
            return None
        return {number: values[step] for number, step in self.outputs.items()}


def _is_kept(guard: tuple[str, int, int, bool], values: Sequence[Fraction]) -> bool:
    operation, left, right, outcome = guard
    return bool(COMPARISONS[operation](values[left], values[right])) == outcome
