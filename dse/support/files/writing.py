"""Files that are written: claimed by the run's guard, whole or not at all, in place of what was there."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from dse.support.errors import UsageError
from dse.support.files.guard import PathLike, current

PAGES = (".html", ".htm", ".md")
"""How the names of pages end, which reports are written as."""
READER_WAIT_S = 10.0
"""Seconds that a named pipe waits for somebody to read from it."""


def check_writable(*paths: PathLike | None) -> None:
    """Fail before the work rather than after it when a file could not be written; None and ``-`` are none.

    Raises
    ------
    UsageError
        naming the path.
    """
    for path in paths:
        if path is None or path == "-":
            continue
        try:
            reason = _obstacle(Path(path))
        except (OSError, ValueError) as error:
            strerror = error.strerror if isinstance(error, OSError) else None
            looped = isinstance(error, OSError) and error.errno == errno.ELOOP
            reason = "its symbolic links lead in a cycle" if looped else strerror or str(error)
        if reason is not None:
            raise UsageError(f"{path}: {reason}")


def _obstacle(path: Path) -> str | None:
    """Why a file cannot be written, in words; None where nothing stands in the way."""
    folder = Path(os.path.realpath(path)).parent
    if not folder.is_dir():
        named = path.parent if not path.is_symlink() else folder
        return f"there is no folder {str(named)!r}"
    try:
        status = path.stat()
    except FileNotFoundError:
        status = None
    if status is not None:
        if stat.S_ISDIR(status.st_mode):
            return "is a folder"
        if stat.S_ISSOCK(status.st_mode) or stat.S_ISBLK(status.st_mode):
            return "is no file that can be written to"
        if not os.access(path, os.W_OK):
            return "cannot be written to"
        if not stat.S_ISREG(status.st_mode):
            return None
    if not os.access(folder, os.W_OK):
        return "the folder cannot be written to"
    return None


def utf8(text: str) -> bytes:
    r"""A text as it is written; names of files that are no UTF-8 have a question mark in place of each such byte.

    >>> utf8("a\udcff.yaml")
    b'a?.yaml'
    """
    return text.encode("utf-8", "replace")


def is_stream(path: PathLike) -> bool:
    """Whether something is there that is no regular file: it is written to, not replaced.

    For example ``/dev/null`` or a named pipe.
    """
    return Path(path).exists() and not Path(path).is_file()


def write_file(path: PathLike, content: str | bytes) -> None:
    """Put a file in place of what is there, in one step: a reader finds the old one or the new one.

    A symbolic link is followed, and stays. The mode of what is replaced is kept; where the file has further hard links
    they keep the old content. Pipes and devices are written to as they are; a pipe that nobody opens to read within
    `READER_WAIT_S` is given up.

    Raises
    ------
    UsageError
        when it is an input or another output of the run under way.
    OSError
        when it cannot be written; then what was there is there still.
    """
    data = utf8(content) if isinstance(content, str) else content
    guard = current()
    if guard is not None and not guard.is_claimed(path):
        guard.claim(path)
    if is_stream(path):
        with os.fdopen(_opened(path), "wb") as stream:
            stream.write(data)
        return
    _replace(Path(os.path.realpath(path)), data)
    if guard is not None:
        guard.replaced(path)


def _opened(path: PathLike) -> int:
    """A pipe or device to write to; to open a pipe is to wait for its reader, which may never come."""
    patience = time.monotonic() + READER_WAIT_S
    while True:
        try:
            handle = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
        except OSError as error:
            if error.errno != errno.ENXIO:
                raise
            if time.monotonic() >= patience:
                raise OSError(errno.ENXIO, "no program reads from this pipe", os.fspath(path)) from error
            time.sleep(0.05)
        else:
            os.set_blocking(handle, True)
            return handle


def write_files(folder: Path, files: Iterable[tuple[str, str | bytes]]) -> list[Path]:
    """Write files into a folder, each whole or not at all; returns their paths. All are claimed before the first.

    `files` are pairs of a name and its content, text or bytes. Raises `OSError` where a file cannot be written,
    `UsageError` where an output would overwrite an input.
    """
    waiting = [(folder / name, content) for name, content in files]
    guard = current()
    for path, _ in waiting:
        if guard is not None and not guard.is_claimed(path):
            guard.claim(path)
    for path, content in waiting:
        write_file(path, content)
    return [path for path, _ in waiting]


def _replace(target: Path, content: bytes) -> None:
    """Write a file next to the target, then rename it to the target."""
    try:
        before = target.stat()
    except FileNotFoundError:
        before = None
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=".dse-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        _dress(Path(name), before)
        Path(name).replace(target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _dress(path: Path, before: os.stat_result | None) -> None:
    """The mode (and, where that may be given, the owner) of what is replaced; else what a new file has."""
    if before is None:
        umask = os.umask(0)
        os.umask(umask)
        path.chmod(0o666 & ~umask)
        return
    mine = path.stat()
    if hasattr(os, "chown") and (mine.st_uid, mine.st_gid) != (before.st_uid, before.st_gid):
        with suppress(OSError):
            os.chown(path, before.st_uid, before.st_gid)
    path.chmod(stat.S_IMODE(before.st_mode) & 0o777)
