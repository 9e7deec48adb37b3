"""Response times in executors, by looking at every ms: nothing of the product's analysis is in here."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import Any

LATE = 10**9
"""A response time without a bound, in ms."""
MOST_MS = 1_500
"""A busy period that is longer goes on for ever: with these figures none that ends is."""


def goes_first(theirs: int | None, mine: int | None, their_rate: Any, my_rate: Any) -> bool:
    if mine is not None or theirs is not None:
        return theirs is not None and (mine is None or theirs >= mine)
    return bool(their_rate < my_rate)


def draw_executors(rng: random.Random) -> list[dict[str, Any]]:
    """One or two executors of any kind."""
    found = []
    for number in range(rng.choice((1, 1, 2))):
        what = tuple(rng.sample(("fifo", "callback_group", "wait_set"), rng.choice((1, 1, 1, 2))))
        found.append({"name": f"e{number}", "kind": what, "priority": rng.choice((None, None, 1, 2))})
    return found


def supplied(supply: tuple[int, int] | None, time: int) -> int:
    """The least that a budget of each period gives in a time: all of it without one (Shin and Lee, RTSS 2003, (6)).

    >>> [supplied((3, 5), time) for time in (4, 5, 7, 8, 9, 10)]
    [0, 1, 3, 3, 3, 4]
    """
    if supply is None:
        return time
    budget, period = supply
    gap = period - budget
    count = max(-(-(time - gap) // period), 1)
    if (count + 1) * period - 2 * budget <= time <= (count + 1) * period - budget:
        return time - (count + 1) * gap
    return max(0, (count - 1) * budget)


class InExecutor:
    """A thread of an executor, what goes before its jobs, and what may have begun before them; all in whole ms.

    `first` is what goes before all: work, period and jitter. Of a `supply` there is a budget in each period.
    """

    def __init__(
        self,
        number: int,
        threads: Any,
        rivals: list[int],
        first: Any,
        figures: Any,
        supply: tuple[int, int] | None,
    ) -> None:
        """`figures` are periods, jitters and times of all threads, the longest section, and the executor's kind."""
        self.number, self.first, self.supply = number, first, supply
        self.period, self.jitter, self.cost, self.section, self.kind = figures
        executor = threads[number]["executor"]
        rivals = [item for item in rivals if self.cost[item]]  # what takes no time delays nothing
        self.fellows = [item for item in rivals if threads[item]["executor"] is executor]
        self.others = [item for item in rivals if item not in self.fellows]
        self.urgent = [item for item in self.fellows if self.kind != "callback_group" or self._is_urgent(threads, item)]
        self.less = [item for item in self.fellows if item not in self.urgent]
        self.is_held = any(threads[item]["section"] for item in (*self.fellows, number))

    def response(self, chains: Chains) -> int:
        """By looking at every ms of the busy period at which a job may come; `LATE` without a bound."""
        every = [*self.urgent, self.number, *self.others]
        found = [LATE, *([] if self.has_no_end(self.others, strictly=True) else self.in_lines(chains))]
        if not self.has_no_end(every, self.blocked):
            busy = self.busy()
            found += [self.among_strangers(busy), *self.in_chain(busy, chains)]
        return min(found)

    def _is_urgent(self, threads: Any, item: int) -> bool:
        mine, theirs = threads[self.number]["priority"], threads[item]["priority"]
        return goes_first(theirs, mine, (self.period[item], item), (self.period[self.number], self.number))

    @property
    def blocked(self) -> int:
        return max([self.section, *(self.cost[item] for item in self.less)])

    def has_no_end(self, every: list[int], blocked: int = 0, *, strictly: bool = False) -> bool:
        """Whether a busy period of these may go on for ever, or releases may be late for ever.

        With `strictly` also where they take all the time there is, and nothing is late.
        """
        load = sum((Fraction(self.cost[item], self.period[item]) for item in every), Fraction(0))
        load += sum((Fraction(*item[:2]) for item in self.first), Fraction(0))
        latest = max([blocked, *(self.jitter[item] for item in every), *(item[2] for item in self.first)])
        if self.supply is not None:
            load += Fraction(self.supply[1] - self.supply[0], self.supply[1])
            latest = max(latest, int(self.supply[0] < self.supply[1]))
        return load > 1 or latest >= LATE // 2 or (load == 1 and (strictly or latest > 0))

    def came(self, items: list[int], until: int) -> int:
        """The work of jobs that are released in [0, until]."""
        return sum(((until + self.jitter[item]) // self.period[item] + 1) * self.cost[item] for item in items)

    def preempting(self, end: int) -> int:
        """The work of what preempts, released in [0, end)."""
        return self.came(self.others, end - 1) + sum(
            -(-(end + late) // every) * taken for taken, every, late in self.first
        )

    def settled(self, fixed: int) -> int:
        """When so much is done, and what preempts it."""
        end = fixed
        while fixed + self.preempting(end) > supplied(self.supply, end):
            end += 1
        return end

    def busy(self) -> int:
        """The longest busy period."""
        inside, busy = [*self.urgent, self.number], 1
        while self.blocked + self.came(inside, busy - 1) + self.preempting(busy) > supplied(self.supply, busy):
            busy += 1
            if busy > MOST_MS:
                return 0
        return busy

    def before_start(self, fixed: int, inner: list[int], sooner: int) -> int:
        """What of others in the executor goes before a job that waits for so much besides: what comes by its start.

        Where something has begun before, however little, all starts are that little `sooner`: what comes then waits.
        """
        start = fixed
        while True:
            at = start - sooner
            taken = sum(((at + late) // every + 1) * work for work, every, late in self.first)
            done = fixed + self.came(inner, at) + self.came(self.others, at) + taken
            now, then = (supplied(self.supply, time) for time in (start, start + 1))
            if now >= done and (sooner or then > now):
                return self.came(inner, at)
            start += 1

    def among_strangers(self, busy: int) -> int:
        """Job after job; `LATE` where the busy period does not end."""
        number, own = self.number, self.cost[self.number]
        if not busy:
            return LATE
        if self.kind == "fifo":
            inside = [*self.urgent, number]
            return max(self.settled(self.blocked + self.came(inside, at)) - at for at in range(busy))
        found, jobs = 0, 0
        while not jobs or jobs * self.period[number] - self.jitter[number] < busy:
            fixed = self.blocked + jobs * own
            end = self.settled(fixed + own + self.before_start(fixed, self.urgent, int(self.blocked > 0)))
            found = max(found, end - max(0, jobs * self.period[number] - self.jitter[number]))
            jobs += 1
        return found

    def in_chain(self, busy: int, chains: Chains) -> Iterator[int]:
        """Where others never wait while it does: they have run until it comes, at most, and for no longer."""
        number, own = self.number, self.cost[self.number]
        kin = [item for item in self.fellows if chains.never_together(item, number)]
        if not kin or not busy:
            return
        strangers = [item for item in self.urgent if item not in kin]
        begun = (
            (max([self.section, *(self.cost[item] for item in self.less if item not in kin)]), 0),
            (0, max([0, *(self.cost[item] for item in self.less if item in kin)])),
        )
        longest = 0
        for at in range(busy):
            ran = self.came([item for item in kin if item in self.urgent], at) + self.came([number], at) - own
            for block, begun_own in begun:
                fixed = block + min(at, ran + begun_own)
                if self.kind == "fifo":
                    inner = self.came(strangers, at)
                else:
                    inner = self.before_start(fixed, strangers, int(block > 0))
                longest = max(longest, self.settled(fixed + inner + own) - at)
        yield longest

    def in_lines(self, chains: Chains) -> Iterator[int]:
        """As jobs come, behind one of each line, where all are in lines."""
        is_preempted = bool(self.others or self.first or self.supply is not None)
        if self.kind != "fifo" or (self.is_held and is_preempted):
            return
        lines = chains.lines([*self.fellows, self.number])
        if lines is not None:
            apart = [item for item in self.fellows if not chains.never_together(item, self.number)]
            waiting = sum(max((self.cost[item] for item in line if item in apart), default=0) for line in lines)
            yield self.settled(self.section + self.cost[self.number] + waiting)


class Chains:
    """Which threads never wait at the same time: by what releases each, how long it takes, and its releases in ms."""

    def __init__(
        self, source: Mapping[int, int], least: Callable[[list[int]], int], period: list[int], jitter: list[int]
    ) -> None:
        """`least` gives the longest time of threads in a row, the first one first."""
        self.source, self.least, self.period, self.jitter = source, least, period, jitter

    def before(self, number: int) -> Iterator[int]:
        """A thread, and all before it."""
        yield number
        while number in self.source:
            number = self.source[number]
            yield number

    def never_together(self, one: int, other: int) -> bool:
        """Whether the later of two in a chain ends before the earlier one is released again, or what is before that."""
        return self.has_ended(one, other) or self.has_ended(other, one)

    def has_ended(self, first: int, last: int) -> bool:
        """Whether one has ended when another before it, or what is before that, is released again."""
        part: list[int] = []
        is_before = False
        for item in self.before(last):
            part.insert(0, item)
            is_before = is_before or item == first
            if is_before and self.least(part) <= self.period[item] - self.jitter[item]:
                return True
        return False

    def lines(self, numbers: list[int]) -> list[list[int]] | None:
        """Threads by the first of their chain, or each alone where two may wait; None where one may wait twice."""
        found: dict[int, list[int]] = {}
        for number in numbers:
            first = [item for item in self.before(number) if item in numbers][-1]
            found.setdefault(first, []).append(number)
        if not all(self.never_together(item, item) for item in numbers):
            return None
        lines = []
        for line in found.values():
            is_one = all(self.never_together(one, other) for one in line for other in line)
            lines += [line] if is_one else [[item] for item in line]
        return lines
