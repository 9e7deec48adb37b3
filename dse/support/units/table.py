"""The closed table of units, the dimensions they measure, and what to say when a text is not one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import NamedTuple

from dse.support.errors import nearest
from dse.support.units.exact import Exact


class UnitError(ValueError):
    """A text is not the quantity that its place asks for; `hint` names the closest valid form.

    Caught where the place in the file is known, and shown with it.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        self.message = message
        self.hint = hint
        super().__init__(f"{message} ({hint})" if hint else message)


class Dimension(NamedTuple):
    """Exponents of the base dimensions.

    Seconds, metres, bytes, units of money, watts and instructions; two quantities can be compared when their dimensions
    are equal.
    """

    time: int = 0
    length: int = 0
    data: int = 0
    money: int = 0
    power: int = 0
    work: int = 0

    def times(self, other: Dimension) -> Dimension:
        """Dimension of a product."""
        return Dimension(*(a + b for a, b in zip(self, other, strict=True)))

    def over(self, other: Dimension) -> Dimension:
        """Dimension of a quotient."""
        return Dimension(*(a - b for a, b in zip(self, other, strict=True)))


BASES = ("s", "m", "B", "ct", "W", "instructions")
"""The coherent unit of each base dimension, in the order of the fields of `Dimension`."""
DIMENSIONLESS = Dimension()
TIME = Dimension(time=1)
LENGTH = Dimension(length=1)
DATA = Dimension(data=1)
MONEY = Dimension(money=1)
POWER = Dimension(power=1)
WORK = Dimension(work=1)
FREQUENCY = DIMENSIONLESS.over(TIME)
DATA_RATE = DATA.over(TIME)
SPEED = LENGTH.over(TIME)
PROCESSING = WORK.over(TIME)


class Rounding(Enum):
    """Direction in which a value becomes an integer; there is no default.

    Times, sizes and prices that are needed round up; times and bandwidths that are available round down.
    """

    DOWN = "down"
    UP = "up"
    EXACT = "exact"


@dataclass(frozen=True)
class Quantity:
    """A number with its unit.

    `value` is in coherent units (s, m, B, ct, W, instructions); when `dimension` is None the unit is not in the
    table and `value` is as written. `unit` is as written, "" for a plain number.
    """

    value: Fraction
    dimension: Dimension | None
    unit: str


class TimeRange(NamedTuple):
    """Least and greatest duration, in ns; whole ones except for what messages take (see `TRANSMISSION`)."""

    min_ns: Exact
    max_ns: Exact


class SizeRange(NamedTuple):
    """Least and greatest data size, in bytes."""

    min_bytes: int
    max_bytes: int


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


_PICO, _NANO, _MICRO, _MILLI = (Fraction(1, 10**power) for power in (12, 9, 6, 3))
_BIT = Fraction(1, 8)
_PREFIXES = (("", 1), ("k", 10**3), ("M", 10**6), ("G", 10**9), ("T", 10**12))

