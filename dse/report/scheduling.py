"""Response times as a table."""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.scheduling import Response
from dse.report.page import Table
from dse.results.display import readable
from dse.units import Exact

SAID = {None: "", True: "met", False: "MISSED"}


def response_table(processor: str, responses: Sequence[Response]) -> Table:
    """What runs on a processor, by core and priority, and when it is done at the latest."""
    rows = []
    for item in responses:
        releases = [
            f"every {_ms(stream.period_ns)}" + (f" +{_ms(stream.jitter_ns)}" if stream.jitter_ns else "")
            for stream in item.task.streams
        ]
        response = "unbounded" if item.response_ns is None else _ms(item.response_ns)
        deadline = "" if item.deadline_ns is None else _ms(item.deadline_ns)
        named = f"{item.name} ({item.executor})" if item.executor else item.name
        cells = (str(item.core), named, _ms(item.worst_ns), ", ".join(releases), response, deadline)
        rows.append((*cells, SAID[item.meets_deadline]))
    headings = ("core", "thread", "execution", "releases", "response time", "deadline", "")
    caption = f"Response times on {processor}, by core and priority"
    return Table(caption, headings, tuple(rows), (0, 2, 4, 5))


def _ms(value_ns: Exact) -> str:
    return readable(value_ns, "ns", digits=6)
