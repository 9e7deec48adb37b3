"""How evenly the cores of a processor can be used by what runs on it, by trying every way to put it there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property
from typing import Any


@dataclass(frozen=True)
class Peak:
    """The least that the fullest core can carry: `taken` are loads of cores, `ways` (core, share) of each thread."""

    taken: tuple[Fraction, ...]
    ways: tuple[tuple[tuple[int, Fraction], ...], ...]

    @cached_property
    def exact(self) -> Fraction:
        """By trying every way to put the threads on cores."""
        return _evenly(self.taken, self.ways)

    def keeps(self, compare: Callable[[Fraction, Fraction], bool], limit: Fraction) -> bool:
        """Whether some way to put the threads on cores keeps an upper limit on each; all are tried if need be."""
        if (compare, limit) not in self._kept:
            self._kept[compare, limit] = self._keeps(compare, limit)
        return self._kept[compare, limit]

    @cached_property
    def _kept(self) -> dict[tuple[Any, Fraction], bool]:
        """What is known of it: many designs share one."""
        return {}

    def _keeps(self, compare: Callable[[Fraction, Fraction], bool], limit: Fraction) -> bool:
        loads = list(self.taken)
        for way in self.ways:
            core, share = min(way, key=lambda item: loads[item[0]])
            loads[core] += share
        if compare(max(loads), limit):
            return True
        least = max(sum(loads, Fraction(0)) / len(loads), *self.taken, *(way[0][1] for way in self.ways))
        return compare(least, limit) and compare(self.exact, limit)


@cache
def _evenly(taken: tuple[Fraction, ...], ways: tuple[tuple[tuple[int, Fraction], ...], ...]) -> Fraction:
    """The least that the fullest core can carry, by trying every way to put the threads on cores."""
    if not ways:
        return max(taken)
    found = []
    for core, share in ways[0]:
        loads = list(taken)
        loads[core] += share
        found.append(_evenly(tuple(loads), ways[1:]))
    return min(found)
