"""The importer of AADL: files or folders of a model in, the document of a problem out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dse.errors import ProblemError
from dse.importers.aadl.model import read_model
from dse.importers.aadl.problem import Writer
from dse.importers.registry import Imported


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
    model = read_model(path, options)
    writer = Writer(model, path, options)
    document = writer.document()
    if model.library.findings:
        raise ProblemError(sorted(model.library.findings, key=lambda item: (item.file, item.line, item.column)))
    remarks = sorted(model.library.remarks, key=lambda item: (item.file, item.line, item.column))
    return Imported(document, tuple(remarks), writer.places)
