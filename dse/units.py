"""Text with a unit to exact numbers, once, and back: a closed table of units and `Fraction` arithmetic.

Coherent units are s, m, B (byte), ct (cent) and W. Every reader names its rounding: demand rounds up, supply rounds
down, a period must convert exactly. Every formatter gives canonical text that reads back as the same value.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from enum import Enum
from fractions import Fraction
from math import ceil, floor
from typing import NamedTuple, NoReturn

MAX_DIGITS = 40
MAX_EXPONENT = 30
NS_PER_S = 10**9


class UnitError(ValueError):
    """A text is not the quantity that its place asks for; `hint` names the closest valid form."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.message = message
        self.hint = hint
        super().__init__(f"{message} ({hint})" if hint else message)


class Dimension(NamedTuple):
    """Exponents of the base dimensions."""

    time: int = 0
    length: int = 0
    data: int = 0
    money: int = 0
    power: int = 0

    def times(self, other: Dimension) -> Dimension:
        """Dimension of a product."""
        return Dimension(*(a + b for a, b in zip(self, other, strict=True)))

    def over(self, other: Dimension) -> Dimension:
        """Dimension of a quotient."""
        return Dimension(*(a - b for a, b in zip(self, other, strict=True)))


DIMENSIONLESS = Dimension()
TIME = Dimension(time=1)
LENGTH = Dimension(length=1)
DATA = Dimension(data=1)
MONEY = Dimension(money=1)
POWER = Dimension(power=1)
FREQUENCY = DIMENSIONLESS.over(TIME)
DATA_RATE = DATA.over(TIME)
SPEED = LENGTH.over(TIME)


class Rounding(Enum):
    """Direction in which a value becomes an integer; there is no default."""

    DOWN = "down"
    UP = "up"
    EXACT = "exact"


@dataclass(frozen=True)
class Quantity:
    """A number with its unit.

    `value` is in coherent units (s, m, B, ct, W); when `dimension` is None the unit is not in the table and `value` is
    as written. `unit` is as written, "" for a plain number.
    """

    value: Fraction
    dimension: Dimension | None
    unit: str


class TimeRange(NamedTuple):
    """Least and greatest duration, in ns."""

    min_ns: int
    max_ns: int


class Money(NamedTuple):
    """An amount in cents of its currency."""

    cents: int
    currency: str


class Total(NamedTuple):
    """A declared total's figure, exactly as written."""

    value: Fraction
    unit: str


def _scaled(dimension: Dimension, units: Mapping[str, Fraction | int]) -> dict[str, tuple[Fraction, Dimension]]:
    return {unit: (Fraction(scale), dimension) for unit, scale in units.items()}


_MICRO, _MILLI, _NANO = Fraction(1, 10**6), Fraction(1, 1000), Fraction(1, 10**9)
_BIT = Fraction(1, 8)
_PREFIXES = (("", 1), ("k", 10**3), ("M", 10**6), ("G", 10**9))

CURRENCIES = ("EUR", "USD", "GBP", "CHF", "DKK", "SEK", "NOK")
UNITS: dict[str, tuple[Fraction, Dimension]] = {
    **_scaled(TIME, {"ns": _NANO, "us": _MICRO, "ms": _MILLI, "s": 1, "min": 60, "h": 3600}),
    **_scaled(DATA, {"bit": _BIT, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9}),
    **_scaled(DATA, {"KiB": 2**10, "MiB": 2**20, "GiB": 2**30}),
    **_scaled(DATA_RATE, {f"{prefix}bit/s": _BIT * factor for prefix, factor in _PREFIXES}),
    **_scaled(DATA_RATE, {f"{prefix.upper()}B/s": factor for prefix, factor in _PREFIXES}),
    **_scaled(DATA_RATE, {f"{prefix.upper()}bitsps": _BIT * factor for prefix, factor in _PREFIXES}),
    **_scaled(DATA_RATE, {f"{prefix.upper()}Bytesps": factor for prefix, factor in _PREFIXES}),
    **_scaled(FREQUENCY, {"Hz": 1, "kHz": 10**3, "MHz": 10**6}),
    **_scaled(MONEY, dict.fromkeys(CURRENCIES, 100)),
    **_scaled(POWER, {"mW": _MILLI, "W": 1, "kW": 1000}),
    **_scaled(DIMENSIONLESS, {"%": Fraction(1, 100), "ppm": _MICRO}),
    **_scaled(LENGTH, {"nm": _NANO, "um": _MICRO, "mm": _MILLI, "cm": Fraction(1, 100), "m": 1, "km": 1000}),
    **_scaled(SPEED, {"mm/s": _MILLI, "cm/s": Fraction(1, 100), "m/s": 1, "km/h": Fraction(1000, 3600)}),
}
_SLIPS = {
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "millisecond": "ms", "milliseconds": "ms",
    "usec": "us", "microsecond": "us", "microseconds": "us", "nsec": "ns", "nanosecond": "ns", "nanoseconds": "ns",
    "minute": "min", "minutes": "min", "hour": "h", "hours": "h", "hr": "h", "byte": "B", "bytes": "B", "bits": "bit",
    "bps": "bit/s", "kbps": "kbit/s", "mbps": "Mbit/s", "gbps": "Gbit/s", "hertz": "Hz", "€": "EUR", "euro": "EUR",
    "euros": "EUR", "$": "USD", "£": "GBP", "watt": "W", "watts": "W", "percent": "%",
}  # fmt: skip

