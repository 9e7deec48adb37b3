"""Threads on the cores of a processor: a partition that keeps every core within a capacity, or a proof of none.

First-fit by decreasing use finds one nearly always; where it does not, a complete search decides it (bin packing is
NP-hard: S. Martello and P. Toth, "Knapsack Problems", Wiley 1990, chapter 8), as far as its effort is allowed to go.
Where that is not soon done, cores are filled one after the other (`dse.analysis.placement.subset_sum`) before it goes
on.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from math import floor
from typing import Any

from dse.analysis.binding import own_core
from dse.analysis.placement.bin_packing import (
    WHOLE,
    Counted,
    PackedItem,
    PackingOutcome,
    PackingSearch,
    Room,
    Status,
    counted_in_parts,
    largest_first,
)
from dse.analysis.placement.subset_sum import filled
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at

MOST_STEPS = 20_000
"""Maximum number of times that the complete search puts a thread on a core."""
FIRST_STEPS = 1_000
"""Steps of the first complete search, before cores are filled one after the other."""
MOST_THREADS = 300
"""Maximum number of threads for the complete search; with more, only first-fit is tried."""


@dataclass(frozen=True)
class CorePartition:
    """The core of each thread, from 0, in the order given; `none` is a proof, `undecided` an end of effort.

    Where none is found the cores are those of first-fit, which overloads some.
    """

    status: Status
    cores: tuple[int, ...]
    loads: tuple[Fraction, ...]

    @property
    def fullest(self) -> int:
        """The core that is used most, the first of several.

        From 0.
        """
        return max(range(len(self.loads)), key=lambda core: (self.loads[core], -core))


def partition(work: Sequence[PackedItem], taken: Sequence[Fraction], room: Room) -> CorePartition:
    """Put threads on cores that already carry `taken`, so that the load of every core fits.

    Parameters
    ----------
    work
        the threads that have no core yet.
    taken
        for each core what is on it already.
    room
        the capacity of a core.

    Examples
    --------
    Shares of 60, 50, 40 and 50 per cent fill two cores; three of 60 per cent do not fit on two.

    >>> from fractions import Fraction as F
    >>> both = (0, 1)
    >>> half = [PackedItem(F(share, 10), both) for share in (6, 5, 4, 5)]
    >>> partition(half, [F(0), F(0)], WHOLE).cores
    (0, 1, 0, 1)
    >>> partition([PackedItem(F(6, 10), both)] * 3, [F(0), F(0)], WHOLE).status
    'none'
    """
    counted = counted_in_parts(work, taken, room)
    order = largest_first(counted.work)
    status, cores, loads = _first_fit(counted, order)
    if status != "found" and _is_hopeless(counted):
        status = "none"
    elif status != "found" and len(work) <= MOST_THREADS:
        packing = _searched(counted, order, FIRST_STEPS)
        if packing.status == "undecided":
            packing = _filled(counted) or _searched(counted, order, MOST_STEPS)
        status = packing.status
        if status == "found":
            cores, loads = list(packing.cores), list(packing.loads)
    return CorePartition(status, tuple(cores), tuple(load / counted.scale for load in loads))


def _filled(counted: Counted) -> PackingOutcome | None:
    """Cores filled one after the other, where that does."""
    if not counted.is_plain:
        return None
    shares = tuple(item.share for item in counted.work)
    allowed = tuple(tuple(item.cores) for item in counted.work)
    cores = _recalled_filling(shares, allowed, tuple(counted.taken), counted.room.share)
    if cores is None:
        return None
    loads = list(counted.taken)
    for core, share in zip(cores, shares, strict=True):
        loads[core] += share
    assert all(map(counted.fits, loads)), (cores, loads)
    return PackingOutcome("found", cores, tuple(loads), 0)


def tightest(work: Sequence[PackedItem], taken: Sequence[Fraction]) -> CorePartition:
    """The partition whose fullest core is used least; `undecided` where effort ended before that was proved.

    A heuristic partition, then complete search for one with a lower peak, until a bound is met or `MOST_STEPS` is
    reached.
    """
    counted = counted_in_parts(work, taken, WHOLE)
    order = largest_first(counted.work)
    cores, loads = _least_used(counted, order)
    total = sum((item.share for item in counted.work), Fraction(0)) + sum(counted.taken)
    least = max(total / len(taken), max(counted.taken), *(item.share for item in counted.work), Fraction(0))
    status: Status = "found"
    steps = MOST_STEPS if len(work) <= MOST_THREADS else 0
    while status == "found" and max(loads) > least:
        peak = max(loads)
        packing = _searched(replace(counted, room=Room(peak, is_strict=True)), order, steps)
        status, steps = packing.status, packing.steps
        if status == "found":
            cores, loads = list(packing.cores), list(packing.loads)
    said: Status = "undecided" if status == "undecided" else "found"
    return CorePartition(said, tuple(cores), tuple(load / counted.scale for load in loads))


def _is_hopeless(counted: Counted) -> bool:
    """Whether some core is too full already, or a thread may have none."""
    return not all(map(counted.fits, counted.taken)) or not all(item.cores for item in counted.work)


@dataclass(frozen=True)
class Spread:
    """The core of each thread of a processor in a design, from 1, by its number, and how much each core is used.

    `status` tells of the threads whose core is neither stated nor decided; without such threads it says whether every
    core fits. `is_open` tells whether there are any.
    """

    status: Status
    cores: Mapping[int, int]
    loads: tuple[Fraction, ...]
    is_open: bool

    @property
    def fullest(self) -> int:
        """The core that is used most, from 1; the first of several.

        An index of `loads` plus 1.
        """
        return max(range(len(self.loads)), key=lambda core: (self.loads[core], -core)) + 1


def spread(space: Space, processor: int, used: Mapping[int, Fraction], view: View, room: Room) -> Spread:
    """The threads of a processor on its cores, such that every core keeps its capacity where that can be.

    Parameters
    ----------
    used
        the threads that run there, by number, each with the share of a core that it uses.
    room
        the capacity of a core. A thread that asks for first-fit has it, within whole cores, and so have those beside it
        whose core is open: what this gives is then the only partition.
    """
    taken, waiting, allowed = _given(space, processor, used, view)
    work = [PackedItem(used[number], allowed[number]) for number in waiting]
    if asks_for_first_fit(space, waiting):
        assignment = first_fit(work, taken)
        assignment = replace(assignment, status="found" if all(map(room.fits, assignment.loads)) else "none")
    else:
        assignment = partition(work, taken, room)
    return _as_spread(space, used, view, waiting, assignment)


def even_spread(space: Space, processor: int, used: Mapping[int, Fraction], view: View) -> Spread:
    """The threads of a processor on its cores, such that the fullest is used least, as far as cores are open.

    A `Spread`; threads with stated or decided cores stay there. `used` has fractions of a core by component index.
    """
    taken, waiting, allowed = _given(space, processor, used, view)
    work = [PackedItem(used[number], allowed[number]) for number in waiting]
    is_given = asks_for_first_fit(space, waiting)
    return _as_spread(space, used, view, waiting, first_fit(work, taken) if is_given else tightest(work, taken))


def asks_for_first_fit(space: Space, waiting: Iterable[int]) -> bool:
    """Whether some thread without a core has it by first-fit, not as it is best.

    Then partitions are built by first-fit instead of by search, as the file asks.
    """
    is_open = {item.component for item in space.open_cores}
    return any(number not in is_open for number in waiting)


def core_count(space: Space, processor: int, view: View) -> int:
    """The number of cores of a processor; where a study varies it, a fraction of a core does not count.

    An integer of at least 1; traced numbers from a study are rounded down.
    """
    count = max(1, at(space.processors[processor].cores, view))
    return operator.index(count) if count.denominator == 1 else floor(count)


def given_cores(space: Space, processor: int, numbers: Iterable[int], view: View) -> dict[int, int] | None:
    """The core of each of these threads, where each has one of its own; None where some are open.

    Component indices to core numbers from 1.
    """
    count = core_count(space, processor, view)
    core_of = {number: own_core(space, number, view, count) for number in numbers}
    stated = {number: core for number, core in core_of.items() if core is not None}
    return stated if len(stated) == len(core_of) else None


def _given(
    space: Space, processor: int, used: Mapping[int, Fraction], view: View
) -> tuple[list[Fraction], list[int], dict[int, Collection[int]]]:
    """What is on each core already, the threads without one, and the cores (from 0) that these may have.

    Where a study moves the number of cores, a core that is not there is the last one.
    """
    count = core_count(space, processor, view)
    taken, waiting = [Fraction(0)] * count, []
    for number, share in used.items():
        core = own_core(space, number, view, count)
        if core is None:
            waiting.append(number)
        else:
            taken[core - 1] += share
    allowed: dict[int, Collection[int]] = {number: range(count) for number in waiting}
    for item in space.open_cores:
        if item.component in allowed:
            allowed[item.component] = sorted(core - 1 for core in item.decision.values if core <= count)
    return taken, waiting, allowed


def _as_spread(
    space: Space, used: Mapping[int, Fraction], view: View, waiting: Sequence[int], packing: CorePartition
) -> Spread:
    chosen = dict(zip(waiting, (core + 1 for core in packing.cores), strict=True))
    own = {number: own_core(space, number, view, len(packing.loads)) for number in used}
    return Spread(
        packing.status,
        {number: chosen[number] if core is None else core for number, core in own.items()},
        packing.loads,
        bool(waiting),
    )


def first_fit(work: Sequence[PackedItem], taken: Sequence[Fraction]) -> CorePartition:
    """Each thread, those that use most first, on the first core with room for it, else on the one that is used least.

    `undecided` where a core carries more than all of it.
    """
    counted = counted_in_parts(work, taken, WHOLE)
    status, cores, loads = _first_fit(counted, largest_first(counted.work))
    return CorePartition(status, tuple(cores), tuple(load / counted.scale for load in loads))


def _first_fit(counted: Counted, order: Sequence[int]) -> tuple[Status, list[int], list[Any]]:
    loads, cores, fits = list(counted.taken), [0] * len(counted.work), counted.fits
    status: Status = "found" if all(map(fits, counted.taken)) else "undecided"
    for number in order:
        item = counted.work[number]
        core = next((core for core in item.cores if fits(loads[core] + item.share)), None)
        if core is None:
            status = "undecided"
            core = min(item.cores or range(len(loads)), key=lambda one: (loads[one], one))
        cores[number] = core
        loads[core] += item.share
    return status, cores, loads


def _least_used(counted: Counted, order: Sequence[int]) -> tuple[list[int], list[Any]]:
    """Each thread on the core that is used least (R. L. Graham, SIAM Journal on Applied Mathematics 17, 1969)."""
    loads, cores = list(counted.taken), [0] * len(counted.work)
    for number in order:
        item = counted.work[number]
        cores[number] = min(item.cores or range(len(loads)), key=lambda one: (loads[one], one))
        loads[cores[number]] += item.share
    return cores, loads


def _searched(counted: Counted, order: Sequence[int], steps: int) -> PackingOutcome:
    """The complete search; remembered, for designs that differ elsewhere use their cores alike."""
    if not counted.is_plain:
        return PackingSearch(counted, order, steps).run()
    work = tuple((item.share, tuple(item.cores)) for item in counted.work)
    return _recalled(work, tuple(counted.taken), counted.room, steps)


_recalled_filling: Callable[..., tuple[int, ...] | None] = lru_cache(maxsize=4096)(filled)


@lru_cache(maxsize=4096)
def _recalled(
    work: tuple[tuple[Any, tuple[int, ...]], ...], taken: tuple[Any, ...], room: Room, steps: int
) -> PackingOutcome:
    counted = Counted([PackedItem(*item) for item in work], taken, room, Fraction(1), is_plain=True)
    return PackingSearch(counted, largest_first(counted.work), steps).run()
