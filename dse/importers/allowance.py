"""How much a file may ask for: a few lines of it can make more texts and parts than there is memory or time.

Files include each other, lists hold lists, components hold arrays of arrays. So whatever is read, built or gone through
counts against one allowance of the import, which looks at the clock as it is used up.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from dse.support.errors import Diagnostic, ProblemError
from dse.support.timelimit import StepCounter

PIECES = 1_000_000
"""Steps, values and entries of one import of launch files; a part of a file counts as several."""
MOST_TEXT = 100_000
"""The greatest number of characters of one text."""
CHARACTERS = 32
"""The number of characters that count as one piece."""


class TooMuchError(Exception):
    """The allowance is used up; the message says what was too much.

    Caught by the importer, which makes a located message of it.
    """


@dataclass
class _Allowance:
    pieces: int
    left: int
    work: StepCounter


_CURRENT: ContextVar[_Allowance | None] = ContextVar("allowance", default=None)


@contextmanager
def allowed(pieces: int = PIECES) -> Iterator[None]:
    """Give everything that is read in the ``with`` block one common allowance.

    `pieces` is the number of parts and texts; expansion beyond it raises `TooMuchError`.
    """
    token = _CURRENT.set(_Allowance(pieces, pieces, StepCounter()))
    try:
        yield
    finally:
        _CURRENT.reset(token)


def spend(pieces: int = 1) -> None:
    """Use up a part of the allowance in force; without one nothing is counted.

    Raises
    ------
    TooMuchError
        when nothing is left.
    OutOfTime
        when the time of the limit in force is up.

    Examples
    --------
    >>> with allowed(10):
    ...     spend(11)
    Traceback (most recent call last):
    dse.importers.allowance.TooMuchError: more than 10 steps, values and entries
    """
    allowance = _CURRENT.get()
    if allowance is None:
        return
    allowance.left -= pieces
    if allowance.left < 0:
        raise TooMuchError(f"more than {allowance.pieces:,} steps, values and entries")
    allowance.work.go_on(pieces)


def spend_text(text: str) -> str:
    """Use up what a text counts; returns it.

    Raises
    ------
    TooMuchError
        when it is too long, or nothing of the allowance is left.
    """
    if len(text) > MOST_TEXT:
        raise TooMuchError(f"a text of more than {MOST_TEXT:,} characters")
    spend(1 + len(text) // CHARACTERS)
    return text


@contextmanager
def at(path: Path, line: int) -> Iterator[None]:
    """Report input that is too large, or nested too deeply, as a mistake of a file.

    Raises
    ------
    ProblemError
        when it is.
    """
    try:
        yield
    except (TooMuchError, RecursionError) as error:
        raise too_much(path, line, error) from None


def too_much(path: Path, line: int, error: TooMuchError | RecursionError) -> ProblemError:
    """The mistake of a file that what it says is too much to read, or nested too deeply."""
    why = str(error) if isinstance(error, TooMuchError) else "it is nested too deeply, or contains itself"
    return ProblemError([Diagnostic(f"too large to be read: {why}", "", str(path), line, 0)])
