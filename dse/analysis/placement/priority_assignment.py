"""The best order of threads that share a core: N. C. Audsley's test, from the lowest priority up.

"On priority assignment in fixed priority scheduling", Information Processing Letters 79(1), 2001: if some thread is in
time with the lowest priority whatever the order of the others, there is an order in which all are in time if and only
if there is one in which it is the lowest. That holds wherever the response time of a thread depends on which threads
go first and which do not, but not on their order, and is no longer with a higher priority: with given release jitter,
and with non-preemptive sections (a thread that goes first takes at least as long as a section of it). As many threads
as are in time with the lowest priority may share it, which takes the fewest levels.

Of several threads that may be lowest the one with the latest limit is. So the order is by deadline wherever that one
will do, as it does whenever any order does of threads without jitter and sections whose deadlines are no longer than
their periods (J. Y.-T. Leung and J. Whitehead, Performance Evaluation 2(4), 1982).
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

from dse.analysis.limits import HOLDS, Limit
from dse.analysis.placement.first_fit import core_of_each
from dse.analysis.scheduling.model import Ends
from dse.analysis.scheduling.priorities import most_levels, number_of
from dse.analysis.scheduling.responses import counted_ns, is_released_alone, response_among
from dse.analysis.views import View
from dse.space.model.space import Design, OpenPriority, Space

Latest = Mapping[int, Sequence[tuple[str, Fraction]]]
"""For each thread its limits in ns, each with its operator."""


@dataclass(frozen=True)
class _Core:
    """Threads that share a core, of which those in `free` (by number) may take any of their numbers."""

    space: Space
    group: tuple[int, ...]
    free: Mapping[int, OpenPriority]
    latest: Latest
    design: Sequence[int]
    known: Ends

    def in_time(self, number: int, options: Mapping[int, int]) -> bool:
        """Whether a thread meets its limits where the free ones have these options."""
        limits = self.latest.get(number, ())
        if not limits:
            return True
        chosen = {self.free[item].index: option for item, option in options.items()}
        view = View(ChainMap(chosen, cast(Any, self.design)))  # copies nothing: a design may note what is looked at
        response = Fraction(counted_ns(response_among(self.space, self.group, number, view, self.known)))
        return all(HOLDS[operator](response, bound) for operator, bound in limits)

    def turn(self, number: int) -> tuple[Fraction, int]:
        """What comes later is tried as the lowest before."""
        bounds = [bound for _, bound in self.latest.get(number, ())]
        return (min(bounds) if bounds else Fraction(10**18)), number

    def are_in_time(self, options: Mapping[int, int]) -> bool:
        """Whether all threads are."""
        return all(self.in_time(number, options) for number in self.group)


def limits_of(limits: Sequence[Limit], view: View) -> Latest:
    """The upper limits on response times in a design, by thread.

    Component indices to pairs of an operator and a limit in ns.
    """
    by_thread: dict[int, list[tuple[str, Fraction]]] = {}
    for limit in limits:
        number = limit.requirement.metric.index or 0
        by_thread.setdefault(number, []).append((limit.requirement.operator, limit.bound(view)))
    return by_thread


def best_options(
    space: Space,
    group: Sequence[int],
    free: Mapping[int, OpenPriority],
    latest: Latest,
    design: Sequence[int],
    known: Ends | None = None,
) -> dict[int, int] | None:
    """Options of the priorities of threads that share a core, by thread, with which all meet their limits.

    None where there are none, the response times of what releases them being as `known`: else at their shortest, so
    that none with these, and none with any further threads on the core, are to be found.
    """
    core = _Core(space, tuple(group), {item: free[item] for item in group if item in free}, latest, design, known or {})
    if not core.free:
        return {} if core.are_in_time({}) else None
    simple = _by_limit(core)
    if simple is not None and core.are_in_time(simple):
        return simple
    options = _from_the_lowest(core)
    return options if options is not None and core.are_in_time(options) else None


def is_decisive(space: Space, group: Sequence[int], free: Mapping[int, OpenPriority], view: View) -> bool:
    """Whether no order is in time where none is found: not where levels are few and some threads have numbers.

    Audsley's algorithm is optimal for distinct priorities; with few levels or stated numbers it may miss an order.
    """
    return most_levels(space, group, view) is None or all(number in free for number in group)


def _by_limit(core: _Core) -> dict[int, int] | None:
    """The free threads by their limits, each with a number of its own; None where numbers do not suffice."""
    if len(core.free) < len(core.group):
        return None
    order = sorted(core.free, key=core.turn, reverse=True)
    levels = most_levels(core.space, core.group, View(core.design))
    if levels is not None and levels < len(order):
        return None
    if any(len(core.free[number].decision.values) <= position for position, number in enumerate(order)):
        return None
    return {number: position for position, number in enumerate(order)}


def _from_the_lowest(core: _Core) -> dict[int, int] | None:
    view = View(core.design)
    stated = {number_of(core.space.components[item], view) for item in core.group if item not in core.free} - {None}
    levels = most_levels(core.space, core.group, view)
    numbers = sorted({value for item in core.free.values() for value in item.decision.values})
    made: dict[int, int] = {}
    used = set(stated)
    for position, value in enumerate(numbers):
        left = [number for number in core.free if number not in made]
        if not left:
            break
        room = len(numbers) - position
        if levels is not None:
            room = min(room, levels - len(used - {value}))
        lowest = list(_lowest(core, made, left, value, first_only=room >= len(left)))
        made |= lowest
        used |= {value} if lowest else set()
    return made if len(made) == len(core.free) else None


def _lowest(
    core: _Core, made: Mapping[int, int], left: Sequence[int], value: int, *, first_only: bool
) -> Iterator[tuple[int, int]]:
    """Threads that may have `value` as their priority where all that are left go first; one where that is enough."""
    above = {number: len(core.free[number].decision.values) - 1 for number in left}
    for number in sorted(left, key=core.turn, reverse=True):
        values = core.free[number].decision.values
        if value not in values:
            continue
        option = values.index(value)
        if core.in_time(number, {**above, **made, number: option}):
            yield number, option
            if first_only:
                return


def with_best_order(
    space: Space, design: Design, free: Sequence[OpenPriority], limits: Sequence[Limit]
) -> Iterator[Design]:
    """The design with priorities for the threads of `free` with which they meet their limits, as far as found.

    Where threads release each other several assumptions are tried on how long they take: judge what comes of it.
    """
    view = View(design)
    latest = limits_of(limits, view)
    by_number = {item.component: item for item in free}
    bounds: Ends = {(number, "thread"): int(min(bound for _, bound in items)) for number, items in latest.items()}
    ways: list[Ends] = [{}]
    if not all(is_released_alone(space, number, view) for number in by_number):
        ways = [bounds, {}]
    seen: set[Design] = set()
    for known in ways:
        chosen = list(design)
        for group in groups_of(space, view):
            here = [number for number in group if number in by_number]
            options = best_options(space, group, by_number, latest, design, known) if here else {}
            if options is None:
                options = _by_turn(by_number, here, latest)
            for number, option in options.items():
                chosen[by_number[number].index] = option
        if tuple(chosen) not in seen:
            seen.add(tuple(chosen))
            yield tuple(chosen)


def _by_turn(free: Mapping[int, OpenPriority], here: Sequence[int], latest: Latest) -> dict[int, int]:
    """Threads by their limits, where no order has all in time."""
    order = sorted(here, key=lambda item: (min((bound for _, bound in latest.get(item, ())), default=10**18), item))
    return {
        number: min(position, len(free[number].decision.values) - 1) for position, number in enumerate(reversed(order))
    }


def groups_of(space: Space, view: View) -> list[list[int]]:
    """The threads of each core of each processor.

    Lists of component indices; each group is ordered by itself.
    """
    groups: dict[tuple[int, int], list[int]] = {}
    for processor in range(len(space.processors)):
        for number, core in core_of_each(space, processor, view).items():
            groups.setdefault((processor, core), []).append(number)
    return list(groups.values())
