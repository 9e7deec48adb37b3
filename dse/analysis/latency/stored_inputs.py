"""Inputs that do not dispatch their reader: data wait until something else does (docs/semantics.md, section 3.1).

An event-triggered component reads what lies in a `data` port, or in one that `dispatch_trigger` leaves out, when
something else dispatches it, as a timer does at its release. Data that come just after one dispatch wait for the next:
no time at the least, and the longest time between two dispatches at the most.

A device that nothing dispatches has no releases: it takes what comes when it comes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, reduce
from typing import Any, NamedTuple, TypeVar

from dse.analysis.latency.deliveries import delivery_ns
from dse.analysis.latency.processing import callback_ns, processing_row, skipped_ns
from dse.analysis.latency.rows import DISPATCH_METHOD, UNBOUNDED_DISPATCH, Row, counts_responses
from dse.analysis.memo import Recall
from dse.analysis.messages.stages import counted_buses
from dse.analysis.rates import NS_PER_S, arrivals, is_event_triggered, is_joined, passes_rates_on, rate_hz
from dse.analysis.scheduling.responses import NO_BOUND, UNBOUNDED_NS
from dse.analysis.views import View
from dse.space.model.arrivals import BY_INPUTS
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at, leaves
from dse.support.units import Exact, picked

T = TypeVar("T")


def stored_row(space: Space, step: Step, component: Component, view: View) -> Row | None:
    """The row of sampling by dispatch, for an event-triggered component whose input does not dispatch it; else None.

    Times in ns: from 0 to the longest distance of dispatches.
    """
    if not may_be_stored(space, step) or not is_event_triggered(component, view):
        return None
    gap = dispatch_gap_ns(space, step.index, view)
    method = DISPATCH_METHOD if gap < UNBOUNDED_NS else UNBOUNDED_DISPATCH
    return Row(component.category, component.name, 0, method, gap, method)


def may_be_stored(space: Space, step: Step) -> bool:
    """Whether an element of a flow is a component that reads what does not dispatch it, in designs where inputs do.

    Judged over all options; periodic readers sample by their timer instead.
    """
    if space.profile != "dse" or step.kind != "component" or step.via is None:
        return False
    component = space.components[step.index]
    if step.via in component.triggers or takes_at_once(space, component):
        return False
    has_events = bool({None, *BY_INPUTS} & set(leaves(component.protocol)))
    is_piece = component.pieces is not None and component.pieces.members[0] != step.index
    return has_events and not is_piece


def takes_at_once(space: Space, component: Component) -> bool:
    """Whether a component takes data when they come where no timer dispatches it: a device that no message dispatches.

    Only under the profile ``dse``.
    """
    return space.profile == "dse" and component.section != "threads" and not component.triggers


def waits_for_others(space: Space, step: Step) -> bool:
    """Whether a component that reads stored inputs waits for jobs whose response times count in that time."""
    return may_be_stored(space, step) and any(
        space.components[number].processor is not None for number in (step.index, *dispatchers(space, step.index))
    )


def dispatchers(space: Space, number: int) -> frozenset[int]:
    """The components whose jobs may dispatch a component, by number, also by way of others.

    The transitive closure over triggers and pieces, without a design.
    """
    numbers: set[int] = set()
    todo = [number]
    while todo:
        component = space.components[todo.pop()]
        pieces = component.pieces.members if component.pieces is not None else ()
        sources = (space.connections[wire].source for wire in component.triggers)
        fresh = {item for item in (*pieces, *sources) if item is not None} - numbers
        numbers |= fresh
        todo += fresh
    return frozenset(numbers)


class Distance(NamedTuple):
    """The least and the most time between two events that follow each other, in ns; `most_ns` None without a bound."""

    least_ns: Exact
    most_ns: Exact | None

    def later(self, spread_ns: Exact) -> Distance:
        """The distance of events each of which is delayed by a time of its own, which spreads so far.

        `spread_ns` is the greatest difference of two delays.
        """
        most = None if self.most_ns is None else self.most_ns + spread_ns
        return Distance(picked("max", self.least_ns - spread_ns, 0), most)

    def _thinned(self, lost_ns: Exact, apart_ns: Exact) -> Distance:
        """The distance of events of which those may be lost that come less than `lost_ns` after the last one.

        Those that come less than `apart_ns` after it are lost.
        """
        if self.least_ns >= lost_ns:
            return self
        most = None if self.most_ns is None else self.most_ns + lost_ns
        return Distance(picked("max", self.least_ns, apart_ns), most)


def dispatch_gap_ns(space: Space, number: int, view: View) -> Exact:
    """The longest time between two dispatches of a component, in ns; `UNBOUNDED_NS` where nothing bounds it.

    A timer is released once in each period, unless it skips a release (one that waits for all inputs goes on at the
    first release after they have come), and what comes from outside comes at its rate; what a job sends comes as much
    later as its processing and transmission may spread. Each way to be dispatched bounds the time by itself; a join of
    all needs the slowest.
    Messages that come while a job runs, sooner than a separation or sooner than a stated rate may be lost, which adds
    that time where messages can come so closely (docs/semantics.md, section 3.1).
    """
    return _recalled(_GAPS, space, number, view, _gap_ns)


_GAPS: Recall[Exact] = Recall()
_DELIVERIES: Recall[tuple[Exact, Exact]] = Recall()
_PROCESSING: Recall[tuple[Exact, Exact]] = Recall()


def _recalled(memory: Recall[T], space: Space, key: Any, view: View, formula: Callable[[Space, Any, View], T]) -> T:
    """The value of a formula, from memory where nothing waits: what waits consults all on a processor or bus."""
    if counts_responses(space) or counted_buses(space):
        return formula(space, key, view)
    return memory.recall(space, key, view, formula)


def _gap_ns(space: Space, number: int, view: View) -> Exact:
    return _as_bound(_distances(space, number, view)[number])


def message_gap_ns(space: Space, wire: int, view: View) -> Exact:
    """The longest time between two messages of a connection, in ns; `UNBOUNDED_NS` where nothing bounds it.

    Over the jobs of the sender's last piece, in this design.
    """
    source = space.connections[wire].source
    distances = {} if source is None else _distances(space, pieces_until(space, source)[0], view)
    return _as_bound(_deliveries(space, wire, distances, view))


def _as_bound(distance: Distance) -> Exact:
    gap = distance.most_ns
    return NO_BOUND if gap is None or gap >= UNBOUNDED_NS else gap


def _distances(space: Space, number: int, view: View) -> dict[int, Distance]:
    """The distance of the dispatches of a component and of each that dispatches it, also by way of others.

    In a cycle, which only a stated rate may break, nothing is known of a component until others bound it.
    """
    distances: dict[int, Distance] = {}
    todo, begun, in_cycles = [number], set[int](), False
    while todo:
        top = todo[-1]
        missing = [item for item in senders(space, top, view) if item not in distances] if top not in distances else []
        if top in distances:
            todo.pop()
        elif not missing or all(item in begun for item in missing):
            in_cycles |= bool(missing)
            distances[top] = _dispatches(space, top, distances, view)
            todo.pop()
        else:
            begun.add(top)
            todo += [item for item in missing if item not in begun]
    for _ in distances if in_cycles else ():
        for item in distances:
            distances[item] = _dispatches(space, item, distances, view)
    return distances


def senders(space: Space, number: int, view: View) -> list[int]:
    """The components whose jobs release a component, by index; of a thread with segments its first piece."""
    component = space.components[number]
    wires = component.triggers if passes_rates_on(component, view) else ()
    sources = [space.connections[wire].source for wire in wires]
    return [pieces_until(space, item)[0] for item in sources if item is not None]


def pieces_until(space: Space, number: int) -> tuple[int, ...]:
    """The pieces of a thread until the end of a component; that alone where it is none."""
    pieces = space.components[number].pieces
    return (number,) if pieces is None else pieces.members[: pieces.members.index(number) + 1]


def _dispatches(space: Space, number: int, distances: Mapping[int, Distance], view: View) -> Distance:
    """The distance of the dispatches of a component, from those of the components that dispatch it."""
    component = space.components[number]
    joins = is_joined(component, view)
    if not is_event_triggered(component, view):
        period: Exact = at(component.period_ns, view)
        if not joins:
            return Distance(period, period + skipped_ns(space, number, view))
        slowest = _together([_to_timer(space, wire, distances, view) for wire in component.triggers], joins=True)
        return Distance(period, None if slowest is None else slowest + period)
    ways = [_deliveries(space, wire, distances, view) for wire in component.triggers]
    arriving = Distance(ways[0].least_ns if len(ways) == 1 else 0, _together(ways, joins=joins))
    pieces = component.pieces.members if component.pieces is not None else (number,)
    _, busy = processing_ns(space, pieces, view)
    apart = at(component.period_ns, view) if arrivals(component, view).is_separated else 0
    return arriving._thinned(picked("max", busy, apart), apart)


def _together(ways: Sequence[Distance], *, joins: bool) -> Exact | None:
    """The longest time between two events that one message makes, or, where it `joins`, a message of each way."""
    bounds = [way.most_ns for way in ways if way.most_ns is not None]
    if not bounds or (joins and len(bounds) < len(ways)):
        return None
    return reduce(partial(picked, "max" if joins else "min"), bounds)


def _to_timer(space: Space, wire: int, distances: Mapping[int, Distance], view: View) -> Distance:
    """The distance of what a hybrid thread's callback leaves for its timer."""
    number = space.connections[wire].target
    assert number is not None
    least, most = callback_ns(space, space.components[number], view)
    return _deliveries(space, wire, distances, view).later(most - least)


