"""Reading results back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dse.answers.forms.consistency import check_data
from dse.answers.result import Result
from dse.spec.loading.recognition import is_problem
from dse.support.errors import UsageError
from dse.support.files.plain_json import parse_json
from dse.support.files.reading import UnreadableFileError, read_text
from dse.support.version import SEMANTICS


def read_result(path: str | Path) -> dict[str, Any]:
    """A result file in the form ``dse-result/1``, whole: every field is there and of its kind.

    Raises
    ------
    UsageError
        when it cannot be read or is something else.
    """
    data = read_stated(path)
    check_data("result", data, path)
    return data


def read_stated(path: str | Path) -> dict[str, Any]:
    """Read the data of a file that claims to be a result; its fields are not yet checked.

    Raises
    ------
    UsageError
        when it cannot be read or says that it is something else.
    """
    try:
        text = read_text(path, what="the result")
        data = parse_json(text)
    except UnreadableFileError as error:
        raise UsageError(f"{path}: cannot be read as a result: {error.reason}") from error
    except ValueError as error:
        raise UsageError(f"{path}: {no_json(text, error, 'cannot be read as a result: not JSON')}") from error
    if not isinstance(data, dict) or data.get("format") != Result.format():
        raise UsageError(f"{path}: is no result of `dse solve --json` ({Result.format()})")
    check_semantics(data, path)
    return data


def no_json(text: str, error: ValueError, otherwise: str = "is not JSON") -> str:
    """The error for a text that should be a file of `--json` and is no JSON: a problem file, or `otherwise`.

    A sentence for the error message; `error` is what the JSON reader says, with line and column.
    """
    if is_problem(text):
        return "is a problem file, and no result: `dse solve PROBLEM --json RESULT.json` writes one"
    return f"{otherwise}: {error}"


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


def decisions_in(data: Mapping[str, Any], number: str, path: str | Path) -> Mapping[str, str]:
    """The decisions of alternative `number` (its id) of a whole result.

    Raises
    ------
    UsageError
        when it has no such alternative.
    """
    others = [item for group in data["others"] for item in group["designs"]]
    for point in [*data["front"], *others]:
        if str(point["id"]) == number:
            return dict(point["decisions"])
    raise UsageError(f"{path}: has no alternative {number!r}; ids run from 1 to {len(data['front'])}")
