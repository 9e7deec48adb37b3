"""Timers on one clock: a table of who reads whom when, the offsets that would spare a wait, and a timeline."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from math import lcm
from typing import Any

from dse.analysis.latency.offset_advice import Boundary
from dse.report.amounts import listed, shortened
from dse.report.page import NOTHING, Block, Plot, Table, texts
from dse.report.plots.canvas import Canvas, Drawing, scale_of
from dse.report.plots.charts import MOST_LETTERS
from dse.support.units import Exact, format_duration

CAPTION = (
    "Timers on one clock along {}: a mark is a release; after it a bar until what is made then is surely there (dark: "
    "it may be), and a line until it is read by the timer to which that leads."
)
TIMELINE_ROW = 46
"""Pixels of a row of the timeline."""
MOST_MARKS = 60
"""The greatest number of releases in a row; further ones within the time shown are cut off."""
UNKNOWN = "unknown"


def boundary_blocks(boundaries: Sequence[Boundary]) -> Iterator[Block]:
    """The blocks on timers that share a clock, flow by flow; none where no timers share one.

    A table for each flow, a plot of the timeline where times are known, and advice on offsets.
    """
    for flow, here in by_flow(boundaries).items():
        yield boundary_table(flow, here)
        records = timeline_records(here)
        if records:
            yield Plot(f"timeline-{flow}", partial(timeline, records), CAPTION.format(flow))
    yield from texts(*boundary_words(boundaries))


def by_flow(boundaries: Sequence[Boundary]) -> dict[str, list[Boundary]]:
    """The readers of each flow that has some.

    Names of flows to boundaries, in the order in which they were found.
    """
    of_flow: dict[str, list[Boundary]] = {}
    for item in boundaries:
        of_flow.setdefault(item.flow, []).append(item)
    return of_flow


def boundary_table(flow: str, boundaries: Sequence[Boundary]) -> Table:
    """The table of readers and senders on one clock: when data arrive, and the time that they wait.

    Offsets, ages and waits as ranges of time; the last column has an offset that would shorten the wait.
    """
    rows = tuple(
        (
            f"{item.receiver} reads {item.sender}",
            " / ".join(_offset(offset) for offset in item.offsets_ns[::-1]),
            _span(item.there_ns),
            _span(item.wait_ns),
            NOTHING if item.room_ns is None else format_duration(item.room_ns),
            _better(item),
        )
        for item in boundaries
    )
    headings = ("on one clock", "offsets", "there after", "first, last wait", "room", "a better offset of the reader")
    return Table(f"Timers on one clock along {flow}", headings, rows)


def boundary_words(boundaries: Sequence[Boundary]) -> list[str]:
    """The advice on offsets where data just miss a read, or some data miss a read that others meet, with the flows.

    Sentences that begin with the names of the flows concerned.
    """
    by_words: dict[str, list[str]] = {}
    for item in boundaries:
        if said := _said(item):
            by_words.setdefault(said, []).append(item.flow)
    return [f"{listed(flows)}: {said}" for said, flows in by_words.items()]


def _said(item: Boundary) -> str:
    if item.better is None:
        return _unknown_words(item)
    cure = f"offset {_offset(item.better.offset_ns)} instead of {_offset(item.offsets_ns[1])}"
    cure += f" saves {format_duration(item.better.saves_ns)} of latency"
    costs = [f"{format_duration(cost)} more on {name}" for name, cost in item.better.costs_ns.items()]
    cure += f" ({', '.join(costs)})" if costs else ""
    if item.is_crossed:
        said = f"{item.receiver} meets some data of {item.sender} and misses others"
        return f"{said}, there {_span(item.there_ns)} after its release: {cure}."
    if None in item.offsets_ns:
        return f"it is not stated when {item.receiver} reads {item.sender}: {cure}."
    return f"{item.receiver} just misses {item.sender}: {cure}." if item.is_just_missed else ""


def _unknown_words(item: Boundary) -> str:
    if None not in item.offsets_ns:
        return ""
    step = format_duration(item.step_ns)
    return (
        f"{item.receiver} waits up to {format_duration(item.wait_ns[1])} for {item.sender}, whose clock "
        f"it shares: known offsets of both save up to {step}."
    )


def _better(item: Boundary) -> str:
    if item.better is None:
        return NOTHING
    return f"{_offset(item.better.offset_ns)} saves {format_duration(item.better.saves_ns)}"


def _offset(offset: Exact | None) -> str:
    return UNKNOWN if offset is None else format_duration(offset) if offset else "0 ms"


def _span(times: tuple[Exact, Exact]) -> str:
    """One time, or the first and the last."""
    first, last = (format_duration(time) for time in times)
    return first if first == last else f"{first} .. {last}"


# --- the timeline -------------------------------------------------------------------------------------------------


def timeline_records(boundaries: Sequence[Boundary]) -> list[dict[str, Any]]:
    """The plot records of a timeline, in ms: for each release of a timer a mark, and when its data arrive and are read.

    Rows count from 1 in the order of the flow. Where some offset is unknown there is no timeline.
    """
    if any(None in item.offsets_ns for item in boundaries):
        return []
    records: list[dict[str, Any]] = []
    names = list(dict.fromkeys(name for item in boundaries for name in (item.sender, item.receiver)))
    until = _until(boundaries)
    for item in boundaries:
        row = names.index(item.sender) + 1
        for number, release in enumerate(_releases(item.offsets_ns[0] or 0, item.periods_ns[0], until)):
            ends = [release + time for time in item.there_ns]
            read = _next(ends[1], item.offsets_ns[1] or 0, item.periods_ns[1])
            records.append(
                {
                    "row": row,
                    "to": names.index(item.receiver) + 1,
                    "label": item.sender,
                    "release": _ms(release),
                    "first": _ms(ends[0]),
                    "last": _ms(ends[1]),
                    "read": _ms(read),
                    "text": f"released {_at(release)}, there by {_at(ends[1])}, read {_at(read)} by {item.receiver}",
                    "named": number == 0,
                }
            )
    senders = {item.sender for item in boundaries}
    for item in boundaries:
        row = names.index(item.receiver) + 1
        reads = _releases(item.offsets_ns[1] or 0, item.periods_ns[1], until) if item.receiver not in senders else []
        for release in reads:
            when = dict.fromkeys(("release", "first", "last", "read"), _ms(release))
            text = f"reads {_at(release)}"
            records.append({"row": row, "to": row, "label": item.receiver, **when, "text": text, "named": True})
    return records


def _until(boundaries: Sequence[Boundary]) -> Exact:
    """To when is drawn: until the pattern has repeated, twice the longest period at most or at least."""
    periods = [period for item in boundaries for period in item.periods_ns]
    longest = max(periods)
    whole = all(period == int(period) for period in periods)
    pattern = lcm(*map(int, periods)) if whole else 2 * longest
    return min(max(pattern, 2 * longest), 4 * longest)


def _releases(offset: Exact, period: Exact, until: Exact) -> list[Exact]:
    first = offset % period
    count = min(int(-(-(until - first) // period)), MOST_MARKS)
    return [first + number * period for number in range(count)]


def _next(time: Exact, offset: Exact, period: Exact) -> Exact:
    """The first release from a time on."""
    return time + (offset - time) % period


def _ms(time_ns: Exact) -> float:
    return float(time_ns) / 1e6


def _at(time_ns: Exact) -> str:
    return f"at {format_duration(time_ns)}"


def timeline(records: Sequence[Mapping[str, Any]]) -> Drawing:
    """A row for each timer: its releases, when their data are there, and lines to where they are read.

    Times are in ms on the clock that the timers share. A bar is from a release until its data are surely there.
    """
    canvas = Canvas()
    names = {record["row"]: record["label"] for record in records}
    times = [record[key] for record in records for key in ("release", "last", "read")]
    scale = scale_of([0.0, *times])
    middle = {row: 26 + number * TIMELINE_ROW for number, row in enumerate(sorted(names))}
    bottom = TIMELINE_ROW * len(names) + 2
    height = canvas.axis_across(scale, 0, bottom, "time on the clock [ms]")
    for record in records:
        release, first, last, read = (scale(record[key]) for key in ("release", "first", "last", "read"))
        y, tip = middle[record["row"]], f"{record['label']} {record['text']}"
        canvas.bar(release, last, y - 6, 12, "f-c1 pale", tip)
        canvas.bar(first, last, y - 6, 12, "f-c1", tip)
        canvas.line((last, y), (read, y), "l-soft dashed", tip)
        canvas.line((read, y), (read, middle[record["to"]]), "l-soft")
        canvas.line((release, y - 10), (release, y + 10), "l-ink two")
    for row, name in names.items():
        canvas.text(0, middle[row] - 13, shortened(name, MOST_LETTERS), "rim")
    words = "Timers on one clock: when each is released, when its data are there, and when they are read."
    return canvas.drawing(words, height)
