"""The plots of one design as Vega-Lite specifications: latency waterfalls, and the use of processors and buses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.analysis.terms import PPM
from dse.answers.analysis import FlowTable, Usage
from dse.answers.tables.display import counted, readable
from dse.report.amounts import shortened
from dse.report.plots.front import Spec, whole_spec
from dse.support.units import Exact, is_unbounded

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
TITLE_LENGTH = 50
"""Letters of a bar's title: as many as a phone has room for. Names give way to figures."""
SHORTEST_NAME = 9
SHORTEST_PIECE = 44
"""Pixels of a piece of a bar from which on its name is written on it; shorter ones tell it when pointed at."""
FLOW_ROW = 32
"""Pixels of a contribution with its title."""
BAR = 46
"""Pixels of a bar of use, with its title."""
NOBODY = "nothing"
HUES = ("var(--c1)", "var(--c2)", "var(--c3)", "var(--c4)", "var(--c5)", "var(--c6)", "var(--accent)", "var(--soft)")


def waterfall_records(table: FlowTable) -> list[dict[str, Any]]:
    """The rows of a flow's contributor table that take time: ``row`` counts from 1, ``text`` has the figures.

    ``short`` is the name where it is too long to stand beside them. A bar without a bound ends with its minimum.
    """
    records = []
    for number, row in enumerate(table.rows, start=1):
        if not row.max_ns:
            continue
        text = f"{counted(row.min_ns, 'ns')} to {counted(row.max_ns, 'ns')}"
        record = {
            "row": number,
            "label": row.contributor,
            "method": row.max_method if row.max_method in METHODS else "other",
            "min_ns": _drawn(row.min_ns),
            "max_ns": _drawn(row.min_ns if is_unbounded(row.max_ns) else row.max_ns),
            "text": text,
        }
        short = _name_beside(row.contributor, text)
        records.append(record if short == row.contributor else {**record, "short": short})
    return records


def _drawn(value_ns: Exact) -> int | float:
    """A time as a length in a drawing, which knows no fractions; its text is exact."""
    return int(value_ns) if value_ns == int(value_ns) else float(value_ns)


def _name_beside(name: str, figures: str) -> str:
    """The name as far as it fits beside its figures."""
    return shortened(name, max(SHORTEST_NAME, TITLE_LENGTH - len(f" · {figures}")))


