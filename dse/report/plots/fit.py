"""Fits as plots: samples, lines and residuals of each transport, ranges of execution times."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from dse.fitting.fitted import Execution, Transport
from dse.fitting.measurements import Summary
from dse.report.page import Plot
from dse.report.plots.canvas import Drawing
from dse.report.plots.charts import ChartBar, ChartRow, Series, plane_chart, rows_chart

MOST_POINTS = 4000
"""The greatest number of samples that are drawn for a plot: an even choice of them, with least and greatest always."""
COLOURS = {"samples": "line", "maximum": "c2", "mean": "soft", "minimum": "c1"}


def transport_plots(item: Transport) -> Iterator[Plot]:
    """A plot of a transport on a platform, and its residuals.

    Transmission times in ms over message sizes in bytes.
    """
    words = f"Transmission times of {item.where}: what was measured, and the lines."
    yield Plot(item.where, partial(_lines, item), words)
    yield Plot(
        f"{item.where} residuals", partial(_residuals, item), f"Residuals of {item.where}: measured less fitted."
    )


def execution_plot(executions: tuple[Execution, ...]) -> Plot:
    """A plot of all execution times.

    One row for each thread or callback, from the shortest to the longest sample.
    """
    return Plot("execution times", partial(_ranges, executions), "Execution times: least to greatest, and the mean.")


def _ms(value: Fraction | float) -> float:
    return float(value) / 1e6


def _drawn(item: Summary, most: int) -> list[float]:
    """Some samples of a row in ms, evenly chosen by their rank."""
    ordered = np.sort(item.samples_ns)
    places = np.unique(np.linspace(0, len(ordered) - 1, min(most, len(ordered))).round().astype(int))
    return [_ms(value) for value in ordered[places]]


def _marks(item: Transport) -> list[dict[str, Any]]:
    most = max(10, MOST_POINTS // len(item.summaries))
    marks = [
        {"x": one.size_bytes, "y": value, "what": "samples"}
        for one in item.summaries
        if len(one.samples_ns)
        for value in _drawn(one, most)
    ]
    for one in item.summaries:
        marks.append({"x": one.size_bytes, "y": _ms(one.max_ns), "what": "maximum"})
        if one.mean_ns is not None:
            marks.append({"x": one.size_bytes, "y": _ms(one.mean_ns), "what": "mean"})
        marks.append({"x": one.size_bytes, "y": _ms(one.min_ns), "what": "minimum"})
    return marks


def _lines(item: Transport) -> Drawing:
    marks = _marks(item)
    last = max(one.size_bytes or 0 for one in item.summaries)
    series = [
        Series(
            name, colour, tuple((m["x"], m["y"], f"{m['y']:.6g} ms, {m['x']} B") for m in marks if m["what"] == name)
        )
        for name, colour in COLOURS.items()
        if any(mark["what"] == name for mark in marks)
    ]
    legend = [(one.name, one.colour) for one in series]
    series += [
        Series(name, COLOURS[name], tuple((size, _ms(line.at(size)), "") for size in (0, last)), "line")
        for name, line in (("maximum", item.high), ("minimum", item.low))
    ]
    words = f"Transmission time by message size, {item.where}: measured points, and both lines."
    return plane_chart(
        series, "message size [B]", "transmission time [ms]", words, legend=legend, height=240, with_zero=True
    )


def _residuals(item: Transport) -> Drawing:
    ends = [min(one.size_bytes or 0 for one in item.summaries), max(one.size_bytes or 0 for one in item.summaries)]
    series = [Series("none", "soft", tuple((size, 0.0, "") for size in ends), "line")]
    for name, line in (("maximum", item.high), ("minimum", item.low)):
        points = []
        for one in item.summaries:
            value = one.max_ns if name == "maximum" else one.min_ns
            left = _ms(value - line.at(one.size_bytes or 0))
            points.append((one.size_bytes or 0, left, f"{left:.6g} ms, {one.size_bytes} B"))
        series.append(Series(name, COLOURS[name], tuple(points)))
    legend = [(one.name, one.colour) for one in series[1:]]
    words = f"Measured less fitted transmission time by message size, {item.where}."
    return plane_chart(series, "message size [B]", "residual [ms]", words, legend=legend, height=130)


def _ranges(executions: tuple[Execution, ...]) -> Drawing:
    rows = []
    for item in executions:
        low, high = _ms(item.summary.min_ns), _ms(item.summary.max_ns)
        mean = None if item.summary.mean_ns is None else _ms(item.summary.mean_ns)
        bar = ChartBar(low, high, "f-c1 pale", f"{item.where}: {low:.6g} to {high:.6g} ms")
        marks = () if mean is None else ((mean, "l-accent two", f"mean {mean:.6g} ms"),)
        rows.append(ChartRow(item.where, (bar,), marks))
    words = "Execution times of each thread on each platform: least to greatest, and the mean."
    return rows_chart(rows, "execution time [ms]", words, thickness=8)
