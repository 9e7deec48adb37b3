"""The plots of studies: steps of a limit, values of inputs, tornadoes, shares, histograms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from dse.report.plots.canvas import Drawing
from dse.report.plots.charts import ChartBar, ChartRow, Series, plane_chart, rows_chart

COLOURS = ("c1", "c2", "c3", "c4", "c5", "c6")
"""The colours of lines; where there are more lines they are drawn alike."""


def lines_chart(
    records: Sequence[Mapping[str, Any]], across: str, up: str, description: str, *, steps: bool = False
) -> Drawing:
    """Values of one objective: ``x`` and ``y`` as numbers, ``series`` as text, ``where`` and ``text`` for a reader.

    With `steps` a value holds until the next one. A record with ``mark`` has a point.
    """
    names = list(dict.fromkeys(record["series"] for record in records))
    is_told_apart = len(names) <= len(COLOURS)
    series = [
        Series(
            name,
            COLOURS[number] if is_told_apart else COLOURS[0],
            tuple((item["x"], item["y"], _said(item)) for item in records if item["series"] == name),
            "steps" if steps else "line",
        )
        for number, name in enumerate(names)
    ]
    legend = None if is_told_apart else ()
    return plane_chart(series, across, up, description, legend=legend)


def _said(record: Mapping[str, Any]) -> str:
    """The words that a page shows at a point of a line: series, value and place; empty at a bend without a mark."""
    if not record["mark"]:
        return ""
    of = f"{record['series']}: " if record["series"] else ""
    return f"{of}{record['text']} at {record['where']}"


def tornado(bars: Sequence[Mapping[str, Any]], across: str, description: str) -> Drawing:
    """Bars from ``low`` to ``high``, ``label`` above each, in the given order; a dashed line at ``nominal``.

    `across` is the title of the axis with its unit, `description` the text for screen readers.
    """
    ends = [value for bar in bars for value in (bar["low"], bar["high"], bar["nominal"]) if value is not None]
    wide = (max(ends, default=1.0) - min(ends, default=0.0)) * 0.03 or 0.5
    rows = [
        ChartRow(
            bar["label"],
            (ChartBar(bar["low"], bar["high"], tip=f"{bar['path']} from {bar['inputs']}: {bar['text']}"),)
            if bar["low"] is not None and bar["high"] is not None
            else (),
        )
        for bar in bars
    ]
    rules = [(bars[0]["nominal"], "l-accent dashed two")] if bars and bars[0]["nominal"] is not None else []
    domain = (min(ends, default=0.0) - wide, max(ends, default=1.0) + wide)
    return rows_chart(rows, across, description, domain=domain, rules=rules)


def shares(records: Sequence[Mapping[str, Any]], across: str, description: str) -> Drawing:
    """Bars from 0 to ``total``, of which ``first`` is solid, with ``label`` above each; in the given order.

    The scale is from 0 to 1: first-order indices inside total ones.
    """
    rows = [
        ChartRow(
            item["label"],
            tuple(ChartBar(0.0, item[key], look) for key, look in (("total", "f-c1 pale"), ("first", "f-c1"))),
        )
        for item in records
    ]
    return rows_chart(rows, across, description, domain=(0.0, 1.0))


def histogram(
    bars: Sequence[Mapping[str, Any]], marks: Sequence[Mapping[str, Any]], across: str, description: str
) -> Drawing:
    """Counts from ``low`` to ``high``, and `marks`: lines ``at`` a place, each of a ``kind``; ``text`` has figures.

    `across` is the title of the axis with its unit. Marks are bounds and observed extremes.
    """
    looks = ("l-accent two", "l-c2 two dashed")
    kinds = list(dict.fromkeys(mark["kind"] for mark in marks))
    boxes = [(bar["low"], bar["high"], bar["count"], f"{bar['text']}: {bar['count']} data") for bar in bars]
    rules = [(m["at"], looks[kinds.index(m["kind"])], f"{m['kind']}: {m['text']}") for m in marks]
    legend = list(zip(kinds, ("accent", "c2"), strict=False))
    return plane_chart([], across, "data", description, boxes=boxes, rules=rules, legend=legend, height=170)
