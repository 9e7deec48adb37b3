"""The uncertainty that a problem file states of its figures, read and bounded; `dse.questions.sensitivity` samples it.

uncertainty:
thread_types.nav.compute_execution_time.max: {range: 3 ms .. 4 ms}
bus_types.can_125k.bandwidth: {distribution: normal, mean: 120 kbit/s, deviation: 2 kbit/s}
thread_types.fusion.compute_execution_time: {factor: 0.8 .. 1.3, distribution: triangular, mode: 1}
connections.position.data_size: {samples: sizes.csv, column: bytes, unit: B}
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import erfc, sqrt

from dse.spec.loading.samples import SampleError, Samples
from dse.spec.quantities.quantities import BASE, LIKE_A_PATH, Figure, figures_of, matching, read_value
from dse.spec.schema.fields import COUNT
from dse.spec.schema.model import Spec, Uncertainty
from dse.spec.schema.quantity_fields import TOTAL
from dse.support.errors import UsageError, did_you_mean
from dse.support.units import (
    DIMENSIONLESS,
    POWER_DRAW,
    UNITS,
    QuantityKind,
    UnitError,
    expectation,
    parse_quantity,
    range_ends,
    shown,
    unit_ratio,
)

PLAIN = QuantityKind("a factor", "1.1", DIMENSIONLESS)
Ends = tuple[Fraction, Fraction]


class UncertaintyError(ValueError):
    """An entry that cannot be read; `place` is where, from the top of the file.

    `is_of_nothing`: no quantity has its path.
    """

    def __init__(self, field: str, message: str, hint: str = "", *, is_of_nothing: bool = False) -> None:
        super().__init__(message)
        self.field, self.message, self.hint = field, message, hint
        self.is_of_nothing = is_of_nothing
        self.path = ""

    @property
    def place(self) -> tuple[str, ...]:
        """The entry, or the field of it that is wrong.

        A path below ``uncertainty``, for the place of the message.
        """
        return ("uncertainty", self.path, self.field) if self.field else ("uncertainty", self.path)


@dataclass(frozen=True)
class UncertainInput:
    """An uncertain input: the figures that it moves, by their value or (`is_factor`) by a common factor.

    `low` and `high` bound it (None: it has no bounds); `distribution` is that of the entry, or ``samples``, whose
    values, least first, are `numbers`, or None where anything is possible. Numbers count in the figures' unit.
    """

    path: str
    words: str
    figures: tuple[Figure, ...]
    is_factor: bool
    distribution: str | None
    low: Fraction | None = None
    high: Fraction | None = None
    mean: Fraction = Fraction(0)
    deviation: Fraction = Fraction(0)
    mode: Fraction = Fraction(0)
    numbers: tuple[Fraction, ...] = ()


def read_stated(spec: Spec, samples: Samples) -> tuple[tuple[UncertainInput, ...], tuple[UncertaintyError, ...]]:
    """The uncertain inputs of a problem, in the order of the file, and every mistake in them.

    Inputs with bounds in base units; a quantity that two entries state is a mistake of the second one.
    """
    figures = figures_of(spec) if spec.uncertainty else ()
    inputs: list[UncertainInput] = []
    mistakes: list[UncertaintyError] = []
    taken: set[Figure] = set()
    for path, entry in spec.uncertainty.items():
        try:
            item = _UncertaintyReader(path, entry, figures, samples).read()
            if not taken.isdisjoint(item.figures):
                raise UncertaintyError("", "another entry states the same quantity")
        except UncertaintyError as error:
            error.path = path
            mistakes.append(error)
        else:
            inputs.append(item)
            taken.update(item.figures)
    return tuple(inputs), tuple(mistakes)


class _UncertaintyReader:
    """Reads one entry."""

    def __init__(self, path: str, entry: Uncertainty, figures: Sequence[Figure], samples: Samples) -> None:
        self.path, self.entry, self.samples = path, entry, samples
        self.figures = tuple(matching(figures, path))
        if not self.figures:
            meant = did_you_mean(path, [item.path for item in figures], LIKE_A_PATH)
            raise UncertaintyError("", "no quantity of the problem has this path", meant, is_of_nothing=True)
        self.is_factor = entry.factor is not None
        if not self.is_factor and len(self.figures) > 1:
            names = ", ".join(item.path for item in self.figures[:4])
            hint = f"say which ({names}), or state a `factor`"
            raise UncertaintyError("", f"it stands for {len(self.figures)} values", hint)
        self.kind = PLAIN if self.is_factor else self.figures[0].kind

    def read(self) -> UncertainInput:
        """The entry; `UncertaintyError` where it is wrong."""
        entry = self.entry
        forms = [name for name in ("range", "factor") if getattr(entry, name) is not None]
        if len(forms) > 1:
            raise UncertaintyError("factor", "give `range` or `factor`, not both")
        if entry.samples is not None:
            if entry.distribution is not None or forms == ["range"]:
                hint = "leave `range` and `distribution` out"
                raise UncertaintyError("samples", "samples are a distribution of their own", hint)
            return self._sampled()
        self._refuse("column", "unit")
        ends = self._ends(forms[0]) if forms else None
        if entry.distribution == "normal":
            return self._normal(ends)
        if ends is None:
            hint = "range: LOW .. HIGH, factor: LOW .. HIGH, distribution: normal, or samples"
            raise UncertaintyError("", "nothing says how uncertain it is", hint)
        self._refuse("mean", "deviation")
        if entry.distribution == "triangular":
            return self._triangular(ends)
        self._refuse("mode")
        words = "uniform" if entry.distribution == "uniform" else "anything"
        return self._made(f"{words} in {getattr(entry, forms[0])}", ends)

    def _made(self, words: str, ends: Ends | None, **more: Fraction) -> UncertainInput:
        low, high = ends if ends is not None else (None, None)
        said = f"factor: {words}" if self.is_factor else words
        made = UncertainInput(self.path, said, self.figures, self.is_factor, self.entry.distribution, low, high)
        return replace(made, **more)  # type: ignore[arg-type] # numbers only

    def _refuse(self, *names: str) -> None:
        for name in names:
            if getattr(self.entry, name) is not None:
                kind = self.entry.distribution or "a range"
                raise UncertaintyError(name, f"`{name}` has no meaning for {kind}")

    def _number(self, field: str, text: str) -> Fraction:
        try:
            value = self._value(field, text)
        except (UsageError, UnitError) as error:
            raise UncertaintyError(field, str(error).removeprefix(f"{field}: ")) from error
        if value < 0:
            raise UncertaintyError(field, "it must not be negative")
        return _in_base(value, self.kind)

    def _value(self, field: str, text: str) -> Fraction:
        """A value in coherent units; a factor, a count or a total as it is."""
        if self.kind is PLAIN:
            return _plain(text)
        quantity = read_value(text, self.kind, field)
        if self.kind is not TOTAL:
            return quantity.value
        ratio = unit_ratio(quantity.unit, self.figures[0].unit) if quantity.unit else None
        if ratio is None:
            raise UnitError(f"expected a figure in {self.figures[0].unit}, got {shown(quantity.unit)}")
        return quantity.value * ratio

    def _ends(self, field: str) -> Ends:
        try:
            texts = range_ends(getattr(self.entry, field))
        except UnitError as error:
            raise UncertaintyError(field, error.message, error.hint) from error
        if texts is None:
            raise UncertaintyError(field, "expected LOW .. HIGH")
        ends = self._number(field, texts[0]), self._number(field, texts[1])
        if ends[0] > ends[1]:
            raise UncertaintyError(field, "the range is empty: its low end is above its high one")
        if self.kind is COUNT and ends[0] != ends[1]:
            raise UncertaintyError(field, "a whole number has no range: list it as options")
        return ends

    def _normal(self, ends: Ends | None) -> UncertainInput:
        entry = self.entry
        self._refuse("mode")
        if entry.mean is None or entry.deviation is None:
            raise UncertaintyError("distribution", "a normal distribution needs `mean` and `deviation`")
        mean, deviation = self._number("mean", entry.mean), self._number("deviation", entry.deviation)
        if deviation <= 0:
            raise UncertaintyError("deviation", "it must be above 0")
        shares = [0.0, 1.0] if ends is None else [normal_share(float((end - mean) / deviation)) for end in ends]
        if shares[1] <= shares[0]:
            raise UncertaintyError("range", "the distribution has nothing in this range")
        words = f"normal, {entry.mean} with deviation {entry.deviation}"
        words += f", cut to {entry.range or entry.factor}" if ends else ""
        return self._made(words, ends, mean=mean, deviation=deviation)

    def _triangular(self, ends: Ends) -> UncertainInput:
        if self.entry.mode is None:
            raise UncertaintyError("distribution", "a triangular distribution needs a `mode`")
        mode = self._number("mode", self.entry.mode)
        if not ends[0] <= mode <= ends[1]:
            raise UncertaintyError("mode", "it must lie in the range")
        words = f"triangular in {self.entry.range or self.entry.factor}, most likely {self.entry.mode}"
        return self._made(words, ends, mode=mode)

    def _sampled(self) -> UncertainInput:
        self._refuse("mean", "deviation", "mode")
        numbers, where = self._numbers()
        words = f"{len(numbers)} samples {where}"
        said = f"factor: {words}" if self.is_factor else words
        ends = numbers[0], numbers[-1]
        return UncertainInput(self.path, said, self.figures, self.is_factor, "samples", *ends, numbers=tuple(numbers))

    def _numbers(self) -> tuple[list[Fraction], str]:
        samples, unit = self.entry.samples, self.entry.unit
        if isinstance(samples, tuple):
            self._refuse("column", "unit")
            if not samples:
                raise UncertaintyError("samples", "an empty list")
            return sorted(self._number("samples", text) for text in samples), "in the file"
        texts = self.samples[self.path]
        if isinstance(texts, SampleError):
            raise UncertaintyError(texts.field, texts.message, texts.hint) from texts
        known: dict[str, Fraction] = {}  # measured values repeat, and there may be a million of them
        for number, text in enumerate(texts, start=1):
            if text not in known:
                try:
                    known[text] = self._number("samples", f"{text} {unit}" if unit else text)
                except UncertaintyError:  # the file may be any: nothing of it is quoted
                    message = f"sample {number} of {samples} is not {expectation(self.kind)}, or it is negative"
                    raise UncertaintyError("samples", message, "" if unit else "`unit` states that of all") from None
        return sorted(known[text] for text in texts), f"of {samples}"


def normal_share(deviations: float) -> float:
    """The share of a normal distribution below a number of deviations from its mean.

    >>> round(normal_share(1.0) - normal_share(-1.0), 4)
    0.6827
    """
    return erfc(-deviations / sqrt(2)) / 2


def _plain(text: str) -> Fraction:
    quantity = parse_quantity(text)
    if quantity.unit not in ("", "%"):
        raise UnitError(f"a factor is a plain number, got {text!r}")
    return quantity.value


def _in_base(value: Fraction, kind: QuantityKind) -> Fraction:
    """A value in coherent units (or of a factor, count, total) in the unit of the figures."""
    if kind in BASE:
        return value / UNITS[BASE[kind]][0]
    return value * 1000 if kind == POWER_DRAW else value