def _deliveries(space: Space, wire: int, distances: Mapping[int, Distance], view: View) -> Distance:
    """The distance of the messages of a connection."""
    connection = space.connections[wire]
    least, most = _recalled(_DELIVERIES, space, wire, view, delivery_ns)
    apart: Exact = 0
    if connection.states_rate or connection.source is None:
        rate = rate_hz(space, ("delivery", wire), view)
        if not rate:
            return Distance(0, None)
        apart = -(-NS_PER_S // rate)
    if connection.source is None:
        return Distance(apart, apart).later(most - least)
    pieces = pieces_until(space, connection.source)
    shortest, longest = processing_ns(space, pieces, view)
    sent = distances.get(pieces[0], Distance(0, None)).later(longest - shortest)
    return sent._thinned(apart, apart).later(most - least)


def processing_ns(space: Space, pieces: Sequence[int], view: View) -> tuple[Exact, Exact]:
    """The shortest and longest processing of pieces of a thread together, in ns, as flows count it.

    A pair, summed over the pieces.
    """
    return _recalled(_PROCESSING, space, tuple(pieces), view, _processing_ns)


def _processing_ns(space: Space, pieces: Sequence[int], view: View) -> tuple[Exact, Exact]:
    rows = [processing_row(space, space.components[item], view) for item in pieces]
    return sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)
