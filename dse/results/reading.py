"""Reading results back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from dse.errors import UsageError
from dse.files.plain_json import parse_json
from dse.files.reading import UnreadableFileError, read_text
from dse.results.result import FORMAT
from dse.version import SEMANTICS


def read_result(path: str | Path) -> dict[str, Any]:
    """A result file in the form ``dse-result/1``.

    Raises
    ------
    UsageError
        when it cannot be read or is something else.
    """
    try:
        data = parse_json(read_text(path, what="the result"))
    except UnreadableFileError as error:
        raise UsageError(f"{path}: cannot be read as a result: {error.reason}") from error
    except ValueError as error:
        raise UsageError(f"{path}: cannot be read as a result: not JSON: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("front"), list):
        raise UsageError(f"{path}: is no result of `dse solve --json` ({FORMAT})")
    check_semantics(data, path)
    return data


def check_semantics(data: Mapping[str, Any], path: str | Path) -> None:
    """Refuse a result whose figures have the meaning of another version.

    Raises
    ------
    UsageError
        naming both.
    """
    if data.get("semantics") != SEMANTICS:
        stated = data.get("semantics", "one before they were counted")
        raise UsageError(
            f"{path}: another version of dse wrote it, whose figures mean something else (semantics {stated}, here "
            f"{SEMANTICS}): solve the problem again"
        )


def check_form(data: Mapping[str, Any], path: str | Path) -> None:
    """Refuse a result whose parts are of other kinds than `dse.solve` writes; `path` is its name in the message.

    Raises
    ------
    UsageError
        naming the first such part.
    """
    for place, is_sound in _FORM.items():
        value: Any = data
        for key in place.split("."):
            value = value.get(key) if isinstance(value, dict) else None
        if not is_sound(value):
            raise UsageError(f"{path}: is not a whole result: {place} is not what `dse solve --json` writes")


def _is_region(value: Any) -> bool:
    return isinstance(value, dict) and all(type(bound) is int for bound in value.values())


def _are_regions(value: Any) -> bool:
    return isinstance(value, list) and all(_is_region(region) for region in value)


_COUNTS = tuple(f"search.{name}" for name in ("solver_calls", "space_size", "workers", "seed"))
_FORM: Mapping[str, Callable[[Any], bool]] = {
    "status": lambda value: value in ("complete", "incomplete", "infeasible"),
    "problem.file": lambda value: isinstance(value, str) and "\0" not in value,
    "unexplored": _are_regions,
    "refuted": _are_regions,
    "potential": lambda value: value is None or _is_region(value),
    **{
        f"search.{name}": lambda value: type(value) is int for name in ("solver_calls", "space_size", "workers", "seed")
    },
    "search.wall_s": lambda value: type(value) in (int, float),
    "search.solver": lambda value: isinstance(value, str),
}


def decisions_in_file(path: str | Path, number: str) -> Mapping[str, str]:
    """The decisions of alternative `number` (its id) of a result file.

    Raises
    ------
    UsageError
        when the file is no result or has no such alternative.
    """
    data = read_result(path)
    front = data["front"]
    groups = data.get("others")
    lists = [group.get("designs") for group in groups if isinstance(group, dict)] if isinstance(groups, list) else []
    more = [item for designs in lists if isinstance(designs, list) for item in designs]
    for point in [*front, *more]:
        if isinstance(point, dict) and str(point.get("id")) == number and isinstance(point.get("decisions"), dict):
            return {str(name): str(option) for name, option in point["decisions"].items()}
    raise UsageError(f"{path}: has no alternative {number!r}; ids run from 1 to {len(front)}")
