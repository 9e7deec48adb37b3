"""Parts of all commands: the options of a question, files in and out, the console."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from dse.cli.printing import in_a_line, tell, visible
from dse.importers.registry import MOST_LOOKED_AT, is_model
from dse.support.errors import UsageError, nearest
from dse.support.files import writing as files
from dse.support.files.guard import PathLike, claim
from dse.support.files.reading import UnreadableFileError, beginning
from dse.support.timelimit import TimeLimit, until

if TYPE_CHECKING:
    from rich.console import Console

    from dse.questions.problem import Problem

F = TypeVar("F", bound=Callable[..., Any])
PIPED_WIDTH = 160
"""How wide what goes into a file or a pipe is, where COLUMNS does not say."""
SCREEN = 39
"""Lines of an answer in a file or a pipe, where LINES does not say: a screen of 40 without the line of the prompt."""
LEAST_LINES = 15
"""Lines of an answer in a window that is lower than this: less would be no answer."""


class ExistingPath(click.Path):
    """A path that must be there; a misspelt one is answered with the nearest name of its folder.

    A `click.Path` with ``exists=True`` and a better message.
    """

    def __init__(self, *, dir_okay: bool = True, allow_dash: bool = False) -> None:
        super().__init__(exists=True, dir_okay=dir_okay, allow_dash=allow_dash)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path as it is."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            near = None if os.path.lexists(value) else _near(Path(value))
            if near is None:
                raise
            self.fail(f"{error.message.rstrip('.')}. (Did you mean {str(near)!r}?)", param, ctx)


def _near(path: Path) -> Path | None:
    """The file of the same folder whose name is the nearest."""
    try:
        there = [entry.name for entry in path.parent.iterdir()]
    except (OSError, ValueError):
        return None
    near = nearest(path.name, there, 0.75)
    return path.with_name(near) if near else None


def _example_in(folder: str | os.PathLike[str]) -> str:
    """A problem file of a folder, as an example; empty where it has none."""
    try:
        there = sorted(path for path in Path(folder).iterdir() if path.suffix in (".yaml", ".yml"))
    except OSError:
        return ""
    return next((f" such as {str(path)!r}" for path in there if _holds_a_problem(path)), "")


class ProblemPath(ExistingPath):
    """A problem file, a model, or a folder that holds one.

    A folder without AADL models, and ``RESULT.json#ID``, are refused with what to write instead.
    """

    def __init__(self) -> None:
        super().__init__(allow_dash=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path as it is."""
        file, mark, number = str(value).rpartition("#")
        if mark and number.isdigit() and Path(file).is_file() and not Path(str(value)).exists():
            self.fail(f"{value} is an alternative of a result: give the problem file, and --design {value}", param, ctx)
        path = super().convert(value, param, ctx)
        if Path(str(path)).is_dir() and not is_model(Path(str(path))):
            self.fail(
                f"{str(path)!r} is a folder without AADL models: name a problem file{_example_in(path)}.", param, ctx
            )
        return path


def problem_argument(*, required: bool = True) -> Callable[[F], F]:
    """The problem file, or a model with ``--root``, ``--mode``, ``--library``: then the command has a `dse.Model`.

    A decorator; `required` False is for commands that also work without a file.
    """

    def decorate(command: F) -> F:
        @wraps(command)
        def asked(*arguments: Any, root: str | None, mode: str | None, library: tuple[str, ...], **options: Any) -> Any:
            if (root or mode or library) and options["file"] is not None:
                from dse.questions.problem import Model

                if str(options["file"]) == "-" or not is_model(Path(options["file"])):
                    option = "--root" if root else "--mode" if mode else "--library"
                    raise UsageError(f"{option} is for AADL models, and {options['file']} is none: leave it out")
                options["file"] = Model(options["file"], root, mode, library)
            return command(*arguments, **options)

        decorated = click.argument("file", type=ProblemPath(), required=required)(cast(F, asked))
        decorated = click.option("--mode", metavar="MODE", help="AADL models: the mode of the system, or PATH.MODE.")(
            decorated
        )
        text = "AADL models: a folder with packages that the model imports; may be repeated."
        decorated = click.option("--library", multiple=True, metavar="DIR", help=text)(decorated)
        text = "AADL models: the system implementation, package::type.implementation."
        return click.option("--root", metavar="NAME", help=text)(decorated)

    return decorate


