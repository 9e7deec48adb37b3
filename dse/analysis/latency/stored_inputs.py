"""Inputs that do not dispatch their reader: data wait until something else does (docs/semantics.md, section 3.1).

An event-triggered component reads what lies in a `data` port, or in one that `dispatch_trigger` leaves out, when
something else dispatches it, as a timer does at its release. Data that come just after one dispatch wait for the next:
no time at the least, and the longest time between two dispatches at the most.

A device that nothing dispatches has no releases: it takes what comes when it comes.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial, reduce

from dse.analysis.binding import transmission_ns
from dse.analysis.latency.processing import processing_row
from dse.analysis.latency.rows import DISPATCH_METHOD, UNBOUNDED_DISPATCH, Row
from dse.analysis.rates import NS_PER_S, arrivals, is_event_triggered, rate_hz
from dse.analysis.scheduling.responses import NO_BOUND, UNBOUNDED_NS
from dse.analysis.terms import picked
from dse.analysis.views import View
from dse.space.model.arrivals import BY_INPUTS
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at, leaves
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
    """The longest time between two dispatches of a component, in ns; `UNBOUNDED_NS` where nothing bounds it.

    A timer is released once in each period, and what comes from outside comes at its rate; what a job sends comes as
    much later as its processing and transmission may spread, and as its stated rate keeps messages apart. Each way to
    be dispatched bounds the time by itself. Jobs that come sooner than a separation are not run, which adds to it.
    """
    gaps: dict[int, Exact | None] = {}
    todo, begun = [number], set[int]()
    while todo:
        top = todo[-1]
        missing = [item for item in _before(space, top, view) if item not in gaps] if top not in gaps else []
        if not missing:
            gaps.setdefault(top, _gap_ns(space, top, gaps, view))
            todo.pop()
        elif top in begun:  # a cycle, which only a stated rate may break
            gaps[top] = None
        else:
            begun.add(top)
            todo += missing
    found = gaps[number]
    return NO_BOUND if found is None or found >= UNBOUNDED_NS else found


def _before(space: Space, number: int, view: View) -> list[int]:
    """The components whose jobs dispatch a component, of a thread with segments its first piece."""
    component = space.components[number]
    wires = component.triggers if is_event_triggered(component, view) else ()
    sources = [space.connections[wire].source for wire in wires]
    return [_pieces(space, item)[0] for item in sources if item is not None]


def _pieces(space: Space, number: int) -> tuple[int, ...]:
    """The pieces of a thread until the end of a component; that alone where it is none."""
    pieces = space.components[number].pieces
    return (number,) if pieces is None else pieces.members[: pieces.members.index(number) + 1]


def _gap_ns(space: Space, number: int, gaps: Mapping[int, Exact | None], view: View) -> Exact | None:
    component = space.components[number]
    if not is_event_triggered(component, view):
        period: Exact = at(component.period_ns, view)
        return period
    found = [gap for wire in component.triggers if (gap := _delivery_gap_ns(space, wire, gaps, view)) is not None]
    if not found:
        return None
    least: Exact = reduce(partial(picked, "min"), found)
    return least + at(component.period_ns, view) if arrivals(component, view).is_separated else least


def _delivery_gap_ns(space: Space, wire: int, gaps: Mapping[int, Exact | None], view: View) -> Exact | None:
    """The longest time between two messages of a connection, in ns; None without a bound."""
    connection = space.connections[wire]
    least, most, _ = transmission_ns(space, connection, view)
    apart: Exact | None = 0
    if connection.states_rate or connection.source is None:
        rate = rate_hz(space, ("delivery", wire), view)
        apart = -(-NS_PER_S // rate) if rate else None
    if apart is None or connection.source is None:
        return None if apart is None else apart + (most - least)
    pieces = _pieces(space, connection.source)
    gap = gaps.get(pieces[0])
    if gap is None:
        return None
    gap += apart  # what is sent sooner than a stated rate allows does not come
    for item in pieces:
        row = processing_row(space, space.components[item], view)
        if row.max_ns >= UNBOUNDED_NS:
            return None
        gap += row.max_ns - row.min_ns
    return gap + (most - least)
