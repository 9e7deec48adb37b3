"""Answers are written as their classes say: every entry once, in order, nothing else."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Annotated, get_args

import pytest

import dse
from dse.answers.base import Answer, DataAnswer
from dse.answers.forms.codec import kind_of, model_of, read_as, written
from dse.answers.forms.registry import FORMS, mistakes_in
from dse.answers.verification import Finding
from dse.report import dispatch
from dse.support.json_fields import BY_NAME, FIGURE, NULL, NUMBER, Data, Json, Of
from dse.support.units import Unbounded

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"


@dataclass(frozen=True)
class Deep:
    """What is deep."""

    name: str
    unit: Annotated[str, "Its unit."]
    value: Annotated[Fraction, NULL, "An exact figure; null where it is unbounded."]


class Named(Data):
    """A thing with a unit."""

    OF = Deep
    WRITTEN = ("unit",)


@dataclass(frozen=True)
class Source:
    """A part with an entry of every kind.

    What follows is for readers of the code.
    """

    JSON_NAME = "Part"
    WRITTEN = (
        "name",
        "deep.unit",
        "note",
        "told",
        "mean",
        "more",
        "flag",
        "share",
        Of("deep.value", "First.", key="first"),
    )

    name: Annotated[str, "A name."]
    deep: Deep
    mean: Annotated[Fraction, NUMBER, "A number."] = Fraction(1, 2)
    note: Annotated[str, NULL, "A text, or none."] = ""
    more: Annotated[tuple[Deep, ...], "By name.", Json(default={}, kind=Annotated[tuple[Named, ...], BY_NAME])] = ()
    flag: Annotated[bool, "A flag.", Json(default=True)] = True
    share_ppm: Annotated[int, FIGURE, "An exact integer."] = 0

    @property
    def told(self) -> tuple[Fraction, Fraction]:
        """What is told.

        This is no part of the text.
        """
        return Fraction(2), Fraction(1, 2)

    @property
    def share(self) -> Annotated[int, FIGURE]:
        """A share."""
        return self.share_ppm


def test_each_kind_of_entry() -> None:
    deep = Deep("d", "ms", Fraction(1, 3))
    plain = {
        "name": "a", "unit": "ms", "note": None, "told": [2, "1/2"], "mean": 0.5, "share": 0, "first": "1/3",
    }  # fmt: skip
    assert list(written(Source, Source("a", deep)).items()) == list(plain.items())
    full = written(Source, Source("a", replace(deep, value=Unbounded(9)), note="x", more=(deep,), flag=False))
    assert full == {**plain, "note": "x", "more": {"d": {"unit": "ms"}}, "flag": False, "first": None}
    assert list(written(Source, dict(reversed(plain.items())))) == list(plain)  # plain data, in the order of the class
    with pytest.raises(KeyError, match="told"):
        written(Source, {"name": "a", "unit": "ms", "note": None})


def test_the_schema_has_the_texts_of_the_class() -> None:
    schema = model_of(Source).model_json_schema()
    assert (schema["title"], schema["description"]) == ("Part", "A part with an entry of every kind.")
    texts = {name: item["description"] for name, item in schema["properties"].items()}
    assert (texts["told"], texts["first"], texts["unit"]) == ("What is told.", "First.", "Its unit.")
    assert schema["required"] == ["name", "unit", "note", "told", "mean", "share", "first"]
    assert (schema["properties"]["told"]["minItems"], schema["properties"]["told"]["maxItems"]) == (2, 2)


def test_an_object_is_read_as_it_was_written() -> None:
    deep = Deep("d", "ms", Fraction(1, 3))
    assert read_as(Finding, written(Finding, Finding("front[2]", "is dominated"))).place == "front[2]"
    found = read_as(Source, written(Source, Source("a", deep, note="x", flag=False)), deep=deep, mean=Fraction(1, 2))
    assert found == Source("a", deep, note="x", flag=False)


def test_a_type_that_is_not_written_is_told() -> None:
    with pytest.raises(TypeError, match="no type that is written as JSON"):
        kind_of(int | str)


def test_every_answer_has_one_of_the_forms() -> None:
    found = get_args(dispatch.Told)
    assert set(found) == {*Answer.__subclasses__(), *DataAnswer.__subclasses__()} - {DataAnswer}
    assert {item.format() for item in found} == {f"dse-{name}/1" for name in FORMS}


def test_a_simulation_that_was_stopped_is_of_its_form() -> None:
    """It said `stopped`, which its form did not have."""
    found = dse.simulate(PUMP, dse.solve(PUMP).front[0].decisions, runs=1)
    data = replace(found, is_stopped=True).to_dict()
    assert data["stopped"] is True and "stopped" not in found.to_dict()
    assert list(map(str, mistakes_in("simulation", data))) == []
