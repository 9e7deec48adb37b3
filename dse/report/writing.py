"""A report in a folder: HTML, Markdown, CSV and JSON, and on demand the plots as PNG and SVG."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from dse.files.guard import guarding
from dse.files.writing import write_files
from dse.report.document import Document
from dse.report.html import html_report
from dse.report.markdown import markdown_report
from dse.report.parts import Section
from dse.results.solve import Result

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


def report_json(document: Document) -> str:
    """The result in the form ``dse-result/1``, with the reasons of each alternative."""
    data: dict[str, Any] = document.result.to_dict()
    for point, alternative in zip(data["front"], document.alternatives, strict=True):
        point["reasons"] = {sentence.label: sentence.text for sentence in alternative.sentences}
    return json.dumps(data, ensure_ascii=False, indent=1) + "\n"


def write_report(result: Result, folder: str | Path = "reports") -> list[Path]:
    """Write a report into a folder, which is made if need be: HTML, Markdown, CSV, JSON; their paths.

    Each file is written whole or not at all, in place of one of that name.

    Parameters
    ----------
    result
        what `dse.solve` returned.
    folder
        where to; the files are called like the problem's.

    Raises
    ------
    UsageError
        when one of them would take the place of the problem file, or of one that it includes.
    OSError
        when one cannot be written.

    Examples
    --------
    >>> import dse
    >>> [path.name for path in dse.write_report(dse.solve("pump.yaml"), "reports")]
    ['pump.html', 'pump.md', 'pump.csv', 'pump.json']
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    with guarding(*problem_files(result)):
        return write_files(target, report_files(Document(result)))


def problem_files(result: Result) -> list[Path]:
    """The files that the problem of a result was read from."""
    main = Path(result.problem.file)
    return [main, *(main.parent / name for name, _ in result.problem.includes)]
