"""Messages on a bus with identifiers, some of whose senders queue them as they come (semantics, section 5.4)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import NamedTuple, TypeAlias

from .stretches import MOST_PLAYED, Releases, has_no_end

Frames: TypeAlias = tuple[Releases | None, Fraction, Fraction, Fraction]
"""When a message is queued, what it takes, its last frame, and its longest one."""
Faults: TypeAlias = tuple[int, int] | None
"""The time between faults of a wire, and how many may come at once; None: none are counted."""


class Queues:
    """Who queues each message, by their names in the order of their identifiers; None: nothing does."""

    def __init__(self, queue: Mapping[str, str | None]) -> None:
        self.order = list(queue)
        members = {name: [each for each in queue if queue[each] == queue[name]] for name in queue if queue[name]}
        self.lines = {name: line for name, line in members.items() if len(line) > 1}
        self.faults: Faults = None

    def responses(
        self, frames: Mapping[str, Frames], bit: Fraction, faults: Faults = None
    ) -> dict[str, Fraction | None]:
        """The longest response time of each; None without a bound."""
        self.faults = faults
        behind: dict[str, Fraction | None] = dict.fromkeys(self.lines, Fraction(0))
        while True:  # as often as there are queues, and once more
            fresh = {name: self._response(name, frames, behind, bit) for name in behind}
            later = {name: None if found is None else found - frames[name][1] for name, found in fresh.items()}
            if later == behind:
                break
            behind = later
        return {name: self._response(name, frames, behind, bit) for name in self.order}

    def _response(
        self, name: str, frames: Mapping[str, Frames], behind: Mapping[str, Fraction | None], bit: Fraction
    ) -> Fraction | None:
        line = self.lines.get(name, [name])
        level = max(map(self.order.index, line))
        others = [each for each in self.order if each not in line]
        begun = max((frames[each][3] for each in others if self.order.index(each) > level), default=Fraction(0))
        urgent: list[Coming] = []
        for each in others:
            if self.order.index(each) > level:
                continue
            reaches = max(map(self.order.index, self.lines.get(each, [each])))
            late = behind[each] if reaches > level else Fraction(0)
            releases = frames[each][0]
            if releases is None or late is None:
                return None
            streams = tuple((period, jitter + late) for period, jitter in releases.streams)
            urgent.append(Coming(Releases(streams), frames[each][1]))
        own = [Coming(releases, frames[each][1]) for each in line if (releases := frames[each][0]) is not None]
        longest = max(frames[each][3] for each in self.order[: level + 1])
        hits = [Coming(each, takes) for each, takes in hits_of(self.faults, longest, bit)]
        if len(own) < len(line) or has_no_end([*own, *urgent, *hits], 1 if begun or hits else 0):
            return None
        return _longest(own, urgent, begun, frames[name][2], bit, hits)


def hits_of(faults: Faults, longest: Fraction, bit: Fraction) -> list[tuple[Releases, Fraction]]:
    """The faults of a wire, each with an error frame of 31 bits and the longest frame that is sent again."""
    if faults is None:
        return []
    interval, burst = faults
    return [(Releases(((interval, Fraction((burst - 1) * interval)),)), 31 * bit + longest)]


class Coming(NamedTuple):
    """When messages come, and what each takes."""

    releases: Releases
    takes: Fraction


def _arrivals(messages: list[Coming]) -> Iterator[tuple[Fraction, Fraction]]:
    """The arrivals of some messages in order, each with what has come by then."""
    times = [item.releases.densest() for item in messages]
    following = [next(each, None) for each in times]
    total = Fraction(0)
    while (now := min((each for each in following if each is not None), default=None)) is not None:
        for place, item in enumerate(messages):
            while following[place] is not None and following[place] == now:
                total += item.takes
                following[place] = next(times[place], None)
        yield now, total


def _longest(
    own: list[Coming], urgent: list[Coming], begun: Fraction, last: Fraction, bit: Fraction, hits: list[Coming]
) -> Fraction | None:
    """The longest from when a message comes to its end, behind all of its queue that come no later."""
    worst = Fraction(0)
    outside = _arrivals(urgent)
    upcoming, work = next(outside, (None, Fraction(0))), Fraction(0)
    faults = _arrivals(hits)
    fault, lost = next(faults, (None, Fraction(0))), Fraction(0)
    for _, (came, queued) in zip(range(MOST_PLAYED), _arrivals(own), strict=False):
        while True:  # who comes less than a bit after the last frame has begun may still win it
            start = begun + queued - last + work + lost
            if fault[0] is not None and fault[0] < start + last:
                lost, fault = fault[1], next(faults, (None, Fraction(0)))
                continue
            edge = start + bit
            if upcoming[0] is None or upcoming[0] > edge or (upcoming[0] == edge and (begun or bit)):
                break
            work, upcoming = upcoming[1], next(outside, (None, Fraction(0)))
        if came and came >= start + last:
            return worst
        worst = max(worst, start + last - came)
        if not any(item.releases.streams for item in own):
            return worst
    return None
