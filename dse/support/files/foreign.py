"""Where an error of a library becomes a mistake in the file that it reads, with its place."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TypeAlias

from dse.support.errors import Diagnostic, DseError, ProblemError
from dse.support.files.guard import PathLike

LONGEST = 200
"""The number of characters of a library's words that are shown."""
WITHOUT_WORDS = (LookupError, TypeError, AttributeError, AssertionError, ArithmeticError)
"""Errors whose words mean nothing without their kind: ``KeyError: 'topic'``."""
_PLACE = re.compile(r"\bline (\d+)(?:, column (\d+))?")
Place: TypeAlias = tuple[int, int]
"""Line and column, from 1; 0: unknown."""


@contextmanager
def reading(
    path: PathLike, what: str, hint: str = "is it cut off?", place: Callable[[str], Place] = lambda words: (0, 0)
) -> Iterator[None]:
    """Stop with a located mistake wherever a library fails on a file; only the calls of the library stand inside.

    A library raises whatever its authors did not think of when a file is damaged (`struct.error`, `KeyError`, errors of
    its own base class), so that no list of errors is ever complete. Errors of dse pass, and so does what a function of
    dse raises that the library calls: that is a bug.

    Parameters
    ----------
    path
        the file.
    what
        what it is not, such as ``not XML``: the beginning of the message, before the words of the library.
    hint
        what may be the reason.
    place
        finds line and column from the words of the library, where the error itself does not have them.

    Raises
    ------
    ProblemError
        in place of an error of the library.
    """
    try:
        yield
    except DseError:
        raise
    except Exception as error:  # the one place that tells what a library raises
        if _is_ours(error.__traceback__):
            raise
        words = _words_of(error)
        line, column = _place_of(error) or place(words)
        text = f"{what}: {words[:LONGEST]}"
        raise ProblemError([Diagnostic(text, "", str(path), line, column, hint)]) from None


def _words_of(error: Exception) -> str:
    """The message of a library's error on one line, without the place that it names.

    >>> _words_of(KeyError("topic")), _words_of(ValueError("no element found: line 1, column 7")), _words_of(EOFError())
    ("KeyError: 'topic'", 'no element found', 'EOFError')
    """
    if isinstance(error, MemoryError):
        return "it takes more memory than there is"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, ValueError) and "integer string conversion" in str(error):
        return "it has a number of too many digits"
    said = getattr(error, "problem", None) or getattr(error, "context", None)  # those of yaml tell the place after it
    said = said if isinstance(said, str) else getattr(error, "strerror", None) or str(error)
    words = " ".join(said.split())
    has_place = getattr(error, "lineno", None) is not None
    words = words if not (has_place or _PLACE.search(words)) else re.sub(r":? line \d+, column \d+$", "", words)
    if isinstance(error, WITHOUT_WORDS) or not words:
        return f"{type(error).__name__}: {words}".rstrip(": ")
    return words


def _place_of(error: Exception) -> Place | None:
    """The place that an error has, as those of yaml and expat do, or names in its words."""
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    if mark is not None:
        return mark.line + 1, mark.column + 1
    line, offset = getattr(error, "lineno", None), getattr(error, "offset", None)
    if isinstance(line, int) and isinstance(offset, int):
        return line, offset + 1
    named = _PLACE.search(str(error))
    return (int(named[1]), max(1, int(named[2] or 0))) if named else None


def _is_ours(trace: TracebackType | None) -> bool:
    """Whether a function of dse raised it that the library called: below the frames of `reading` and of its block."""
    modules = []
    while trace is not None:
        modules.append(str(trace.tb_frame.f_globals.get("__name__", "")))
        trace = trace.tb_next
    return len(modules) > 2 and modules[-1].startswith("dse.")
