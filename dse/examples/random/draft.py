"""The drawn system: threads with figures and options, where they run, what carries their messages."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from dse.examples.random.families import Family
from dse.examples.random.published import (
    ANGLE_SYNCHRONOUS,
    AUTOMOTIVE_SIZES,
    CRANK_PERIOD_MS,
    ROBOT_ANCHORS_MS,
    ROBOT_SIZES,
    ROBOT_WORST_US,
    RUNNABLES,
    PeriodClass,
)
from dse.examples.random.topology import Topology

MOST_OF_ONE_CORE = 40
"""Percent of one core that a thread may use in the starting design."""


@dataclass
class DraftThread:
    """A thread: its options, and what it does in the starting design.

    `inputs` are connection numbers; the first of them dispatches the thread.
    """

    name: str
    mode: Literal["event", "both", "timer"]
    periods_ms: list[int]
    period_ms: int
    start: Literal["periodic", "aperiodic"]
    slots: list[int]
    best_us: int = 1
    worst_us: int = 1
    inputs: list[int] = field(default_factory=list)


@dataclass
class DraftConnection:
    """A connection: ends are thread numbers or device names.

    `buses` are bus numbers, none where both ends share a processor.
    """

    name: str
    source: int | str
    target: int | str
    size_bytes: int
    buses: list[int]
    has_middleware: bool


@dataclass
class Draft:
    """A system without its limits; times in milliseconds and microseconds as the names say."""

    family: Family
    threads: list[DraftThread]
    wires: list[DraftConnection]
    sensors_ms: list[int]
    actuators: int
    flows: list[list[int]]
    flow_ends: list[tuple[int, int]]
    processors: int
    buses: int


def draw_draft(rng: random.Random, family: Family, topology: Topology) -> Draft:
    """All of the system but its limits."""
    sources: dict[int, list[int]] = {}
    for source, target in topology.edges():
        sources.setdefault(target, []).append(source)
    first = {flow[0]: sensor for flow, sensor in zip(topology.flows, topology.sensors, strict=True)}
    sensors_ms = [rng.choice(family.sensors_ms) for _ in set(topology.sensors)]
    if family.automotive:
        sensors_ms[0] = CRANK_PERIOD_MS
    processors = family.processors(topology.threads)
    threads: list[DraftThread] = []
    crowd = [0] * processors
    for number in range(topology.threads):
        heard = sources.get(number, [])
        arriving_ms = threads[heard[0]].period_ms if heard and heard[0] < number else None
        if number in first:
            arriving_ms = sensors_ms[first[number]]
        thread = _draw_thread(rng, family, number, arriving_ms, is_merge=len(heard) + (number in first) > 1)
        near = threads[heard[0]].slots[0] if heard and heard[0] < number and rng.randrange(100) < 60 else None
        thread.slots = _draw_slots(rng, family, crowd, near)
        threads.append(thread)
    buses = max(1, processors * family.buses_per_processor - (processors > 1))
    draft = Draft(family, threads, [], sensors_ms, len(set(topology.actuators)), topology.flows, [], processors, buses)
    _draw_wires(rng, draft, topology)
    return draft


def _draw_thread(
    rng: random.Random, family: Family, number: int, arriving_ms: int | None, *, is_merge: bool
) -> DraftThread:
    """A thread with four to six periods around an anchor; where flows meet it usually has a timer."""
    drawn = rng.randrange(100)
    mode: Literal["event", "both", "timer"] = "timer"
    if arriving_ms is not None and not (is_merge and rng.randrange(100) >= family.event):
        mode = "event" if drawn < family.event else "both" if drawn < family.event + family.both else "timer"
    runnables = _draw_class(rng) if family.automotive else None
    anchor = runnables.period_ms if runnables else rng.choices(*zip(*ROBOT_ANCHORS_MS, strict=True))[0]
    periods = _around(rng, family.periods_ms, anchor)
    start: Literal["periodic", "aperiodic"] = "aperiodic" if mode == "event" else "periodic"
    if mode == "both" and arriving_ms is not None and arriving_ms >= periods[1] and rng.randrange(2):
        start = "aperiodic"
    period_ms = periods[len(periods) // 2]
    if start == "aperiodic" and arriving_ms is not None:
        period_ms = arriving_ms
    thread = DraftThread(f"{rng.choice(family.roles)}_{number + 1}", mode, periods, period_ms, start, [])
    worst_us, share = _draw_worst(rng, runnables)
    thread.worst_us = max(1, min(worst_us, period_ms * 10 * MOST_OF_ONE_CORE))
    thread.best_us = max(1, thread.worst_us * share // 100)
    return thread


def _draw_class(rng: random.Random) -> PeriodClass:
    classes = (*RUNNABLES, ANGLE_SYNCHRONOUS)
    return rng.choices(classes, [item.share for item in classes])[0]


def _around(rng: random.Random, grid: tuple[int, ...], anchor: int) -> list[int]:
    """Four to six neighbouring periods with the anchor among them, not at the fast end where that can be."""
    count = rng.randint(4, 6)
    place = grid.index(anchor)
    start = place - rng.randint(1, count - 1)
    start = max(0, min(start, len(grid) - count))
    return list(grid[start : start + count])


def _draw_worst(rng: random.Random, runnables: PeriodClass | None) -> tuple[int, int]:
    """Worst execution time in microseconds, and the best in percent of it."""
    if runnables is None:
        low, high = ROBOT_WORST_US
        return round(low * (high / low) ** rng.random()), rng.randint(15, 80)
    count = rng.randint(10, 60)
    beyond_ns = runnables.mean_ns - runnables.least_ns
    drawn_ns = [runnables.least_ns + round(rng.expovariate(1 / beyond_ns)) for _ in range(count)]
    average_ns = sum(min(runnables.most_ns, figure) for figure in drawn_ns)
    low, high = runnables.worst
    worst = round(low * (high / low) ** rng.random())
    best = rng.randint(*runnables.best)
    return -(-average_ns * worst // 100_000), max(1, 100 * best // worst)


def _draw_slots(rng: random.Random, family: Family, crowd: list[int], near: int | None) -> list[int]:
    """Where the thread runs: often beside whoever feeds it, else on the emptiest processor; some may move."""
    emptiest = min(range(len(crowd)), key=lambda slot: (crowd[slot], slot))
    slot = near if near is not None and crowd[near] <= crowd[emptiest] + 3 else emptiest
    crowd[slot] += 1
    if len(crowd) > 1 and rng.randrange(100) < family.movable:
        return [slot, (slot + 1) % len(crowd)]
    return [slot]


def _draw_wires(rng: random.Random, draft: Draft, topology: Topology) -> None:
    sizes = AUTOMOTIVE_SIZES if draft.family.automotive else ROBOT_SIZES
    for number in range(len(draft.flows)):
        draft.flow_ends.append((topology.sensors[number], topology.actuators[number]))
    pairs: dict[tuple[int | str, int | str], None] = {}
    for flow, (sensor, actuator) in zip(draft.flows, draft.flow_ends, strict=True):
        ends: list[int | str] = [f"sensor_{sensor + 1}", *flow, f"actuator_{actuator + 1}"]
        pairs.update(dict.fromkeys(pairwise(ends)))
    pairs.update(dict.fromkeys(topology.feeds))
    for source, target in pairs:
        number = len(draft.wires)
        buses, has_middleware = _draw_route(rng, draft, source, target)
        draft.wires.append(
            DraftConnection(f"message_{number + 1}", source, target, rng.choice(sizes), buses, has_middleware)
        )
        if isinstance(target, int):
            draft.threads[target].inputs.append(number)


def _draw_route(rng: random.Random, draft: Draft, source: int | str, target: int | str) -> tuple[list[int], bool]:
    """The buses that may carry a connection, and whether middleware may do so instead."""
    ends = [draft.threads[end].slots if isinstance(end, int) else None for end in (source, target)]
    if ends[0] is None or ends[1] is None:
        slot = (ends[0] or ends[1] or [0])[0]
        return ([slot % draft.buses], False) if isinstance(target, str) or rng.randrange(2) else ([], False)
    if ends[0] == ends[1] and len(ends[0]) == 1:
        return [], True
    bus = min(ends[0][0], ends[1][0]) % draft.buses
    if draft.buses > 1 and rng.randrange(100) < draft.family.rerouted:
        return [bus, (bus + 1) % draft.buses], False
    return [bus], len(ends[0]) + len(ends[1]) > 2
