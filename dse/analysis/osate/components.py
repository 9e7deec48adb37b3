"""What OSATE reads of a component by itself: its period, processing and queue (docs/semantics.md, section 3.7)."""

from __future__ import annotations

from collections.abc import Iterator

from dse.analysis.latency.rows import Row, computed_ns, first_given, in_flow, is_computed, scheduled_ns
from dse.analysis.views import View
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.units import Exact

EXECUTING = ("thread", "device", "abstract")
"""The categories whose execution times and dispatch protocols OSATE reads."""
OLD = "osate-2.2"
METHODS = ("response time", "processing time", "specified")


def later_rows(space: Space, step: Step, component: Component, view: View) -> Iterator[Row]:
    """The rows of a component after its sampling: callback of a hybrid one, queue, processing.

    Rows of the contributor table in OSATE's order, times in ns.
    """
    component = in_flow(space, component, step, is_periodic=is_sampling(space, component, view))
    callback = _callback_row(space, step, component, view)
    if callback is not None:
        yield callback
    queue = _queue_row(space, step, component, view)
    if queue is not None:
        yield queue
    best, best_method = _best_ns(space, component, view)
    worst, worst_method = _worst_ns(space, component, view)
    yield Row(component.category, component.name, best, best_method, worst, worst_method)


def _callback_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """The callback of a hybrid component, which AADL has no word for: counted before its timer samples."""
    callback = at(component.callback_ns, view) if at(component.protocol, view) == "hybrid" else None
    if callback is None or step.via is None:
        return None
    worst, method = callback[1], "processing time"
    if is_computed(space, component, view):
        worst, method = scheduled_ns(space, component, "callback", view)
    return Row(component.category, component.name, callback[0], "processing time", worst, method)


def period_ns(component: Component, view: View) -> Exact:
    """AADL's Period, which counts whatever the dispatch protocol; 0 where none is given.

    In ns.
    """
    return at(component.stated_period_ns, view) or 0


def is_sampling(space: Space, component: Component, view: View) -> bool:
    """Whether a component has a Period and is not dispatched by events, as far as OSATE looks at that.

    The profile *osate-2.2* treats sporadic threads and devices as not sampling; *osate-2.19* sporadic and aperiodic
    ones.
    """
    if not period_ns(component, view):
        return False
    protocol = at(component.protocol, view)
    if space.profile == OLD:
        return not (component.category in ("thread", "device") and protocol == "sporadic")
    return not (component.category in EXECUTING and protocol in ("sporadic", "aperiodic"))


def _queue_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """0 (or as much, where queues are full at best) .. queue size * delay of each queued item."""
    if step.via is None or step.unlinked:
        return None
    wire = space.connections[step.via]
    size = at(wire.queue_size, view)
    if size is None:
        size = at(component.queue_size, view)
    explicit = at(component.protocol, view)
    by_period = explicit in ("periodic", "sporadic")
    if space.profile == OLD:
        if wire.port not in ("event", "event_data") or component.category not in ("thread", "device"):
            return None
        size = 1 if size is None else size
        size = max(size - 1, 0) if by_period else size
    else:
        if size is None:
            passive = component.category in EXECUTING and explicit in ("aperiodic", "sporadic")
            size = 1 if wire.port == "data" and passive else 0
        if size == 0:
            return None
    most = size * (period_ns(component, view) if by_period else _worst_ns(space, component, view)[0])
    least: Exact = 0
    if space.best_case == "full_queue":
        least = size * (period_ns(component, view) if by_period else _best_ns(space, component, view)[0])
    return Row(component.category, component.name, least, "queued", most, "queued")


def _ranges(component: Component, view: View) -> list[tuple[Exact, Exact] | None]:
    """Response time, execution time and specified latency, as far as OSATE reads them of its category."""
    executes = component.category in EXECUTING
    trees = (component.response_ns, component.execution_ns, component.latency_ns)
    return [at(tree, view) if executes or tree is component.latency_ns else None for tree in trees]


def _best_ns(space: Space, component: Component, view: View) -> tuple[Exact, str]:
    """Shortest processing: response time (not in 2014), execution time, specified."""
    times = list(zip(_ranges(component, view), METHODS, strict=True))[1 if space.profile == OLD else 0 :]
    return first_given(space, [(range_ns and range_ns[0], method) for range_ns, method in times])


def _worst_ns(space: Space, component: Component, view: View) -> tuple[Exact, str]:
    """Longest processing, by profile and by the worst-case setting.

    An assigned deadline of 0 takes the place of the execution time all the same, and leaves the specified latency.
    """
    by_deadline = space.worst_case == "deadline"
    deadline = (at(component.deadline_ns, view), "deadline")
    response, execution, latency = (
        (range_ns and range_ns[1], method) for range_ns, method in zip(_ranges(component, view), METHODS, strict=True)
    )
    if space.profile == OLD:
        return first_given(space, [deadline, latency] if by_deadline else [execution, deadline, latency])
    if is_computed(space, component, view) and response[0] is None and execution[0] is not None:
        response = computed_ns(space, component, execution, view)
    if by_deadline and deadline[0] is not None:
        return first_given(space, [response, deadline, latency])
    period = (period_ns(component, view), "deadline")
    return first_given(space, [response, execution, latency, deadline, period])
