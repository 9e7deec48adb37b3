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
from dse.report.plots.canvas import Drawing
from dse.report.plots.charts import ChartBar, ChartRow, rows_chart

CAPTION = (
    "Worst response times, in % of the deadline, where the grey track ends; what is nearest to its deadline first. "
    "Threads and messages without a deadline are in the table only."
)
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


def deadline_chart(records: Sequence[Mapping[str, Any]]) -> Drawing:
    """A bar for each thread or message up to its response time, over a track that ends at its deadline.

    Late ones are highlighted; the axis is in % of the deadline, so that different deadlines compare.
    """
    rows = [
        ChartRow(
            record["title"],
            (
                ChartBar(0.0, record["deadline"], "f-soft faint"),
                ChartBar(
                    0.0,
                    record["end"],
                    "f-accent" if record["late"] else "f-c1",
                    f"{record['label']}, {record['where']}: {record['text']}",
                ),
            ),
        )
        for record in records
    ]
    return rows_chart(
        rows, "response time [% of the deadline]", "Response times against deadlines, in % of the deadline."
    )


def deadline_plot(
    responses: Mapping[str, Sequence[Response]], messages: Mapping[str, Sequence[MessageResponse]]
) -> list[Plot]:
    """The plot of an answer about one design; none where no thread or message has a deadline.

    A list of one `Plot` or of none; `responses` are those of threads by processor, `messages` of messages by bus.
    """
    records = deadline_records(responses, messages)
    return [Plot("deadlines", partial(deadline_chart, records), CAPTION)] if records else []
