"""Rows of levels with many points: no more than what a core must have room for, of random threads."""

from __future__ import annotations

import random
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import pytest

from dse.analysis.rates import NS_PER_S
from dse.analysis.scheduling.busy_window import periodic, response_time_ns
from dse.encode.scheduling import core_demand
from dse.encode.scheduling.core_demand import CoreDemand, few_points_of, points_of, work_of
from tests.helpers.effort import cases


@pytest.mark.parametrize("seed", cases(1000))
def test_what_is_in_time_has_room_at_one_of_few_points(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Threads on a core by rate; of those that may be there some are not, which leaves every row easier to keep."""
    rng = random.Random(seed)
    monkeypatch.setattr(core_demand, "MOST_POINTS", rng.choice((1, 3, 8)))
    scale = NS_PER_S // 1000
    latest = rng.randint(20, 400) * scale
    periods = [rng.randint(3, latest // scale) * scale // rng.choice((1, 1, 3)) for _ in range(rng.randint(1, 8))]
    works = [max(1, int(period * rng.uniform(0.02, 0.3))) for period in periods]
    threads: list[Any] = [SimpleNamespace(number=at, worst=((0, work),)) for at, work in enumerate(works)]
    urgent = [(at, Fraction(NS_PER_S, period), threads[at]) for at, period in enumerate(periods)]
    own: Any = SimpleNamespace(number=99, worst=((0, rng.randint(1, latest // 2)),))
    demand = CoreDemand(latest, urgent, [(own, 99)], [99])
    here = [at for at in range(len(periods)) if rng.random() < 0.7]
    task = periodic("own", own.worst[0][1], 10 * latest)
    response = response_time_ns(task, [periodic("x", works[at], periods[at]) for at in here])
    points, by_share = few_points_of(demand)
    assert points_of(demand) is not None or by_share, "else they are all there"

    def has_room(point: int) -> bool:
        work = work_of(demand, point, lambda thread: int(thread.worst[0][1]), by_share)
        return sum(time for literal, time in work if literal in (*here, 99)) <= point

    is_in_time = response is not None and response <= latest
    if not by_share:
        assert any(map(has_room, points)) == is_in_time
    elif is_in_time:
        assert any(map(has_room, points))
