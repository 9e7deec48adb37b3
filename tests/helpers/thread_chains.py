"""Chains of threads on a core (docs/semantics.md, section 4.9), in whole ms: nothing of the product's analysis is here.

Connections take no time here, so that nothing breaks a window.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import count
from typing import Any, NamedTuple

from tests.helpers.thread_executors import LATE, MOST_MS, Chains


class Stream(NamedTuple):
    """Jobs of so much work every so often, up to so late; those of what is over have ended when a job is released."""

    work: int
    period: int
    late: int
    is_over: bool = False

    def came(self, end: int) -> int:
        """The work of the jobs that are released in [0, end)."""
        return -(-(end + self.late) // self.period) * self.work

    def soonest(self, job: int) -> int:
        """When a job, the first of which is 1, may be released at the earliest."""
        return max(0, (job - 1) * self.period - self.late)


def longest(own: Stream, rivals: Sequence[Stream], blocked: int, *, own_over: bool) -> int:
    """The greatest time from a release of `own` to its end over the jobs of the busy period; `LATE` without a bound.

    With `own_over` an earlier job has ended at the release of the next one.
    """
    every = [own, *rivals]
    load = sum((Fraction(each.work, each.period) for each in every), Fraction(0))
    latest = max(blocked, *(each.late for each in every))
    if load > 1 or latest >= LATE // 2 or (load == 1 and latest):
        return LATE
    found = end = 0
    for job in count(1):
        end = max(end, 1)
        while (need := blocked + job * own.work + sum(each.came(end) for each in rivals)) > end:
            end = need
            if end > MOST_MS:
                return LATE
        ran = (job - 1) * own.work + sum(each.came(end) for each in rivals if each.is_over) if own_over else 0
        found = max(found, end - max(own.soonest(job), ran))
        if end <= own.soonest(job + 1):
            return found
    raise AssertionError


class OnCore:
    """The threads that priorities alone schedule, and what the chains of them wait for on a core.

    `windows` are the longest times from the release of the first to the end of the last of threads in a row.
    """

    def __init__(self, source: Mapping[int, int], figures: Any, is_alone: Sequence[bool]) -> None:
        """`figures` are cores, levels, periods and times of all threads, context switches included, and of work."""
        self.source = source
        self.cores, self.levels, self.period, self.cost, self.work = figures
        self.is_plain = [alone and cost > 0 for alone, cost in zip(is_alone, self.cost, strict=True)]
        self.windows = {row: sum(self.cost[item] for item in row) for row in self._rows()}

    def chain(self, number: int) -> list[int]:
        """All before a thread, the first of all first, and the thread."""
        return [*self.chain(self.source[number]), number] if number in self.source else [number]

    def _rows(self) -> Iterator[tuple[int, ...]]:
        for number in range(len(self.cost)):
            chain = self.chain(number)
            for first in range(len(chain) - 1):
                row = tuple(chain[first:])
                if all(self.is_plain[item] for item in row) and len({self.cores[item] for item in row}) == 1:
                    yield row

    def least(self, part: Sequence[int], known: Sequence[int]) -> int:
        """The longest that part of a chain takes: the least over all ways to cut it into windows and threads."""
        best = [0]
        for end in range(1, len(part) + 1):
            ways = [best[end - 1] + known[part[end - 1]]]
            ways += [best[at] + self.windows.get(tuple(part[at:end]), LATE) for at in range(end - 1)]
            best.append(min(ways))
        return best[-1]

    def jitters(self, known: Sequence[int]) -> list[int]:
        """How much later than at the earliest each thread is released."""
        found = [0] * len(self.cost)
        for number in sorted(range(len(found)), key=lambda item: len(self.chain(item))):
            before = self.chain(number)[:-1]
            parts = [before[at:] for at in range(len(before))]
            found[number] = min(
                (found[part[0]] + self.least(part, known) - sum(self.work[item] for item in part) for part in parts),
                default=0,
            )
        return found

    def over(self, number: int, chains: Chains) -> list[int]:
        """What goes before a thread on its core, and never waits while it does."""
        return [
            item
            for item in range(len(self.cost))
            if item != number
            and (self.is_plain[item] and self.is_plain[number])
            and self.cores[item] == self.cores[number]
            and self.levels[item] <= self.levels[number]
            and chains.never_together(item, number)
        ]

    def widened(
        self, chains: Chains, rivals_of: Callable[[tuple[int, ...]], tuple[list[int], list[Stream], int]]
    ) -> dict[tuple[int, ...], int]:
        """The windows as they are with what is known; `rivals_of` gives rivals, what else goes first, and blocking."""
        return {row: self._window(row, chains, *rivals_of(row)) for row in self.windows}

    def _window(
        self, row: tuple[int, ...], chains: Chains, rivals: Sequence[int], first: Sequence[Stream], blocked: int
    ) -> int:
        stream = (self.period[row[0]], chains.jitter[row[0]])
        if chains.has_ended(row[0], row[-1]):
            over = [item for item in rivals if self._is_over(item, row, chains)]
            every = [self._stream(item, chains, is_over=item in over) for item in rivals]
            own = Stream(sum(self.cost[item] for item in row), *stream)
            return longest(own, [*every, *first], blocked, own_over=True)
        every = [self._stream(item, chains) for item in rivals]
        every += [Stream(self.cost[item], *stream) for item in row[:-1]]
        return longest(Stream(self.cost[row[-1]], *stream), [*every, *first], blocked, own_over=False)

    def _is_over(self, item: int, row: tuple[int, ...], chains: Chains) -> bool:
        if not self.is_plain[item]:
            return False
        if item in self.chain(row[0]):
            return chains.has_ended(item, row[-1])
        return row[-1] in self.chain(item) and chains.has_ended(row[0], item)

    def _stream(self, item: int, chains: Chains, *, is_over: bool = False) -> Stream:
        return Stream(self.cost[item], self.period[item], chains.jitter[item], is_over)
