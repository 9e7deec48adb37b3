"""``dse explain``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import click

from dse.cli.common import (
    all_option,
    check_writable,
    json_option,
    load_told,
    problem_argument,
    quiet_option,
    time_limit_option,
)
from dse.cli.options import OrderedCommand, objective_options, objectives_of, question_of, question_options
from dse.cli.pages import answer, page_path, report_option
from dse.cli.progress import Working
from dse.support.timelimit import TimeLimit, until

if TYPE_CHECKING:
    from dse.answers.explanation import Demand

SOON_S = 2.0
"""Conflicts that are found before that are read on the page, which comes soon."""
F = TypeVar("F", bound=Callable[..., Any])
WITHOUT_EFFECT = ("workers", "scheduler", "top", "rank-by", "further", "within", "insist", "output", "explain")
"""Options of `dse solve` that are about the front: they are taken, and change no explanation."""
REFUSED = {
    "robust": "explains the figures as the file states them, not a robust question",
    "resume": "takes the question by its own options: give the problem file, and those of the result",
}


def _options_of_solve(command: F) -> F:
    """The options of `dse solve` that are about its front, so that the same ones may be given; not in the help."""
    for name in WITHOUT_EFFECT:
        other = {"output": ("-o",), "further": ("--alternatives",)}.get(name, ())
        unused = f"unused_{name.replace('-', '_')}"
        command = click.option(*other, f"--{name}", unused, is_flag=name in ("insist", "explain"), hidden=True)(command)
    for name in REFUSED:
        command = click.option(
            f"--{name}", is_flag=name != "resume", expose_value=False, callback=_refuse, hidden=True
        )(command)
    return command


def _refuse(ctx: click.Context, param: click.Parameter, value: object) -> None:
    if value and param.name is not None:
        raise click.UsageError(f"--{param.name}: `dse explain` {REFUSED[param.name]}")


@click.command("explain", cls=OrderedCommand)
@problem_argument()
@question_options
@objective_options(hidden=True)
@all_option
@click.option(
    "--limit", type=click.IntRange(1), default=100, show_default=True, help="Largest number of conflicts to list."
)
@click.option(
    "--offer",
    multiple=True,
    metavar="'DECISION += OPTION'",
    help="Price of the cheapest design with a further option, e.g. 'computer.type += Spectra'.",
)
@time_limit_option("with what was proved so far")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True, help="Seed of the solver.")
@report_option
@json_option
@click.option("--csv", "csv_path", metavar="PATH", help="Also write the conflicts as CSV; - for standard output.")
@quiet_option
@_options_of_solve
def command(
    file: str,
    minimise: tuple[str, ...],
    maximise: tuple[str, ...],
    every: bool,
    limit: int,
    offer: tuple[str, ...],
    time_limit: TimeLimit,
    seed: int,
    report: str | None,
    json_path: str | None,
    csv_path: str | None,
    quiet: bool,
    **options: Any,
) -> int:
    """Why a problem is infeasible: requirements and rules that conflict, and the smallest relaxations that help.

    Takes the options of `dse solve`; those about its front (--workers, --top, ...) change nothing. Each conflict is
    minimal, shown by a design for each member left out; each limit is exact. Without --time-limit and --all a hard
    problem is explained for about 10 seconds of CPU time, and the page says what was left out. Exit code 0 when the
    problem is feasible, 4 when it is proved infeasible, 5 when something was left out.
    """
    if json_path == "-" and csv_path == "-":
        raise click.UsageError("only one of --json and --csv can go to standard output")
    check_writable(json_path, csv_path, page_path(report))
    from dse.questions.explain.explain import Listener, Wishes, explain_asked

    with until(time_limit):
        asked_problem = load_told(file).ask(**question_of(options, objectives_of(minimise, maximise)))
    with Working("looking for what clashes", quiet=quiet) as line:

        def show(conflict: Sequence[Demand]) -> None:
            if line.seconds >= SOON_S:
                line.tell(f"conflict: {'; '.join(item.text for item in conflict)}")

        listener = Listener(partial(setattr, line, "text"), show)
        explanation = explain_asked(asked_problem, Wishes(every, limit, offer, time_limit.rest_s, seed), listener)
    from dse.report.content.explain import explanation_page

    answer(
        explanation_page(explanation),
        (json_path, explanation.to_json),
        (csv_path, explanation.to_csv),
        report=report,
        quiet=quiet,
        every=every,
    )
    return explanation.exit_code
