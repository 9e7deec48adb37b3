"""Who sends to whom: flows that share threads, and threads beside them."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from itertools import pairwise

SHORTEST, LONGEST = 3, 7
"""Threads of a flow: with the sensor and the actuator these make four to eight hops."""
IN_FLOWS = 70
"""Percent of the threads that lie on flows."""


@dataclass
class Topology:
    """Flows as lists of thread numbers with a sensor and an actuator number; `feeds` are further (from, to) pairs."""

    threads: int
    flows: list[list[int]] = field(default_factory=list)
    sensors: list[int] = field(default_factory=list)
    actuators: list[int] = field(default_factory=list)
    feeds: list[tuple[int, int]] = field(default_factory=list)

    def edges(self) -> list[tuple[int, int]]:
        """Every pair of threads that communicate, once, in the order in which they were drawn."""
        pairs = [pair for flow in self.flows for pair in pairwise(flow)]
        return list(dict.fromkeys([*pairs, *self.feeds]))


def draw_topology(rng: random.Random, threads: int) -> Topology:
    """Flows over the first threads, the others as consumers beside them or alone.

    Every flow but a few joins an earlier one (its own sensor, then the rest of that flow) or forks from it. There are
    no cycles.
    """
    result = Topology(threads)
    used = 0
    wanted = max(SHORTEST + 1, threads * IN_FLOWS // 100)
    while used < wanted or len(result.flows) < 2:
        used = _add_flow(rng, result, used, threads)
    for thread in range(used, threads):
        if rng.randrange(100) < 70:
            result.feeds.append((rng.randrange(thread), thread))
    return result


def _add_flow(rng: random.Random, result: Topology, used: int, threads: int) -> int:
    """One more flow; returns how many threads are now in use."""
    length = rng.randint(SHORTEST, LONGEST)
    free = threads - used
    sensor, actuator = len(set(result.sensors)), len(set(result.actuators))
    kept_head: list[int] = []
    kept_tail: list[int] = []
    how = rng.choice(("join", "join", "fork"))
    if not result.flows or (free >= LONGEST and rng.randrange(100) < 10):
        how = "new"
    if how != "new":
        number = rng.randrange(len(result.flows)) if len(result.flows) > 1 else 0
        base = result.flows[number]
        cut = rng.randrange(1, len(base))
        if how == "join":
            kept_tail, actuator = base[cut:], result.actuators[number]
        else:
            kept_head, sensor = base[:cut], result.sensors[number]
    shared = len(kept_head) + len(kept_tail)
    fresh = max(1, min(max(length, shared + 1) - shared, LONGEST - shared, free - (1 if not result.flows else 0)))
    result.flows.append([*kept_head, *range(used, used + fresh), *kept_tail])
    result.sensors.append(sensor)
    result.actuators.append(actuator)
    return used + fresh
