"""Numbers with units, in exact coherent base units: ns, nm, byte, cent, mW (a data rate is byte per ns, and so on)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from math import ceil, floor

Dimension = tuple[tuple[str, int], ...]
"""Base unit and exponent, sorted; empty for a ratio."""

NS_PER_S = 10**9
TIME: Dimension = (("ns", 1),)
SIZE: Dimension = (("B", 1),)
DATA_RATE: Dimension = (("B", 1), ("ns", -1))
RATE: Dimension = (("ns", -1),)
MONEY: Dimension = (("ct", 1),)
POWER: Dimension = (("mW", 1),)
LENGTH: Dimension = (("nm", 1),)
SPEED: Dimension = (("nm", 1), ("ns", -1))
RATIO: Dimension = ()


def _units() -> dict[str, tuple[Fraction, Dimension]]:
    units: dict[str, tuple[Fraction, Dimension]] = {}
    units["ps"] = (Fraction(1, 1000), TIME)
    for name, factor in {
        "ns": 1,
        "us": 10**3,
        "µs": 10**3,
        "μs": 10**3,
        "ms": 10**6,
        "s": 10**9,
        "min": 60 * 10**9,
        "h": 3600 * 10**9,
    }.items():
        units[name] = (Fraction(factor), TIME)
    sizes = {
        "bit": Fraction(1, 8),
        "B": Fraction(1),
        "KB": Fraction(10**3),
        "MB": Fraction(10**6),
        "GB": Fraction(10**9),
        "KiB": Fraction(2**10),
        "MiB": Fraction(2**20),
        "GiB": Fraction(2**30),
    }
    for name, size in sizes.items():
        units[name] = (size, SIZE)
    for prefix, factor in {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}.items():
        bits = Fraction(factor, 8 * NS_PER_S)
        units[f"{prefix}bit/s"] = (bits, DATA_RATE)
        units[f"{prefix.upper()}bitsps"] = (bits, DATA_RATE)
        units[f"{prefix.upper()}B/s"] = (8 * bits, DATA_RATE)
        units[f"{prefix.upper()}Bytesps"] = (8 * bits, DATA_RATE)
    for name, factor in {"Hz": 1, "kHz": 10**3, "MHz": 10**6}.items():
        units[name] = (Fraction(factor, NS_PER_S), RATE)
    for name in ("EUR", "USD", "GBP", "CHF", "DKK", "SEK", "NOK"):
        units[name] = (Fraction(100), MONEY)
    for name, factor in {"mW": 1, "W": 10**3, "kW": 10**6}.items():
        units[name] = (Fraction(factor), POWER)
    units["%"] = (Fraction(1, 100), RATIO)
    units["ppm"] = (Fraction(1, 10**6), RATIO)
    for name, factor in {"nm": 1, "um": 10**3, "mm": 10**6, "cm": 10**7, "m": 10**9, "km": 10**12}.items():
        units[name] = (Fraction(factor), LENGTH)
    for name, speed in {
        "mm/s": Fraction(1, 1000),
        "cm/s": Fraction(1, 100),
        "m/s": Fraction(1),
        "km/h": Fraction(1000, 3600),
    }.items():
        units[name] = (speed, SPEED)
    return units


UNITS = _units()
NUMBER = r"[+-]?(?:\d+/\d+|\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({NUMBER})\s*(.*?)\s*$")


@dataclass(frozen=True)
class Quantity:
    """An exact value in coherent base units."""

    value: Fraction
    dimension: Dimension


@cache
def quantity(text: str) -> Quantity | None:
    """The quantity that a text states, or None: ``"10 ms"`` is 10 000 000 ns."""
    match = _QUANTITY.match(text)
    if match is None:
        return None
    number, unit = Fraction(match[1]), match[2]
    if not unit:
        return Quantity(number, RATIO)
    if unit not in UNITS:
        return None
    factor, dimension = UNITS[unit]
    return Quantity(number * factor, dimension)


@cache
def exact(text: str, dimension: Dimension) -> Fraction:
    """The value of a text that must have the given dimension."""
    found = quantity(text)
    if found is None or found.dimension != dimension:
        raise ValueError(f"{text!r} is not a quantity of dimension {dimension}")
    return found.value


@cache
def time_range(text: str) -> tuple[int, int]:
    """``MIN .. MAX`` or one duration, in whole ns: the minimum rounded down, the maximum rounded up."""
    low, _, high = text.partition("..")
    best, worst = floor(exact(low, TIME)), ceil(exact(high or low, TIME))
    if best > worst:
        raise ValueError(f"{text!r}: the minimum exceeds the maximum")
    return best, worst


@cache
def transmission(text: str) -> tuple[Fraction, Fraction]:
    """``MIN .. MAX`` or one duration of a message or a byte, in ns, exact."""
    low, _, high = text.partition("..")
    best, worst = exact(low, TIME), exact(high or low, TIME)
    if best > worst:
        raise ValueError(f"{text!r}: the minimum exceeds the maximum")
    return best, worst


@cache
def period(text: str) -> int:
    """A period in ns; it must convert exactly."""
    value = exact(text, TIME)
    if value.denominator != 1 or value <= 0:
        raise ValueError(f"{text!r} is no period")
    return int(value)


@cache
def duration(text: str) -> int:
    """A duration in whole ns, rounded up."""
    return ceil(exact(text, TIME))


@cache
def deadline(text: str) -> int:
    """A deadline in whole ns, rounded down: it is a supply."""
    return floor(exact(text, TIME))


@cache
def size(text: str) -> int:
    """Bytes, rounded up (a demand)."""
    return ceil(exact(text, SIZE))


@cache
def bandwidth(text: str) -> Fraction:
    """Bytes per second of a supply: whole bits per second, rounded down."""
    return Fraction(floor(exact(text, DATA_RATE) * NS_PER_S * 8), 8)


@cache
def data_rate(text: str) -> Fraction:
    """Bytes per second of a demand, exact."""
    return exact(text, DATA_RATE) * NS_PER_S


@cache
def rate(text: str) -> Fraction:
    """Events per second, exact."""
    return exact(text, RATE) * NS_PER_S


@cache
def price(text: str) -> int:
    """Cents, rounded up."""
    return ceil(exact(text, MONEY))


@cache
def power(text: str) -> int:
    """Milliwatts, rounded up."""
    return ceil(exact(text, POWER))


@cache
def figure(text: str, unit: str) -> Fraction:
    """The number of a declared total, which must be stated in its declared unit."""
    match = _QUANTITY.match(text)
    if match is None or match[2] != unit:
        raise ValueError(f"{text!r} is not a number of {unit}")
    return Fraction(match[1])


def multiply(left: Dimension, right: Dimension, sign: int = 1) -> Dimension:
    """The dimension of a product, or of a quotient with sign -1."""
    powers = dict(left)
    for unit, exponent in right:
        powers[unit] = powers.get(unit, 0) + sign * exponent
    return tuple(sorted((unit, exponent) for unit, exponent in powers.items() if exponent))


def per_second(value: Fraction, dimension: Dimension) -> Fraction:
    """From coherent units to those of results: data rates and rates per second instead of per ns."""
    return value * NS_PER_S if dimension in (DATA_RATE, RATE) else value
