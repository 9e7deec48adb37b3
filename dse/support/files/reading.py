"""Files that are read: regular ones, of a bounded size, each noted as an input of the run."""

from __future__ import annotations

import errno
import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from dse.support.errors import UsageError
from dse.support.files.guard import PathLike, current

STANDARD_INPUT = "-"
MOST_BYTES = 256_000_000
"""The largest result, study or store entry that is read."""
_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


class UnreadableFileError(UsageError):
    """A file that cannot be read; `reason` says why, without its name.

    `is_other_content`: it was read, but is no text.
    """

    def __init__(self, path: PathLike, reason: str, *, is_other_content: bool = False) -> None:
        self.reason = reason
        self.is_other_content = is_other_content
        super().__init__(f"{os.fspath(path)}: {reason}")


def read_bytes(path: PathLike, most: int = MOST_BYTES, what: str = "a file") -> bytes:
    """The content of a regular file of at most `most` bytes; `what` it is, for a message that it is not overwritten.

    ``-`` is standard input, whatever that is. Other pipes and devices have no end that one could wait for, so they are
    refused, without being opened for long.

    Raises
    ------
    UnreadableFileError
        when there is no such file, it is none, it is too large, or it cannot be read.
    UsageError
        when an output of the same run is to take its place.
    """
    if os.fspath(path) == STANDARD_INPUT:
        return _standard_input(most)
    with opened(path) as stream:
        guard = current()
        if guard is not None:
            guard.note(path, what)
        is_small = os.fstat(stream.fileno()).st_size <= most
        data = _read(path, stream, most + 1) if is_small else b""
    if not is_small or len(data) > most:
        raise UnreadableFileError(path, f"the file is larger than {_size(most)}")
    return data


def beginning(path: PathLike, most: int) -> bytes:
    """The first bytes of a regular file, at most `most`, to tell what it is: that makes it no input of the run.

    Raises
    ------
    UnreadableFileError
        when there is no such file, it is none, or it cannot be read.
    """
    with opened(path) as stream:
        return _read(path, stream, most)


@contextmanager
def opened(path: PathLike) -> Iterator[BinaryIO]:
    """A regular file to read from; opening it never blocks.

    Raises
    ------
    UnreadableFileError
        when there is no such file, it is none, or it cannot be opened.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as error:
        raise UnreadableFileError(path, _why(path, error)) from None
    status = os.fstat(handle)
    if not stat.S_ISREG(status.st_mode):
        os.close(handle)
        raise UnreadableFileError(path, _other_kind(status.st_mode))
    with os.fdopen(handle, "rb") as stream:
        yield stream


def _read(path: PathLike, stream: BinaryIO, most: int) -> bytes:
    """The first `most` bytes; files of the kernel may have none as yet, and others to come without an end."""
    try:
        data: bytes | None = stream.read(most)
    except OSError as error:
        raise UnreadableFileError(path, _why(path, error)) from None
    if data is None:
        raise UnreadableFileError(path, "cannot be read: there is nothing in it as yet")
    return data


def _standard_input(most: int) -> bytes:
    """All of it; within one run it can be read again."""
    guard = current()
    data = guard.standard_input if guard is not None else None
    if data is None:
        try:
            data = sys.stdin.buffer.read(most + 1)
        except (OSError, ValueError) as error:
            raise UnreadableFileError(STANDARD_INPUT, f"standard input cannot be read: {error}") from None
        if guard is not None:
            guard.standard_input = data
    if len(data) > most:
        raise UnreadableFileError(STANDARD_INPUT, f"standard input is larger than {_size(most)}")
    return data


def read_text(path: PathLike, most: int = MOST_BYTES, what: str = "a file") -> str:
    """The content of a file as UTF-8 text.

    Raises
    ------
    UnreadableFileError
        as `read_bytes`, and when it is no such text.
    """
    try:
        return read_bytes(path, most, what).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise UnreadableFileError(path, "the file is not UTF-8 text", is_other_content=True) from None


def obstacle(path: PathLike) -> str | None:
    """The reason why there is nothing to read at a path: no such file, or no regular one; None where there is.

    A phrase for a message, such as "is a folder".
    """
    try:
        mode = Path(path).stat().st_mode
    except (OSError, ValueError) as error:
        return _why(path, error)
    return None if stat.S_ISREG(mode) else _other_kind(mode)


def real(path: PathLike) -> Path:
    """The canonical path of a file, without links and dots, the same for every spelling.

    Unchanged where that is not possible: no name has a NUL, and symbolic links may lead in a cycle.
    """
    try:
        return Path(os.path.realpath(path))
    except (OSError, ValueError):
        return Path(path)


def _other_kind(mode: int) -> str:
    kind = next((words for is_kind, words in _KINDS if is_kind(mode)), "something else")
    return f"expected a file, this is {kind}"


def _why(path: PathLike, error: OSError | ValueError) -> str:
    if isinstance(error, FileNotFoundError | NotADirectoryError | ValueError):  # no name has a NUL
        return "no such file"
    if error.errno == errno.ELOOP:
        return "cannot be read: its symbolic links lead in a cycle"
    try:
        mode = Path(path).stat().st_mode
    except OSError:
        mode = stat.S_IFREG
    return f"cannot be read: {error.strerror}" if stat.S_ISREG(mode) else _other_kind(mode)


def _size(count: int) -> str:
    return f"{count // 10**6} MB" if count >= 10**6 else f"{count} B"
