"""The options of a question, and of a ranking."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import click

from dse.cli.common import F
from dse.cli.completion import fixes, rankings
from dse.cli.grouping import GroupedCommand
from dse.cli.pages import no_page
from dse.questions.question import LIMITED
from dse.support.errors import UsageError
from dse.support.files.writing import PAGES

if TYPE_CHECKING:
    from dse.questions.question import Question

ORDER = f"{__name__}.order"


class Words(click.Choice[str]):
    """One of some words, also in the spelling of the problem file: ``response-time`` or ``response_time``.

    Underscores and hyphens are read alike; what the command gets has underscores.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The word as the problem file has it."""
        return super().convert(str(value).replace("_", "-"), param, ctx).replace("-", "_")


OTHERS = {
    "system": ["asynchronous", "synchronous"],
    "partition_output": ["major-frame", "partition-end"],
    "best_case": ["empty-queue", "full-queue"],
    "bus_queuing": ["counted", "not-counted"],
}
"""OSATE's further settings have options as every setting has; ``--settings`` is the short way to them."""


def _osate_settings(context: click.Context, option: click.Parameter, text: str | None) -> dict[str, str]:
    """The settings that OSATE's abbreviations ask for."""
    from dse.space.question.settings import osate_settings

    try:
        return osate_settings(text) if text is not None else {}
    except ValueError as error:
        raise click.BadParameter(str(error), context, option) from error


def question_options(command: F) -> F:
    """Options that change the question: limits, requirements, rules, fixed decisions, settings.

    A decorator for every command that asks a question; `question_of` reads the options.
    """
    for metric, (example, of, called, whose) in reversed(list(LIMITED.items())):
        what = f"of every {of}, or of one (NAME={example})" if of else whose
        command = click.option(
            f"--max-{metric}",
            multiple=True,
            metavar="QUANTITY",
            help=f"Limit the {called or metric} {what}, e.g. {example}.",
        )(command)
    more = (
        click.option(
            "--require",
            multiple=True,
            metavar="TEXT",
            help="Add a requirement or rule, e.g. 'can_1m requires Spectra'.",
        ),
        click.option(
            "--fix",
            multiple=True,
            metavar="'DECISION = OPTION'",
            shell_complete=fixes,
            help="Fix a decision to one option.",
        ),
        click.option(
            "--profile", type=click.Choice(["dse", "osate-2.2", "osate-2.19"]), help="Rules by which latencies count."
        ),
        click.option(
            "--worst-case",
            type=Words(["execution-time", "deadline"]),
            help="OSATE's worst-case setting (ET or DL); profile dse ignores it.",
        ),
        click.option(
            "--settings",
            callback=_osate_settings,
            metavar="AS-MF-ET-EQ-EQL",
            help="OSATE's settings by its abbreviations, some or all; profile dse ignores them.",
        ),
        *(
            click.option(f"--{name.replace('_', '-')}", type=Words(values), hidden=True)
            for name, values in OTHERS.items()
        ),
        click.option(
            "--processing",
            type=Words(["execution-time", "response-time"]),
            help="What a flow counts for a thread: its response time (default under profile dse), or its execution "
            "time (quick: without waiting for the CPU).",
        ),
        click.option(
            "--deadlines",
            type=Words(["stated", "all", "none"]),
            help="Deadlines that are requirements: the stated ones (default of profile dse), all (the period where "
            "none is stated), or none.",
        ),
        click.option(
            "--overload",
            type=Words(["forbidden", "allowed"]),
            help="Whether a load of more than 100 % of a core, a bandwidth or an exclusive bus is allowed.",
        ),
    )
    for option in more:
        command = option(command)
    return command


class OrderedCommand(GroupedCommand):
    """A command that knows in which order its options were given; click keeps it for each option by itself only.

    Its ``--report`` has a value where a path of a page follows, and none else.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Note the names of the options, one for each time that one was given.

        ``--minimise`` and ``--maximise`` are one list of objectives, whose order only the raw arguments have.
        """
        has_report = any("--report" in parameter.opts for parameter in self.params)
        if has_report:
            args = _with_reports(args)
        _, extra, given = self.make_parser(ctx).parse_args(list(args))
        behind = [path for option, path in pairwise(args) if option == "--report=" and not path.startswith("-")]
        if has_report and extra and behind:  # one word too many: it was to be the path of a page
            raise no_page(behind[0])
        ctx.meta[ORDER] = [parameter.name for parameter in given]
        return super().parse_args(ctx, args)


