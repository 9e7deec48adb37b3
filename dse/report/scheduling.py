"""Response times as a table."""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.scheduling import Response
from dse.report.page import Table
from dse.results.display import readable
from dse.units import Exact

SAID = {None: "", True: "met", False: "MISSED"}


HEADINGS = (
    "core", "thread", "execution", "releases", "response time", "deadline", "", "slack", "blocked", "waits for",
)  # fmt: skip
NUMBERS = (0, 2, 4, 5, 7, 8)
ALWAYS = 7
"""Columns from here on are there where they say something."""


def response_table(processor: str, responses: Sequence[Response]) -> Table:
    """What runs on a processor, by core and priority, what it waits for, and when it is done at the latest."""
    rows = [_row(item) for item in responses]
    caption = f"Response times on {processor}, by core and priority"
    kept = [at for at in range(len(HEADINGS)) if at < ALWAYS or any(row[at] for row in rows)]
    shown = tuple(tuple(row[at] for at in kept) for row in rows)
    numbers = tuple(position for position, at in enumerate(kept) if at in NUMBERS)
    return Table(caption, tuple(HEADINGS[at] for at in kept), shown, numbers, wide=ALWAYS, label=1)


def _row(item: Response) -> tuple[str, ...]:
    releases = [
        f"every {_ms(stream.period_ns)}" + (f" +{_ms(stream.jitter_ns)}" if stream.jitter_ns else "")
        for stream in item.task.streams
    ]
    response, deadline = item.response_ns, item.deadline_ns
    named = f"{item.name} ({item.executor})" if item.executor else item.name
    switching = item.task.worst_ns - item.worst_ns
    return (
        str(item.core),
        named,
        _ms(item.worst_ns) + (f" +{_ms(switching)}" if switching else ""),
        ", ".join(releases),
        "unbounded" if response is None else _ms(response),
        "" if deadline is None else _ms(deadline),
        SAID[item.meets_deadline],
        "" if deadline is None or response is None else _ms(deadline - response),
        _ms(item.blocked_ns) if item.blocked_ns else "",
        _waits_for(item),
    )


def _waits_for(item: Response) -> str:
    """Whose jobs go before the worst one, and how many of each."""
    if item.executor:
        return f"its turn in {item.executor}"
    return ", ".join(f"{delay.jobs} x {delay.name} ({_ms(delay.work_ns)})" for delay in item.delays)


def _ms(value_ns: Exact) -> str:
    return readable(value_ns, "ns", digits=6)
