"""The processing row of a contributor table: shortest and longest time of a job (docs/semantics.md, section 3.2)."""

from __future__ import annotations

from dse.analysis.latency.rows import Row, computed_ns, first_given, is_computed, scheduled_ns
from dse.analysis.latency.sampling import LET, LET_METHOD
from dse.analysis.rates import is_periodic, kept_jobs, may_poll
from dse.analysis.scheduling.priorities import deadline_ns
from dse.analysis.scheduling.tasks import elapsed_ns
from dse.analysis.views import View
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.units import Exact


def is_logical(space: Space, component: Component, view: View) -> bool:
    """Whether data pass at release and deadline: logical execution time, which OSATE does not look at.

    ``communication: let``: data are read at the release and written at the deadline, whatever the core does.
    """
    return space.profile == "dse" and at(component.communication, view) == LET


def processing_row(
    space: Space, component: Component, view: View, chained: Step | None = None, *, is_paired: bool = False
) -> Row:
    """The shortest and longest time from the release of a component's job until its data leave, in ns, as a row.

    Of a `chained` step of a flow it is what the thread adds to the longest time of those before it in its chain. Where
    the step `is_paired` it takes messages of all its inputs in order, and the time counts from its latest release. The
    methods say which figure was used: deadline, response time, processing time or specified.
    """
    if is_logical(space, component, view):
        logical = deadline_ns(component, view)
        assert logical is not None, component.name
        return Row(component.category, component.name, logical, LET_METHOD, logical, LET_METHOD)
    best, best_method = best_ns(space, component, view)
    worst, worst_method = worst_ns(space, component, view, chained, is_paired=is_paired)
    return Row(component.category, component.name, best, best_method, worst, worst_method)


def best_ns(space: Space, component: Component, view: View) -> tuple[Exact, str]:
    """Best processing: best execution time, else specified.

    A time in ns and its method.
    """
    candidates = [(component.execution_ns, "processing time"), (component.latency_ns, "specified")]
    ranges = [(at(tree, view), method) for tree, method in candidates]
    return first_given(space, [(times and times[0], method) for times, method in ranges])


def worst_ns(
    space: Space, component: Component, view: View, chained: Step | None = None, *, is_paired: bool = False
) -> tuple[Exact, str]:
    """Worst processing: the response time, stated or computed, the execution time, specified (section 3.2).

    Of a `chained` step of a flow it is how much longer its chain takes with the thread (section 4.9), where it
    `is_paired` from its latest release on (section 3.8).

    A time in ns and its method; with segments the last piece has what earlier ones have not used.
    """
    trees = (component.response_ns, component.execution_ns, component.latency_ns)
    ranges = [at(tree, view) for tree in trees]
    methods = ("response time", "processing time", "specified")
    response, execution, latency = ((times and times[1], method) for times, method in zip(ranges, methods, strict=True))
    waits = component.pieces is None or component.name == component.pieces.thread  # all of it at the last piece
    if waits and is_computed(space, component, view) and response[0] is None and execution[0] is not None:
        response = computed_ns(space, component, execution, view, chained, is_paired=is_paired)
        if component.pieces is not None:
            own = execution[0]
            before = elapsed_ns(space, component.pieces.members[-1], view)[1] - own
            return max(own, response[0] - before), response[1]
    return first_given(space, [response, execution, latency])


def callback_row(space: Space, component: Component, view: View) -> Row | None:
    """The row of the callback of a hybrid component, which runs before its timer samples; None without a callback.

    Times in ns; with response times the worst case includes waiting.
    """
    callback = at(component.callback_ns, view)
    if callback is None or at(component.protocol, view) != "hybrid":
        return None
    method = "processing time"
    worst, worst_method = callback[1], method
    if is_computed(space, component, view):
        worst, worst_method = scheduled_ns(space, component, "callback", view)
    return Row(component.category, component.name, callback[0], method, worst, worst_method)


def callback_ns(space: Space, component: Component, view: View) -> tuple[Exact, Exact]:
    """The shortest and longest time of that callback, in ns; 0 where there is none."""
    row = callback_row(space, component, view)
    return (0, 0) if row is None else (row.min_ns, row.max_ns)


def skipped_ns(space: Space, number: int, view: View) -> Exact:
    """The most by which the releases of two consecutive jobs of a timer exceed its period, in ns; 0 if it skips none.

    A job waits at most for its response time less its longest execution. Where that is shorter than a period it has
    begun when the next is released.
    """
    waits = longest_wait_ns(space, number, view)
    return waits if waits is not None and waits >= at(space.components[number].period_ns, view) else 0


def longest_wait_ns(space: Space, number: int, view: View) -> Exact | None:
    """The longest wait of a timer's job until it begins in an executor that polls, in ns; None for other components.

    Releases that come meanwhile are skipped.
    """
    component = space.components[number]
    if not may_poll(space, component) or not is_periodic(component, view):
        return None
    execution = at(component.execution_ns, view)
    if execution is None or kept_jobs(space, component, "thread", view) is None:
        return None
    waits: Exact = processing_row(space, component, view).max_ns - execution[1]
    return waits
