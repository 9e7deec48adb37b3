"""Exact numbers to canonical text, which reads back as the same value."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache, lru_cache
from math import ceil

from dse.support.units.exact import Exact
from dse.support.units.table import UNITS, Money, SizeRange, TimeRange, Total

MAX_PLACES = 20
LONGEST = 400
"""The most digits that a numerator or a denominator is written with."""
DECIMALS = 15
_TOO_LONG = 10**LONGEST


def writable(value: Exact) -> Exact:
    """The value; rounded up to `DECIMALS` decimals where its numerator or denominator has more than `LONGEST` digits.

    Sums over many different periods have such denominators, which are unreadable; Python refuses to write the longest.
    """
    if max(abs(value.numerator), value.denominator) < _TOO_LONG:
        return value
    return Fraction(ceil(value * 10**DECIMALS), 10**DECIMALS)


def format_number(value: Fraction | int) -> str:
    """Exact text: a decimal where there is a finite one of reasonable length, else a fraction; see `writable`.

    >>> format_number(Fraction(13, 10)), format_number(Fraction(50, 3))
    ('1.3', '50/3')
    """
    value = Fraction(writable(value))
    rest, places = value.denominator, 0
    for prime in (2, 5):
        power = 0
        while rest % prime == 0:
            rest, power = rest // prime, power + 1
        places = max(places, power)
    if rest != 1 or places > MAX_PLACES:
        return f"{value.numerator}/{value.denominator}"
    digits = str(abs(value.numerator) * 10**places // value.denominator).rjust(places + 1, "0")
    text = f"{digits[:-places]}.{digits[-places:]}" if places else digits
    return f"-{text}" if value < 0 else text


def _format(value: Fraction | int, *units: str) -> str:
    """Text in the first of `units` (largest first, value in the last) in which the number is at least 1."""
    number = Fraction(value)
    return _in_units(number.numerator, number.denominator, units)


@lru_cache(maxsize=4096)
def _in_units(numerator: int, denominator: int, units: tuple[str, ...]) -> str:
    """A fraction as `_format` writes it; most figures of a large problem occur many times."""
    sizes = _sizes(units)
    unit, size = next(((unit, size) for unit, size in sizes if abs(numerator) >= size * denominator), sizes[-1])
    return f"{format_number(Fraction(numerator, denominator * size))} {unit}"


@cache
def _sizes(units: tuple[str, ...]) -> tuple[tuple[str, int], ...]:
    """How many of the last unit each is: whole numbers."""
    sizes = [UNITS[unit][0] / UNITS[units[-1]][0] for unit in units]
    assert all(size.denominator == 1 for size in sizes)
    return tuple((unit, int(size)) for unit, size in zip(units, sizes, strict=True))


def format_duration(value_ns: Exact) -> str:
    """A duration: ``10 ms``, ``756.8 us``, ``0.1 ns``, ``0 ns``.

    In the largest unit of which there is at least one; what is no decimal number is a fraction, such as ``1/3 ns``.
    """
    return _format(value_ns, "s", "ms", "us", "ns")


def format_time_range(value: TimeRange) -> str:
    """A time range: ``243 us .. 1.3 ms``, or one duration when both are equal.

    Both ends exactly, each in its own unit.
    """
    low, high = value
    return format_duration(low) if low == high else f"{format_duration(low)} .. {format_duration(high)}"


def format_size(size_bytes: int) -> str:
    """A data size in the largest unit that needs no decimals: ``1500 B``, ``2 KB``."""
    for unit in ("GB", "MB", "KB"):
        scale = int(UNITS[unit][0])
        if size_bytes and size_bytes % scale == 0:
            return f"{size_bytes // scale} {unit}"
    return f"{size_bytes} B"


def format_size_range(value: SizeRange) -> str:
    """A range of data sizes: ``100 B .. 3 KB``, or one size when both are equal."""
    low, high = value
    return format_size(low) if low == high else f"{format_size(low)} .. {format_size(high)}"


def format_bandwidth(bandwidth_bps: int) -> str:
    """A bandwidth: ``125 kbit/s``."""
    return _format(bandwidth_bps, "Gbit/s", "Mbit/s", "kbit/s", "bit/s")


def format_data_rate(data_rate: Fraction) -> str:
    """A data rate given in B/s: ``11.52 KB/s``."""
    return _format(data_rate, "GB/s", "MB/s", "KB/s", "B/s")


def format_speed(speed_mips: Fraction) -> str:
    """The speed of a processor given in million instructions a second: ``1.2 MIPS``."""
    return _format(speed_mips * 1000, "GIPS", "MIPS", "KIPS")


def format_instructions(count: Fraction) -> str:
    """A number of instructions for each dispatch: ``250 KIPD``."""
    return _format(count, "GIPD", "MIPD", "KIPD", "IPD")


def format_rate(rate_hz: Fraction) -> str:
    """A rate given in Hz: ``20 Hz``, ``50/3 Hz``."""
    return _format(rate_hz, "MHz", "kHz", "Hz")


def format_money(value: Money) -> str:
    """An amount: ``150 EUR``, ``99.90 EUR``.

    With cents only where they are not 0.
    """
    whole, cents = divmod(abs(int(value.cents)), 100)
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


def format_count(count: int) -> str:
    """A count: in full, or from a million billions on by its power of ten.

    >>> format_count(9600), format_count(3 * 10**20)
    ('9 600', 'about 10^20')
    """
    return f"{count:,}".replace(",", " ") if count < 10**15 else f"about 10^{len(str(count)) - 1}"


def first_of(items: Sequence[str], most: int, aside: str = "", join: str = ", ") -> str:
    """The first `most` items of a list with commas, and the number of the others; `aside` says where these are.

    >>> first_of(["a", "b", "c"], 2), first_of(["a", "b"], 2), first_of(["a", "b", "c"], 1, " (--all)")
    ('a, b and 1 more', 'a, b', 'a and 2 more (--all)')
    """
    left = len(items) - most
    return join.join(items[:most]) + (f" and {left} more{aside}" if left > 0 else "")


class Hexadecimal(int):
    """A whole number that is written in hexadecimal where the format of a file has both forms.

    >>> f"{Hexadecimal(513)}", Hexadecimal(513) == 513
    ('0x201', True)
    """

    def __format__(self, form: str) -> str:
        """The number in `form`; in hexadecimal where none is stated."""
        return super().__format__(form or "#x")


def count_words(count: int, noun: str) -> str:
    """A count and what is counted.

    >>> count_words(9600, "design"), count_words(1, "design")
    ('9 600 designs', '1 design')
    """
    return f"{format_count(count)} {noun}{'' if count == 1 else 's'}"
