"""The plots of the front as Vega-Lite specifications: one for the report, where they answer to each other, and for PNG.

Colours are CSS variables (`dse.report.theme`). Names from the problem occur as data and titles only, never as field
names or in expressions: fields are called ``o0``, ``o1``, … in the order of the objectives.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from textwrap import wrap
from typing import Any, TypeAlias

from dse.answers.ranking.variants import varying
from dse.answers.result import ObjectiveInfo, Result
from dse.answers.tables.display import counted, display_unit, titled
from dse.support.units import is_unbounded

Spec: TypeAlias = dict[str, Any]
SCHEMA = "https://vega.github.io/schema/vega-lite/v6.json"
STEPS = ("var(--s1)", "var(--s2)", "var(--s3)", "var(--s4)")
TITLE_WIDTH = 40
"""Letters in a line of an axis' title: as many as a phone has room for."""
EDGE = 0.4
"""How far beyond the front the baseline is drawn at most, as a share of the front's range."""
KEPT = "kept === null || indexof(kept, datum.id) >= 0"
ESCAPED = str.maketrans({"\\": "\\\\", "\n": "\\n", "\r": "\\r", "\u2028": "\\u2028", "\u2029": "\\u2029"})
"""What ends a text in an expression of Vega, but for quotes."""
CONFIG: Spec = {
    "background": None,
    "font": "system-ui, sans-serif",
    "locale": {"number": {"decimal": ".", "thousands": " ", "grouping": [3], "currency": ["", ""]}},  # as `readable`
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
    """A record per point: ``id``, ``rank``; for objective k the readable value ``o<k>``, text ``t<k>``, class ``q<k>``.

    ``n<k>`` is the place between the worst (0) and the best value (1) of the front; 1 where there is only one. What is
    unbounded has the worst place and no value (None): it is not drawn among the others.
    """
    differing = varying([point.decisions for point in result.front], result.open_decisions)
    records: list[dict[str, Any]] = [
        {
            "id": point.id,
            "rank": point.rank,
            "decisions": ", ".join(f"{name} {point.decisions[name]}" for name in differing if name in point.decisions),
        }
        for point in result.front
    ]
    for axis, info in enumerate(result.objectives):
        values = [point.objectives[info.name] for point in result.front]
        factor, _ = display_unit(info.unit, result.space.currency)
        bounded = [value for value in values if not is_unbounded(value)]
        low, high = min(bounded, default=0), max(bounded, default=0)
        classes = _classes(values, info, result.space.currency)
        for record, value in zip(records, values, strict=True):
            place = Fraction(min(value, high) - low, high - low) if high > low else Fraction(info.sense == "maximise")
            if is_unbounded(value):
                place = Fraction(1)
            record[f"o{axis}"] = None if is_unbounded(value) else float(value / factor)
            record[f"t{axis}"] = counted(value, info.unit, result.space.currency)
            record[f"n{axis}"] = float(place if info.sense == "maximise" else 1 - place)
            record[f"q{axis}"] = classes[value]
    return records


def _classes(values: Sequence[int], info: ObjectiveInfo, currency: str) -> dict[int, str]:
    """Each value's class: the value itself where there are up to four, else a quarter of the values, in words."""
    distinct = sorted(set(values))
    if len(distinct) <= len(STEPS):
        return {value: counted(value, info.unit, currency) for value in distinct}
    class_of = {}
    for step in range(len(STEPS)):
        part = distinct[len(distinct) * step // 4 : len(distinct) * (step + 1) // 4]
        ends = [counted(value, info.unit, currency) for value in (part[0], part[-1])]
        class_of.update(dict.fromkeys(part, ends[0] if len(part) == 1 else f"{ends[0]} to {ends[1]}"))
    return class_of


def _class_order(result: Result, axis: int) -> list[str]:
    """The classes of an objective, smallest values first."""
    info = result.objectives[axis]
    values = [point.objectives[info.name] for point in result.front]
    classes = _classes(values, info, result.space.currency)
    return list(dict.fromkeys(classes[value] for value in sorted(classes)))


def axis_title(result: Result, axis: int) -> list[str]:
    """``price [EUR]``, in lines.

    Name and unit of an objective, wrapped at `TITLE_WIDTH` letters.
    """
    info = result.objectives[axis]
    return wrap(titled(info.name, display_unit(info.unit, result.space.currency)[1]), TITLE_WIDTH)


def scatter(
    result: Result, records: Sequence[Mapping[str, Any]], chosen: int | None, baseline: Mapping[str, Any] | None
) -> Spec:
    """Two objectives against each other, the third as colour; the chosen point and today's design are highlighted.

    A single objective is a line of points.
    """
    axes = list(range(min(len(result.objectives), 2)))
    titles = [axis_title(result, axis) for axis in axes]
    tooltip = [{"field": "id", "title": "alternative"}] + [
        {"field": f"t{axis}", "title": info.name} for axis, info in enumerate(result.objectives)
    ]
    chosen_by = [*tooltip, {"field": "decisions", "title": "decisions"}]
    position = {
        name: {
            "field": f"o{axis}",
            "type": "quantitative",
            "title": title,
            "scale": {"zero": False, "padding": 14},
            "axis": {"labelOverlap": True, "tickCount": 6},
        }
        for name, axis, title in zip("xy", axes, titles, strict=False)
    }
    points: Spec = {
        "name": "points",
        "params": [{"name": "brush", "select": {"type": "interval", "encodings": list(position)}}],
        "mark": {"type": "point", "filled": True, "cursor": "pointer", "tooltip": True},
        "encoding": {
            **position,
            "opacity": {"condition": {"test": KEPT, "value": 0.95}, "value": 0.12},
            "size": {"value": 80},
            "stroke": {"value": "var(--paper)"},
            "strokeWidth": {"value": 0.6},
            "tooltip": chosen_by,
            "color": {"value": "var(--c1)"},
        },
    }
    if len(result.objectives) > 2:
        points["encoding"]["color"] = _colour_by(result, 2)
    layers = [points]
    if baseline is not None:
        baseline, word_of_it, side = _at_the_edge(records, baseline, len(axes))
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
        word = {"type": "text", "dy": -13, "color": "var(--ink)", "fontSize": 11, "align": side}
        named = {**position, "text": {"value": word_of_it}}
        layers += [{"data": {"values": [dict(baseline)]}, **layer} for layer in _readable_text(word, named)]
    layers += _chosen_point(position, tooltip)
    values = [{**record, "label": f"#{record['id']}"} for record in records]
    height = 340 if len(axes) > 1 else 90
    what = "Pareto scatter: " if len(axes) > 1 else ""
    where = ", ".join(f"{' '.join(title)} {way}" for title, way in zip(titles, ("across", "up"), strict=False))
    count = f"{len(records)} alternative{'s' if len(records) > 1 else ''}"
    return whole_spec(
        {"params": _params(chosen), "data": {"name": "front", "values": values}, "layer": layers, "height": height},
        f"{what}{where}; {count}.",
    )


def _at_the_edge(
    records: Sequence[Mapping[str, Any]], baseline: Mapping[str, Any], axes: int
) -> tuple[dict[str, Any], str, str]:
    """The baseline as it is drawn, its name, and how that is aligned: `axes` are as many as are drawn.

    One far away is put at the edge, for the axes fit the front (report.js does the same).
    """
    drawn, is_far, side = dict(baseline), False, "center"
    for field in (f"o{axis}" for axis in range(axes)):
        values = [record[field] for record in records if record[field] is not None]
        if drawn[field] is None or not values:
            continue
        low, high = min(values), max(values)
        room = EDGE * ((high - low) or abs(high) or 1.0)
        inside = min(max(drawn[field], low - room), high + room)
        is_far = is_far or inside != drawn[field]
        if field == "o0" and not low <= inside <= high:
            side = "right" if inside > high else "left"
        drawn[field] = inside
    return drawn, "baseline, beyond the edge" if is_far else "baseline", side


def _chosen_point(position: Mapping[str, Any], tooltip: Sequence[Mapping[str, Any]]) -> list[Spec]:
    """A ring and a label in front of all other points, which may lie on the chosen one."""
    only = [{"filter": "datum.id === chosen"}]
    ring = {"type": "point", "filled": False, "size": 220, "strokeWidth": 3, "color": "var(--accent)", "tooltip": True}
    word = {
        "type": "text",
        "dx": 13,
        "align": "left",
        "fontWeight": 700,
        "color": "var(--accent)",
        "fontSize": 12,
    }
    named = {**position, "text": {"field": "label"}}
    layers: list[Spec] = [
        {"mark": ring, "encoding": {**position, "tooltip": list(tooltip)}},
        *_readable_text(word, named),
    ]
    return [{"transform": only, **layer} for layer in layers]


def _readable_text(mark: Mapping[str, Any], encoding: Mapping[str, Any]) -> list[Spec]:
    """Text on a rim in the colour of the paper, so that it can be read on top of points and lines."""
    rim = {**mark, "color": "var(--paper)", "stroke": "var(--paper)", "strokeWidth": 4, "strokeJoin": "round"}
    return [{"mark": dict(layer), "encoding": dict(encoding)} for layer in (rim, mark)]


def _colour_by(result: Result, axis: int) -> Spec:
    """Colour by the class of an objective."""
    domain = _class_order(result, axis)
    steps = STEPS if len(domain) > 2 else (STEPS[1], STEPS[3])
    scale = {"domain": domain, "range": list(steps[: len(domain)])}
    return {"field": f"q{axis}", "type": "ordinal", "scale": scale, "title": axis_title(result, axis)}


def parallel(result: Result, records: Sequence[Mapping[str, Any]], chosen: int | None) -> Spec:
    """Every objective as an axis with its best value on top, every alternative as a line.

    A Vega-Lite specification; places are normalised to 0 (worst on the front) .. 1 (best). `chosen` is the id of the
    highlighted point.
    """
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
            "labelPadding": 17,
            "labelExpr": "split(replace(datum.label, ' of ', '|of '), '|')",
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
    ]
    word = {"type": "text", "dx": 6, "align": "left", "fontSize": 11, "color": "var(--ink)"}
    named = {"x": across, "y": up, "text": {"field": "text"}}
    layers += [{"data": {"values": ends}, **layer} for layer in _readable_text(word, named)]
    layers.append(
        {
            "data": {"name": "bands", "values": []},  # stretches of axes that a reader draws, two ends each
            "mark": {"type": "line", "strokeWidth": 16, "color": "var(--accent)", "opacity": 0.3},
            "encoding": {"x": across, "y": up, "detail": {"field": "name"}},
        }
    )
    return whole_spec(
        {"params": _params(chosen), "data": {"name": "lines", "values": values}, "layer": layers, "height": 260},
        f"Parallel coordinates: {', '.join(names)}; the best value of each is on top.",
    )


def _params(chosen: int | None) -> list[Spec]:
    return [{"name": "chosen", "value": chosen}, {"name": "kept", "value": None}]


def whole_spec(spec: Spec, description: str) -> Spec:
    """The specification with what all of them share; the description is what a screen reader says.

    Vega-Lite writes titles into expressions and escapes nothing in them but quotes: those of tooltips are escaped here,
    and where another one would end its expression, marks are not described one by one.
    """
    safe = _with_safe_tooltips(spec)
    is_plain = all(_in_expression(title) == title for title in _titles(spec))
    return {
        "$schema": SCHEMA,
        "description": description,
        "width": "container",
        "config": CONFIG if is_plain else {**CONFIG, "mark": {"aria": False}},
        **safe,
    }


def _in_expression(title: str) -> str:
    """A title for an expression in which Vega-Lite escapes its quotes.

    >>> len(_in_expression(chr(92)))
    2
    """
    return title.translate(ESCAPED)


def _with_safe_tooltips(part: Any) -> Any:
    """The part of a specification with the titles of its tooltips as expressions need them; data stay what they are."""
    if isinstance(part, list):
        return [_with_safe_tooltips(item) for item in part]
    if not isinstance(part, dict):
        return part
    copied = {key: value if key == "data" else _with_safe_tooltips(value) for key, value in part.items()}
    if isinstance(copied.get("tooltip"), list):
        copied["tooltip"] = [{**item, "title": _in_expression(item["title"])} for item in copied["tooltip"]]
    return copied


def _titles(part: Any) -> Iterator[str]:
    """The titles in a part of a specification, but for those of tooltips."""
    if isinstance(part, dict):
        for key, value in part.items():
            if key == "title" and isinstance(value, str | list):
                yield value if isinstance(value, str) else "".join(value)
            elif key not in ("data", "tooltip"):
                yield from _titles(value)
    elif isinstance(part, list):
        for item in part:
            yield from _titles(item)
