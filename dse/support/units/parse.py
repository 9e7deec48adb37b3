"""Text with a unit to exact numbers; each reader says how it rounds."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from math import ceil, floor
from typing import NoReturn

from dse.support.units.exact import Exact, Rounded, is_unbounded
from dse.support.units.table import (
    BANDWIDTH,
    DIMENSIONLESS,
    DURATION,
    INSTRUCTIONS,
    PERIOD,
    POWER_DRAW,
    PRICE,
    PROCESSOR_SPEED,
    RATE,
    RATE_OF_DATA,
    RATIO,
    SIZE,
    SIZE_RANGE,
    TIME_RANGE,
    TRANSMISSION,
    UNITS,
    Money,
    Quantity,
    QuantityKind,
    Rounding,
    SizeRange,
    TimeRange,
    Total,
    UnitError,
    canonical_unit,
    expectation,
    shown,
    unit_hint,
)
from dse.support.units.text import (
    format_bandwidth,
    format_duration,
    format_money,
    format_power,
    format_size,
    format_time_range,
)

MAX_DIGITS = 40
MAX_EXPONENT = 30
NS_PER_S = 10**9
PARAMETER_TIMES_NS = {"s": Fraction(10**9), "ms": Fraction(10**6), "us": Fraction(10**3), "ns": Fraction(1)}
"""Units of parameters of other tools that hold a bare number for a time, in ns."""
PARAMETER_RATES = {"Hz": Fraction(1), "kHz": Fraction(1000)}
"""Units of parameters of other tools that hold a bare number for a rate, in Hz."""

_NUMBER = re.compile(
    r"(?P<sign>[+-]?)(?:(?P<whole>[0-9]+)/(?P<denominator>[0-9]+)"
    r"|(?P<mantissa>[0-9]+(?:\.(?!\.)[0-9]*)?|\.[0-9]+)(?:[eE](?P<exponent>[+-]?[0-9]+))?)"
)


@lru_cache(maxsize=4096)
def parse_quantity(text: str) -> Quantity:
    """Read a number with an optional unit.

    Raises
    ------
    UnitError
        No number, one that is malformed, not finite or absurdly long, or a unit that cannot be one.

    Examples
    --------
    >>> found = parse_quantity("1.5 ms")
    >>> found.value, found.dimension, found.unit
    (Fraction(3, 2000), Dimension(time=1, length=0, data=0, money=0, power=0, work=0), 'ms')
    """
    match = _NUMBER.match(text.strip())
    if match is None:
        raise UnitError(f"expected a number with its unit, got {shown(text)}")
    unit = text.strip()[match.end() :].strip()
    if unit and (unit[0] in "0123456789._,+-/" or not unit.isprintable()):
        hint = "write decimals with a point" if unit[0] == "," else "digits are not grouped" if unit[0] == "_" else ""
        raise UnitError(f"malformed number {shown(text)}", hint)
    scale, dimension = UNITS.get(canonical_unit(unit), (Fraction(1), None if unit else DIMENSIONLESS))
    return Quantity(_number(match, text) * scale, dimension, unit)


def convert(quantity: Quantity, unit: str) -> Fraction:
    """The number of `unit`s in a quantity; the units must have one dimension, or be the same undeclared one.

    Exact. Raises `UnitError` where the dimensions differ.
    """
    if quantity.unit == unit and quantity.dimension is None:
        return quantity.value
    scale, dimension = UNITS.get(canonical_unit(unit), (Fraction(1), None))
    if dimension is None or quantity.dimension != dimension:
        raise UnitError(f'expected a quantity in "{unit}", got {shown(quantity.unit)}')
    return quantity.value / scale


def as_written(quantity: Quantity) -> Quantity:
    """The quantity as a declared total counts it: the number as written, in its own unit, whatever that is.

    >>> as_written(parse_quantity("70 %"))
    Quantity(value=Fraction(70, 1), dimension=None, unit='%')
    """
    scale, _ = UNITS.get(canonical_unit(quantity.unit), (Fraction(1), None))
    return Quantity(quantity.value / scale, None, quantity.unit)


def round_to_int(value: Fraction, rounding: Rounding) -> int:
    """An integer, in the named direction; `Rounding.EXACT` raises `UnitError` when there is none.

    `Rounding.UP` is for demand, `Rounding.DOWN` for what there is.
    """
    if rounding is Rounding.EXACT and value.denominator != 1:
        raise UnitError("not a whole number")
    return ceil(value) if rounding is Rounding.UP else floor(value)


def _number(match: re.Match[str], text: str) -> Fraction:
    parts = match.groupdict(default="")
    sign = -1 if parts["sign"] == "-" else 1
    if max(len(parts[name]) for name in ("whole", "denominator", "mantissa")) > MAX_DIGITS:
        raise UnitError(f"number too long: {shown(text)}", f"at most {MAX_DIGITS} digits")
    if parts["whole"]:
        if not int(parts["denominator"]):
            raise UnitError(f"division by zero in {shown(text)}")
        return sign * Fraction(int(parts["whole"]), int(parts["denominator"]))
    exponent = parts["exponent"] or "0"
    if len(exponent.lstrip("+-0")) > 3 or abs(int(exponent)) > MAX_EXPONENT:
        raise UnitError(f"exponent out of range in {shown(text)}", f"from -{MAX_EXPONENT} to {MAX_EXPONENT}")
    return sign * Fraction(parts["mantissa"]) * Fraction(10) ** int(exponent)


def _refuse(kind: QuantityKind, text: str, hint: str = "") -> NoReturn:
    raise UnitError(f"expected {expectation(kind)}, got {shown(text)}", hint)


def _read(kind: QuantityKind, text: str, *, positive: bool = False) -> Quantity:
    """A quantity of the kind, not negative; above zero when `positive`."""
    if not _NUMBER.match(text.strip()):
        _refuse(kind, text)
    quantity = parse_quantity(text)
    if quantity.dimension != kind.dimension:
        _refuse(kind, text, unit_hint(quantity.unit, kind.dimension))
    if quantity.value < 0 or (positive and quantity.value == 0):
        _refuse(kind, text, "it must be above zero" if positive else "it must not be negative")
    return quantity


def _round(
    kind: QuantityKind,
    text: str,
    value: Fraction,
    rounding: Rounding,
    base: str,
    write: Callable[[int], str] | None = None,
) -> int:
    """The value as an integer, which remembers that it was rounded (see `Rounded`)."""
    if rounding is Rounding.EXACT and value.denominator != 1:
        _refuse(kind, text, f"it must be a whole number of {base}")
    number = round_to_int(value, rounding)
    if number == value or write is None:
        return number
    return Rounded(number, f"{shown(text)} counts as {write(number)}", value)


def parse_duration_ns(text: str, rounding: Rounding) -> int:
    """A duration in ns, at least 0.

    >>> parse_duration_ns("756.8 us", Rounding.UP)
    756800
    """
    return _round(DURATION, text, _read(DURATION, text).value * NS_PER_S, rounding, "ns", format_duration)


def parse_period_ns(text: str) -> int:
    """A period in ns, above 0, converted exactly.

    Raises `UnitError` for another dimension, for 0, and where the period is no whole number of ns.
    """
    return _round(PERIOD, text, _read(PERIOD, text, positive=True).value * NS_PER_S, Rounding.EXACT, "ns")


def parse_time_range_ns(text: str) -> TimeRange:
    """``MIN .. MAX`` or one duration, in ns; the minimum rounds down and the maximum up.

    >>> parse_time_range_ns("1 .. 3 ms")
    TimeRange(min_ns=1000000, max_ns=3000000)
    """
    least, greatest = _range(TIME_RANGE, text, NS_PER_S)
    whole = TimeRange(floor(least), ceil(greatest))
    note = f"{shown(text)} counts as {format_time_range(whole)}"
    ends = zip(whole, (least, greatest), strict=True)
    return TimeRange(*(end if end == exact else Rounded(int(end), note, exact) for end, exact in ends))


def parse_transmission_ns(text: str) -> TimeRange:
    """``MIN .. MAX`` or one duration of a message or a byte, in ns, exact.

    >>> parse_transmission_ns("100 ps .. 1 ns")
    TimeRange(min_ns=Fraction(1, 10), max_ns=1)
    """
    least, greatest = _range(TRANSMISSION, text, NS_PER_S)
    return TimeRange(whole(least), whole(greatest))


def whole(value: Exact) -> Exact:
    """The number as an integer where it is one.

    Unbounded figures stay as they are.
    """
    return value.numerator if value.denominator == 1 and not is_unbounded(value) else value


def range_ends(text: str) -> tuple[str, str] | None:
    """The texts of the two ends of ``LOW .. HIGH``, each with its unit; None where the text is no range.

    The unit may stand behind the high end alone.

    >>> range_ends("1 .. 3 ms"), range_ends("0.9 .. 1.1"), range_ends("3 ms")
    (('1 ms', '3 ms'), ('0.9', '1.1'), None)
    """
    low, separator, high = (part.strip() for part in text.partition(".."))
    if not separator or not low or not high:
        return None
    unit = parse_quantity(high).unit
    return (low if parse_quantity(low).unit or not unit else f"{low} {unit}"), high


_OTHER_RANGE = re.compile(
    r"\s*(?P<low>[0-9.]+\s*[a-zµ]*?)\s*(?:\.{3}|[-\u2010-\u2015~\u2026;:]|,\s|\bto\b|\s\.\s)\s*(?P<high>[0-9.]+\s*[a-zµ]+)\s*",
    re.IGNORECASE,
)
"""Two quantities between which stands something else than two points."""


def _meant_range(text: str) -> str:
    """How a range is written, where a text is one in another way; else "".

    >>> _meant_range("200 us - 900 us"), _meant_range("1...3 ms"), _meant_range("3 ms")
    ('a range is written "200 us .. 900 us"', 'a range is written "1 .. 3 ms"', '')
    """
    match = _OTHER_RANGE.fullmatch(text)
    return f'a range is written "{match["low"].strip(". ")} .. {match["high"].strip(". ")}"' if match else ""


def _range(kind: QuantityKind, text: str, scale: int = 1) -> tuple[Fraction, Fraction]:
    """Both ends, exact, times `scale`; they are equal where there is one figure."""
    low, separator, high = (part.strip() for part in text.partition(".."))
    if not separator:
        try:
            value = _read(kind, text).value * scale
        except UnitError:
            if hint := _meant_range(text):
                _refuse(kind, text, hint)
            raise
        return value, value
    if "..." in text or ".." in high or not low or not high:
        _refuse(kind, text, _meant_range(text))
    greatest = _read(kind, high)
    number = _NUMBER.fullmatch(low)
    least = _read(kind, f"{low} {greatest.unit}" if number else low)
    if least.value > greatest.value:
        _refuse(kind, text, "the minimum is above the maximum")
    return least.value * scale, greatest.value * scale


def parse_size_bytes(text: str) -> int:
    """A data size in bytes, rounded up.

    Raises `UnitError` for another dimension. A `Rounded` integer remembers the exact size.
    """
    return _round(SIZE, text, _read(SIZE, text).value, Rounding.UP, "bytes", format_size)


def parse_size_range_bytes(text: str) -> SizeRange:
    """``MIN .. MAX`` or one data size, in whole bytes.

    >>> parse_size_range_bytes("100 B .. 3 KB")
    SizeRange(min_bytes=100, max_bytes=3000)
    """
    ends = _range(SIZE_RANGE, text)
    if any(end.denominator != 1 for end in ends):
        _refuse(SIZE_RANGE, text, "both ends must be whole numbers of bytes")
    return SizeRange(*map(int, ends))


def parse_bandwidth_bps(text: str) -> int:
    """A bandwidth in bit/s, rounded down, at least 1.

    Raises `UnitError` for another dimension and below 1 bit/s.
    """
    exact = _read(BANDWIDTH, text).value * 8
    bandwidth_bps = _round(BANDWIDTH, text, exact, Rounding.DOWN, "bit/s", format_bandwidth)
    if not bandwidth_bps:
        _refuse(BANDWIDTH, text, "it must be at least 1 bit/s")
    return bandwidth_bps


def parse_data_rate(text: str) -> Fraction:
    """A data rate in B/s, exact, at least 0.

    Raises `UnitError` for another dimension.
    """
    return _read(RATE_OF_DATA, text).value


def parse_rate_hz(text: str) -> Fraction:
    """A rate in Hz, exact, above 0.

    Raises `UnitError` for another dimension and for 0.
    """
    return _read(RATE, text, positive=True).value


def parse_speed_mips(text: str) -> Fraction:
    """The speed of a processor in million instructions a second, exact, at least 0."""
    return _read(PROCESSOR_SPEED, text).value / 10**6


def parse_instructions(text: str) -> Fraction:
    """A number of instructions, exact, at least 0."""
    return _read(INSTRUCTIONS, text).value


def parse_money(text: str) -> Money:
    """A price in cents, rounded up, with its currency.

    Raises `UnitError` for another dimension; the currency is the unit as it is written.
    """
    quantity = _read(PRICE, text)

    def write(cents: int) -> str:
        return format_money(Money(cents, quantity.unit))

    return Money(_round(PRICE, text, quantity.value, Rounding.UP, "cents", write), quantity.unit)


def parse_power_mw(text: str) -> int:
    """A power in mW, rounded up.

    Raises `UnitError` for another dimension.
    """
    return _round(POWER_DRAW, text, _read(POWER_DRAW, text).value * 1000, Rounding.UP, "mW", format_power)


def parse_ratio(text: str) -> Fraction:
    """A ratio as an exact fraction of one; a plain number is not one.

    70 % is 7/10. Raises `UnitError` for another dimension, too.
    """
    quantity = _read(RATIO, text)
    if not quantity.unit:
        _refuse(RATIO, text, unit_hint("", DIMENSIONLESS))
    return quantity.value


def parse_parameter(text: str) -> Total:
    """A figure as written, with any unit or none."""
    quantity = parse_quantity(text)
    return Total(as_written(quantity).value, quantity.unit)


def parse_total(text: str) -> Total:
    """A figure with any unit, both as written.

    Raises `UnitError` where there is no unit.
    """
    quantity = parse_quantity(text)
    if not quantity.unit:
        raise UnitError(f'expected a number with its unit such as "90 g", got {shown(text)}')
    return Total(as_written(quantity).value, quantity.unit)