def load_told(file: str | os.PathLike[str]) -> Problem:
    """The problem of a file or model; standard error says what the import of a model has left out.

    Raises `ProblemError` with every mistake of the file.
    """
    from dse.questions.problem import Model, load

    problem = load(file if isinstance(file, Model) else Path(file))
    for item in problem.loaded.told:
        tell(in_a_line(str(item)))
    return problem


def json_option(command: F) -> F:
    """``--json PATH``."""
    text = "Also write JSON; - for standard output (then nothing else goes there)."
    return click.option("--json", "json_path", metavar="PATH", help=text)(command)


def all_option(command: F) -> F:
    """``--all``, as `every`: of a command whose answer is on one screen otherwise."""
    text = "Print every row, design and conflict, not only what fits on one screen."
    return click.option("--all", "every", is_flag=True, help=text)(command)


def quiet_option(command: F) -> F:
    """``-q``."""
    text = "Print nothing, except what --json - or --csv - write to standard output."
    return click.option("-q", "--quiet", is_flag=True, help=text)(command)


def time_limit_option(what: str) -> Callable[[F], F]:
    """``--time-limit``: a `TimeLimit` that begins with the command; `what` there is when it comes.

    A decorator; the deadline begins when the option is read, so that loading counts.
    """
    text = f"Stop after this time {what} (exit code 5), e.g. 60 (seconds) or 2min."
    begun = lambda ctx, param, value: TimeLimit.after(value)  # noqa: E731 (as click calls it)
    return click.option("--time-limit", type=Seconds(), callback=begun, metavar="DURATION", help=text)


def in_time(command: F) -> F:
    """``--time-limit`` of a command whose answer is whole or none: it ends with a message and exit code 5.

    A decorator; the limit is in force (`until`) around the whole command.
    """

    @wraps(command)
    def limited(*arguments: Any, time_limit: TimeLimit, **options: Any) -> Any:
        with until(time_limit):
            return command(*arguments, **options)

    return cast(F, time_limit_option("without an answer")(limited))


