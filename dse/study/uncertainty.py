"""Stated uncertainties: what the problem file says of its own figures, read, bounded and sampled.

uncertainty:
thread_types.nav.compute_execution_time.max: {range: 3 ms .. 4 ms}
bus_types.can_125k.bandwidth: {distribution: normal, mean: 120 kbit/s, deviation: 2 kbit/s}
thread_types.fusion.compute_execution_time: {factor: 0.8 .. 1.3, distribution: triangular, mode: 1}
connections.position.data_size: {samples: sizes.csv, column: bytes, unit: B}
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from fractions import Fraction
from typing import Any

import numpy

from dse.api.problem import Problem
from dse.errors import Diagnostic, ProblemError, UsageError
from dse.spec.model import Uncertainty
from dse.spec.samples import SampleError
from dse.study.functions import InputSpace, Variable
from dse.study.quantities import BASE, COUNT, RANGES, TOTAL, read_value
from dse.units import POWER_DRAW, UNITS, Kind, UnitError, parse_quantity, shown

MIDDLE = 0.95
"""The share of its values over which an input without bounds is said to have its effect."""
PLAIN = Kind("a factor", "1.1", parse_quantity("1").dimension or UNITS["%"][1])
Quantile = Callable[[Any], Any]


@dataclass(frozen=True)
class Uncertain:
    """An uncertain input: the variables it moves, by their value or (`is_factor`) by a common factor.

    `low` and `high` bound it (None: it has no bounds); `quantile` maps [0, 1] to its values, in the variables' unit.
    """

    path: str
    words: str
    variables: tuple[Variable, ...]
    is_factor: bool
    low: Fraction | None
    high: Fraction | None
    quantile: Quantile

    def ppf(self, share: Any) -> Any:
        """`quantile`, by the name that scipy looks for."""
        return self.quantile(numpy.asarray(share, dtype=float))

    def columns(self, values: Any) -> dict[int, Any]:
        """The variables' samples for samples of the input."""
        if not self.is_factor:
            return {item.index: _settled(item, numpy.maximum(values, item.least)) for item in self.variables}
        return {item.index: _settled(item, numpy.maximum(values * float(item.nominal), 0.0)) for item in self.variables}

    def ends(self) -> tuple[Fraction, Fraction]:
        """Both bounds.

        Raises
        ------
        UsageError
            when there are none.
        """
        if self.low is None or self.high is None:
            raise UsageError(f"{self.path}: a normal distribution has no bounds: state a `range` beside it")
        return self.low, self.high

    def main_range(self) -> tuple[float, float]:
        """The bounds; where there are none, the middle `MIDDLE` of all values."""
        if self.low is not None and self.high is not None:
            return float(self.low), float(self.high)
        low, high = self.ppf([(1 - MIDDLE) / 2, (1 + MIDDLE) / 2])
        return float(low), float(high)

    def set(self, values: list[Fraction], place: Fraction) -> None:
        """Put a value of the input into a list of all variables' values."""
        for variable in self.variables:
            values[variable.index] = self._value(variable, place)

    def range_of(self, variable: Variable) -> tuple[Fraction, Fraction]:
        """The bounds of one of its variables.

        Raises
        ------
        UsageError
            when there are none.
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
    """What the problem states, in the order of the file.

    Raises
    ------
    ProblemError
        for paths that do not exist, values of the wrong kind, samples that cannot be read: all at once.
    """
    found: list[Uncertain] = []
    mistakes: list[Diagnostic] = []
    for path, stated in problem.loaded.spec.uncertainty.items():
        try:
            item = _Reader(problem, inputs, path, stated).read()
            taken = {variable.index for other in found for variable in other.variables}
            if any(variable.index in taken for variable in item.variables):
                raise _Mistake("", "another entry states the same quantity")
            found.append(item)
        except _Mistake as error:
            place = ("uncertainty", path, error.field) if error.field else ("uncertainty", path)
            mistakes.append(problem.loaded.diagnostic(place, error.message, error.hint, at_key=not error.field))
    if mistakes:
        raise ProblemError(mistakes)
    return tuple(found)


class _Mistake(ValueError):
    def __init__(self, field: str, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.field, self.message, self.hint = field, message, hint


class _Reader:
    """Reads one entry."""

    def __init__(self, problem: Problem, inputs: InputSpace, path: str, stated: Uncertainty) -> None:
        self.problem, self.path, self.stated = problem, path, stated
        self.variables = tuple(inputs.matching(path))
        if not self.variables:
            close = get_close_matches(path, [item.path for item in inputs.variables], 1, 0.0)
            hint = f'did you mean "{close[0]}"?' if close else ""
            raise _Mistake("", "no quantity of the problem has this path", hint)
        self.is_factor = stated.factor is not None
        if not self.is_factor and len(self.variables) > 1:
            names = ", ".join(item.path for item in self.variables[:4])
            raise _Mistake(
                "", f"it stands for {len(self.variables)} values", f"say which ({names}), or state a `factor`"
            )
        self.kind = PLAIN if self.is_factor else self.variables[0].kind

    def read(self) -> Uncertain:
        stated = self.stated
        forms = [name for name in ("range", "factor") if getattr(stated, name) is not None]
        if len(forms) > 1:
            raise _Mistake("factor", "give `range` or `factor`, not both")
        if stated.samples is not None:
            if stated.distribution is not None or forms == ["range"]:
                raise _Mistake(
                    "samples", "samples are a distribution of their own", "leave `range` and `distribution` out"
                )
            return self._sampled()
        self._refuse("column", "unit")
        ends = self._ends(forms[0]) if forms else None
        if stated.distribution == "normal":
            return self._normal(ends)
        if ends is None:
            hint = "range: LOW .. HIGH, factor: LOW .. HIGH, distribution: normal, or samples"
            raise _Mistake("", "nothing says how uncertain it is", hint)
        self._refuse("mean", "deviation")
        if stated.distribution == "triangular":
            return self._triangular(ends)
        self._refuse("mode")
        low, high = (float(end) for end in ends)
        words = "uniform" if stated.distribution == "uniform" else "anything (sampled uniformly)"
        return self._made(f"{words} in {getattr(stated, forms[0])}", ends, lambda share: low + (high - low) * share)

    def _made(self, words: str, ends: tuple[Fraction, Fraction] | None, quantile: Quantile) -> Uncertain:
        low, high = ends if ends is not None else (None, None)
        said = f"factor: {words}" if self.is_factor else words
        return Uncertain(self.path, said, self.variables, self.is_factor, low, high, quantile)

    def _refuse(self, *names: str) -> None:
        for name in names:
            if getattr(self.stated, name) is not None:
                kind = self.stated.distribution or "a range"
                raise _Mistake(name, f"`{name}` has no meaning for {kind}")

    def _number(self, field: str, text: str) -> Fraction:
        try:
            value = self._value(field, text)
        except (UsageError, UnitError) as error:
            raise _Mistake(field, str(error).removeprefix(f"{field}: ")) from error
        if value < 0:
            raise _Mistake(field, "it must not be negative")
        return in_base(value, self.kind)

    def _value(self, field: str, text: str) -> Fraction:
        """A value in coherent units; a factor, a count or a total as it is."""
        if self.kind is PLAIN:
            return _plain(text)
        quantity = read_value(text, self.kind, field)
        if self.kind is TOTAL and quantity.unit != self.variables[0].unit:
            raise UnitError(f"expected a figure in {self.variables[0].unit}, got {shown(quantity.unit)}")
        return quantity.value

    def _ends(self, field: str) -> tuple[Fraction, Fraction]:
        low, separator, high = (part.strip() for part in getattr(self.stated, field).partition(".."))
        if not separator or not low or not high:
            raise _Mistake(field, "expected LOW .. HIGH")
        try:
            unit = parse_quantity(high).unit
            low = low if parse_quantity(low).unit or not unit else f"{low} {unit}"
        except UnitError as error:
            raise _Mistake(field, error.message, error.hint) from error
        ends = self._number(field, low), self._number(field, high)
        if ends[0] > ends[1]:
            raise _Mistake(field, "the range is empty: its low end is above its high one")
        if self.kind is COUNT and ends[0] != ends[1]:
            raise _Mistake(field, "a whole number has no range: list it as alternatives")
        return ends

    def _normal(self, ends: tuple[Fraction, Fraction] | None) -> Uncertain:
        stated = self.stated
        self._refuse("mode")
        if stated.mean is None or stated.deviation is None:
            raise _Mistake("distribution", "a normal distribution needs `mean` and `deviation`")
        mean, deviation = float(self._number("mean", stated.mean)), float(self._number("deviation", stated.deviation))
        if deviation <= 0:
            raise _Mistake("deviation", "it must be above 0")
        from scipy.special import ndtr, ndtri

        bottom, top = (0.0, 1.0) if ends is None else (float(ndtr((float(end) - mean) / deviation)) for end in ends)
        if top <= bottom:
            raise _Mistake("range", "the distribution has nothing in this range")
        words = f"normal, {stated.mean} with deviation {stated.deviation}" + (
            f", cut to {stated.range or stated.factor}" if ends else ""
        )
        return self._made(words, ends, lambda share: mean + deviation * ndtri(bottom + (top - bottom) * share))

    def _triangular(self, ends: tuple[Fraction, Fraction]) -> Uncertain:
        if self.stated.mode is None:
            raise _Mistake("distribution", "a triangular distribution needs a `mode`")
        mode_exact = self._number("mode", self.stated.mode)
        if not ends[0] <= mode_exact <= ends[1]:
            raise _Mistake("mode", "it must lie in the range")
        low, high, mode = float(ends[0]), float(ends[1]), float(mode_exact)
        width = high - low
        knee = (mode - low) / width if width else 1.0

        def quantile(share: Any) -> Any:
            rising = low + numpy.sqrt(share * width * (mode - low))
            falling = high - numpy.sqrt((1 - share) * width * (high - mode))
            return numpy.where(share <= knee, rising, falling)

        words = f"triangular in {self.stated.range or self.stated.factor}, most likely {self.stated.mode}"
        return self._made(words, ends, quantile)

    def _sampled(self) -> Uncertain:
        self._refuse("mean", "deviation", "mode")
        texts, where = self._texts()
        numbers = sorted(self._number("samples", text) for text in texts)
        ordered = numpy.array([float(number) for number in numbers])

        def quantile(share: Any) -> Any:
            return ordered[numpy.minimum((share * len(ordered)).astype(int), len(ordered) - 1)]

        return self._made(f"{len(numbers)} samples {where}", (numbers[0], numbers[-1]), quantile)

    def _texts(self) -> tuple[Sequence[str], str]:
        given, stated = self.stated.samples, self.stated
        if isinstance(given, tuple):
            self._refuse("column", "unit")
            if not given:
                raise _Mistake("samples", "an empty list")
            return given, "in the file"
        assert given is not None
        texts = self.problem.loaded.samples[self.path]
        if isinstance(texts, SampleError):
            raise _Mistake(texts.field, texts.message, texts.hint) from texts
        unit = f" {stated.unit}" if stated.unit else ""
        return [f"{text}{unit}" for text in texts], f"of {given}"


def _plain(text: str) -> Fraction:
    quantity = parse_quantity(text)
    if quantity.unit not in ("", "%"):
        raise UnitError(f"a factor is a plain number, got {text!r}")
    return quantity.value


def in_base(value: Fraction, kind: Kind) -> Fraction:
    """A value in coherent units (or of a factor, count, total) in the unit of the variables."""
    if kind in BASE:
        return value / UNITS[BASE[kind]][0]
    return value * 1000 if kind == POWER_DRAW else value


def stated_ends(uncertain: Sequence[Uncertain]) -> Mapping[int, tuple[Fraction, Fraction]]:
    """The bounds of each variable that has some."""
    found: dict[int, tuple[Fraction, Fraction]] = {}
    for item in uncertain:
        if item.low is None or item.high is None:
            continue
        found |= {variable.index: item.range_of(variable) for variable in item.variables}
    return found


def columns_of(uncertain: Sequence[Uncertain], shares: Any) -> dict[int, Any]:
    """Samples of every variable for shares of [0, 1], one row for each uncertain input.

    A range's maximum is at least its minimum.
    """
    return ordered_columns(uncertain, [item.ppf(row) for item, row in zip(uncertain, shares, strict=True)])


def ordered_columns(uncertain: Sequence[Uncertain], values: Sequence[Any]) -> dict[int, Any]:
    """Samples of every variable for samples of the inputs."""
    columns: dict[int, Any] = {}
    variables: dict[int, Variable] = {}
    for item, row in zip(uncertain, values, strict=True):
        columns |= item.columns(row)
        variables |= {variable.index: variable for variable in item.variables}
    for index, variable in variables.items():
        if variable.kind in RANGES and variable.end == "max" and index - 1 in columns:
            columns[index] = numpy.maximum(columns[index], columns[index - 1])
    return columns
