"""What releases the tasks of a design: streams of jobs, with the jitter that is known so far.

Event-triggered threads inherit the streams of what triggers them, later by the jitter of processing and transmission
(`dse.analysis.scheduling.holistic`). A thread with segments is one thread: where a job of it is late without a bound,
so is the first piece of the next one, and any number of these may follow each other closely (docs/semantics.md, section
4.7).
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.binding import transmission_ns
from dse.analysis.rates import NS_PER_S, arrivals, is_event_triggered, rate_hz
from dse.analysis.scheduling.overheads import switching_ns
from dse.analysis.scheduling.response_time import Stream, Task
from dse.analysis.scheduling.servers.segments import elapsed_ns
from dse.analysis.scheduling.tasks import Part, TaskKey, alone_ns, task_name
from dse.analysis.views import CyclicActivation, View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import Exact

Streams: TypeAlias = tuple[Stream, ...] | None


def has_no_bound(space: Space, number: int, known: Mapping[TaskKey, Exact | None]) -> bool:
    """Whether a component is a piece of a thread without a bound: its jobs follow each other as closely as they may."""
    pieces = space.components[number].pieces
    return pieces is not None and known.get((pieces.members[-1], "thread"), 0) is None


def is_lone(space: Space, key: TaskKey, view: View) -> bool:
    """Whether a task's releases depend on no other task."""
    number, part = key
    return part == "thread" and not is_event_triggered(space.components[number], view)


def task_of(space: Space, key: TaskKey, known: Mapping[TaskKey, Exact | None], view: View) -> Task | None:
    """The task with the streams that release it; None when their jitter has no bound."""
    return late_task(space, key, view) if has_no_bound(space, key[0], known) else bounded_task(space, key, known, view)


def late_task(space: Space, key: TaskKey, view: View) -> Task | None:
    """A task whose releases may be late without a bound: None, but for one that takes no time, which delays nothing."""
    job = job_of(space, key, (), None, view)
    return None if job.worst_ns else job


def bounded_task(space: Space, key: TaskKey, known: Mapping[TaskKey, Exact | None], view: View) -> Task | None:
    """The same of a piece as if its thread had a bound."""
    number, part = key
    component = space.components[number]
    streams = releases_of(space, number, part, known, view)
    if streams is None:
        return late_task(space, key, view)
    separated = part == "thread" and arrivals(component, view).is_separated
    return job_of(space, key, streams, at(component.period_ns, view) if separated else None, view)


def job_of(space: Space, key: TaskKey, streams: tuple[Stream, ...], separation_ns: int | None, view: View) -> Task:
    """The task with these streams, of its longest time with what it costs to switch to it and back."""
    component = space.components[key[0]]
    worst = alone_ns(component, key[1], view)[1] + switching_ns(space, key[0], view)
    return Task(task_name(component, key[1]), worst, streams, separation_ns)


def releases_of(
    space: Space,
    number: int,
    part: Part,
    known: Mapping[TaskKey, Exact | None],
    view: View,
    after: tuple[int, ...] = (),
) -> Streams:
    """The streams that release a thread or a callback; None when their jitter has no bound.

    `after` are the components further down, which are asked about because this one is before them.

    Raises
    ------
    CyclicActivation
        when event-triggered components dispatch each other in a cycle.
    """
    component = space.components[number]
    if part == "thread" and not is_event_triggered(component, view):
        return (Stream(at(component.period_ns, view)),)
    if number in after:
        raise CyclicActivation
    is_timed = part == "thread" and arrivals(component, view).by_timer
    streams: list[Stream] = [Stream(at(component.period_ns, view))] if is_timed else []
    for wire in component.triggers:
        found = _deliveries(space, wire, known, view, (*after, number))
        if found is None:
            return None
        streams += found
    return tuple(streams)


def thread_releases(
    space: Space, first: int, known: Mapping[TaskKey, Exact | None], view: View
) -> tuple[Streams, int | None]:
    """What releases a thread, of one with segments its first piece, and the least time between two releases."""
    component = space.components[first]
    separation = at(component.period_ns, view) if at(component.protocol, view) == "sporadic" else None
    return releases_of(space, first, "thread", known, view), separation


def _deliveries(
    space: Space, wire: int, known: Mapping[TaskKey, Exact | None], view: View, after: tuple[int, ...]
) -> Streams:
    """What a connection delivers: what its sender releases, later by the jitter of processing and transmission."""
    connection = space.connections[wire]
    least, most, _ = transmission_ns(space, connection, view)
    if connection.sender is None:
        rate = rate_hz(space, ("delivery", wire), view)
        period = NS_PER_S // rate if rate else 0
        return (Stream(max(1, period), most - least),) if rate else ()
    leaving = _leaving(space, connection.sender, known, view, after)
    return None if leaving is None else tuple(Stream(item.period_ns, item.jitter_ns + most - least) for item in leaving)


def _leaving(
    space: Space, number: int, known: Mapping[TaskKey, Exact | None], view: View, after: tuple[int, ...]
) -> Streams:
    pieces = space.components[number].pieces
    first = number if pieces is None else pieces.members[0]
    component = space.components[first]
    released = releases_of(space, first, "thread", known, view, after)
    best, worst = elapsed_ns(space, number, view)
    response = known.get((number, "thread"), worst)
    if released is None or response is None:
        return None
    if arrivals(component, view).is_separated:
        # holding back what comes early keeps the bound of the streams (Le Boudec and Thiran, "Network Calculus", 1.5:
        # shaping keeps arrival constraints); of this and the separation, the one with the lower rate goes on
        separation = at(component.period_ns, view)
        if sum((Fraction(1) / item.period_ns for item in released), Fraction(0)) * separation >= 1:
            released = (Stream(separation),)
    return tuple(Stream(item.period_ns, item.jitter_ns + max(response, worst) - best) for item in released)