CURRENCIES = ("EUR", "USD", "GBP", "CHF", "DKK", "SEK", "NOK")
UNITS: dict[str, tuple[Fraction, Dimension]] = {
    **_scaled(TIME, {"ps": _PICO, "ns": _NANO, "us": _MICRO, "ms": _MILLI, "s": 1, "min": 60, "h": 3600}),
    **_scaled(DATA, {f"{prefix}bit": _BIT * factor for prefix, factor in _PREFIXES[:-1]}),
    **_scaled(DATA, {f"{prefix.upper()}B": factor for prefix, factor in _PREFIXES}),
    **_scaled(DATA, {"KiB": 2**10, "MiB": 2**20, "GiB": 2**30, "TiB": 2**40}),
    **_scaled(DATA_RATE, {f"{prefix}bit/s": _BIT * factor for prefix, factor in _PREFIXES}),
    **_scaled(DATA_RATE, {f"{prefix.upper()}B/s": factor for prefix, factor in _PREFIXES}),
    **_scaled(DATA_RATE, {f"{prefix.upper()}bitsps": _BIT * factor for prefix, factor in _PREFIXES}),
    **_scaled(DATA_RATE, {f"{prefix.upper()}Bytesps": factor for prefix, factor in _PREFIXES}),
    **_scaled(FREQUENCY, {"Hz": 1, "kHz": 10**3, "MHz": 10**6, "GHz": 10**9}),
    **_scaled(MONEY, dict.fromkeys(CURRENCIES, 100)),
    **_scaled(POWER, {"uW": _MICRO, "mW": _MILLI, "W": 1, "kW": 1000, "MW": 10**6}),
    **_scaled(DIMENSIONLESS, {"%": Fraction(1, 100), "ppm": _MICRO}),
    **_scaled(LENGTH, {"nm": _NANO, "um": _MICRO, "mm": _MILLI, "cm": Fraction(1, 100), "m": 1, "km": 1000}),
    **_scaled(SPEED, {"mm/s": _MILLI, "cm/s": Fraction(1, 100), "m/s": 1, "km/h": Fraction(1000, 3600)}),
    **_scaled(WORK, {"IPD": 1, "KIPD": 10**3, "MIPD": 10**6, "GIPD": 10**9}),
    **_scaled(PROCESSING, {"KIPS": 10**3, "MIPS": 10**6, "GIPS": 10**9}),
}
SPELLINGS = {
    "µs": "us", "μs": "us", "µm": "um", "μm": "um", "µW": "uW", "μW": "uW", "kB": "KB", "kB/s": "KB/s",
}  # fmt: skip
"""Other spellings that are taken: the micro sign, of which there are two, and the k of SI before bytes."""
_SI = frozenset(
    {
        "g", "m", "s", "A", "K", "mol", "cd", "Hz", "N", "Pa", "J", "W", "Wh", "V", "VA", "var", "F", "Ohm", "Ω", "S",
        "Wb", "T", "H", "lm", "lx", "Bq", "Gy", "Sv", "kat", "l", "L", "eV", "Ah", "bar", "t", "bit",
    }
)  # fmt: skip
"""Units of SI and beside it, to which any of its prefixes may be put."""
_FACTORS: Mapping[str, Fraction | int] = {
    "": 1, "f": Fraction(1, 10**15), "p": _PICO, "n": _NANO, "u": _MICRO, "µ": _MICRO, "μ": _MICRO, "m": _MILLI,
    "c": Fraction(1, 100), "d": Fraction(1, 10), "h": 100, "k": 1000, "M": 10**6, "G": 10**9, "T": 10**12, "P": 10**15,
}  # fmt: skip
_COMMON = "kMGT"
MOST_SYMBOL = 3
"""Words of more letters than this may have a prefix before them: GOPS is 10^9 OPS, but "Mod" no million of "od"."""
_SLIPS = {
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "millisecond": "ms", "milliseconds": "ms",
    "usec": "us", "microsecond": "us", "microseconds": "us", "nsec": "ns", "nanosecond": "ns", "nanoseconds": "ns",
    "psec": "ps", "picosecond": "ps", "picoseconds": "ps",
    "minute": "min", "minutes": "min", "hour": "h", "hours": "h", "hr": "h", "byte": "B", "bytes": "B", "bits": "bit",
    "bps": "bit/s", "kbps": "kbit/s", "mbps": "Mbit/s", "gbps": "Gbit/s", "hertz": "Hz", "€": "EUR", "euro": "EUR",
    "euros": "EUR", "$": "USD", "£": "GBP", "watt": "W", "watts": "W", "percent": "%",
}  # fmt: skip


class QuantityKind(NamedTuple):
    """The kind of quantity that a place in the file asks for.

    Used to check a value and for the message where it does not fit.
    """

    noun: str
    example: str
    dimension: Dimension


