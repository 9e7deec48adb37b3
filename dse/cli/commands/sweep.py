"""``dse sweep``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

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
from dse.cli.printing import tell
from dse.cli.progress import Reporter
from dse.cli.study_files import claim_study, folder_of, study_report_options, write_study
from dse.support.files.guard import claim
from dse.support.files.writing import is_stream
from dse.support.timelimit import TimeLimit, until

if TYPE_CHECKING:
    from dse.questions.sweep.sweep import SweepProgress

PLAIN_STEP_S = 5.0


@click.command("sweep", cls=OrderedCommand)
@problem_argument()
@click.option(
    "--vary",
    multiple=True,
    required=True,
    metavar="'WHAT=VALUES'",
    help="A limit: 'jitter of FLOW=5ms..100ms' (every break-point) or '=a,b,c'; an input by its path: 'PATH=a,b,c', "
    "'PATH=a..b step c', "
    "or a factor 'PATH=*0.5..2 step 0.1'. Several make a grid.",
)
@question_options
@objective_options()
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=0,
    show_default=True,
    help="Seed of the solver; the result does not depend on it.",
)
@click.option(
    "--workers", type=click.IntRange(1, 1024), help="Number of processes on this machine; default: its cores."
)
@click.option(
    "--scheduler", metavar="ADDRESS", help="Solve on a Dask cluster, such as tcp://host:8786 (docs/cluster.md)."
)
@click.option(
    "--store",
    metavar="PATH",
    help="Where finished runs are kept; else NAME.runs.sqlite next to the result (--json, --csv, --report), and "
    "nowhere where none is written.",
)
@click.option("--no-store", is_flag=True, help="Keep no finished runs; a stopped sweep starts from the beginning.")
@time_limit_option("with the runs that are finished")
@all_option
@study_report_options
@json_option
@click.option(
    "--csv", "csv_path", metavar="PATH", help="Also write every alternative of every run as CSV; - for standard output."
)
@quiet_option
def command(
    file: str,
    vary: tuple[str, ...],
    minimise: tuple[str, ...],
    maximise: tuple[str, ...],
    seed: int,
    workers: int | None,
    scheduler: str | None,
    store: str | None,
    no_store: bool,
    time_limit: TimeLimit,
    every: bool,
    report: str | None,
    folder: str,
    json_path: str | None,
    csv_path: str | None,
    quiet: bool,
    **options: Any,
) -> int:
    """The front as a function of a limit or an input.

    With --json, --csv, --report or --store every finished run is kept at once, so that the same command goes on after
    any stop. Ctrl-C ends the sweep and writes the finished runs (exit code 5).
    """
    if json_path == "-" and csv_path == "-":
        raise click.UsageError("only one of --json and --csv can go to standard output")
    if store is not None and no_store:
        raise click.UsageError("either --store or --no-store")
    check_writable(json_path, csv_path, page_path(report))
    target = folder_of(report, folder)
    from dse.questions.sweep.sweep import Means, sweep_asked
    from dse.questions.sweep.workers import usable_cores

    with until(time_limit):
        problem = load_told(file).ask(**question_of(options, objectives_of(minimise, maximise)))
    claim_study(target, problem.name, "sweep")
    path = None if no_store else Path(store) if store is not None else _beside(file, (json_path, csv_path), target)
    if path is not None:
        check_writable(path)
        claim(*(f"{os.path.realpath(path)}{ending}" for ending in ("-wal", "-shm", "-journal")))
    means = Means(workers or usable_cores(), scheduler, path, time_limit)
    with Estimate(quiet=quiet) as progress:
        result = sweep_asked(problem, vary, seed, means, progress)
    from dse.report.content.study import study_page
    from dse.report.terminal import print_page

    page = study_page(result.to_dict())
    if not quiet and "-" not in (json_path, csv_path):
        screen = console()
        print_page(screen, page, every=every, lines=screen_lines(screen) - 1)
        kept = f", kept in {path}" if path is not None else ""
        count = f"{len(result.runs)} {'run' if len(result.runs) == 1 else 'runs'}"
        summary = f"{count}: {result.solved} solved now, {result.found} from the store{kept}."
        screen.print(summary, markup=False)
    failure = save((json_path, result.to_json), (csv_path, result.to_csv)) or write_page(report or None, page)
    if target is not None:
        write_study(result, target, quiet=quiet)
    if failure is not None:
        raise failure
    if result.status == "incomplete" and path is not None and not quiet:
        tell("dse: stopped early; the same command goes on from here")
    return result.exit_code


def _beside(file: str, results: Sequence[str | None], report: Path | None) -> Path | None:
    """The store of a sweep that names none: beside the first result that is written; None where there is none."""
    written = [Path(path).parent for path in results if path is not None and path != "-" and not is_stream(path)]
    folders = [*written, *([report] if report is not None else [])]
    return folders[0] / f"{Path(file).stem}.runs.sqlite" if folders else None


class Estimate(Reporter):
    """Progress with the time that is left, on standard error: a bar on a terminal, plain lines elsewhere."""

    def __init__(self, *, quiet: bool) -> None:
        super().__init__("preparing the runs", PLAIN_STEP_S, quiet=quiet)

    def __call__(self, progress: SweepProgress) -> None:
        """Say where the sweep stands, unless it was said just now."""
        left = "" if progress.left_s is None else f", about {duration(progress.left_s)} left"
        text = f"{progress.done} of {progress.total} runs{left}"
        filled = 30 * progress.done // progress.total
        self.report(f"[{'#' * filled}{'.' * (30 - filled)}] {text}", text)


def duration(seconds: float) -> str:
    """``45 s``, ``12 min``, ``3.5 h``.

    >>> duration(750)
    '12 min'
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
