"""Mistakes in the user's words: diagnostics, and the exceptions that carry them.

Every exception knows the exit code that the command line answers with.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

EXIT_COMPLETE = 0
EXIT_USAGE = 2
EXIT_INVALID = 3
EXIT_NO = 4
EXIT_INCOMPLETE = 5
EXIT_BUG = 70
EXIT_MEANINGS = {
    EXIT_COMPLETE: "done",
    EXIT_USAGE: "wrong usage",
    EXIT_INVALID: "the problem file is wrong",
    EXIT_NO: "the answer is no",
    EXIT_INCOMPLETE: "stopped early",
    EXIT_BUG: "a bug of dse",
}
"""The meaning of each exit code, whichever command answers with it; docs/commands.md has those of each."""

LONGEST_COMPARED = 200
"""Letters of a name that are compared with known ones."""


@dataclass(frozen=True)
class Diagnostic:
    """One finding about a problem file.

    `line` and `column` count from 1 (0: unknown); `path` is the dotted place in the data, such as
    ``threads.nav.period``; `hint` names the closest valid name or the allowed values.

    Examples
    --------
    >>> print(Diagnostic("unknown key", "threds", "p.yaml", 3, 1, 'did you mean "threads"?'))
    p.yaml:3:1: threds: unknown key (did you mean "threads"?)
    """

    message: str
    path: str = ""
    file: str = ""
    line: int = 0
    column: int = 0
    hint: str = ""
    severity: Literal["error", "warning"] = "error"

    def __str__(self) -> str:
        place = ":".join([self.file] + [str(n) for n in (self.line, self.column) if n])
        words = [part for part in (place, self.path) if part]
        if self.severity == "warning":
            words.append("warning")
        text = ": ".join([*words, self.message])
        return f"{text} ({self.hint})" if self.hint else text


class Suggestion(str):
    """A hint of what could have been meant: it lists names, and tells nothing of them.

    Examples
    --------
    >>> Suggestion('did you mean "threads"?').partition(" ")[0]
    'did'
    """


def nearest(name: str, known: Iterable[str], likeness: float = 0.6) -> str:
    """The known name that is closest to a name which is none of them; empty where none is at least so alike.

    Capitals count for nothing.

    Examples
    --------
    >>> nearest("Aperiodic", ["periodic", "aperiodic"]), nearest("WCTE", ["wcet"], 0.5), nearest("x", ["period"])
    ('aperiodic', 'wcet', '')
    """
    from difflib import get_close_matches

    folded: dict[str, str] = {}
    for item in known:
        folded.setdefault(item.casefold(), item)
    wanted = name[:LONGEST_COMPARED].casefold()
    close = [wanted] if wanted in folded else get_close_matches(wanted, folded, 1, likeness)
    return folded[close[0]] if close else ""


def did_you_mean(name: str, known: Iterable[str], likeness: float = 0.6) -> Suggestion:
    """``did you mean "x"?`` for the known name that is closest; empty where none is at least so alike.

    Names that look alike are distinguished.

    Examples
    --------
    >>> print(did_you_mean("mean power", ["mean  power"]))
    did you mean "mean  power"? It differs in its blanks or in the codes of its letters
    """
    close = nearest(name, known, likeness)
    if not close:
        return Suggestion()
    from unicodedata import normalize

    ours, theirs = (" ".join(normalize("NFKC", item).split()) for item in (name, close))
    alike = " It differs in its blanks or in the codes of its letters" if ours == theirs else ""
    return Suggestion(f'did you mean "{close}"?{alike}')


def in_order(findings: Iterable[Diagnostic], files: Sequence[str]) -> list[Diagnostic]:
    """Findings by file, in the order given, other files behind them; then by line and column.

    A new list; `files` are names in the order of inclusion.
    """
    order = {file: number for number, file in enumerate(files)}
    return sorted(findings, key=lambda item: (order.get(item.file, len(order)), item.file, item.line, item.column))


class DseError(Exception):
    """Base of all errors that the user can correct; `exit_code` is the process's answer.

    Examples
    --------
    >>> import dse
    >>> try:
    ...     dse.load("pump.yaml").ask(max_jitter="20")
    ... except DseError as error:
    ...     error.exit_code
    2
    """

    exit_code = EXIT_USAGE


class Wording:
    """Whether messages speak of options, as the command line has them; of keywords of Python else.

    Set by `dse.cli.main.run` around a command; messages are written with options and translated for Python.
    """

    options = False


def _with_keywords(text: str) -> str:
    """A message about options as one about the keywords of Python.

    Commands, in backquotes, stay what they are.

    >>> _with_keywords("--max-jitter 20: expected a limit; `dse solve --json r.json` writes one")
    'max_jitter 20: expected a limit; `dse solve --json r.json` writes one'
    """
    option = r"(`[^`]*`)|(?<![\w-])--([a-z]+(?:-[a-z]+)*)"
    return re.sub(option, lambda match: match[1] or match[2].replace("-", "_"), text)


class UsageError(DseError):
    """The call is wrong: an unknown option value, an expression that does not parse, an incomplete design.

    Examples
    --------
    >>> import dse
    >>> try:
    ...     dse.solve("pump.yaml", max_jitter="20")
    ... except UsageError as error:
    ...     str(error)
    'max_jitter 20: expected a limit with its unit for jitter of sensor_to_valve, got a bare number (such as 20 ms)'
    """

    def __str__(self) -> str:
        """The message, which speaks of options on the command line alone."""
        text = super().__str__()
        return text if Wording.options else _with_keywords(text)


@contextmanager
def about(path: object) -> Iterator[None]:
    """Add the path of a file to each `UsageError` about its use.

    Raises
    ------
    UsageError
        as raised inside, with the path before it unless that is named already.
    """
    try:
        yield
    except UsageError as error:
        if str(path) in str(error):
            raise
        raise UsageError(f"{path}: {error}") from error


class ProblemError(DseError):
    """The problem file is wrong; holds every diagnostic found, in file order.

    Examples
    --------
    >>> import dse
    >>> try:
    ...     dse.load({"dse": 1, "name": "x", "threds": {}})
    ... except ProblemError as error:
    ...     error.diagnostics[0].message, error.diagnostics[0].hint
    ('unknown key', 'did you mean "threads"?')
    """

    exit_code = EXIT_INVALID

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(str(item) for item in self.diagnostics))


class TooLargeError(DseError):
    """The figures are such that sums leave the range of exact arithmetic; says which.

    Exit code 3: the problem must be stated with coarser figures.
    """

    exit_code = EXIT_INVALID


class UncheckedError(DseError):
    """Requirements of the problem cannot be compared with anything, so that nothing can be proved; says which.

    Exit code 3; the message names each requirement with the reason.
    """

    exit_code = EXIT_INVALID


class RefereeError(AssertionError):
    """The solver's figures and the analysis disagree: a bug of ours, never the user's.

    The run stops with both figures; please report it with the problem file.
    """
