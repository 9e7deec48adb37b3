"""How often threads come in busy windows of their core, and which of them in one (docs/semantics.md, section 4.9).

Behind a thread that does not run in such a window come the jobs that are on their way as it begins; behind the thread
of the window, or the last of its chain, these and one for each job that has ended; at once behind another one that
runs, as many as of that. Of those that come at once behind one that does not run only what is behind one and the same
thread does in one window, and what is before that one comes late.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from .pieces import distance
from .problem import as_list
from .stretches import Releases, earliest

if TYPE_CHECKING:
    from .scheduling import Job, Scheduling


MOST_ON_WAY = 16
"""No more jobs than so many are counted on a way by how long the thread before it takes."""


class Behind(NamedTuple):
    """How often jobs come that the last thread of a window releases, by way of what is between.

    No more than `besides`, and once for each job of the window that has ended before; and, where each job comes within
    `reach` of the earliest time at which that of the window which sends it may be released, one every `period`.
    """

    besides: int
    reach: Fraction | None = None
    period: int = 0

    def most(self, ended: int, release: Fraction | None) -> int:
        """How many come until the end of a job of the window, released so long after that began; None of any."""
        whole = ended + self.besides
        if release is None or self.reach is None:
            return whole
        return min(whole, int((release + self.reach) // self.period))

    def looks(self, ended: int, since: Fraction) -> Iterator[Fraction]:
        """The releases behind one from which on one more job may come."""
        if self.reach is not None:
            for number in range(self.most(ended, since) + 1, ended + self.besides + 1):
                yield number * self.period - self.reach


class Case(NamedTuple):
    """When jobs come in one kind of window: its own, and those that go first; None of one late without a bound.

    Those `behind` its last thread come no more often than that lets them.
    """

    own: Releases | None
    rivals: Mapping[Job, Releases | None]
    behind: Mapping[Job, Behind]

    @property
    def has_limits(self) -> bool:
        """Whether some jobs come so many times only, or no more often than others end."""
        return bool(self.behind) or any(each is not None and each.most is not None for each in self.rivals.values())


class OnWay(NamedTuple):
    """Of the jobs of a thread that have ended by a time, or before it, the most that release another one since then."""

    by: int | None
    before: int | None


class Successors:
    """When the threads of a design come in busy windows of others."""

    def __init__(self, scheduling: Scheduling) -> None:
        self.known = scheduling
        self._settled = {job for job in scheduling.jobs if self._is_settled(job)}

    def is_plain(self, job: Job) -> bool:
        """Whether priorities alone schedule a thread that takes some time."""
        return self.known.reading.executor_of(job[0]) is None and self.may_be_in_window(job)

    def may_be_in_window(self, job: Job) -> bool:
        """Whether a thread takes some time without a reservation, by itself or in an executor."""
        known, reading = self.known, self.known.reading
        if job[1] != "timer" or reading.reservation_of(job[0]) is not None or known.order(job) is not None:
            return False
        return known.times(job)[1] > 0

    def is_stated(self, name: str) -> bool:
        """Whether the response time of a thread is stated."""
        return self.known.reading.get(name, "response_time") is not None

    def _is_settled(self, job: Job) -> bool:
        """Whether a thread states one processor, core and priority, and priorities alone schedule all of it."""
        name, problem = job[0], self.known.problem
        if not self.is_plain(job) or self.known.reading.protocol(name) == "hybrid":
            return False
        slots = as_list(problem.component(name).get("processor"))
        cores = [core for core in problem.stated_cores(name) if core.isdigit()]
        return (
            not self.is_stated(name)
            and str(problem.settled.get((name, "priority"))).isdigit()
            and len(slots) == 1
            and (len(cores) == 1 or problem.most_cores(slots[0]) == 1)
        )

    def _senders(self, job: Job, level: Job) -> list[Job]:
        """What comes before a thread in its chain, on its core, where all are stated as what the window is of."""
        if job[1] != "timer" or not self._settled.issuperset({job, level}):
            return []
        here: list[Job] = [(name, "timer") for name in self.known.chains.chain(job[0])[:-1]]
        core = self.known.core(job)
        if core != self.known.core(level):
            return []
        return [each for each in here if each in self._settled and self.known.core(each) == core]

    def _at_once_behind(self, job: Job, level: Job) -> Job | None:
        """What releases a thread of its core as soon as it ends."""
        sender = self.known.chains.sender(job[0]) if job[1] == "timer" else None
        if sender is None or (sender, "timer") not in self._senders(job, level) or self.known.chains.way(job[0]):
            return None
        return sender, "timer"

    def _runs(self, job: Job, level: Job) -> bool:
        """Whether a thread runs in a busy window of another one, or of itself."""
        return job == level or self.known.goes_before(job, level)

    def on_way(self, sender: Job, job: Job) -> OnWay:
        """How many jobs are on their way from the end of one thread to the release of another one behind it."""
        chains, chain = self.known.chains, self.known.chains.chain(job[0])
        between = chain[chain.index(sender[0]) + 1 : -1]
        last = chains.way(job[0])
        ways = last + (chains.way(between[0]) if between else 0)
        is_cut = self.known.section(sender[0]) > 0
        by: list[int] = []
        before: list[int] = []
        if not between:
            shortest = self.known.times(sender)[0]
            if not ways:
                by, before = [1], [0]
            else:
                by += [number for number in range(1, MOST_ON_WAY + 1) if ways < number * shortest and not is_cut][:1]
                before += [number for number in range(1, MOST_ON_WAY + 1) if ways <= number * shortest][:1]
        releases, takes = self.known.releases(sender), self.known.windows.bound([sender[0], *between])
        apart = None if releases is None else distance(releases)
        if takes is not None and apart is not None and takes + last <= apart:
            by.append(1)
            before.append(1)
        rest, passed = self.known.windows.bound(between), self.known.leaving(sender[0])
        if rest is not None and passed is not None:
            if not is_cut:
                by.append(sum((rest + ways + late) // period + 1 for period, late in passed))
            before.append(sum(-(-(rest + ways + late) // period) for period, late in passed))
        return OnWay(min(by, default=None), min(before, default=None))

    def comes(self, job: Job, level: Job, parts: int | None = 1, *, is_own: bool = False) -> Releases | None:
        """When jobs come in a busy window of another one, or of itself; None where they may be late without a bound.

        The core may leave the window for less urgent threads between `parts`; None where it does so for each job. What
        `is_own`, the first of the window, comes once or as ever.
        """
        found, most = self.known.coming(job), list[int]()
        sender = self._at_once_behind(job, level)
        if sender is not None and self._runs(sender, level):
            up = self.comes(sender, level, parts, is_own=is_own)
            found = None if up is None else earliest(up, found)  # whatever the least distance of the sender
            most += [up.most or 1] if up is not None and (up.most or not up.streams) else []
        number = self._most(job, level, parts)
        if number is not None and (number == 1 or not is_own):
            most.append(number)
        if not most:
            return found
        return Releases((), most=min(most)) if found is None else replace(found, most=min(most))

    def _most(self, job: Job, level: Job, parts: int | None) -> int | None:
        """No more jobs than so many come in a window, by all ways from threads before it on the core; None: any."""
        found = list[int]()
        for other in self._senders(job, level):
            way = self.on_way(other, job)
            if not self._runs(other, level):
                found += [parts * way.by] if parts is not None and way.by is not None else []
            elif way.before is not None and (up := self._most(other, level, parts)) is not None:
                found.append(up + way.before)
        return min(found, default=None)

    def _besides(self, job: Job, level: Job, last: Job) -> int | None:
        """How many jobs come in a window besides one for each job of the last thread that has ended; None: any."""
        found = list[int]()
        for other in self._senders(job, level):
            before = self.on_way(other, job).before
            up = 0 if other == last else self._besides(other, level, last) if self._runs(other, level) else None
            found += [] if before is None or up is None else [before + up]
        return min(found, default=None)

    def _behind(self, job: Job, level: Job, own: Job, last: Job) -> Behind | None:
        """How often jobs come that the last thread of a window releases; None of what it does not."""
        found: list[Behind] = []
        besides = self._besides(job, level, last)
        if besides is not None:
            found.append(Behind(besides, *self._reach(job, own)))
        sender = self._at_once_behind(job, level)
        if sender is not None and sender != last and self._runs(sender, level):
            up = self._behind(sender, level, own, last)
            found += [] if up is None else [up]
        if not found:
            return None
        reach = min((each.reach for each in found if each.reach is not None), default=None)
        return Behind(min(each.besides for each in found), reach, max(each.period for each in found))

    def _reach(self, job: Job, own: Job) -> tuple[Fraction | None, int]:
        """How long after the first of a window may be released at the earliest what it sends comes, and its period."""
        releases, chain = self.known.releases(own), self.known.chains.chain(job[0])
        takes = self.known.windows.bound(chain[chain.index(own[0]) : -1])
        if own not in self._settled or releases is None or len(releases.streams) != 1 or takes is None:
            return None, 0
        ((period, late),) = releases.streams
        return late + takes + self.known.chains.way(job[0]), period

    def head(self, job: Job, level: Job) -> Job | None:
        """The less urgent thread behind which a job comes at once, by itself or by what is between; None without."""
        sender = self._at_once_behind(job, level)
        if sender is None:
            return None
        return self.head(sender, level) if self._runs(sender, level) else sender

    def broken(self, own: Job, level: Job, rivals: Sequence[Job], parts: int | None) -> Case:
        """What comes in a window of a chain with breaks: of so many parts, or of as many as jobs of it make."""
        return Case(self.comes(own, level, None), {job: self.comes(job, level, parts) for job in rivals}, {})

    def cases(self, own: Job, level: Job, last: Job, rivals: Sequence[Job]) -> Iterator[Case]:
        """What comes in each kind of busy window of a level: behind none of the less urgent threads, or behind one.

        Its own jobs end with those of the `last` of its threads.
        """
        heads = {job: self.head(job, level) for job in rivals}
        behind = {job: found for job in rivals if (found := self._behind(job, level, own, last)) is not None}
        mine = self.head(own, level)
        begins: list[Job | None] = [None, *dict.fromkeys(head for head in heads.values() if head is not None)]
        for begin in begins if mine is None else [mine]:
            coming = {job: self._comes_late(job, level, begin) for job in rivals if heads[job] in (None, begin)}
            yield Case(self.comes(own, level, is_own=True), coming, behind)

    def _comes_late(self, job: Job, level: Job, begin: Job | None) -> Releases | None:
        """When a rival comes in windows that begin as a thread ends: one that is before that in its chain, later."""
        releases = self.comes(job, level)
        chain = [] if begin is None else self.known.chains.chain(begin[0])
        if begin is None or releases is None or job[1] != "timer" or job[0] not in chain[:-1]:
            return releases
        first, passed = self.known.releases((chain[0], "timer")), self.known.leaving(begin[0])
        if passed is None or first is None or first.apart or releases.apart:
            return releases
        if len(passed) != 1 or len(releases.streams) != 1 or passed[0][0] != releases.streams[0][0]:
            return releases
        (period, late), (_, more) = releases.streams[0], passed[0]
        part = chain[chain.index(job[0]) :]
        least = Fraction(sum(self.known.times((name, "timer"))[0] for name in part))
        least += sum((self.known.chains.way(name, least=True) for name in part[1:]), Fraction(0))
        return replace(releases, streams=((period, min(late, more + least - period)),))
