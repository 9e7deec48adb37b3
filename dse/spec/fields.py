"""The field types of the schema: how one value of the file is read, checked, written back and described to editors.

Values are integers or exact fractions from here on; `dse.units` knows the units and the rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Annotated, Any, TypeAlias, TypeVar

from pydantic import (
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainSerializer,
    PlainValidator,
    ValidationError,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

from dse import units
from dse.importers.ros_messages import LONGEST
from dse.units import Kind, Rounding, UnitError

T = TypeVar("T")
MAX_NAME = 200
MAX_LINE = 10_000


def field_error(message: str, hint: str = "") -> PydanticCustomError:
    """An error in the user's words, for a pydantic validator to raise; `dse.spec.load` takes message and hint back."""
    return PydanticCustomError("dse", "{message}", {"message": message, "hint": hint})


def describe(value: Any) -> str:
    """What the file holds in a place, in words: ``10``, ``"text"``, ``a list``, ``nothing``."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return units.shown(value)
    if isinstance(value, dict):
        return "a mapping"
    return "a list" if isinstance(value, list | tuple) else str(value)


# --- text ---------------------------------------------------------------------------------------------------------


def _text(value: Any, noun: str, limit: int) -> str:
    if not isinstance(value, str):
        hint = "put it in quotes" if isinstance(value, int | float) else ""
        raise field_error(f"expected {noun}, got {describe(value)}", hint)
    if not value.strip():
        raise field_error(f"expected {noun}, got an empty text")
    if len(value.splitlines()) > 1 or not value.isprintable():
        raise field_error(f"expected {noun} without line breaks, tabs or control characters")
    if len(value) > limit:
        raise field_error(f"expected {noun} of at most {limit} characters, got {len(value)}")
    return value.strip()


def _line(value: Any) -> str:
    return _text(value, "text", MAX_LINE)


def _name(value: Any) -> str:
    name = _text(value, "a name", MAX_NAME)
    if name == "none":
        raise field_error('the name "none" is reserved', 'for a slot that may stay empty write "optional: true"')
    return name


Line: TypeAlias = Annotated[
    str,
    PlainValidator(_line),
    WithJsonSchema({"type": "string", "minLength": 1, "maxLength": MAX_LINE, "pattern": r"^[^\r\n]*$"}),
]
Name: TypeAlias = Annotated[
    str,
    PlainValidator(_name),
    WithJsonSchema(
        {
            "type": "string",
            "minLength": 1,
            "maxLength": MAX_NAME,
            "pattern": r"^[^\r\n]*$",
            "not": {"const": "none"},
            "description": 'A name: any text without line breaks but "none".',
        }
    ),
]

# --- numbers ------------------------------------------------------------------------------------------------------


CORE_RULES = ("any", "first_fit")
"""What may stand where a core does: the search decides, or first-fit by decreasing utilisation."""


PRIORITY_RULES = ("rate_monotonic", "deadline_monotonic")
"""What orders a thread that has no priority of its own: the time between its jobs, or its deadline."""
ANY_PRIORITY = "any"
"""Asks for the best order."""


def _count(least: int, most: int | None = None) -> Callable[[Any], int]:
    def read(value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or value < least:
            raise field_error(f"expected a whole number of at least {least}, got {describe(value)}")
        if most is not None and value > most:
            raise field_error(f"expected a whole number of at most {most:,}, got {describe(value)}")
        return value

    return read


def _core(value: Any) -> int | str:
    if isinstance(value, str):
        return value
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        hint = "a core from 1 or a group of cores, a list of these, any (the search decides) or first_fit"
        raise field_error(f"expected a core, got {describe(value)}", hint)
    return value


def _priority(value: Any) -> int | str:
    if value == ANY_PRIORITY or value in PRIORITY_RULES:
        return str(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        hint = f"a number (a larger one is more urgent), a list of numbers, {', '.join(PRIORITY_RULES)} or any"
        raise field_error(f"expected a priority, got {describe(value)}", hint)
    return value


OFFSET_WORDS = ("any", "unknown")
"""What may stand where an offset does: the search decides on the grid, or it is constant and nobody knows it."""


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


def _setting(value: Any) -> str | int:
    if isinstance(value, bool) or not isinstance(value, str | int):
        raise field_error(f"expected one option, got {describe(value)}")
    return _line(value) if isinstance(value, str) else value


def _version(value: Any) -> int:
    if value != 1 or not isinstance(value, int) or isinstance(value, bool):
        raise field_error(f"expected 1, got {describe(value)}", "the version of this format")
    return value


Version: TypeAlias = Annotated[int, PlainValidator(_version), WithJsonSchema({"const": 1})]
Count: TypeAlias = Annotated[int, PlainValidator(_count(1)), WithJsonSchema({"type": "integer", "minimum": 1})]
MOST_CORES = 1024
"""The most cores of one processor."""
Cores: TypeAlias = Annotated[
    int,
    PlainValidator(_count(1, MOST_CORES)),
    WithJsonSchema({"type": "integer", "minimum": 1, "maximum": MOST_CORES}),
]
Core: TypeAlias = Annotated[
    int | str,
    PlainValidator(_core),
    WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 1}, {"type": "string"}]}),
]
Priority: TypeAlias = Annotated[
    int | str,
    PlainValidator(_priority),
    WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 0}, {"enum": [*PRIORITY_RULES, ANY_PRIORITY]}]}),
]
QueueSize: TypeAlias = Annotated[int, PlainValidator(_count(0)), WithJsonSchema({"type": "integer", "minimum": 0})]
Length: TypeAlias = Annotated[
    int,
    PlainValidator(_count(0, LONGEST)),
    WithJsonSchema({"type": "integer", "minimum": 0, "maximum": LONGEST}),
]
Weight: TypeAlias = Annotated[
    int,
    PlainValidator(_count(0)),
    WithJsonSchema({"type": "integer", "minimum": 0, "description": "What changing the decision costs, in any unit."}),
]
Setting: TypeAlias = Annotated[
    str | int,
    PlainValidator(_setting),
    WithJsonSchema({"type": ["string", "integer"], "description": "The option that the baseline has."}),
]

# --- quantities ---------------------------------------------------------------------------------------------------

_NUMBER = r"\+?([0-9]+/[0-9]+|([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?)"


def _reader(kind: Kind, parse: Callable[[str], T]) -> PlainValidator:
    def read(value: Any) -> T:
        if not isinstance(value, str):
            raise field_error(f"expected {units.expectation(kind)}, got {describe(value)}")
        try:
            return parse(value)
        except UnitError as error:
            raise field_error(error.message, error.hint) from None

    return PlainValidator(read)


def _unit_pattern(kind: Kind) -> str:
    names = list(units.units_of(kind.dimension))
    names += [spelling for spelling, unit in units.SPELLINGS.items() if unit in names]
    return "(" + "|".join(names) + ")"


def _describe_quantity(kind: Kind, *examples: str, pattern: str = "") -> WithJsonSchema:
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


def _writer(write: Callable[[Any], str]) -> PlainSerializer:
    return PlainSerializer(write, return_type=str, when_used="json")


def _deadline_ns(text: str) -> int:
    """A time that there is for something: supply, which rounds down."""
    return units.parse_duration_ns(text, Rounding.DOWN)


def _demand_ns(text: str) -> int:
    """A time that something takes: demand, which rounds up."""
    return units.parse_duration_ns(text, Rounding.UP)


_RANGE = (
    rf"^\s*({_NUMBER}\s*{_unit_pattern(units.TIME_RANGE)}"
    rf"|{_NUMBER}\s*{_unit_pattern(units.TIME_RANGE)}?\s*\.\.\s*{_NUMBER}\s*{_unit_pattern(units.TIME_RANGE)})\s*$"
)
_TOTAL = Kind("a figure", "90 g", units.DIMENSIONLESS)

Duration: TypeAlias = Annotated[
    int,
    _reader(units.DURATION, _deadline_ns),
    _writer(units.format_duration),
    _describe_quantity(units.DURATION, "1.3 ms", "250 us"),
]
Demand: TypeAlias = Annotated[
    int,
    _reader(units.DURATION, _demand_ns),
    _writer(units.format_duration),
    _describe_quantity(units.DURATION, "5 us", "250 us"),
]
Offset: TypeAlias = Annotated[
    int | str,
    PlainValidator(_offset),
    _writer(_write_offset),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": rf"^\s*{_NUMBER}\s*{_unit_pattern(units.DURATION)}\s*$|^({'|'.join(OFFSET_WORDS)})$",
            "description": "When the first release is on its clock; the search decides (any), or nobody knows.",
            "examples": ["3 ms", "any"],
        }
    ),
]
Period: TypeAlias = Annotated[
    int,
    _reader(units.PERIOD, units.parse_period_ns),
    _writer(units.format_duration),
    _describe_quantity(units.PERIOD, "20 ms", "1 s"),
]
TimeRange: TypeAlias = Annotated[
    units.TimeRange,
    _reader(units.TIME_RANGE, units.parse_time_range_ns),
    _writer(units.format_time_range),
    _describe_quantity(units.TIME_RANGE, "10 ms", "1 .. 3 ms", pattern=_RANGE),
]
Transmission: TypeAlias = Annotated[
    units.TimeRange,
    _reader(units.TRANSMISSION, units.parse_transmission_ns),
    _writer(units.format_time_range),
    _describe_quantity(units.TRANSMISSION, "128 us", "100 ps .. 0.2 ns", pattern=_RANGE),
]
DataSize: TypeAlias = Annotated[
    int,
    _reader(units.SIZE, units.parse_size_bytes),
    _writer(units.format_size),
    _describe_quantity(units.SIZE, "2 KB", "64 KiB"),
]
Bandwidth: TypeAlias = Annotated[
    int,
    _reader(units.BANDWIDTH, units.parse_bandwidth_bps),
    _writer(units.format_bandwidth),
    _describe_quantity(units.BANDWIDTH, "11520 B/s", "100 Mbit/s"),
]
DataRate: TypeAlias = Annotated[
    Fraction,
    _reader(units.RATE_OF_DATA, units.parse_data_rate),
    _writer(units.format_data_rate),
    _describe_quantity(units.RATE_OF_DATA, "3 kbit/s"),
]
Rate: TypeAlias = Annotated[
    Fraction,
    _reader(units.RATE, units.parse_rate_hz),
    _writer(units.format_rate),
    _describe_quantity(units.RATE, "50/3 Hz", "1 kHz"),
]
Money: TypeAlias = Annotated[
    units.Money,
    _reader(units.PRICE, units.parse_money),
    _writer(units.format_money),
    _describe_quantity(units.PRICE, "99.90 EUR"),
]
Power: TypeAlias = Annotated[
    int,
    _reader(units.POWER_DRAW, units.parse_power_mw),
    _writer(units.format_power),
    _describe_quantity(units.POWER_DRAW, "500 mW"),
]
Total: TypeAlias = Annotated[
    units.Total,
    _reader(_TOTAL, units.parse_total),
    _writer(units.format_total),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": rf"^\s*-?{_NUMBER}\s*[^\s0-9].*$",
            "description": "A figure in the unit that `totals` declares, or another one of the same: kg where it is g.",
            "examples": ["90 g", "1.5 kg"],
        }
    ),
]

# --- lists --------------------------------------------------------------------------------------------------------


def _one_or_list(value: Any) -> Any:
    if isinstance(value, list | tuple):
        if not value:
            raise field_error("expected at least one option, got an empty list")
        return tuple(value)
    return (value,)


def _distinct(values: tuple[T, ...]) -> tuple[T, ...]:
    first: dict[T, int] = {}
    repeated = [at for at, value in enumerate(values) if first.setdefault(value, at) != at]
    if not repeated:
        return values
    errors = [InitErrorDetails(type=field_error("option given twice"), loc=(at,), input=values[at]) for at in repeated]
    raise ValidationError.from_exception_data("options", errors)


class _OneOrMore:
    """Annotation of a tuple: one value or a list with one or more different values."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        inner = core_schema.no_info_before_validator_function(_one_or_list, handler(source))
        return core_schema.no_info_after_validator_function(_distinct, inner)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        items = handler.resolve_ref_schema(handler(schema)).get("items", {})
        return {"anyOf": [items, {"type": "array", "items": items, "minItems": 1, "uniqueItems": True}]}


def _list(value: Any) -> Any:
    if not isinstance(value, list | tuple):
        raise field_error(f"expected a list, got {describe(value)}")
    return tuple(value)


Options: TypeAlias = Annotated[tuple[T, ...], _OneOrMore()]
Items: TypeAlias = Annotated[tuple[T, ...], BeforeValidator(_list)]
SomeItems: TypeAlias = Annotated[tuple[T, ...], Field(min_length=1), BeforeValidator(_list)]
