"""The plots of one design : latency waterfalls, and the use of processors and buses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.analysis.terms import PPM
from dse.answers.analysis import FlowTable, Usage
from dse.answers.tables.display import counted, readable
from dse.report.amounts import shortened
from dse.report.plots.canvas import Drawing
from dse.report.plots.charts import ChartBar, ChartRow, rows_chart
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
NOBODY = "nothing"
COLOURS = ("c1", "c2", "c3", "c4", "c5", "c6", "accent", "soft")
"""The colours of `METHODS`."""


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
            "min_ns": drawn_ns(row.min_ns),
            "max_ns": drawn_ns(row.min_ns if is_unbounded(row.max_ns) else row.max_ns),
            "text": text,
        }
        short = _name_beside(row.contributor, text)
        records.append(record if short == row.contributor else {**record, "short": short})
    return records


def drawn_ns(value_ns: Exact) -> int | float:
    """A time as a length in a drawing, which knows no fractions; its text is exact."""
    return int(value_ns) if value_ns == int(value_ns) else float(value_ns)


def _name_beside(name: str, figures: str) -> str:
    """The name as far as it fits beside its figures."""
    return shortened(name, max(SHORTEST_NAME, TITLE_LENGTH - len(f" · {figures}")))


def waterfall(table: FlowTable, records: Sequence[Mapping[str, Any]]) -> Drawing:
    """Worst-case latency of a flow, contribution by contribution, in ms; the solid part of a bar is its minimum.

    Each bar begins where the worst case of the one before it ends; colours stand for the method by which it counts.
    """
    rows = []
    start: float = 0
    for record in records:
        ends = [(start + record[key]) / 1e6 for key in ("min_ns", "max_ns")]
        look = f"f-{COLOURS[METHODS.index(record['method'])]}"
        tip = f"{record['label']}, {record['method']}: {record['text']}"
        bars = (ChartBar(start / 1e6, ends[1], f"{look} pale", tip), ChartBar(start / 1e6, ends[0], look, tip))
        rows.append(ChartRow(f"{record.get('short', record['label'])} · {record['text']}", bars))
        start += record["max_ns"]
    legend = [
        (method, colour)
        for method, colour in zip(METHODS, COLOURS, strict=True)
        if any(record["method"] == method for record in records)
    ]
    words = f"Latency waterfall of {table.name}: {counted(table.min_ns, 'ns')} to {counted(table.max_ns, 'ns')}."
    return rows_chart(rows, "latency [ms]", words, legend=legend)


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


def usage_chart(records: Sequence[Mapping[str, Any]]) -> Drawing:
    """The use of cores and buses as stacked bars, in % of one core or of the bandwidth; the limit is a mark across.

    Pieces of a bar are threads or connections, dark and pale in turn, named where there is room.
    """
    rows = []
    for name in dict.fromkeys(record["name"] for record in records):
        here = [record for record in records if record["name"] == name]
        bars = []
        end = 0.0
        for number, record in enumerate(here):
            start, end = end, end + record["share"]
            tip, look = f"{name}, {record['part']}: {record['text']}", "f-c1 pale" if number % 2 else "f-c1"
            bars.append(ChartBar(start, end, look, tip, record["part"]))
        limit = here[0]["limit"]
        marks = () if limit is None else ((limit, "l-accent three", f"limit {limit:g} %"),)
        rows.append(ChartRow(here[0]["title"], tuple(bars), marks))
    most = max([100.0, *(bar.high for row in rows for bar in row.bars)])
    across = "used, in % of the core or the bandwidth"
    words = f"Use of {', '.join(dict.fromkeys(record['name'] for record in records))} against the limits."
    return rows_chart(rows, across, words, domain=(0.0, most), thickness=19)
