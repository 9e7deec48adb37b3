"""The plots of the front: two objectives against each other, and all of them as parallel coordinates.

The page of a report draws both again with what its reader chooses and filters (`templates/scatter.js`, `parallel.js`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from textwrap import wrap
from typing import Any

from dse.answers.ranking.variants import varying
from dse.answers.result import ObjectiveInfo, Result
from dse.answers.tables.display import counted, display_unit, titled
from dse.report.amounts import number_of, shortened
from dse.report.plots.canvas import LETTER, RIGHT, WIDTH, Canvas, Drawing, Scale, scale_of, title_height
from dse.support.units import is_unbounded

STEPS = ("s1", "s2", "s3", "s4")
"""Colours of the classes of an objective."""
TITLE_WIDTH = 40
"""Letters in a line of an axis' title: as many as a phone has room for."""
EDGE = 0.4
"""How far beyond the front the baseline is drawn at most, as a share of the front's range."""


def drawn_figures(result: Result, values: Mapping[str, int]) -> dict[str, Any]:
    """A design's objectives as the plots draw them: for objective k the readable value ``o<k>`` and its text ``t<k>``.

    `values` are the objectives in counting units, by name.
    """
    record: dict[str, Any] = {}
    for axis, info in enumerate(result.objectives):
        record |= drawn_figure(axis, info, values[info.name], result.space.currency)
    return record


def drawn_figure(axis: int, info: ObjectiveInfo, value: int, currency: str) -> dict[str, Any]:
    """One objective of a design as the plots draw it; the value is None where it is unbounded."""
    number = number_of(value, info.unit, currency)
    return {f"o{axis}": number, f"t{axis}": counted(value, info.unit, currency)}


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
        bounded = [value for value in values if not is_unbounded(value)]
        low, high = min(bounded, default=0), max(bounded, default=0)
        classes = _classes(values, info, result.space.currency)
        for record, value in zip(records, values, strict=True):
            place = Fraction(min(value, high) - low, high - low) if high > low else Fraction(info.sense == "maximise")
            if is_unbounded(value):
                place = Fraction(1)
            record |= drawn_figure(axis, info, value, result.space.currency)
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
) -> Drawing:
    """Two objectives against each other, the third as colour; the chosen point and today's design are highlighted.

    A single objective is a line of points.
    """
    canvas = Canvas()
    axes = min(len(result.objectives), 2)
    titles = [" ".join(axis_title(result, axis)) for axis in range(axes)]
    colours = _colours(result) if len(result.objectives) > 2 else {}
    top = 0.0
    if colours:
        canvas.text(0, 12, " ".join(axis_title(result, 2)), "title")
        top = 18 + canvas.legend(list(colours.items()), 18)
    bottom = top + (title_height(titles[1]) + 300 if axes > 1 else 60)
    drawn = [record for record in records if all(record[f"o{axis}"] is not None for axis in range(axes))]
    far = baseline is not None and all(baseline[f"o{axis}"] is not None for axis in range(axes))
    marked, word = _at_the_edge(records, baseline, axes) if far and baseline is not None else (None, "")
    placed = [*drawn, marked] if marked is not None else drawn
    x = scale_of([record["o0"] for record in placed], 0.09, RIGHT, room=0.05)
    y = (
        scale_of([record["o1"] for record in placed], bottom, top + title_height(titles[-1]), 0.07)
        if axes > 1
        else None
    )
    place = {id(one): (x(one["o0"]), y(one["o1"]) if y is not None else (top + bottom) / 2) for one in placed}
    height = canvas.axis_across(x, top + (title_height(titles[-1]) if axes > 1 else 0), bottom, titles[0])
    if y is not None:
        canvas.axis_up(y, titles[1])
    for record in reversed(drawn):
        figures = [f"{info.name} {record[f't{axis}']}" for axis, info in enumerate(result.objectives)]
        tip = "\n".join([f"#{record['id']}", *figures, record["decisions"]])
        canvas.dot(place[id(record)], 5, f"f-{colours.get(record['q2'], 'c1') if colours else 'c1'}", tip)
    if marked is not None:
        across, up = place[id(marked)]
        canvas.line((across - 0.008, up), (across + 0.008, up), "l-ink three", word)
        canvas.line((across, up - 6), (across, up + 6), "l-ink three", word)
        canvas.text(
            across, up - 10, word, "rim", anchor="end" if across > 0.75 else "start" if across < 0.25 else "middle"
        )
    for record in drawn:
        if record["id"] == chosen:
            across, up = place[id(record)]
            canvas.dot((across, up), 9, "hollow l-accent three")
            is_right = across > 0.85
            canvas.text(
                across,
                up + 4,
                f"#{chosen}",
                "rim strong",
                shift=-13 if is_right else 13,
                anchor="end" if is_right else "start",
            )
    what = "Pareto scatter: " if axes > 1 else ""
    where = ", ".join(f"{title} {way}" for title, way in zip(titles, ("across", "up"), strict=False))
    count = f"{len(records)} alternative{'s' if len(records) > 1 else ''}"
    return canvas.drawing(f"{what}{where}; {count}.", height)


