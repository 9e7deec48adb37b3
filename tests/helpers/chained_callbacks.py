"""Chains of callbacks on one core, drawn at random and played ms by ms: nothing of the product is in here.

One core runs OS threads by priority: executors of any kind, and threads of their own. Timers begin chains, each later
callback is released by the end of the one before, or of one before that. What is played is one of many ways in which it
may go: phases, execution times, and who goes first among equals, are drawn.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

PERIODS = (8, 10, 12, 15, 20, 24, 30, 40, 90)
Turn: TypeAlias = tuple[int, float, int]


@dataclass
class Callback:
    """A thread: its executor (None: it is an OS thread itself), its times in ms, and what releases it.

    One that is `elsewhere` has a processor of its own; nothing interrupts the jobs of one that `holds` its core.
    """

    name: str
    executor: int | None
    priority: int | None
    best: int
    worst: int
    period: int
    before: str | None
    elsewhere: bool = False
    holds: bool = False


@dataclass
class Core:
    """What runs on the core; of executors their kind and priority."""

    callbacks: list[Callback]
    kinds: list[str]
    priorities: list[int | None]
    is_open: bool = False


@dataclass
class Job:
    """A job that waits or runs, since the release of a timer at some time."""

    of: Callback
    release: int
    begun: int
    left: int
    tie: float


@dataclass
class Unit:
    """An OS thread: its turn, and its jobs that wait, were polled, and run."""

    turn: Turn
    kind: str
    is_elsewhere: bool
    queue: list[Job] = field(default_factory=list)
    polled: list[Job] = field(default_factory=list)
    running: Job | None = None

    @property
    def is_busy(self) -> bool:
        return bool(self.queue or self.polled or self.running)


def draw(rng: random.Random) -> Core:
    """Up to three chains of up to four callbacks, in one executor or two, some threads beside them."""
    count = rng.choice((1, 1, 2))
    kinds = [rng.choice(("fifo", "callback_group", "wait_set")) for _ in range(count)]
    found: list[Callback] = []
    for chain in range(rng.choice((1, 2, 2, 3))):
        home, period = rng.randrange(count), rng.choice(PERIODS)
        names: list[str] = []
        for place in range(rng.choice((1, 2, 3, 4))):
            executor = home if rng.random() < 0.85 else rng.choice((None, *range(count)))
            is_number = executor is None or kinds[executor] == "callback_group"
            worst = rng.choice((1, 1, 1, 2, 2, 3))
            before = names[-2 if place > 1 and rng.random() < 0.15 else -1] if names else None
            priority = rng.choice((None, 1, 2, 3, 4, 5)) if is_number else None
            name = f"c{chain}_{place}"
            is_elsewhere = executor is None and bool(names) and rng.random() < 0.6
            worst = rng.randint(1, period) if is_elsewhere else worst
            found.append(
                Callback(name, executor, priority, rng.choice((worst, 1)), worst, period, before, is_elsewhere)
            )
            names.append(name)
    core = Core(found, kinds, [rng.choice((None, 1, 3, 5)) for _ in kinds])
    _take_no_time(core, random.Random(repr(rng.getstate()[1][:2])))  # apart from all else
    return core


def _take_no_time(core: Core, rng: random.Random) -> None:
    """Some callbacks take no time in every third core, and in some of these all of an executor but one."""
    if rng.random() < 0.65:
        return
    kept = rng.choice(core.callbacks)
    home = kept.executor if rng.random() < 0.3 else None
    for item in core.callbacks:
        is_beside = home is not None and item.executor == home and item is not kept
        if is_beside or (item is not kept and rng.random() < 0.3):
            item.best = item.worst = 0


def text_of(core: Core, *, more: str = "objectives: [minimise price]") -> str:
    """The problem file; where it `is_open` the kinds are decisions, and cores of two."""
    lines = ["dse: 1", "name: chains", "processing: response_time", "deadlines: none"]
    cores = 2 if core.is_open else 1
    lines += [
        f"processor_types: {{cpu: {{cores: {cores}, price: 1 EUR}}, other: {{}}}}",
        "processors:",
        "  pc: {type: cpu}",
    ]
    lines += [f"  of_{item.name}: {{type: other}}" for item in core.callbacks if item.elsewhere]
    used = sorted({item.executor for item in core.callbacks if item.executor is not None})
    if used:
        lines.append("executors:")
    for number in used:
        kind = core.kinds[number]
        kinds = "[fifo, wait_set]" if core.is_open and kind != "callback_group" else kind
        given = core.priorities[number]
        priority = "" if given is None else f", priority: {given}"
        lines.append(f"  e{number}: {{processor: pc, kind: {kinds}{priority}}}")
    lines.append("threads:")
    for item in core.callbacks:
        home = f"of_{item.name}" if item.elsewhere else "pc"
        fields = [f"processor: {home}" if item.executor is None else f"executor: e{item.executor}"]
        fields.append("dispatch_protocol: aperiodic" if item.before else f"period: {item.period} ms")
        fields.append(f"compute_execution_time: {item.best} ms .. {item.worst} ms")
        fields += [] if item.priority is None else [f"priority: {item.priority}"]
        fields += [f"non_preemptive: {item.worst} ms"] if item.holds and item.worst else []
        lines.append(f"  {item.name}: {{{', '.join(fields)}}}")
    wires = [f"  w{item.name}: {{from: {item.before}, to: {item.name}}}" for item in core.callbacks if item.before]
    return "\n".join([*lines, *(["connections:", *wires] if wires else []), more, ""])


def played(core: Core, rng: random.Random, most_ms: int = 500) -> dict[str, int]:
    """The longest response of each callback in one run, in ms."""
    found: dict[str, int] = {}
    for name, taken, _ in _responses(core, rng, most_ms):
        found[name] = max(taken, found.get(name, 0))
    return found


def chains_played(core: Core, rng: random.Random, most_ms: int = 500) -> dict[str, int]:
    """The longest time from the release of its timer to the end of each callback in one run, in ms."""
    found: dict[str, int] = {}
    for name, _, taken in _responses(core, rng, most_ms):
        found[name] = max(taken, found.get(name, 0))
    return found


def flows_of(core: Core) -> str:
    """The flows of a problem file, from its timer to each callback."""
    by_name = {item.name: item for item in core.callbacks}
    lines = ["flows:"]
    for item in core.callbacks:
        path = [item]
        while path[0].before is not None:
            path.insert(0, by_name[path[0].before])
        lines.append(f"  f_{item.name}: {{path: [{', '.join(one.name for one in path)}]}}")
    return "\n".join(lines)


def _responses(core: Core, rng: random.Random, most_ms: int) -> Iterator[tuple[str, int, int]]:
    """The name of each callback whose job ends, and how long that took from its own and from its timer's release."""
    units, home = _units(core)
    after: dict[str, list[Callback]] = {}
    for item in core.callbacks:
        after.setdefault(item.before or "", []).append(item)
    timers = after.pop("")
    together, always_worst = rng.random() < 0.3, rng.random() < 0.5
    phase = {item.name: 0 if together else rng.randrange(item.period) for item in timers}

    def release(item: Callback, time: int, begun: int) -> Iterator[tuple[str, int, int]]:
        """A job waits; one that takes no time does not: it is over, and what comes after it released."""
        left = item.worst if always_worst else rng.randint(item.best, item.worst)
        if item.worst:
            home[item.name].queue.append(Job(item, time, begun, left, rng.random()))
            return
        yield item.name, 0, time - begun
        for other in after.get(item.name, ()):
            yield from release(other, time, begun)

    for now in range(most_ms):
        for item in timers:
            if now >= phase[item.name] and (now - phase[item.name]) % item.period == 0:
                yield from release(item, now, now)
        for unit in _running(units, rng):
            job = unit.running = unit.running or _next(core, unit)
            job.left -= 1
            if job.left == 0:
                unit.running = None
                yield job.of.name, now + 1 - job.release, now + 1 - job.begun
                for item in after.get(job.of.name, ()):
                    yield from release(item, now + 1, job.begun)


