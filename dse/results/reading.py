"""Reading results back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dse.errors import UsageError
from dse.results.result import FORMAT


def read_result(path: str | Path) -> dict[str, Any]:
    """A result file in the form ``dse-result/1``.

    Raises
    ------
    UsageError
        when it cannot be read or is something else.
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:  # a number of 5000 digits is a ValueError too
        raise UsageError(f"{path}: cannot be read as a result: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("front"), list):
        raise UsageError(f"{path}: is no result of `dse solve --json` ({FORMAT})")
    return data


def decisions_in_file(path: str | Path, number: str) -> Mapping[str, str]:
    """The decisions of alternative `number` (its id) of a result file.

    Raises
    ------
    UsageError
        when the file is no result or has no such alternative.
    """
    data = read_result(path)
    front = data["front"]
    others = data.get("others")
    more = [item for group in others if isinstance(group, dict) for item in group.get("designs", [])] if others else []
    for point in [*front, *more]:
        if isinstance(point, dict) and str(point.get("id")) == number and isinstance(point.get("decisions"), dict):
            return {str(name): str(option) for name, option in point["decisions"].items()}
    raise UsageError(f"{path}: has no alternative {number!r}; ids run from 1 to {len(front)}")
