"""A report in a folder: HTML, Markdown, CSV and JSON, and on demand the plots as PNG and SVG."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from dse.answers.base import json_text
from dse.answers.drawing.picture import Drafter
from dse.answers.measured import MeasuredComparison
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.answers.studies.sensitivity import SensitivityResult
from dse.answers.studies.sweep import SweepResult
from dse.fitting.fitted import Fit
from dse.report.content.front.document import Document
from dse.report.content.front.pages import written_page
from dse.report.content.study import sections_of, study_page
from dse.report.dispatch import Told, page_of
from dse.report.html import html_page, html_report
from dse.report.markdown import markdown_page
from dse.report.page import Page, Section
from dse.report.plots.canvas import Drawing
from dse.report.plots.deadlines import deadline_chart
from dse.report.plots.design import usage_chart, waterfall
from dse.report.plots.front import parallel, scatter
from dse.report.words.clocks import timeline
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.extras import needed_for
from dse.support.files.guard import guarding
from dse.support.files.writing import PAGES, write_files

SUFFIXES = (".html", ".md", ".csv", ".json")


def _report_name(result: Result) -> str:
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
    yield whole, _report_json(document)


def markdown_report(document: Document, top: int | None = None, studies: Sequence[Section] = ()) -> str:
    """The whole ranked table, the first three alternatives (or `top`, if fewer) in detail, and what it rests on.

    `studies` come before the foundations.
    """
    return markdown_page(written_page(document, top, studies))


def page_text(page: Page, path: str) -> str:
    """The page as the suffix of a path wants it: HTML, else Markdown.

    HTML for ``.html`` and ``.htm``, Markdown for anything else.
    """
    return html_page(page) if _is_html(path) else markdown_page(page)


def front_text(document: Document, path: str, studies: Sequence[Section] = ()) -> str:
    """The report of a front in one file, as the suffix of its path wants it.

    `studies` are further sections, such as a sensitivity study of the first design.
    """
    return html_report(document, None, studies) if _is_html(path) else markdown_report(document, None, studies)


def _is_html(path: str) -> bool:
    """Whether a report of this name is HTML.

    >>> _is_html("a.HTM"), _is_html("a.md")
    (True, False)
    """
    return Path(path).suffix.lower() in (".html", ".htm")


def _report_json(document: Document) -> str:
    """The result in the form ``dse-result/1``, with the reasons of each alternative."""
    data: dict[str, Any] = document.result.to_dict()
    for point, alternative in zip(data["front"], document.alternatives, strict=True):
        point["reasons"] = {sentence.label: sentence.text for sentence in alternative.sentences}
    return json_text(data)


@arguments.checked(
    answer=arguments.ANSWER,
    to=arguments.path,
    alternative=arguments.Whole(1, 10**9, is_optional=True),
    top=arguments.Whole(0, 10**9, is_optional=True),
)
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
    from dse.report.content.study import sections_of
    from dse.report.dispatch import text_of

    target = Path(to)
    sources = _problem_files(answer) if isinstance(answer, Result) else []
    with guarding(*sources):
        if target.suffix.lower() in PAGES:
            if alternative is not None or top is not None or studies:
                raise UsageError(f"{to}: an alternative, a number of them and studies go with the report in a folder")
            return write_files(target.parent, [(target.name, text_of(answer, is_html=_is_html(target.name)))])
        if target.suffix[1:].isalpha() and not target.is_dir():
            raise UsageError(f"{to}: a report is a page, {' or '.join(f'NAME{end}' for end in PAGES)}, or a folder")
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


def _problem_files(result: Result) -> list[Path]:
    """The files that the problem of a result was read from."""
    main = Path(result.problem.file)
    return [main, *(main.parent / name for name, _ in result.problem.includes)]


# The report of a study in a folder: HTML, Markdown, CSV and JSON, and on demand the plots as PNG and SVG.


def study_files(data: Mapping[str, Any], csv: str | None, json: str | None) -> Iterator[tuple[str, str]]:
    """(file name, content) of each file of a study's report: HTML, Markdown, and CSV and JSON where they are given.

    `data` is the JSON form of a sweep or sensitivity study; names are made of the problem's name and the kind of study.
    """
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
    """(file name, content) of each plot of a study.

    `formats` are ``svg`` and ``png``, which needs the extra `png`.
    """
    stem = f"{_stem(data['problem']['name'])}-{_kind(data)}"
    for section in sections_of(data):
        for plot in section.plots:
            svg = plot.draw().standalone()
            for kind in formats:
                yield f"{stem}-{_stem(plot.name)}.{kind}", svg if kind == "svg" else png_of(svg)


def _kind(data: Mapping[str, Any]) -> str:
    return str(data["format"]).removeprefix("dse-").partition("/")[0]


def _stem(text: str) -> str:
    return re.sub(r"[^\w.-]+", "-", text).strip("-.")[:80] or "study"


# The plots as PNG and SVG files, without a browser.


SCALE = 2
"""Pixels of a PNG for a pixel of its plot."""


def figure_files(
    document: Document, formats: Sequence[str], chosen: int | None = None
) -> Iterator[tuple[str, str | bytes]]:
    """(file name, content) of each plot of the front, and of those of the alternative `chosen` (the first in rank).

    Names begin with the report's name, such as ``inmark-scatter.svg``; nothing for an empty front.
    """
    if not document.result.front:
        return
    stem = _report_name(document.result)
    for name, draw in drawings(document, chosen):
        svg = draw()
        for kind in formats:
            yield f"{stem}-{name}.{kind}", svg if kind == "svg" else png_of(svg)


def page_figures(page: Page, formats: Sequence[str], stem: str) -> Iterator[tuple[str, str | bytes]]:
    """(file name, content) of each plot of a page; names begin with `stem`.

    `formats` are ``svg`` and ``png``; characters that a file name should not have become hyphens.
    """
    for plot in chain.from_iterable(section.plots for section in page.sections):
        svg = plot.draw().standalone()
        name = re.sub(r"[^\w.-]+", "-", f"{stem}-{plot.name}").strip("-.")[:100]
        for kind in formats:
            yield f"{name}.{kind}", svg if kind == "svg" else png_of(svg)


def drawings(document: Document, chosen: int | None = None) -> Iterator[tuple[str, Callable[[], str]]]:
    """(name, what makes its SVG) of each plot of a front, and of the design `chosen` (None: the first in rank).

    Front plots (scatter, parallel coordinates), then latencies, timelines, use of processors and deadlines of the
    design.
    """
    result = document.result
    point = next((one for one in result.front if one.id == chosen), result.front[0])
    number = point.id
    yield "scatter", lambda: scatter(result, document.records, number, document.baseline_record).standalone()
    yield "parallel", lambda: parallel(result, document.records, number).standalone()
    item = document.alternative(point)
    for position, flow in enumerate(item.flows, start=1):
        if flow.records:
            yield f"{number}-latency-{position}", partial(_drawn, waterfall, flow.source, flow.records)
    for position, part in enumerate(item.clocks, start=1):
        if part.records:
            yield f"{number}-timeline-{position}", partial(_drawn, timeline, part.records)
    if item.usage:
        yield f"{number}-usage", partial(_drawn, usage_chart, item.usage)
    if item.deadlines:
        yield f"{number}-deadlines", partial(_drawn, deadline_chart, item.deadlines)
    yield f"{number}-architecture", lambda: Drafter(result.space).standalone(item.point.design)


def _drawn(chart: Callable[..., Drawing], *data: Any) -> str:
    return chart(*data).standalone()


def png_of(svg: str) -> bytes:
    """A plot or drawing as PNG.

    The content of a PNG file, enlarged by `SCALE`. Raises `UsageError` where the extra `png` is not installed.
    """
    with needed_for("A picture as PNG", "png"):
        import resvg_py

    return bytes(resvg_py.svg_to_bytes(svg_string=svg, zoom=SCALE))


# The plots of any answer as files of their own.


FORMATS = ("png", "svg")


@arguments.checked(
    answer=arguments.ANSWER,
    to=arguments.path,
    formats=arguments.texts,
    alternative=arguments.Whole(1, 10**9, is_optional=True),
)
def write_figures(
    answer: Told, to: str | Path = "figures", formats: Sequence[str] = ("svg",), alternative: int | None = None
) -> list[Path]:
    """Write the plots of an answer as pictures, for a paper or slides; the paths.

    Parameters
    ----------
    answer
        what `dse.solve` or any other verb returned.
    to
        the folder, which is made if need be.
    formats
        ``svg``, ``png`` (which needs the extra `png`), or both.
    alternative
        of a front, the id of the point whose latencies, loads and architecture are drawn; None: the first in rank.

    Raises
    ------
    UsageError
        when there is no such format or alternative, or nothing to draw; of ``png`` without the extra `png`.
    OSError
        when a file cannot be written.

    Examples
    --------
    >>> import dse
    >>> [path.name for path in dse.write_figures(dse.solve("pump.yaml"), "figures")][:2]
    ['pump-scatter.svg', 'pump-parallel.svg']
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise UsageError(f"{unknown[0]}: expected png, svg or both")
    front = answer.robust if isinstance(answer, RobustResult) else answer
    with guarding(*(_problem_files(front) if isinstance(front, Result) else [])):
        files = list(_figures(front, tuple(formats), alternative))
        if not files:
            raise UsageError("there is nothing to draw in this answer")
        target = Path(to)
        target.mkdir(parents=True, exist_ok=True)
        return write_files(target, files)


def _figures(answer: Told, formats: tuple[str, ...], alternative: int | None) -> Iterator[tuple[str, str | bytes]]:
    if isinstance(answer, Result):
        check_alternative(answer, alternative, "the result")
        return figure_files(Document(answer), formats, alternative)
    if alternative is not None:
        raise UsageError("only a front has alternatives")
    if isinstance(answer, SweepResult | SensitivityResult):
        return study_figures(answer.to_dict(), formats)
    page = page_of(answer)
    is_measured = isinstance(answer, Fit | MeasuredComparison)
    return page_figures(page, formats, Path(answer.files[0]).stem if is_measured else page.title)  # type: ignore[union-attr]
