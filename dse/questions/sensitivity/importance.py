"""What uncertain inputs do to designs: the chance that requirements hold, and which inputs matter (Sobol, effects)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from math import sqrt
from typing import Any

import numpy

from dse.analysis.limits import HOLDS
from dse.answers.result import decisions_of
from dse.answers.studies.sensitivity import Chance, Indices
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.uncertainty import Uncertain, columns_of, ordered_columns
from dse.support.units import is_unbounded

SAMPLES = 100_000
SOBOL_SAMPLES = 2**12
"""Base samples of the Sobol indices; the function is evaluated (inputs + 2) times as often."""
EFFECT_SAMPLES = 256
"""The number of draws of the other inputs where one goes from one end of its range to the other."""
SLACK = 1e-12
"""Samples are floating-point numbers: a value that meets its limit to this relative difference holds."""


def random_shares(count: int, samples: int, seed: int) -> Any:
    """Independent shares of [0, 1]: a row for each input.

    An array of shape (`count`, `samples`), from NumPy's default generator with `seed`: two studies with one seed draw
    equal samples.
    """
    return numpy.random.default_rng(seed).random((count, samples))


def chance(function: DesignFunction, uncertain: Sequence[Uncertain], shares: Any) -> Chance:
    """The share of the given samples in which the design meets its requirements.

    They are the same for every design, so that designs compare.
    """
    size = shares.shape[1]
    outputs = function.sampled(columns_of(uncertain, shares), size)
    held: dict[int, Any] = {}
    for bound in function.outputs.bounds:
        good = _holds(function.outputs.operators[bound.requirement], outputs[bound.value], outputs[bound.limit])
        held[bound.requirement] = held.get(bound.requirement, True) & numpy.broadcast_to(good, (size,))
    together = numpy.ones(size, dtype=bool)
    for good in held.values():
        together &= good
    share = float(together.mean())
    return Chance(
        decisions=decisions_of(function.inputs.problem.space, function.design),
        all_met=share,
        standard_error=sqrt(share * (1 - share) / size),
        by_requirement={function.outputs.texts[number]: float(good.mean()) for number, good in held.items()},
    )


def _holds(operator: str, value: Any, limit: Any) -> Any:
    if not isinstance(value, numpy.ndarray) and not isinstance(limit, numpy.ndarray):
        return HOLDS[operator](value, limit)
    value, limit = (item if isinstance(item, numpy.ndarray) else float(item) for item in (value, limit))
    slack = SLACK * numpy.maximum(numpy.abs(limit), 1.0)
    if operator == "==":
        return numpy.abs(value - limit) <= slack
    compare: Callable[..., Any] = HOLDS[operator]
    return compare(value, limit + slack if operator[0] == "<" else limit - slack)


def indices(
    function: DesignFunction, uncertain: Sequence[Uncertain], metrics: Sequence[str], seed: int
) -> tuple[tuple[Indices, ...], tuple[str, ...]]:
    """Sobol indices (Saltelli 2010, by SciPy) and effects over the whole range, of each metric that varies.

    A metric that is unbounded in some sample has neither variance nor effects: only its name is there, second.
    """
    names = [name for name in metrics if name in function.outputs.names]
    numbers = [function.outputs.names.index(name) for name in names]

    tops = _Tops(function, uncertain, numbers)

    def outputs(values: Any) -> Any:
        sampled = function.sampled(ordered_columns(uncertain, list(values)), values.shape[1])
        made = numpy.array(
            [numpy.broadcast_to(numpy.asarray(sampled[number], dtype=float), values.shape[1]) for number in numbers]
        )
        tops.note(values, made)
        return made

    ranges = [item.main_range() for item in uncertain]
    effects, spreads = _effects(outputs, uncertain, ranges, seed)
    nominal = function.exact(function.inputs.nominal)
    sizes = [max(abs(float(nominal[number])), 1e-300) for number in numbers]
    endless = {position for position, number in enumerate(numbers) if tops.are_unbounded(number)}
    varying = [position for position in range(len(names)) if effects[position].any() and position not in endless]
    if not varying:
        return (), tuple(names[position] for position in sorted(endless))
    first, total = _sobol(outputs, uncertain, varying, sizes, seed)
    endless |= {position for position in varying if tops.are_unbounded(numbers[position])}
    paths = [item.path for item in uncertain]
    results = tuple(
        Indices(
            output=names[position],
            unit=function.outputs.units[numbers[position]],
            first=_by_path(paths, first[row]),
            total=_by_path(paths, total[row]),
            effect=_by_path(paths, effects[position]),
            spread=_by_path(paths, spreads[position]),
            over=dict(zip(paths, ranges, strict=True)),
        )
        for row, position in enumerate(varying)
        if position not in endless
    )
    return results, tuple(names[position] for position in sorted(endless))


class _Tops:
    """The samples with the greatest value of each output so far."""

    def __init__(self, function: DesignFunction, uncertain: Sequence[Uncertain], numbers: Sequence[int]) -> None:
        self.function, self.uncertain, self.numbers = function, uncertain, numbers
        self._found: dict[int, tuple[float, Any]] = {}

    def note(self, values: Any, outputs: Any) -> None:
        """Look at samples, a column each."""
        for row, number in enumerate(self.numbers):
            column = int(numpy.argmax(numpy.abs(outputs[row])))
            top = float(abs(outputs[row][column]))
            if number not in self._found or top > self._found[number][0]:
                self._found[number] = (top, values[:, column])

    def are_unbounded(self, number: int) -> bool:
        """Whether an output is unbounded in the sample where it is greatest."""
        columns = ordered_columns(self.uncertain, [numpy.array([value]) for value in self._found[number][1]])
        inputs = [
            Fraction(float(columns[item.index][0])) if item.index in columns else item.nominal
            for item in self.function.inputs.variables
        ]
        return is_unbounded(self.function.exact(inputs)[number])


def _by_path(paths: Sequence[str], values: Any) -> dict[str, float]:
    return {path: float(value) for path, value in zip(paths, values, strict=True)}


def _sobol(
    outputs: Callable[[Any], Any],
    uncertain: Sequence[Uncertain],
    varying: Sequence[int],
    sizes: Sequence[float],
    seed: int,
) -> tuple[Any, Any]:
    """First-order and total indices: a row for each varying output (of size `sizes`), a column for each input."""
    from scipy.stats import sobol_indices

    rows = list(varying)
    if len(rows) == len(uncertain) == 1:
        rows *= 2  # of one input and one output SciPy makes a number, where it then expects an array
    units = numpy.array(sizes)[rows].reshape(-1, 1)

    def scaled(values: Any) -> Any:
        return outputs(values)[rows] / units

    result = sobol_indices(func=scaled, n=SOBOL_SAMPLES, dists=list(uncertain), rng=numpy.random.default_rng(seed))
    shape = (len(rows), len(uncertain))
    first, total = (numpy.reshape(item, shape)[: len(varying)] for item in (result.first_order, result.total_order))
    return first, total


def _effects(
    outputs: Callable[[Any], Any], uncertain: Sequence[Uncertain], ranges: Sequence[tuple[float, float]], seed: int
) -> tuple[Any, Any]:
    """How much each output changes when one input goes from one end of its range to the other, the others as drawn.

    Mean absolute change, and the standard deviation of the change: 0 where the others have no part in it. This is the
    elementary effect of Morris (Technometrics 33, 1991) for a step as long as the range. A row for each output, a
    column for each input.
    """
    shares = random_shares(len(uncertain), EFFECT_SAMPLES, seed)
    values = numpy.array([item.ppf(row) for item, row in zip(uncertain, shares, strict=True)])
    means, spreads = [], []
    for number, (low, high) in enumerate(ranges):
        moved = numpy.concatenate([values, values], axis=1)
        moved[number] = numpy.repeat([low, high], EFFECT_SAMPLES)
        moved_outputs = outputs(moved)
        change = moved_outputs[:, EFFECT_SAMPLES:] - moved_outputs[:, :EFFECT_SAMPLES]
        means.append(numpy.abs(change).mean(axis=1))
        spreads.append(change.std(axis=1))
    return numpy.array(means).T, numpy.array(spreads).T
