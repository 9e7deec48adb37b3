"""Releases that a timer skips: what they add to the age of data (docs/semantics.md, sections 3.1 and 4.6).

In an executor that polls at most one job of a timer waits. A release that comes while one does is skipped, so that the
next job may be released later than a period after the last one. Until data are read that adds nothing: the job that
waits begins after they came, and reads them. Nor do data wait for a whole period and for a job of the timer that ran
when they came: by then its next release may have come.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial

from dse.analysis.latency.deliveries import delivery_ns
from dse.analysis.latency.processing import skipped_ns
from dse.analysis.latency.rows import OWN_JOB_METHOD, Row, counts_responses
from dse.analysis.latency.stored_inputs import stored_row
from dse.analysis.rates import NS_PER_S, is_periodic, kept_jobs, may_poll, rate_hz
from dse.analysis.scheduling.overheads import switching_ns
from dse.analysis.scheduling.priorities import number_of
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.scheduling.tasks import alone_ns, task_keys
from dse.analysis.terms import ZERO, Term
from dse.analysis.views import View
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.units import Exact, picked


def skipped_terms(space: Space, flow: Flow, kind: str) -> Iterator[Term]:
    """The terms of skipped releases in the reaction time of a flow, or in the age of its data.

    In the reaction time something sensed waits for the first timer. In an age each timer adds that another follows.
    """
    ends = _anything if counts_responses(space) else None
    for place, step in enumerate(flow.steps):
        if step.kind != "component" or not may_poll(space, space.components[step.index]):
            continue
        if kind == "reaction time" and place:
            return

        def value(view: View, place: int = place, number: int = step.index) -> Fraction:
            is_counted = kind == "reaction time" or _is_followed(space, flow, place, view)
            return ZERO + (skipped_ns(space, number, view) if is_counted else 0)

        name = space.components[step.index].name
        yield Term(f"skipped releases of {name}", value, ends=ends)
        if kind != "reaction time" and step.via is not None and not step.only_reads:
            yield Term(f"own job of {name}", partial(_own_job, space, step))


def _anything(view: View) -> tuple[Fraction, Fraction]:
    """The ends of a time that depends on response times."""
    return ZERO, ZERO + UNBOUNDED_NS


def _own_job(space: Space, step: Step, view: View) -> Fraction:
    return ZERO + own_job_ns(space, step, view)


def _is_followed(space: Space, flow: Flow, place: int, view: View) -> bool:
    """Whether another element of a flow behind this one samples what comes to it."""
    for step in flow.steps[place + 1 :]:
        if step.kind == "component":
            component = space.components[step.index]
            if is_periodic(component, view) or stored_row(space, step, component, view) is not None:
                return True
    return False


def own_job_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """The row that takes off a job of the timer that samples, where its sampling and its response both count it."""
    time_ns = own_job_ns(space, step, view)
    return Row(component.category, component.name, 0, OWN_JOB_METHOD, -time_ns, OWN_JOB_METHOD) if time_ns else None


def own_job_ns(space: Space, step: Step, view: View) -> Exact:
    """The time to subtract where the period and the response time of a timer both count one of its own jobs, in ns.

    In an executor that asks for more than a core its response time is that of rounds, which has a job of its own in the
    round that runs, or what priorities put before it in a round where that takes longer. If it ran when data came its
    next release comes meanwhile; if none did it does not count. What the executor itself stores comes when none runs.
    Of a timer with an offset nothing is taken off.
    """
    number = step.index
    component = space.components[number]
    if step.via is None or not counts_responses(space) or not may_poll(space, component):
        return 0
    if not is_periodic(component, view) or kept_jobs(space, component, "thread", view) is None:
        return 0
    executor = at(component.executor, view)
    if (
        at(component.response_ns, view) is not None
        or at(component.offset_ns, view) is not None
        or not asks_for_too_much(space, executor, view)
    ):
        return 0
    period, longest = at(component.period_ns, view), at(component.execution_ns, view)
    own: Exact = 0 if longest is None else longest[1]
    own = picked("max", own - _earlier_ns(space, number, executor, view), 0)
    return own if _is_stored_there(space, step, view) else min(own, period)


def _earlier_ns(space: Space, number: int, executor: int, view: View) -> Exact:
    """The longest jobs of all that priorities put before a thread in a round of its executor, in ns."""
    own = number_of(space.components[number], view)
    found: Exact = 0
    for other in space.in_executor(executor, view) if own is not None else ():
        component = space.components[other]
        turn = number_of(component, view)
        if turn is None or own is None or turn <= own:
            continue
        for _, part in task_keys(space, other, view):
            found += alone_ns(component, part, view)[1] + switching_ns(space, other, view)
    return found


def asks_for_too_much(space: Space, executor: int, view: View) -> bool:
    """Whether the threads of an executor need more than all of a core."""
    used = Fraction(0)
    for number in space.in_executor(executor, view):
        component = space.components[number]
        longest, callback = at(component.execution_ns, view), at(component.callback_ns, view)
        used += 0 if longest is None else rate_hz(space, ("activation", number), view) * longest[1]
        if callback is not None and at(component.protocol, view) == "hybrid":
            used += rate_hz(space, ("input", number), view) * callback[1]
    return used > NS_PER_S


def _is_stored_there(space: Space, step: Step, view: View) -> bool:
    """Whether the executor of a timer stores what comes to it, at the end of a job, which takes some time."""
    component, wire = space.components[step.index], step.via
    if wire is None:
        return False
    callback = at(component.callback_ns, view) if at(component.protocol, view) == "hybrid" else None
    if callback is not None and wire in component.triggers:
        return bool(callback[1])
    sender = space.connections[wire].source
    if sender is None or space.components[sender].executor is None:
        return False
    longest = at(space.components[sender].execution_ns, view)
    is_here = at(space.components[sender].executor, view) == at(component.executor, view)
    return is_here and longest is not None and bool(longest[1]) and not delivery_ns(space, wire, view)[1]
