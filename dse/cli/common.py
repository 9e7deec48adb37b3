"""What commands share: the options of a question, files in and out, the console."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import wraps
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from dse.api.limited import LIMITED
from dse.errors import UsageError
from dse.extras import how_to_install, is_installed
from dse.files import writing as files
from dse.files.guard import PathLike, claim
from dse.importers.registry import is_model
from dse.timelimit import TimeLimit, until

if TYPE_CHECKING:
    from rich.console import Console

    from dse.api.problem import Problem
    from dse.api.question import Question
    from dse.report.page import Page

F = TypeVar("F", bound=Callable[..., Any])
ORDER = f"{__name__}.order"
PAGES = (".html", ".htm", ".md")
"""How the names of pages end."""
PIPED_WIDTH = 160
"""How wide what goes into a file or a pipe is, where COLUMNS does not say."""


class Words(click.Choice[str]):
    """One of some words, also in the spelling of the problem file: ``response-time`` or ``response_time``."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The word as the problem file has it."""
        return super().convert(str(value).replace("_", "-"), param, ctx).replace("-", "_")


class ProblemPath(click.Path):
    """A problem file, a model, or a folder that holds one."""

    def __init__(self) -> None:
        super().__init__(exists=True, allow_dash=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path as it is."""
        path = super().convert(value, param, ctx)
        if Path(str(path)).is_dir() and not is_model(Path(str(path))):
            self.fail(f"File {str(path)!r} is a directory.", param, ctx)
        return path


def problem_argument(*, required: bool = True) -> Callable[[F], F]:
    """The problem file, or a model with ``--root`` and ``--mode``: then the command is given a `dse.Model`."""

    def decorate(command: F) -> F:
        @wraps(command)
        def asked(*arguments: Any, root: str | None, mode: str | None, **options: Any) -> Any:
            if (root or mode) and options["file"] is not None:
                from dse.api.problem import Model

                if str(options["file"]) == "-" or not is_model(Path(options["file"])):
                    given = "--root" if root else "--mode"
                    raise UsageError(f"{given} is for AADL models, and {options['file']} is none: leave it out")
                options["file"] = Model(options["file"], root, mode)
            return command(*arguments, **options)

        found = click.argument("file", type=ProblemPath(), required=required)(cast(F, asked))
        found = click.option("--mode", metavar="MODE", help="Of an AADL model: the mode it is in, or PATH.MODE.")(found)
        text = "Of an AADL model: the system implementation, package::type.implementation."
        return click.option("--root", metavar="NAME", help=text)(found)

    return decorate


def load_told(file: str | os.PathLike[str]) -> Problem:
    """The problem of a file or model; standard error says what the import of a model has left out."""
    from dse.api.problem import Model, load

    problem = load(file if isinstance(file, Model) else Path(file))
    for item in problem.loaded.told:
        click.echo(str(item), err=True)
    return problem


OTHERS = {
    "system": ["asynchronous", "synchronous"],
    "partition_output": ["major-frame", "partition-end"],
    "best_case": ["empty-queue", "full-queue"],
    "bus_queuing": ["counted", "not-counted"],
}
"""OSATE's further settings have options as every setting has; ``--settings`` is the short way to them."""


def _osate_settings(context: click.Context, option: click.Parameter, text: str | None) -> dict[str, str]:
    """The settings that OSATE's abbreviations ask for."""
    from dse.space.settings import osate_settings

    try:
        return osate_settings(text) if text is not None else {}
    except ValueError as error:
        raise click.BadParameter(str(error), context, option) from error


def question_options(command: F) -> F:
    """Options that change the question: limits, requirements, rules, fixed decisions, settings."""
    for metric, (example, of, called, whose) in reversed(list(LIMITED.items())):
        what = f"of every {of}, or of one (NAME={example})" if of else whose
        command = click.option(
            f"--max-{metric}",
            multiple=True,
            metavar="QUANTITY",
            help=f"Limit the {called or metric} {what}, e.g. {example}.",
        )(command)
    more = (
        click.option("--require", multiple=True, metavar="TEXT", help="A further requirement or rule."),
        click.option(
            "--fix", multiple=True, metavar="'DECISION = OPTION'", help="Fix a decision in the designs that use it."
        ),
        click.option(
            "--profile", type=click.Choice(["dse", "osate-2.2", "osate-2.19"]), help="Latency rules to apply."
        ),
        click.option(
            "--worst-case",
            type=Words(["execution-time", "deadline"]),
            help="OSATE's worst-case setting (ET or DL); the dse profile does not look at it.",
        ),
        click.option(
            "--settings",
            callback=_osate_settings,
            metavar="AS-MF-ET-EQ-EQL",
            help="OSATE's settings by its abbreviations, some or all; the dse profile does not look at them.",
        ),
        *(
            click.option(f"--{name.replace('_', '-')}", type=Words(values), hidden=True)
            for name, values in OTHERS.items()
        ),
        click.option(
            "--processing",
            type=Words(["execution-time", "response-time"]),
            help="What a flow counts for a thread: its execution time, or its response time under contention.",
        ),
        click.option(
            "--deadlines",
            type=Words(["stated", "all", "none"]),
            help="Which deadlines count: those stated (told of each design), all (required; else the period), or none.",
        ),
        click.option(
            "--overload",
            type=Words(["forbidden", "allowed"]),
            help="Whether cores, bandwidths and exclusive buses may be used beyond all of them.",
        ),
    )
    for option in more:
        command = option(command)
    return command


def report_option(command: F) -> F:
    """``--report PATH`` of a command whose report is one page."""
    text = "Also write what is printed as a page: HTML (PATH.html, with plots) or Markdown (PATH.md)."
    return click.option("--report", metavar="PATH", callback=_check_report, help=text)(command)


def _check_report(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    if value is not None and not value.lower().endswith(PAGES):
        raise _no_page(value)
    if value is not None:
        tell_plots()
    return value


def check_page_or_folder(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """A report that is one page where a path is given, and files in a folder where none is."""
    if value and not value.lower().endswith(PAGES):
        raise _no_page(value)
    return value


def _no_page(path: str) -> click.BadParameter:
    """That a report cannot go to `path`."""
    text = f"{path or 'no path'}: a report is HTML or Markdown: a path that ends in {' or '.join(PAGES)}"
    return click.BadParameter(text, param_hint="'--report'")


def write_page(path: str | None, page: Page) -> OSError | None:
    """Write a page where ``--report`` says, if it was given; returns the failure to do so."""
    if path is None:
        return None
    from dse.report.writing import page_text

    return save((path, lambda: page_text(page, path)))


class OrderedCommand(click.Command):
    """A command that knows in which order its options were given; click keeps it for each option by itself only.

    Its ``--report`` has a value where a path of a page follows, and none else.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Note the names of the options, one for each time that one was given."""
        has_report = any("--report" in parameter.opts for parameter in self.params)
        if has_report:
            args = _with_reports(args)
        _, extra, given = self.make_parser(ctx).parse_args(list(args))
        behind = [path for option, path in pairwise(args) if option == "--report=" and not path.startswith("-")]
        if has_report and extra and behind:  # one word too many: it was to be the path of a page
            raise _no_page(behind[0])
        ctx.meta[ORDER] = [parameter.name for parameter in given]
        return super().parse_args(ctx, args)


def _with_reports(args: list[str]) -> list[str]:
    """The arguments with each ``--report`` and the path behind it, if there is one, as one argument.

    >>> _with_reports(["a.yaml", "--report", "-q"]), _with_reports(["--report", "a.html", "a.yaml"])
    (['a.yaml', '--report=', '-q'], ['--report=a.html', 'a.yaml'])
    """
    found: list[str] = []
    for at, given in enumerate(args):
        if given == "--":
            return found + args[at:]
        if found and found[-1] == "--report=" and args[at - 1] == "--report" and given.lower().endswith(PAGES):
            found[-1] += given
        else:
            found.append("--report=" if given == "--report" else given)
    return found


def objective_options(*, hidden: bool = False) -> Callable[[F], F]:
    """``--minimise`` and ``--maximise`` of an `OrderedCommand`; see `objectives_of`."""

    def decorate(command: F) -> F:
        what = "As for solve; changes no explanation." if hidden else "Objectives instead of those of the file."
        for name, text in (("maximis", "The same, to be maximised."), ("minimis", what)):
            names = f"--{name}e", f"--{name.removesuffix('s')}ze"
            command = click.option(*names, multiple=True, metavar="METRIC", hidden=hidden, help=text)(command)
        return command

    return decorate


def objectives_of(minimise: tuple[str, ...], maximise: tuple[str, ...]) -> tuple[str, ...]:
    """The objectives of the running command, in the order in which they were given."""
    given = {"minimise": iter(minimise), "maximise": iter(maximise)}
    order = [name for name in click.get_current_context().meta[ORDER] if name in given]
    return tuple(f"{sense} {next(given[sense])}" for sense in order)


def json_option(command: F) -> F:
    """``--json PATH``."""
    text = "Also write JSON; - for standard output (then nothing else goes there)."
    return click.option("--json", "json_path", metavar="PATH", help=text)(command)


def time_limit_option(what: str) -> Callable[[F], F]:
    """``--time-limit``: a `TimeLimit` that begins with the command; `what` there is when it comes."""
    text = f"Stop after this time {what}, e.g. 60 (seconds) or 2min (exit code 5)."
    begun = lambda ctx, param, value: TimeLimit.after(value)  # noqa: E731 (as click calls it)
    return click.option("--time-limit", type=Seconds(), callback=begun, metavar="DURATION", help=text)


def in_time(command: F) -> F:
    """``--time-limit`` of a command whose answer is whole or none: it ends with a message and exit code 5."""

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
        from dse.units import TIME, UnitError, parse_quantity

        try:
            quantity = parse_quantity(str(value))
        except UnitError as error:
            self.fail(f"{value!r}: {error.message}", param, ctx)
        if quantity.unit and quantity.dimension != TIME:
            self.fail(f'{value!r}: expected seconds or a duration with its unit, such as "2min"', param, ctx)
        if quantity.value <= 0:
            self.fail("a time limit is positive", param, ctx)
        return float(quantity.value)


class Top(click.ParamType[int | None]):
    """How many alternatives to show: a number, or ``all``."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | None:
        """None for ``all``."""
        if value is None or value == "all":
            return None
        if not str(value).isdecimal() or int(value) < 1:
            self.fail(f"{value!r}: expected a number from 1, or all", param, ctx)
        return int(value)


def ranking_options(command: F) -> F:
    """``--rank-by`` and ``--top``."""
    more = (
        click.option(
            "--top", type=Top(), default="10", show_default=True, metavar="N|all", help="How many alternatives to show."
        ),
        click.option(
            "--rank-by",
            metavar="METHOD",
            help="ideal (default), topsis, knee, baseline, weights:NAME=NUMBER,... or order:NAME,...; ideal and topsis "
            "take weights too, and what is not named weighs 0.",
        ),
    )
    for option in more:
        command = option(command)
    return command


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
    tell_plots()
    return folder


def tell_plots() -> None:
    """Say on standard error that pages have no plots, where that is so."""
    if not is_installed("plots"):
        click.echo(f"dse: a page without plots: they need {how_to_install('plots')}", err=True)


def tell_carried(file: str | Path, *, is_carried: bool) -> None:
    """Say on standard error that the problem file is not there, and what was worked with instead."""
    if is_carried:
        click.echo(f"dse: {file} is not there: working with the problem that the result itself carries", err=True)


def question_of(options: dict[str, Any], objectives: tuple[str, ...] = ()) -> Question:
    """The question that the options ask, in the words of `dse.Problem.ask`."""
    from dse.space.settings import SETTINGS

    asked: Question = {"objectives": objectives, "require": options["require"], "fix": options["fix"]}
    for name in (*(f"max_{metric}" for metric in LIMITED), *SETTINGS):
        stated, short = options.get(name), options["settings"].get(name)
        if stated and short and stated != short:
            shown = f"--{name} {stated}".replace("_", "-")
            raise UsageError(f"{shown} contradicts --settings, which says {short.replace('_', '-')}: give one of them")
        value = stated or short
        asked[name] = value  # type: ignore[literal-required]  # every one is a key of Question
    return asked


def console(*, quiet: bool = False, err: bool = False) -> Console:
    """A console that neither cuts tables in a pipe nor fails on a terminal without UTF-8; COLUMNS is its width."""
    from rich.console import Console

    class PipedConsole(Console):
        """Goes on without a reader that has gone: files are still written, and the exit code stays what it means."""

        def on_broken_pipe(self) -> None:
            discard_output()

    stream = sys.stderr if err else sys.stdout
    if hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="replace")
    stated = os.environ.get("COLUMNS", "")
    width = None if stream.isatty() or (stated.isascii() and stated.isdecimal() and int(stated)) else PIPED_WIDTH
    return PipedConsole(file=stream, quiet=quiet, width=width, highlight=False, soft_wrap=False, emoji=False)


def check_writable(*paths: PathLike | None, renews: PathLike | None = None) -> None:
    """Claim the outputs of a command, before its work: nothing that it reads may be among them, nor one of them twice.

    `renews` is an input that an output may take the place of, because all that was there is in it.

    Raises
    ------
    UsageError
        naming the path; also from whatever reads such a file later.
    """
    files.check_writable(*paths)
    claim(*paths, renews=renews)


def write_text(path: str, text: str) -> None:
    """Write a file whole or not at all; ``-`` is standard output."""
    if path == "-":
        try:
            sys.stdout.buffer.write(text.encode())
            sys.stdout.flush()
        except BrokenPipeError:
            discard_output()
        return
    files.write_file(path, text)


def save(*files: tuple[str | None, Callable[[], str]]) -> OSError | None:
    """Write each file that is asked for; returns the first failure, so that what was computed can still be shown."""
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
    """The error with the path that the user gave: writing to a full disk names none."""
    return error if error.filename or path == "-" else OSError(error.errno, error.strerror, path)


def discard_output() -> None:
    """The reader has gone: nothing more can be written, and Python must not try at exit."""
    devnull = os.open(os.devnull, os.O_WRONLY)
    os.dup2(devnull, sys.stdout.fileno())
    os.close(devnull)