def stacked_rows(records: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The records with their bars, in ms, each from the worst case of the one before it (report.js does the same).

    Each record gets ``start``, ``best`` and ``end`` in ms: bars of a waterfall from the first contributor to the last.
    """
    stacked = []
    start: float = 0
    for record in records:
        bar = {"start": start / 1e6, "best": (start + record["min_ns"]) / 1e6, "end": (start + record["max_ns"]) / 1e6}
        stacked.append({**record, **bar, "title": f"{record.get('short', record['label'])} · {record['text']}"})
        start += record["max_ns"]
    return stacked


def waterfall(table: FlowTable, records: Sequence[Mapping[str, Any]]) -> Spec:
    """Worst-case latency of a flow, contribution by contribution; the solid part of a bar is its minimum.

    A Vega-Lite specification with times in ms; colours stand for the method by which a contribution counts.
    """
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
    return whole_spec(
        {"data": {"name": "rows", "values": values}, "layer": layers, "height": FLOW_ROW * len(values) + 8},
        f"Latency waterfall of {table.name}: {counted(table.min_ns, 'ns')} to {counted(table.max_ns, 'ns')}.",
    )


@dataclass(frozen=True)
class _Bar:
    """One bar of the plot of use: a core, a processor with one core, or a bus; shares and limit of `capacity`."""

    name: str
    type: str
    shares: Mapping[str, Fraction]
    capacity: Fraction
    limit: Fraction | None


def _bars(processors: Sequence[Usage], buses: Sequence[Usage], limits: Mapping[str, Fraction]) -> Iterator[_Bar]:
    """The bars, cores on which nothing runs as one."""
    for usage in (*processors, *buses):
        if not usage.capacity:
            continue
        count = int(usage.capacity / PPM) if usage.cores else 1
        limit = limits.get(usage.name)
        if count == 1:
            yield _Bar(usage.name, usage.type, usage.shares, usage.capacity, limit)
            continue
        for core in range(1, count + 1):
            here = {who: share for who, share in usage.shares.items() if usage.cores.get(who) == core}
            name = f"core {core} of {usage.name}"
            own = [mark for mark in (limit, limits.get(name)) if mark is not None]
            if here:
                yield _Bar(name, usage.type, here, Fraction(PPM), min(own, default=None))
        if idle := sorted(set(range(1, count + 1)) - set(usage.cores.values())):
            named = f"cores {', '.join(map(str, idle))}" if len(idle) > 1 else f"core {idle[0]}"
            yield _Bar(f"{named} of {usage.name}", usage.type, {}, Fraction(PPM), None)


def usage_records(
    processors: Sequence[Usage], buses: Sequence[Usage], limits: Mapping[str, Fraction]
) -> list[dict[str, Any]]:
    """The use of each core and each bus with a capacity, by thread and connection, in per cent.

    `limits` are shares of the capacity, by the name of a processor, which limits each of its cores, of a core
    (``core 2 of computer``), or of a bus.
    """
    records = []
    for bar in _bars(processors, buses, limits):
        total = readable(sum(bar.shares.values(), Fraction(0)) / bar.capacity * PPM, "ppm", digits=2)
        figures = total if bar.limit is None else f"{total}, limit {readable(bar.limit * PPM, 'ppm')}"
        if not bar.shares:
            figures = NOBODY
        said = f"{_name_beside(f'{bar.name} ({bar.type})', figures)} · {figures}"
        for who, share in (bar.shares or {NOBODY: Fraction(0)}).items():
            part = share / bar.capacity * 100
            records.append(
                {
                    "name": bar.name,
                    "part": who,
                    "share": float(part),
                    "text": readable(part / 100 * PPM, "ppm"),
                    "title": said,
                    "limit": None if bar.limit is None else float(bar.limit * 100),
                }
            )
    return records


def _stacked_shares(records: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The records with their place in the bar (report.js does the same)."""
    stacked: list[dict[str, Any]] = []
    for record in records:
        before = stacked[-1] if stacked and stacked[-1]["name"] == record["name"] else None
        start, shade = (before["end"], 1 - before["shade"]) if before else (0.0, 0)
        stacked.append({**record, "start": start, "end": start + record["share"], "shade": shade})
    return stacked


def usage_chart(shares: Sequence[Mapping[str, Any]]) -> Spec:
    """The chart of the use of cores and buses, with the limit as a mark across the bar.

    A Vega-Lite specification with stacked bars, in % of one core or of the bandwidth.
    """
    records = _stacked_shares(shares)
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
        "title": "used, in % of the core or the bandwidth",
        "scale": {"domain": [0, most]},
        "axis": {"tickCount": 6},
    }
    tooltip = [
        {"field": "name", "title": "of"},
        {"field": "part", "title": "used by"},
        {"field": "text", "title": "share"},
    ]
    firsts = [next(record for record in records if record["name"] == name) for name in names]
    first = "datum.shade === 0"
    shade = {"condition": {"test": first, "value": 0.95}, "value": 0.45}
    long = "(scale('x', datum.end) - scale('x', datum.start))"
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
            "mark": {"type": "tick", "thickness": 3, "color": "var(--accent)", "height": 24},
            "encoding": {"y": row, "x": {**across, "field": "limit"}},
        },
        {
            "data": {"values": firsts},
            "mark": {"type": "text", "align": "left", "baseline": "bottom", "dy": -13, "fontSize": 11, "limit": 320},
            "encoding": {"y": row, "x": {"value": 2}, "text": {"field": "title"}},
        },
        {
            "transform": [{"filter": "datum.share > 0"}],
            "mark": {
                "type": "text",
                "align": "left",
                "dx": 4,
                "fontSize": 11,
                "limit": {"expr": f"max(1, {long} - 8)"},
                "opacity": {"expr": f"{long} > {SHORTEST_PIECE} ? 1 : 0"},
                "tooltip": True,
            },
            "encoding": {
                "y": row,
                "x": {**across, "field": "start"},
                "text": {"field": "part"},
                "color": {"condition": {"test": first, "value": "var(--paper)"}, "value": "var(--ink)"},
                "tooltip": tooltip,
            },
        },
    ]
    return whole_spec(
        {"data": {"name": "shares", "values": list(records)}, "layer": layers, "height": BAR * len(names) + 8},
        f"Use of {', '.join(names)} against the limits.",
    )
