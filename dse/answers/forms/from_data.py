"""Answers from their data: what `dse.answers.forms.writing` writes, read back by the same forms.

A form that holds data has their types; an answer that is made of nothing but data is built of it, each of its fields
from the field of the form that is written from it. What an answer looks up when it is written
(`dse.answers.base.With`) it looks up here the other way round, by a class method ``_heard``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from fractions import Fraction
from functools import cache
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from dse.answers.forms.base import Form
from dse.answers.forms.writing import sources_of, written
from dse.answers.tables.display import figure

T = TypeVar("T")


def read_as(kind: type[T], data: Form) -> T:
    """An object of a dataclass, of data that `written` made of one.

    Raises
    ------
    TypeError
        when the form does not have all of its fields.

    Examples
    --------
    >>> from dse.answers.forms.verdicts import Finding as Read
    >>> from dse.answers.verification import Finding
    >>> read_as(Finding, Read.model_validate({"place": "front[2]", "text": "is dominated"}))
    Finding(place='front[2]', text='is dominated')
    """
    hear = getattr(kind, "_heard", None)
    heard: Mapping[str, Any] = hear(data) if hear is not None else {}
    names = sources_of(type(data))
    found: dict[str, Any] = {}
    for name, hint in _hints(kind).items():  # type: ignore[arg-type]
        if name in heard:
            found[name] = _value(hint, heard[name])
        elif name in names:
            found[name] = _value(hint, getattr(data, names[name]))
    return kind(**found)


@cache
def _hints(kind: Any) -> dict[str, Any]:
    """The type of each field that makes an object."""
    hints = get_type_hints(kind)
    return {item.name: hints[item.name] for item in fields(kind) if item.init}


def _value(hint: Any, value: Any) -> Any:
    """A value of a form as the field of an answer has it."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        cases = [item for item in inner if item is not NoneType]
        return None if value is None else _value(cases[0], value) if len(cases) == 1 else value
    if hint is Fraction:
        return figure(value)
    if hint is str:
        return "" if value is None else value
    if isinstance(hint, type) and is_dataclass(hint) and isinstance(value, Form):
        return read_as(hint, value)
    if origin is tuple and isinstance(value, Sequence):
        kinds = [inner[0]] * len(value) if inner[1:] == (...,) else inner
        return tuple(_value(kind, item) for kind, item in zip(kinds, value, strict=True))
    if isinstance(value, Form):
        return written(type(value), value)
    if isinstance(value, Mapping):
        kind = inner[1] if len(inner) == 2 else Any
        return {name: _value(kind, item) for name, item in value.items()}
    return value
