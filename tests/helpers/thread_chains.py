"""Chains of threads on a core (docs/semantics.md, section 4.9), in whole ms: nothing of the product's analysis is here.

Connections take no time here, so that only what a callback group has begun breaks a window.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import count
from typing import Any, NamedTuple, TypeAlias

from tests.helpers.thread_executors import LATE, MOST_MS, Chains


class Comes(NamedTuple):
    """Jobs every so often, up to so late, in a busy window `most` of them.

    Until the end of a job of the window no more than so many `behind` it, and one for each job before that one; and
    one every period from `reach` before the release of that job on.
    """

    period: int
    late: int
    most: int | None = None
    behind: int | None = None
    reach: int | None = None

    @property
    def has_limit(self) -> bool:
        """Whether something else than its period and jitter says how often it comes."""
        return self.most is not None or self.behind is not None


class Stream(NamedTuple):
    """Jobs of so much work that come so; those of what is over have ended when a job is released."""

    work: int
    comes: Comes
    is_over: bool = False

    def looks(self, ended: int, since: int) -> list[int]:
        """The releases of a job of the window, behind one, from which on one more job may come."""
        if self.comes.behind is None or self.comes.reach is None:
            return []
        ways = [number * self.comes.period - self.comes.reach for number in range(1, ended + self.comes.behind + 1)]
        return [each for each in ways if each > since]

    def came(self, end: int, ended: int, release: int | None) -> int:
        """The work of the jobs in [0, end), until the end of a job of the window that has such a release, if any.

        So many jobs of the window have ended before.
        """
        count = max(0, -(-(end + self.comes.late) // self.comes.period))
        if self.comes.most is not None:
            count = min(count, self.comes.most)
        if self.comes.behind is not None:
            count = min(count, ended + self.comes.behind)
        if self.comes.reach is not None and release is not None:
            count = min(count, (release + self.comes.reach) // self.comes.period)
        return count * self.work

    def soonest(self, job: int) -> int:
        """When a job, the first of which is 1, may be released at the earliest."""
        if self.comes.most is not None and job > self.comes.most:
            return LATE
        return max(0, (job - 1) * self.comes.period - self.comes.late)


def longest(
    own: Stream, rivals: Sequence[Stream], blocked: int, *, own_over: bool, counted: Stream, tail: int = 0
) -> int:
    """The greatest time from a release of `counted` to the end of `own` over the jobs of the busy period.

    It is `LATE` without a bound. With `own_over` an earlier job has ended at the release of the next one, and a `tail`.
    """
    every = [each for each in (own, *rivals) if each.comes.most is None]
    load = sum((Fraction(each.work, each.comes.period) for each in every), Fraction(0))
    latest = max([blocked, tail, *(each.comes.late for each in every)])
    if load > 1 or latest >= LATE // 2 or (load == 1 and latest):
        return LATE

    def ends(job: int, ended: int, release: int | None = None) -> int:
        end = 1
        while (need := blocked + tail + job * own.work + sum(each.came(end, ended, release) for each in rivals)) > end:
            end = need
            if end > MOST_MS:
                return LATE
        return end

    found = 0
    for job in count(1):
        soonest, latest = own.soonest(job), ends(job, job - 1)
        if latest == LATE:
            return LATE
        for release in {soonest, *(at for each in rivals for at in each.looks(job - 1, soonest) if at < latest)}:
            end = ends(job, job - 1, release)
            ran = tail + (job - 1) * own.work if own_over else 0
            ran += sum(each.came(end, job - 1, release) for each in rivals if each.is_over) if own_over else 0
            found = max(found, end - max(release, counted.soonest(job), ran))
        if ends(job, job) <= own.soonest(job + 1) or (load == 1 and latest > MOST_MS // 2):
            return found  # where there is as much work as time, all jobs of the hyperperiod before are as late
    raise AssertionError


Row: TypeAlias = tuple[int, ...]
Given: TypeAlias = tuple[list[int], list[Stream], int, list[int]]
"""Rivals, what else goes first, blocking, and what a callback group may have begun."""
Rivals: TypeAlias = Callable[[Row], Given]
"""Gives what goes before the threads of a row."""


class OnCore:
    """The threads that priorities alone schedule, and what the chains of them wait for on a core.

    `windows` are the longest times from the release of the first to the end of the last of threads in a row, `lags`
    those from the latest release of the first, of rows that something releases, and of single threads, too.
    """

    def __init__(
        self,
        source: Mapping[int, int],
        figures: Any,
        is_alone: Sequence[bool | None],
        is_settled: Sequence[bool],
        homes: Sequence[Any],
    ) -> None:
        """`figures` are cores, levels, periods, times, context switches included, least times and sections.

        A thread `is_alone` that is an OS thread by itself, None of one in a reservation; and `is_settled` where its
        core and priority are stated, each as one number. The `homes` are their executors.
        """
        self.source = source
        self.cores, self.levels, self.period, self.cost, self.shortest, self.section = figures
        self.homes = homes
        self.is_plain = [alone is not None and cost > 0 for alone, cost in zip(is_alone, self.cost, strict=True)]
        self.is_alone = [bool(alone) and plain for alone, plain in zip(is_alone, self.is_plain, strict=True)]
        self.is_settled = [one and other for one, other in zip(self.is_alone, is_settled, strict=True)]
        work = {row: sum(self.cost[item] for item in row) for row in self._rows()}
        self.windows = {row: takes for row, takes in work.items() if len(row) > 1}
        self.lags = {row: takes for row, takes in work.items() if row[0] in source and self._may_lag(row)}

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

    def _may_lag(self, row: Row) -> bool:
        return len(row) > 1 or self.is_alone[row[0]]

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
            and (self.is_plain[item] and self.is_alone[number])
            and self.cores[item] == self.cores[number]
            and self.levels[item] <= self.levels[number]
            and chains.never_together(item, number)
        ]

    def comes(self, item: int, level: int, chains: Chains, *, ends: Row = (), is_own: bool = False) -> Comes:
        """How often a thread comes in a busy window of another one, or of threads in a row, that `ends` with these.

        Behind one that does not run in such a window it comes as often as it may be on its way from there, behind the
        last one that often, and once for each job of that, behind another one that does no more often than that one.
        What `is_own`, the first of the window, comes once or as ever.
        """
        found = self.comes_inside(item, chains)
        limits, behind, reach = list[int](), list[int](), list[int]()
        most = self._most(item, level, chains)
        if most is not None and (most == 1 or not is_own):
            limits.append(most)
        earlier = self._besides(item, level, ends[-1], chains) if ends else None
        if earlier is not None:
            behind.append(earlier)
            if self.is_settled[ends[0]]:
                chain = self.chain(item)
                reach.append(chains.jitter[ends[0]] + chains.least(chain[chain.index(ends[0]) : -1]))
        sender = self._before(item, level)
        if sender is not None and self.levels[sender] <= self.levels[level]:
            up = self.comes(sender, level, chains, ends=ends, is_own=is_own)
            found = up._replace(late=min(up.late, found.late))
            limits += [] if found.most is None else [found.most]
            behind += [] if found.behind is None else [found.behind]
            reach += [] if found.reach is None else [found.reach]
        return Comes(found.period, found.late, *(min(each, default=None) for each in (limits, behind, reach)))

    def _most(self, item: int, level: int, chains: Chains) -> int | None:
        """The most jobs of a thread in a window of a level, of those that are on their way as it begins."""
        found = list[int]()
        for before in self._all_before(item, level):
            by, earlier = self._on_way(before, item, chains)
            if self.levels[before] > self.levels[level]:
                found += [] if by is None else [by]
            elif earlier is not None and (up := self._most(before, level, chains)) is not None:
                found.append(up + earlier)
        return min(found, default=None)

    def _besides(self, item: int, level: int, last: int, chains: Chains) -> int | None:
        """The most jobs of a thread in a window besides one for each job of its last thread that has ended."""
        found = list[int]()
        for before in self._all_before(item, level):
            earlier = self._on_way(before, item, chains)[1]
            up = 0 if before == last else None
            if up is None and self.levels[before] <= self.levels[level]:
                up = self._besides(before, level, last, chains)
            found += [] if up is None or earlier is None else [up + earlier]
        return min(found, default=None)

    def comes_inside(self, item: int, chains: Chains, begun: Sequence[int] = ()) -> Comes:
        """The releases of a thread in a window: no more than of those of its executor that release each other up to it.

        Threads that may have begun before the window, `begun`, and those before them are left out.
        """
        first, late = item, chains.jitter[item]
        while self.homes[item] and self.is_plain[first] and first in self.source:
            before = self.source[first]
            if self.homes[before] is not self.homes[item] or not self.is_plain[before] or before in begun:
                break
            first, late = before, min(late, chains.jitter[before])
        return Comes(self.period[item], late)

    def _all_before(self, item: int, level: int) -> list[int]:
        """What comes before a thread in its chain, on its core, where all are settled as what the window is of."""
        here = [each for each in self.chain(item)[:-1] if self.is_settled[each]]
        are_settled = self.is_settled[item] and self.is_settled[level]
        return [each for each in here if are_settled and self.cores[each] == self.cores[item] == self.cores[level]]

    def _on_way(self, before: int, item: int, chains: Chains) -> tuple[int | None, int | None]:
        """How many jobs that have ended by a time, and before it, may release a thread behind them since then."""
        if self.source[item] == before:
            return 1, 0
        chain = self.chain(item)
        between = chain[chain.index(before) + 1 : -1]
        if chains.least([before, *between]) <= self.period[before] - chains.jitter[before]:
            return 1, 1
        rest, passed = chains.least(between), chains.jitter[between[0]]
        if max(rest, passed) >= LATE // 10:
            return None, None
        whole, earlier = (rest + passed) // self.period[before] + 1, -(-(rest + passed) // self.period[before])
        return None if self.section[before] else whole, earlier

    def _before(self, item: int, level: int) -> int | None:
        """What releases a thread on its core, where both are settled as what the window is of."""
        before = self.source.get(item)
        return before if before in self._all_before(item, level) else None

    def head(self, item: int, level: int) -> int | None:
        """The less urgent thread behind which one comes, by itself or by what is between; None without."""
        before = self._before(item, level)
        if before is None or self.levels[before] > self.levels[level]:
            return before
        return self.head(before, level)

    def cases(self, row: Row, level: int, chains: Chains) -> list[list[Comes]]:
        """What all threads do in each kind of busy window of a row: behind no less urgent thread, or behind one."""
        own = row[0]
        numbers = range(len(self.cost))
        heads = [
            self.head(item, level) if self.cores[item] == self.cores[level] and self.levels[item] <= self.levels[level]
            else None for item in numbers
        ]  # fmt: skip
        mine = self.head(own, level)
        begins = [None, *{head for head in heads if head is not None}] if mine is None else [mine]
        found = []
        for begin in begins:
            comes = [self._comes_late(item, level, row, begin, chains) for item in numbers]
            absent = [head not in (None, begin) for head in heads]
            comes = [
                each._replace(most=0) if is_absent else each for is_absent, each in zip(absent, comes, strict=True)
            ]
            comes[own] = self.comes(own, level, chains, is_own=True)
            found.append(comes)
        return found

    def _comes_late(self, item: int, level: int, row: Row, begin: int | None, chains: Chains) -> Comes:
        """How a rival comes in windows that begin as a thread ends: one that is before that in its chain, later."""
        comes = self.comes(item, level, chains, ends=row)
        before = [] if begin is None else self.chain(begin)
        if item not in before[:-1]:
            return comes
        passed = next(chains.jitter[other] for other, source in self.source.items() if source == begin)
        shortest = sum(self.shortest[other] for other in before[before.index(item) :])
        return comes._replace(late=min(comes.late, passed + shortest - comes.period))

    def widened(self, chains: Chains, rivals_of: Rivals) -> tuple[dict[Row, int], dict[Row, int]]:
        """Windows and lags as they are with what is known."""
        windows = {row: self._window(row, None, chains, rivals_of(row)) for row in self.windows}
        lags = {}
        for row in self.lags:
            first = self.chain(row[0])[0]
            counted = Stream(0, Comes(self.period[first], 0))
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
        given: Given,
        *,
        counted: Stream | None = None,
    ) -> int:
        """From a release (as is `counted`) to the end of a thread, some of whose rivals may be over."""
        rivals, first, blocked, _ = given
        over = self.over(number, chains)
        found = []
        for comes in self.cases((number,), number, chains):
            own = Stream(self.cost[number], comes[number])
            every = [Stream(self.cost[item], comes[item], item in over) for item in rivals]
            found.append(longest(own, [*every, *first], blocked, own_over=bool(over), counted=counted or own))
        return max(found)

    def _window(self, row: Row, counted: Stream | None, chains: Chains, given: Given) -> int:
        rivals, first, blocked, begun = given
        if begun:
            sections = max((self.section[item] for item in self._less_urgent(row)), default=0)
            as_rivals = ([*rivals, *begun], first, sections, list[int]())
            return min(self._broken(row, counted, chains, given), self._window(row, counted, chains, as_rivals))
        level = max(row, key=lambda item: self.levels[item])
        has_ended = chains.has_ended(row[0], row[-1])
        over = [item for item in rivals if has_ended and self._is_over(item, row, chains)]
        in_turn = 0 if has_ended else self._in_turn(row)
        found = []
        for comes in self.cases(row, level, chains):
            every = [Stream(self.cost[item], comes[item], item in over) for item in rivals] + first
            own = Stream(sum(self.cost[item] for item in row[in_turn:]), comes[row[0]])
            every += [Stream(self.cost[item], comes[row[0]]) for item in row[:in_turn]]
            found.append(longest(own, every, blocked, own_over=has_ended, counted=counted or own))
        return max(found)

    def _broken(self, row: Row, counted: Stream | None, chains: Chains, given: Given) -> int:
        """The window of a row of which a callback group may begin something less urgent before each thread."""
        rivals, first, blocked, begun = given
        has_ended = chains.has_ended(row[0], row[-1])
        over = [item for item in rivals if has_ended and self._is_over(item, row, chains)]
        comes = self.comes_inside(row[0], chains, begun)
        every = [Stream(self.cost[item], self.comes_inside(item, chains, begun), item in over) for item in rivals]
        every += first
        whole = Stream(sum(self.cost[item] for item in row), comes)
        begins, tail = counted or whole, sum(self.cost[item] for item in row[1:])
        alone = longest(Stream(tail, Comes(MOST_MS, 0, 1)), every, blocked, own_over=False, counted=Stream(0, comes))
        if has_ended and alone <= self.period[row[0]] - chains.jitter[row[0]] - chains.least(list(row)):
            tail = 0
        found = [longest(whole, every, len(row) * blocked, own_over=True, counted=begins, tail=tail)]
        if not has_ended:
            last = Stream(self.cost[row[-1]] + (len(row) - 1) * blocked, comes)
            before = [Stream(self.cost[item], comes) for item in row[:-1]]
            found.append(longest(last, [*before, *every], blocked, own_over=False, counted=begins))
        return max(found)

    def _less_urgent(self, row: Row) -> list[int]:
        """The threads of a core that are less urgent than each of some threads there."""
        level = max(self.levels[item] for item in row)
        here = [item for item in range(len(self.cost)) if self.cores[item] == self.cores[row[0]]]
        return [item for item in here if self.levels[item] > level]

    def _in_turn(self, row: Row) -> int:
        """The place of the first thread of a row that is less urgent than all behind it, where later jobs wait.

        The last one where an executor may take a next job of an earlier one that nothing interrupts.
        """
        if any(self.homes[item] and self.section[item] for item in row[:-1]):
            return len(row) - 1
        levels = [self.levels[item] for item in row]
        return next(place for place, level in enumerate(levels) if all(level > other for other in levels[place + 1 :]))

    def _is_over(self, item: int, row: Row, chains: Chains) -> bool:
        homes = [self.homes[each] for each in row if self.homes[each]]
        if not self.is_plain[item] or any(home is not self.homes[item] for home in homes):
            return False
        if item in self.chain(row[0]):
            return chains.has_ended(item, row[-1])
        return row[-1] in self.chain(item) and chains.has_ended(row[0], item)
