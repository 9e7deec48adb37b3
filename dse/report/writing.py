"""A report in a folder: HTML, Markdown, CSV and JSON, and on demand the plots as PNG and SVG."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from dse.report.document import Document
from dse.report.html import html_report
from dse.report.markdown import markdown_report
from dse.report.parts import Section
from dse.results.result import Result


def report_name(result: Result) -> str:
    r"""The stem of a report's files: that of the problem file, in letters that every file system takes.

    >>> re.sub(r"[^\w.-]+", "-", "my <robot>").strip("-.")
    'my-robot'
    """
    stem = Path(result.problem.file).stem or result.problem.name
    return re.sub(r"[^\w.-]+", "-", stem).strip("-.")[:100] or "report"


def report_files(
    document: Document, chosen: int | None = None, top: int | None = None, studies: Sequence[Section] = ()
) -> Iterator[tuple[str, str]]:
    """(file name, content) of each file of a report; Markdown has the reasons of the first `top` alternatives.

    `studies` are further sections of the page and the Markdown.
    """
    stem = report_name(document.result)
    yield f"{stem}.html", html_report(document, chosen, studies)
    yield f"{stem}.md", markdown_report(document, top, studies)
    yield f"{stem}.csv", document.result.to_csv()
    yield f"{stem}.json", report_json(document)


def report_json(document: Document) -> str:
    """The result in the form ``dse-result/1``, with the reasons of each alternative."""
    data: dict[str, Any] = document.result.to_dict()
    for point, alternative in zip(data["front"], document.alternatives, strict=True):
        point["reasons"] = {sentence.label: sentence.text for sentence in alternative.sentences}
    return json.dumps(data, ensure_ascii=False, indent=1) + "\n"


def write_report(result: Result, folder: str | Path = "reports") -> list[Path]:
    """Write a report into a folder, which is made if need be: HTML, Markdown, CSV, JSON; their paths."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, content in report_files(Document(result)):
        (target / name).write_text(content, encoding="utf-8")
        paths.append(target / name)
    return paths
