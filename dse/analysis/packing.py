"""Where threads whose core is open may run in a design that is made otherwise: quick ways, tried one after the other.

No way is sure to find a core for each thread where there is one: the search's model is (`dse.encode.schedulability`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import chain
from typing import TypeAlias

from dse.analysis.audsley import Latest, best_options, limits_of, with_best_order
from dse.analysis.limits import HOLDS, Limit, build_limit, judge, on_processor, thread_values
from dse.analysis.partition import Room
from dse.analysis.placement import core_of_each
from dse.analysis.scheduling import counted_ns, subset_responses
from dse.analysis.tasks import members, utilisation
from dse.analysis.views import View
from dse.space.cores import without_cores
from dse.space.trees import at, consulted
from dse.space.types import EMPTY, Design, OpenCore, OpenPriority, Space

Fits: TypeAlias = Callable[[Sequence[int]], bool]
MOST_STEPS = 500
"""So often a thread is put on a core in the search for the first cores."""
MOST_ENDS = 4
"""So often such a search may reach the last thread only to find that some response time is too long."""
Order: TypeAlias = Callable[[Sequence[Fraction]], Sequence[int]]
NO_ROOMS: Mapping[int, Room] = {}


def core_limits(space: Space) -> list[Limit]:
    """The upper limits on response times that are asked for."""
    return [
        build_limit(space, item)
        for item in space.requirements
        if item.metric.kind == "response time" and item.operator in ("<=", "<")
    ]


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
    known = iter(()) if whole is None else _ordered(space, whole, orders, limits)
    for found in chain(known, placements(space, design, open_, limits, orders)):
        first = first if first is not None else found
        view = View(found)
        if all(judge(limit, view).holds for limit in (*limits, *beside)):
            return found
    return first if first is not None else design


def first_fit(space: Space, design: Design, open_: Sequence[OpenCore]) -> Design | None:
    """The design with the cores that first-fit gives to the threads of `open_`; None where one may not run there.

    See `dse.analysis.placement.core_of_each`.
    """
    view, without = View(design), without_cores(space, open_)
    chosen = list(design)
    given: dict[int, int] = {}
    for processor, slot in enumerate(space.processors):
        if slot.types[view[slot.type_decision]] != EMPTY:
            given |= core_of_each(without, processor, View(design))
    for unit, item in _by_unit(open_, space, view).items():
        core = given.get(unit)
        if core is None:
            continue
        if core not in item.decision.values:
            return None
        chosen[item.index] = item.decision.values.index(core)
    return tuple(chosen)


def _ordered(space: Space, design: Design, orders: Sequence[OpenPriority], limits: Sequence[Limit]) -> Iterator[Design]:
    """The design, with priorities for the threads that ask for the best order."""
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
        yield from _ordered(space, design, orders, limits)
    for found in _elsewhere(space, view, open_, _check_of(space, view, latest, orders), beside) if open_ else ():
        if found is not None and found not in seen:
            seen.add(found)
            yield from _ordered(space, found, orders, limits)


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
    found: dict[int, Room] = {}
    for limit in beside:
        if limit.cores is not None:
            processor, room = limit.cores.processor, limit.cores.room
            found[processor] = min(found.get(processor, room), room, key=lambda item: (item.share, not item.is_strict))
    return found


def first_placement(
    space: Space,
    design: Design,
    open_: Sequence[OpenCore],
    limits: Sequence[Limit],
    beside: Sequence[Limit] = (),
    orders: Sequence[OpenPriority] = (),
) -> tuple[Design | None, bool]:
    """The design with the first cores, in the order of the file, on which all limits hold, and whether that is sure.

    None where there are no such cores; it is not sure where looking for them was given up.

    `limits` are those on response times, `beside` others that the cores must keep. Thread after thread gets the first
    core where those that have one already are not late for sure, and not too many for a limit of that core: with fewer
    threads no response time is longer, and no core fuller. What that leaves open the whole design decides.
    """
    view = View(design)
    meets = _check_of(space, view, limits_of(limits, view), orders)
    keeps_room = _room_check(space, view, beside)
    left = [MOST_STEPS]
    made = _by_unit(open_, space, view)
    where = {number: slot for slot in range(len(space.processors)) for number in members(space, slot, view)}
    taken: dict[tuple[int, int], list[int]] = {}
    for number, processor in where.items():
        core = at(space.components[number].core, view) if space.unit(number, view) not in made else None
        if core is not None:
            taken.setdefault((processor, core), []).append(number)
    order = [item for item in open_ if item.component in where and _is_asked(item, view)]
    chosen = list(design)

    def place(position: int) -> Design | None:
        if position == len(order):
            for found in _ordered(space, tuple(chosen), orders, limits):
                end = View(found)
                if all(judge(limit, end).holds for limit in (*limits, *beside)):
                    return found
            left[0] -= MOST_STEPS // MOST_ENDS
            return None
        item = order[position]
        processor = where[item.component]
        count = max(1, at(space.processors[processor].cores, view))
        empty = False
        for option, core in enumerate(item.decision.values):
            here = taken.setdefault((processor, core), [])
            if core > count or (empty and not here) or left[0] <= 0:
                continue
            left[0] -= 1
            empty = empty or (not here and bare)
            here += item.threads
            if keeps_room(processor, here) and meets(here):
                chosen[item.index] = option
                whole_design = place(position + 1)
                if whole_design is not None:
                    return whole_design
            del here[-len(item.threads) :]
        return None

    most = max((max(1, at(slot.cores, view)) for slot in space.processors), default=1)
    whole = all(set(range(1, most + 1)) <= set(item.decision.values) for item in order)
    bare = whole and not any(taken.values()) and sum(len(item.threads) for item in order) == len(where)
    found = place(0)
    return found, found is not None or left[0] > 0


def _room_check(space: Space, view: View, beside: Sequence[Limit]) -> Callable[[int, Sequence[int]], bool]:
    """Tells whether threads that share a core of a processor leave it within its limits."""
    found: dict[int, list[tuple[Room, Mapping[int, Fraction]]]] = {}
    for limit in beside:
        if limit.cores is not None:
            loads = on_processor(space, limit.cores.processor, thread_values(limit, view), view)
            found.setdefault(limit.cores.processor, []).append((limit.cores.room, loads))

    def keeps_room(processor: int, numbers: Sequence[int]) -> bool:
        return all(
            room.fits(sum((loads.get(number, Fraction(0)) for number in numbers), Fraction(0)))
            for room, loads in found.get(processor, ())
        )

    return keeps_room


def _is_asked(item: OpenCore, view: View) -> bool:
    """Whether the thread's core is a decision in the design."""
    return item.index in consulted(item.decision.home, view)[0]