def _at_the_edge(
    records: Sequence[Mapping[str, Any]], baseline: Mapping[str, Any], axes: int
) -> tuple[dict[str, Any], str]:
    """The baseline as it is drawn, and its name: `axes` are as many as are drawn.

    One far away is put at the edge, for the axes fit the front (scatter.js does the same).
    """
    drawn, is_far = dict(baseline), False
    for field in (f"o{axis}" for axis in range(axes)):
        values = [record[field] for record in records if record[field] is not None]
        if not values:
            continue
        low, high = min(values), max(values)
        room = EDGE * ((high - low) or abs(high) or 1.0)
        inside = min(max(drawn[field], low - room), high + room)
        is_far = is_far or inside != drawn[field]
        drawn[field] = inside
    return drawn, "baseline, beyond the edge" if is_far else "baseline"


def _colours(result: Result) -> dict[str, str]:
    """The classes of the third objective with their colours, smallest values first."""
    domain = _class_order(result, 2)
    return dict(zip(domain, STEPS if len(domain) > 2 else (STEPS[1], STEPS[3]), strict=False))


def parallel(result: Result, records: Sequence[Mapping[str, Any]], chosen: int | None) -> Drawing:
    """Every objective as an axis with its best value on top, every alternative as a line.

    Places are normalised to 0 (worst on the front) .. 1 (best). `chosen` is the id of the highlighted point.
    """
    canvas = Canvas()
    count = len(result.objectives)
    up = Scale(0.0, 1.0, 290, 54)
    across = [(axis + 0.5) / count for axis in range(count)]
    for record in sorted(records, key=lambda one: one["id"] == chosen):
        is_chosen = record["id"] == chosen
        tip = "\n".join([f"#{record['id']}", *(f"{i.name} {record[f't{k}']}" for k, i in enumerate(result.objectives))])
        ends = [(across[axis], up(record[f"n{axis}"])) for axis in range(count)]
        for one, other in pairwise(ends):
            canvas.line(one, other, "l-accent three" if is_chosen else "l-c1 two pale", tip)
        for end in ends:
            canvas.dot(end, 4 if is_chosen else 2, "f-accent" if is_chosen else "f-c1", tip)
    most = max(8, int(WIDTH / count / LETTER))
    for axis, info in enumerate(result.objectives):
        canvas.line((across[axis], up(1)), (across[axis], up(0)), "l-soft")
        head, of, rest = info.name.partition(" of ")
        canvas.text(across[axis], 14 if of else 28, shortened(head, most), "title", anchor="middle", tip=info.name)
        if of:
            canvas.text(across[axis], 28, shortened(f"of {rest}", most), "title", anchor="middle")
        values = sorted((point.objectives[info.name] for point in result.front), reverse=info.sense == "maximise")
        for place, value in ((1.0, values[0]), (0.0, values[-1])) if values else ():
            if place or value != values[0]:
                text = counted(value, info.unit, result.space.currency)
                canvas.text(across[axis], up(place) + 4, text, "rim", shift=6)
    names = ", ".join(info.name for info in result.objectives)
    return canvas.drawing(f"Parallel coordinates: {names}; the best value of each is on top.", 304)
