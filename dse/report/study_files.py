"""The report of a study in a folder: HTML, Markdown, CSV and JSON, and on demand the plots as PNG and SVG."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from dse.report.html import html_page
from dse.report.markdown import markdown_page
from dse.report.plot_files import png_of, svg_of
from dse.report.study import sections_of, study_page
from dse.report.writing import SUFFIXES


def study_files(data: Mapping[str, Any], csv: str | None, json: str | None) -> Iterator[tuple[str, str]]:
    """(file name, content) of each file of a study's report: HTML, Markdown, and CSV and JSON where they are given."""
    names = study_names(data["problem"]["name"], _kind(data))
    page = study_page(data)
    yield names[0], html_page(page)
    yield names[1], markdown_page(page)
    if csv is not None:
        yield names[2], csv
    if json is not None:
        yield names[3], json


def study_names(problem: str, kind: str) -> list[str]:
    """The files of the report of a ``sweep`` or ``sensitivity``: HTML, Markdown, CSV and JSON.

    >>> study_names("My <robot>", "sweep")[0]
    'My-robot-sweep.html'
    """
    return [f"{_stem(problem)}-{kind}{suffix}" for suffix in SUFFIXES]


def study_figures(data: Mapping[str, Any], formats: Sequence[str]) -> Iterator[tuple[str, str | bytes]]:
    """(file name, content) of each plot of a study."""
    stem = f"{_stem(data['problem']['name'])}-{_kind(data)}"
    for section in sections_of(data):
        for plot in section.plots:
            svg = svg_of(plot.draw())
            for kind in formats:
                yield f"{stem}-{_stem(plot.name)}.{kind}", svg if kind == "svg" else png_of(svg)


def _kind(data: Mapping[str, Any]) -> str:
    return str(data["format"]).removeprefix("dse-").partition("/")[0]


def _stem(text: str) -> str:
    return re.sub(r"[^\w.-]+", "-", text).strip("-.")[:80] or "study"
