"""Where the files of a problem are read from: the disk, or the texts that a result carries."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from posixpath import normpath
from typing import Protocol

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.reading import UnreadableFileError, obstacle, read_bytes, real


class Files(Protocol):
    """Reads the files of one problem."""

    def read(self, path: Path, most: int, what: str) -> bytes:
        """The content of a file of at most `most` bytes; raises `UnreadableFileError`."""

    def obstacle(self, path: Path) -> str | None:
        """Why there is nothing to read at a path, or None."""

    def real(self, path: Path) -> Path:
        """What tells a file from others, however it is spelled."""


class OnDisk:
    """Files where they are; each is noted as an input of the run."""

    def read(self, path: Path, most: int, what: str) -> bytes:
        """See `Files`."""
        return read_bytes(path, most, what)

    def obstacle(self, path: Path) -> str | None:
        """See `Files`."""
        return obstacle(path)

    def real(self, path: Path) -> Path:
        """See `dse.support.files.reading.real`."""
        return real(path)


class Carried:
    """Texts by name, as found from the folder of the main file; nothing is looked up on the disk."""

    def __init__(self, main: Path, texts: Mapping[str, str]) -> None:
        self.main = main
        self.texts = {normpath(name): text for name, text in texts.items()}

    def read(self, path: Path, most: int, what: str) -> bytes:
        """See `Files`."""
        text = self.texts.get(self._name(path))
        if text is None:
            raise UnreadableFileError(path, "the result does not carry it")
        try:
            return text.encode()
        except UnicodeEncodeError:
            raise UnreadableFileError(path, "what the result carries of it is no text") from None

    def obstacle(self, path: Path) -> str | None:
        """See `Files`."""
        return None if self._name(path) in self.texts else "the result does not carry it"

    def real(self, path: Path) -> Path:
        """See `Files`."""
        return Path(self._name(path))

    def _name(self, path: Path) -> str:
        return normpath(name_from(path, self.main))


def name_from(path: Path | str, main: Path) -> str:
    """How a file is found from the folder of the main file: as it was included."""
    folder = str(main.parent)
    return str(path).removeprefix(f"{folder}/") if folder != "." else str(path)


def read_source(files: Files, path: Path, file: str, most: int, what: str) -> bytes:
    """The content of a file of a problem; `file` is its name in diagnostics.

    Raises
    ------
    ProblemError
        when it cannot be read.
    """
    try:
        return files.read(path, most, what)
    except UnreadableFileError as error:
        raise ProblemError([Diagnostic(error.reason, file=file)]) from None
