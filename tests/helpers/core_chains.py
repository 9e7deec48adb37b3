"""Chains of threads on cores, drawn at random and played job by job: nothing of the product is in here.

Times are in tenths of a millisecond. A timer begins each chain; each later thread is released by the end of the one
before it, or of an earlier one (a fork), after what the connection takes.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush
from typing import Any

PERIODS = (100, 120, 200, 240, 300, 400, 600)
HORIZON = 3_000


@dataclass
class Thread:
    """A thread with its core, priority, times, the thread before it in its chain, and the time on the way from that."""

    core: int
    least: int
    most: int
    before: int
    way: int = 0
    priority: int = 0


@dataclass
class Chains:
    """Chains with their periods, on so many cores."""

    cores: int
    chains: list[tuple[int, list[Thread]]] = field(default_factory=list)

    @property
    def threads(self) -> Iterator[tuple[int, int, Thread]]:
        """Each thread with its chain and its place there."""
        return ((one, place, item) for one, (_, chain) in enumerate(self.chains) for place, item in enumerate(chain))

    def way_to(self, chain: int, place: int) -> list[int]:
        """The places of the threads from the first of a chain to one of it."""
        found = [place]
        while found[0]:
            found.insert(0, self.chains[chain][1][found[0]].before)
        return found


def draw(rng: random.Random, cores: int, load: float, *, by_rate: bool) -> Chains:
    """One to four chains of one to five threads that use so much of the cores, by rate or with any priorities."""
    found = Chains(cores)
    count = rng.randint(1, 4)
    for _ in range(count):
        period, length = rng.choice(PERIODS), rng.randint(1, 5)
        shares = [rng.random() for _ in range(length)]
        chain = []
        for place, share in enumerate(shares):
            most = max(1, round(load * cores / count * period * share / sum(shares)))
            before = place - 1 if place < 2 or rng.random() < 0.7 else rng.randrange(place)
            way = rng.choice((0, 0, 0, rng.randint(1, 30))) if place else 0
            chain.append(Thread(rng.randrange(cores), rng.randint(max(1, most // 2), most), most, before, way))
        found.chains.append((period, chain))
    order = [item for _, _, item in found.threads]
    if by_rate:
        order = [item for _, chain in sorted(found.chains, key=lambda one: one[0]) for item in chain]
    else:
        rng.shuffle(order)
    for turn, item in enumerate(order):
        item.priority = len(order) - turn
    return found


def problem_of(drawn: Chains) -> dict[str, Any]:
    """The problem file, with a flow from the first thread of each chain to each of its threads."""
    threads, connections, flows, types, buses = {}, {}, {}, {}, {}
    for chain, place, item in drawn.threads:
        name = f"t{chain}_{place}"
        released = {"dispatch_protocol": "aperiodic"} if place else {"period": f"{drawn.chains[chain][0] * 100} us"}
        threads[name] = {
            **released, "processor": "cpu", "core": item.core + 1, "priority": item.priority,
            "compute_execution_time": f"{item.least * 100} us .. {item.most * 100} us",
        }  # fmt: skip
        if place:
            connections[f"c{chain}_{place}"] = {"from": f"t{chain}_{item.before}", "to": name}
        if item.way:
            longest = f"0 us .. {item.way * 100} us"
            types[f"k{chain}_{place}"] = {"virtual": True, "transmission_time": {"fixed": longest}}
            buses[f"b{chain}_{place}"] = {"type": f"k{chain}_{place}"}
            connections[f"c{chain}_{place}"] |= {"bus": f"b{chain}_{place}", "data_size": "1 B"}
        flows[f"f{chain}_{place}"] = {"path": [f"t{chain}_{each}" for each in drawn.way_to(chain, place)]}
    return {
        "dse": 1, "name": "chains", "processing": "response_time", "deadlines": "none", "overload": "allowed",
        "processor_types": {"p": {"cores": drawn.cores}}, "processors": {"cpu": {"type": "p"}},
        "threads": threads, "connections": connections, "flows": flows, "bus_types": types, "buses": buses,
    }  # fmt: skip


def played(drawn: Chains, rng: random.Random, *, longest: bool) -> dict[str, int]:
    """How long each flow took at most in one run, with drawn phases; with the longest times, or any."""
    coming = [
        (time, chain, 0, time)
        for chain, (period, _) in enumerate(drawn.chains)
        for time in range(rng.randrange(period), HORIZON, period)
    ]
    heapify(coming)
    ready: list[list[tuple[int, int, int, int, int, list[int]]]] = [[] for _ in range(drawn.cores)]
    seen: dict[str, int] = {}
    arrived: dict[tuple[int, int], int] = {}
    now = number = 0
    while coming or any(ready):
        ends = [now + waiting[0][5][0] for waiting in ready if waiting]
        then = min([*ends, *(one[0] for one in coming[:1])])
        for waiting in ready:
            if waiting:
                waiting[0][5][0] -= then - now
        now = then
        for waiting in ready:
            while waiting and not waiting[0][5][0]:
                _, _, chain, place, begun, _ = heappop(waiting)
                name = f"f{chain}_{place}"
                seen[name] = max(seen.get(name, 0), now - begun)
                for behind, item in enumerate(drawn.chains[chain][1]):
                    if behind and item.before == place:
                        way = item.way if longest else rng.randint(0, item.way)
                        arrived[chain, behind] = max(now + way, arrived.get((chain, behind), 0))  # in the order sent
                        heappush(coming, (arrived[chain, behind], chain, behind, begun))
        while coming and coming[0][0] <= now:
            _, chain, place, begun = heappop(coming)
            item, number = drawn.chains[chain][1][place], number + 1
            left = item.most if longest else rng.randint(item.least, item.most)
            heappush(ready[item.core], (-item.priority, number, chain, place, begun, [left]))
    return seen


def some_groups(rng: random.Random, cores: Sequence[Sequence[int]]) -> list[tuple[int, ...]]:
    """Some of the threads of each core, now and then as if they were on two."""
    found = []
    for numbers in cores:
        kept = [number for number in numbers if rng.random() < 0.7]
        cut = rng.randrange(len(kept) + 1) if rng.random() < 0.3 else 0
        found += [tuple(part) for part in (kept[:cut], kept[cut:]) if part]
    return found
