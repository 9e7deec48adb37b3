"""`dse.read`: what a command wrote as JSON, as typed data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from dse.errors import UsageError
from dse.files.plain_json import parse_json
from dse.files.reading import UnreadableFileError, read_text
from dse.results.answer import DataAnswer
from dse.results.forms.base import Form
from dse.results.forms.registry import FORMS
from dse.results.reading import check_data, no_json

ANSWERS: Final[Mapping[str, tuple[str, str]]] = {
    "sweep": ("dse.results.sweep", "SweepResult"),
    "sensitivity": ("dse.results.sensitivity", "SensitivityResult"),
    "verification": ("dse.results.verify", "Verification"),
    "sizes": ("dse.api.sizes", "Sizes"),
}
"""The formats whose answers are made of nothing but their data, and where these answers are."""


def read(path: str | Path) -> DataAnswer | Form:
    """What a command wrote with ``--json``, of any format, as it was written: nothing is computed again.

    Parameters
    ----------
    path
        the file.

    Returns
    -------
    DataAnswer or Form
        of a sweep, sensitivities, a verification and sizes the answer as the verb returned it, with its tables and its
        report; of every other format its data, with an attribute for each field (docs/formats.md). Figures are exact.
        A result that is to be ranked, exported or compared is opened with `dse.reopen`, which computes it anew.

    Raises
    ------
    UsageError
        when the file cannot be read, or is not of the format that it names: with the first place that is wrong.

    Examples
    --------
    >>> import dse
    >>> import pathlib
    >>> found = dse.sweep("pump.yaml", "price=60EUR..300EUR", store=None)
    >>> written = pathlib.Path("prices.json").write_text(found.to_json(), encoding="utf-8")
    >>> dse.read("prices.json") == found
    True
    >>> written = pathlib.Path("check.json").write_text(dse.check("pump.yaml").to_json(), encoding="utf-8")
    >>> dse.read("check.json").space_size
    48
    """
    try:
        text = read_text(path, what="an answer")
        data = parse_json(text)
    except UnreadableFileError as error:
        raise UsageError(f"{path}: cannot be read: {error.reason}") from error
    except ValueError as error:
        raise UsageError(f"{path}: {no_json(text, error)}") from error
    name = _name_of(data)
    if name is None:
        known = ", ".join(f"dse-{name}/1" for name in FORMS)
        raise UsageError(f"{path}: names no format that is known: {known}")
    check_data(name, data, path)
    if name in ANSWERS:
        from importlib import import_module

        module, answer = ANSWERS[name]
        kind: type[DataAnswer] = getattr(import_module(module), answer)
        return kind.from_dict(data)
    found: Any = FORMS[name].model_validate(data)
    form: Form = getattr(found, "root", found)
    return form


def _name_of(data: Any) -> str | None:
    """The format that data name, without the tool and the version."""
    stated = data.get("format") if isinstance(data, dict) else None
    return next((name for name in FORMS if stated == f"dse-{name}/1"), None)
