"""Response times in executors, by looking at every ms: nothing of the product's analysis is in here."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

LATE = 10**9
"""A response time without a bound, in ms."""
MOST_MS = 1_500
"""A busy period that is longer goes on for ever: with these figures none that ends is."""


def _goes_first(theirs: int | None, mine: int | None, their_rate: Any, my_rate: Any) -> bool:
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


def in_executor(
    number: int, threads: Any, rivals: list[int], first: Any, figures: Any, supply: tuple[int, int] | None = None
) -> int:
    """By looking at every ms of the busy period at which a job may come; all figures are whole ms.

    `first` is what goes before all: work, period and jitter. Of a `supply` there is a budget in each period.
    """
    period, jitter, cost, blocked, kind = figures
    executor = threads[number]["executor"]
    fellows = [item for item in rivals if threads[item]["executor"] is executor]
    others = [item for item in rivals if item not in fellows]
    if kind == "callback_group":
        urgent = [
            item
            for item in fellows
            if _goes_first(
                threads[item]["priority"], threads[number]["priority"], (period[item], item), (period[number], number)
            )
        ]
        blocked = max([blocked, *(cost[item] for item in fellows if item not in urgent)])
        fellows = urgent
    inside = [*fellows, number]
    load = sum((Fraction(cost[item], period[item]) for item in (*inside, *others)), Fraction(0))
    load += sum((Fraction(*item[:2]) for item in first), Fraction(0))
    latest = max(blocked, *(jitter[item] for item in (*inside, *others)), *(item[2] for item in first))
    if supply is not None:
        load += Fraction(supply[1] - supply[0], supply[1])
        latest = max(latest, int(supply[0] < supply[1]))
    if load > 1 or latest >= LATE // 2 or (load == 1 and latest):
        return LATE

    def came(items: Any, until: int) -> int:
        """The work of jobs that are released in [0, until]."""
        return sum(((until + jitter[item]) // period[item] + 1) * cost[item] for item in items)

    def urgent_before(end: int) -> int:
        """The work of what preempts, released in [0, end)."""
        return came(others, end - 1) + sum(-(-(end + late) // every) * taken for taken, every, late in first)

    def settled(fixed: int) -> int:
        end = fixed
        while fixed + urgent_before(end) > supplied(supply, end):
            end += 1
        return end

    busy = 1
    while blocked + came(inside, busy - 1) + urgent_before(busy) > supplied(supply, busy):
        busy += 1
        if busy > MOST_MS:
            return LATE
    if kind == "fifo":
        return max(settled(blocked + came(inside, at)) - at for at in range(busy))
    return _after_all_starts(number, figures, blocked, (fellows, others, first, busy, supply), came, settled)


def _after_all_starts(
    number: int, figures: Any, blocked: int, given: Any, came: Callable[..., int], settled: Callable[[int], int]
) -> int:
    """Job after job: what comes until its start goes before it, what comes later waits.

    Where something has begun before, however little, all starts are that little sooner: what comes then waits.
    """
    period, jitter, cost = figures[:3]
    fellows, others, first, busy, supply = given
    worst, jobs, sooner = 0, 0, int(blocked > 0)
    while not jobs or jobs * period[number] - jitter[number] < busy:
        start = blocked + jobs * cost[number]
        while True:
            at = start - sooner
            taken = sum(((at + late) // every + 1) * work for work, every, late in first)
            done = blocked + jobs * cost[number] + came(fellows, at) + came(others, at) + taken
            if supplied(supply, start) >= done and (sooner or supplied(supply, start + 1) > supplied(supply, start)):
                break
            start += 1
        end = settled(blocked + (jobs + 1) * cost[number] + came(fellows, at))
        worst = max(worst, end - max(0, jobs * period[number] - jitter[number]))
        jobs += 1
    return worst
