"""What a contribution to a flow's latency is: one row of its contributor table (docs/semantics.md, section 3.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

from dse.analysis.scheduling.busy_window import Part
from dse.analysis.scheduling.chained import longer_by_ns
from dse.analysis.scheduling.responses import UNBOUNDED_NS, bounded_response_ns
from dse.analysis.views import View
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.json_fields import NULL, Json
from dse.support.units import Exact

NO_LATENCY = {"dse": "no latency", "osate-2.2": "no latency", "osate-2.19": "no sampling/queuing latency"}
UNBOUNDED_METHOD = "response time (unbounded)"
"""Of a row whose maximum stands for a response time without a bound."""
DISPATCH_METHOD = "sampling by dispatch"
"""Of a row of an event-triggered component that reads what does not dispatch it."""
UNBOUNDED_DISPATCH = "sampling by dispatch (unbounded)"
"""Of such a row where nothing bounds the time between two dispatches."""
JOIN_METHOD = "waiting for input "
"""Begins the method of a row of a component that needs all its inputs, before the name of what comes last."""
UNBOUNDED_JOIN = " (unbounded)"
"""Ends it where nothing bounds how long that takes."""
OWN_JOB_METHOD = "less its own job"
"""The method of a row that subtracts the time that both the sampling and the response time of a timer count."""
BUS_METHOD = "waiting for the bus"
"""Of a row of a connection whose message waits for others."""
UNBOUNDED_BUS = "waiting for the bus (unbounded)"


@dataclass(frozen=True, slots=True)
class Row:
    """A contributor to the latency of a flow.

    `category` and `contributor` are as OSATE prints them.
    """

    category: Annotated[str, "What kind of contribution it is."]
    contributor: Annotated[str, "The component, connection or bus."]
    min_ns: Annotated[Exact, "What it adds to the minimum latency."]
    min_method: Annotated[str, "The rule that gives the minimum."]
    max_ns: Annotated[Exact, NULL, "What it adds to the maximum latency; null where it is unbounded."]
    max_method: Annotated[str, "The rule that gives the maximum."]
    medium: Annotated[str, "The bus or virtual bus of a row of a connection.", Json(default="")] = ""
    specified_ns: Annotated[
        tuple[Exact, Exact] | None,
        "Under the `osate` profiles: the minimum and maximum that are specified for it.",
        Json(default=None, kind=tuple[Exact, ...] | None),
    ] = None


def has_no_bound(row: Row) -> bool:
    """Whether the maximum of a row stands for a time without a bound.

    Judged by the row's method.
    """
    if row.max_method.startswith(JOIN_METHOD):
        return row.max_method.endswith(UNBOUNDED_JOIN)
    return row.max_method in (UNBOUNDED_METHOD, UNBOUNDED_DISPATCH, UNBOUNDED_BUS)


def counts_responses(space: Space) -> bool:
    """Whether latencies count response times; OSATE of 2014 looks at none.

    True for `processing: response_time` under a profile that has response times.
    """
    return space.processing == "response_time" and space.profile != "osate-2.2"


def scheduled_ns(space: Space, component: Component, part: Part, view: View) -> tuple[Exact, str]:
    """The response time that follows from what shares the core (``processing: response_time``), with its method.

    A time in ns, `UNBOUNDED_NS` without a bound, and its method.
    """
    worst = bounded_response_ns(space, space.component_numbers[component.name], part, view)
    return worst, "response time" if worst < UNBOUNDED_NS else UNBOUNDED_METHOD


def computed_ns(
    space: Space,
    component: Component,
    execution: tuple[Exact | None, str],
    view: View,
    chained: Step | None = None,
    *,
    is_paired: bool = False,
) -> tuple[Exact, str]:
    """The computed response time of a thread; no less than the execution time that it has in one flow alone.

    A time in ns and its method; a flow may state a longer execution time of its own for the thread. Of a `chained` step
    of a flow it is how much longer its chain takes with the thread, where it `is_paired` from its latest release on.
    """
    if chained is not None:
        time_ns = longer_by_ns(space, chained, view, is_paired=is_paired), "response time"
        time_ns = time_ns if time_ns[0] < UNBOUNDED_NS else (time_ns[0], UNBOUNDED_METHOD)
    else:
        time_ns = scheduled_ns(space, component, "thread", view)
    if execution[0] is None or space.components[space.component_numbers[component.name]] is component:
        return time_ns
    return time_ns if time_ns[0] >= execution[0] else (execution[0], execution[1])


def in_flow(space: Space, component: Component, step: Step, *, is_periodic: bool) -> Component:
    """A component with the figures that it has in one flow.

    Execution and response time are those of an event port or event data port, of a component that is not periodic.
    """
    figures = step.figures
    if figures is None:
        return component
    by_event = step.via is not None and space.connections[step.via].port in ("event", "event_data")
    counts = by_event and not is_periodic
    response, execution = (figures.response_ns, figures.execution_ns) if counts else (None, None)
    return replace(
        component,
        latency_ns=figures.latency_ns or component.latency_ns,
        execution_ns=execution or component.execution_ns,
        response_ns=response or component.response_ns,
    )


def is_computed(space: Space, component: Component, view: View) -> bool:
    """Whether a component's response time is computed: where these count, of a thread on a processor."""
    return counts_responses(space) and at(component.processor, view) is not None


def first_given(space: Space, candidates: Sequence[tuple[Exact | None, str]]) -> tuple[Exact, str]:
    """The first value that is given, with its method; for OSATE a time of 0 is none.

    A time in ns and its method; 0 with the method "no latency" of the profile where none is given.
    """
    for value, method in candidates:
        if value or (value is not None and space.profile == "dse"):
            return value, method
    return 0, NO_LATENCY[space.profile]
