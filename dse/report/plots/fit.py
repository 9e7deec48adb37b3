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
from dse.report.plots.front import Spec, whole_spec

MOST_POINTS = 4000
"""The greatest number of samples that are drawn for a plot: an even choice of them, with least and greatest always."""
HUES = {"samples": "var(--line)", "maximum": "var(--c2)", "mean": "var(--soft)", "minimum": "var(--c1)"}


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


def _axis(field: str, title: str) -> Spec:
    return {"field": field, "type": "quantitative", "title": title, "axis": {"tickCount": 6}}


def _colour(names: list[str]) -> Spec:
    scale = {"domain": names, "range": [HUES[name] for name in names]}
    return {"field": "what", "type": "nominal", "title": None, "scale": scale}


def _lines(item: Transport) -> Spec:
    marks = _marks(item)
    names = [name for name in HUES if any(mark["what"] == name for mark in marks)]
    place = {"x": _axis("x", "message size [B]"), "y": _axis("y", "transmission time [ms]")}
    last = max(one.size_bytes or 0 for one in item.summaries)
    lines = [
        {"x": size, "y": _ms(line.at(size)), "what": what}
        for what, line in (("maximum", item.high), ("minimum", item.low))
        for size in (0, last)
    ]
    layers: list[Spec] = [
        {
            "mark": {"type": "point", "filled": True, "size": 28, "opacity": 0.8},
            "encoding": {**place, "color": _colour(names)},
        },
        {
            "data": {"values": lines},
            "mark": {"type": "line", "strokeWidth": 2},
            "encoding": {**place, "color": _colour(names)},
        },
    ]
    spec = {"data": {"values": marks}, "layer": layers, "height": 260}
    return whole_spec(spec, f"Transmission time by message size, {item.where}: measured points, and both lines.")


def _residuals(item: Transport) -> Spec:
    rows = [
        {"x": one.size_bytes, "y": _ms(value - line.at(one.size_bytes or 0)), "what": what}
        for one in item.summaries
        for what, line, value in (("maximum", item.high, one.max_ns), ("minimum", item.low, one.min_ns))
    ]
    place = {"x": _axis("x", "message size [B]"), "y": _axis("y", "residual [ms]")}
    layers: list[Spec] = [
        {
            "data": {"values": [{"y": 0}]},
            "mark": {"type": "rule", "color": "var(--soft)"},
            "encoding": {"y": place["y"]},
        },
        {
            "mark": {"type": "point", "filled": True, "size": 34},
            "encoding": {**place, "color": _colour(["maximum", "minimum"])},
        },
    ]
    spec = {"data": {"values": rows}, "layer": layers, "height": 150}
    return whole_spec(spec, f"Measured less fitted transmission time by message size, {item.where}.")


def _ranges(executions: tuple[Execution, ...]) -> Spec:
    rows = [
        {
            "row": number,
            "label": item.where,
            "low": _ms(item.summary.min_ns),
            "high": _ms(item.summary.max_ns),
            "mean": None if item.summary.mean_ns is None else _ms(item.summary.mean_ns),
        }
        for number, item in enumerate(executions)
    ]
    row = {"field": "label", "type": "nominal", "title": None, "sort": {"field": "row"}, "axis": {"labelLimit": 300}}
    across = {"type": "quantitative", "title": "execution time [ms]"}
    layers: list[Spec] = [
        {
            "mark": {"type": "bar", "color": "var(--c1)", "opacity": 0.6, "height": 8},
            "encoding": {"y": row, "x": {**across, "field": "low"}, "x2": {"field": "high"}},
        },
        {
            "transform": [{"filter": "datum.mean !== null"}],
            "mark": {"type": "tick", "color": "var(--accent)", "thickness": 2},
            "encoding": {"y": row, "x": {**across, "field": "mean"}},
        },
    ]
    spec = {"data": {"values": rows}, "layer": layers, "height": 22 * len(rows) + 20}
    return whole_spec(spec, "Execution times of each thread on each platform: least to greatest, and the mean.")
