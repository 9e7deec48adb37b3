"""How a class says what is written of it as JSON: the text and the type of each entry, next to its fields.

A field is written if it has a text, under its own name and in the order of the fields::

    limit: Annotated[Fraction, "The limit, in `unit`."]
    by_ns: Annotated[int, FIGURE, "How much less each of its jobs takes, in ns."]
    thread: Annotated[str, NULL, "The thread by which it breaks; null where several do."] = ""
    is_sought: Annotated[bool, "False where the time was too short.", Json("looked_for", default=True)] = True

Where properties are written too, or the order is another one, ``WRITTEN`` names all entries: fields, properties (their
text is the first paragraph of the docstring), paths such as ``requirement.text``, `Of` a path with a text of its own,
and classes, which stand for all of their entries. The first paragraph of the class's docstring is what the schema says
of it, under the name of the class, or ``JSON_NAME``; a whole answer has a ``FORMAT``. `dse.answers.forms.codec` makes
the JSON, its schema and its checks of this.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import Annotated, Any, Final, TypeAlias


class Mark(Enum):
    """A mark on the type of a field that says how its values are written.

    Used in `Annotated` of a field, such as ``Annotated[Fraction, NULL, "text"]``; the codec reads it.
    """

    FIGURE = auto()
    COUNT = auto()
    WHOLE = auto()
    NUMBER = auto()
    UNIT = auto()
    NULL = auto()
    BY_NAME = auto()
    BY_KIND = auto()


FIGURE: Final = Mark.FIGURE
"""An integer that is written as an exact number, as all fractions are."""
COUNT: Final = Mark.COUNT
"""An integer that the search has counted with: below 2**62."""
WHOLE: Final = Mark.WHOLE
"""An integer of any size: the search does not count with it."""
NUMBER: Final = Mark.NUMBER
"""A fraction that is written as a floating-point number."""
UNIT: Final = Mark.UNIT
"""A unit, or a part of one such as ``1/3 ppm``."""
NULL: Final = Mark.NULL
"""Null stands for an unbounded figure, or an empty text."""
BY_NAME: Final = Mark.BY_NAME
"""A sequence of things that have a `name`, written as a mapping by it."""
BY_KIND: Final = Mark.BY_KIND
"""One of several kinds of `Data`, which the entry ``kind`` tells apart."""
ALWAYS: Final = object()
"""The default of an entry that is never left out."""

Unit: TypeAlias = Annotated[str, UNIT]
Counts: TypeAlias = Mapping[str, Annotated[int, COUNT]]
"""Figures by name that the search has counted with."""
Values: TypeAlias = Mapping[str, Annotated[int, COUNT, NULL]]
"""Figures of a design by name; null where one is unbounded: a response time in it has no bound."""


class Data:
    """Plain data that the annotations of a class describe, or objects of another class, `OF`, as they are written here.

    Nothing is made of the class itself.
    """


@dataclass(frozen=True)
class Json:
    """The form of a field that is not always written, under its own name and by its own type.

    Parameters
    ----------
    key
        the name in JSON.
    default
        the value with which it is left out.
    kind
        the type that it has in JSON.
    limits
        what else a value must keep, in the words of pydantic's `Field`: ``{"min_length": 1}``.
    """

    key: str = ""
    default: Any = ALWAYS
    kind: Any = None
    limits: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Of:
    """An entry of ``WRITTEN`` that needs more than a name: what is at `path`, such as ``requirement.text``.

    The text and the type are those of the field or property at the path, and the key is the last part of the path,
    where they are left out. The rest is as for `Json`.
    """

    path: str
    text: str = ""
    key: str = ""
    default: Any = ALWAYS
    kind: Any = None
    limits: Mapping[str, Any] | None = None
