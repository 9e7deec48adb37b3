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


def in_executor(number: int, threads: Any, rivals: list[int], first: Any, figures: Any) -> int:
    """By looking at every ms of the busy period at which a job may come; all figures are whole ms."""
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
    load += sum((Fraction(*item) for item in first), Fraction(0))
    latest = max(blocked, *(jitter[item] for item in (*inside, *others)))
    if load > 1 or latest >= LATE // 2 or (load == 1 and latest):
        return LATE

    def came(items: Any, until: int) -> int:
        """The work of jobs that are released in [0, until]."""
        return sum(((until + jitter[item]) // period[item] + 1) * cost[item] for item in items)

    def urgent_before(end: int) -> int:
        """The work of what preempts, released in [0, end)."""
        return came(others, end - 1) + sum(-(-end // every) * taken for taken, every in first)

    def settled(fixed: int) -> int:
        end = fixed
        while fixed + urgent_before(end) > end:
            end = fixed + urgent_before(end)
        return end

    busy = 1
    while blocked + came(inside, busy - 1) + urgent_before(busy) > busy:
        busy = blocked + came(inside, busy - 1) + urgent_before(busy)
        if busy > MOST_MS:
            return LATE
    if kind == "wait_set":
        return busy
    if kind == "fifo":
        return max(settled(blocked + came(inside, at)) - at for at in range(busy))
    return _after_all_starts(number, figures, blocked, (fellows, others, first, busy), came, settled)


def _after_all_starts(
    number: int, figures: Any, blocked: int, given: Any, came: Callable[..., int], settled: Callable[[int], int]
) -> int:
    """Job after job: what comes until its start goes before it, what comes later waits."""
    period, jitter, cost = figures[:3]
    fellows, others, first, busy = given
    worst, jobs = 0, 0
    while not jobs or jobs * period[number] - jitter[number] < busy:
        start = blocked + jobs * cost[number]
        while True:
            taken = sum((start // every + 1) * work for work, every in first)
            later = blocked + jobs * cost[number] + came(fellows, start) + came(others, start) + taken
            if later == start:
                break
            start = later
        end = settled(blocked + (jobs + 1) * cost[number] + came(fellows, start))
        worst = max(worst, end - max(0, jobs * period[number] - jitter[number]))
        jobs += 1
    return worst
