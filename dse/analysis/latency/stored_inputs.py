"""Inputs that do not dispatch their reader: data wait until something else does (docs/semantics.md, section 3.1).

An event-triggered component reads what lies in a `data` port, or in one that `dispatch_trigger` leaves out, when
something else dispatches it, as a timer does at its release. Data that come just after one dispatch wait for the next:
no time at the least, and the longest time between two dispatches at the most.

A device that nothing dispatches has no releases: it takes what comes when it comes.
"""

from __future__ import annotations

from dse.analysis.latency.rows import DISPATCH_METHOD, UNBOUNDED_DISPATCH, Row, counts_responses
from dse.analysis.rates import is_event_triggered
from dse.analysis.scheduling.event_models import EventModels
from dse.analysis.scheduling.model import Stage
from dse.analysis.scheduling.resolve import reader, with_senders
from dse.analysis.scheduling.responses import NO_BOUND, UNBOUNDED_NS, bounded_response_ns
from dse.analysis.scheduling.tasks import TaskKey
from dse.analysis.views import View
from dse.space.model.arrivals import BY_INPUTS
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import leaves
from dse.support.units import Exact


def stored_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """What data wait for the next dispatch of an event-triggered component; None where they dispatch it."""
    if not may_be_stored(space, step) or not is_event_triggered(component, view):
        return None
    gap = dispatch_gap_ns(space, step.index, view)
    method = DISPATCH_METHOD if gap < UNBOUNDED_NS else UNBOUNDED_DISPATCH
    return Row(component.category, component.name, 0, method, gap, method)


def may_be_stored(space: Space, step: Step) -> bool:
    """Whether an element of a flow is a component that reads what does not dispatch it, in designs where inputs do."""
    if space.profile != "dse" or step.kind != "component" or step.via is None:
        return False
    component = space.components[step.index]
    if step.via in component.triggers or (component.section != "threads" and not component.triggers):
        return False
    has_events = bool({None, *BY_INPUTS} & set(leaves(component.protocol)))
    is_piece = component.pieces is not None and component.pieces.members[0] != step.index
    return has_events and not is_piece


def waits_for_others(space: Space, step: Step) -> bool:
    """Whether the longest time between two dispatches of such a component hangs on response times."""
    return may_be_stored(space, step) and any(
        space.components[number].processor is not None for number in dispatchers(space, step.index)
    )


def dispatchers(space: Space, number: int) -> frozenset[int]:
    """The components whose jobs may dispatch a component, by number, also by way of others."""
    found: set[int] = set()
    todo = [number]
    while todo:
        component = space.components[todo.pop()]
        pieces = component.pieces.members if component.pieces is not None else ()
        senders = (space.connections[wire].sender for wire in component.triggers)
        fresh = {item for item in (*pieces, *senders) if item is not None} - found
        found |= fresh
        todo += fresh
    return frozenset(found)


def dispatch_gap_ns(space: Space, number: int, view: View) -> Exact:
    """The longest time between two dispatches of a component, in ns; `UNBOUNDED_NS` where nothing bounds it."""
    stages = with_senders([(number, "thread")], reader(space, view))
    ends = {key: _end_ns(space, stage, view) for key, stage in stages.items()} if counts_responses(space) else {}
    found = EventModels(stages, ends).longest_gap_ns((number, "thread"))
    return NO_BOUND if found is None or found >= UNBOUNDED_NS else found


def _end_ns(space: Space, stage: Stage, view: View) -> Exact | None:
    """When a stage ends after the release of its thread; None without a bound."""
    key: TaskKey = stage.key
    response = bounded_response_ns(space, *key, view)
    if response >= UNBOUNDED_NS:
        return None
    return response if response >= stage.elapsed_ns[1] else stage.elapsed_ns[1]
