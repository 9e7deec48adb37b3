"""Answers as data, made by their forms: a form says which fields there are, in which order, and where each comes from.

The same classes check what is read (`dse.answers.forms.registry`) and print the schema, so that a field is described
once. A field takes the attribute of its name, or the one that `Of` names; what an answer has to look up first it tells
under the names of its fields (`dse.answers.base.With`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from operator import attrgetter
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, PlainSerializer

from dse.answers.base import With
from dse.answers.forms.base import Form, Of

Writer = Callable[[Any], Any]


def written(form: type[BaseModel], source: object) -> dict[str, Any]:
    """What `source` says, as plain data of a form.

    Parameters
    ----------
    form
        what to write: its fields in order. One with a `default` is left out where that is its value, or None.
    source
        an object, whose attributes become fields; a tuple, which has them in order; plain data of the form; or the form
        itself, which was read.

    Raises
    ------
    AttributeError, KeyError
        when the source has nothing for a field.

    Examples
    --------
    >>> from dse.answers.forms.verdicts import Finding
    >>> written(Finding, ("front[2]", "is dominated"))
    {'place': 'front[2]', 'text': 'is dominated'}
    """
    given = source if isinstance(source, With) else With(source, {})
    source, told = given.source, given.told
    parts = _parts(form)
    if isinstance(source, tuple):
        source = {part.key: value for part, value in zip(parts, source, strict=True)}
    if isinstance(source, form):
        source = {part.key: getattr(source, part.name) for part in parts if part.name in source.model_fields_set}
    if isinstance(source, Mapping):
        return {part.key: part.write(source[part.key]) for part in parts if part.is_always or part.key in source}
    found: dict[str, Any] = {}
    for part in parts:
        value = part.value(source, told)
        if part.is_always or not part.says_nothing(value):
            found[part.key] = part.write(value)
    return found


def sources_of(form: type[BaseModel]) -> dict[str, str]:
    """The field of a form by the attribute of an answer that it is written from."""
    return {part.path: part.name for part in _parts(form)}


@dataclass(frozen=True)
class _Part:
    """A field as it is written: under `key`, from the attribute `path` of the source, or `constant`."""

    name: str
    key: str
    path: str
    write: Writer
    is_always: bool
    default: Any
    constant: Any

    def value(self, source: object, told: Mapping[str, Any]) -> Any:
        """What is written, before it is plain data."""
        if self.constant is not None:
            return self.constant
        if self.name in told:
            return told[self.name]
        return attrgetter(self.path)(source) if self.path != "." else source

    def says_nothing(self, value: Any) -> bool:
        """Whether a field is left out that may be."""
        return value is None or value == self.default or (self.default in ([], {}, "") and not value)


@cache
def _parts(form: type[BaseModel]) -> tuple[_Part, ...]:
    return tuple(_part(form, name) for name in _order(form))


def _inherited(form: type[BaseModel]) -> list[str]:
    return [name for base in form.__bases__ if issubclass(base, Form) for name in _order(base)]


def _order(form: type[BaseModel]) -> list[str]:
    """The fields in the order in which they are written: those of a base where the form has their place."""
    if vars(form).get("ORDER"):
        return list(form.ORDER)  # type: ignore[attr-defined]
    inherited = _inherited(form)
    own = [name for name in form.model_fields if name not in inherited]
    behind = vars(form).get("INHERITED_BEHIND", "")
    place = own.index(behind) + 1 if behind else 0
    last = vars(form).get("LAST", ())
    names = [*own[:place], *inherited, *own[place:]]
    return [*(name for name in names if name not in last), *last]


def _part(form: type[BaseModel], name: str) -> _Part:
    info = form.model_fields[name]
    path = next((item.path for item in info.metadata if isinstance(item, Of)), name)
    holder = vars(form).get("INHERITED_OF", "")
    if holder and name in _inherited(form):
        path = f"{holder}.{path}"
    options = get_args(info.annotation) if get_origin(info.annotation) is Literal else ()
    serializer = next((item for item in info.metadata if isinstance(item, PlainSerializer)), None)
    write = _writer(info.annotation) if serializer is None else serializer.func
    if info.annotation == str | None:
        write = _text
    is_always = info.is_required() or info.default_factory is not None
    constant = options[0] if len(options) == 1 else None
    return _Part(name, info.alias or name, path, write, is_always, info.default, constant)  # type: ignore[arg-type]


def _writer(kind: Any) -> Writer:
    """What makes plain data of a value of this type."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        serializer = next((item for item in inner[1:] if isinstance(item, PlainSerializer)), None)
        return _writer(inner[0]) if serializer is None else serializer.func  # type: ignore[return-value]
    if origin in (Union, UnionType):
        cases = [item for item in inner if item is not type(None)]
        return partial(_optional, _writer(cases[0])) if len(cases) == 1 else _any_form
    if origin is list:
        return partial(_list, _writer(inner[0]))
    if origin is dict:
        return partial(_dict, _writer(inner[1]))
    if isinstance(kind, type) and issubclass(kind, Form):
        return partial(written, kind)
    return _number if kind is float else _same


def _same(value: Any) -> Any:
    return value


def _any_form(value: Any) -> Any:
    """One of several forms that was read; else what is plain data."""
    return written(type(value), value) if isinstance(value, Form) else value


def _number(value: Any) -> Any:
    """A measured number; what is exact becomes one."""
    return float(value) if isinstance(value, Fraction) else value


def _text(value: Any) -> Any:
    """A text that a field may be without: null where it is ""."""
    return value or None


def _optional(write: Writer, value: Any) -> Any:
    return None if value is None else write(value)


def _list(write: Writer, values: Iterable[Any]) -> list[Any]:
    return [write(value) for value in values]


def _dict(write: Writer, values: Any) -> dict[str, Any]:
    """Entries by name; things that have one are entries, too."""
    if not isinstance(values, Mapping):
        return {item.name: write(item) for item in values}
    if write is _same:
        return dict(values)
    return {name: write(value) for name, value in values.items()}
