"""Which threads of a core go first: numbers, then a time that orders the others, within the levels that there are.

A thread with a number goes before those without (a larger number is more urgent; the same number is the same level).
The others are ordered by a time of their own, the shorter first: `rate_monotonic` by the mean time between two jobs
(C. L. Liu and J. W. Layland, "Scheduling algorithms for multiprogramming in a hard-real-time environment", Journal of
the ACM 20(1), 1973), `deadline_monotonic` by the deadline (J. Y.-T. Leung and J. Whitehead, "On the complexity of
fixed-priority scheduling of periodic, real-time tasks", Performance Evaluation 2(4), 1982); the order of the file
breaks ties. An operating system with fewer levels than that takes has the last one for all that is left.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.rates import NS_PER_S, rate_hz
from dse.analysis.views import View
from dse.space.model.space import Component, Space
from dse.space.model.trees import at

DEADLINE_MONOTONIC = "deadline_monotonic"


def deadline_ns(component: Component, view: View) -> int | None:
    """The stated deadline, else the period (or minimum separation), else None.

    In ns, as the design has it.
    """
    stated = at(component.deadline_ns, view)
    found: int | None = at(component.period_ns, view) if stated is None else stated
    return found


def number_of(component: Component, view: View) -> int | None:
    """The stated or chosen priority; None where a rule orders the thread.

    A larger number is more urgent.
    """
    found = at(component.priority, view)
    return found if isinstance(found, int) else None


def order_ns(space: Space, number: int, view: View) -> Fraction | None:
    """The time that orders a thread without a priority of its own, the shorter first; None behind all others.

    In ns, exact: the mean time between jobs, or the deadline under `deadline_monotonic`.
    """
    component = space.components[number]
    if at(component.priority, view) == DEADLINE_MONOTONIC:
        deadline = deadline_ns(component, view)
        if deadline is not None:
            return Fraction(0) + deadline
    rate = rate_hz(space, ("activation", number), view)
    return NS_PER_S / rate if rate else None


def levels_of(space: Space, numbers: Sequence[int], view: View) -> list[list[int]]:
    """The threads of one core by level, the most urgent first; those of one level may all delay each other.

    The first thread of an executor stands for it: with its number, else as often as its fastest thread runs; that of a
    reservation with its number, else its period.
    """
    units = list(dict.fromkeys(space.unit(number, view) for number in numbers))
    levels = _ordered({unit: _turn_of(space, unit, view) for unit in units})
    most = most_levels(space, numbers, view)
    if most is None or len(levels) <= most:
        return levels
    return [*levels[: most - 1], sorted(number for level in levels[most - 1 :] for number in level)]


def reserved_levels(space: Space, numbers: Sequence[int], view: View) -> list[list[int]]:
    """The threads of one reservation by level, the most urgent first; the first of an executor stands for it.

    Lists of component indices; threads of one level count in each other's interference.
    """
    firsts = dict.fromkeys(space.os_thread(number, view)[0] for number in numbers)
    return _ordered({first: _thread_turn(space, first, view) for first in firsts})


def inner_levels(space: Space, numbers: Sequence[int], view: View) -> list[list[int]]:
    """The threads of one executor by level, the most urgent first.

    Lists of component indices; threads of one level count in each other's interference.
    """
    return _ordered({number: _own_turn(space, number, view) for number in numbers})


Turn: TypeAlias = int | Fraction | None
"""A number, the time that orders what has none, or None behind all others."""


def _own_turn(space: Space, number: int, view: View) -> Turn:
    priority = number_of(space.components[number], view)
    return order_ns(space, number, view) if priority is None else priority


def _turn_of(space: Space, unit: int, view: View) -> Turn:
    number = space.components[unit].reservation
    if number is None:
        return _thread_turn(space, unit, view)
    reservation = space.reservations[number]
    priority: int | None = at(reservation.priority, view)
    return Fraction(at(reservation.period_ns, view)) if priority is None else priority


def _thread_turn(space: Space, unit: int, view: View) -> Turn:
    """The turn of an OS thread."""
    executor = at(space.components[unit].executor, view)
    if executor is None:
        return _own_turn(space, unit, view)
    priority: int | None = at(space.executors[executor].priority, view)
    if priority is not None:
        return priority
    # of all of its threads, whoever is looked at: what is learnt of some of them then holds of all
    rate = max(rate_hz(space, ("activation", number), view) for number in space.in_executor(executor, view))
    return NS_PER_S / rate if rate else None


def _ordered(turns: Mapping[int, Turn]) -> list[list[int]]:
    numbers = {unit: turn for unit, turn in turns.items() if isinstance(turn, int)}
    levels = [
        [unit for unit, turn in numbers.items() if turn == level]
        for level in sorted(set(numbers.values()), reverse=True)
    ]
    timed = [(turn, unit) for unit, turn in turns.items() if turn is not None and unit not in numbers]
    levels += ([unit] for _, unit in sorted(timed))
    return levels + [[unit] for unit, turn in turns.items() if turn is None]


def most_levels(space: Space, numbers: Sequence[int], view: View) -> int | None:
    """The number of priority levels of the processor of these threads; None where it is not stated.

    Threads beyond that number share the last level.
    """
    processor = at(space.components[numbers[0]].processor, view) if numbers else None
    if processor is None:
        return None
    found: int | None = at(space.processors[processor].priority_levels, view)
    return found
