"""``--report``, and how a command gives its answer: on the terminal, as a page, in files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dse.cli.common import F, console, report_folder, save, screen_lines
from dse.cli.printing import tell
from dse.support.errors import UsageError
from dse.support.files.writing import PAGES
from dse.support.timelimit import OutOfTime, TimeLimit, until

if TYPE_CHECKING:
    from dse.report.content.front.document import Document
    from dse.report.page import Page, Section


def report_option(command: F) -> F:
    """``--report PATH`` of a command whose report is one page.

    A decorator; the suffix is checked before the command runs.
    """
    text = "Also write what is printed as a page: HTML (PATH.html, with plots) or Markdown (PATH.md)."
    return click.option("--report", metavar="PATH", callback=_check_report, help=text)(command)


def _check_report(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    if value is not None and not value.lower().endswith(PAGES):
        raise no_page(value)
    return value


def check_page_or_folder(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """A report that is one page where a path is given, and files in a folder where none is.

    A callback of click: "" means a folder, a path must end in a suffix of `PAGES`.
    """
    if value and not value.lower().endswith(PAGES):
        raise no_page(value)
    return value


def page_path(path: str | None) -> str | None:
    """The path of a page as ``--report`` has it, whose folder is made if need be; None where there is no page.

    Called before the work, so that a folder that cannot be made ends the command at once.

    Raises
    ------
    UsageError
        naming the folder that cannot be made.
    """
    if not path:
        return None
    folder = Path(path).parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise UsageError(f"{path}: the folder {str(folder)!r} cannot be made: {why}") from error
    return path


def no_page(path: str) -> click.BadParameter:
    """The error for a report that cannot go to `path`.

    Raised by the caller; names the suffixes that are possible.
    """
    text = f"{path or 'no path'}: a report is HTML or Markdown: a path that ends in {' or '.join(PAGES)}"
    return click.BadParameter(text, param_hint="'--report'")


def in_what_is_left(limit: TimeLimit, write: Callable[[], OSError | None], failure: OSError | None) -> bool:
    """Whether there was time to write a report; standard error says where there was not.

    Raises
    ------
    OSError
        the first failure: an earlier one, or that to write it.
    """
    in_time = False
    try:
        with until(limit.for_the_last_steps()):
            failed, in_time = write(), True
        failure = failure or failed
    except OutOfTime:
        tell("dse: no report: the time limit came first; `dse report` makes one of what --json writes")
    if failure is not None:
        raise failure
    return in_time


def write_page(path: str | None, page: Page) -> OSError | None:
    """Write a page where ``--report`` says, if it was given; returns the failure to do so.

    HTML or Markdown by the suffix. The answer is still printed where writing fails.
    """
    if path is None:
        return None
    from dse.report.output import page_text

    return save((path, lambda: page_text(page, path)))


def answer(
    page: Page,
    *files: tuple[str | None, Callable[[], str]],
    report: str | None = None,
    quiet: bool = False,
    every: bool = False,
    lead: str = "",
) -> None:
    """Print a page (`every` row of it), unless a file goes to standard output; write the files and the report.

    `lead` stands in place of the page's own on a terminal, where it names what the command was given.

    Raises
    ------
    OSError
        the first failure to write, when everything else was done.
    """
    if not quiet and all(path != "-" for path, _ in files):
        from dse.report.terminal import print_page

        screen = console()
        printed = replace(page, lead=lead) if lead else page
        print_page(screen, printed, every=every, lines=screen_lines(screen))
    failure = save(*files) or write_page(report, page)
    if failure is not None:
        raise failure


def print_front(
    document: Document, top: int | None, limit: TimeLimit, *, explain: bool, further: Sequence[Section] = ()
) -> None:
    """Print a front with sections of studies: on one screen, or with all that is known of each alternative.

    Where the time limit comes first, only the contents of the result are printed.
    """
    from dse.report.content.front.first_screen import first_page
    from dse.report.content.front.pages import printed_page
    from dse.report.terminal import print_page

    screen = console()
    lines: int | None = screen_lines(screen)
    try:
        with until(limit.for_the_last_steps()):
            if explain:
                page, lines = printed_page(document, top, further), None
            else:
                page = first_page(document, top, further)
    except OutOfTime:
        page = first_page(document, top, further, has_time=False)
    print_page(screen, page, lines=lines)


def write_page_figures(folder: str | None, page: Page, stem: str) -> None:
    """Write the plots of a page as SVG files into a folder, and tell each; nothing without a folder.

    Their names begin with `stem`.
    """
    if folder is None:
        return
    from dse.report.output import page_figures
    from dse.support.files.writing import write_files

    for path in write_files(report_folder(folder), page_figures(page, ("svg",), stem)):
        tell(f"figure: {path}")
