"""Columns of CSV files that stated uncertainties take their samples from."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from dse.spec.loading.sources import Files
from dse.spec.schema.model import Spec
from dse.support.files.reading import UnreadableFileError
from dse.support.units import UnitError, parse_quantity

_A_NAME = re.compile(r"[^\W\d][\w .\[\]()%/-]{0,39}")
MOST_SAMPLES = 1_000_000
MOST_BYTES = 64_000_000


class SampleError(ValueError):
    """Samples that cannot be had; `field` is the key of the entry that is wrong.

    A missing file, a missing column or a cell that is no number.
    """

    def __init__(self, field: str, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.field, self.message, self.hint = field, message, hint


Samples: TypeAlias = Mapping[str, tuple[str, ...] | SampleError]
"""By the path of the quantity: its samples as texts without their unit, or why there are none."""


def read_samples(spec: Spec, main: Path, files: Files) -> tuple[Samples, dict[str, str]]:
    """The samples that stand in files of their own, and the texts of these files by name.

    Columns by path of the uncertain quantity; a `SampleError` stands where a column cannot be read, and is reported
    with the uncertainties.
    """
    samples: dict[str, tuple[str, ...] | SampleError] = {}
    texts: dict[str, str] = {}
    for path, stated in spec.uncertainty.items():
        if not isinstance(stated.samples, str):
            continue
        name = stated.samples
        try:
            if name not in texts:
                texts[name] = _text(files, main.parent / name)
            samples[path] = tuple(column(texts[name], Path(name).name, stated.column))
        except SampleError as error:
            samples[path] = error
    return samples, texts


def _text(files: Files, path: Path) -> str:
    try:
        return files.read(path, MOST_BYTES, "a file of samples").decode()
    except UnreadableFileError as error:
        reason = error.reason.removeprefix("cannot be read: ")
        raise SampleError("samples", f"{path.name} cannot be read: {reason}") from error
    except UnicodeDecodeError:
        raise SampleError("samples", f"{path.name} cannot be read: the file is not UTF-8 text") from None


def column(text: str, file: str, name: str | None) -> list[str]:
    """The texts of a column of a CSV file with a header; of the only one when no name is given.

    A single column may go without a header: a first line that is a number, with or without a unit, is a sample.

    Raises
    ------
    SampleError
        when there is no such column, or it has too few or too many samples.
    """
    try:
        reader = csv.DictReader(io.StringIO(text.removeprefix("\ufeff"), newline=""))
        columns = list(reader.fieldnames or [])
        bare = name is None and bool(columns) and all(map(_is_figure, columns))
        if bare and len(columns) > 1:
            raise SampleError(
                "samples",
                f"{file} has {len(columns)} columns, but no header",
                "name them in a first line, and `column`",
            )
        if name is None and len(columns) != 1:
            raise SampleError(
                "samples", f"{file} has {len(columns)} columns", f"say which with `column`{_named(columns)}"
            )
        chosen = name if name is not None else columns[0]
        if chosen not in columns:
            raise SampleError("column", f"{file} has no such column", f"there are {len(columns)}{_named(columns)}")
        texts = [str(row[chosen]).strip() for row in reader if row[chosen]]
        texts = [chosen.strip(), *texts] if bare else texts
    except csv.Error as error:
        raise SampleError("samples", f"{file} is no table of comma-separated values") from error
    if not texts or len(texts) > MOST_SAMPLES:
        raise SampleError("samples", f"{file}: {len(texts)} samples", f"from 1 to {MOST_SAMPLES}")
    return texts


def _named(columns: Sequence[str]) -> str:
    """The names of several columns, where all of them are names: of a file that is no table nothing is quoted."""
    return f": {', '.join(columns)}" if len(columns) > 1 and all(map(_A_NAME.fullmatch, columns)) else ""


def _is_figure(text: str) -> bool:
    """Whether a text is a number, with or without a unit that is known, and so no name of a column."""
    try:
        return parse_quantity(text).dimension is not None
    except UnitError:
        return False
