"""Which response times have no bound: `UNBOUNDED_NS` stands for them in sums, and is never shown to people."""

from __future__ import annotations

from dse.analysis.latency import flow_rows
from dse.analysis.rows import UNBOUNDED_METHOD
from dse.analysis.scheduling import UNBOUNDED_NS, bounded_response_ns
from dse.analysis.views import View
from dse.space.types import Metric, Space


def unbounded_in(space: Space, metric: Metric, view: View) -> tuple[str, ...]:
    """The threads in a metric of a design whose response time has no bound, in the order of the flow.

    Empty for a metric that counts no response times, and where all of them are bounded.
    """
    if metric.kind == "derived":
        inner = (item for times, item in space.derived[metric.index or 0].terms if times.value)
        return tuple(dict.fromkeys(name for item in inner for name in unbounded_in(space, item, view)))
    if metric.kind in ("latency", "jitter"):
        rows = flow_rows(space, space.flows[metric.index or 0], view)
        return tuple(dict.fromkeys(row.contributor for row in rows if row.max_method == UNBOUNDED_METHOD))
    if metric.kind == "response time":
        number = metric.index or 0
        if bounded_response_ns(space, number, "thread", view) >= UNBOUNDED_NS:
            return (space.components[number].name,)
    return ()
