"""Stated uncertainties (`dse.spec.schema.uncertainty`) as inputs of a study: their variables, bounded and sampled."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import Any

import numpy

from dse.questions.problem import Problem
from dse.questions.sensitivity.inputs import InputSpace, Variable
from dse.space.model.space import Component
from dse.space.model.trees import leaves
from dse.space.question.open_cores import OWNERS
from dse.spec.quantities.quantities import RANGES
from dse.spec.schema.uncertainty import UncertainInput, normal_share
from dse.support.errors import UsageError
from dse.support.units.text import count_words

MIDDLE = 0.95
"""The share of its values over which an input without bounds is said to have its effect."""
DEVIATIONS = 3
"""Half the width of the interval of an input without bounds in a robust front, in standard deviations of its mean."""
Quantile = Callable[[Any], Any]


@dataclass(frozen=True)
class Uncertain:
    """An uncertain input: the variables it moves, by their value or (`is_factor`) by a common factor.

    `low` and `high` bound it (None: it has no bounds, and most of its values lie between `near`); `quantile` maps
    [0, 1] to its values, in the variables' unit.
    """

    path: str
    words: str
    variables: tuple[Variable, ...]
    is_factor: bool
    low: Fraction | None
    high: Fraction | None
    quantile: Quantile
    near: tuple[Fraction, Fraction] = (Fraction(0), Fraction(0))

    def ppf(self, share: Any) -> Any:
        """`quantile`, by the name that scipy looks for.

        The inverse of the distribution function: shares in [0, 1], an array of any shape, to values of the input in
        base units.
        """
        return self.quantile(numpy.asarray(share, dtype=float))

    def columns(self, values: Any) -> dict[int, Any]:
        """The variables' samples for samples of the input.

        Variable index to an array of floats as long as `values`. A factor multiplies each variable's nominal value; no
        sample is below the least value that the variable can have.
        """
        if not self.is_factor:
            return {item.index: _settled(item, numpy.maximum(values, item.least)) for item in self.variables}
        return {item.index: _settled(item, numpy.maximum(values * float(item.nominal), 0.0)) for item in self.variables}

    def ends(self) -> tuple[Fraction, Fraction]:
        """The bounds of the input; without bounds the interval that holds most values (`robust_words` names it).

        A pair (low, high), exact and in base units, or factors. A normal distribution has no bounds; `DEVIATIONS`
        deviations on each side are taken instead.
        """
        return self.near if self.low is None or self.high is None else (self.low, self.high)

    @property
    def sampled_words(self) -> str:
        """The stated uncertainty in words, with the distribution that samples are drawn from.

        A range without a distribution is sampled uniformly, and the text says so.
        """
        return self.words.replace("anything in ", "anything (sampled uniformly) in ")

    @property
    def robust_words(self) -> str:
        """The stated uncertainty in words, with the interval that a robust front covers.

        For an input with bounds the words of the file; for a normal distribution the interval that is taken, with its
        probability.
        """
        if self.low is not None:
            return self.words
        share = normal_share(DEVIATIONS) - normal_share(-DEVIATIONS)
        return f"{self.words}, within {DEVIATIONS} deviations of its mean ({share:.2%} of its values)"

    def main_range(self) -> tuple[float, float]:
        """The bounds; where there are none, the middle `MIDDLE` of all values.

        A pair of floats (low, high) in base units, for the axis of a plot and the ends of a local effect.
        """
        if self.low is not None and self.high is not None:
            return float(self.low), float(self.high)
        low, high = self.ppf([(1 - MIDDLE) / 2, (1 + MIDDLE) / 2])
        return float(low), float(high)

    def set(self, values: list[Fraction], place: Fraction) -> None:
        """Put a value of the input into a list of all variables' values.

        `values` is changed in place: every variable that moves with the input gets its value at `place`, which is a
        value in base units or a factor.
        """
        for variable in self.variables:
            values[variable.index] = self._value(variable, place)

    def range_of(self, variable: Variable) -> tuple[Fraction, Fraction]:
        """`ends` of one of its variables.

        A pair (low, high), exact and in base units of the variable: a factor is multiplied with its nominal value.
        """
        low, high = self.ends()
        return self._value(variable, low), self._value(variable, high)

    def _value(self, variable: Variable, place: Fraction) -> Fraction:
        """A variable's value for one of the input; counts move in whole steps."""
        value = variable.nominal * place if self.is_factor else place
        return variable.settled(value) if variable.is_count else value


def _settled(variable: Variable, values: Any) -> Any:
    """Samples of a variable as it can have them: counts in whole steps."""
    return numpy.maximum(numpy.floor(values + 0.5), variable.least) if variable.is_count else values


def read_uncertainties(problem: Problem, inputs: InputSpace) -> tuple[Uncertain, ...]:
    """The uncertain inputs that the problem states, in the order of the file.

    Raises
    ------
    UsageError
        when an input has values for which there is no design.
    """
    numbers = {variable.path: variable for variable in inputs.variables}
    uncertain: list[Uncertain] = []
    for item in problem.loaded.stated:
        variables = tuple(numbers[figure.path] for figure in item.figures)
        uncertain.append(
            Uncertain(
                item.path,
                item.words,
                variables,
                item.is_factor,
                item.low,
                item.high,
                _quantile(item),
                _near(item, variables),
            )
        )
        _check_cores(problem, uncertain[-1])
    return tuple(uncertain)


