"""``dse sensitivity``."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import click

from dse.cli.commands.analyse import named
from dse.cli.common import (
    all_option,
    check_writable,
    console,
    json_option,
    load_told,
    problem_argument,
    quiet_option,
    save,
    screen_lines,
    time_limit_option,
)
from dse.cli.options import OrderedCommand, objective_options, objectives_of, question_of, question_options
from dse.cli.pages import page_path, write_page
from dse.cli.printing import rewrite
from dse.cli.study_files import claim_study, folder_of, study_report_options, write_study
from dse.support.timelimit import TimeLimit, until


class Share(click.ParamType[Any]):
    """A ratio such as ``10%`` or ``0.1``, exactly."""

    name = "ratio"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """An exact fraction of one."""
        from dse.support.units import DIMENSIONLESS, UnitError, parse_quantity

        try:
            quantity = parse_quantity(str(value))
        except UnitError as error:
            self.fail(f"{value!r}: {error.message}", param, ctx)
        if quantity.dimension != DIMENSIONLESS or not 0 < quantity.value < 1:
            self.fail(f"{value!r} is no share above 0 and below 100 %", param, ctx)
        return quantity.value


@click.command("sensitivity", cls=OrderedCommand)
@problem_argument()
@click.option(
    "--design",
    multiple=True,
    metavar="'DECISION = OPTION'",
    help="The design: RESULT.json#ID (an alternative, with its question), or a decision other than the baseline's.",
)
@question_options
@objective_options()
@click.option(
    "--swing",
    type=Share(),
    default="10%",
    show_default=True,
    help="How far the tornado goes where no uncertainty is stated.",
)
@click.option(
    "--samples",
    type=click.IntRange(1, 10**8),
    default=100_000,
    show_default=True,
    help="Of the stated uncertain inputs.",
)
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=0,
    show_default=True,
    help="Of the samples; recorded in the result.",
)
@click.option(
    "--front/--no-front",
    default=True,
    help="Also compute the chance of each alternative of the front to meet every requirement.",
)
@all_option
@time_limit_option("with what was found so far")
@study_report_options
@json_option
@quiet_option
@click.option("--csv", "csv_path", metavar="PATH", help="Also write the margins as CSV; - for standard output.")
def command(
    file: str,
    design: tuple[str, ...],
    minimise: tuple[str, ...],
    maximise: tuple[str, ...],
    swing: Any,
    samples: int,
    seed: int,
    front: bool,
    time_limit: TimeLimit,
    every: bool,
    report: str | None,
    folder: str,
    json_path: str | None,
    quiet: bool,
    csv_path: str | None,
    **options: Any,
) -> int:
    """Margins and sensitivity of a design: how far inputs may move, which matter most, how sure it is.

    Uncertain inputs are those that the problem file states under `uncertainty`. Exit code 4 when the design violates a
    requirement with the stated inputs.
    """
    if json_path == "-" and csv_path == "-":
        raise click.UsageError("only one of --json and --csv can go to standard output")
    check_writable(json_path, csv_path, page_path(report))
    target = folder_of(report, folder)
    from dse.questions.sensitivity.sensitivity import StudySettings, sensitivity_asked

    live = sys.stderr.isatty()

    def say(what: str) -> None:
        if live:
            rewrite(what)

    settings = StudySettings(swing, samples, seed, front)
    with until(time_limit):
        problem = load_told(file).ask(**question_of(options, objectives_of(minimise, maximise)))
        claim_study(target, problem.name, "sensitivity")
        chosen = named(design, problem)
        result = sensitivity_asked(chosen.problem, chosen.texts, settings, say)
    if live:
        rewrite("")
    from dse.report.content.study import study_page
    from dse.report.terminal import print_page

    page = study_page(result.to_dict())
    if not quiet and "-" not in (json_path, csv_path):
        screen = console()
        lead = f"{problem.name}: margins of {chosen.called}"
        print_page(screen, replace(page, lead=lead), every=every, lines=screen_lines(screen))
    failure = save((json_path, result.to_json), (csv_path, result.to_csv)) or write_page(report or None, page)
    if target is not None:
        write_study(result, target, quiet=quiet)
    if failure is not None:
        raise failure
    return result.exit_code
