"""The plots as PNG and SVG files, without a browser."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

from dse.extras import needed_for
from dse.report.bars import usage_chart, waterfall
from dse.report.charts import Spec, parallel, scatter
from dse.report.deadlines import deadline_chart
from dse.report.document import Alternative, Document
from dse.report.drawing import Drafter
from dse.report.page import Page
from dse.report.theme import LIGHT, with_colours
from dse.report.timeline import timeline
from dse.report.writing import report_name

WIDTH = 760
SCALE = 1.5
NAMED = ("values", "title", "description", "sort", "domain")
"""Where names of the problem stand in a specification."""


def figure_files(
    document: Document, formats: Sequence[str], chosen: int | None = None
) -> Iterator[tuple[str, str | bytes]]:
    """(file name, content) of each plot of the front, and of those of the alternative `chosen` (the first in rank)."""
    alternatives = document.alternatives
    if not alternatives:
        return
    item = next((one for one in alternatives if one.point.id == chosen), alternatives[0])
    stem = report_name(document.result)
    for name, svg in _drawings(document, item):
        for kind in formats:
            yield f"{stem}-{name}.{kind}", svg if kind == "svg" else png_of(svg)


def page_figures(page: Page, formats: Sequence[str], stem: str) -> Iterator[tuple[str, str | bytes]]:
    """(file name, content) of each plot of a page; names begin with `stem`."""
    for plot in chain.from_iterable(section.plots for section in page.sections):
        svg = svg_of(plot.draw())
        name = re.sub(r"[^\w.-]+", "-", f"{stem}-{plot.name}").strip("-.")[:100]
        for kind in formats:
            yield f"{name}.{kind}", svg if kind == "svg" else png_of(svg)


def _drawings(document: Document, item: Alternative) -> Iterator[tuple[str, str]]:
    """(name, SVG) of each plot."""
    result, number = document.result, item.point.id
    yield "scatter", svg_of(scatter(result, document.records, number, document.baseline_record))
    yield "parallel", svg_of(parallel(result, document.records, number))
    for position, flow in enumerate(item.flows, start=1):
        if flow.records:
            yield f"{number}-latency-{position}", svg_of(waterfall(flow.source, flow.records))
    for position, part in enumerate(item.clocks, start=1):
        if part.records:
            yield f"{number}-timeline-{position}", svg_of(timeline(part.records))
    if item.usage:
        yield f"{number}-usage", svg_of(usage_chart(item.usage))
    if item.deadlines:
        yield f"{number}-deadlines", svg_of(deadline_chart(item.deadlines))
    yield f"{number}-architecture", Drafter(result.space).standalone(item.point.design)


def svg_of(spec: Spec) -> str:
    """The plot in light colours, at a fixed width."""
    with needed_for("A plot as a picture", "plots"):
        import vl_convert

    literal: dict[str, Any] = _literal(spec)
    literal["width"] = WIDTH
    literal["config"] = {**literal["config"], "background": LIGHT["paper"], "font": "sans-serif", "padding": 12}
    literal["config"]["text"] = {**literal["config"]["text"], "font": "sans-serif"}
    svg: str = vl_convert.vegalite_to_svg(literal)
    return svg


def _literal(part: Any) -> Any:
    """The part of a specification with literal colours; names in data and titles stay what they are."""
    if isinstance(part, dict):
        return {
            key: value if key in NAMED and not isinstance(value, dict) else _literal(value)
            for key, value in part.items()
        }
    if isinstance(part, list | tuple):
        return [_literal(item) for item in part]
    return with_colours(part, LIGHT) if isinstance(part, str) else part


def png_of(svg: str) -> bytes:
    """A plot or drawing as PNG."""
    with needed_for("A plot as a picture", "plots"):
        import vl_convert

    png: bytes = vl_convert.svg_to_png(svg, scale=SCALE)
    return png
