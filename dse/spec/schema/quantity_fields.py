"""The field types of the schema that are quantities: read with their unit, written back, and described to editors."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Annotated, Any, TypeAlias

from pydantic import WithJsonSchema

from dse.spec.schema.fields import T, describe, field_error
from dse.spec.schema.parts import ReadBy
from dse.support import units
from dse.support.units import QuantityKind, Rounding, UnitError

OFFSET_WORDS = ("any", "unknown")
"""Words in place of an offset: the search decides on the grid, or it is constant and nobody knows it."""


def _offset(value: Any) -> int | str:
    if value in OFFSET_WORDS:
        return str(value)
    hint = f"a duration such as {units.DURATION.example}, a list of them, any (the search decides) or unknown"
    if not isinstance(value, str):
        raise field_error(f"expected an offset, got {describe(value)}", hint)
    try:
        return units.parse_duration_ns(value, Rounding.EXACT)
    except UnitError as error:
        raise field_error(error.message, error.hint or hint) from None


def _write_offset(value: int | str) -> str:
    return value if isinstance(value, str) else units.format_duration(value)


_NUMBER = r"\+?([0-9]+/[0-9]+|([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?)"


def _text_of(kind: QuantityKind, parse: Callable[[str], T], write: Callable[[Any], str]) -> ReadBy:
    def read(value: Any) -> T:
        if not isinstance(value, str):
            raise field_error(f"expected {units.expectation(kind)}, got {describe(value)}")
        try:
            return parse(value)
        except UnitError as error:
            raise field_error(error.message, error.hint) from None

    return ReadBy(read, write)


def _unit_pattern(kind: QuantityKind) -> str:
    names = list(units.units_of(kind.dimension))
    names += [spelling for spelling, unit in units.SPELLINGS.items() if unit in names]
    return "(" + "|".join(names) + ")"


def _describe_quantity(kind: QuantityKind, *examples: str, pattern: str = "") -> WithJsonSchema:
    text = pattern or rf"^\s*{_NUMBER}\s*{_unit_pattern(kind)}\s*$"
    named = kind.noun.split(" ", 1)[1].capitalize()
    known = ", ".join(units.units_of(kind.dimension))
    return WithJsonSchema(
        {
            "type": "string",
            "pattern": text,
            "description": f"{named} with its unit: {known}.",
            "examples": [kind.example, *examples],
        }
    )


def _deadline_ns(text: str) -> int:
    """A time that there is for something: supply, which rounds down."""
    return units.parse_duration_ns(text, Rounding.DOWN)


def _demand_ns(text: str) -> int:
    """A time that something takes: demand, which rounds up."""
    return units.parse_duration_ns(text, Rounding.UP)


def _range_pattern(kind: QuantityKind) -> str:
    unit = _unit_pattern(kind)
    return rf"^\s*({_NUMBER}\s*{unit}|{_NUMBER}\s*{unit}?\s*\.\.\s*{_NUMBER}\s*{unit})\s*$"


_RANGE = _range_pattern(units.TIME_RANGE)


TOTAL = QuantityKind("a figure", "90 g", units.DIMENSIONLESS)


Duration: TypeAlias = Annotated[
    int,
    units.DURATION,
    _text_of(units.DURATION, _deadline_ns, units.format_duration),
    _describe_quantity(units.DURATION, "1.3 ms", "250 us"),
]


Demand: TypeAlias = Annotated[
    int,
    units.DURATION,
    _text_of(units.DURATION, _demand_ns, units.format_duration),
    _describe_quantity(units.DURATION, "5 us", "250 us"),
]


Offset: TypeAlias = Annotated[
    int | str,
    units.DURATION,
    ReadBy(_offset, _write_offset),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": rf"^\s*{_NUMBER}\s*{_unit_pattern(units.DURATION)}\s*$|^({'|'.join(OFFSET_WORDS)})$",
            "description": "When the first release is on its clock; the search decides (any), or it is not known.",
            "examples": ["3 ms", "any"],
        }
    ),
]


Period: TypeAlias = Annotated[
    int,
    units.PERIOD,
    _text_of(units.PERIOD, units.parse_period_ns, units.format_duration),
    _describe_quantity(units.PERIOD, "20 ms", "1 s"),
]


TimeRange: TypeAlias = Annotated[
    units.TimeRange,
    units.TIME_RANGE,
    _text_of(units.TIME_RANGE, units.parse_time_range_ns, units.format_time_range),
    _describe_quantity(units.TIME_RANGE, "10 ms", "1 .. 3 ms", pattern=_RANGE),
]


Transmission: TypeAlias = Annotated[
    units.TimeRange,
    units.TRANSMISSION,
    _text_of(units.TRANSMISSION, units.parse_transmission_ns, units.format_time_range),
    _describe_quantity(units.TRANSMISSION, "128 us", "100 ps .. 0.2 ns", pattern=_RANGE),
]


DataSize: TypeAlias = Annotated[
    int,
    units.SIZE,
    _text_of(units.SIZE, units.parse_size_bytes, units.format_size),
    _describe_quantity(units.SIZE, "2 KB", "64 KiB"),
]


SizeRange: TypeAlias = Annotated[
    units.SizeRange,
    _text_of(units.SIZE_RANGE, units.parse_size_range_bytes, units.format_size_range),
    _describe_quantity(units.SIZE_RANGE, "64 B .. 1500 B", pattern=_range_pattern(units.SIZE_RANGE)),
]


Bandwidth: TypeAlias = Annotated[
    int,
    units.BANDWIDTH,
    _text_of(units.BANDWIDTH, units.parse_bandwidth_bps, units.format_bandwidth),
    _describe_quantity(units.BANDWIDTH, "11520 B/s", "100 Mbit/s"),
]


DataRate: TypeAlias = Annotated[
    Fraction,
    units.RATE_OF_DATA,
    _text_of(units.RATE_OF_DATA, units.parse_data_rate, units.format_data_rate),
    _describe_quantity(units.RATE_OF_DATA, "3 kbit/s"),
]


Speed: TypeAlias = Annotated[
    Fraction,
    units.PROCESSOR_SPEED,
    _text_of(units.PROCESSOR_SPEED, units.parse_speed_mips, units.format_speed),
    _describe_quantity(units.PROCESSOR_SPEED, "1.2 GIPS"),
]


Instructions: TypeAlias = Annotated[
    Fraction,
    units.INSTRUCTIONS,
    _text_of(units.INSTRUCTIONS, units.parse_instructions, units.format_instructions),
    _describe_quantity(units.INSTRUCTIONS, "2 MIPD"),
]


Rate: TypeAlias = Annotated[
    Fraction,
    units.RATE,
    _text_of(units.RATE, units.parse_rate_hz, units.format_rate),
    _describe_quantity(units.RATE, "50/3 Hz", "1 kHz"),
]


Money: TypeAlias = Annotated[
    units.Money,
    units.PRICE,
    _text_of(units.PRICE, units.parse_money, units.format_money),
    _describe_quantity(units.PRICE, "99.90 EUR"),
]


Power: TypeAlias = Annotated[
    int,
    units.POWER_DRAW,
    _text_of(units.POWER_DRAW, units.parse_power_mw, units.format_power),
    _describe_quantity(units.POWER_DRAW, "500 mW"),
]


Total: TypeAlias = Annotated[
    units.Total,
    _text_of(TOTAL, units.parse_total, units.format_total),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": rf"^\s*-?{_NUMBER}\s*[^\s0-9].*$",
            "description": "A figure in the unit that `totals` declares, or another one of the same: kg where it is g.",
            "examples": ["90 g", "1.5 kg"],
        }
    ),
]
