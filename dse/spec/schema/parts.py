"""The base of the classes that a problem file is read into: strict and frozen, and made ready when they are needed."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

_inside: ContextVar[bool] = ContextVar("_inside", default=False)
"""Whether the validator of a class is being made, of which others are parts."""


class ReadBy:
    """Annotation of a value of a problem file: one function reads it, and another may write it back.

    As pydantic's `PlainValidator`, which besides prepares for every field a way to write its Python type, for four
    fifths of the time that a class takes.
    """

    def __init__(self, read: Callable[[Any], Any], write: Callable[[Any], str] | None = None) -> None:
        self.read = read
        self.write = write

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The pydantic schema of the type."""
        written = self.write and core_schema.plain_serializer_function_ser_schema(
            self.write, return_schema=core_schema.str_schema(), when_used="json"
        )
        return core_schema.no_info_plain_validator_function(self.read, serialization=written)


class StrictMapping(BaseModel):
    """A mapping of a problem file: unknown keys are errors, nothing is coerced, nothing changes.

    The validator of a class is made when the first value is validated; those that contain the class call it. Most
    problem files use a third of the classes, and what is made for a class is not made again for each that contains it.
    """

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", defer_build=True)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: type[BaseModel], handler: GetCoreSchemaHandler) -> CoreSchema:
        """The pydantic schema of the type; values of another class are validated by this one."""
        if not _inside.get():
            token = _inside.set(True)
            try:
                return handler(source)
            finally:
                _inside.reset(token)

        def described(schema: CoreSchema, of: GetJsonSchemaHandler) -> dict[str, Any]:
            source.model_rebuild()
            return of(source.__pydantic_core_schema__)

        name = f"{source.__module__}.{source.__qualname__}:{id(source)}"
        own_schema = core_schema.no_info_plain_validator_function(source.model_validate, ref=name)
        own_schema["metadata"] = {"pydantic_js_functions": [described]}
        return own_schema


class SpecMapping(StrictMapping):
    """Base of every part of a problem file but the frames of buses."""

    model_config = ConfigDict(populate_by_name=True)
