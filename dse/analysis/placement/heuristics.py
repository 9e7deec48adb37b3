"""Where threads whose core is open may run in a design that is made otherwise: quick ways, tried one after the other.

No way is sure to find a core for each thread where there is one: the search's model is
(`dse.encode.scheduling.schedulability`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import chain
from typing import TypeAlias

from dse.analysis.limits import Limit, build_limit, judge
from dse.analysis.placement.admission import Admission
from dse.analysis.placement.bin_packing import Room
from dse.analysis.placement.first_fit import core_of_each, even_core_of_each
from dse.analysis.placement.priority_assignment import limits_of, with_best_order
from dse.analysis.scheduling.tasks import members, utilisation
from dse.analysis.views import View
from dse.space.model.space import EMPTY, Design, OpenCore, OpenPriority, Space
from dse.space.model.trees import at
from dse.space.question.open_cores import without_cores

Fits: TypeAlias = Callable[[Sequence[int]], bool]
Order: TypeAlias = Callable[[Sequence[Fraction]], Sequence[int]]
NO_ROOMS: Mapping[int, Room] = {}


def core_limits(space: Space) -> list[Limit]:
    """The upper limits on response times that are asked for.

    `Limit` objects in the order of the question.
    """
    return [build_limit(space, item) for item in space.requirements if item.is_deadline]


def placed(space: Space, design: Design, waiting: Sequence[int]) -> Design:
    """The design, whole but for `waiting`, with cores for these: as first-fit gives them where limits are met so.

    Else the first of `placements` that meet them; where there are none, those of first-fit. Limits are those on
    response times, deadlines among them. So a design that leaves cores open is analysed on the cores on which fronts
    without contention are judged (docs/semantics.md, section 4.4). Where the best order is asked for, it is looked for
    on these cores.
    """
    open_ = [item for item in space.open_cores if item.index in set(waiting)]
    orders = [item for item in space.open_priorities if item.index in set(waiting)]
    limits = core_limits(space)
    beside = [build_limit(space, item) for item in space.requirements if item.metric.kind == "core utilisation"]
    whole = first_fit(space, design, open_)
    first: Design | None = None
    known = iter(()) if whole is None else ordered(space, whole, orders, limits)
    for candidate in chain(known, placements(space, design, open_, limits, orders)):
        first = first if first is not None else candidate
        view = View(candidate)
        if all(judge(limit, view).holds for limit in (*limits, *beside)):
            return candidate
    return first if first is not None else design


def first_fit(space: Space, design: Design, open_: Sequence[OpenCore]) -> Design | None:
    """The design with the cores that first-fit gives to the threads of `open_`; None where one may not run there.

    See `dse.analysis.placement.first_fit.core_of_each`.
    """
    return _with_cores(space, design, open_, core_of_each)


def evenly(space: Space, design: Design, open_: Sequence[OpenCore]) -> Design | None:
    """The design with the threads of `open_` spread over cores, the fullest used as little as is found soon.

    A whole design, or None where the core that was found is no option of a thread.
    """
    return _with_cores(space, design, open_, even_core_of_each)


def _with_cores(
    space: Space,
    design: Design,
    open_: Sequence[OpenCore],
    core_of_each: Callable[[Space, int, View], Mapping[int, int]],
) -> Design | None:
    """The design with the cores of which a rule says how the threads of a processor have them."""
    view, without = View(design), without_cores(space, open_)
    chosen = list(design)
    core_of: dict[int, int] = {}
    for processor, slot in enumerate(space.processors):
        if slot.types[view[slot.type_decision]] != EMPTY:
            core_of |= core_of_each(without, processor, View(design))
    for unit, item in by_unit(open_, space, view).items():
        core = core_of.get(unit)
        if core is None:
            continue
        if core not in item.decision.values:
            return None
        chosen[item.index] = item.decision.values.index(core)
    return tuple(chosen)


def ordered(space: Space, design: Design, orders: Sequence[OpenPriority], limits: Sequence[Limit]) -> Iterator[Design]:
    """The design, with priorities for the threads that ask for the best order.

    One design for each order that is proposed; the design itself where no priority is open.
    """
    return with_best_order(space, design, orders, limits) if orders else iter((design,))


def placements(
    space: Space,
    design: Design,
    open_: Sequence[OpenCore],
    limits: Sequence[Limit],
    orders: Sequence[OpenPriority] = (),
    beside: Sequence[Limit] = (),
) -> Iterator[Design]:
    """The design with other cores for the threads of `open_`, and other priorities for those of `orders`.

    First each thread, those that use most first, on the core that is used least; then on the least used, the first and
    the most used core where it and the threads there meet their limits as far as these depend on that core. Where
    there are limits on cores (`beside`), then as first-fit has them, and in the latter three ways within these limits.
    """
    view = View(design)
    latest = limits_of(limits, view)
    seen = set()
    if orders:
        yield from ordered(space, design, orders, limits)
    for candidate in _elsewhere(space, view, open_, Admission(space, view, latest, orders), beside) if open_ else ():
        if candidate is not None and candidate not in seen:
            seen.add(candidate)
            yield from ordered(space, candidate, orders, limits)


def _elsewhere(
    space: Space, view: View, open_: Sequence[OpenCore], meets: Fits, beside: Sequence[Limit]
) -> Iterator[Design | None]:
    """The design with other cores, one way after the other; None where a way finds none."""
    for fits, order in _ways(meets):
        yield _place(space, view, open_, fits, order)
    rooms = _rooms(beside)
    if rooms:
        yield first_fit(space, tuple(view.design), open_)
        for fits, order in tuple(_ways(meets))[1:]:
            yield _place(space, view, open_, fits, order, rooms)


def _rooms(beside: Sequence[Limit]) -> dict[int, Room]:
    """What limits on cores leave of each core of a processor."""
    room_of: dict[int, Room] = {}
    for limit in beside:
        if limit.cores is not None:
            processor, room = limit.cores.processor, limit.cores.room
            room_of[processor] = min(
                room_of.get(processor, room), room, key=lambda item: (item.share, not item.is_strict)
            )
    return room_of


def _ways(meets: Fits) -> Iterator[tuple[Fits, Order]]:
    """Ways to choose a core: which sets of threads a core may have, and which cores to try first."""

    def least_used(loads: Sequence[Fraction]) -> Sequence[int]:
        return sorted(range(len(loads)), key=lambda core: (loads[core], core))

    yield (lambda numbers: True), least_used
    yield meets, least_used
    yield meets, lambda loads: range(len(loads))
    yield meets, lambda loads: sorted(range(len(loads)), key=lambda core: (-loads[core], core))


def _place(
    space: Space,
    view: View,
    open_: Sequence[OpenCore],
    fits: Fits,
    order: Order,
    rooms: Mapping[int, Room] = NO_ROOMS,
) -> Design | None:
    """The design with a core for each thread; None where a thread fits nowhere.

    `rooms` are the capacities of the cores of a processor that is limited, by its number.
    """
    chosen = list(view.design)
    by_number = by_unit(open_, space, view)
    for processor, slot in enumerate(space.processors):
        count, room = max(1, at(slot.cores, view)), rooms.get(processor)
        here: dict[int, Fraction] = {}
        for number in members(space, processor, view):
            unit = space.unit(number, view)
            here[unit] = here.get(unit, Fraction(0)) + utilisation(space, number, view)
        cores: list[list[int]] = [[] for _ in range(count)]
        loads = [Fraction(0)] * count
        for number in here.keys() - by_number.keys():
            core = at(space.components[number].core, view)
            if core is not None and core <= count:
                cores[core - 1] += space.together(number, view)
                loads[core - 1] += here[number]
        for number in sorted(here.keys() & by_number.keys(), key=lambda item: (-here[item], item)):
            decision = by_number[number].decision
            allowed = {value - 1: option for option, value in enumerate(decision.values) if value <= count}
            threads, share = space.together(number, view), here[number]
            able = [
                core for core in order(loads) if core in allowed and (room is None or room.fits(loads[core] + share))
            ]
            core = next((core for core in able if fits([*cores[core], *threads])), None)
            if core is None:
                return None
            cores[core] += threads
            loads[core] += here[number]
            chosen[by_number[number].index] = allowed[core]
    return _relabelled(space, view, tuple(chosen), open_)


def by_unit(open_: Sequence[OpenCore], space: Space, view: View) -> dict[int, OpenCore]:
    """Open cores by the first thread that has each in a design; those that none has are left out.

    Component indices to open cores, for the executors, reservations and threads of this design.
    """
    units: dict[int, OpenCore] = {}
    for item in open_:
        first = next((one for one in item.threads if _owner(space, one, view) == item.decision.component), None)
        if first is not None:
            units[first] = item
    return units


def _owner(space: Space, number: int, view: View) -> str:
    return space.core_owner(space.components[number], view)


def _relabelled(space: Space, view: View, design: Design, open_: Sequence[OpenCore]) -> Design:
    """The design with the cores of each processor numbered in the order of their first threads, where none is named."""
    result = list(design)
    named = {number for item in open_ for number in item.threads}
    for processor, slot in enumerate(space.processors):
        count = max(1, at(slot.cores, view))
        here = [item for item in open_ if at(space.components[item.component].processor, view) == processor]
        others = set(members(space, processor, view)) - named
        whole = all(item.decision.values[:count] == tuple(range(1, count + 1)) for item in here)
        if count < 2 or not whole or any(at(space.components[item].core, view) is not None for item in others):
            continue
        labels: dict[int, int] = {}
        for item in (one for one in here if design[one.index] >= 0):  # others are of executors that nobody is in
            result[item.index] = labels.setdefault(design[item.index], len(labels))
    return tuple(result)
