"""Answers are written by their forms: every field once, in the order of the form, nothing else."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Annotated, get_args

import pytest

import dse
from dse.answers.base import Answer, DataAnswer, With
from dse.answers.forms.base import Figure, Form, Number, Of, field
from dse.answers.forms.registry import FORMS, mistakes_in
from dse.answers.forms.writing import written
from dse.report import dispatch
from dse.support.units import Unbounded

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"


class Base(Form):
    """What a base has."""

    unit: str = field("Its unit.")


class Part(Base):
    """A part with a field of every kind."""

    INHERITED_BEHIND = "name"
    INHERITED_OF = "deep"
    LAST = ("first",)

    first: Annotated[Figure | None, Of("deep.value")] = field("An exact figure.")
    name: str = field("A name.")
    note: str | None = field("A text, or none.")
    told: list[Figure] = field("What is told.")
    mean: Number = field("A number.")
    more: dict[str, Base] = field("By name.", default={})
    flag: bool = field("A flag.", default=True)
    old: int = field("What earlier files have not.", earlier=0)


@dataclass(frozen=True)
class Deep:
    name: str
    unit: str
    value: Fraction


@dataclass(frozen=True)
class Source:
    name: str
    deep: Deep
    mean: Fraction = Fraction(1, 2)
    note: str = ""
    more: tuple[Deep, ...] = ()
    flag: bool = True
    old: int = 0


def test_each_kind_of_field() -> None:
    deep = Deep("d", "ms", Fraction(1, 3))
    plain = {"name": "a", "unit": "ms", "note": None, "told": [2, "1/2"], "mean": 0.5, "old": 0, "first": "1/3"}
    found = written(Part, With(Source("a", deep), {"told": (Fraction(2), Fraction(1, 2))}))
    assert list(found.items()) == list(plain.items())
    told = {"told": [], "note": "x"}
    full = written(Part, With(Source("a", replace(deep, value=Unbounded(9)), more=(deep,), flag=False), told))
    assert full == {**plain, "note": "x", "told": [], "more": {"d": {"unit": "ms"}}, "flag": False, "first": None}
    assert list(written(Part, dict(reversed(plain.items())))) == list(plain)  # plain data, in the order of the form
    with pytest.raises(AttributeError, match="told"):
        written(Part, Source("a", deep))


def test_every_answer_has_one_of_the_forms() -> None:
    known = {form.__name__ for form in FORMS.values()} - {"ComparisonForm"} | {"Designs", "Results", "MeasuredForm"}
    found = get_args(dispatch.Told)
    assert set(found) == {*Answer.__subclasses__(), *DataAnswer.__subclasses__()} - {DataAnswer}
    assert {item.form().__name__ for item in found} == known
    assert {item.format() for item in found} == {f"dse-{name}/1" for name in FORMS}


def test_a_simulation_that_was_stopped_is_of_its_form() -> None:
    """It said `stopped`, which its form did not have."""
    found = dse.simulate(PUMP, dse.solve(PUMP).front[0].decisions, runs=1)
    data = replace(found, is_stopped=True).to_dict()
    assert data["stopped"] is True and "stopped" not in found.to_dict()
    assert list(map(str, mistakes_in("simulation", data))) == []
