"""End-to-end flow latency: the contributor table, row by row (docs/semantics.md, section 3.1).

Minimum and maximum of a flow are sums of contributions; the rules in which the profiles differ stand side by side here
(docs/semantics.md, section 3.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dse.analysis.binding import transmission_ns
from dse.analysis.clocks import LET, LET_METHOD, METHOD, pair_of, spread_ns, wait_ns
from dse.analysis.priorities import deadline_ns
from dse.analysis.rates import is_event_triggered, is_periodic
from dse.analysis.scheduling import UNBOUNDED_NS, Part, bounded_response_ns
from dse.analysis.views import View
from dse.space.trees import at
from dse.space.types import Component, Flow, Space, Step
from dse.units import Exact

NO_LATENCY = {"dse": "no latency", "osate-2.2": "no latency", "osate-2.19": "no sampling/queuing latency"}
UNBOUNDED_METHOD = "response time (unbounded)"
"""Of a row whose maximum stands for a response time without a bound."""


@dataclass(frozen=True, slots=True)
class Row:
    """One contribution to a flow's latency, in ns, exact; `category` and `contributor` as OSATE prints them."""

    category: str
    contributor: str
    min_ns: Exact
    min_method: str
    max_ns: Exact
    max_method: str


def counts_responses(space: Space) -> bool:
    """Whether latencies count response times; OSATE of 2014 looks at none."""
    return space.processing == "response_time" and space.profile != "osate-2.2"


def flow_rows(space: Space, flow: Flow, view: View) -> tuple[Row, ...]:
    """The contributor table of `flow`; its totals are the sums of its columns."""
    return tuple(row for step in flow.steps for row in step_rows(space, step, view))


def step_rows(space: Space, step: Step, view: View) -> tuple[Row, ...]:
    """The rows of one element of a flow.

    The flow starts at its first component without that component's own period (the *reduced* reaction time).
    """
    if step.kind == "connection":
        return (_connection_row(space, step.index, view),)
    component = space.components[step.index]
    rows = _callback_rows(space, step, component, view)
    for row in (_sampling_row(space, step, component, view), _queuing_row(space, step, component, view)):
        if row is not None:
            rows.append(row)
    rows.append(_processing_row(space, component, view))
    return tuple(rows)


def _callback_rows(space: Space, step: Step, component: Component, view: View) -> list[Row]:
    """What the callback of a hybrid component takes before its timer samples."""
    callback = at(component.callback_ns, view) if step.via is not None else None
    if callback is None or at(component.protocol, view) != "hybrid":
        return []
    method = "processing time"
    worst, worst_method = callback[1], method
    if counts_responses(space) and at(component.processor, view) is not None:
        worst, worst_method = _scheduled_ns(space, component, "callback", view)
    return [Row(component.category, component.name, callback[0], method, worst, worst_method)]


def arrival_ns(space: Space, step: Step, view: View) -> tuple[Component, Exact, Exact] | None:
    """The nearest component before a step that a timer releases, and how long after that data may be there.

    None where a flow has no such component before it.
    """
    rows = _callback_rows(space, step, space.components[step.index], view)
    for earlier in reversed(step.since):
        if earlier.kind == "component" and is_periodic(space.components[earlier.index], view):
            sender = space.components[earlier.index]
            rows.append(_processing_row(space, sender, view))
            return sender, sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)
        rows += step_rows(space, earlier, view)
    return None


def run_spread_ns(space: Space, step: Step, view: View) -> Exact | None:
    """What sampling adds to the largest difference of latencies within one run (docs/semantics.md, section 3.6).

    None where it is that of all runs: offsets are known, or the clocks drift.
    """
    receiver = space.components[step.index] if step.since else None
    if receiver is None or space.profile != "dse" or not is_periodic(receiver, view):
        return None
    found = arrival_ns(space, step, view)
    if found is None or pair_of(found[0], receiver, view) is not None:
        return None
    pair = pair_of(found[0], receiver, view, offsets=False)
    return None if pair is None else spread_ns(pair, *found[1:])


