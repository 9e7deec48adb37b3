"""``dse report``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

from dse.cli.common import ExistingPath, console, in_time, report_folder, tell_carried
from dse.cli.grouping import GroupedCommand
from dse.cli.options import ranking_options
from dse.cli.study_files import check_study, is_study, read_json, sections_in
from dse.support.files.writing import write_files


@click.command("report", cls=GroupedCommand)
@click.argument("result", type=ExistingPath(dir_okay=False, allow_dash=True))
@click.option(
    "-o",
    "--output",
    "folder",
    default="reports",
    show_default=True,
    metavar="DIR",
    help="Folder to write to; it is created.",
)
@click.option(
    "--problem",
    type=ExistingPath(dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="The problem file, if it has moved.",
)
@click.option(
    "--alternative", type=int, metavar="ID", help="Alternative that the report opens with and that figures show."
)
@click.option(
    "--study",
    "studies",
    multiple=True,
    type=ExistingPath(dir_okay=False, allow_dash=True),
    metavar="JSON",
    help="Also show what `dse sweep --json` or `dse sensitivity --json` wrote, as a section of the report.",
)
@click.option("--figures", metavar="png,svg", help="Write the plots in these formats instead; no browser is needed.")
@ranking_options
@in_time
def command(
    result: str,
    folder: str,
    problem: str | None,
    alternative: int | None,
    studies: tuple[str, ...],
    figures: str | None,
    rank_by: str | None,
    top: int | None,
) -> int:
    """A result as a report: one HTML file that needs no network, Markdown, CSV and JSON.

    Every figure is recomputed from the problem file, which must state the problem that was solved, or, where the file
    is missing, from the problem that the result carries. RESULT may also be the JSON of `dse sweep` or `dse
    sensitivity`: then the report shows that study, with its figures as they were written.
    """
    formats = _formats(figures)
    target = report_folder(folder)
    data = read_json(result)
    if is_study(data):
        return _report_study(result, data, target, formats, others=(problem, alternative, rank_by, *studies))
    sections = [section for path in studies for section in sections_in(path)]
    from dse.answers.ranking.order import ranked_by
    from dse.questions.reopen import reopen
    from dse.report.content.front.document import Document
    from dse.report.output import check_alternative, report_files
    from dse.support.errors import UsageError

    reopened = reopen(result, problem)
    tell_carried(reopened.problem.file, is_carried=reopened.problem.is_carried)
    if rank_by is not None:
        reopened = ranked_by(reopened, rank_by)
    check_alternative(reopened, alternative, result)
    if formats and not reopened.front:
        raise UsageError(f"{result}: there is no alternative, so there is nothing to draw")
    document = Document(reopened)
    if formats:
        from dse.report.output import figure_files

        paths = write_files(target, figure_files(document, formats, alternative))
    else:
        paths = write_files(target, report_files(document, alternative, top, sections))
    for path in paths:
        console().print(str(path), markup=False, soft_wrap=True)
    return 0


def _report_study(
    path: str, data: dict[str, Any], target: Path, formats: tuple[str, ...], others: Iterable[object]
) -> int:
    """The report of a study: no alternative to choose, nothing to rank."""
    if any(item is not None for item in others):
        raise click.UsageError(
            "a study has no alternatives: --problem, --alternative, --rank-by and --study are for results"
        )
    from dse.report.output import study_figures, study_files
    from dse.support.errors import about

    check_study(data, path)
    with about(path):
        written = write_files(target, study_figures(data, formats) if formats else study_files(data, None, None))
    for file in written:
        console().print(str(file), markup=False, soft_wrap=True)
    return 0


def _formats(text: str | None) -> tuple[str, ...]:
    if text is None:
        return ()
    formats = tuple(part.strip().lower() for part in text.split(","))
    unknown = [name for name in formats if name not in ("png", "svg")]
    if unknown:
        raise click.BadParameter(f"expected png, svg or both, got {unknown[0]!r}", param_hint="--figures")
    return formats
