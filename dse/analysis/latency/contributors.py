"""End-to-end flow latency: the contributor table, row by row (docs/semantics.md, sections 3.1 to 3.3).

Minimum and maximum of a flow are sums of contributions. The rules here are those of the profile `dse`; OSATE's are in
`dse.analysis.osate.latency`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from dse.analysis.latency.deliveries import delivery_rows
from dse.analysis.latency.joined_inputs import is_paired, joined_row
from dse.analysis.latency.processing import best_ns, callback_row, processing_row, worst_ns
from dse.analysis.latency.rows import (
    UNBOUNDED_METHOD,
    Row,
    in_flow,
)
from dse.analysis.latency.sampling import METHOD, Pair, missing_ns, pair_of, spread_ns, wait_ns
from dse.analysis.latency.skipping import own_job_row
from dse.analysis.latency.stored_inputs import stored_row
from dse.analysis.osate.latency import FlowPosition, place_rows, places_of
from dse.analysis.rates import is_event_triggered, is_joined, is_periodic, may_poll, polls
from dse.analysis.views import View
from dse.space.architecture.clocks import AT_RELEASE
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.units import Exact, is_unbounded, picked


def flow_rows(space: Space, flow: Flow, view: View) -> tuple[Row, ...]:
    """The contributor table of `flow`; its totals are the sums of its columns.

    `Row` objects in the order of the flow, times in ns.
    """
    return tuple(row for element in elements_of(space, flow) for row in element_rows(space, element, view))


def elements_of(space: Space, flow: Flow) -> Sequence[Step | FlowPosition]:
    """The elements of a flow, in order; for OSATE, where what came before matters, with their places in it.

    Steps under the profile *dse*, `FlowPosition` objects under the OSATE profiles.
    """
    return flow.steps if space.profile == "dse" else places_of(space, flow)


def element_rows(space: Space, element: Step | FlowPosition, view: View) -> tuple[Row, ...]:
    """The rows of one element of a flow (one of `elements_of`).

    `Row` objects, times in ns; a connection and a component may have several.
    """
    return place_rows(space, element, view) if isinstance(element, FlowPosition) else step_rows(space, element, view)


def step_rows(space: Space, step: Step, view: View) -> tuple[Row, ...]:
    """The rows of one element of a flow under the profile `dse`.

    The flow starts at its first component without that component's own period (the *reduced* reaction time).
    """
    if step.kind == "connection":
        if space.connections[step.index].is_inner:
            return ()
        return delivery_rows(space, step.index, view, has_source=step.has_source)
    component = _in_flow(space, step, view)
    rows = _callback_rows(space, step, component, view)
    for row in (_sampling_row(space, step, component, view), _queuing_row(space, step, component, view)):
        if row is not None:
            rows.append(row)
    if not step.only_reads:
        rows += _job_rows(space, step, component, view)
        own = own_job_row(space, step, component, view)
        rows += [own] if own is not None else []
    return tuple(rows)


def _in_flow(space: Space, step: Step, view: View) -> Component:
    """The component of a step with the figures that it has there."""
    component = space.components[step.index]
    return in_flow(space, component, step, is_periodic=is_periodic(component, view))


def _callback_rows(space: Space, step: Step, component: Component, view: View) -> list[Row]:
    """The rows of a hybrid component before its timer samples: its callback, and its wait for the other inputs."""
    if step.via is None or at(component.protocol, view) != "hybrid":
        return []
    rows = (callback_row(space, component, view), joined_row(space, step, component, view))
    return [row for row in rows if row is not None]


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Timers on one clock that follow each other in a flow, the first of them by its number.

    Data are there between `least_ns` and `most_ns` after its release.
    """

    sender: int
    pair: Pair
    least_ns: Exact
    most_ns: Exact


def neighbours(space: Space, step: Step, view: View, *, offsets: bool = True) -> Neighbours | None:
    """A reader and the nearest component before it that a timer releases; None where clocks say nothing of them.

    With `offsets` both must be known, too.
    """
    arrival_ns = _arrival_ns(space, step, view)
    if arrival_ns is None:
        return None
    earlier, least, most = arrival_ns
    sender, receiver = space.components[earlier.index], space.components[step.index]
    pair = pair_of(sender, receiver, view, offsets=offsets)
    if pair is None:
        return None
    first = start_delay_ns(space, earlier, view), start_delay_ns(space, step, view)
    return Neighbours(earlier.index, replace(pair, begins_ns=first), least, most)


def start_delay_ns(space: Space, step: Step, view: View) -> Exact:
    """The longest time from the release of a timer's job until it reads, in ns; 0 where it reads at its release.

    A job that begins so late and takes its longest execution time ends within the response time. Latency is counted
    from the release of the first component of a flow.
    """
    component = space.components[step.index]
    if step.via is None or space.profile != "dse" or at(component.communication, view) in AT_RELEASE:
        return 0
    worst, method = worst_ns(space, component, view)
    if method not in ("response time", UNBOUNDED_METHOD):
        return 0
    execution = at(component.execution_ns, view)
    own = execution[1] if execution is not None else best_ns(space, component, view)[0]
    return worst if is_unbounded(worst) else picked("max", worst - own, 0)


