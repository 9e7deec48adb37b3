"""Every format by its short name: its JSON Schema, and data that are held to it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from dse.answers.forms.codec import model_of
from dse.spec.schema.fields import describe
from dse.spec.schema.json_schema import json_schema, schema_head, simplified
from dse.support import arguments
from dse.support.errors import UsageError


def _form_at(place: str) -> type[BaseModel]:
    """The model of a class by its place, such as ``answers.verification:Verification``."""
    home, _, name = place.partition(":")
    return model_of(getattr(import_module(f"dse.{home}"), name))


class Forms(Mapping[str, type[BaseModel]]):
    """Forms by name, each made when it is first asked for: a command needs one or two, and each costs at the start."""

    def __init__(self, places: Mapping[str, str]) -> None:
        self.places = places

    def __getitem__(self, name: str) -> type[BaseModel]:
        return _form_at(self.places[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)


FORMS = Forms(
    {
        "result": "answers.robust:AnyResult",
        "analysis": "answers.analysis:Analysis",
        "check": "questions.verbs.check:Description",
        "comparison": "answers.measured:Comparison",
        "explanation": "answers.explanation:Explanation",
        "fit": "fitting.fitted:Fit",
        "sensitivity": "answers.studies.sensitivity:SensitivityResult",
        "simulation": "answers.simulation:Simulation",
        "sizes": "questions.verbs.sizes:Sizes",
        "sweep": "answers.studies.sweep:SweepResult",
        "verification": "answers.verification:Verification",
    }
)
"""The model of ``dse-NAME/1`` by NAME, made of the class of the answer when it is asked for."""


def form_schema(name: str) -> dict[str, Any]:
    """The JSON Schema of ``dse-NAME/1`` as plain data.

    >>> form_schema("verification")["properties"]["checked"]["description"]
    'Checks that were made, and how.'
    """
    schema = FORMS[name].model_json_schema(by_alias=True)
    head = schema_head(name)
    return {**head, **simplified({key: value for key, value in schema.items() if key not in head})}


KINDS = {
    "int": "an integer",
    "string": "text",
    "bool": "true or false",
    "float": "a number",
    "list": "a list",
    "dict": "a mapping",
    "model": "a mapping",
}
"""The expected values in words, by pydantic's name of the kind."""
TAGS = ("union_tag_invalid", "union_tag_not_found")
"""Findings of pydantic where it cannot tell which case of a union a value is."""


@arguments.checked(of=arguments.Word(("problem", *FORMS)))
def schema(of: str = "problem") -> dict[str, Any]:
    """The JSON Schema of problem files, or of a format that is written, as plain data.

    Parameters
    ----------
    of
        ``problem``, or one of `FORMS`: ``result`` for ``dse-result/1``.

    Raises
    ------
    UsageError
        when there is no such format.

    Examples
    --------
    >>> schema("result")["properties"]["status"]["enum"]
    ['complete', 'incomplete', 'infeasible']
    """
    if of == "problem":
        return json_schema()
    if of not in FORMS:
        raise UsageError(f"no format is called {of!r}: there are problem, {', '.join(FORMS)}")
    return form_schema(of)


@dataclass(frozen=True)
class FormMistake:
    """Something in data that is not of a form: `place` in the data, such as ``front[2].objectives``, and why.

    Printed as ``PLACE: TEXT``, or the text alone for the whole file.
    """

    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}" if self.place else self.text


def mistakes_in(name: str, data: object) -> Iterator[FormMistake]:
    """The deviations of data from the form ``dse-NAME/1``, in the order of the data; none where the data conform.

    >>> [str(item) for item in mistakes_in("verification", {"format": "dse-verification/1", "result": 3})][:2]
    ['result: expected text, got 3', 'problem: is missing']
    """
    yield from _mistakes(FORMS[name].model_validate, name, data)


def mistakes_in_part(kind: Any, name: str, data: object) -> Iterator[FormMistake]:
    """The mistakes in a part of ``dse-NAME/1``, of the type `kind`, in the order of the data.

    `kind` is the type of the part. Yields nothing for valid data.
    """
    yield from _mistakes(_adapter(kind).validate_python, name, data)


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    """Built once: a sweep reads an outcome for each of its runs."""
    return TypeAdapter(kind)


def _mistakes(validate: Callable[[Any], object], name: str, data: object) -> Iterator[FormMistake]:
    try:
        validate(data)
    except ValidationError as error:
        for item in error.errors(include_url=False):
            yield FormMistake(_place(_location(item), data), _words(item, name))


def _location(item: ErrorDetails) -> tuple[str | int, ...]:
    """The place of a mistake; the field that selects the case of a union counts as a step."""
    path = item["loc"]
    if item["type"] not in TAGS:
        return path
    return (*path, item["ctx"]["discriminator"].strip("'_()"))


def _place(path: Sequence[str | int], data: object) -> str:
    """``front[2].objectives.price``; the names of cases and types that pydantic puts between are no part of it."""
    place = ""
    for number, part in enumerate(path, 1):
        if isinstance(part, int) and isinstance(data, list):
            place += f"[{part}]"
            data = data[part] if part < len(data) else None
        elif isinstance(data, dict) and (part in data or number == len(path)):
            place += f".{part}"
            data = data.get(part)
    return place.removeprefix(".")


def _words(item: ErrorDetails, name: str) -> str:
    """The finding in our words."""
    kind, context = item["type"], item.get("ctx", {})
    if kind == "missing":
        return "is missing"
    if kind == "extra_forbidden":
        return f"dse-{name}/1 has no such field"
    if kind in TAGS:
        tags = re.findall(r"'(?:[^']* )?([^' ]+)'", context.get("expected_tags", ""))
        return f"expected one of {', '.join(tags)}" if tags else "is not one of those that there are"
    expected = context.get("expected") or KINDS.get(kind.removesuffix("_type")) or item["msg"].lower()
    return f"{'' if expected.startswith('expected') else 'expected '}{expected}, got {describe(item['input'])}"
