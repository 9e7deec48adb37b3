"""The two kinds of plots that most are: bars in rows, and points, lines and boxes over two axes.

A plot is drawn from plain numbers and texts; `Canvas` writes it as SVG.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from dse.report.amounts import shortened
from dse.report.plots.canvas import LETTER, NARROW, Canvas, Drawing, Scale, scale_of, title_height

TITLE = 15
"""Pixels of the title of a row."""
GAP = 6
UP = 190
"""Pixels of the axis up."""
MOST_LETTERS = int(NARROW / LETTER)


@dataclass(frozen=True)
class ChartBar:
    """A part of a row from `low` to `high`; `look` is a list of classes, `name` is written on it if there is room."""

    low: float
    high: float
    look: str = "f-c1"
    tip: str = ""
    name: str = ""
    height: float | None = None


@dataclass(frozen=True)
class ChartRow:
    """A row of a plot: its title above it, its bars, and marks across them as (where, classes, tip)."""

    title: str
    bars: tuple[ChartBar, ...]
    marks: tuple[tuple[float, str, str], ...] = ()


def rows_chart(
    rows: Sequence[ChartRow],
    across: str,
    description: str,
    *,
    domain: tuple[float, float] | None = None,
    legend: Sequence[tuple[str, str]] = (),
    rules: Iterable[tuple[float, str]] = (),
    thickness: float = 12,
) -> Drawing:
    """Bars in rows, in the given order, each below its title; `rules` are lines through all rows, as (where, classes).

    `across` is the title of the axis with its unit; `domain` its ends, without which all bars and zero have room.
    `legend` names colours, `thickness` is that of bars in pixels.
    """
    canvas = Canvas()
    top = canvas.legend(legend, 0)
    values = [value for row in rows for bar in row.bars for value in (bar.low, bar.high)]
    values += [mark[0] for row in rows for mark in row.marks]
    scale = Scale(*domain) if domain is not None else scale_of([0.0, *values])
    step = TITLE + thickness + GAP
    bottom = top + step * len(rows) + 2
    height = canvas.axis_across(scale, top, bottom, across)
    for number, row in enumerate(rows):
        y = top + number * step
        canvas.text(0, y + TITLE - 3, shortened(row.title, MOST_LETTERS), "rim", tip=row.title)
        for bar in row.bars:
            tall = bar.height or thickness
            ends = sorted(min(max(value, scale.low), scale.high) for value in (bar.low, bar.high))
            place = (scale(ends[0]), scale(ends[1]), y + TITLE + (thickness - tall) / 2, tall)
            canvas.bar(*place, bar.look, bar.tip)
            if bar.name:
                canvas.name_in(*place, bar.name, "" if "pale" in bar.look else "on")
        for at, look, tip in row.marks:
            canvas.line((scale(at), y + TITLE - 2), (scale(at), y + TITLE + thickness + 2), look, tip)
    for at, look in rules:
        canvas.line((scale(at), top), (scale(at), bottom), look)
    return canvas.drawing(description, height)


@dataclass(frozen=True)
class Series:
    """Points of one colour, as (x, y, what is said of it); lines or steps connect them where `kind` says so.

    A point without a text belongs to the line only; one with y None interrupts it.
    """

    name: str
    colour: str
    points: tuple[tuple[float, float | None, str], ...]
    kind: Literal["points", "line", "steps"] = "points"


def plane_chart(
    series: Sequence[Series],
    across: str,
    up: str,
    description: str,
    *,
    boxes: Sequence[tuple[float, float, float, str]] = (),
    rules: Sequence[tuple[float, str, str]] = (),
    legend: Sequence[tuple[str, str]] | None = None,
    height: float = UP,
    with_zero: bool = False,
) -> Drawing:
    """Points, lines, boxes and upright rules over two axes; `across` and `up` are their titles with units.

    `boxes` are (from, to, height, what is said of it), and stand on zero; `rules` are (where, classes, what is said of
    it). Without a `legend` it names the series where there are several. `height` is that of the axis up in pixels,
    `with_zero` lets it reach zero.
    """
    canvas = Canvas()
    named = [(item.name, item.colour) for item in series] if len(series) > 1 else []
    top = canvas.legend(named if legend is None else legend, 0) + title_height(up)
    xs = [point[0] for item in series for point in item.points] + [rule[0] for rule in rules]
    ys = [point[1] for item in series for point in item.points if point[1] is not None]
    xs += [end for box in boxes for end in box[:2]]
    ys += [box[2] for box in boxes] + [0.0] * (with_zero or bool(boxes))
    x = scale_of(xs, 0.09, 0.965, room=0.0 if boxes else 0.02)
    y = scale_of(ys, top + height, top + 4, room=0.06)
    if boxes:
        y = Scale(0.0, y.high, y.start, y.end)
    whole = canvas.axis_across(x, top, top + height, across)
    canvas.axis_up(y, up)
    for low, high, value, tip in boxes:
        canvas.bar(x(low), x(high), y(value), y(0) - y(value), "f-c1", tip)
    for item in series:
        _draw_series(canvas, item, x, y)
    for at, look, tip in rules:
        canvas.line((x(at), top), (x(at), top + height), look, tip)
    return canvas.drawing(description, whole)


def _draw_series(canvas: Canvas, item: Series, x: Scale, y: Scale) -> None:
    places = [None if value is None else (x(at), y(value)) for at, value, _ in item.points]
    for one, other in pairwise(places) if item.kind != "points" else ():
        if one is None or other is None:
            continue
        corner = (other[0], one[1]) if item.kind == "steps" else other
        canvas.line(one, corner, f"l-{item.colour} two")
        if corner != other:
            canvas.line(corner, other, f"l-{item.colour} two")
    for place, (_, _, tip) in zip(places, item.points, strict=True):
        if place is not None and tip:
            canvas.dot(place, 3.5, f"f-{item.colour}", tip)