def _arrival_ns(space: Space, step: Step, view: View) -> tuple[Step, Exact, Exact] | None:
    """The nearest element before one whose component a timer releases, and how long after that data may be there.

    None where a flow has no such element before it.
    """
    rows = _callback_rows(space, step, space.components[step.index], view)
    for earlier in reversed(step.since):
        if earlier.kind == "component" and is_periodic(space.components[earlier.index], view):
            rows += _job_rows(space, earlier, _in_flow(space, earlier, view), view)
            return earlier, sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)
        rows += step_rows(space, earlier, view)
    return None


def run_spread_ns(space: Space, step: Step, view: View) -> Exact | None:
    """The contribution of sampling to the run jitter of a flow, in ns (docs/semantics.md, section 3.6).

    None where it is that of all runs: offsets are known, or the clocks drift.
    """
    receiver = space.components[step.index] if step.since else None
    if receiver is None or space.profile != "dse" or not is_periodic(receiver, view):
        return None
    if neighbours(space, step, view) is not None:
        return None
    pair = neighbours(space, step, view, offsets=False)
    return None if pair is None else spread_ns(pair.pair, pair.least_ns, pair.most_ns)


@dataclass(frozen=True, slots=True)
class Phase:
    """The range of a wait by its offsets, with d = offset of the receiver - offset of the sender.

    It is at most (d + `most_ns`) mod `step_ns`, and at least (d + `least_ns`) mod `step_ns` less `less_ns`, and 0.
    """

    least_ns: Exact
    most_ns: Exact
    step_ns: Exact
    less_ns: Exact


def phased_parts(space: Space, step: Step, view: View) -> tuple[tuple[Exact, Exact], Phase | None]:
    """The least and greatest contribution of an element of a flow without its offsets, and the `Phase` of these.

    That is None for sampling of other clocks.
    """
    component = space.components[step.index]
    phased = neighbours(space, step, view, offsets=False)
    rows = _callback_rows(space, step, component, view)
    if not step.only_reads:
        rows += _job_rows(space, step, _in_flow(space, step, view), view)
    least, most = sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)
    period = at(component.period_ns, view)
    if phased is None:
        return (least, most + period), None
    pair = phased.pair
    assert not pair.error_ns, component.name
    phase = Phase(pair.begins_ns[1] - phased.least_ns, -phased.most_ns, pair.step_ns, missing_ns(pair))
    return (least, most + period - pair.step_ns), phase


def _on_one_clock(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """Sampling of what comes from a timer of the same clock, where both offsets are known."""
    if not step.since or at(component.offset_ns, view) is None:
        return None
    pair = neighbours(space, step, view)
    if pair is None:
        return None
    least, most = wait_ns(pair.pair, pair.least_ns, pair.most_ns)
    return Row(component.category, component.name, least, METHOD, most, METHOD)


def _sampling_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """Sampling delay: 0 .. period of a periodic component that is not the first of the flow, or until a dispatch.

    That of an event-triggered one that needs all its inputs is how long it waits for the others.
    """
    if not is_periodic(component, view):
        return joined_row(space, step, component, view) or stored_row(space, step, component, view)
    if step.via is None:
        return Row(component.category, component.name, 0, "first sampling", 0, "first sampling")
    on_one_clock = _on_one_clock(space, step, component, view)
    if on_one_clock is not None:
        return on_one_clock
    return Row(component.category, component.name, 0, "sampling", at(component.period_ns, view), "sampling")


def _queuing_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """Queuing delay of an event-triggered component with a queue: 0 .. queue size * its longest processing."""
    if step.via is None:
        return None
    size = at(space.connections[step.via].queue_size, view)
    if size is None:
        size = at(component.queue_size, view)
    if size is None or not is_event_triggered(component, view) or is_joined(component, view):
        return None  # in a join of all the queue holds what waits for the others
    if may_poll(space, component) and polls(space, component, view):
        return None  # its response time counts what waits
    each = worst_ns(space, component, view)[0]
    return Row(component.category, component.name, 0, "queued", size * each, "queued")


def _job_rows(space: Space, step: Step, component: Component, view: View) -> list[Row]:
    """The rows of a component's own time, from its release on; waits of later timers on its clock count them, too."""
    paired = is_paired(space, step, component, view)
    return [processing_row(space, component, view, step if step.chain or paired else None, is_paired=paired)]


def job_range_ns(space: Space, step: Step, view: View) -> tuple[Exact, Exact]:
    """The least and the most that a component of a flow takes from its release on.

    A pair in ns: processing, and waiting for what the job itself needs.
    """
    rows = _job_rows(space, step, _in_flow(space, step, view), view)
    return sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)


def figure_of(kind: str, range_ns: tuple[Exact, Exact]) -> Exact:
    """The figure of a flow, or of an element of one, in ns.

    `kind` is ``latency``, ``min latency`` or ``jitter``; the jitter is the difference of the range.
    """
    least, most = range_ns
    return least if kind == "min latency" else most if kind == "latency" else most - least