class Seconds(click.ParamType[float]):
    """A limit on the time of a run: seconds, or a duration with its unit (which times of the system always need)."""

    name = "duration"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Seconds from ``90``, ``90s`` or ``1.5 min``."""
        from dse.support.arguments import read_span
        from dse.support.units import UnitError

        try:
            seconds = read_span(str(value))
        except UnitError as error:
            self.fail(f"{value!r}: {error.message}", param, ctx)
        if seconds <= 0:
            self.fail("a time limit is positive", param, ctx)
        return seconds


def report_folder(path: str) -> Path:
    """The folder of a report, made if need be; fails before the work rather than after it.

    Raises
    ------
    UsageError
        when it cannot be written to.
    """
    folder = Path(path)
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{path}: is a file; -o names the folder that reports go to")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror or error}") from error
    if not os.access(folder, os.W_OK):
        raise UsageError(f"{path}: the folder cannot be written to")
    return folder


def tell_carried(file: str | Path, *, is_carried: bool) -> None:
    """Say on standard error that the problem file is not there, and what was worked with instead.

    Nothing is printed where the file is there.
    """
    if is_carried:
        what = f"{file} names files that are not there" if Path(file).is_file() else f"{file} is not there"
        tell(f"dse: {what}: working with the problem that the result itself carries")


def console(*, quiet: bool = False, err: bool = False) -> Console:
    """A console that neither cuts tables in a pipe nor fails on a terminal without UTF-8; COLUMNS is its width.

    A rich `Console` without colours in a pipe; `quiet` prints nothing, `err` goes to standard error.
    """
    from rich.console import Console
    from rich.text import Text

    class PipedConsole(Console):
        """Goes on without a reader that has gone: files are still written, and the exit code stays what it means."""

        def on_broken_pipe(self) -> None:
            discard_output()

        def render_str(self, text: str, **how: Any) -> Text:
            """Every text that is printed, before it is measured: nothing in it steers the terminal."""
            return super().render_str(visible(text), **how)

    stream = sys.stderr if err else sys.stdout
    if hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="replace")
    stated = os.environ.get("COLUMNS", "")
    width = None if stream.isatty() or (stated.isascii() and stated.isdecimal() and int(stated)) else PIPED_WIDTH
    return PipedConsole(file=stream, quiet=quiet, width=width, highlight=False, soft_wrap=False, emoji=False)


def screen_lines(screen: Console) -> int:
    """The number of lines that an answer may take, without that of the prompt.

    From LINES, else from the terminal, at least `LEAST_LINES`; `SCREEN` where the output is no terminal.
    """
    stated = os.environ.get("LINES", "")
    if stated.isascii() and stated.isdecimal() and int(stated):
        return max(int(stated) - 1, LEAST_LINES)
    return max(screen.height - 1, LEAST_LINES) if screen.is_terminal else SCREEN


def check_writable(*paths: PathLike | None, renews: PathLike | None = None, replaces_problems: bool = False) -> None:
    """Claim the outputs of a command, before its work: nothing that it reads may be among them, nor one of them twice.

    `renews` is an input that an output may take the place of, because all that was there is in it. A problem file is
    only written over by what is one itself.

    Raises
    ------
    UsageError
        naming the path; also from whatever reads such a file later.
    """
    files.check_writable(*paths)
    claim(*paths, renews=renews)
    for path in () if replaces_problems else paths:
        if path is not None and path != "-" and Path(path).is_file() and _holds_a_problem(path):
            raise UsageError(f"{path}: is a problem file, and is not overwritten; give another name")


def _holds_a_problem(path: PathLike) -> bool:
    """Whether the file that is there is a problem file."""
    from dse.spec.loading.recognition import is_problem

    try:
        return is_problem(beginning(path, MOST_LOOKED_AT).decode("utf-8", "replace"))
    except UnreadableFileError:
        return False


def write_text(path: str, text: str) -> None:
    """Write a file whole or not at all; ``-`` is standard output.

    UTF-8; a reader of standard output that has gone is no error. Raises `OSError` for a file that cannot be written.
    """
    if path == "-":
        try:
            sys.stdout.buffer.write(files.utf8(text))
            sys.stdout.flush()
        except BrokenPipeError:
            discard_output()
        return
    files.write_file(path, text)


def save(*files: tuple[str | None, Callable[[], str]]) -> OSError | None:
    """Write each file that is asked for; returns the first failure, so that what was computed can still be shown.

    `files` are pairs of a path and a function that makes the text; files with the path None are not made.
    """
    failure: OSError | None = None
    for path, text in files:
        if path is None:
            continue
        try:
            write_text(path, text())
        except OSError as error:
            failure = failure or named(error, path)
    return failure


def named(error: OSError, path: str) -> OSError:
    """The error with the path that the user gave: writing to a full disk names none.

    A new `OSError` where the original has no file name.
    """
    return error if error.filename or path == "-" else OSError(error.errno, error.strerror, path)


def discard_output() -> None:
    """The reader has gone: nothing more can be written, and Python must not try at exit.

    Standard output goes to the null device from now on, so that the exit code stays that of the answer.
    """
    devnull = os.open(os.devnull, os.O_WRONLY)
    os.dup2(devnull, sys.stdout.fileno())
    os.close(devnull)
