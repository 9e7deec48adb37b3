"""The field types of the schema: how one value of the file is read, checked, written back and described to editors.

Values are integers or exact fractions from here on; `dse.support.units` knows the units and the rounding.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any, TypeAlias, TypeVar, get_args

from pydantic import (
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

from dse.importers.ros2.messages import LONGEST
from dse.spec.schema.canopen import BROADCASTS, FUNCTIONS, PATTERN, connection_set
from dse.spec.schema.parts import ReadBy
from dse.support import units
from dse.support.arguments import respelt
from dse.support.units import QuantityKind

T = TypeVar("T")
MAX_NAME = 200
MAX_LINE = 10_000


def field_error(message: str, hint: str = "") -> PydanticCustomError:
    """An error in the user's words, for a pydantic validator to raise; `dse.spec.loading` takes both texts back.

    `message` says what is wrong, `hint` what would be right; without the prefix that pydantic gives to a `ValueError`.
    """
    return PydanticCustomError("dse", "{message}", {"message": message, "hint": hint})


def describe(value: Any) -> str:
    """The description of a value in a file: ``10``, ``"text"``, ``a list``, ``nothing``.

    Texts are quoted and shortened for a message.
    """
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return units.shown(value)
    if isinstance(value, dict):
        return "a mapping"
    return "a list" if isinstance(value, list | tuple) else str(value)


def kind_of(value: Any) -> str:
    """The kind of a value in a file, without quoting the value: ``text``, ``a number``, ``a list``.

    For files that may hold secrets or long texts, such as a wrong file given by mistake.
    """
    if isinstance(value, str):
        return "text"
    return "a number" if isinstance(value, int | float) and not isinstance(value, bool) else describe(value)


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


def _named(hint: str) -> Callable[[Any], str]:
    """Reads a name; what to do where somebody writes that there is none."""

    def name(value: Any) -> str:
        text = _text(value, "a name", MAX_NAME)
        if text == "none":
            raise field_error('the name "none" is reserved', hint)
        return text

    return name


_name = _named("choose another: it is the type of a slot that stays empty")
_slot_type = _named('for a slot that may stay empty write "optional: true"')
_reference = _named("leave the key out where there is none")


def _carrier(value: Any) -> str:
    if value == "none":
        hint = (
            "name a bus whose type has `transmission_time: {fixed: 0 s}`, or leave `bus` out where none ever carries it"
        )
        raise field_error("a connection cannot choose to have no bus", hint)
    return _name(value)


Line: TypeAlias = Annotated[
    str,
    ReadBy(_line),
    WithJsonSchema({"type": "string", "minLength": 1, "maxLength": MAX_LINE, "pattern": r"^[^\r\n]*$"}),
]
_NAME_SCHEMA = WithJsonSchema(
    {
        "type": "string",
        "minLength": 1,
        "maxLength": MAX_NAME,
        "pattern": r"^[^\r\n]*$",
        "not": {"const": "none"},
        "description": 'A name: any text without line breaks but "none".',
    }
)
Name: TypeAlias = Annotated[str, ReadBy(_name), _NAME_SCHEMA]
SlotType: TypeAlias = Annotated[str, ReadBy(_slot_type), _NAME_SCHEMA]
"""The type of a slot, which may stay empty."""
Reference: TypeAlias = Annotated[str, ReadBy(_reference), _NAME_SCHEMA]
"""The name of something else in the file."""
Carrier: TypeAlias = Annotated[str, ReadBy(_carrier), _NAME_SCHEMA]
"""The name of a bus that a connection may take."""


class Respelt:
    """Annotation of some words: hyphens and spaces do for their underscores, as in the options of the command line.

    A validator for `Annotated`: ``response-time`` and ``response time`` are read as ``response_time``.
    """

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The pydantic schema of the type."""
        words = get_args(source)
        return core_schema.no_info_before_validator_function(lambda value: respelt(value, words), handler(source))


# --- numbers ------------------------------------------------------------------------------------------------------


CORE_RULES = ("any", "first_fit")
"""Words in place of a core: the search decides, or first-fit by decreasing utilisation."""


PRIORITY_RULES = ("rate_monotonic", "deadline_monotonic")
"""The order of threads without a priority of their own: by the time between jobs, or by the deadline."""
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
        return str(respelt(value, CORE_RULES))
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        hint = "a core from 1 or a group of cores, a list of these, any (the search decides) or first_fit"
        raise field_error(f"expected a core, got {describe(value)}", hint)
    return value


