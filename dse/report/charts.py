"""The plots as Vega-Lite specifications: one description for the report, where they answer to each other, and for PNG and SVG.

Colours are CSS variables (`dse.report.theme`). Names from the problem occur as data and titles only, never as field
names or in expressions: fields are called ``o0``, ``o1``, … in the order of the objectives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

from dse.results.analysis import FlowTable, Usage
from dse.results.result import ObjectiveInfo, Result
from dse.results.values import counted, display_unit, readable

Spec: TypeAlias = dict[str, Any]
SCHEMA = "https://vega.github.io/schema/vega-lite/v6.json"
METHODS = (
    "sampling",
    "processing time",
    "transmission time",
    "queued",
    "specified",
    "response time",
    "deadline",
    "other",
)
HUES = ("var(--c1)", "var(--c2)", "var(--c3)", "var(--c4)", "var(--c5)", "var(--c6)", "var(--accent)", "var(--soft)")
STEPS = ("var(--s1)", "var(--s2)", "var(--s3)", "var(--s4)")
KEPT = "kept === null || indexof(kept, datum.id) >= 0"
CONFIG: Spec = {
    "background": None,
    "font": "system-ui, sans-serif",
    "view": {"stroke": None},
    "axis": {
        "labelColor": "var(--ink)",
        "titleColor": "var(--ink)",
        "gridColor": "var(--line)",
        "gridOpacity": 0.5,
        "domainColor": "var(--soft)",
        "tickColor": "var(--soft)",
        "labelFontSize": 11,
        "titleFontSize": 12,
        "titleFontWeight": 600,
    },
    "legend": {
        "labelColor": "var(--ink)",
        "titleColor": "var(--ink)",
        "labelFontSize": 11,
        "titleFontSize": 11,
        "orient": "top",
        "columns": 3,
        "symbolStrokeWidth": 0,
        "labelLimit": 220,
        "titleLimit": 320,
    },
    "text": {"color": "var(--ink)", "font": "system-ui, sans-serif"},
    "title": {"color": "var(--ink)", "anchor": "start"},
}


def front_records(result: Result) -> list[dict[str, Any]]:
    """A record per point: ``id``, ``rank``; for objective k its value ``o<k>`` in readable units, text ``t<k>``, class ``q<k>``.

    ``n<k>`` is the place between the worst (0) and the best value (1) of the front.
    """
    records: list[dict[str, Any]] = [{"id": point.id, "rank": point.rank} for point in result.front]
    for axis, info in enumerate(result.objectives):
        values = [point.objectives[info.name] for point in result.front]
        factor, _ = display_unit(info.unit, result.space.currency)
        low, high = min(values, default=0), max(values, default=0)
        classes = _classes(values, info, result.space.currency)
        for record, value in zip(records, values, strict=True):
            place = Fraction(value - low, high - low) if high > low else Fraction(1, 2)
            record[f"o{axis}"] = float(value / factor)
            record[f"t{axis}"] = counted(value, info.unit, result.space.currency)
            record[f"n{axis}"] = float(place if info.sense == "maximise" else 1 - place)
            record[f"q{axis}"] = classes[value]
    return records


def _classes(values: Sequence[int], info: ObjectiveInfo, currency: str) -> dict[int, str]:
    """Each value's class: the value itself where there are up to four, else a quarter of the values, in words."""
    distinct = sorted(set(values))
    if len(distinct) <= len(STEPS):
        return {value: counted(value, info.unit, currency) for value in distinct}
    found = {}
    for step in range(len(STEPS)):
        part = distinct[len(distinct) * step // 4 : len(distinct) * (step + 1) // 4]
        ends = [counted(value, info.unit, currency) for value in (part[0], part[-1])]
        found.update(dict.fromkeys(part, ends[0] if len(part) == 1 else f"{ends[0]} to {ends[1]}"))
    return found


def class_order(result: Result, axis: int) -> list[str]:
    """The classes of an objective, smallest values first."""
    info = result.objectives[axis]
    values = [point.objectives[info.name] for point in result.front]
    classes = _classes(values, info, result.space.currency)
    return list(dict.fromkeys(classes[value] for value in sorted(classes)))


def axis_title(result: Result, axis: int) -> str:
    """``price [EUR]``."""
    info = result.objectives[axis]
    return f"{info.name} [{display_unit(info.unit, result.space.currency)[1]}]"


def scatter(
    result: Result, records: Sequence[Mapping[str, Any]], chosen: int | None, baseline: Mapping[str, Any] | None
) -> Spec:
    """Two objectives against each other, the third as colour; the chosen point and today's design stand out."""
    axes = [0, 1] if len(result.objectives) > 1 else [0, 0]
    titles = [axis_title(result, axis) for axis in axes]
    tooltip = [{"field": "id", "title": "alternative"}] + [
        {"field": f"t{axis}", "title": info.name} for axis, info in enumerate(result.objectives)
    ]
    position = {
        name: {
            "field": f"o{axis}",
            "type": "quantitative",
            "title": title,
            "scale": {"zero": False, "padding": 14},
            "axis": {"labelOverlap": True, "tickCount": 6},
        }
        for name, axis, title in zip("xy", axes, titles, strict=True)
    }
    points: Spec = {
        "name": "points",
        "params": [{"name": "brush", "select": {"type": "interval"}}],
        "mark": {"type": "point", "filled": True, "cursor": "pointer", "tooltip": True},
        "encoding": {
            **position,
            "opacity": {"condition": {"test": KEPT, "value": 0.95}, "value": 0.12},
            "size": {"condition": {"test": "datum.id === chosen", "value": 200}, "value": 80},
            "stroke": {"condition": {"test": "datum.id === chosen", "value": "var(--accent)"}, "value": "var(--paper)"},
            "strokeWidth": {"condition": {"test": "datum.id === chosen", "value": 3}, "value": 0.6},
            "tooltip": tooltip,
            "color": {"value": "var(--c1)"},
        },
    }
    if len(result.objectives) > 2:
        points["encoding"]["color"] = colour_by(result, 2)
    label: Spec = {
        "transform": [{"filter": "datum.id === chosen"}],
        "mark": {
            "type": "text",
            "dx": 13,
            "align": "left",
            "fontWeight": 700,
            "color": "var(--accent)",
            "fontSize": 12,
        },
        "encoding": {**position, "text": {"field": "label"}},
    }
    layers = [points, label]
    if baseline is not None:
        layers.append(
            {
                "data": {"values": [dict(baseline)], "name": "baseline"},
                "mark": {
                    "type": "point",
                    "shape": "cross",
                    "filled": True,
                    "size": 140,
                    "color": "var(--ink)",
                    "tooltip": True,
                },
                "encoding": {**position, "tooltip": tooltip[1:]},
            }
        )
        layers.append(
            {
                "data": {"values": [dict(baseline)]},
                "mark": {"type": "text", "dy": -13, "color": "var(--ink)", "fontSize": 11},
                "encoding": {**position, "text": {"value": "baseline"}},
            }
        )
    values = [{**record, "label": f"#{record['id']}"} for record in records]
    return _whole(
        {"params": _params(chosen), "data": {"name": "front", "values": values}, "layer": layers, "height": 340},
        f"Pareto scatter: {titles[0]} across, {titles[1]} up; {len(records)} alternatives.",
    )


def colour_by(result: Result, axis: int) -> Spec:
    """Colour by the class of an objective."""
    domain = class_order(result, axis)
    steps = STEPS if len(domain) > 2 else (STEPS[1], STEPS[3])
    scale = {"domain": domain, "range": list(steps[: len(domain)])}
    return {"field": f"q{axis}", "type": "ordinal", "scale": scale, "title": axis_title(result, axis)}


def parallel(result: Result, records: Sequence[Mapping[str, Any]], chosen: int | None) -> Spec:
    """Every objective as an axis with its best value on top, every alternative as a line."""
    names = [info.name for info in result.objectives]
    values = [
        {"id": record["id"], "axis": axis, "name": names[axis], "place": record[f"n{axis}"], "text": record[f"t{axis}"]}
        for record in records
        for axis in range(len(names))
    ]
    ends = []
    for axis, info in enumerate(result.objectives):
        ordered = sorted((point.objectives[info.name] for point in result.front), reverse=info.sense == "maximise")
        for place, value in ((1.0, ordered[0]), (0.0, ordered[-1])) if ordered else ():
            if place or value != ordered[0]:
                ends.append(
                    {
                        "axis": axis,
                        "name": names[axis],
                        "place": place,
                        "text": counted(value, info.unit, result.space.currency),
                    }
                )
    across: Spec = {
        "field": "name",
        "type": "nominal",
        "sort": names,
        "title": None,
        "scale": {"padding": 0.25},
        "axis": {
            "labelAngle": 0,
            "orient": "top",
            "labelLimit": 160,
            "grid": True,
            "domain": False,
            "ticks": False,
            "labelFontWeight": 600,
        },
    }
    up: Spec = {"field": "place", "type": "quantitative", "axis": None, "scale": {"domain": [-0.04, 1.04]}}
    line = {"x": across, "y": up, "detail": {"field": "id"}}
    tooltip = [
        {"field": "id", "title": "alternative"},
        {"field": "name", "title": "objective"},
        {"field": "text", "title": "value"},
    ]
    layers: list[Spec] = [
        {
            "mark": {"type": "line", "strokeWidth": 1.6, "color": "var(--c1)"},
            "encoding": {**line, "opacity": {"condition": {"test": KEPT, "value": 0.6}, "value": 0.07}},
        },
        {
            "transform": [{"filter": "datum.id === chosen"}],
            "mark": {
                "type": "line",
                "strokeWidth": 4,
                "color": "var(--accent)",
                "point": {"color": "var(--accent)", "size": 60},
            },
            "encoding": line,
        },
        {
            "mark": {"type": "line", "strokeWidth": 12, "opacity": 0.001, "cursor": "pointer"},
            "encoding": {**line, "tooltip": tooltip},
        },
        {
            "data": {"values": ends},
            "mark": {"type": "text", "dx": 6, "align": "left", "fontSize": 11},
            "encoding": {"x": across, "y": up, "text": {"field": "text"}},
        },
    ]
    return _whole(
        {"params": _params(chosen), "data": {"name": "lines", "values": values}, "layer": layers, "height": 260},
        f"Parallel coordinates: {', '.join(names)}; the best value of each is on top.",
    )


def waterfall_records(table: FlowTable) -> list[dict[str, Any]]:
    """The rows of a flow's contributor table that take time: ``row`` counts from 1, ``text`` is what a reader sees."""
    return [
        {
            "row": number,
            "label": row.contributor,
            "method": row.max_method if row.max_method in METHODS else "other",
            "min_ns": row.min_ns,
            "max_ns": row.max_ns,
            "text": f"{counted(row.min_ns, 'ns')} to {counted(row.max_ns, 'ns')}",
        }
        for number, row in enumerate(table.rows, start=1)
        if row.max_ns
    ]


def stacked_rows(records: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The records with their bars, in ms: each starts where the worst case of the one before it ends (report.js does the same)."""
    found = []
    start = 0
    for record in records:
        bar = {"start": start / 1e6, "best": (start + record["min_ns"]) / 1e6, "end": (start + record["max_ns"]) / 1e6}
        found.append({**record, **bar, "title": f"{record['label']} · {record['text']}"})
        start += record["max_ns"]
    return found


def waterfall(table: FlowTable, records: Sequence[Mapping[str, Any]]) -> Spec:
    """Worst-case latency of a flow, contribution by contribution; the solid part of a bar is its minimum."""
    used = [method for method in METHODS if any(record["method"] == method for record in records)]
    colour = {
        "field": "method",
        "type": "nominal",
        "title": None,
        "scale": {"domain": used, "range": [HUES[METHODS.index(method)] for method in used]},
    }
    row = {
        "field": "row",
        "type": "ordinal",
        "title": None,
        "axis": {"labels": False, "ticks": False, "domain": False, "grid": False},
        "scale": {"paddingInner": 0.45, "paddingOuter": 0.4},
    }
    across = {"type": "quantitative", "title": "latency [ms]", "axis": {"tickCount": 6}}
    tooltip = [
        {"field": "label", "title": "contributor"},
        {"field": "method", "title": "method"},
        {"field": "text", "title": "minimum to maximum"},
    ]
    bars = {"y": row, "color": colour, "tooltip": tooltip}
    layers: list[Spec] = [
        {
            "mark": {"type": "bar", "opacity": 0.55},
            "encoding": {**bars, "x": {**across, "field": "start"}, "x2": {"field": "end"}},
        },
        {"mark": {"type": "bar"}, "encoding": {**bars, "x": {**across, "field": "start"}, "x2": {"field": "best"}}},
        {
            "mark": {"type": "text", "align": "left", "baseline": "bottom", "dy": -9, "fontSize": 11, "limit": 320},
            "encoding": {"y": row, "x": {"value": 2}, "text": {"field": "title"}},
        },
    ]
    values = stacked_rows(records)
    return _whole(
        {"data": {"name": "rows", "values": values}, "layer": layers, "height": 32 * len(values) + 8},
        f"Latency waterfall of {table.name}: {counted(table.min_ns, 'ns')} to {counted(table.max_ns, 'ns')}.",
    )


def usage_records(usages: Sequence[Usage], limits: Mapping[str, Fraction]) -> list[dict[str, Any]]:
    """The shares of each processor and bus that has a capacity, in per cent of it.

    `limits` are shares of the capacity.
    """
    records = []
    for usage in usages:
        if not usage.capacity:
            continue
        total = readable(usage.total / usage.capacity * 10**6, "ppm", digits=2)
        limit = limits.get(usage.name)
        said = f"{usage.name} ({usage.type}) · {total}"
        if limit is not None:
            said += f" of at most {readable(limit * 10**6, 'ppm')}"
        for who, share in usage.shares.items():
            part = share / usage.capacity * 100
            records.append(
                {
                    "name": usage.name,
                    "part": who,
                    "share": float(part),
                    "text": readable(part * 10**4, "ppm"),
                    "title": said,
                    "limit": None if limit is None else float(limit * 100),
                }
            )
    return records


def stacked_shares(records: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The records with their place in the bar (report.js does the same)."""
    found: list[dict[str, Any]] = []
    for record in records:
        before = found[-1] if found and found[-1]["name"] == record["name"] else None
        start, shade = (before["end"], 1 - before["shade"]) if before else (0.0, 0)
        found.append({**record, "start": start, "end": start + record["share"], "shade": shade})
    return found


def usage_chart(shares: Sequence[Mapping[str, Any]]) -> Spec:
    """Stacked shares against the limit, which is a mark across the bar."""
    records = stacked_shares(shares)
    names = list(dict.fromkeys(record["name"] for record in records))
    row = {
        "field": "name",
        "type": "nominal",
        "sort": names,
        "title": None,
        "axis": {"labels": False, "ticks": False, "domain": False},
        "scale": {"paddingInner": 0.5, "paddingOuter": 0.45},
    }
    most = max([100.0, *(record["end"] for record in records)])
    across = {
        "type": "quantitative",
        "title": "share of the capacity [%]",
        "scale": {"domain": [0, most]},
        "axis": {"tickCount": 6},
    }
    tooltip = [
        {"field": "name", "title": "of"},
        {"field": "part", "title": "used by"},
        {"field": "text", "title": "share"},
    ]
    firsts = [next(record for record in records if record["name"] == name) for name in names]
    shade = {"condition": {"test": "datum.shade === 0", "value": 0.95}, "value": 0.6}
    layers: list[Spec] = [
        {
            "mark": {"type": "bar", "color": "var(--c1)"},
            "encoding": {
                "y": row,
                "x": {**across, "field": "start"},
                "x2": {"field": "end"},
                "opacity": shade,
                "tooltip": tooltip,
            },
        },
        {
            "data": {"values": [record for record in firsts if record["limit"] is not None]},
            "mark": {"type": "tick", "thickness": 3, "color": "var(--accent)", "height": 20},
            "encoding": {"y": row, "x": {**across, "field": "limit"}},
        },
        {
            "data": {"values": firsts},
            "mark": {"type": "text", "align": "left", "baseline": "bottom", "dy": -11, "fontSize": 11, "limit": 320},
            "encoding": {"y": row, "x": {"value": 2}, "text": {"field": "title"}},
        },
    ]
    return _whole(
        {"data": {"name": "shares", "values": list(records)}, "layer": layers, "height": 40 * len(names) + 8},
        f"Use of {', '.join(names)} against the limits.",
    )


def _params(chosen: int | None) -> list[Spec]:
    return [{"name": "chosen", "value": chosen}, {"name": "kept", "value": None}]


def _whole(spec: Spec, description: str) -> Spec:
    return {
        "$schema": SCHEMA,
        "description": description,
        "width": "container",
        "config": CONFIG,
        **spec,
    }
