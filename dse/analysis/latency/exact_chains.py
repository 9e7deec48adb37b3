"""The exact latency of a flow whose timers share clocks: job by job over the hyperperiod (docs/semantics.md, 3.6).

The sum of neighbours' waits (`dse.analysis.latency.sampling`) bounds it: not every pair of neighbours need be at its
worst for the same datum. Between releases whose phase drifts, each stretch of a flow is at its worst for some datum.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from math import lcm
from typing import TypeAlias

from dse.analysis.latency.contributors import flow_rows, neighbours, step_rows
from dse.analysis.latency.sampling import METHOD
from dse.analysis.rates import is_periodic
from dse.analysis.views import View
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import Exact, is_unbounded, whole

Ends: TypeAlias = tuple[int, int]
_Whole: TypeAlias = tuple[int, int, int, int, int, int]
_Late: TypeAlias = tuple[int, int, int, int]
MOST_RELEASES = 10_000
"""A hyperperiod with more releases to follow than this is not looked through: the bound stands for the exact value."""


@dataclass(frozen=True, slots=True)
class Hop:
    """To a reader released every `period_ns` from `offset_ns` on, `least_ns` to `most_ns` after the release before.

    It begins, and reads, up to `begins_ns` after its release.
    """

    period_ns: Exact
    offset_ns: Exact
    least_ns: Exact
    most_ns: Exact
    error_ns: Exact = 0
    begins_ns: Exact = 0


@dataclass(frozen=True, slots=True)
class ClockSegment:
    """A stretch of a flow on one clock: its first release, the hops from there, and the waits that bound it.

    The first job begins, and reads, up to `begins_ns` after its release.
    """

    period_ns: Exact
    offset_ns: Exact
    hops: tuple[Hop, ...]
    bounds_ns: tuple[Exact, Exact] = (0, 0)
    begins_ns: Exact = 0

    def _onward(self, hop: Hop, least_ns: Exact, most_ns: Exact) -> ClockSegment:
        """The stretch with a hop more, whose wait is in these bounds."""
        low, high = self.bounds_ns
        return replace(self, hops=(*self.hops, hop), bounds_ns=(low + least_ns, high + most_ns))


def exact_range_ns(space: Space, flow: Flow, view: View) -> tuple[Exact, Exact]:
    """The shortest and the longest latency of a flow.

    They are exact unless clocks differ by an error, or a hyperperiod is too long (`MOST_RELEASES`): then safe bounds.
    """
    range_ns: tuple[Exact, Exact] | None = view.memo.get(("exact", flow.name, space.processing, space.bus_queuing))
    if range_ns is None:
        range_ns = view.memo["exact", flow.name, space.processing, space.bus_queuing] = _range_ns(space, flow, view)
    return range_ns


def _range_ns(space: Space, flow: Flow, view: View) -> tuple[Exact, Exact]:
    runs, others = _runs(space, flow, view)
    least, most = (sum((ends[side] for ends in others), Fraction(0)) for side in (0, 1))
    for run in runs:
        both_ns = None if is_unbounded(most) else longest_and_shortest_ns(run)
        low, high = run.bounds_ns
        if both_ns is not None:
            low = max(low, both_ns[0] - sum(hop.least_ns for hop in run.hops))
            high = min(high, both_ns[1] - sum(hop.most_ns for hop in run.hops))
        least, most = least + low, most + high
    return least, most


def repeats_too_late(space: Space, flow: Flow, view: View) -> bool:
    """Whether the hyperperiod of some stretch of a flow on one clock is too long to look through.

    More than `MOST_RELEASES` releases; the bound of section 3.6 then stands for the exact latency.
    """
    return any(_releases(run) is None for run in _runs(space, flow, view)[0])


def _runs(space: Space, flow: Flow, view: View) -> tuple[list[ClockSegment], list[tuple[Exact, Exact]]]:
    """The stretches of a flow on one clock, and what else adds to its latency."""
    if space.profile != "dse":  # OSATE knows no offsets: its sums are all there is
        return [], [(row.min_ns, row.max_ns) for row in flow_rows(space, flow, view)]
    runs: list[ClockSegment] = []
    others: list[tuple[Exact, Exact]] = []
    is_open = False
    for step in flow.steps:
        is_synchronous = False
        for row in step_rows(space, step, view):
            if row.max_method == METHOD:
                is_synchronous = True
                first, hop = _hop(space, step, view)
                if not is_open:
                    runs.append(first)
                runs[-1] = runs[-1]._onward(hop, row.min_ns, row.max_ns)
            else:
                others.append((row.min_ns, row.max_ns))
        if step.kind == "component" and is_periodic(space.components[step.index], view):
            is_open = is_synchronous
    return runs, others


def _hop(space: Space, step: Step, view: View) -> tuple[ClockSegment, Hop]:
    """A stretch that begins with the timer that releases what a synchronous reader reads, and the way from there."""
    receiver = space.components[step.index]
    neighbour = neighbours(space, step, view)
    assert neighbour is not None, receiver.name
    pair, offset = neighbour.pair, at(space.components[neighbour.sender].offset_ns, view)
    first, begins = pair.begins_ns
    hop = Hop(
        pair.receiver_ns, at(receiver.offset_ns, view), neighbour.least_ns, neighbour.most_ns, pair.error_ns, begins
    )
    return ClockSegment(pair.sender_ns, offset, (), (0, 0), first), hop


def longest_and_shortest_ns(run: ClockSegment) -> tuple[Exact, Exact] | None:
    """The shortest and the longest time from a release to the last read of its data; None where that is too long.

    The shortest from when the first job reads. A middle job that may begin 2 ns after its release, at 10, reads what
    comes at 11, and its own data, 9 ns later, meet the release at 20.

    >>> longest_and_shortest_ns(ClockSegment(5, 0, (Hop(10, 0, 5, 5), Hop(20, 0, 10, 10))))
    (15, 30)
    >>> longest_and_shortest_ns(ClockSegment(10, 0, (Hop(10, 0, 11, 11, 0, 2), Hop(20, 0, 9, 9))))
    (20, 40)
    """
    scale = _scale(run)
    count = _releases(run)
    if count is None:
        return None
    hops = tuple(_whole(scale, hop) for hop in run.hops)
    period, offset, begins = (int(time * scale) for time in (run.period_ns, run.offset_ns, run.begins_ns))
    low, high = _followed(count, period, offset, begins, hops)
    return whole(Fraction(low, scale)), whole(Fraction(high, scale))


@lru_cache(maxsize=4096)
def _followed(count: int, period: int, offset: int, first: int, hops: tuple[_Whole, ...]) -> Ends:
    """The shortest and the longest time of a chain in whole numbers, which many designs share."""
    starts = range(offset, offset + count * period, period)
    error = max(hop[4] for hop in hops)
    high = max(_read([(each, start, most + gap) for each, start, _, most, gap, _ in hops], at) - at for at in starts)
    soonest = [(each, start, least - gap, begins) for each, start, least, _, gap, begins in hops]
    if first or any(hop[5] for hop in hops):
        low = min(_late_read(soonest, at) - at for release in starts for at in _last_moments(soonest, release, first))
    else:
        low = min(_read([hop[:3] for hop in soonest], at) - at for at in starts)
    return max(0, low - error), high + error


def _read(hops: Sequence[tuple[int, int, int]], release: int) -> int:
    """When the last component reads what the first one released."""
    for period, offset, time in hops:
        release = offset - (offset - release - time) // period * period
    return release


def _late_read(hops: Sequence[_Late], time: int) -> int:
    """When at the soonest the last component reads what the first one read at a time: jobs begin as late as helps."""
    for period, offset, least, begins in hops:
        time += least
        time = max(time, offset - (offset - time + begins) // period * period)
    return time


def _last_moments(hops: Sequence[_Late], release: int, first: int) -> Iterator[int]:
    """When a job released at a time may read such that, were it any later, some job would not be met any more."""
    yield release + first
    least = 0
    for period, offset, time, begins in hops:
        least += time
        closes = offset + begins - least  # to meet the job released at the offset
        yield from range(closes - (closes - release) // period * period, release + first + 1, period)


def _scale(run: ClockSegment) -> int:
    """A common denominator of all times of a stretch."""
    times = [run.period_ns, run.offset_ns, run.begins_ns, *(time for hop in run.hops for time in _times(hop))]
    return lcm(*(Fraction(time).denominator for time in times))


def _times(hop: Hop) -> tuple[Exact, ...]:
    return hop.period_ns, hop.offset_ns, hop.least_ns, hop.most_ns, hop.error_ns, hop.begins_ns


def _whole(scale: int, hop: Hop) -> _Whole:
    period, offset, least, most, error, begins = (int(time * scale) for time in _times(hop))
    return period, offset, least, most, error, begins


def _releases(run: ClockSegment) -> int | None:
    """After how many releases the pattern repeats."""
    scale = _scale(run)
    period = int(run.period_ns * scale)
    count = lcm(period, *(int(hop.period_ns * scale) for hop in run.hops)) // period
    return count if count * len(run.hops) <= MOST_RELEASES else None
