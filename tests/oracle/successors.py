"""How often threads come in busy windows of their core, and which of them in one (docs/semantics.md, section 4.9).

Behind a thread that does not run in such a window one job comes, behind one that does as many as of that. Of those that
come once only what is behind one and the same thread does in one window, and what is before that one comes late.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from .problem import as_list
from .stretches import Releases

if TYPE_CHECKING:
    from .scheduling import Job, Scheduling


class Case(NamedTuple):
    """When jobs come in one kind of window: its own, and those that go first; None of one late without a bound."""

    own: Releases | None
    rivals: Mapping[Job, Releases | None]


class Successors:
    """When the threads of a design come in busy windows of others."""

    def __init__(self, scheduling: Scheduling) -> None:
        self.known = scheduling
        self._settled = {job for job in scheduling.jobs if self._is_settled(job)}

    def is_plain(self, job: Job) -> bool:
        """Whether priorities alone schedule a thread that takes some time."""
        known, reading = self.known, self.known.reading
        is_alone = reading.executor_of(job[0]) is None and reading.reservation_of(job[0]) is None
        return job[1] == "timer" and is_alone and known.order(job) is None and known.times(job)[1] > 0

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

    def _sender(self, job: Job, level: Job) -> Job | None:
        """What releases a thread on its core, where both are stated as what the window is of."""
        sender = self.known.chains.sender(job[0]) if job[1] == "timer" else None
        if sender is None:
            return None
        here: list[Job] = [(sender, "timer"), job, level]
        if not self._settled.issuperset(here) or len({self.known.core(each) for each in here}) > 1:
            return None
        return here[0]

    def _runs(self, job: Job, level: Job) -> bool:
        """Whether a thread runs in a busy window of another one, or of itself."""
        return job == level or self.known.goes_before(job, level)

    def comes(self, job: Job, level: Job) -> Releases | None:
        """When jobs come in a busy window of another one, or of itself; None where they may be late without a bound."""
        sender = self._sender(job, level)
        if sender is None:
            return self.known.releases(job)
        most = self.known.chains.way(job[0])
        if self._runs(sender, level):
            found = self.known.releases(job) if most else self.comes(sender, level)
            return None if found is None else Releases(found.streams)  # whatever the least distance of the sender
        if not most or (most < self.known.times(sender)[0] and not self.known.section(sender[0])):
            return Releases(())
        return self.known.releases(job)

    def head(self, job: Job, level: Job) -> Job | None:
        """The less urgent thread behind which a job comes at once, by itself or by what is between; None without."""
        sender = self._sender(job, level)
        if sender is None or self.known.chains.way(job[0]):
            return None
        return self.head(sender, level) if self._runs(sender, level) else sender

    def _comes_in(self, job: Job, level: Job, parts: int | None) -> Releases | None:
        """When jobs come in a window that the core may leave for less urgent threads between so many parts.

        Once for each of these where it comes once in each; without `parts`, and of a job of its own, as often as ever.
        """
        sender = self._sender(job, level)
        if sender is None:
            return self.known.releases(job)
        most = self.known.chains.way(job[0])
        if self._runs(sender, level):
            found = self.known.releases(job) if most else self._comes_in(sender, level, parts)
            return None if found is None else Releases(found.streams, most=found.most)
        comes = self.known.releases(job)
        is_soon = not most or (most < self.known.times(sender)[0] and not self.known.section(sender[0]))
        if parts is None or not is_soon:
            return comes
        return Releases((), most=parts) if comes is None else replace(comes, most=parts)

    def broken(self, own: Job, level: Job, rivals: Sequence[Job], parts: int | None) -> Case:
        """What comes in a window of a chain with breaks: of so many parts, or of as many as jobs of it make."""
        coming = {job: self._comes_in(job, level, parts) for job in rivals}
        return Case(self._comes_in(own, level, None), coming)

    def cases(self, own: Job, level: Job, rivals: Sequence[Job]) -> Iterator[Case]:
        """What comes in each kind of busy window of a level: behind none of the less urgent threads, or behind one."""
        heads = {job: self.head(job, level) for job in rivals}
        mine = self.head(own, level)
        begins: list[Job | None] = [None, *dict.fromkeys(head for head in heads.values() if head is not None)]
        for begin in begins if mine is None else [mine]:
            coming = [job for job in rivals if heads[job] in (None, begin)]
            yield Case(self.comes(own, level), {job: self._comes_late(job, level, begin) for job in coming})

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
        return Releases(((period, min(late, more + least - period)),))
