"""A design along one way through its inputs: some of them move with one number, the rest stays as stated.

Only the steps that what moves can reach are computed anew, which is what makes a margin of each input affordable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from fractions import Fraction

from dse.questions.sensitivity.design_function import DesignFunction, OutputComparison, steps_or_none
from dse.questions.sensitivity.traced_numbers import COMPARISONS, OPERATIONS, Program, TooManyGuardsError, untraced

WORTH_IT = 3
"""So often the analysis is run where the known expressions do not apply, before new ones are made."""

TOO_LONG = 12
"""After figures that are too long to remember, so many places are analysed before it is tried again."""


class LineComparisons:
    """Comparisons of a design where the input with index i has the value ``moving[i] * place``, for every i there.

    `bounds` are the comparisons that are looked at.
    """

    def __init__(
        self, function: DesignFunction, moving: Mapping[int, Fraction], bounds: Sequence[OutputComparison]
    ) -> None:
        self.function, self.moving, self.bounds = function, moving, tuple(bounds)
        about_cores = function.outputs.about_cores
        groups = {here: [one for one in bounds if (one.requirement in about_cores) == here] for here in (False, True)}
        self._sides = [_Sides(function, moving, group, learns=not here) for here, group in groups.items() if group]
        self._known: dict[Fraction, dict[int, Fraction]] = {}

    def values(self, place: Fraction) -> list[Fraction]:
        """All inputs at a place."""
        values = list(self.function.inputs.nominal)
        for index, scale in self.moving.items():
            values[index] = scale * place
        return values

    def broken(self, place: Fraction) -> list[OutputComparison]:
        """The comparisons that do not hold at a place."""
        return self.function.broken(self._at(place), self.bounds)

    def gap(self, place: Fraction, bound: OutputComparison) -> Fraction:
        """Limit less value of a comparison at a place."""
        found = self._at(place)
        return found[bound.limit] - found[bound.value]

    def _at(self, place: Fraction) -> dict[int, Fraction]:
        """The outputs that the comparisons need, by number."""
        if place not in self._known:
            values = self.values(place)
            self._known[place] = {side: value for part in self._sides for side, value in part.at(values, place).items()}
        return self._known[place]


class _Sides:
    """Both sides of some comparisons along a way, by the expressions that apply, else by the analysis.

    Where it `learns`, new expressions are made after some misses; those that hold nearby only are not worth it.
    """

    def __init__(
        self,
        function: DesignFunction,
        moving: Mapping[int, Fraction],
        bounds: Sequence[OutputComparison],
        *,
        learns: bool,
    ) -> None:
        self.function, self.moving, self.bounds, self.learns = function, moving, bounds, learns
        self._parts: list[_ReachedSteps] = []
        self._misses = 0

    def at(self, values: Sequence[Fraction], place: Fraction) -> dict[int, Fraction]:
        """The sides by the number of their output, where all inputs are `values` at a place."""
        function, moving = self.function, frozenset(self.moving)
        if not function.applies:
            return function.compared(values, self.bounds)[0]
        if not self._parts:
            program = function.programs[0]
            outputs = {
                number: program.outputs[number] for bound in self.bounds for number in (bound.value, bound.limit)
            }
            self._parts.append(_ReachedSteps(program, function.steps_as_stated, moving, outputs))
        moved = {index: scale * place for index, scale in self.moving.items()}
        for part in reversed(self._parts):  # the last one was made nearby
            found = part.run(moved)
            if found is not None:
                return found
        self._misses += 1
        if self.learns and self._misses > WORTH_IT:
            with suppress(TooManyGuardsError):
                found, guards = function.compared(values, self.bounds, traced=True)
                program = Program(list(found.values()), guards)
                outputs = dict(zip(found, program.outputs, strict=True))
                self._parts.append(
                    _ReachedSteps(program, steps_or_none(program, function.inputs.nominal), moving, outputs)
                )
                return {number: untraced(value) for number, value in found.items()}
            self._misses = -TOO_LONG  # the analysis alone is quicker here
        return function.compared(values, self.bounds)[0]


class _ReachedSteps:
    """What is to be computed of a program where only some inputs move: the steps that they reach and that matter."""

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
        """The outputs by number; None where the program does not apply."""
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