def _with_reports(args: list[str]) -> list[str]:
    """The arguments with each ``--report`` and the path behind it, if there is one, as one argument.

    >>> _with_reports(["a.yaml", "--report", "-q"]), _with_reports(["--report", "a.html", "a.yaml"])
    (['a.yaml', '--report=', '-q'], ['--report=a.html', 'a.yaml'])
    """
    words: list[str] = []
    for at, word in enumerate(args):
        if word == "--":
            return words + args[at:]
        if words and words[-1] == "--report=" and args[at - 1] == "--report" and word.lower().endswith(PAGES):
            words[-1] += word
        else:
            words.append("--report=" if word == "--report" else word)
    return words


def objective_options(*, hidden: bool = False) -> Callable[[F], F]:
    """``--minimise`` and ``--maximise`` of an `OrderedCommand`; see `objectives_of`.

    A decorator; both spellings (``--minimize``) are read. `hidden` leaves them out of the help.
    """

    def decorate(command: F) -> F:
        what = "As for solve; changes no explanation." if hidden else "Replace the objectives of the file, e.g. price."
        for name, text in (("maximis", "Replace the objectives of the file by one to maximise."), ("minimis", what)):
            names = f"--{name}e", f"--{name.removesuffix('s')}ze"
            command = click.option(*names, multiple=True, metavar="METRIC", hidden=hidden, help=text)(command)
        return command

    return decorate


def objectives_of(minimise: tuple[str, ...], maximise: tuple[str, ...]) -> tuple[str, ...]:
    """The objectives of the running command, in the order in which they were given.

    Texts such as ``minimise price``; requires an `OrderedCommand`.
    """
    values = {"minimise": iter(minimise), "maximise": iter(maximise)}
    order = [name for name in click.get_current_context().meta[ORDER] if name in values]
    return tuple(f"{sense} {next(values[sense])}" for sense in order)


def question_of(options: dict[str, Any], objectives: tuple[str, ...] = ()) -> Question:
    """The question that the options ask, in the words of `dse.Problem.ask`.

    Keywords of `Problem.ask`. Raises `UsageError` where an option contradicts ``--settings``.
    """
    from dse.space.question.settings import SETTINGS

    asked: Question = {"objectives": objectives, "require": options["require"], "fix": options["fix"]}
    for name in (*(f"max_{metric}" for metric in LIMITED), *SETTINGS):
        stated, short = options.get(name), options["settings"].get(name)
        if stated and short and stated != short:
            shown = f"--{name} {stated}".replace("_", "-")
            raise UsageError(f"{shown} contradicts --settings, which says {short.replace('_', '-')}: give one of them")
        value = stated or short
        asked[name] = value  # type: ignore[literal-required]  # every one is a key of Question
    return asked


class Top(click.ParamType[int | None]):
    """The parameter type for the number of alternatives to show: a number, or ``all``.

    Numbers from 1; raises a usage error of click for anything else.
    """

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | None:
        """None for ``all``."""
        if value is None or value == "all":
            return None
        if not str(value).isdecimal() or len(str(value)) > 18 or int(value) < 1:
            self.fail(f"{value!r}: expected a number from 1, or all", param, ctx)
        return int(value)


def ranking_options(command: F) -> F:
    """``--rank-by`` and ``--top``.

    A decorator; the method is checked when the objectives are known.
    """
    more = (
        click.option(
            "--top",
            type=Top(),
            default="10",
            metavar="N|all",
            help="Number of alternatives to list; default: 10 in reports and with --explain, one of each kind else.",
        ),
        click.option(
            "--rank-by",
            metavar="METHOD",
            shell_complete=rankings,
            help="Ranking method: ideal (default), topsis, knee, baseline, weights:NAME=NUMBER,... or order:NAME,...; "
            "ideal and topsis take weights too. An objective that is not named has weight 0.",
        ),
    )
    for option in more:
        command = option(command)
    return command
