"""What commands write is what the schemas say, field by field; what is not of a form is told with its place."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from pydantic import BaseModel

import dse
from dse.answers.base import DataAnswer, json_text
from dse.answers.forms.registry import FORMS, form_schema, mistakes_in
from dse.cli.commands.files.schema import FORMATS
from dse.cli.main import run
from dse.questions.reopen import ANSWERS
from tests.answers.written import written_files
from tests.helpers.effort import LONG

Data = dict[str, Any]
UNSEEN = {
    "result": {
        *(
            "Point.is_first",
            "Member.looked_for",
            "Robust.unjudged",
            "AnyResult.under_way",
        ),  # only where one was stopped
    },
    "explanation": {
        *("Demand.kind", "Demand.text", "Demand.origin"),
        *(
            f"MessageResponse.{name}" for name in ("because", "blocked_by", "earlier_ns", "needed_ppm", "over_ns")
        ),  # tests/buses
    },
    "sensitivity": {"SensitivityResult.left_out", "Uncertain.unbounded"},
    "analysis": {"Contention.decisions"},  # other cores are chosen for fronts of `dse solve` alone
    "sweep": {"Contention.decisions", "LimitedContention.decisions"},
    "simulation": {"Simulation.stopped"},  # held by tests/answers/test_writing.py
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[str, Data]]]:
    """What the commands write, by format, each with the command."""
    found: dict[str, list[tuple[str, Data]]] = {name: [] for name in FORMS}
    for command, data in written_files(tmp_path_factory.mktemp("written")):
        found[data["format"].removeprefix("dse-").removesuffix("/1")].append((command, data))
    return found


@pytest.mark.parametrize("name", FORMS)
def test_what_commands_write_is_of_the_form(name: str, written: dict[str, list[tuple[str, Data]]]) -> None:
    validator = jsonschema.Draft202012Validator(form_schema(name))
    assert written[name]
    for command, data in written[name]:
        assert [f"{item.json_path}: {item.message}" for item in validator.iter_errors(data)] == [], command
        assert list(map(str, mistakes_in(name, data))) == [], command


@pytest.mark.parametrize("name", FORMS)
def test_what_is_read_can_be_written_again(name: str, written: dict[str, list[tuple[str, Data]]]) -> None:
    for command, data in written[name]:
        read = FORMS[name].model_validate(data)
        assert json.loads(read.model_dump_json(by_alias=True, exclude_unset=True)) == data, command


@pytest.mark.parametrize("name", FORMS)
def test_a_file_is_read_as_it_was_written(
    name: str, written: dict[str, list[tuple[str, Data]]], tmp_path: Path
) -> None:
    """Byte for byte, whether it becomes an answer again or typed data."""
    for command, data in written[name]:
        path = tmp_path / "written.json"
        path.write_text(json_text(data), encoding="utf-8")
        read = dse.read(path)
        if isinstance(read, DataAnswer):
            again = read.to_json()
        else:
            again = json_text(json.loads(read.model_dump_json(by_alias=True, exclude_unset=True)))
        assert again == path.read_text(encoding="utf-8"), command
        assert isinstance(read, DataAnswer) is (name in ANSWERS)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "is not JSON"),
        ("[]", "names no format that is known: dse-result/1, dse-analysis/1"),
        ('{"format": "dse-sweep/2"}', "names no format that is known"),
        ('{"format": "dse-sweep/1"}', "is not a whole sweep: problem: is missing (and 10 more mistakes)"),
    ],
)
def test_what_is_no_answer_is_told(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(dse.UsageError, match=f"^{re.escape(f'{path}: {said}')}"):
        dse.read(path)
    with pytest.raises(dse.UsageError, match="no such file"):
        dse.read(tmp_path / "y.json")


@pytest.mark.parametrize("name", FORMS)
def test_every_field_is_written_by_some_command(name: str, written: dict[str, list[tuple[str, Data]]]) -> None:
    seen: set[str] = set()
    for _, data in written[name]:
        seen |= set(fields_set(FORMS[name].model_validate(data)))
    schema = form_schema(name)
    parts = {**schema["$defs"], FORMS[name].__name__: schema}
    missing = {f"{part}.{key}" for part, item in parts.items() for key in item.get("properties", ())} - seen
    assert missing <= UNSEEN.get(name, set())


def fields_set(part: object) -> Iterator[str]:
    """Class and name of each field that data had."""
    if isinstance(part, list | tuple):
        for item in part:
            yield from fields_set(item)
    elif isinstance(part, dict):
        yield from fields_set(list(part.values()))
    elif isinstance(part, BaseModel):
        fields = type(part).model_fields
        for name in part.model_fields_set:
            yield f"{type(part).__name__}.{fields[name].alias or name}"
            yield from fields_set(getattr(part, name))


@pytest.mark.parametrize("name", FORMS)
def test_every_field_is_described_and_nothing_else_is_taken(name: str) -> None:
    schema = form_schema(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    for part in (schema, *schema["$defs"].values()):
        if "properties" in part:
            assert part["additionalProperties"] is False and part["description"]
            assert all(item.get("description") for item in part["properties"].values()), part["title"]


@pytest.mark.parametrize("name", FORMS)
def test_each_thing_that_is_wrong_is_told_with_its_place(name: str, written: dict[str, list[tuple[str, Data]]]) -> None:
    """A field that is missing, unknown, or of another kind: at the first of each kind of place in the data."""
    validator = jsonschema.Draft202012Validator(form_schema(name))
    command, data = max(written[name], key=lambda pair: len(json.dumps(pair[1])))
    data = first_of_each_kind(data, set())
    tried: set[str] = set()
    for place, holder, key in places(data):
        shape = "".join(letter for letter in place if not letter.isdigit())
        if shape in tried or len(tried) > 150:
            continue
        tried.add(shape)
        kept = holder[key]
        wrongs: tuple[Any, ...] = (None, [[]], {"x": []}, True, 2.5)
        for wrong in wrongs if LONG else (wrongs[len(tried) % 5], wrongs[(len(tried) + 2) % 5]):
            if type(wrong) is type(kept):
                continue
            holder[key] = wrong
            mistakes = list(mistakes_in(name, data))
            assert bool(mistakes) is not validator.is_valid(data), (command, place, wrong)
            assert not mistakes or any(item.place.startswith(place) for item in mistakes), (place, wrong, mistakes)
        holder[key] = kept
    assert not list(mistakes_in(name, data))
    data["surprise"] = 1
    assert [str(item) for item in mistakes_in(name, data)] == [f"surprise: dse-{name}/1 has no such field"]
    del data["surprise"], data["format"]
    assert [str(item) for item in mistakes_in(name, data)] == ["format: is missing"]


def first_of_each_kind(data: Any, seen: set[str], at: str = "") -> Any:
    """The data with only those objects of each list that have a place of a kind that none before them has."""
    if isinstance(data, dict):
        seen |= {f"{at}.{key}" for key in data}
        return {key: first_of_each_kind(value, seen, f"{at}.{key}") for key, value in data.items()}
    if not isinstance(data, list) or not all(isinstance(item, dict) for item in data):
        return data
    kept = []
    for item in data:
        known = len(seen)
        seen.add(f"{at}[]")
        fewer = first_of_each_kind(item, seen, f"{at}[]")
        kept += [fewer] if len(seen) > known else []
    return kept


def places(data: Any, at: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Every place in the data with what holds it."""
    if isinstance(data, dict):
        for key in list(data):
            place = f"{at}.{key}".removeprefix(".")
            yield place, data, key
            yield from places(data[key], place)
    elif isinstance(data, list):
        for number in range(len(data)):
            yield f"{at}[{number}]", data, number
            yield from places(data[number], f"{at}[{number}]")


def test_the_command_prints_every_schema(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert ("problem", *FORMS) == FORMATS
    for name in FORMATS[1:]:
        assert run(["schema", "--of", name]) == 0
        assert json.loads(capfd.readouterr().out) == form_schema(name)
    assert run(["schema", "-o", str(tmp_path / "s.json")]) == 0
    assert run(["schema", "--of", "sweep", "-o", str(tmp_path / "s.json")]) == 0
    assert run(["schema", "-o", str(tmp_path / "s.json")]) == 0
    problem = tmp_path / "p.yaml"
    problem.write_text("dse: 1\n", encoding="utf-8")
    assert run(["schema", "-o", str(problem)]) == 2
    assert problem.read_text(encoding="utf-8") == "dse: 1\n"
    assert json.loads((tmp_path / "s.json").read_text())["title"] == "dse problem file"
