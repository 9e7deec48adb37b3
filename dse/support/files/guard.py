"""The files that a run reads and writes, so that no output takes the place of an input or of another output.

Files are distinguished by device and inode, not by the spelling of their paths; files that do not exist yet by their
place in their folder. A run of the command line has one guard, set by `guarding`; everything that `dse.support.files`
reads is noted there, and everything that it writes is claimed.
"""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from dse.support.errors import UsageError

PathLike: TypeAlias = str | os.PathLike[str]
Key: TypeAlias = tuple[int, int, str]
"""Device, inode and "" of a file that is there; of its folder and its name, of any file."""


def _keys_of(path: PathLike) -> frozenset[Key]:
    """The keys that identify a regular file, or one that does not exist yet; none for pipes and devices."""
    real = Path(os.path.realpath(path))
    keys: set[Key] = set()
    try:
        status = real.stat()
        if not stat.S_ISREG(status.st_mode):
            return frozenset()
        keys.add((status.st_dev, status.st_ino, ""))
    except OSError:
        pass
    try:
        folder = real.parent.stat()
        keys.add((folder.st_dev, folder.st_ino, real.name))
    except OSError:
        pass
    return frozenset(keys)


@dataclass
class Guard:
    """The inputs (what each is) and outputs (by what name) of one run, by their keys.

    An input that is noted after its place was claimed is refused as well: includes and samples are known late, but
    before the work.
    """

    inputs: dict[Key, str] = field(default_factory=dict)
    outputs: dict[Key, str] = field(default_factory=dict)
    renewed: set[Key] = field(default_factory=set)
    standard_input: bytes | None = None
    """The content that was read there, so that it can be read again."""

    def note(self, path: PathLike, what: str = "a file") -> None:
        """An input, and what it is.

        Raises
        ------
        UsageError
            when it is to be written over.
        """
        keys = _keys_of(path)
        for key in keys - self.renewed:
            if key in self.outputs:
                raise _input(self.outputs[key], what)
        self.inputs.update(dict.fromkeys(keys, what))

    def claim(self, path: PathLike, *, renews: PathLike | None = None) -> None:
        """An output; `renews` is an input that it may take the place of, because it holds all that was there.

        Raises
        ------
        UsageError
            when it is an input, or another output.
        """
        name, keys = os.fspath(path), _keys_of(path)
        if renews is not None:
            self.renewed |= keys & _keys_of(renews)
        for key in keys - self.renewed:
            if key in self.inputs:
                raise _input(name, self.inputs[key])
        for key in keys:
            if key in self.outputs:
                raise _output(name, self.outputs[key])
        if keys & _standard_output():
            raise UsageError(f'{name}: is where standard output goes, too; "-" writes to it')
        self.outputs.update(dict.fromkeys(keys, name))

    def is_claimed(self, path: PathLike) -> bool:
        """Whether this very output was claimed before.

        Files are distinguished by device and inode, so that links to one file count as one.
        """
        return any(self.outputs.get(key) == os.fspath(path) for key in _keys_of(path))

    def replaced(self, path: PathLike) -> None:
        """A claimed output is another file now, in the same place: the inode of the old one may serve again.

        Called after an atomic replacement; the new file takes over the claim.
        """
        name = os.fspath(path)
        self.outputs = {key: known for key, known in self.outputs.items() if known != name or key[2]}
        self.outputs.update(dict.fromkeys(_keys_of(path), name))


def _input(output: str, what: str) -> UsageError:
    return UsageError(f"{output}: is {what} that this command reads, and is not overwritten; give another name")


def _output(name: str, other: str) -> UsageError:
    if name == other:
        return UsageError(f"{name}: is asked for twice; each output needs a name of its own")
    return UsageError(f"{name}: is the same file as {other}; each output needs a name of its own")


def _standard_output() -> frozenset[Key]:
    """The file that standard output was redirected to; nothing for terminals and pipes."""
    try:
        status = os.fstat(sys.stdout.fileno())
    except (OSError, ValueError, AttributeError):
        return frozenset()
    return frozenset({(status.st_dev, status.st_ino, "")}) if stat.S_ISREG(status.st_mode) else frozenset()


_CURRENT: ContextVar[Guard | None] = ContextVar("guard", default=None)


def current() -> Guard | None:
    """The guard of the run under way.

    None outside of `guarding`.
    """
    return _CURRENT.get()


@contextmanager
def guarding(*inputs: PathLike) -> Iterator[Guard]:
    """A guard for what is done inside, on top of the one around it; `inputs` must not be written over.

    Nested guards share inputs and outputs. Paths are noted before the run reads them.
    """
    around = _CURRENT.get()
    guard = Guard() if around is None else Guard(around.inputs, around.outputs, around.renewed)
    token = _CURRENT.set(guard)
    try:
        for path in inputs:
            guard.note(path)
        yield guard
    finally:
        _CURRENT.reset(token)


def claim(*paths: PathLike | None, renews: PathLike | None = None) -> None:
    """Claim the outputs of the run under way; None and ``-`` (standard output) are no files.

    Raises `UsageError` where a path is an input of the run or another output; `renews` is an input that may be
    replaced.
    """
    guard = current()
    names: Sequence[PathLike] = [path for path in paths if path is not None and path != "-"]
    if guard is not None:
        for path in names:
            guard.claim(path, renews=renews)