def _check_of(space: Space, view: View, latest: Latest, orders: Sequence[OpenPriority]) -> Fits:
    """Tells whether threads that share a core meet their limits, in some order, as far as these depend on that core.

    Remembered: whoever goes through cores depth first asks for the same threads again and again.
    """
    free = {item.component: item for item in orders}
    known_of: dict[frozenset[int], bool] = {}

    def meets(numbers: Sequence[int]) -> bool:
        group = frozenset(numbers)
        if group not in known_of:
            known_of[group] = found_to_meet(numbers)
        return known_of[group]

    def found_to_meet(numbers: Sequence[int]) -> bool:
        if free:
            return best_options(space, numbers, free, latest, view.design) is not None
        known = subset_responses(space, [numbers], view)
        for number in numbers:
            response = Fraction(counted_ns(known.get((number, "thread"), 0)))
            if not all(HOLDS[operator](response, bound) for operator, bound in latest.get(number, ())):
                return False
        return True

    return meets


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
    by_number = _by_unit(open_, space, view)
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


def _by_unit(open_: Sequence[OpenCore], space: Space, view: View) -> dict[int, OpenCore]:
    """Open cores by the first thread that has each in a design; those that none has are left out."""
    units: dict[int, OpenCore] = {}
    for item in open_:
        first = next((one for one in item.threads if _owner(space, one, view) == item.decision.component), None)
        if first is not None:
            units[first] = item
    return units


def _owner(space: Space, number: int, view: View) -> str:
    return space.core_owner(space.components[number], view)


def _relabelled(space: Space, view: View, design: Design, open_: Sequence[OpenCore]) -> Design:
    """The same with the cores of each processor numbered as they come first in the file, where nothing names a core."""
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
        for item in here:
            result[item.index] = labels.setdefault(design[item.index], len(labels))
    return tuple(result)
