"""Answers as JSON and back: what is written of a class, read as it, and how its data are checked.

A class says next to its fields what is written of it (`dse.support.json_fields`). From that alone follow

* `written`: the data of an object,
* `model_of`: the model by which data are checked, and from which `dse schema` and docs/formats.md are made,
* `read_as`: the object again, of data that were checked.

Every type of values is one case of `kind_of`, with all three.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from fractions import Fraction
from functools import cache, cached_property, reduce
from keyword import iskeyword
from operator import attrgetter, or_
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    PlainSerializer,
    PlainValidator,
    RootModel,
    Tag,
    WithJsonSchema,
    create_model,
)
from pydantic import Field as ModelField
from pydantic_core import PydanticCustomError

from dse.answers.tables.display import exact, figure
from dse.support.json_fields import ALWAYS, Data, Json, Mark, Of
from dse.support.units.text import LONGEST

MOST = 10**300
"""No exact figure is beyond it: floating-point numbers for plots are not either."""
FRACTION = rf"-?\d{{1,{LONGEST}}}/0*[1-9]\d{{0,{LONGEST - 1}}}"


class Form(BaseModel):
    """Base of all models of data: unknown fields are errors, nothing is coerced, nothing changes.

    Pydantic models made from answer classes; `strict` refuses ``"1"`` for 1, and data from files stay immutable.
    """

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", populate_by_name=False, defer_build=True)

    def __repr__(self) -> str:
        """The names of the fields; their values may be long."""
        return f"<{type(self).__name__}: {', '.join(type(self).model_fields)}>"

    __str__ = __repr__


def _read_figure(value: Any) -> Fraction:
    if type(value) is int or (isinstance(value, str) and re.fullmatch(FRACTION, value)):
        exact = Fraction(value)
        if abs(exact) <= MOST:
            return exact
    raise PydanticCustomError("figure", 'expected an integer, or a fraction as text such as "50/3"')


def _exact(value: Any) -> int | str | None:
    """A figure as JSON has it, also if it is one already."""
    return value if value is None or isinstance(value, str) else exact(value)


Figure: TypeAlias = Annotated[
    Fraction,
    PlainValidator(_read_figure),
    PlainSerializer(_exact),
    WithJsonSchema({"anyOf": [{"type": "integer"}, {"type": "string", "pattern": f"^{FRACTION}$"}]}),
]


def _read_whole(value: Any) -> int:
    if type(value) is int and abs(value) <= MOST:
        return value
    raise PydanticCustomError("whole", f"expected an integer of at most {len(str(MOST)) - 1} digits")


Whole: TypeAlias = Annotated[
    int, PlainValidator(_read_whole), PlainSerializer(_exact), WithJsonSchema({"type": "integer"})
]
Count: TypeAlias = Annotated[int, ModelField(ge=-(2**62), le=2**62), PlainSerializer(_exact)]
UnitText: TypeAlias = Annotated[str, ModelField(pattern=r"^(1/[1-9][0-9]{0,30} .*|[^1].*|1[^/].*|1)?$")]
T = TypeVar("T")
Convert = Callable[[Any], Any]


def _same(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class ValueType:
    """A type of values: `form` gives the type by which JSON is checked, `write` and `read` convert a value.

    Fractions are written as text where they are not whole, tuples as lists, classes as objects.
    """

    form: Callable[[], Any]
    write: Convert = _same
    read: Convert = _same


@dataclass(frozen=True)
class FormEntry:
    """An entry of an object in JSON: under `key` what is at `path`, left out where it is `default`.

    `path` is a dotted path of attributes, `text` the description that `dse schema` prints.
    """

    key: str
    path: str
    kind: ValueType
    text: str
    default: Any = ALWAYS
    limits: Mapping[str, Any] | None = None

    def is_left_out(self, value: Any) -> bool:
        """Whether the entry is left out, with this value.

        A default of ``[]``, ``{}`` or ``""`` stands for every empty value.
        """
        if self.default is ALWAYS:
            return False
        return value is None or value == self.default or (self.default in ([], {}, "") and not value)

    @cached_property
    def get(self) -> Convert:
        """The getter that reads the value from the object.

        A function from the object to the value at `path`.
        """
        return attrgetter(self.path)


def written(cls: type, source: object) -> dict[str, Any]:
    """An object as plain data, as its class says; `source` may also be its data by key, with figures to be written.

    Examples
    --------
    >>> from dse.answers.verification import Finding
    >>> written(Finding, Finding("front[2]", "is dominated"))
    {'place': 'front[2]', 'text': 'is dominated'}
    """
    entries = _entries_of(cls)
    if isinstance(source, Mapping):
        there = [entry for entry in entries if entry.default is ALWAYS or entry.key in source]
        return {entry.key: entry.kind.write(source[entry.key]) for entry in there}
    entries_of = [(entry, entry.get(source)) for entry in entries]
    return {entry.key: entry.kind.write(value) for entry, value in entries_of if not entry.is_left_out(value)}


def read_as(cls: type[T], data: Mapping[str, Any], **more: Any) -> T:
    """An object of a dataclass, of data that `written` made of one and that were checked, and of `more` fields.

    Examples
    --------
    >>> from dse.answers.verification import Finding
    >>> read_as(Finding, {"place": "front[2]", "text": "is dominated"})
    Finding(place='front[2]', text='is dominated')
    """
    made = {item.name for item in fields(cls) if item.init} - more.keys()  # type: ignore[arg-type]
    entries = [entry for entry in _entries_of(cls) if entry.path in made and entry.key in data]
    return cls(**{entry.path: entry.kind.read(data[entry.key]) for entry in entries}, **more)


def model_of(cls: Any) -> type[BaseModel]:
    """The model that checks the data of a class, and is the JSON Schema of them.

    A pydantic model with one field for each entry of the class; its first docstring paragraph is the description.
    """
    return _model(cls)


@cache
def _model(cls: Any) -> type[BaseModel]:
    if "ONE_OF" in vars(cls):
        cases = reduce(or_, map(model_of, cls.ONE_OF))
        return create_model(
            cls.__name__,
            __base__=RootModel[Annotated[cases, ModelField(discriminator="of")]],  # type: ignore[valid-type]
            __doc__=_first_paragraph(cls),
        )
    members: dict[str, Any] = {}
    for entry in _entries_of(cls):
        name = f"{entry.key}_" if iskeyword(entry.key) else entry.key
        more: dict[str, Any] = dict(entry.limits or {})
        if entry.default is not ALWAYS:
            more["default"] = entry.default
        if name != entry.key:
            more["alias"] = entry.key
        members[name] = (entry.kind.form(), ModelField(description=entry.text, **more))
    name = getattr(cls, "JSON_NAME", cls.__name__)
    return create_model(name, __base__=Form, __doc__=_first_paragraph(cls), __module__=cls.__module__, **members)


def _entries_of(cls: Any) -> tuple[FormEntry, ...]:
    """The entries that are written for an object of a class, in order."""
    return _listed(cls)


@cache
def _listed(cls: Any) -> tuple[FormEntry, ...]:
    return tuple(_entries(cls))


def _entries(cls: type) -> Iterator[FormEntry]:
    if "FORMAT" in vars(cls):
        yield _format(cls)
    hints = _hints(cls)
    listed: Sequence[str | Of | type] = getattr(cls, "WRITTEN", ()) or [name for name in hints if _text_of(hints[name])]
    for item in listed:
        if isinstance(item, type):
            yield from _entries_of(item)
        else:
            yield _entry(cls, item if isinstance(item, Of) else Of(item))


def _entry(cls: Any, stated: Of) -> FormEntry:
    hint, text, how = stated.kind, stated.text or _text_of(stated.kind), Json()
    if hint is None or not text:
        owner, found_text = _at(getattr(cls, "OF", cls), stated.path)
        how = next((mark for mark in _metadata(owner) if isinstance(mark, Json)), how)
        text = text or found_text
        hint = next((kind for kind in (stated.kind, how.kind) if kind is not None), owner)
    return FormEntry(
        key=stated.key or how.key or stated.path.rpartition(".")[2],
        path=stated.path,
        kind=kind_of(hint),
        text=text,
        default=how.default if stated.default is ALWAYS else stated.default,
        limits=stated.limits or how.limits,
    )


def _format(cls: Any) -> FormEntry:
    """The first entry of a whole answer: the name of its format."""
    name = f"dse-{cls.FORMAT}/1"
    return FormEntry("format", "FORMAT", ValueType(lambda: Literal[name], lambda _: name), "The name of this format.")


def _at(cls: Any, path: str) -> tuple[Any, str]:
    """The type and the text of what is at a path: a field, or a property."""
    hint: Any = cls
    text = ""
    for name in path.split("."):
        owner = _plain(hint)
        attribute = inspect.getattr_static(owner, name, None)
        getter = attribute.fget if isinstance(attribute, property) else getattr(attribute, "func", None)
        if getter is not None:
            hint = _hints(getter)["return"]
            text = _text_of(hint) or _first_paragraph(getter)
        else:
            hint = _hints(owner)[name]
            text = _text_of(hint)
    return hint, text


@cache
def _hints(item: Any) -> dict[str, Any]:
    """The types of the fields of a class, or of a function, with what is said of them."""
    return get_type_hints(item, include_extras=True)


def _plain(hint: Any) -> Any:
    """The class that a type is about, without None and what is said of it."""
    if get_origin(hint) is Annotated:
        return _plain(get_args(hint)[0])
    if get_origin(hint) in (Union, UnionType):
        (hint,) = [_plain(item) for item in get_args(hint) if item is not NoneType]
    return hint


def _metadata(hint: Any) -> tuple[Any, ...]:
    return get_args(hint)[1:] if get_origin(hint) is Annotated else ()


def _text_of(hint: Any) -> str:
    return next((item for item in _metadata(hint) if isinstance(item, str)), "")


def _first_paragraph(item: Any) -> str:
    return inspect.cleandoc(item.__doc__ or "").partition("\n\n")[0]


# Every type of values.


def kind_of(hint: Any, marks: frozenset[Mark] = frozenset()) -> ValueType:
    """The value type of an annotation, which checks, writes and reads values.

    `hint` is the annotation of a field, `marks` what its `Annotated` says. Raises `TypeError` for types that JSON
    answers do not have.
    """
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return kind_of(inner[0], marks | {item for item in inner[1:] if isinstance(item, Mark)})
    if Mark.BY_KIND in marks:
        return _by_kind(inner)
    if origin in (Union, UnionType):
        cases = [item for item in inner if item is not NoneType and (item is not int or Fraction not in inner)]
        if len(cases) != 1:
            raise TypeError(f"{hint} is no type that is written as JSON")
        kind = kind_of(cases[0], marks)
        return _or_null(kind) if NoneType in inner else kind
    if Mark.BY_NAME in marks:
        return _by_name(kind_of(inner[0]))
    if origin in (tuple, list, Sequence):
        return _list(kind_of(inner[0]), len(inner) if origin is tuple and inner[-1] is not ... else None)
    if origin in (dict, Mapping):
        return _mapping(kind_of(inner[1]))
    if isinstance(hint, type) and issubclass(hint, Data):
        return ValueType(lambda: model_of(hint), lambda value: written(hint, value))
    if is_dataclass(hint) and isinstance(hint, type):
        return ValueType(lambda: model_of(hint), lambda value: written(hint, value), lambda value: read_as(hint, value))
    return _plain_kind(hint, marks)


def _plain_kind(hint: Any, marks: frozenset[Mark]) -> ValueType:
    """Numbers, texts, and what is written as it is."""
    if Mark.NUMBER in marks or hint is float:
        return ValueType(lambda: float, lambda value: float(value) if isinstance(value, Fraction) else value)
    if hint is Fraction or Mark.FIGURE in marks:
        return _figure(Mark.NULL in marks)
    if hint is int and Mark.COUNT in marks:
        return ValueType(lambda: Count | None if Mark.NULL in marks else Count, _exact)
    if hint is int and Mark.WHOLE in marks:
        return ValueType(lambda: Whole | None if Mark.NULL in marks else Whole, _exact)
    if hint is str and Mark.NULL in marks:
        return ValueType(lambda: str | None, lambda value: value or None, lambda value: value or "")
    if hint is str and Mark.UNIT in marks:
        return ValueType(lambda: UnitText)
    return ValueType(lambda: hint)


def _figure(is_null: bool) -> ValueType:
    return ValueType(lambda: Figure | None if is_null else Figure, _exact, figure)


def _or_null(kind: ValueType) -> ValueType:
    return ValueType(
        lambda: kind.form() | None,
        lambda value: None if value is None else kind.write(value),
        lambda value: None if value is None else kind.read(value),
    )


def _list(kind: ValueType, length: int | None) -> ValueType:
    def form() -> Any:
        every: Any = list[kind.form()]  # type: ignore[misc]
        return every if length is None else Annotated[every, ModelField(min_length=length, max_length=length)]

    return ValueType(
        form,
        lambda values: [kind.write(value) for value in values],
        lambda values: tuple(kind.read(value) for value in values),
    )


def _by_kind(cases: Sequence[type]) -> ValueType:
    """Data of one of several classes; the tags are no names of entries, so that places of mistakes do without them."""

    def kind(data: Any) -> str | None:  # its name is the place of a mistake
        stated_kind = data.get("kind") if isinstance(data, dict) else getattr(data, "kind", None)
        return f"a run of kind {stated_kind}" if isinstance(stated_kind, str) else None

    def form() -> Any:
        tagged = []
        for case in cases:
            (word,) = get_args(_plain(_hints(case)["kind"]))
            tagged.append(Annotated[model_of(case), Tag(f"a run of kind {word}")])
        return Annotated[reduce(or_, tagged), Discriminator(kind)]

    return ValueType(form)


def _mapping(kind: ValueType) -> ValueType:
    return ValueType(
        lambda: dict[str, kind.form()],  # type: ignore[misc]
        lambda values: {name: kind.write(value) for name, value in values.items()},
        lambda values: {name: kind.read(value) for name, value in values.items()},
    )


def _by_name(kind: ValueType) -> ValueType:
    return replace(_mapping(kind), write=lambda values: {item.name: kind.write(item) for item in values})
