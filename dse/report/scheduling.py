"""Response times as a table."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from dse.analysis.scheduling import Response
from dse.report.plain import plain, plain_table
from dse.results.display import readable
from dse.units import Exact

SAID = {None: "", True: "met", False: "MISSED"}


def response_table(console: Console, processor: str, responses: Sequence[Response]) -> Table:
    """What runs on a processor, by core and priority, and when it is done at the latest."""
    table = plain_table(console, plain(f"Response times on {processor}, by core and priority"))
    for heading in ("core", "thread", "execution", "releases", "response time", "deadline", ""):
        table.add_column(heading, justify="right" if heading not in ("thread", "releases", "") else "left")
    for item in responses:
        releases = [
            f"every {_ms(stream.period_ns)}" + (f" +{_ms(stream.jitter_ns)}" if stream.jitter_ns else "")
            for stream in item.task.streams
        ]
        response = "unbounded" if item.response_ns is None else _ms(item.response_ns)
        deadline = "" if item.deadline_ns is None else _ms(item.deadline_ns)
        cells = (str(item.core), plain(item.name), _ms(item.worst_ns), ", ".join(releases), response, deadline)
        table.add_row(*cells, SAID[item.meets_deadline])
    return table


def _ms(value_ns: Exact) -> str:
    return readable(value_ns, "ns", digits=6)
