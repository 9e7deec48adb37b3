"""``dse compare``."""

from __future__ import annotations

from pathlib import Path

import click

from dse.cli.common import (
    ExistingPath,
    all_option,
    check_writable,
    in_time,
    json_option,
    load_told,
    quiet_option,
    tell_carried,
)
from dse.cli.grouping import GroupedCommand
from dse.cli.pages import answer, page_path, report_option, write_page_figures
from dse.support.errors import EXIT_COMPLETE, EXIT_NO


@click.command("compare", cls=GroupedCommand)
@click.argument("one", metavar="A")
@click.argument("other", metavar="[B]", required=False)
@click.option(
    "--problem",
    type=ExistingPath(dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="The problem file, if it has moved.",
)
@click.option(
    "--measured",
    multiple=True,
    type=ExistingPath(),
    metavar="PATH",
    help="Compare a design of the problem file A with measurements: CSV, a trace, or a bag.",
)
@click.option(
    "--design",
    multiple=True,
    metavar="'DECISION = OPTION'",
    help="With --measured: the design, RESULT.json#ID or a decision other than the baseline's.",
)
@click.option(
    "--tolerance",
    metavar="SHARE",
    help="With --measured: largest difference of the mean of a period or rate from the stated one.  [default: 1 %]",
)
@click.option("--figures", metavar="DIR", help="With --measured: write the plots into this folder, as SVG.")
@all_option
@report_option
@json_option
@quiet_option
@in_time
def command(
    one: str,
    other: str | None,
    problem: str | None,
    measured: tuple[str, ...],
    design: tuple[str, ...],
    tolerance: str | None,
    figures: str | None,
    every: bool,
    report: str | None,
    json_path: str | None,
    quiet: bool,
) -> int:
    """Two results (RESULT.json), two designs (RESULT.json#ID), or a design and baseline, side by side.

    With --measured, A is a problem file: its baseline (or --design) against samples of latencies, loads and
    utilisations, and of the execution times, periods, rates and sizes that the file states. Exit code 4 when a
    requirement is violated with the measured figures, or a measurement exceeds its limit.
    """
    check_writable(json_path, page_path(report))
    if measured:
        if other is not None or problem is not None:
            raise click.UsageError("--measured goes with one problem file; --design names a design of it")
        return _measured(one, measured, design, tolerance or "1 %", figures, every, quiet, report, json_path)
    if design or tolerance is not None or figures is not None:
        option = "--design" if design else "--tolerance" if tolerance is not None else "--figures"
        raise click.UsageError(f"{option} goes with --measured")
    if other is None:
        raise click.UsageError("missing argument B: what A is compared with, or --measured FILE")
    from dse.questions.verbs.compare import compare
    from dse.report.content.compare import comparison_page

    comparison = compare(one, other, problem)
    for file in comparison.carried:
        tell_carried(file, is_carried=True)
    answer(comparison_page(comparison), (json_path, comparison.to_json), report=report, every=every, quiet=quiet)
    return EXIT_COMPLETE


def _measured(
    problem: str,
    files: tuple[str, ...],
    design: tuple[str, ...],
    tolerance: str,
    figures: str | None,
    every: bool,
    quiet: bool,
    report: str | None,
    json_path: str | None,
) -> int:
    if problem.rpartition("#")[0].endswith(".json") or problem.endswith(".json"):
        raise click.UsageError(f"{problem}: name the problem file, and the design with --design RESULT.json#ID")
    from dse.cli.commands.analyse import named
    from dse.questions.verbs.compare_measured import compare_measured
    from dse.report.content.measured import measured_page

    chosen = named(design, load_told(problem))
    comparison = compare_measured(chosen.problem, *files, design=chosen.texts, tolerance=tolerance)
    page = measured_page(comparison)
    answer(page, (json_path, comparison.to_json), report=report, every=every, quiet=quiet)
    write_page_figures(figures, page, Path(files[0]).stem)
    return EXIT_NO if any(item.is_newly_broken for item in comparison.requirements) else EXIT_COMPLETE
