"""What all forms share: strictness, exact figures, and the settings of a question."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, PlainSerializer, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from dse.answers.tables.display import exact
from dse.support.units.text import LONGEST

MOST = 10**300
"""No exact figure is beyond it: floating-point numbers for plots are not either."""
FRACTION = rf"-?\d{{1,{LONGEST}}}/0*[1-9]\d{{0,{LONGEST - 1}}}"


class Form(BaseModel):
    """Base of every part of a format: unknown fields are errors, nothing is coerced, nothing changes.

    `dse.answers.forms.writing` makes data of objects by it. Fields of a base come first there, or behind the own field
    `INHERITED_BEHIND`, from the attribute `INHERITED_OF` of what is written; the fields `LAST` come last. Where they
    are mixed otherwise, `ORDER` has all of them.
    """

    INHERITED_BEHIND: ClassVar[str] = ""
    INHERITED_OF: ClassVar[str] = ""
    LAST: ClassVar[tuple[str, ...]] = ()
    ORDER: ClassVar[tuple[str, ...]] = ()

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", populate_by_name=False, defer_build=True)

    def __repr__(self) -> str:
        """What there is, by the names of the fields; their values may be long."""
        return f"<{type(self).__name__}: {', '.join(type(self).model_fields)}>"

    __str__ = __repr__


def _figure(value: Any) -> Fraction:
    if type(value) is int or (isinstance(value, str) and re.fullmatch(FRACTION, value)):
        found = Fraction(value)
        if abs(found) <= MOST:
            return found
    raise PydanticCustomError("figure", 'expected an integer, or a fraction as text such as "50/3"')


def _plain(value: Any) -> int | str | None:
    """A figure as JSON has it, also if it is one already."""
    return value if isinstance(value, str) else exact(value)


Figure: TypeAlias = Annotated[
    Fraction,
    PlainValidator(_figure),
    PlainSerializer(_plain),
    WithJsonSchema({"anyOf": [{"type": "integer"}, {"type": "string", "pattern": f"^{FRACTION}$"}]}),
]
"""An exact number: an integer, or a fraction as text."""
Count: TypeAlias = Annotated[int, Field(ge=-(2**62), le=2**62), PlainSerializer(_plain)]
"""A figure that the search has counted with."""
Counts: TypeAlias = dict[str, Count]
Values: TypeAlias = dict[str, Count | None]
"""Objectives of a design; null where one is unbounded: a response time in it has no bound."""


def _whole(value: Any) -> int:
    if type(value) is int and abs(value) <= MOST:
        return value
    raise PydanticCustomError("whole", f"expected an integer of at most {len(str(MOST)) - 1} digits")


Whole: TypeAlias = Annotated[int, PlainValidator(_whole), PlainSerializer(_plain), WithJsonSchema({"type": "integer"})]
"""A figure in whole counting units, of any size: the search does not count with it."""
Metrics: TypeAlias = dict[str, Whole | None]
"""Metrics of a design; null where one is unbounded."""
Unit: TypeAlias = Annotated[str, Field(pattern=r"^(1/[1-9][0-9]{0,30} .*|[^1].*|1[^/].*|1)?$")]
"""A unit, or a part of one such as ``1/3 ppm``."""
Number: TypeAlias = float
"""A number that is measured or sampled, and so not exact."""
Decisions: TypeAlias = dict[str, str]
"""The chosen option of each decision by name."""
Sense: TypeAlias = Literal["minimise", "maximise"]


NOT_GIVEN = object()


@dataclass(frozen=True)
class Of:
    """Where a field comes from, if not from the attribute of its name: ``requirement.text``, or ``.`` for the whole."""

    path: str


def field(text: str, *, earlier: Any = NOT_GIVEN, **more: Any) -> Any:
    """A field with its description.

    One with a `default` is left out where that is its value; one that files of `earlier` versions do not have is always
    written, and stands for this value where it is missing.
    """
    if earlier is not NOT_GIVEN:
        return Field(description=text, default_factory=lambda: earlier, **more)
    return Field(description=text, **more)


class Settings(Form):
    """How the question was read."""

    profile: Literal["dse", "osate-2.2", "osate-2.19"] = field("The latency rules that were applied.")
    worst_case: Literal["execution_time", "deadline"] = field("OSATE's worst-case setting.")
    system: Literal["asynchronous", "synchronous"] = field(
        "OSATE's setting for ends that may or may not share a clock.", earlier="asynchronous"
    )
    partition_output: Literal["major_frame", "partition_end"] = field(
        "OSATE's setting for when output leaves a partition.", earlier="major_frame"
    )
    best_case: Literal["empty_queue", "full_queue"] = field("OSATE's setting for queues.", earlier="empty_queue")
    bus_queuing: Literal["counted", "not_counted"] = field("OSATE's setting for buses.", earlier="counted")
    processing: Literal["execution_time", "response_time"] = field("What a flow counts for a thread.")
    deadlines: Literal["stated", "all", "none"] = field("Which deadlines count.")
    overload: Literal["forbidden", "allowed"] = field("Whether cores and buses may be used beyond all of them.")


class Objective(Form):
    """An objective of the question."""

    name: str = field("The metric.")
    sense: Sense = field("Whether less or more of it is better.")
    unit: Unit = field("What its figures count: `ns`, `ct` (cents), `ppm`, or a part of one such as `1/3 ppm`.")


class Include(Form):
    """A file that the problem includes."""

    file: str = field("Its path, as found from the folder of the problem file.")
    sha256: str = field("The SHA-256 of its content.")
