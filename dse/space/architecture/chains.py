"""Chains in flows: threads of which each may be released by the end of the one before, at once and on one core.

Where a design lets them, such threads have one busy window (docs/semantics.md, section 4.9).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from dse.space.architecture.activation import may_be_event_triggered
from dse.space.model.flows import Step
from dse.space.model.space import Component, Connection, Space
from dse.space.model.trees import leaves


def follows(components: Sequence[Component], connections: Sequence[Connection], number: int) -> int | None:
    """The only component whose end may release a component in some design, by number; None where there is none."""
    component = components[number]
    if len(component.triggers) != 1 or not may_be_event_triggered(component):
        return None
    if set(leaves(component.protocol)) == {"sporadic"}:  # which holds jobs back
        return None
    connection = connections[component.triggers[0]]
    return connection.sender if connection.sender != number else None


def chained_to(components: Sequence[Component], connections: Sequence[Connection], number: int) -> int | None:
    """The thread whose end may release a thread on the same core in some design, by number; None where none may.

    Judged by what the file offers: one trigger, a common processor, and no reservation, segment or stated response time
    that keeps them apart in every design.
    """
    found = follows(components, connections, number)
    if found is None or not _may_be_chained(components[number]) or not _may_be_chained(components[found]):
        return None
    if set(leaves(components[found].communication)) == {"let"}:
        return None
    shared = (set(leaves(components[number].processor)) & set(leaves(components[found].processor))) - {None}
    return found if shared else None


def stated_place(space: Space, number: int) -> tuple[int, int, int] | None:
    """The processor, core (from 1) and priority of a thread that only its priority schedules, where all are stated.

    None where one of them is a decision, follows from something else, or is limited by the operating system.
    """
    component = space.components[number]
    if not _may_be_chained(component) or set(leaves(component.executor)) != {None} or component.callback_ns is not None:
        return None
    processors, cores = set(leaves(component.processor)), set(leaves(component.core))
    priorities = set(leaves(component.priority))
    if len(processors) != 1 or len(cores) != 1 or len(priorities) != 1:
        return None
    (processor,), (core,), (priority,) = processors, cores, priorities
    if processor is None or not isinstance(priority, int):
        return None
    if set(leaves(space.processors[processor].priority_levels)) != {None}:
        return None
    if core is None:
        if set(leaves(space.processors[processor].cores)) != {1}:
            return None
        core = 1
    return processor, core, priority


def before_on_core(space: Space, number: int) -> list[int]:
    """The threads before one in its chain in some design that are on its stated core, by number, the nearest first.

    Each with a stated priority, as it has itself.
    """
    place = stated_place(space, number)
    if place is None:
        return []
    others = ((before, stated_place(space, before)) for before in before_in_chain(space, number))
    return [before for before, other in others if other is not None and other[:2] == place[:2]]


def may_come_seldom(space: Space, number: int, others: Iterable[int]) -> bool:
    """Whether a thread comes a few times at most in busy windows of the priority of some threads, in some design.

    A less urgent thread of its core comes before it in its chain (docs/semantics.md, section 4.9).
    """
    before = before_on_core(space, number)
    priorities = [place[2] for item in others if before and (place := stated_place(space, item)) is not None]
    lowest = (place[2] for item in before if (place := stated_place(space, item)) is not None)
    return bool(priorities) and min(lowest) < max(priorities)


def _may_be_chained(component: Component) -> bool:
    """Whether a component may be a whole thread, in an executor or not, and executes in every design."""
    if component.processor is None or component.pieces is not None or component.reservation is not None:
        return False
    executes = all(leaf is not None for leaf in leaves(component.execution_ns))
    return executes and component.response_ns is None


def way_up(space: Space, number: int) -> tuple[int, ...]:
    """The threads that may be one chain up to a thread in some design: the first of them first, itself last."""
    found = [number]
    while (before := chained_to(space.components, space.connections, found[0])) is not None and before not in found:
        found.insert(0, before)
    return tuple(found)


def may_succeed(space: Space, one: int, other: int) -> bool:
    """Whether in some design one of two components comes before the other in a chain, on whatever cores.

    Then a job of one need not wait for the other, however urgent that is (docs/semantics.md, section 4.9).
    """
    return bool(successors(space, one, other))


def successors(space: Space, one: int, other: int) -> tuple[int, ...]:
    """The threads behind the first of two components up to the other one, where these are in a chain in some design.

    Numbers, without that first one; none where neither may come before the other.
    """
    for first, last in ((one, other), (other, one)):
        before = before_in_chain(space, last)
        if first in before:
            return (last, *before[: before.index(first)])
    return ()


def before_in_chain(space: Space, number: int) -> list[int]:
    """The components that may come before one in its chain in some design, by number, the nearest first."""
    found = {number: None}
    before = follows(space.components, space.connections, number)
    while before is not None and before not in found:
        found[before] = None
        before = follows(space.components, space.connections, before)
    return list(found)[1:]


def with_chains(
    components: Sequence[Component], connections: Sequence[Connection], steps: Sequence[Step]
) -> tuple[Step, ...]:
    """The steps of a flow, each thread with those in a row of the flow that may be one chain with it.

    With them is told whether the flow comes to them from their source. A thread of which the flow states figures of its
    own is in no chain. Nor is what comes before a thread that may join all its triggers, which waits for the other ones
    as long as response times, added up, differ. One alone is a chain where another component may release it and the
    flow comes from its source. A connection is told whether the flow comes to its sender from the source of its chain.
    """
    rows: list[list[int]] = []  # places of the steps of each chain
    sources: list[bool] = []
    previous, has_source = None, False
    last_join = max((place for place, step in enumerate(steps) if step.before), default=-1)
    found = list(steps)
    for place, step in enumerate(steps):
        if step.kind == "connection":
            found[place] = replace(step, has_source=has_source)
            continue
        row = rows[-1] if rows else []
        if step.figures is not None or place < last_join or any(steps[item].index == step.index for item in row):
            rows.append([])
            sources.append(False)
            has_source = False
            continue
        before = follows(components, connections, step.index)
        is_released = before is not None and before == previous and step.via == components[step.index].triggers[0]
        has_source = before is None or (is_released and has_source)
        if row and is_released and chained_to(components, connections, step.index) is not None:
            row.append(place)
        else:
            rows.append([place])
            sources.append(has_source)
        previous = step.index
    for row, from_source in zip(rows, sources, strict=True):
        threads = tuple(steps[place].index for place in row)
        if len(row) > 1 or (from_source and row and _may_lag(components, connections, threads[0])):
            for place in row:
                found[place] = replace(steps[place], chain=threads, has_source=from_source)
    return tuple(found)


def _may_lag(components: Sequence[Component], connections: Sequence[Connection], number: int) -> bool:
    """Whether a thread alone may end sooner after its source's latest release than after its own."""
    is_released = follows(components, connections, number) is not None
    return is_released and _may_be_chained(components[number]) and None in leaves(components[number].executor)
