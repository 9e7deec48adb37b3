"""The importer of AADL: files or folders of a model in, the document of a problem out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.importers.aadl.document.implementations import (
    DifferError,
    Subsystem,
    conflict,
    merged,
    subsystems,
    with_implementations,
)
from dse.importers.aadl.document.problem import ProblemWriter
from dse.importers.aadl.instance.model import InstanceModel, read_model
from dse.importers.aadl.instance.unread_properties import tell
from dse.importers.aadl.syntax.tokens import finding
from dse.importers.allowance import allowed, at
from dse.importers.registry import CHOICES, Imported, Key, Place
from dse.support.errors import ProblemError

PIECES = 20_000_000
"""The allowance of one import of a model."""


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """The problem that a model states: one design, with the rules of OSATE.

    Parameters
    ----------
    path
        an ``.aadl`` file, which is read with those around it that it needs, or a folder, which is read whole.
    options
        ``root``: the implementation to instantiate, ``package::type.implementation``; ``mode``: the mode of the root,
        or ``path.mode`` of components, with commas between.

    Raises
    ------
    ProblemError
        with every mistake, each with its file, line and column.
    """
    with allowed(PIECES), at(path, 1):
        return _read(path, options)


def _read(path: Path, options: Mapping[str, Any]) -> Imported:
    model = read_model(path, options)
    writer = ProblemWriter(model, path, options)
    choices = options.get(CHOICES, {})
    chosen = subsystems(model, choices)
    document = writer.document() if not chosen else _alternatives(model, chosen, writer.places, path, options)
    if model.library.findings:
        raise ProblemError(sorted(model.library.findings, key=lambda item: (item.file, item.line, item.column)))
    tell(model)
    return Imported(document, tuple(model.library.remarks()), writer.places)


def _alternatives(
    model: InstanceModel, chosen: Sequence[Subsystem], places: dict[Key, Place], path: Path, options: Mapping[str, Any]
) -> dict[str, Any]:
    """The document that leaves implementations of subsystems open."""
    budgets: list[Any] = []

    def document(taken: Mapping[str, str]) -> dict[str, Any]:
        variant = with_implementations(model, chosen, taken, path, options)
        writer = ProblemWriter(variant, path, options)
        written = writer.document()
        model.properties.asked |= variant.properties.asked
        budgets.append(written.pop("budgets", None))
        places.update({key: place for key, place in writer.places.items() if key not in places})
        return written

    try:
        if reason := conflict(chosen):
            raise DifferError(reason)
        joined = merged(chosen, document, places)
    except DifferError as error:
        raise ProblemError([finding(str(error), chosen[0].component.place)]) from None
    if all(item == budgets[0] for item in budgets):
        return joined if budgets[0] is None else {**joined, "budgets": budgets[0]}
    message = f"budgets of processors and memories differ with the type of {chosen[0].name}: not looked at"
    model.library.remark(message, chosen[0].component.place)
    return joined
