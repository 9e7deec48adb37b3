"""What a core must have room for until some time, and the times that are enough to look at (E. Bini, G. C. Buttazzo).

"Schedulability analysis of periodic fixed priority systems", IEEE Transactions on Computers 53(11), 2004.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.rates import NS_PER_S
from dse.encode.places import Thread
from dse.records import dataclass

MOST_POINTS = 24
"""A level with more points than this has no rows: what it would refuse is found by the referee."""
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