_NUMBER = re.compile(
    r"(?P<sign>[+-]?)(?:(?P<whole>[0-9]+)/(?P<denominator>[0-9]+)"
    r"|(?P<mantissa>[0-9]+(?:\.(?!\.)[0-9]*)?|\.[0-9]+)(?:[eE](?P<exponent>[+-]?[0-9]+))?)"
)


class Kind(NamedTuple):
    """What a place in the file asks for."""

    noun: str
    example: str
    dimension: Dimension


DURATION = Kind("a duration", "10 ms", TIME)
PERIOD = Kind("a period", "10 ms", TIME)
TIME_RANGE = Kind("a time range", "243 us .. 1.3 ms", TIME)
SIZE = Kind("a data size", "30 B", DATA)
BANDWIDTH = Kind("a bandwidth", "125 kbit/s", DATA_RATE)
RATE_OF_DATA = Kind("a data rate", "11520 B/s", DATA_RATE)
RATE = Kind("a rate", "20 Hz", FREQUENCY)
PRICE = Kind("a price", "150 EUR", MONEY)
POWER_DRAW = Kind("a power", "5 W", POWER)
RATIO = Kind("a ratio", "70 %", DIMENSIONLESS)


def shown(text: str) -> str:
    """The text in double quotes, shortened to what fits in a message."""
    return f'"{text[:57]}..."' if len(text) > 60 else f'"{text}"'


def expectation(kind: Kind) -> str:
    """What a place asks for, in words: ``a duration such as "10 ms"``."""
    return f'{kind.noun} such as "{kind.example}"'


def units_of(dimension: Dimension) -> tuple[str, ...]:
    """The units of a dimension, in the table's order."""
    return tuple(unit for unit, (_, found) in UNITS.items() if found == dimension)


def unit_hint(unit: str, dimension: Dimension | None = None) -> str:
    """A hint that names the closest valid unit (of `dimension` if given), else the units of the dimension, else ""."""
    allowed = list(UNITS) if dimension is None else list(units_of(dimension))
    close = [_SLIPS[unit.lower()]] if unit.lower() in _SLIPS else []
    close += [known for known in allowed if known.lower() == unit.lower() and known not in close]
    close += [known for known in allowed if known.replace("bit", "b").lower() == unit.lower() and known not in close]
    close = [known for known in close if known in allowed and known != unit]
    if not close and _canonical(unit) not in UNITS:
        close = get_close_matches(unit, allowed, 1, 0.7)
    if close:
        return "did you mean " + " or ".join(f'"{known}"' for known in close) + "?"
    return f"units: {', '.join(allowed)}" if dimension is not None else ""


def parse_quantity(text: str) -> Quantity:
    """Read a number with an optional unit.

    Raises
    ------
    UnitError
        No number, one that is malformed, not finite or absurdly long, or a unit that cannot be one.

    Examples
    --------
    >>> parse_quantity("1.5 ms")
    Quantity(value=Fraction(3, 2000), dimension=Dimension(time=1, length=0, data=0, money=0, power=0), unit='ms')
    """
    found = _NUMBER.match(text.strip())
    if found is None:
        raise UnitError(f"expected a number with its unit, got {shown(text)}")
    unit = text.strip()[found.end() :].strip()
    if unit and (unit[0] in "0123456789._,+-/" or not unit.isprintable()):
        hint = "write decimals with a point" if unit[0] == "," else "digits are not grouped" if unit[0] == "_" else ""
        raise UnitError(f"malformed number {shown(text)}", hint)
    scale, dimension = UNITS.get(_canonical(unit), (Fraction(1), None if unit else DIMENSIONLESS))
    return Quantity(_number(found, text) * scale, dimension, unit)


