"""``dse solve``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dse.cli.common import (
    ExistingPath,
    all_option,
    check_writable,
    json_option,
    load_told,
    problem_argument,
    quiet_option,
    save,
    tell_carried,
    time_limit_option,
)
from dse.cli.options import (
    OrderedCommand,
    objective_options,
    objectives_of,
    question_of,
    question_options,
    ranking_options,
)
from dse.cli.pages import in_what_is_left, page_path, print_front
from dse.cli.printing import rewrite, tell
from dse.cli.progress import Reporter
from dse.cli.study_files import folder_of, study_report_options
from dse.support.errors import EXIT_INCOMPLETE, about
from dse.support.files.writing import is_stream, write_files
from dse.support.timelimit import TimeLimit, until
from dse.support.units.text import count_words

if TYPE_CHECKING:
    from dse.answers.result import Result
    from dse.answers.robust import RobustResult
    from dse.questions.problem import Problem
    from dse.questions.question import Question
    from dse.report.content.front.document import Document
    from dse.search.front import FrontSearch, Progress

PLAIN_STEP_S = 2.0
REPORT_S = 2.0
"""Seconds of a time limit that are kept for a report that is asked for, at most a quarter of it."""


@click.command("solve", cls=OrderedCommand)
@problem_argument(required=False)
@question_options
@objective_options()
@time_limit_option("with the front so far")
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=0,
    show_default=True,
    help="Seed of the solver; the front does not depend on it.",
)
@click.option(
    "--workers",
    type=click.IntRange(1, 64),
    help="Number of regions that are searched in parallel (default 1), or of options with --insist (default: the cores "
    "of this machine). The answer does not depend on it. Helps for fronts of hundreds of points with short solver "
    "calls; a few hard calls, as with response times, may end no sooner, and use more CPU time.",
)
@click.option(
    "--resume",
    type=ExistingPath(dir_okay=False, allow_dash=True),
    metavar="RESULT",
    help="Go on with the stopped search of a result file, with the question of that result.",
)
@click.option(
    "--robust",
    is_flag=True,
    help="Search designs that meet every requirement for all values stated under `uncertainty`, and print what "
    "robustness costs.",
)
@ranking_options
@all_option
@click.option(
    "--explain",
    is_flag=True,
    help="Explain why each of the first alternatives is on the front, and print what the screen leaves out.",
)
@click.option(
    "--further",
    "--alternatives",
    "further",
    type=click.IntRange(1, 1000),
    metavar="K",
    help="Also search up to K other designs with the same objective values as each alternative shown, as different as "
    "possible.",
)
@click.option(
    "--within",
    metavar="SHARE",
    help="Also search designs with every objective worse by at most this share, e.g. 5%, and name what dominates them.",
)
@click.option(
    "--insist",
    is_flag=True,
    help="Also print the price of insisting on an option: for each option of each open decision the front with that "
    "option fixed, solved on --workers cores or on --scheduler.",
)
@click.option(
    "--scheduler", metavar="ADDRESS", help="Dask cluster on which --insist searches, such as tcp://host:8786."
)
@study_report_options
@json_option
@click.option("--csv", "csv_path", metavar="PATH", help="Also write the front as CSV; - for standard output.")
@quiet_option
def command(
    file: str | None,
    minimise: tuple[str, ...],
    maximise: tuple[str, ...],
    time_limit: TimeLimit,
    seed: int,
    workers: int | None,
    resume: str | None,
    robust: bool,
    rank_by: str | None,
    top: int | None,
    every: bool,
    explain: bool,
    further: int | None,
    within: str | None,
    report: str | None,
    folder: str,
    json_path: str | None,
    csv_path: str | None,
    insist: bool,
    scheduler: str | None,
    quiet: bool,
    **options: Any,
) -> int:
    """The proven Pareto front of a problem, ranked.

    Requirements given here are added to those of the file; --minimise and --maximise replace its objectives.
    Ctrl-C ends the search and prints the designs found so far. During the search --json PATH holds the result so far,
    marked incomplete, from which --resume goes on.
    """
    if json_path == "-" and csv_path == "-":
        raise click.UsageError("only one of --json and --csv can go to standard output")
    check_writable(json_path, renews=resume)  # it holds all that the result held; a table or a page does not
    check_writable(csv_path, page_path(report))
    target = folder_of(report, folder)
    from dse.answers.ranking.order import check_ranking, ranked_by
    from dse.questions.complete_design import baseline_design
    from dse.questions.verbs.solve import Watcher, solve_asked
    from dse.search.front import SearchLimits

    whole = time_limit
    with until(whole.for_the_last_steps()):
        problem, earlier = _question(file, resume, question_of(options, objectives_of(minimise, maximise)))
    if target is not None:
        _claim_report(target, problem)
    if report is not None:
        time_limit = whole.sparing(REPORT_S)
    if within is not None:
        from dse.questions.verbs.alternatives import read_share

        read_share(within)
    check_ranking(rank_by or "ideal", problem.space, has_baseline=baseline_design(problem.space) is not None)
    if robust and resume is not None and not problem.robust:
        raise click.UsageError(
            f"{resume}: its search is not robust, and --resume goes on with the question of the result"
        )
    if scheduler is not None and not insist:
        raise click.UsageError("--scheduler is for --insist")
    if robust or problem.robust:
        if further is not None or within is not None or insist:
            raise click.UsageError("--robust shows one design for each point: no --further, --within or --insist")
        from dse.cli.commands.robust import show_robust, solve_robustly

        with _SearchReporter(quiet=quiet) as progress:
            budget, tell = SearchLimits(time_limit, seed, workers or 1), (progress, _checkpoint(json_path))
            asked = (resume, file) if resume is not None else None
            study = solve_robustly(problem, asked, budget, tell, json_path)
        return show_robust(
            study,
            rank_by or "ideal",
            None if every else top,
            (json_path, csv_path, target, report),
            whole,
            explain=None if quiet else explain,
        )
    with _SearchReporter(quiet=quiet) as progress, about(resume) if resume is not None else nullcontext():
        watcher = Watcher(progress, _checkpoint(json_path))
        result = solve_asked(problem, SearchLimits(time_limit, seed, workers or 1), watcher, earlier)
    result = ranked_by(result, rank_by or "ideal")
    if further is not None or within is not None:
        from dse.questions.verbs.alternatives import DEFAULT_COUNT, with_further_designs

        result = with_further_designs(
            result, further or DEFAULT_COUNT, within, top, seed=seed, time_limit_s=time_limit.rest_s
        )
    if insist and not result.interrupted:
        result = _insisted(result, workers, scheduler, time_limit, quiet=quiet)
    failure = save((json_path, result.to_json), (csv_path, result.to_csv))
    is_shown = not quiet and "-" not in (json_path, csv_path)
    document = _document(result) if is_shown or report is not None else None
    if document is not None and is_shown:
        print_front(document, None if every else top, whole, explain=explain)
    in_time = in_what_is_left(whole, lambda: _write_reports(document, target, report, quiet=quiet), failure)
    is_whole = result.insisting is None or result.insisting.is_complete
    return result.exit_code if in_time and is_whole else EXIT_INCOMPLETE


def _insisted(result: Result, workers: int | None, scheduler: str | None, limit: TimeLimit, *, quiet: bool) -> Result:
    """The result with the price of insisting; a terminal shows the progress."""
    from dse.questions.sweep.workers import usable_cores
    from dse.questions.verbs.insist import Machines, insisted

    live = sys.stderr.isatty() and not quiet

    def tell(done: int, whole: int) -> None:
        if live:
            rewrite(f"{done} of {whole} options")

    with_prices = insisted(result, Machines(workers or usable_cores(), scheduler), limit, tell)
    if live:
        rewrite("")
    return with_prices


def _question(file: str | None, resume: str | None, question: Question) -> tuple[Problem, FrontSearch | None]:
    """The problem as it is asked, and the search to go on with."""
    if resume is not None:
        from dse.questions.question import changes_of
        from dse.questions.stopped_search import read_search

        if changes_of(question).is_anything:
            raise click.UsageError("--resume goes on with the question of the result: no further limits or objectives")
        problem, earlier = read_search(resume, file)
        tell_carried(problem.loaded.path, is_carried=problem.loaded.is_carried)
        return problem, earlier
    if file is None:
        raise click.UsageError("missing argument FILE")
    return load_told(file).ask(**question), None


def _checkpoint(json_path: str | None) -> Callable[[Result | RobustResult], None] | None:
    """The function that writes the result so far; where that fails the search goes on, with one message."""
    if json_path is None or json_path == "-" or is_stream(json_path):
        return None
    is_reported = False

    def write(result: Result | RobustResult) -> None:
        nonlocal is_reported
        failure = save((json_path, result.to_json))
        if failure is not None and not is_reported:
            is_reported = True
            tell(f"dse: the result so far cannot be written: {json_path}: {failure.strerror}")

    return write


def _claim_report(folder: Path, problem: Problem) -> None:
    from dse.report.output import report_names

    check_writable(*(folder / name for name in report_names(str(problem.loaded.path), problem.name)))


def _document(result: Result) -> Document:
    from dse.report.content.front.document import Document

    return Document(result)


def _write_reports(document: Document | None, folder: Path | None, page: str | None, *, quiet: bool) -> OSError | None:
    """The page that ``--report PATH`` asks for, the files of ``--report``; returns the failure to write the page."""
    if document is None or not (page or folder):
        return None
    from dse.report.output import front_text, report_files

    failure = save((page, lambda: front_text(document, page))) if page else None
    for path in write_files(folder, report_files(document)) if folder is not None else ():
        if not quiet:
            tell(f"report: {path}")
    return failure


class _SearchReporter(Reporter):
    """Progress of a search on standard error: how many points are found, and how many regions are open."""

    def __init__(self, *, quiet: bool) -> None:
        super().__init__("making the model", PLAIN_STEP_S, quiet=quiet)

    def __call__(self, progress: Progress) -> None:
        text = f"{count_words(progress.points, 'point')}, {count_words(progress.open_regions, 'region')} open"
        self.report(text, f"{text}, {progress.elapsed_s:.1f} s")
