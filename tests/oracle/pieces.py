"""How long the pieces of a thread take, one after the other on its core and on accelerators: docs, section 4.7.

As all in `scheduling`, by playing the busiest stretch of what serves them, job by job.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from heapq import merge
from itertools import repeat
from typing import TYPE_CHECKING

from .stretches import Releases, has_no_end, play, play_inside

if TYPE_CHECKING:
    from .scheduling import Job, Scheduling

Work = tuple[Releases, int]
"""When jobs come at the earliest, and how long each takes."""


def piece_of(job: Job) -> int | None:
    """The place of a piece in its thread, from 0; None of a whole thread."""
    return int(job[1].removeprefix("piece ")) if job[1].startswith("piece ") else None


def distance(releases: Releases) -> Fraction | None:
    """The least time between two releases of a thread; None where it has one job alone."""
    if not releases.streams:
        return None
    least = Fraction(releases.apart)
    if len(releases.streams) == 1:
        period, late = releases.streams[0]
        least = max(least, period - late)
    return least


class Pieces:
    """What the pieces of threads take in a design; `spans` are their times from release to end, as last played."""

    def __init__(self, scheduling: Scheduling) -> None:
        self.scheduling = scheduling
        self.spans: dict[Job, Fraction | None] = {}

    def end(self, job: Job) -> Fraction | None:
        """The time from the release of its thread to the end of a piece; None without a bound."""
        known = self.scheduling
        name, place = job[0], piece_of(job)
        assert place is not None
        jobs = known.pieces_of(name)
        releases = known.releases((name, "timer"))
        begins = known.response[jobs[place - 1]] if place else Fraction(0)
        if known.response[jobs[-1]] is None or releases is None or begins is None:
            return None
        rivals = known.beside(job)
        urgent = [other for other in rivals if other[0] != name and known.goes_before(other, job)]
        waits = any(known.goes_before(job, other) for other in urgent)  # what is as urgent waits for other pieces
        if known.order(job) is None:
            self.spans[job] = self._on_core(job, urgent, waits)
        else:
            self.spans[job] = self._served(job, rivals, urgent, waits)
        found = [None if self.spans[job] is None else begins + (self.spans[job] or 0)]
        if known.order(job) is None and place:
            found.append(self._by_the_core(job, urgent, waits, releases))
        ends = min((each for each in found if each is not None), default=None)
        most = distance(releases)
        return None if ends is None or (most is not None and ends > most) else ends

    def _given(self, jobs: Sequence[Job]) -> list[Work] | None:
        """When such jobs come, and their work; None where one may be late without a bound."""
        found = []
        for job in jobs:
            releases, work = self.scheduling.coming(job), self.scheduling.times(job)[1]
            if work and releases is None:
                return None
            if work and releases is not None:
                found.append((releases, work))
        return found

    def _own(self, job: Job) -> list[Job]:
        """The other pieces of the thread that run where this one does."""
        return [other for other in self.scheduling.beside(job) if other[0] == job[0]]

    def _on_core(self, job: Job, urgent: Sequence[Job], waits: bool) -> Fraction | None:
        """From the release of a piece to its end: of one job alone, unless something waits for the other pieces."""
        releases = self.scheduling.releases(job) if waits else Releases(())
        before = self._given([*urgent, *(self._own(job) if waits else ())])
        return self._played(job, releases, Fraction(self.scheduling.times(job)[1]), before)

    def _by_the_core(self, job: Job, urgent: Sequence[Job], waits: bool, releases: Releases) -> Fraction | None:
        """From the release of the thread: as if the core worked while accelerators serve."""
        jobs = self.scheduling.pieces_of(job[0])
        so_far = jobs[: (piece_of(job) or 0) + 1]
        parts = [self.spans[each] if self.scheduling.order(each) else self.scheduling.times(each)[1] for each in so_far]
        if None in parts:
            return None
        work = sum((Fraction(part or 0) for part in parts), Fraction(0))
        return self._played(job, releases if waits else Releases(()), work, self._given(urgent))

    def _played(
        self, job: Job, releases: Releases | None, work: Fraction, before: list[Work] | None
    ) -> Fraction | None:
        shares = self.scheduling.shares(job)
        if releases is None or before is None or shares is None:
            return None
        if has_no_end([(releases, work), *before, *shares], 0):
            return None
        return play(releases, work, [*before, *shares])

    def _served(self, job: Job, rivals: Sequence[Job], urgent: Sequence[Job], waits: bool) -> Fraction | None:
        """On an accelerator, from the release of a piece to its end."""
        work = self.scheduling.times(job)[1]
        others = [other for other in rivals if other[0] != job[0]]
        if self.scheduling.order(job) == "fifo":
            given = self._given(others)
            if given is None:
                return None
            own = self._given([job, *self._own(job)])
            found = [None if own is None else queued(work, own, given)]
            found.append(self.scheduling.chains.in_lines(job, [*self._own(job), *others], ()))
            return min((each for each in found if each is not None), default=None)
        given = self._given(urgent)
        begun = max((self.scheduling.times(other)[1] for other in others if other not in urgent), default=0)
        if given is None:
            return None
        if waits:
            own = self._given([job, *self._own(job)])
            if own is None or has_no_end([*own, *given], begun):
                return None
            return play_inside([*own, *given], [], begun, in_order=False)
        found = [self._behind(work, given, begun)]
        if given:
            found += self._behind_own(job, given)
        return None if None in found else max(each for each in found if each is not None)

    @staticmethod
    def _behind(work: int, urgent: Sequence[Work], begun: int) -> Fraction | None:
        """One job alone, where something else has begun a moment before."""
        alone = (Releases(()), work)
        if has_no_end([alone, *urgent], begun):
            return None
        return play_inside([alone, *urgent], [], begun, in_order=False)

    def _behind_own(self, job: Job, urgent: Sequence[Work]) -> Iterator[Fraction | None]:
        """Where a piece of the thread itself has begun before what goes first came."""
        work = self.scheduling.times(job)[1]
        releases = self.scheduling.releases((job[0], "timer"))
        least = None if releases is None else distance(releases)
        for other in [*self._own(job), job]:
            idle = Fraction(0)
            if (piece_of(other) or 0) >= (piece_of(job) or 0):  # of the job before
                ends = self.scheduling.response[other]
                if least is None:
                    continue
                if ends is None:
                    yield None
                    return
                idle = max(idle, least - ends)
            begun = self.scheduling.times(other)[1]
            ended = self._behind(work, urgent, begun)
            yield None if ended is None else ended - begun - idle


def queued(work: int, own: Sequence[Work], others: Sequence[Work]) -> Fraction | None:
    """In the order of arrival, where whatever ran of its own thread has ended: own pieces, the first of them its own.

    >>> pieces = [(Releases(((33, Fraction(0)),)), time) for time in (2, 8)]
    >>> queued(2, pieces, [(Releases(((4, Fraction(0)),)), 2)])
    Fraction(8, 1)
    """
    if has_no_end([*own, *others], 0):
        return None
    coming = merge(
        *(zip(releases.densest(), repeat((cost, True)), strict=False) for releases, cost in own),
        *(zip(releases.densest(), repeat((cost, False)), strict=False) for releases, cost in others),
    )
    mine = theirs = 0
    worst = Fraction(0)
    for number, (time, (cost, is_own)) in enumerate(coming):
        if (time > 0 and mine + theirs <= time) or number > 200_000:
            break
        mine, theirs = (mine + cost, theirs) if is_own else (mine, theirs + cost)
        worst = max(worst, theirs - max(Fraction(0), time - (mine - work)))
    return worst + work
