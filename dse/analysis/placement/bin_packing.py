"""Bin packing as it is asked about cores, and its complete search.

It is NP-hard (S. Martello and P. Toth, "Knapsack Problems", Wiley 1990, chapter 8); `dse.analysis.placement.partition`
says how much effort it is worth.
"""

from __future__ import annotations

import operator
from bisect import bisect_right
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import ceil, floor, lcm
from typing import Any, Literal, TypeAlias, cast

Status: TypeAlias = Literal["found", "none", "undecided"]
MOST_IN_SUMS = 10
"""Maximum number of threads of which all sums are made: no more than 1024."""


@dataclass(frozen=True)
class Room:
    """The capacity of a core: at most `share` of it, or less than that where `is_strict`.

    A fraction of one core, exact.
    """

    share: Fraction
    is_strict: bool = False

    def fits(self, load: Fraction) -> bool:
        """Whether a core may carry a load.

        Equality fits unless the room is strict.
        """
        return load < self.share if self.is_strict else load <= self.share


WHOLE = Room(Fraction(1))


@dataclass(frozen=True)
class PackedItem:
    """A thread to be put on a core: the share of a core that it uses, and the cores that it may have, from 0.

    `cores` are the allowed core numbers, from 0.
    """

    share: Fraction
    cores: Collection[int]


@dataclass(frozen=True)
class Counted:
    """The question in whole parts of a core, `scale` of them, where figures are plain numbers: they add up quickly.

    Figures that remember how they were made stay as they are: these are not `is_plain`.
    """

    work: Sequence[PackedItem]
    taken: Sequence[Any]
    room: Room
    scale: Fraction
    is_plain: bool

    @property
    def fits(self) -> Callable[[Any], bool]:
        """Whether a core may carry a load.

        A function of a load in the parts of `counted_in_parts`.
        """
        if not self.is_plain:
            return self.room.fits
        return partial(operator.gt if self.room.is_strict else operator.ge, self.room.share)  # by far quicker


def counted_in_parts(work: Sequence[PackedItem], taken: Sequence[Fraction], room: Room) -> Counted:
    """The question in the largest parts of a core of which all figures are whole numbers.

    Integers are compared faster than fractions; traced numbers stay as they are.
    """
    figures = [*taken, *(item.share for item in work)]
    if not all(type(figure) in (int, Fraction) for figure in figures):
        return Counted(work, taken, room, Fraction(1), is_plain=False)
    scale = lcm(*(figure.denominator for figure in figures))
    share = room.share * scale
    most = ceil(share) - 1 if room.is_strict else floor(share)
    whole = [PackedItem(cast(Any, int(item.share * scale)), item.cores) for item in work]
    return Counted(whole, [int(load * scale) for load in taken], Room(cast(Any, most)), Fraction(scale), is_plain=True)


def largest_first(work: Sequence[PackedItem]) -> list[int]:
    """The positions of the threads, those that use most first.

    Indices into `work`; ties by index, so that results are reproducible.
    """
    return sorted(range(len(work)), key=lambda number: (-work[number].share, number))


@dataclass(frozen=True)
class PackingOutcome:
    """The outcome of a complete search for a placement, with the number of steps that it did not need.

    `status` is ``found``, ``none`` (proved) or ``undecided`` (effort used up).
    """

    status: Status
    cores: tuple[int, ...]
    loads: tuple[Any, ...]
    steps: int


class PackingSearch:
    """Depth first, the largest thread first; cores that are alike are tried once.

    What the cores have left must be enough for the threads that are left, without what no choice of these can fill
    (wasted space: S. Martello and P. Toth, "Knapsack Problems", Wiley 1990, chapter 8), as soon as they are few.
    """

    def __init__(self, counted: Counted, order: Sequence[int], steps: int) -> None:
        self.work, self.order, self.fits, self.most = counted.work, order, counted.fits, counted.room.share
        self.loads, self.cores, self.steps = list(counted.taken), [0] * len(counted.work), steps
        left = sum((self.work[number].share for number in order), cast(Any, 0))
        self.is_enough = sum(self.most - load for load in self.loads if self.most > load) >= left
        self.alike = {core for core in range(len(self.loads)) if all(core in item.cores for item in self.work)}
        self.most -= counted.is_plain and counted.room.is_strict  # in whole parts
        self.slack = None if not counted.is_plain else sum(self.most - load for load in self.loads) - left
        self.is_enough &= not counted.is_plain or all(load <= self.most for load in self.loads)
        self.sums: dict[int, list[Any]] = {}

    def run(self) -> PackingOutcome:
        """Whether there is a partition, and one where there is.

        Depth-first over the threads in decreasing load, with equal cores tried once.
        """
        is_packed = self._place(0) if self.is_enough else False
        status: Status = "undecided" if is_packed is None else "found" if is_packed else "none"
        return PackingOutcome(status, tuple(self.cores), tuple(self.loads), self.steps)

    def _place(self, position: int) -> bool | None:
        """Put the threads from `position` on; None when effort ends."""
        if position == len(self.order):
            return True
        if self.slack is not None and position >= len(self.order) - MOST_IN_SUMS and self._is_wasted(position):
            return False
        number = self.order[position]
        item = self.work[number]
        tried = set()
        for core in item.cores:
            load = self.loads[core]
            if (core in self.alike and load in tried) or not self.fits(load + item.share):
                continue
            tried |= {load} if core in self.alike else set()
            self.steps -= 1
            if self.steps < 0:
                return None
            self.loads[core], self.cores[number] = load + item.share, core
            is_placed = self._place(position + 1)
            if is_placed is not False:
                return is_placed
            self.loads[core] = load
        return False

    def _is_wasted(self, position: int) -> bool:
        """Whether the cores have too much room that the threads from `position` on cannot fill, each by itself."""
        sums = self.sums.get(position)
        if sums is None:
            reachable: set[Any] = {0}
            for number in self.order[position:]:
                reachable |= {one + self.work[number].share for one in reachable}
            sums = self.sums[position] = sorted(reachable)
        waste: Any = 0
        for load in self.loads:
            room = self.most - load
            waste += room - sums[bisect_right(sums, room) - 1]
        return bool(waste > self.slack)
