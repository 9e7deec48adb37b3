"""The busiest stretch of a core or an accelerator, played job by job."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from heapq import heappop, heappush, merge
from itertools import count, repeat
from typing import Any

MOST_PLAYED = 200_000
"""Releases of a stretch that has not ended by then: it is taken to have no end."""


@dataclass(frozen=True)
class Releases:
    """Streams of (period, how late at most); jobs at least `apart` from each other, in a stretch `most` of them.

    No stream: one job, or so many.
    """

    streams: tuple[tuple[int, Fraction], ...]
    apart: int = 0
    most: int | None = None

    def densest(self) -> Iterator[Fraction]:
        """Times from the first release on, each as early as it can be."""
        if not self.streams:
            yield from repeat(Fraction(0), self.most or 1)
            return
        for number, time in enumerate(merge(*(_each(*stream) for stream in self.streams))):
            if number == self.most:
                return
            yield max(time, Fraction(number * self.apart))

    @property
    def often(self) -> Fraction:
        """Jobs per ns in the long run."""
        if self.most is not None:
            return Fraction(0)
        return min(self._whole, Fraction(1, self.apart)) if self.apart else self._whole

    @property
    def may_be_early(self) -> bool:
        """Whether jobs come sooner than so often: not where they wait for the time that is to be between them."""
        return any(late for _, late in self.streams) and self.apart * self._whole < 1

    @property
    def _whole(self) -> Fraction:
        return sum((Fraction(1, period) for period, _ in self.streams), Fraction(0))


def _each(period: int, late: Fraction) -> Iterator[Fraction]:
    """The releases of one stream."""
    return (max(Fraction(0), number * period - late) for number in count())


def kept_apart(releases: Releases) -> tuple[tuple[int, Fraction], ...]:
    """The streams of jobs; of those that always come as soon as they may, one stream."""
    streams = releases.streams
    if releases.apart and sum(Fraction(1, period) for period, _ in streams) * releases.apart >= 1:
        return ((releases.apart, Fraction(0)),)
    return streams


def has_no_end(given: Sequence[tuple[Releases, int | Fraction]], begun: int) -> bool:
    """Whether there is more work than time, or as much and some of it is early: jobs are ever later then.

    Not where there is as much, and some jobs besides that come so many times only: later jobs are all as late.

    >>> late, whole = ((4, Fraction(1)),), (Releases(((4, Fraction(0)),)), 2)
    >>> [has_no_end([(Releases(late, apart), 2), whole], 0) for apart in (0, 3, 4)]
    [True, True, False]
    """
    used = sum((releases.often * work for releases, work in given), Fraction(0))
    every = [releases for releases, _ in given if releases.most is None]
    is_more = begun > 0 or any(not each.streams or each.may_be_early for each in every)
    return used > 1 or (used == 1 and is_more)


def play(
    own: Releases, work: int | Fraction, before: Sequence[tuple[Releases, int]], begun: int = 0
) -> Fraction | None:
    """The longest time from the release of one of `own` jobs, of so much `work`, to its end.

    The core is never idle meanwhile: all that is released goes `before` these jobs, and so does what has `begun`.

    >>> a, b, c = (Releases(((period, Fraction(0)),)) for period in (7, 12, 20))
    >>> play(c, 5, [(a, 3), (b, 3)])
    Fraction(20, 1)
    """
    coming: list[tuple[Fraction, int, int | Fraction, Iterator[Any]]] = []
    for number, (releases, cost) in enumerate([(own, work), *before]):
        times = releases.densest()
        heappush(coming, (next(times), number, cost, times))
    now = worst = Fraction(0)
    urgent = Fraction(begun)
    waiting: deque[tuple[Fraction, Fraction]] = deque()
    for _ in range(MOST_PLAYED):
        upcoming = coming[0][0] if coming else None
        while urgent or waiting:  # until the next release
            left = None if upcoming is None else upcoming - now
            need = urgent or waiting[0][1]
            if left is not None and left <= 0:
                break
            done = need if left is None else min(need, left)
            now += done
            if urgent:
                urgent -= done
            elif done == need:
                worst = max(worst, now - waiting.popleft()[0])
            else:
                waiting[0] = (waiting[0][0], need - done)
        if upcoming is None or (now < upcoming and not urgent and not waiting):
            return worst
        if now == upcoming and now > 0 and not urgent and not waiting:
            return worst  # all is done when the next begins: a stretch of its own
        time, number, cost, times = heappop(coming)
        if number:
            urgent += cost
        else:
            waiting.append((time, Fraction(cost)))
        following = next(times, None)
        if following is not None:
            heappush(coming, (following, number, cost, times))
    return None


MOMENT = Fraction(1, 10**12)
"""How much sooner than what waits for it something has begun, in ns."""


def earliest(begins: Releases, own: Releases | None) -> Releases:
    """Jobs that come no more often than others that begin so, nor than they do themselves; None: late without a bound.

    Each stream of theirs is one of the others.
    """
    if own is None or [period for period, _ in own.streams] != [period for period, _ in begins.streams]:
        return Releases(begins.streams)
    pairs = zip(begins.streams, own.streams, strict=True)
    return Releases(tuple((period, min(one, other)) for (period, one), (_, other) in pairs))


def play_inside(
    inside: Sequence[tuple[Releases, int]], outside: Sequence[tuple[Releases, int]], begun: int, *, in_order: bool
) -> Fraction | None:
    """The longest time from the release of a job of the first of `inside` to its end: one job at a time, to its end.

    What is `outside` preempts. The others inside go first among what waits, or all go `in_order` of their release: then
    whoever comes at that time may be the first of them. Something else inside may have `begun` a moment before.

    >>> timer, callback = (Releases(((period, Fraction(0)),)) for period in (10, 20))
    >>> [play_inside([(timer, 1), (callback, 3)], [], 0, in_order=in_order) for in_order in (True, False)]
    [Fraction(4, 1), Fraction(4, 1)]
    """
    coming: list[tuple[Fraction, int, int, Iterator[Any]]] = []
    for number, (releases, cost) in enumerate([*inside, *outside]):
        times = releases.densest()
        heappush(coming, (next(times), number, cost, times))
    sooner = MOMENT if begun else Fraction(0)
    now, worst = Fraction(0), Fraction(0)
    running: list[Any] = [None, Fraction(begun) - sooner] if begun else []
    preempting = Fraction(0)
    waiting: list[tuple[Any, Fraction, int]] = []  # what goes first, the release, the cost

    for _ in range(MOST_PLAYED):
        while coming and coming[0][0] <= now:
            time, number, cost, times = heappop(coming)
            if number >= len(inside):
                preempting += cost
            else:
                rank: Any = (time, number == 0) if in_order else (number == 0, time)
                heappush(waiting, (rank, time, cost))
            following = next(times, None)
            if following is not None:
                heappush(coming, (following, number, cost, times))
        if not preempting and not running and not waiting:
            return worst
        upcoming = coming[0][0] if coming else None
        if not preempting and not running:
            rank, time, cost = heappop(waiting)
            running = [(time, in_order or rank[0] is True), Fraction(cost)]
        need = preempting or running[1]
        done = need if upcoming is None else min(need, upcoming - now)
        now += done
        if preempting:
            preempting -= done
        else:
            running[1] -= done
            if not running[1]:
                if running[0] is not None and running[0][1]:
                    worst = max(worst, now + sooner - running[0][0])
                running = []
        if not preempting and not running and not waiting and coming and coming[0][0] >= now > 0:
            return worst  # all is done when the next begins
    return None
