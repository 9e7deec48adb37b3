"""``dse explain``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from dse.cli.common import (
    OrderedCommand,
    check_writable,
    console,
    json_option,
    objective_options,
    objectives_of,
    problem_argument,
    question_of,
    question_options,
    time_limit_option,
    write_text,
)
from dse.timelimit import TimeLimit, until


@click.command("explain", cls=OrderedCommand)
@problem_argument
@question_options
@objective_options(hidden=True)
@click.option("--all", "every", is_flag=True, help="List all minimal conflicts.")
@click.option("--limit", type=click.IntRange(1), default=100, show_default=True, help="At most so many conflicts.")
@click.option(
    "--offer",
    multiple=True,
    metavar="'DECISION += OPTION'",
    help="A further option, e.g. 'computer.type += Spectra': would it help, and at what price?",
)
@time_limit_option("with what was proved so far")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True, help="Of the solver.")
@json_option
def command(
    file: str,
    minimise: tuple[str, ...],
    maximise: tuple[str, ...],
    every: bool,
    limit: int,
    offer: tuple[str, ...],
    time_limit: TimeLimit,
    seed: int,
    json_path: str | None,
    **options: Any,
) -> int:
    """Why a problem is infeasible: requirements and rules that clash, and the smallest changes that mend it.

    Takes the options of `dse solve`. Each conflict is minimal, shown by a design for each member left out; each limit
    is exact. Exit code 0 when the problem is feasible, 4 when it is proved infeasible.
    """
    check_writable(json_path)
    from dse.api.explaining import Wishes, explain_asked
    from dse.api.problem import load

    with until(time_limit):
        asked = load(Path(file)).ask(**question_of(options, objectives_of(minimise, maximise)))
    found = explain_asked(asked, Wishes(every, limit, offer, time_limit.rest_s, seed))
    if json_path != "-":
        from dse.report.explanation import print_explanation

        print_explanation(console(), found)
    if json_path is not None:
        write_text(json_path, found.to_json())
    return found.exit_code