def convert(quantity: Quantity, unit: str) -> Fraction:
    """The number of `unit`s in a quantity; the units must have one dimension, or be the same undeclared one."""
    if quantity.unit == unit and quantity.dimension is None:
        return quantity.value
    scale, dimension = UNITS.get(_canonical(unit), (Fraction(1), None))
    if dimension is None or quantity.dimension != dimension:
        raise UnitError(f'expected a quantity in "{unit}", got {shown(quantity.unit)}')
    return quantity.value / scale


def round_to_int(value: Fraction, rounding: Rounding) -> int:
    """An integer, in the named direction; `Rounding.EXACT` raises `UnitError` when there is none."""
    if rounding is Rounding.EXACT and value.denominator != 1:
        raise UnitError("not a whole number")
    return ceil(value) if rounding is Rounding.UP else floor(value)


def _canonical(unit: str) -> str:
    return "us" if unit in ("µs", "μs") else "um" if unit in ("µm", "μm") else unit


def _number(found: re.Match[str], text: str) -> Fraction:
    parts = found.groupdict(default="")
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


def _refuse(kind: Kind, text: str, hint: str = "") -> NoReturn:
    raise UnitError(f"expected {expectation(kind)}, got {shown(text)}", hint)


def _read(kind: Kind, text: str, *, positive: bool = False) -> Quantity:
    """A quantity of the kind, not negative; above zero when `positive`."""
    if not _NUMBER.match(text.strip()):
        _refuse(kind, text)
    quantity = parse_quantity(text)
    if quantity.dimension != kind.dimension:
        _refuse(kind, text, unit_hint(quantity.unit, kind.dimension))
    if quantity.value < 0 or (positive and quantity.value == 0):
        _refuse(kind, text, "it must be above zero" if positive else "it must not be negative")
    return quantity


def _round(kind: Kind, text: str, value: Fraction, rounding: Rounding, base: str) -> int:
    if rounding is Rounding.EXACT and value.denominator != 1:
        _refuse(kind, text, f"it must be a whole number of {base}")
    return round_to_int(value, rounding)


def parse_duration_ns(text: str, rounding: Rounding) -> int:
    """A duration in ns, at least 0.

    >>> parse_duration_ns("756.8 us", Rounding.UP)
    756800
    """
    return _round(DURATION, text, _read(DURATION, text).value * NS_PER_S, rounding, "ns")


def parse_period_ns(text: str) -> int:
    """A period in ns, above 0, converted exactly."""
    return _round(PERIOD, text, _read(PERIOD, text, positive=True).value * NS_PER_S, Rounding.EXACT, "ns")


def parse_time_range_ns(text: str) -> TimeRange:
    """``MIN .. MAX`` or one duration, in ns; the minimum rounds down and the maximum up.

    >>> parse_time_range_ns("1 .. 3 ms")
    TimeRange(min_ns=1000000, max_ns=3000000)
    """
    low, separator, high = (part.strip() for part in text.partition(".."))
    if not separator:
        value = _read(TIME_RANGE, text).value * NS_PER_S
        return TimeRange(floor(value), ceil(value))
    if "..." in text or ".." in high or not low or not high:
        _refuse(TIME_RANGE, text)
    greatest = _read(TIME_RANGE, high)
    number = _NUMBER.fullmatch(low)
    least = _read(TIME_RANGE, f"{low} {greatest.unit}" if number else low)
    if least.value > greatest.value:
        _refuse(TIME_RANGE, text, "the minimum is above the maximum")
    return TimeRange(floor(least.value * NS_PER_S), ceil(greatest.value * NS_PER_S))


def parse_size_bytes(text: str) -> int:
    """A data size in bytes, rounded up."""
    return _round(SIZE, text, _read(SIZE, text).value, Rounding.UP, "bytes")


def parse_bandwidth_bps(text: str) -> int:
    """A bandwidth in bit/s, rounded down, at least 1."""
    bandwidth_bps = _round(BANDWIDTH, text, _read(BANDWIDTH, text).value * 8, Rounding.DOWN, "bit/s")
    if not bandwidth_bps:
        _refuse(BANDWIDTH, text, "it must be at least 1 bit/s")
    return bandwidth_bps


def parse_data_rate(text: str) -> Fraction:
    """A data rate in B/s, exact, at least 0."""
    return _read(RATE_OF_DATA, text).value


def parse_rate_hz(text: str) -> Fraction:
    """A rate in Hz, exact, above 0."""
    return _read(RATE, text, positive=True).value


