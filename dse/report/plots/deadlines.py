"""Response times against deadlines as a plot: a bar for each thread or message that has one, the nearest first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from dse.analysis.messages.waits import MessageResponse
from dse.analysis.scheduling.responses import Response
from dse.answers.tables.display import counted
from dse.report.amounts import shortened
from dse.report.page import Plot
from dse.report.plots.front import Spec, whole_spec

CAPTION = (
    "Worst response times, in % of the deadline, where the grey track ends; what is nearest to its deadline first. "
    "Threads and messages without a deadline are in the table only."
)
DEADLINE_ROW = 32
"""Pixels of a bar with its title."""
MOST = 40
"""The greatest number of bars that are drawn: those nearest to their deadlines."""
WIDEST = 200.0
"""Where a bar ends that is later than this share of its deadline, or has no end at all."""
NAME = 26


def deadline_records(
    responses: Mapping[str, Sequence[Response]], messages: Mapping[str, Sequence[MessageResponse]]
) -> list[dict[str, Any]]:
    """The plot records of threads and messages with a deadline: response time in % of it, and a label.

    Rows count from 1. The processor is named where several have response times; of a message its bus is.
    """
    several = sum(map(bool, responses.values())) > 1
    records: list[tuple[float, dict[str, Any]]] = []
    for processor, items in responses.items():
        for item in items:
            where = processor if item.is_served else f"core {item.core}" + (f" of {processor}" if several else "")
            records += [_record(item, where)] if item.deadline_ns else []
    records += [_record(item, bus) for bus, of_bus in messages.items() for item in of_bus if item.deadline_ns]
    records.sort(key=lambda item: -item[0])
    return [{**record, "row": row} for row, (_, record) in enumerate(records[:MOST], start=1)]


def _record(item: Response | MessageResponse, where: str) -> tuple[float, dict[str, Any]]:
    """The response time of a thread or message in % of its deadline, and its bar."""
    assert item.deadline_ns
    share = WIDEST if item.response_ns is None else float(item.response_ns) / item.deadline_ns * 100
    response = "unbounded" if item.response_ns is None else counted(item.response_ns, "ns")
    said = f"{response} of {counted(item.deadline_ns, 'ns')}"
    return share, {
        "label": item.name,
        "where": where,
        "begin": 0,
        "end": min(share, WIDEST),
        "deadline": 100,
        "late": item.meets_deadline is False,
        "text": said,
        "title": f"{shortened(item.name, NAME)}, {where} · {said}",
    }


def deadline_chart(records: Sequence[Mapping[str, Any]]) -> Spec:
    """A bar for each thread or message up to its response time, over a track that ends at its deadline.

    Late ones are highlighted. A Vega-Lite specification; the axis is in % of the deadline, so that different deadlines
    compare.
    """
    axis = {"labels": False, "ticks": False, "domain": False, "grid": False}
    scale = {"paddingInner": 0.6, "paddingOuter": 0.5}
    row = {"field": "row", "type": "ordinal", "title": None, "axis": axis, "scale": scale}
    across = {
        "field": "begin",
        "type": "quantitative",
        "title": "response time [% of the deadline]",
        "axis": {"tickCount": 6},
    }
    tooltip = [
        {"field": "label", "title": "thread or message"},
        {"field": "where", "title": "on"},
        {"field": "text", "title": "response time of deadline"},
    ]
    colour = {"condition": {"test": "datum.late", "value": "var(--accent)"}, "value": "var(--c1)"}
    track, bar = {"y": row, "x": across, "x2": {"field": "deadline"}}, {"y": row, "x": across, "x2": {"field": "end"}}
    layers: list[Spec] = [
        {"mark": {"type": "bar", "opacity": 0.18}, "encoding": {**track, "color": {"value": "var(--soft)"}}},
        {"mark": {"type": "bar"}, "encoding": {**bar, "color": colour, "tooltip": tooltip}},
        {
            "mark": {"type": "text", "align": "left", "baseline": "bottom", "dy": -8, "fontSize": 11, "limit": 320},
            "encoding": {"y": row, "x": {"value": 2}, "text": {"field": "title"}},
        },
    ]
    return whole_spec(
        {"data": {"name": "rows", "values": list(records)}, "layer": layers, "height": DEADLINE_ROW * len(records) + 8},
        "Response times against deadlines, in % of the deadline.",
    )


def deadline_plot(
    responses: Mapping[str, Sequence[Response]], messages: Mapping[str, Sequence[MessageResponse]]
) -> list[Plot]:
    """The plot of an answer about one design; none where no thread or message has a deadline.

    A list of one `Plot` or of none; `responses` are those of threads by processor, `messages` of messages by bus.
    """
    records = deadline_records(responses, messages)
    return [Plot("deadlines", partial(deadline_chart, records), CAPTION)] if records else []
