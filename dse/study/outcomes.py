"""Outcomes of runs as they come back from a store or another machine: plain data of the very form that runs have."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from dse.files.plain_json import parse_json

NUMBER = re.compile(r"-?\d{1,400}(/0*[1-9]\d{0,399})?")
Check = Callable[[Any], bool]


class OutcomeError(ValueError):
    """A text that is no outcome of a run."""


def read_outcome(text: str) -> dict[str, Any]:
    """The outcome that a run has written, see `SweepRun.outcome`.

    Raises
    ------
    OutcomeError
        when it is none; what it says may still be wrong.
    """
    try:
        data = parse_json(text)
    except ValueError as error:
        raise OutcomeError(f"not JSON: {error}") from error
    if not isinstance(data, dict) or not isinstance(data.get("kind"), str) or data["kind"] not in _FORMS:
        raise OutcomeError("it is of no known kind")
    _check_form(data, _FORMS[data["kind"]])
    if data["kind"] != "error":
        _check_alternatives(data)
    return data


def _check_form(data: Mapping[str, Any], form: Mapping[str, Check]) -> None:
    for key, is_sound in form.items():
        if key not in data or not is_sound(data[key]):
            raise OutcomeError(f"{key} is not what a run writes")


def _check_alternatives(data: Mapping[str, Any]) -> None:
    """Every alternative has a figure for each metric; stretches speak of alternatives that are there."""
    names = [info["name"] for info in data["objectives"]]
    if not names or len(set(names)) != len(names) or not set(names) <= set(data["units"]):
        raise OutcomeError("objectives is not what a run writes")
    found = data["front"] if data["kind"] == "front" else data["alternatives"]
    if data["status"] != "incomplete" and (data["status"] == "infeasible") == bool(found):
        raise OutcomeError("status does not fit what was found")
    for item in found:
        if not isinstance(item, dict):
            raise OutcomeError("an alternative is not what a run writes")
        _check_form(item, _ALTERNATIVE if data["kind"] == "front" else {**_ALTERNATIVE, **_LIMITED})
        if set(item["metrics"]) != set(data["units"]):
            raise OutcomeError("an alternative lacks figures")
    if data["kind"] == "breaks":
        ids = [item["id"] for item in found]
        listed = [entry["id"] for stretch in data["stretches"] for entry in stretch["front"]]
        if len(set(ids)) != len(ids) or set(listed) != set(ids):
            raise OutcomeError("stretches is not what a run writes")


def is_number(value: Any) -> bool:
    """An exact figure: an integer, or a fraction as text."""
    return type(value) is int or (isinstance(value, str) and NUMBER.fullmatch(value) is not None)


def _is_figure(value: Any) -> bool:
    """A figure of a design: a number, or None where it is unbounded."""
    return value is None or is_number(value)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_table(is_sound: Check) -> Check:
    return lambda value: isinstance(value, dict) and all(map(is_sound, value.values()))


def _is_list(is_sound: Check) -> Check:
    return lambda value: isinstance(value, list) and all(map(is_sound, value))


def _is_info(value: Any) -> bool:
    if not isinstance(value, dict) or set(value) != {"name", "sense", "unit"}:
        return False
    return all(map(_is_text, value.values())) and value["sense"] in ("minimise", "maximise")


def _is_stretch(value: Any) -> bool:
    if not isinstance(value, dict) or not all(is_number(value.get(end)) for end in ("from", "to")):
        return False
    front = value.get("front")
    entries = front if isinstance(front, list) else []
    return bool(entries) and all(isinstance(item, dict) and type(item.get("id")) is int for item in entries)


_ALTERNATIVE: Mapping[str, Check] = {"decisions": _is_table(_is_text), "metrics": _is_table(_is_figure)}
_LIMITED: Mapping[str, Check] = {"id": lambda value: type(value) is int, "limited": is_number}
_SOLVED: Mapping[str, Check] = {
    "status": lambda value: value in ("complete", "infeasible", "incomplete"),
    "objectives": _is_list(_is_info),
    "units": _is_table(_is_text),
}
_FORMS: Mapping[str, Mapping[str, Check]] = {
    "error": {"status": lambda value: value in ("invalid", "other version"), "message": _is_text},
    "front": {**_SOLVED, "front": lambda value: isinstance(value, list)},
    "breaks": {
        **_SOLVED,
        "definition": _is_text,
        "metric": _is_text,
        "operator": lambda value: value in ("<=", ">="),
        "unit": _is_text,
        "from": is_number,
        "to": is_number,
        "exact": lambda value: isinstance(value, bool),
        "infeasible_until": lambda value: value is None or is_number(value),
        "alternatives": lambda value: isinstance(value, list),
        "stretches": _is_list(_is_stretch),
    },
}