def _priority(value: Any) -> int | str:
    value = respelt(value, PRIORITY_RULES)
    if value == ANY_PRIORITY or value in PRIORITY_RULES:
        return str(value)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        hint = f"a number (a larger one is more urgent), a list of numbers, {', '.join(PRIORITY_RULES)} or any"
        raise field_error(f"expected a priority, got {describe(value)}", hint)
    return value


def _setting(value: Any) -> str | int:
    if isinstance(value, bool) or not isinstance(value, str | int):
        raise field_error(f"expected one option, got {describe(value)}")
    return _line(value) if isinstance(value, str) else value


def _version(value: Any) -> int:
    if value != 1 or not isinstance(value, int) or isinstance(value, bool):
        raise field_error(f"expected 1, got {describe(value)}", "the version of this format")
    return value


COUNT = QuantityKind("a whole number", "4", units.DIMENSIONLESS)
"""A figure that counts: a `QuantityKind` beside a type tells that studies may vary its values
(`dse.spec.quantities`)."""

Version: TypeAlias = Annotated[int, ReadBy(_version), WithJsonSchema({"const": 1})]
Count: TypeAlias = Annotated[int, ReadBy(_count(1)), WithJsonSchema({"type": "integer", "minimum": 1})]
MOST_CORES = 1024
"""The most cores of one processor."""
Cores: TypeAlias = Annotated[
    int,
    COUNT,
    ReadBy(_count(1, MOST_CORES)),
    WithJsonSchema({"type": "integer", "minimum": 1, "maximum": MOST_CORES}),
]
Core: TypeAlias = Annotated[
    int | str,
    ReadBy(_core),
    WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 1}, {"type": "string"}]}),
]
Priority: TypeAlias = Annotated[
    int | str,
    ReadBy(_priority),
    WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 0}, {"enum": [*PRIORITY_RULES, ANY_PRIORITY]}]}),
]
QueueSize: TypeAlias = Annotated[int, COUNT, ReadBy(_count(0)), WithJsonSchema({"type": "integer", "minimum": 0})]
MOST_CLASS = 7
"""The most urgent priority of Ethernet (IEEE 802.1Q, the priority code point of a tag)."""
MessagePriority: TypeAlias = Annotated[
    int,
    ReadBy(_count(0, MOST_CLASS)),
    WithJsonSchema({"type": "integer", "minimum": 0, "maximum": MOST_CLASS}),
]
MOST_IDENTIFIER = 2**29 - 1
"""The greatest identifier of CAN, of 29 bits."""
_HEXADECIMAL = re.compile(r"0x[0-9a-fA-F]{1,8}")


ANY_IDENTIFIER = "any"
"""The text for an identifier that is assigned by the deadlines of the messages on the bus."""


def _identifier(value: Any) -> int | str:
    """An identifier of CAN as a number; as text where it is hexadecimal, of CANopen, or may be `any`."""
    if value == ANY_IDENTIFIER:
        return ANY_IDENTIFIER
    if isinstance(value, str):
        try:
            number = connection_set(value)
        except ValueError as error:
            known = f"{', '.join(FUNCTIONS)}, each of a node; {', '.join(BROADCASTS)}"
            raise field_error(str(error), f"known: {known}") from None
        if number is not None:
            return number
        if not _HEXADECIMAL.fullmatch(value):
            hint = "a number (0x201), a name of CANopen (TPDO1 of node 5), a list of these, or any"
            raise field_error(f"expected an identifier, got {describe(value)}", hint)
        value = int(value, 16)
    return _count(0, MOST_IDENTIFIER)(value)


Identifier: TypeAlias = Annotated[
    int | str,
    ReadBy(_identifier),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "integer", "minimum": 0, "maximum": MOST_IDENTIFIER},
                {"type": "string", "pattern": f"^{_HEXADECIMAL.pattern}$"},
                {"type": "string", "pattern": PATTERN},
                {"enum": [ANY_IDENTIFIER, *BROADCASTS]},
            ]
        }
    ),
]
Length: TypeAlias = Annotated[
    int,
    ReadBy(_count(0, LONGEST)),
    WithJsonSchema({"type": "integer", "minimum": 0, "maximum": LONGEST}),
]
Weight: TypeAlias = Annotated[
    int,
    ReadBy(_count(0)),
    WithJsonSchema({"type": "integer", "minimum": 0, "description": "What changing the decision costs, in any unit."}),
]
Setting: TypeAlias = Annotated[
    str | int,
    ReadBy(_setting),
    WithJsonSchema({"type": ["string", "integer"], "description": "The option that the baseline has."}),
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
