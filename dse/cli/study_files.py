"""Files and reports of studies, for all commands that make or read one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from dse.cli.common import check_writable, report_folder
from dse.cli.pages import check_page_or_folder
from dse.cli.printing import tell
from dse.support.errors import UsageError, about
from dse.support.files.plain_json import parse_json
from dse.support.files.reading import UnreadableFileError, read_text
from dse.support.files.writing import PAGES, write_files

if TYPE_CHECKING:
    from collections.abc import Callable

    from dse.answers.studies.sensitivity import SensitivityResult
    from dse.answers.studies.sweep import SweepResult
    from dse.report.page import Section

F = TypeVar("F", bound="Callable[..., Any]")


def study_report_options(command: F) -> F:
    """``--report [PATH]`` of an `OrderedCommand`, and ``-o``.

    A decorator; ``--report`` without a path means files in the folder of ``-o``.
    """
    what = "Also write a report: one page (PATH.html or PATH.md), else HTML, Markdown, CSV and JSON in a folder (-o)."
    more = (
        click.option("--report", metavar="[PATH]", callback=check_page_or_folder, help=what),
        click.option(
            "-o",
            "--output",
            "folder",
            default="reports",
            show_default=True,
            metavar="DIR",
            help="Folder of a report of several files.",
        ),
    )
    for option in reversed(more):
        command = option(command)
    return command


def write_study(result: SweepResult | SensitivityResult, folder: Path, *, quiet: bool = False) -> None:
    """The report of a study.

    HTML, Markdown, CSV and JSON in `folder`; each path is printed on standard error unless `quiet`.
    """
    from dse.report.output import study_files

    files = study_files(result.to_dict(), result.to_csv(), result.to_json())
    for path in write_files(folder, files):
        if not quiet:
            tell(f"report: {path}")


def folder_of(report: str | None, folder: str) -> Path | None:
    """The folder of a report of several files, made before the work; None where no such report was asked for.

    Raises
    ------
    UsageError
        for ``-o`` without a report of several files, which would be ignored; for a folder that cannot be made.
    """
    if report == "":
        return report_folder(folder)
    context = click.get_current_context(silent=True)
    if context is not None and context.get_parameter_source("folder") is click.core.ParameterSource.COMMANDLINE:
        way = f"--report {folder}" if folder.lower().endswith(PAGES) else f"--json {folder}"
        if not folder.lower().endswith((*PAGES, ".json")):
            way = f"--report -o {folder}"
        raise UsageError(f"-o {folder}: names the folder of a report of several files; did you mean `{way}`?")
    return None


def claim_study(folder: Path | None, problem: str, kind: str) -> None:
    """The files of a study's report are claimed before the work, as soon as the problem's name is known.

    Raises `UsageError` before any run is solved where a file cannot be written.
    """
    if folder is not None:
        from dse.report.output import study_names

        check_writable(*(folder / name for name in study_names(problem, kind)))


def read_json(path: str) -> Any:
    """The content of a JSON file, None where it is none.

    Raises
    ------
    UsageError
        when it cannot be read at all.
    """
    try:
        return parse_json(read_text(path, what="a study"))
    except UnreadableFileError as error:
        if error.is_other_content:
            return None
        raise
    except ValueError:
        return None


def is_study(data: Any) -> bool:
    """Whether the data are those of a sweep or of sensitivity.

    Judged by the key ``format`` of the JSON.
    """
    return isinstance(data, dict) and str(data.get("format", "")).startswith(("dse-sweep/", "dse-sensitivity/"))


def check_study(data: Any, path: str) -> None:
    """Refuse what is no whole study.

    Raises
    ------
    UsageError
        saying what is wrong with the file, and where.
    """
    from dse.answers.forms.consistency import check_data

    kinds = {f"dse-{name}/1": name for name in ("sweep", "sensitivity", "result")}
    form = data.get("format") if isinstance(data, dict) else None
    if form not in kinds:
        raise UsageError(f"{path}: it is no study: expected {', '.join(kinds)}")
    check_data(kinds[form], data, path)


def sections_in(path: str) -> list[Section]:
    """The sections of a report that a file of a study makes.

    Raises
    ------
    UsageError
        when the file is none.
    """
    from dse.report.content.study import sections_of

    data = read_json(path)
    check_study(data, path)
    with about(path):
        return sections_of(data)
