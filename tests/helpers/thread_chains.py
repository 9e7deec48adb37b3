"""Chains of threads on a core (docs/semantics.md, section 4.9), in whole ms: nothing of the product's analysis is here.

Connections take no time here, so that nothing breaks a window.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import count
from typing import Any, NamedTuple, TypeAlias

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


def longest(own: Stream, rivals: Sequence[Stream], blocked: int, *, own_over: bool, counted: Stream) -> int:
    """The greatest time from a release of `counted` to the end of `own` over the jobs of the busy period.

    It is `LATE` without a bound. With `own_over` an earlier job has ended at the release of the next one.
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
        found = max(found, end - max(counted.soonest(job), ran))
        if end <= own.soonest(job + 1):
            return found
    raise AssertionError


Comes: TypeAlias = tuple[int, int]
"""How often jobs come, and how late: period and jitter in ms."""
ONCE = (LATE, 0)
NEVER = (LATE, -LATE)
Row: TypeAlias = tuple[int, ...]
Rivals: TypeAlias = Callable[[Row], tuple[list[int], list[Stream], int]]
"""Gives rivals, what else goes first, and blocking."""


class OnCore:
    """The threads that priorities alone schedule, and what the chains of them wait for on a core.

    `windows` are the longest times from the release of the first to the end of the last of threads in a row, `lags`
    those from the latest release of the first, of rows that something releases, and of single threads, too.
    """

    def __init__(
        self, source: Mapping[int, int], figures: Any, is_alone: Sequence[bool], is_settled: Sequence[bool]
    ) -> None:
        """`figures` are cores, levels, periods and times of all threads, context switches included, and their least.

        A thread `is_settled` whose core and priority are stated, each as one number.
        """
        self.source = source
        self.cores, self.levels, self.period, self.cost, self.shortest = figures
        self.is_plain = [alone and cost > 0 for alone, cost in zip(is_alone, self.cost, strict=True)]
        self.is_settled = [one and other for one, other in zip(self.is_plain, is_settled, strict=True)]
        work = {row: sum(self.cost[item] for item in row) for row in self._rows()}
        self.windows = {row: takes for row, takes in work.items() if len(row) > 1}
        self.lags = {row: takes for row, takes in work.items() if row[0] in source}

    def chain(self, number: int) -> list[int]:
        """All before a thread, the first of all first, and the thread."""
        return [*self.chain(self.source[number]), number] if number in self.source else [number]

    def _rows(self) -> Iterator[Row]:
        for number in range(len(self.cost)):
            chain = self.chain(number)
            for first in range(len(chain)):
                row = tuple(chain[first:])
                if all(self.is_plain[item] for item in row) and len({self.cores[item] for item in row}) == 1:
                    yield row

    def least(self, part: Sequence[int], known: Sequence[int]) -> int:
        """S of part of a chain, by response times alone: the least over all ways to cut it into windows and threads."""
        return self._cut(part, known, {})

    def bound(self, part: Sequence[int], known: Sequence[int]) -> int:
        """The longest that part of a chain takes: as `least`, but that lags count in what begins with a timer."""
        return self._cut(part, known, self.lags if part[0] not in self.source else {})

    def _cut(self, part: Sequence[int], known: Sequence[int], lags: Mapping[Row, int]) -> int:
        best = [0]
        for end in range(1, len(part) + 1):
            ways = []
            for at in range(end):
                row = tuple(part[at:end])
                takes = known[row[0]] if len(row) == 1 else self.windows.get(row, LATE)
                ways.append(best[at] + (takes if takes >= LATE // 10 else min(takes, lags.get(row, takes))))
            best.append(min(ways))
        return best[-1]

    def jitters(self, known: Sequence[int]) -> list[int]:
        """How much later than at the earliest each thread is released, whose chain begins with a timer."""
        before = [self.chain(number)[:-1] for number in range(len(self.cost))]
        return [self.bound(part, known) - sum(self.shortest[item] for item in part) if part else 0 for part in before]

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

    def comes(self, item: int, level: int, chains: Chains) -> Comes:
        """How often a thread comes in a busy window of another one, and how late.

        Behind one that does not run in such a window it comes once, behind one that does no more often than that one.
        """
        before = self._before(item, level)
        if before is None:
            return self.period[item], chains.jitter[item]
        return ONCE if self.levels[before] > self.levels[level] else self.comes(before, level, chains)

    def _before(self, item: int, level: int) -> int | None:
        """What releases a thread on its core, where both are settled as what the window is of."""
        before = self.source.get(item)
        if before is None or not all(self.is_settled[each] for each in (before, item, level)):
            return None
        return before if self.cores[before] == self.cores[item] == self.cores[level] else None

    def head(self, item: int, level: int) -> int | None:
        """The less urgent thread behind which one comes, by itself or by what is between; None without."""
        before = self._before(item, level)
        if before is None or self.levels[before] > self.levels[level]:
            return before
        return self.head(before, level)

    def cases(self, own: int, level: int, chains: Chains) -> list[list[Comes]]:
        """What all threads do in each kind of busy window: behind none of the less urgent threads, or behind one."""
        numbers = range(len(self.cost))
        heads = [
            self.head(item, level) if self.cores[item] == self.cores[level] and self.levels[item] <= self.levels[level]
            else None for item in numbers
        ]  # fmt: skip
        mine = self.head(own, level)
        begins = [None, *{head for head in heads if head is not None}] if mine is None else [mine]
        found = []
        for begin in begins:
            comes = [self._comes_late(item, level, begin, chains) for item in numbers]
            absent = [head not in (None, begin) for head in heads]
            comes = [NEVER if is_absent else each for is_absent, each in zip(absent, comes, strict=True)]
            comes[own] = self.comes(own, level, chains)
            found.append(comes)
        return found

    def _comes_late(self, item: int, level: int, begin: int | None, chains: Chains) -> Comes:
        """How a rival comes in windows that begin as a thread ends: one that is before that in its chain, later."""
        period, jitter = self.comes(item, level, chains)
        before = [] if begin is None else self.chain(begin)
        if item not in before[:-1] or (period, jitter) == ONCE:
            return period, jitter
        passed = next(chains.jitter[other] for other, source in self.source.items() if source == begin)
        shortest = sum(self.shortest[other] for other in before[before.index(item) :])
        return period, min(jitter, passed + shortest - period)

    def widened(self, chains: Chains, rivals_of: Rivals) -> tuple[dict[Row, int], dict[Row, int]]:
        """Windows and lags as they are with what is known."""
        windows = {row: self._window(row, None, chains, rivals_of(row)) for row in self.windows}
        lags = {}
        for row in self.lags:
            first = self.chain(row[0])[0]
            counted = Stream(0, self.period[first], 0)
            given = rivals_of(row)
            if len(row) > 1:
                lags[row] = self._window(row, counted, chains, given)
            else:
                lags[row] = self.single(row[0], chains, given, counted=counted)
        return windows, lags

    def single(
        self,
        number: int,
        chains: Chains,
        given: tuple[list[int], list[Stream], int],
        *,
        counted: Stream | None = None,
    ) -> int:
        """From a release (as is `counted`) to the end of a thread, some of whose rivals may be over."""
        rivals, first, blocked = given
        over = self.over(number, chains)
        found = []
        for comes in self.cases(number, number, chains):
            own = Stream(self.cost[number], *comes[number])
            every = [Stream(self.cost[item], *comes[item], item in over) for item in rivals]
            found.append(longest(own, [*every, *first], blocked, own_over=bool(over), counted=counted or own))
        return max(found)

    def _window(
        self, row: Row, counted: Stream | None, chains: Chains, given: tuple[list[int], list[Stream], int]
    ) -> int:
        rivals, first, blocked = given
        level = max(row, key=lambda item: self.levels[item])
        has_ended = chains.has_ended(row[0], row[-1])
        over = [item for item in rivals if has_ended and self._is_over(item, row, chains)]
        in_turn = 0 if has_ended else self._in_turn(row)
        found = []
        for comes in self.cases(row[0], level, chains):
            every = [Stream(self.cost[item], *comes[item], item in over) for item in rivals] + first
            own = Stream(sum(self.cost[item] for item in row[in_turn:]), *comes[row[0]])
            every += [Stream(self.cost[item], *comes[row[0]]) for item in row[:in_turn]]
            found.append(longest(own, every, blocked, own_over=has_ended, counted=counted or own))
        return max(found)

    def _in_turn(self, row: Row) -> int:
        """The place of the first thread of a row that is less urgent than all behind it, where later jobs wait."""
        levels = [self.levels[item] for item in row]
        return next(place for place, level in enumerate(levels) if all(level > other for other in levels[place + 1 :]))

    def _is_over(self, item: int, row: Row, chains: Chains) -> bool:
        if not self.is_plain[item]:
            return False
        if item in self.chain(row[0]):
            return chains.has_ended(item, row[-1])
        return row[-1] in self.chain(item) and chains.has_ended(row[0], item)
