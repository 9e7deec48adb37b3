"""What a core must have room for until some time, and the times that are enough to look at (E. Bini, G. C. Buttazzo).

"Schedulability analysis of periodic fixed priority systems", IEEE Transactions on Computers 53(11), 2004.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.rates import NS_PER_S
from dse.encode.scheduling.threads import Thread

MOST_POINTS = 24
"""Of a level with more points than this some jobs count by their share: what that lets pass the referee refuses."""
WHOLE = 10**9
"""A core, in whose parts what threads use of it is counted."""

Rate: TypeAlias = Fraction


@dataclass(frozen=True)
class CoreDemand:
    """Work that some time up to `latest` (ns) must have room for on a core, where one of `demanding` is true.

    `urgent` are literals, the rate while they are true (at least one job counts), and who they are of; of `members` one
    job counts. Without anything `demanding` it is so always.
    """

    latest: int
    urgent: Sequence[tuple[int, Rate, Thread]]
    members: Sequence[tuple[Thread, int]]
    demanding: Sequence[int] = ()


def points_of(demand: CoreDemand) -> list[int] | None:
    """The times of which one has room for a demand if any has; None where they are too many."""
    return scheduling_points(demand.latest, sorted({rate for _, rate, _ in demand.urgent}))


def jobs_of(demand: CoreDemand, point: int) -> Iterator[tuple[int, int, Thread]]:
    """How many jobs count until a time, for each literal of a demand."""
    for pair, rate, thread in demand.urgent:
        yield pair, jobs_within(point, rate), thread
    for thread, pair in demand.members:
        yield pair, 1, thread


def few_points_of(demand: CoreDemand) -> tuple[list[int], frozenset[Rate]]:
    """Few times of which one has room for a demand if any has, where jobs at some rates count by their share.

    Those of the longest jobs are counted one by one as far as there are few points. ceil(t * rate) * worst is no less
    than t * rate * worst, so that a time that has room for all jobs has room for these; and with shares that leave
    something of the core it is as if the others ran on a slower one, of which Bini and Buttazzo's points are enough.
    """
    longest: dict[Rate, int] = {}
    for _, rate, thread in demand.urgent:
        longest[rate] = max(longest.get(rate, 0), *(worst for _, worst in thread.worst))
    counted: list[Rate] = []
    points = [demand.latest]
    for rate in sorted(longest, key=lambda rate: (-longest[rate], rate)):
        more = scheduling_points(demand.latest, sorted([*counted, rate]))
        if more is not None:
            counted, points = [*counted, rate], more
    return points, frozenset(longest) - set(counted)


def work_of(
    demand: CoreDemand, point: int, worst: Callable[[Thread], int], by_share: Collection[Rate]
) -> Iterator[tuple[int, int]]:
    """The work in ns that counts until a time, at least, for each literal of a demand; `by_share` are such rates."""
    jobs: dict[int, int | Fraction] = {}  # by the object of a rate: most literals share one
    times: dict[int, int] = {}
    for pair, rate, thread in demand.urgent:
        if id(rate) not in jobs:
            jobs[id(rate)] = jobs_within(point, rate) if rate not in by_share else point * rate / NS_PER_S
        if thread.number not in times:
            times[thread.number] = worst(thread)
        yield pair, int(times[thread.number] * jobs[id(rate)])
    for thread, pair in demand.members:
        yield pair, worst(thread)


def jobs_within(window_ns: int, rate: Rate) -> int:
    """The fewest jobs that a thread of this rate may release in a window at worst: at least the first.

    >>> [jobs_within(25, Fraction(NS_PER_S, 10)), jobs_within(20, Fraction(NS_PER_S, 10)), jobs_within(20, Fraction(0))]
    [3, 2, 1]
    """
    return max(1, -(-(window_ns * rate.numerator) // (NS_PER_S * rate.denominator)))


def scheduling_points(latest: int, rates: Sequence[Rate]) -> list[int] | None:
    """The times up to `latest` (ns) of which one has room if any time has, by Bini and Buttazzo; None if too many.

    `rates` go from the slowest to the fastest; a rate of 0 has its first job only.

    >>> scheduling_points(20, [Fraction(NS_PER_S, 12), Fraction(NS_PER_S, 7)])
    [7, 12, 14, 20]
    """
    points = {latest}
    for rate in rates:
        if rate:
            points |= {int(int(point * rate / NS_PER_S) * NS_PER_S / rate) for point in points}
        points.discard(0)
        if len(points) > MOST_POINTS:
            return None
    return sorted(points)
