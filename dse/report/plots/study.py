"""The plots of studies as Vega-Lite specifications: steps of a limit, values of inputs, tornadoes, shares, histograms.

As in `dse.report.plots.front`, names from the problem occur as data and titles only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from dse.report.plots.front import Spec, whole_spec

HUES = ("var(--c1)", "var(--c2)", "var(--c3)", "var(--c4)", "var(--c5)", "var(--c6)")
BAR_HEIGHT = 34
SERIES = 6
"""The greatest number of lines that are told apart by colour; more are drawn alike."""


def lines_chart(
    records: Sequence[Mapping[str, Any]], across: str, up: str, description: str, *, steps: bool = False
) -> Spec:
    """Values of one objective: ``x`` and ``y`` as numbers, ``series`` as text, ``where`` and ``text`` for a reader.

    With `steps` a value holds until the next one.
    """
    names = list(dict.fromkeys(record["series"] for record in records))
    colour: Spec = {"value": HUES[0]}
    if 1 < len(names) <= SERIES:
        scale = {"domain": names, "range": list(HUES[: len(names)])}
        colour = {"field": "series", "type": "nominal", "title": None, "scale": scale}
    place = {
        "x": {"field": "x", "type": "quantitative", "title": across, "scale": {"zero": False}},
        "y": {"field": "y", "type": "quantitative", "title": up, "scale": {"zero": False, "nice": True}},
    }
    tooltip = [
        {"field": "series", "title": "of"},
        {"field": "where", "title": "at"},
        {"field": "text", "title": "best"},
    ]
    tooltip = tooltip if len(names) > 1 else tooltip[1:]
    line = {"type": "line", "interpolate": "step-after" if steps else "linear", "strokeWidth": 2}
    layers: list[Spec] = [
        {"mark": line, "encoding": {**place, "color": colour, "detail": {"field": "series"}}},
        {
            "transform": [{"filter": "datum.mark"}],
            "mark": {"type": "point", "filled": True, "size": 40, "opacity": 1},
            "encoding": {**place, "color": colour, "tooltip": tooltip},
        },
    ]
    return whole_spec({"data": {"values": list(records)}, "layer": layers, "height": 220}, description)


def tornado(bars: Sequence[Mapping[str, Any]], across: str, description: str) -> Spec:
    """Bars from ``low`` to ``high`` about ``nominal``, with ``label`` above each; in the given order.

    A Vega-Lite specification; `across` is the title of the axis with its unit, `description` the text for screen
    readers.
    """
    records = [{**bar, "row": number} for number, bar in enumerate(bars)]
    row = {
        "field": "row",
        "type": "ordinal",
        "title": None,
        "axis": None,
        "scale": {"paddingInner": 0.6, "paddingOuter": 0.5},
    }
    axis = {"type": "quantitative", "title": across, "scale": {"zero": False}, "axis": {"tickCount": 6}}
    tooltip = [
        {"field": "path", "title": "input"},
        {"field": "inputs", "title": "from and to"},
        {"field": "text", "title": "the metric"},
    ]
    layers: list[Spec] = [
        {
            "mark": {"type": "bar", "color": "var(--c1)", "opacity": 0.8},
            "encoding": {"y": row, "x": {**axis, "field": "low"}, "x2": {"field": "high"}, "tooltip": tooltip},
        },
        {
            "data": {"values": records[:1]},
            "mark": {"type": "rule", "color": "var(--accent)", "strokeDash": [4, 3]},
            "encoding": {"x": {**axis, "field": "nominal"}},
        },
        _labels(row),
    ]
    height = BAR_HEIGHT * len(records) + 8
    return whole_spec({"data": {"values": records}, "layer": layers, "height": height}, description)


def shares(records: Sequence[Mapping[str, Any]], across: str, description: str) -> Spec:
    """Bars from 0 to ``total``, of which ``first`` is solid, with ``label`` above each; in the given order.

    A Vega-Lite specification on a scale from 0 to 1: first-order indices inside total ones.
    """
    values = [{**record, "row": number} for number, record in enumerate(records)]
    row = {
        "field": "row",
        "type": "ordinal",
        "title": None,
        "axis": None,
        "scale": {"paddingInner": 0.6, "paddingOuter": 0.5},
    }
    axis = {"type": "quantitative", "title": across, "scale": {"domain": [0, 1]}, "axis": {"tickCount": 6}}
    layers: list[Spec] = [
        {
            "mark": {"type": "bar", "color": "var(--c1)", "opacity": opacity, "clip": True},
            "encoding": {"y": row, "x": {**axis, "field": field}, "tooltip": [{"field": "label", "title": "input"}]},
        }
        for field, opacity in (("total", 0.45), ("first", 1))
    ]
    height = BAR_HEIGHT * len(values) + 8
    spec = {"data": {"values": values}, "layer": [*layers, _labels(row)], "height": height}
    return whole_spec(spec, description)


def histogram(
    bars: Sequence[Mapping[str, Any]], marks: Sequence[Mapping[str, Any]], across: str, description: str
) -> Spec:
    """Counts from ``low`` to ``high``, and `marks`: lines ``at`` a place, each of a ``kind``; ``text`` has figures.

    A Vega-Lite specification; `across` is the title of the axis with its unit. Marks are bounds and observed extremes.
    """
    place = {"type": "quantitative", "title": across, "scale": {"zero": False}}
    kinds = list(dict.fromkeys(mark["kind"] for mark in marks))
    scale = {"domain": kinds, "range": ["var(--accent)", "var(--c2)"][: len(kinds)]}
    dashes = {"domain": kinds, "range": [[1, 0], [5, 4]][: len(kinds)]}
    line = {"field": "kind", "type": "nominal", "title": None, "legend": {"symbolStrokeWidth": 3}}
    layers: list[Spec] = [
        {
            "mark": {"type": "rect", "color": "var(--c1)", "stroke": "var(--paper)", "strokeWidth": 1},
            "encoding": {
                "x": {**place, "field": "low"},
                "x2": {"field": "high"},
                "y": {"field": "count", "type": "quantitative", "title": "data"},
                "y2": {"datum": 0},
                "tooltip": [{"field": "text", "title": "latency"}, {"field": "count", "title": "data"}],
            },
        },
        {
            "data": {"values": list(marks)},
            "mark": {"type": "rule", "strokeWidth": 2},
            "encoding": {
                "x": {**place, "field": "at"},
                "color": {**line, "scale": scale},
                "strokeDash": {**line, "scale": dashes},
                "tooltip": [{"field": "kind", "title": "bound"}, {"field": "text", "title": "latency"}],
            },
        },
    ]
    return whole_spec({"data": {"name": "bins", "values": list(bars)}, "layer": layers, "height": 200}, description)


def _labels(row: Spec) -> Spec:
    mark = {"type": "text", "align": "left", "baseline": "bottom", "dy": -8, "fontSize": 11, "limit": 560}
    return {"mark": mark, "encoding": {"y": row, "x": {"value": 2}, "text": {"field": "label"}}}
