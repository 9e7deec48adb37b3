"""A report in a folder: HTML, Markdown, CSV and JSON, and on demand the plots as PNG and SVG."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dse.errors import UsageError
from dse.files.guard import guarding
from dse.files.writing import PAGES, write_files
from dse.report.document import Document
from dse.report.html import html_page, html_report
from dse.report.markdown import markdown_page
from dse.report.page import Page, Section
from dse.report.solve import written_page
from dse.results.answer import json_text
from dse.results.solve import Result

if TYPE_CHECKING:
    from dse.report.answers import Told
    from dse.results.robust import RobustResult
    from dse.results.sensitivity import SensitivityResult
    from dse.results.sweep import SweepResult

SUFFIXES = (".html", ".md", ".csv", ".json")


def report_name(result: Result) -> str:
    r"""The stem of a report's files: that of the problem file, in letters that every file system takes.

    >>> re.sub(r"[^\w.-]+", "-", "my <robot>").strip("-.")
    'my-robot'
    """
    return _stem_of(result.problem.file, result.problem.name)


def report_names(file: str, name: str) -> list[str]:
    """The files of the report of a problem with this file and name: HTML, Markdown, CSV and JSON.

    >>> report_names("problems/my robot.yaml", "Robot")
    ['my-robot.html', 'my-robot.md', 'my-robot.csv', 'my-robot.json']
    """
    return [f"{_stem_of(file, name)}{suffix}" for suffix in SUFFIXES]


def _stem_of(file: str, name: str) -> str:
    stem = Path(file).stem or name
    return re.sub(r"[^\w.-]+", "-", stem).strip("-.")[:100] or "report"


def report_files(
    document: Document, chosen: int | None = None, top: int | None = None, studies: Sequence[Section] = ()
) -> Iterator[tuple[str, str]]:
    """(file name, content) of each file of a report; Markdown has the reasons of the first `top` alternatives.

    `studies` are further sections of the page and the Markdown.
    """
    origin = document.result.problem
    page, words, table, whole = report_names(origin.file, origin.name)
    yield page, html_report(document, chosen, studies)
    yield words, markdown_report(document, top, studies)
    yield table, document.result.to_csv()
    yield whole, report_json(document)


def markdown_report(document: Document, top: int | None = None, studies: Sequence[Section] = ()) -> str:
    """The whole ranked table, the first three alternatives (or `top`, if fewer) in detail, and what it rests on.

    `studies` come before the foundations.
    """
    return markdown_page(written_page(document, top, studies))


def page_text(page: Page, path: str) -> str:
    """The page as the suffix of a path wants it: HTML, else Markdown."""
    return html_page(page) if is_html(path) else markdown_page(page)


def front_text(document: Document, path: str, studies: Sequence[Section] = ()) -> str:
    """The report of a front in one file, as the suffix of its path wants it."""
    return html_report(document, None, studies) if is_html(path) else markdown_report(document, None, studies)


def is_html(path: str) -> bool:
    """Whether a report of this name is HTML.

    >>> is_html("a.HTM"), is_html("a.md")
    (True, False)
    """
    return Path(path).suffix.lower() in (".html", ".htm")


def report_json(document: Document) -> str:
    """The result in the form ``dse-result/1``, with the reasons of each alternative."""
    data: dict[str, Any] = document.result.to_dict()
    for point, alternative in zip(data["front"], document.alternatives, strict=True):
        point["reasons"] = {sentence.label: sentence.text for sentence in alternative.sentences}
    return json_text(data)


def write_report(
    answer: Told,
    to: str | Path = "reports",
    *,
    alternative: int | None = None,
    top: int | None = None,
    studies: Sequence[SweepResult | SensitivityResult | RobustResult] = (),
) -> list[Path]:
    """Write what is said of an answer for people: a page, or of a front a folder with everything; the paths.

    Each file is written whole or not at all, in place of one of that name.

    Parameters
    ----------
    answer
        what `dse.solve` or any other verb returned.
    to
        the file of a page, ``NAME.html`` or ``NAME.md``; of a front also a folder, which is made if need be: HTML,
        Markdown, CSV and JSON, called like the problem's file.
    alternative
        the id of the point with which the page in a folder opens; None: the first in rank.
    top
        how many alternatives its Markdown details; None: three.
    studies
        sweeps and margins that it shows as well.

    Raises
    ------
    UsageError
        when one of them would take the place of the problem file, or of one that it includes; when `to` is a folder,
        and the answer no front; when there is no such alternative, or what is for a folder goes with a page.
    OSError
        when one cannot be written.

    Examples
    --------
    >>> import dse
    >>> [path.name for path in dse.write_report(dse.solve("pump.yaml"), "reports")]
    ['pump.html', 'pump.md', 'pump.csv', 'pump.json']
    >>> [path.name for path in dse.write_report(dse.check("pump.yaml"), "check.md")]
    ['check.md']
    """
    from dse.report.answers import text_of
    from dse.report.study import sections_of

    target = Path(to)
    sources = problem_files(answer) if isinstance(answer, Result) else []
    with guarding(*sources):
        if target.suffix.lower() in PAGES:
            if alternative is not None or top is not None or studies:
                raise UsageError(f"{to}: an alternative, a number of them and studies go with the report in a folder")
            return write_files(target.parent, [(target.name, text_of(answer, is_html=is_html(target.name)))])
        if not isinstance(answer, Result):
            raise UsageError(f"{to}: the report of this answer is a page: a path that ends in {' or '.join(PAGES)}")
        check_alternative(answer, alternative, "the result")
        sections = [section for study in studies for section in sections_of(study.to_dict())]
        target.mkdir(parents=True, exist_ok=True)
        return write_files(target, report_files(Document(answer), alternative, top, sections))


def check_alternative(result: Result, number: int | None, name: str) -> None:
    """Refuse an id that no point of the front has.

    Raises
    ------
    UsageError
        saying which there are.
    """
    if number is not None and number not in {point.id for point in result.front}:
        raise UsageError(f"{name}: has no alternative {number}; ids run from 1 to {len(result.front)}")


def problem_files(result: Result) -> list[Path]:
    """The files that the problem of a result was read from."""
    main = Path(result.problem.file)
    return [main, *(main.parent / name for name, _ in result.problem.includes)]