def _running(units: list[Unit], rng: random.Random) -> list[Unit]:
    """Whatever runs now: all that is elsewhere, and what holds the core, else one of its most urgent OS threads."""
    busy = [unit for unit in units if unit.is_busy]
    here = [unit for unit in busy if not unit.is_elsewhere]
    found = [unit for unit in busy if unit.is_elsewhere]
    held = [unit for unit in here if unit.running is not None and unit.running.of.holds]
    if held:
        return [*found, *held]
    if here:
        first = min(unit.turn for unit in here)
        equal = [unit for unit in here if unit.turn == first or (first[0] == 0 and unit.turn[:2] == first[:2])]
        found.append(rng.choice(equal))
    return found


def _units(core: Core) -> tuple[list[Unit], dict[str, Unit]]:
    """The OS threads, and that of each callback."""
    made: dict[tuple[str, int], Unit] = {}
    home = {}
    for number, item in enumerate(core.callbacks):
        key = ("thread", number) if item.executor is None else ("executor", item.executor)
        if key not in made:
            priority = item.priority if item.executor is None else core.priorities[item.executor]
            inside = [one for one in core.callbacks if one is item or one.executor == item.executor is not None]
            turn = (1, min(one.period for one in inside), number) if priority is None else (0, -priority, number)
            kind = "fifo" if item.executor is None else core.kinds[item.executor]
            made[key] = Unit(turn, kind, item.elsewhere)
        home[item.name] = made[key]
    return list(made.values()), home


def _next(core: Core, unit: Unit) -> Job:
    """The job that an OS thread runs next; those of one callback as they came."""
    unit.queue.sort(key=lambda job: (job.release, job.tie))
    if unit.kind == "fifo":
        return unit.queue.pop(0)
    firsts: dict[str, Job] = {}
    for job in unit.queue:
        firsts.setdefault(job.of.name, job)
    if unit.kind == "callback_group":
        chosen = min(firsts.values(), key=lambda job: _urgency(core, job))
        unit.queue.remove(chosen)
        return chosen
    if not unit.polled:  # timers first
        unit.polled = sorted(firsts.values(), key=lambda job: (job.of.before is not None, job.tie))
        for job in unit.polled:
            unit.queue.remove(job)
    return unit.polled.pop(0)


def _urgency(core: Core, job: Job) -> tuple[int, float, float]:
    if job.of.priority is not None:
        return 0, -job.of.priority, job.tie
    return 1, job.of.period, core.callbacks.index(job.of)
