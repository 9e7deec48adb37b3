"""Where the files of a problem are read from: the disk, or the texts that a result carries."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from posixpath import normpath
from typing import Protocol

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.reading import UnreadableFileError, obstacle, read_bytes, real


class Files(Protocol):
    """Reads the files of one problem.

    `OnDisk` reads files, `Carried` the texts of a result; loading does not know which of them it has.
    """

    def read(self, path: Path, most: int, what: str) -> bytes:
        """The content of a file of at most `most` bytes; raises `UnreadableFileError`.

        Larger files are refused before they are read. `what` is a noun for messages, such as "a problem file".
        """

    def obstacle(self, path: Path) -> str | None:
        """The reason why there is nothing to read at a path, or None.

        A phrase for a message: missing, a folder, not readable.
        """

    def real(self, path: Path) -> Path:
        """The canonical path of a file, the same for every spelling of the path.

        Two paths with one real path are one file; circles of includes are found by it.
        """


class OnDisk:
    """Files where they are; each is noted as an input of the run.

    An output of the run must not overwrite one of the inputs; the note serves that check.
    """

    def read(self, path: Path, most: int, what: str) -> bytes:
        """The content of a file on the disk, of at most `most` bytes.

        Raises `UnreadableFileError` where the file is missing, is no regular file, or is too large.
        """
        return read_bytes(path, most, what)

    def obstacle(self, path: Path) -> str | None:
        """The reason why there is nothing to read at a path on the disk, or None.

        A phrase for a message: missing, a folder, not readable.
        """
        return obstacle(path)

    def real(self, path: Path) -> Path:
        """The path without links and relative parts, which tells a file from others.

        As `dse.support.files.reading.real` computes it.
        """
        return real(path)


class Carried:
    """Texts by name, as found from the folder of the main file; nothing is looked up on the disk.

    Names are relative to the folder of the main file (`name_from`).
    """

    def __init__(self, main: Path, texts: Mapping[str, str]) -> None:
        self.main = main
        self.texts = {normpath(name): text for name, text in texts.items()}

    def read(self, path: Path, most: int, what: str) -> bytes:
        """The text that a result carries for a path, as bytes.

        Raises `UnreadableFileError` where the result does not carry it.
        """
        text = self.texts.get(self._name(path))
        if text is None:
            raise UnreadableFileError(path, "the result does not carry it")
        try:
            return text.encode()
        except UnicodeEncodeError:
            raise UnreadableFileError(path, "what the result carries of it is no text") from None

    def obstacle(self, path: Path) -> str | None:
        """The reason why a result has nothing to read at a path, or None."""
        return None if self._name(path) in self.texts else "the result does not carry it"

    def real(self, path: Path) -> Path:
        """The name by which a result carries the file."""
        return Path(self._name(path))

    def _name(self, path: Path) -> str:
        return normpath(name_from(path, self.main))


def name_from(path: Path | str, main: Path) -> str:
    """The path of a file relative to the folder of the main file, as the include has it.

    Text with slashes; a path outside of that folder is kept as it is.
    """
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
