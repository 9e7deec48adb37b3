"""The tasks of a thread: what a job of each takes by itself, and what they use of a core.

A hybrid thread is two tasks of one priority, its callback before its timer.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from dse.analysis.rates import NS_PER_S, RateKey, rate_hz
from dse.analysis.scheduling.busy_window import Part, TaskKey
from dse.analysis.views import View
from dse.space.model.space import Component, Space
from dse.space.model.trees import at, leaves


def longest_alone_ns(space: Space, component: int, part: Part, view: View) -> int:
    """The longest time of one job that nothing delays: no response time is shorter."""
    return alone_ns(space.components[component], part, view)[1]


def shortest_alone_ns(space: Space, component: int, part: Part, view: View) -> int:
    """The shortest time of one job."""
    return alone_ns(space.components[component], part, view)[0]


def work_ns(space: Space, number: int, view: View) -> int:
    """The longest time of one job of a thread (not its callback); 0 where it executes nothing."""
    executes = at(space.components[number].execution_ns, view) is not None
    return longest_alone_ns(space, number, "thread", view) if executes else 0


def alone_ns(component: Component, part: Part, view: View) -> tuple[int, int]:
    """Best and worst time of one job that nothing delays."""
    trees = (component.callback_ns,) if part == "callback" else (component.execution_ns, component.latency_ns)
    for tree in trees:
        given = at(tree, view)
        if given is not None:
            return given[0], given[1]
    stated = at(component.response_ns, view) if part == "thread" else None
    return (0, 0) if stated is None else (stated[0], stated[1])


def members(space: Space, processor: int, view: View) -> list[int]:
    """The threads on a processor, by number."""
    return [
        number
        for number, component in enumerate(space.components)
        if component.processor is not None and at(component.processor, view) == processor
    ]


def task_keys(space: Space, number: int, view: View) -> Iterator[TaskKey]:
    """The tasks of a thread: its callback first."""
    component = space.components[number]
    if at(component.protocol, view) == "hybrid" and at(component.callback_ns, view) is not None:
        yield number, "callback"
    if at(component.execution_ns, view) is not None:
        yield number, "thread"


def utilisation(space: Space, number: int, view: View) -> Fraction:
    """The share of one core that a thread uses, callback and timer together."""
    share = Fraction(0)
    for _, part in task_keys(space, number, view):
        key: RateKey = ("input", number) if part == "callback" else ("activation", number)
        share += alone_ns(space.components[number], part, view)[1] * rate_hz(space, key, view) / NS_PER_S
    return share


def task_name(component: Component, part: Part) -> str:
    """The name of a task: that of its thread, with ``(callback)`` where it is a callback."""
    return component.name if part == "thread" else f"{component.name} (callback)"


def elapsed_ns(space: Space, number: int, view: View) -> tuple[int, int]:
    """The shortest and longest time of a thread's job until the end of a component, all its pieces so far."""
    times = [alone_ns(item, "thread", view) for item in _so_far(space, number)]
    return sum(least for least, _ in times), sum(most for _, most in times)


def always_executes(space: Space, number: int) -> bool:
    """Whether a thread executes something in every design, until the end of a component in each piece."""
    return all(leaf is not None for item in _so_far(space, number) for leaf in leaves(item.execution_ns))


def _so_far(space: Space, number: int) -> list[Component]:
    """A component, and the pieces of its thread before it."""
    pieces = space.components[number].pieces
    members = (number,) if pieces is None else pieces.members[: pieces.members.index(number) + 1]
    return [space.components[item] for item in members]