def stated_cores(problem: Problem, component: Component) -> tuple[int, ...]:
    """The cores that the file states of a thread, its executors or its reservation: one, or a list of options.

    Core numbers, in the order of the file; other values (such as ``any``) are left out. Used to see that a number of
    cores cannot fall below what is stated.
    """
    spec, owners = problem.loaded.spec, problem.space.core_owners(component)
    owners_of = [
        getattr(spec, section)[name] for name in owners for section in OWNERS if name in getattr(spec, section)
    ]
    return tuple(item for one in owners_of for item in one.core or () if isinstance(item, int))


def _check_cores(problem: Problem, item: Uncertain) -> None:
    """There is no design with fewer cores than a thread states.

    Raises
    ------
    UsageError
        when an input goes down so far.
    """
    space = problem.space
    for variable in item.variables if any(variable.is_count for variable in item.variables) else ():
        least = item.range_of(variable)[0]
        for thread in space.components:
            kinds = {
                kind for slot in leaves(thread.processor) if slot is not None for kind in space.processors[slot].types
            }
            here = any(variable.path.partition("[")[0] == f"processor_types.{kind}.cores" for kind in kinds)
            highest = max(stated_cores(problem, thread), default=0) if here else 0
            if least < highest:
                raise UsageError(
                    f"uncertainty.{item.path}: {item.words} goes down to {count_words(int(least), 'core')}, but "
                    f"{thread.name} may run on core {highest}: there is no such design"
                )


def _near(item: UncertainInput, variables: Sequence[Variable]) -> tuple[Fraction, Fraction]:
    """The mean, and `DEVIATIONS` less and more; never less than there can be."""
    least = 0 if item.is_factor else max(variable.least for variable in variables)
    reach = DEVIATIONS * item.deviation
    return max(Fraction(least), item.mean - reach), max(Fraction(least), item.mean + reach)


def _quantile(item: UncertainInput) -> Quantile:
    """The values below which a share of all lies."""
    if item.distribution == "samples":
        return _quantile_of_samples(item)
    if item.distribution == "normal":
        return _quantile_of_normal(item)
    assert item.low is not None and item.high is not None
    low, high, mode = float(item.low), float(item.high), float(item.mode)
    width = high - low
    if item.distribution != "triangular":
        return lambda share: low + width * share
    knee = (mode - low) / width if width else 1.0

    def quantile(share: Any) -> Any:
        rising = low + numpy.sqrt(share * width * (mode - low))
        falling = high - numpy.sqrt((1 - share) * width * (high - mode))
        return numpy.where(share <= knee, rising, falling)

    return quantile


def _quantile_of_normal(item: UncertainInput) -> Quantile:
    from scipy.special import ndtr, ndtri

    mean, deviation = float(item.mean), float(item.deviation)
    bottom, top = 0.0, 1.0
    if item.low is not None and item.high is not None:
        bottom, top = (float(ndtr((float(end) - mean) / deviation)) for end in (item.low, item.high))
    return lambda share: mean + deviation * ndtri(bottom + (top - bottom) * share)


def _quantile_of_samples(item: UncertainInput) -> Quantile:
    ordered = numpy.array([float(number) for number in item.numbers])
    return lambda share: ordered[numpy.minimum((share * len(ordered)).astype(int), len(ordered) - 1)]


def stated_ends(uncertain: Sequence[Uncertain]) -> Mapping[int, tuple[Fraction, Fraction]]:
    """The bounds of each variable that has some: the last values that it can have there.

    Variable index to (low, high), exact and in base units; inputs without bounds are left out.
    """
    ends_of: dict[int, tuple[Fraction, Fraction]] = {}
    for item in uncertain:
        if item.low is None or item.high is None:
            continue
        ends_of |= {variable.index: _last_values(variable, *item.range_of(variable)) for variable in item.variables}
    return ends_of


def _last_values(variable: Variable, low: Fraction, high: Fraction) -> tuple[Fraction, Fraction]:
    """The ends of a range; where the variable's values are whole numbers, the whole ones within it, or nearest to it.

    A tenth less and more of 12 B is 11 B and 13 B: there is no message of 10.8 B.
    """
    if not variable.is_whole:
        return low, high
    first, last = Fraction(ceil(low)), Fraction(floor(high))
    return (first, last) if first <= last else (variable.settled(low), variable.settled(high))


def columns_of(uncertain: Sequence[Uncertain], shares: Any) -> dict[int, Any]:
    """Samples of every variable for shares of [0, 1], one row for each uncertain input.

    A range's maximum is at least its minimum.
    """
    return ordered_columns(uncertain, [item.ppf(row) for item, row in zip(uncertain, shares, strict=True)])


def ordered_columns(uncertain: Sequence[Uncertain], values: Sequence[Any]) -> dict[int, Any]:
    """Samples of every variable for samples of the inputs.

    Variable index to an array of floats. The maximum of a range is raised to its sampled minimum where both are
    uncertain and would cross.
    """
    columns: dict[int, Any] = {}
    variables: dict[int, Variable] = {}
    for item, row in zip(uncertain, values, strict=True):
        columns |= item.columns(row)
        variables |= {variable.index: variable for variable in item.variables}
    for index, variable in variables.items():
        if variable.kind in RANGES and variable.end == "max" and index - 1 in columns:
            columns[index] = numpy.maximum(columns[index], columns[index - 1])
    return columns