DURATION = QuantityKind("a duration", "10 ms", TIME)
PERIOD = QuantityKind("a period", "10 ms", TIME)
TIME_RANGE = QuantityKind("a time range", "243 us .. 1.3 ms", TIME)
TRANSMISSION = QuantityKind("a time range", "87 ns .. 95.5 ns", TIME)
"""The time for a message or a byte of it: bytes are many, so that these times are kept exactly, however fine."""
SIZE = QuantityKind("a data size", "30 B", DATA)
SIZE_RANGE = QuantityKind("a range of data sizes", "1 B .. 3 KB", DATA)
BANDWIDTH = QuantityKind("a bandwidth", "125 kbit/s", DATA_RATE)
RATE_OF_DATA = QuantityKind("a data rate", "11520 B/s", DATA_RATE)
RATE = QuantityKind("a rate", "20 Hz", FREQUENCY)
PRICE = QuantityKind("a price", "150 EUR", MONEY)
POWER_DRAW = QuantityKind("a power", "5 W", POWER)
PROCESSOR_SPEED = QuantityKind("a processor speed", "100 MIPS", PROCESSING)
INSTRUCTIONS = QuantityKind("a number of instructions", "250 KIPD", WORK)
RATIO = QuantityKind("a ratio", "70 %", DIMENSIONLESS)


def shown(text: str) -> str:
    """The text in double quotes, shortened to what fits in a message.

    At most 60 characters of the text.
    """
    return f'"{text[:57]}..."' if len(text) > 60 else f'"{text}"'


def expectation(kind: QuantityKind) -> str:
    """The words for the quantity that a place asks for: ``a duration such as "10 ms"``."""
    return f'{kind.noun} such as "{kind.example}"'


def units_of(dimension: Dimension) -> tuple[str, ...]:
    """The units of a dimension, in the table's order."""
    return tuple(unit for unit, (_, of_unit) in UNITS.items() if of_unit == dimension)


def unit_hint(unit: str, dimension: Dimension | None = None) -> str:
    """A hint that names the closest valid unit (of `dimension` if given), else the units of the dimension, else "".

    Slips such as ``mS`` and ``Mb/s`` have their meaning in a table; other units are matched by similarity.
    """
    allowed = list(UNITS) if dimension is None else list(units_of(dimension))
    close = [_SLIPS[unit.lower()]] if unit.lower() in _SLIPS else []
    close += [known for known in allowed if known.lower() == unit.lower() and known not in close]
    close += [known for known in allowed if known.replace("bit", "b").lower() == unit.lower() and known not in close]
    close = [known for known in close if known in allowed and known != unit]
    if not close and canonical_unit(unit) not in UNITS:
        close = list(filter(None, [nearest(unit, allowed, 0.7)]))
    if close:
        return "did you mean " + " or ".join(f'"{known}"' for known in close) + "?"
    return f"units: {', '.join(allowed)}" if dimension is not None else ""


def canonical_unit(unit: str) -> str:
    """The unit as the table has it: see `SPELLINGS`."""
    return SPELLINGS.get(unit, unit)


def unit_ratio(unit: str, base: str) -> Fraction | None:
    """The ratio of `unit` to `base`; None where they do not measure the same, or nothing says so.

    Units of the table count as they do there (amounts of money as their own currency only); others where they differ
    in their SI prefix.

    >>> unit_ratio("kg", "g"), unit_ratio("TOPS", "GOPS"), unit_ratio("cm", "mm"), unit_ratio("g", "EUR")
    (Fraction(1000, 1), Fraction(1000, 1), Fraction(10, 1), None)
    """
    own, wanted = canonical_unit(unit), canonical_unit(base)
    if own == wanted:
        return Fraction(1)
    if own in UNITS or wanted in UNITS:
        scale, dimension = UNITS.get(own, (Fraction(1), None))
        other, wanted_dimension = UNITS.get(wanted, (Fraction(1), None))
        return None if dimension in (None, MONEY) or dimension != wanted_dimension else scale / other
    ours, theirs = _split(own), _split(wanted)
    common = [name for name in ours if name in theirs]
    return ours[common[0]] / theirs[common[0]] if common else None


def _split(unit: str) -> dict[str, Fraction]:
    """The units that a unit may be a multiple of, with the factors; units outside SI have the common prefixes only."""
    known = {unit: Fraction(1)} if unit in _SI else {}
    for prefix, factor in _FACTORS.items():
        if prefix and unit.startswith(prefix) and unit[len(prefix) :] in _SI:
            known[unit[len(prefix) :]] = Fraction(factor)
    if known:
        return known
    powers = {unit: Fraction(1)}
    if unit[:1] in _COMMON and len(unit) > MOST_SYMBOL and unit.isalpha():
        powers[unit[1:]] = Fraction(_FACTORS[unit[0]])
    return powers