def parse_money(text: str) -> Money:
    """A price in cents, rounded up, with its currency."""
    quantity = _read(PRICE, text)
    return Money(_round(PRICE, text, quantity.value, Rounding.UP, "cents"), quantity.unit)


def parse_power_mw(text: str) -> int:
    """A power in mW, rounded up."""
    return _round(POWER_DRAW, text, _read(POWER_DRAW, text).value * 1000, Rounding.UP, "mW")


def parse_ratio(text: str) -> Fraction:
    """A ratio as an exact fraction of one; a plain number is not one."""
    quantity = _read(RATIO, text)
    if not quantity.unit:
        _refuse(RATIO, text, unit_hint("", DIMENSIONLESS))
    return quantity.value


def parse_total(text: str) -> Total:
    """A figure with any unit, both as written."""
    quantity = parse_quantity(text)
    if not quantity.unit:
        raise UnitError(f'expected a number with its unit such as "90 g", got {shown(text)}')
    scale, _ = UNITS.get(_canonical(quantity.unit), (Fraction(1), None))
    return Total(quantity.value / scale, quantity.unit)


def format_number(value: Fraction | int) -> str:
    """Exact text: a decimal where there is a finite one of reasonable length, else a fraction.

    >>> format_number(Fraction(13, 10)), format_number(Fraction(50, 3))
    ('1.3', '50/3')
    """
    value = Fraction(value)
    rest, places = value.denominator, 0
    for prime in (2, 5):
        power = 0
        while rest % prime == 0:
            rest, power = rest // prime, power + 1
        places = max(places, power)
    if rest != 1 or places > MAX_DIGITS // 2:
        return f"{value.numerator}/{value.denominator}"
    digits = str(abs(value.numerator) * 10**places // value.denominator).rjust(places + 1, "0")
    text = f"{digits[:-places]}.{digits[-places:]}" if places else digits
    return f"-{text}" if value < 0 else text


def _format(value: Fraction | int, *units: str) -> str:
    """Text in the first of `units` (largest first, value in the last) in which the number is at least 1."""
    base = UNITS[units[-1]][0]
    for unit in units:
        number = Fraction(value) * base / UNITS[unit][0]
        if abs(number) >= 1 or unit == units[-1]:
            return f"{format_number(number)} {unit}"
    raise AssertionError("no units")


def format_duration(value_ns: int) -> str:
    """A duration: ``10 ms``, ``756.8 us``, ``0 ns``."""
    return _format(value_ns, "s", "ms", "us", "ns")


def format_time_range(value: TimeRange) -> str:
    """A time range: ``243 us .. 1.3 ms``, or one duration when both are equal."""
    low, high = value
    return format_duration(low) if low == high else f"{format_duration(low)} .. {format_duration(high)}"


def format_size(size_bytes: int) -> str:
    """A data size in the largest unit that needs no decimals: ``1500 B``, ``2 KB``."""
    for unit in ("GB", "MB", "KB"):
        scale = int(UNITS[unit][0])
        if size_bytes and size_bytes % scale == 0:
            return f"{size_bytes // scale} {unit}"
    return f"{size_bytes} B"


def format_bandwidth(bandwidth_bps: int) -> str:
    """A bandwidth: ``125 kbit/s``."""
    return _format(bandwidth_bps, "Gbit/s", "Mbit/s", "kbit/s", "bit/s")


def format_data_rate(data_rate: Fraction) -> str:
    """A data rate given in B/s: ``11.52 KB/s``."""
    return _format(data_rate, "GB/s", "MB/s", "KB/s", "B/s")


def format_rate(rate_hz: Fraction) -> str:
    """A rate given in Hz: ``20 Hz``, ``50/3 Hz``."""
    return _format(rate_hz, "MHz", "kHz", "Hz")


def format_money(value: Money) -> str:
    """An amount: ``150 EUR``, ``99.90 EUR``."""
    whole, cents = divmod(abs(value.cents), 100)
    sign = "-" if value.cents < 0 else ""
    return f"{sign}{whole}.{cents:02} {value.currency}" if cents else f"{sign}{whole} {value.currency}"


def format_power(power_mw: int) -> str:
    """A power: ``500 mW``, ``5 W``."""
    return _format(power_mw, "kW", "W", "mW")


def format_ratio(ratio: Fraction) -> str:
    """A ratio in per cent: ``70 %``."""
    return f"{format_number(ratio * 100)} %"


def format_total(value: Total) -> str:
    """A declared total's figure: ``90 g``."""
    return f"{format_number(value.value)} {value.unit}"
