"""Property values as the texts of problem files: times, sizes, rates, with the units that both know."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from dse.importers.aadl.instance.properties import FoundProperty
from dse.importers.aadl.syntax.predeclared import (
    DATA_RATE_UNITS,
    MESSAGE_RATE_UNITS,
    POWER_UNITS,
    SIZE_UNITS,
    SPEED_UNITS,
    TIME_UNITS,
)
from dse.importers.aadl.syntax.tree import Listed, Number, Range, StringLiteral, Value, Word
from dse.importers.registry import Place

_DECIMAL = re.compile(r"-?[0-9]{1,30}(\.[0-9]{1,30})?")
_TIME_WORDS = {"sec": "s", "hr": "h"}


class WrongKindError(ValueError):
    """A value is none of its kind; `expected` says what is."""

    def __init__(self, expected: str) -> None:
        self.expected = expected
        super().__init__(expected)


@dataclass(frozen=True)
class Span:
    """A range of numbers in a coherent unit, and its text in a problem file."""

    low: Fraction
    high: Fraction
    text: str


def number_text(value: Fraction) -> str:
    """A number without loss: decimal where it is one.

    >>> number_text(Fraction(3, 2)), number_text(Fraction(1, 3)), number_text(Fraction(10))
    ('1.5', '1/3', '10')
    """
    denominator = value.denominator
    places = 0
    while denominator % 10 == 0:
        denominator, places = denominator // 10, places + 1
    twos = fives = 0
    while denominator % 2 == 0:
        denominator, twos = denominator // 2, twos + 1
    while denominator % 5 == 0:
        denominator, fives = denominator // 5, fives + 1
    if denominator != 1:
        return f"{value.numerator}/{value.denominator}"
    places += max(twos, fives)
    digits = str(abs(value.numerator) * 10**places // value.denominator).rjust(places + 1, "0")
    sign = "-" if value < 0 else ""
    return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)


def _number(value: Value, units: Mapping[str, Fraction], expected: str) -> tuple[Fraction, Fraction, str]:
    """The value in the coherent unit, as written, and its unit."""
    if not isinstance(value, Number):
        raise WrongKindError(expected)
    unit = value.unit.lower()
    if unit not in units and not (unit == "" and value.value == 0):
        raise WrongKindError(f"{expected} in {', '.join(units)}")
    return value.value * units.get(unit, Fraction(1)), value.value, value.unit


def _time_of(value: Value) -> Span:
    """A time in ns, as text such as ``10 ms``."""
    worth, written, unit = _number(value, TIME_UNITS, "a time")
    key = unit.lower() or "ns"
    return Span(worth, worth, f"{number_text(written)} {_TIME_WORDS.get(key, key)}")


def time_range(value: Value) -> Span:
    """A range of times, or one, in ns."""
    if isinstance(value, Range):
        low, high = _time_of(value.low), _time_of(value.high)
        if low.high > high.low:
            raise WrongKindError("a range whose first value is not the larger one")
        return Span(low.low, high.high, f"{low.text} .. {high.text}")
    return _time_of(value)


def size_of(value: Value) -> Span:
    """A size in bytes."""
    worth, _, _ = _number(value, SIZE_UNITS, "a size")
    return Span(worth, worth, size_text(worth))


def size_text(size_bytes: Fraction) -> str:
    """A size in bytes as text: in bits where it is no whole number of them.

    >>> size_text(Fraction(3)), size_text(Fraction(1, 8))
    ('3 B', '1 bit')
    """
    is_whole = size_bytes.denominator == 1
    return f"{number_text(size_bytes)} B" if is_whole else f"{number_text(size_bytes * 8)} bit"


def data_rate(value: Value) -> Span:
    """A data rate in bit/s."""
    worth, written, unit = _number(value, DATA_RATE_UNITS, "a data rate")
    return Span(worth, worth, f"{number_text(written)} {_spelled_rate(unit)}")


def _spelled_rate(unit: str) -> str:
    words = {"bitsps": "bit/s", "kbitsps": "kbit/s", "mbitsps": "Mbit/s", "gbitsps": "Gbit/s", "bytesps": "B/s",
             "kbytesps": "KB/s", "mbytesps": "MB/s", "gbytesps": "GB/s"}  # fmt: skip
    return words.get(unit.lower(), "bit/s")


def speed_mips(value: Value) -> Fraction:
    """A speed of a processor in MIPS."""
    value = value.high if isinstance(value, Range) else value
    return _number(value, SPEED_UNITS, "a speed")[0]


def power_text(value: Value) -> str:
    """A power."""
    worth, _, _ = _number(value, POWER_UNITS, "a power")
    return f"{number_text(worth)} mW"


def message_rate(value: Value) -> Fraction:
    """A rate in Hz."""
    value = value.high if isinstance(value, Range) else value
    return _number(value, {**MESSAGE_RATE_UNITS, "": Fraction(1)}, "a rate")[0]


def whole(value: Value) -> int:
    """A whole number from 0."""
    if isinstance(value, Number) and value.value.denominator == 1 and value.value >= 0 and not value.unit:
        return int(value.value)
    raise WrongKindError("a whole number")


def word(value: Value) -> str:
    """A literal, in small letters; the first of a list."""
    while isinstance(value, Listed) and len(value.items) == 1:
        value = value.items[0]
    if isinstance(value, Word):
        return value.name.lower()
    raise WrongKindError("one of its literals")


def text_of(value: Value) -> str:
    """A text in quotes."""
    if isinstance(value, StringLiteral):
        return value.text
    raise WrongKindError("a text in quotes")


def is_true(value: Value) -> bool:
    """Whether a value is ``true``."""
    return isinstance(value, Word) and value.name.lower() == "true"


def shown_place(place: Place) -> str:
    """``robot.aadl:12``: the name of the file and the line."""
    return f"{place.file.rpartition('/')[2]}:{place.line}"


def told(value: FoundProperty) -> str:
    """The origin of a value, in words."""
    return shown_place(value.place) + (" (inherited)" if value.via == "inherited" else "")


def plain_range(value: Value) -> tuple[Fraction, Fraction]:
    """The ends of a range of numbers without units, the lower one first."""
    if not (isinstance(value, Range) and isinstance(value.low, Number) and isinstance(value.high, Number)):
        raise WrongKindError("a range of numbers")
    if value.low.value > value.high.value:
        raise WrongKindError("a range that ends above its beginning")
    return value.low.value, value.high.value


def first_number(value: Value) -> Fraction | None:
    """The number in a list of one text, such as an Initial_Value; None where that is none."""
    items = value.items if isinstance(value, Listed) else (value,)
    text = items[0].text.strip() if len(items) == 1 and isinstance(items[0], StringLiteral) else ""
    return Fraction(text) if _DECIMAL.fullmatch(text) else None