def _on_one_clock(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """Sampling of what comes from a timer of the same clock, where both offsets are known."""
    if space.profile != "dse" or not step.since or at(component.offset_ns, view) is None:
        return None
    found = arrival_ns(space, step, view)
    pair = None if found is None else pair_of(found[0], component, view)
    if found is None or pair is None:
        return None
    least, most = wait_ns(pair, *found[1:])
    return Row(component.category, component.name, least, METHOD, most, METHOD)


def _connection_row(space: Space, number: int, view: View) -> Row:
    """Transmission, as `transmission_ns` says."""
    connection = space.connections[number]
    least, most, method = transmission_ns(space, connection, view)
    if method == "transmission time" and space.profile == "osate-2.2":
        method = "no latency"
    if method == "no latency":
        method = NO_LATENCY[space.profile]
    return Row("connection", connection.name, least, method, most, method)


def _sampling_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """Sampling delay: 0 .. period of a periodic component that is not the first of the flow."""
    periodic = is_periodic(component, view)
    if step.via is None:
        # OSATE 2.2 prints the row for every device and abstract component, periodic or not: a slip of its source
        if periodic or (space.profile == "osate-2.2" and component.category in ("device", "abstract")):
            return Row(component.category, component.name, 0, "first sampling", 0, "first sampling")
        return None
    if periodic:
        if space.profile == "osate-2.19" and space.connections[step.via].port not in ("data", "feature"):
            return None
        on_one_clock = _on_one_clock(space, step, component, view)
        if on_one_clock is not None:
            return on_one_clock
        period = at(component.period_ns, view)
        if space.profile == "osate-2.19":
            period = _harmonic_period(space, step, period, view)
        return Row(component.category, component.name, 0, "sampling", period, "sampling")
    if space.profile == "osate-2.2" and component.category in ("device", "abstract"):
        return Row(component.category, component.name, 0, "sampling", 0, "sampling")
    return None


def _harmonic_period(space: Space, step: Step, period: int, view: View) -> int:
    """OSATE since 2.3: the sender's period, however that is dispatched, if it divides the receiver's; else that one."""
    sending: int | None = at(space.components[step.sender].period_ns, view) if step.sender is not None else None
    return sending if sending is not None and period % sending == 0 else period


def _queuing_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """Queuing delay: 0 .. queue size * delay per queued item, by the profile's rules.

    Where a thread is explicitly periodic or sporadic, OSATE counts a period for each item; in 2014 less one item, the
    one that its sampling delay accounts for.
    """
    if step.via is None:
        return None
    wire = space.connections[step.via]
    size = at(wire.queue_size, view)
    if size is None:
        size = at(component.queue_size, view)
    explicit = at(component.protocol, view)
    each = _worst_ns(space, component, view)[0]
    if space.profile == "dse":
        if size is None or not is_event_triggered(component, view):
            return None
    elif space.profile == "osate-2.2":
        if wire.port not in ("event", "event_data") or component.category == "abstract":
            return None
        size = 1 if size is None else size
        if explicit in ("periodic", "sporadic"):
            size, each = max(size - 1, 0), at(component.period_ns, view)
    else:
        if size is None:
            size = 1 if wire.port == "data" and explicit in ("aperiodic", "sporadic") else 0
        if size == 0:
            return None
        if explicit in ("periodic", "sporadic"):
            each = at(component.period_ns, view)
    return Row(component.category, component.name, 0, "queued", size * each, "queued")


def is_logical(space: Space, component: Component, view: View) -> bool:
    """Whether data pass at release and deadline: logical execution time, which OSATE does not look at."""
    return space.profile == "dse" and at(component.communication, view) == LET


def _processing_row(space: Space, component: Component, view: View) -> Row:
    if is_logical(space, component, view):
        logical = deadline_ns(component, view)
        assert logical is not None, component.name
        return Row(component.category, component.name, logical, LET_METHOD, logical, LET_METHOD)
    best, best_method = _best_ns(space, component, view)
    worst, worst_method = _worst_ns(space, component, view)
    return Row(component.category, component.name, best, best_method, worst, worst_method)


def _best_ns(space: Space, component: Component, view: View) -> tuple[Exact, str]:
    """Best processing: best execution time, else specified; OSATE 2.19 looks at the response time first."""
    candidates = [(component.execution_ns, "processing time"), (component.latency_ns, "specified")]
    if space.profile == "osate-2.19":
        candidates.insert(0, (component.response_ns, "response time"))
    ranges = [(at(tree, view), method) for tree, method in candidates]
    return _first(space, [(given and given[0], method) for given, method in ranges])


def _worst_ns(space: Space, component: Component, view: View) -> tuple[Exact, str]:
    """Worst processing, by profile and by the worst-case setting (docs/semantics.md, section 3.2).

    An assigned deadline counts in OSATE under either setting where nothing before it gives a time.
    """
    by_deadline = space.worst_case == "deadline"
    deadline = (at(component.deadline_ns, view), "deadline")
    period = (at(component.period_ns, view), "deadline")
    trees = (component.response_ns, component.execution_ns, component.latency_ns)
    ranges = [at(tree, view) for tree in trees]
    methods = ("response time", "processing time", "specified")
    response, execution, latency = ((given and given[1], method) for given, method in zip(ranges, methods, strict=True))
    computed = counts_responses(space) and at(component.processor, view) is not None
    if computed and response[0] is None and execution[0] is not None:
        response = _scheduled_ns(space, component, "thread", view)
    if space.profile == "dse":
        return _first(space, [response, execution, latency])
    if space.profile == "osate-2.2":
        return _first(space, [deadline, latency] if by_deadline else [execution, deadline, latency])
    if by_deadline and deadline[0] is not None:
        return _first(space, [response, deadline])
    return _first(space, [response, execution, latency, deadline, period])


def _scheduled_ns(space: Space, component: Component, part: Part, view: View) -> tuple[Exact, str]:
    """The response time that follows from what shares the core (``processing: response_time``)."""
    number = next(number for number, item in enumerate(space.components) if item is component)
    worst = bounded_response_ns(space, number, part, view)
    return worst, "response time" if worst < UNBOUNDED_NS else UNBOUNDED_METHOD


def _first(space: Space, candidates: Sequence[tuple[Exact | None, str]]) -> tuple[Exact, str]:
    """The first value that is given, with its method; for OSATE a time of 0 is none."""
    for value, method in candidates:
        if value or (value is not None and space.profile == "dse"):
            return value, method
    return 0, NO_LATENCY[space.profile]
