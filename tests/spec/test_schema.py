"""The JSON Schema and the loader say the same."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from pydantic import BaseModel

import dse
from dse.answers.forms.registry import FORMS
from dse.spec.loading.load import parse_spec
from dse.spec.loading.reader import read_yaml
from dse.spec.schema import model
from dse.spec.schema.json_schema import descriptions, json_schema
from dse.support.errors import ProblemError

FOLDER = Path(__file__).parents[1] / "bad_inputs"
VALID = (FOLDER / "valid.yaml").read_text(encoding="utf-8")
SCHEMA = json_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)

# What a JSON Schema cannot say: exact conversion, order of a range, equality after parsing, other files.
BEYOND_SCHEMA = {
    "period_not_whole_ns",
    "period_zero",
    "period_absurd_exponent",
    "option_given_twice",
    "range_reversed",
    "sizes_in_fractions",
    "sizes_reversed",
    "bandwidth_zero",
}


def accepted(text: str) -> bool:
    try:
        parse_spec(text)
    except ProblemError:
        return False
    return True


def schema_accepts(data: Any) -> bool:
    return bool(VALIDATOR.is_valid(data))


def test_it_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"].endswith("2020-12/schema") and SCHEMA["title"] and SCHEMA["description"]


@pytest.mark.parametrize("name", sorted(set(SCHEMA["$defs"]) | {"Spec"}))
def test_every_field_appears(name: str) -> None:
    part = SCHEMA if name == "Spec" else SCHEMA["$defs"][name]
    fields = getattr(model, name).model_fields
    assert set(part["properties"]) == {info.alias or field for field, info in fields.items()}
    assert part["additionalProperties"] is False and part["description"]


def properties() -> Iterator[tuple[str, str, Any]]:
    for name, part in (("Spec", SCHEMA), *SCHEMA["$defs"].items()):
        for key, item in part["properties"].items():
            yield name, key, item
            yield from nested(f"{name}.{key}", item)


def nested(name: str, part: Any) -> Iterator[tuple[str, str, Any]]:
    """The properties of mappings that have no definition of their own, however deep they are."""
    if isinstance(part, list):
        for item in part:
            yield from nested(name, item)
    elif isinstance(part, dict):
        for key, item in part.get("properties", {}).items():
            yield name, key, item
        for key in part:
            if key != "examples":
                yield from nested(name, part[key])


@pytest.mark.parametrize(("name", "key", "item"), [pytest.param(*one, id=".".join(one[:2])) for one in properties()])
def test_every_property_has_a_meaning_its_units_and_examples_that_hold(name: str, key: str, item: Any) -> None:
    assert len(item.get("description", "")) > 15, "dse/spec/descriptions.yaml"
    units = re.findall(r"with its unit: [^'.]*", str({part: item[part] for part in item if part != "description"}))
    assert all(text in item["description"] for text in units)
    assert item.get("examples")
    for example in item["examples"]:
        jsonschema.Draft202012Validator({**item, "$defs": SCHEMA["$defs"]}).validate(example)


def test_nothing_is_described_that_there_is_not() -> None:
    for name, keys in descriptions().items():
        fields = {info.alias or field for field, info in getattr(model, name).model_fields.items()}
        assert set(keys) <= fields, name


def test_schemas_are_told_apart_by_their_ids() -> None:
    ids = [dse.schema(name)["$id"] for name in ("problem", *FORMS)]
    assert ids[0] == "urn:x-dse:problem:1" and len(set(ids)) == len(ids)


def test_every_class_appears() -> None:
    used = {"BaseModel", "Priced", "SpecMapping", "StrictMapping", "Slot", "Catalogue", "Spec"}
    classes = {name for name, item in vars(model).items() if isinstance(item, type) and issubclass(item, BaseModel)}
    assert classes - used == set(SCHEMA["$defs"])


def test_every_quantity_has_examples_that_fit_its_pattern() -> None:
    patterns = []

    def visit(part: Any) -> None:
        if isinstance(part, list):
            for item in part:
                visit(item)
        elif isinstance(part, dict):
            if "pattern" in part and "examples" in part:
                patterns.append(part)
            for item in part.values():
                visit(item)

    visit(SCHEMA)
    assert len({part["pattern"] for part in patterns}) >= 8
    for part in patterns:
        for example in part["examples"]:
            jsonschema.validate(example, part)


def test_valid_documents() -> None:
    assert schema_accepts(yaml.safe_load(VALID))
    for path in sorted((FOLDER / "semantic").glob("*.yaml")):
        assert schema_accepts(read_yaml(path.read_text(encoding="utf-8"), path.name).to_data()), path.name


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.yaml")), ids=lambda path: path.stem)
def test_bad_inputs(path: Path) -> None:
    try:
        data = read_yaml(path.read_text(encoding="utf-8"), path.name).to_data()
    except (ProblemError, UnicodeDecodeError):
        return
    beyond = path.stem in BEYOND_SCHEMA or path.stem == "valid" or path.stem.startswith("include_")
    if path.stem == "include_number":
        beyond = False
    assert schema_accepts(data) is beyond


EDITS: tuple[tuple[str, Any, bool], ...] = (
    ("threads.nav.period", "10 ms", True),
    ("threads.nav.period", "10ms", True),
    ("threads.nav.period", "1e1 ms", True),
    ("threads.nav.period", "50/3 us", False),
    ("threads.nav.period", "10 µs", True),
    ("threads.nav.compute_execution_time", "1 .. 3 ms", True),
    ("threads.nav.compute_execution_time", "1ms..3ms", True),
    ("threads.nav.compute_execution_time", [], False),
    ("threads.nav.compute_execution_time", {"RT101": ["1 ms", "2 ms"]}, True),
    ("threads.nav.compute_execution_time", {"RT101": 5}, False),
    ("threads.nav.price", "-1 EUR", False),
    ("connections.position.data_size", "1.5 kB", True),
    ("connections.position.data_size", "1 Kb", False),
    ("bus_types.can_125k.bandwidth", "20 kB/s", True),
    ("threads.nav.power", "1 µW", True),
    ("threads.nav.totals", {"mass": "90 g"}, True),
    ("threads.nav.totals", {"mass": "g"}, False),
    ("threads.nav.queue_size", 0, True),
    ("threads.nav.queue_size", True, False),
    ("threads.nav.queue_size", 1.5, False),
    ("threads.nav.period", None, True),
    ("bus_types.can_125k.transmission_time", {"RT101": {"fixed": "1 us"}}, True),
    ("bus_types.can_125k.transmission_time", {}, True),
    ("bus_types.can_125k.transmission_time", "1 us", False),
    ("bus_types.can_125k.virtual", "yes", False),
    ("processors.computer.type", "none", False),
    ("processors.computer.type", [], False),
    ("connections.position.from", "", False),
    ("rules", [{"forbid": "x"}], True),
    ("rules", [{"forbid": "x", "require": "y"}], False),
    ("baseline", {"nav": {"queue_size": 3}}, True),
    ("baseline", {"nav": {"queue_size": 3.5}}, False),
    ("cost_of_change", {"nav": {"queue_size": 0}}, True),
    ("cost_of_change", {"nav": {"queue_size": -1}}, False),
    ("cost_of_change", {"nav": {"queue_size": 1.5}}, False),
    ("assumptions", ["a"], True),
    ("assumptions", "a", False),
    ("description", "a\nb", True),
    ("name", "a\nb", False),
    ("include", [], False),
)


@pytest.mark.parametrize(("place", "value", "valid"), EDITS)
def test_edits_are_judged_alike(place: str, value: Any, valid: bool) -> None:
    data = yaml.safe_load(VALID)
    *folders, last = place.split(".")
    part = data
    for folder in folders:
        part = part[folder]
    part[last] = value
    assert accepted(yaml.safe_dump(data, allow_unicode=True)) is valid
    if value != "50/3 us":
        assert schema_accepts(data) is valid
