"""What is measured: problems by name, and what is asked of them."""

from __future__ import annotations

import random
import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from tests.helpers import classics

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Case:
    """A problem: of the generator, or a file of `problems/` with a further limit.

    Of a knapsack, `threads` is the number of items, of an assignment that of tasks. With `waiting` flows count response
    times.
    """

    name: str
    family: str = ""
    threads: int = 0
    objectives: int = 0
    seed: int = 1
    file: str = ""
    max_jitter: str = ""
    periods: int = 0
    deadlines: bool = False
    waiting: bool = False
    cores: int = 0
    load: float = 0.0

    def text(self) -> str:
        """The problem file of a generated case; with `periods`, at most that many options of each period are left."""
        counted = "response_time" if self.waiting else "execution_time"
        text = self._drawn()
        return text if "processing:" in text else text.replace("\nname:", f"\nprocessing: {counted}\nname:", 1)

    def _drawn(self) -> str:
        if self.cores:
            return nearly_full(self.threads, self.cores, self.load, self.seed)
        if self.family == "long-flows":
            return long_flows(self.threads, self.seed)
        if self.family == "knapsack":
            return classics.knapsack(*classics.drawn_items(self.threads, self.objectives, self.seed))
        if self.family == "assignment":
            return classics.assignment(classics.drawn_costs(self.threads, self.objectives, self.seed))
        from dse.examples.random import random_problem  # not in the processes of peers that have no use for it

        text = random_problem(self.threads, self.seed, self.objectives, self.family)
        if self.deadlines:
            text = text.replace("\nname:", "\ndeadlines: all\nname:", 1)
        return _with_fewer_periods(text, self.periods) if self.periods else text


def _with_fewer_periods(text: str, most: int) -> str:
    """Neighbours of the baseline's period only, which keeps the baseline a design."""
    head, baseline = text.split("\nbaseline:\n")
    kept = dict(re.findall(r"^  (\w+): \{.*?period: (\d+ ms)\}", baseline, re.MULTILINE))
    lines = []
    for line in head.split("\n"):
        found = re.search(r"period: \[([^\]]*)\]", line)
        if found:
            options = found.group(1).split(", ")
            mine = kept.get(line.split(":")[0].strip(), options[len(options) // 2])
            start = max(0, min(options.index(mine) - most // 2, len(options) - most))
            line = line.replace(found.group(1), ", ".join(options[start : start + most]))
        lines.append(line)
    return "\n".join(lines) + "\nbaseline:\n" + baseline


GRID_MS = (5, 10, 20, 25, 40, 50, 100, 200)
SPEEDS = {"slow": (100, 100), "medium": (180, 75), "fast": (310, 55)}
"""Types with their price in EUR and how long a job takes, in percent of the slow one."""


def nearly_full(threads: int, cores: int, load: float, seed: int) -> str:
    """Threads with four neighbouring periods each that use a share of the cores of the medium type at their second.

    The core of each is open; the objectives are the price, and the latency of a flow through all threads.
    """
    rng = random.Random(f"tight {threads} {cores} {seed}")
    starts = [rng.randrange(len(GRID_MS) - 3) for _ in range(threads)]
    shares = [rng.random() + 0.1 for _ in range(threads)]
    lines = ["dse: 1", f"name: {threads} threads on {cores} cores, {load:g} full, seed {seed}", "deadlines: all"]
    lines += ["processing: execution_time", "processor_types:"]
    lines += [f"  {name}: {{cores: {cores}, price: {price} EUR}}" for name, (price, _) in SPEEDS.items()]
    lines += ["processors: {p: {type: [slow, medium, fast]}}", "devices: {s: {period: 10 ms}}", "threads:"]
    for number, (start, share) in enumerate(zip(starts, shares, strict=True)):
        used_us = share / sum(shares) * cores * load * GRID_MS[start + 1] * 1000
        worst = {name: max(1, int(used_us * speed / SPEEDS["medium"][1])) for name, (_, speed) in SPEEDS.items()}
        times = ", ".join(f"{name}: {most // 2} us .. {most} us" for name, most in worst.items())
        periods = ", ".join(f"{period} ms" for period in GRID_MS[start : start + 4])
        lines.append(f"  t{number}: {{processor: p, compute_execution_time: {{{times}}}, period: [{periods}]}}")
    path = ["s", *(f"t{number}" for number in range(threads))]
    lines.append("connections:")
    lines += [f"  c{number}: {{from: {one}, to: {other}}}" for number, (one, other) in enumerate(pairwise(path))]
    lines += [f"flows: {{f: {{path: [{', '.join(path)}]}}}}", "objectives: [minimise price, minimise latency of f]"]
    return "\n".join(lines) + "\n"


def long_flows(threads: int, seed: int) -> str:
    """Threads with four periods each in flows of eight hops, one flow for three threads, two types of the computer.

    The objectives are the sum of the flows' latencies, and utilisation; both are plain sums over the decisions.
    """
    rng = random.Random(seed)
    lines = ["dse: 1", f"name: {threads} threads in long flows, seed {seed}"]
    lines += ["processing: execution_time", "processor_types:"]
    lines += ["  slow: {cores: 8, price: 100 EUR}", "  fast: {cores: 8, price: 250 EUR}"]
    lines += ["processors: {computer: {type: [slow, fast]}}", "threads:"]
    for number in range(threads):
        time_us = rng.randint(100, 900)
        times = f"{{slow: {time_us} us .. {2 * time_us} us, fast: {time_us // 2} us .. {time_us} us}}"
        lines.append(f"  t{number}: {{processor: computer, period: [5 ms, 10 ms, 20 ms, 40 ms],")
        lines.append(f"    compute_execution_time: {times}}}")
    flows = [rng.sample(range(threads), 8) for _ in range(threads // 3)]
    wires = dict.fromkeys(pair for path in flows for pair in pairwise(path))
    lines += ["connections:", *(f"  c{one}_{two}: {{from: t{one}, to: t{two}}}" for one, two in wires), "flows:"]
    lines += [f"  f{number}: {{path: [{', '.join(f't{item}' for item in path)}]}}" for number, path in enumerate(flows)]
    names = [f"latency of f{number}" for number in range(len(flows))]
    lines += [f"metrics: {{all_latency: {' + '.join(names)}}}"]
    lines += [f"requirements: [{', '.join(f'{name} <= 264 ms' for name in names)}]"]
    return "\n".join([*lines, "objectives: [minimise all_latency, minimise utilisation of computer]"]) + "\n"


def contended(*, quick: bool, seed: int) -> list[Case]:
    """Problems with deadlines and open cores, which are timed beside other ways to meet deadlines."""

    def drawn(family: str, threads: int) -> Case:
        case = generated(family, threads, 2, seed)
        return replace(case, name=f"{case.name} deadlines", deadlines=True)

    def full(threads: int, cores: int, load: float) -> Case:
        name = f"{threads} threads on {cores} cores, {load:.0%} full, seed={seed}"
        return Case(name, threads=threads, objectives=2, seed=seed, deadlines=True, cores=cores, load=load)

    if quick:
        return [drawn("automotive", 6), drawn("robot", 10), full(6, 2, 0.8)]
    return [
        *(drawn(family, 16) for family in ("robot", "two-computers")),
        full(16, 2, 0.65),
        *(drawn(family, 30) for family in families()),
        full(24, 3, 0.65),
    ]


def heuristics(*, quick: bool, seed: int) -> list[Case]:
    """Problems that are solved without each heuristic of the search: at least one for each that needs it."""

    def drawn(family: str, threads: int, objectives: int, seed: int, kind: str = "") -> Case:
        case = generated(family, threads, objectives, seed)
        name = f"{case.name} {kind}" if kind else case.name
        return replace(case, name=name, deadlines=bool(kind), waiting=kind == "response times")

    def full(threads: int, cores: int, load: float) -> Case:
        name = f"{threads} threads on {cores} cores, {load:.0%} full, seed={seed}"
        return Case(name, threads=threads, objectives=2, seed=seed, deadlines=True, cores=cores, load=load)

    if quick:
        return [drawn("automotive", 10, 3, seed), full(6, 2, 0.8)]
    return [
        drawn("automotive", 60, 2, seed),
        drawn("robot", 60, 2, seed),
        drawn("two-computers", 100, 2, seed),
        drawn("automotive", 30, 3, seed),
        drawn("automotive", 10, 4, seed),
        drawn("many-buses", 60, 3, 15),
        Case(f"knapsack 40 items K=3 seed={seed}", "knapsack", 40, 3, seed),
        Case("long-flows N=30 K=2 seed=2", "long-flows", 30, 2, 2),
        full(24, 3, 0.65),
        full(24, 3, 0.8),
        full(48, 6, 0.65),
        drawn("two-computers", 64, 2, 3, "deadlines"),
        drawn("automotive", 30, 2, 6, "response times"),
        drawn("two-computers", 30, 2, 8, "response times"),
        drawn("robot", 20, 2, 6, "response times"),
    ]


def families() -> Collection[str]:
    """Those of the generator."""
    from dse.examples.random import FAMILIES

    return FAMILIES


def classical(*, quick: bool, seed: int) -> list[Case]:
    """Assignments and knapsacks, which are solved by the command itself and by another exact method.

    The first one is so small that both do little but start.
    """

    def drawn(family: str, size: int, objectives: int, seed: int = seed) -> Case:
        shape = f"{size} x {size}" if family == "assignment" else f"{size} items"
        return Case(f"{family} {shape} K={objectives} seed={seed}", family, size, objectives, seed)

    start = drawn("assignment", 2, 3)
    if quick:
        return [start, drawn("assignment", 5, 3), drawn("knapsack", 10, 3), drawn("knapsack", 10, 4)]
    assignments = [drawn("assignment", 10, 3, seed), drawn("assignment", 10, 3, seed + 1)]
    sizes = ((20, 3), (30, 3), (20, 4), (40, 3), (30, 4))
    return [start, *assignments, *(drawn("knapsack", *size) for size in sizes)]


def generated(family: str, threads: int, objectives: int, seed: int = 1, periods: int = 0) -> Case:
    """A case of the generator, named after its arguments."""
    name = f"{family} N={threads} K={objectives} seed={seed}"
    return Case(f"{name} periods<={periods}" if periods else name, family, threads, objectives, seed, periods=periods)


INMARK = Case("inmark, jitter <= 20 ms", file="problems/inmark.yaml", max_jitter="20 ms")


MANY_POINTS = generated("many-buses", 100, 3, 15)
"""201 points of 100 threads: checkpoints that are made anew took eight times as long as the search."""


def fronts(*, quick: bool, seed: int) -> list[Case]:
    """Problems whose proven fronts are timed beside the peers'."""
    small = [generated(family, 6, 3, seed) for family in families()]
    if quick:
        return [INMARK, *small[:2], generated("event-driven", 30, 2, seed)]
    middle = [generated(family, 30, objectives, seed) for family in families() for objectives in (2, 3)]
    many = [generated(family, 10, 4, seed) for family in ("automotive", "many-buses")]
    large = [generated(family, 100, 3, seed) for family in ("many-buses", "automotive", "two-computers")]
    largest = [generated(family, 300, 2, seed) for family in ("event-driven", "two-computers", "robot")]
    return [INMARK, *small, *middle, *many, *large, *largest, generated("event-driven", 1000, 2, seed)]


def commands(*, quick: bool, seed: int) -> list[Case]:
    """Problems that are solved by the command itself: many points, so that what is kept of them is large."""
    if quick:
        return [INMARK, generated("many-buses", 10, 3, seed)]
    return [INMARK, *(generated("many-buses", threads, 3, seed) for threads in (30, 100)), MANY_POINTS]


def curves(*, quick: bool, seed: int) -> dict[str, list[tuple[float, Case]]]:
    """Series of cases by what grows in them, with its value."""
    threads = (10, 20) if quick else (10, 30, 100, 300, 1000)
    objectives = (2, 3) if quick else (2, 3, 4, 5)
    options = (2, 3) if quick else (2, 3, 4, 5, 6)
    return {
        "threads": [(n, generated("event-driven", n, 2, seed)) for n in threads],
        "objectives": [(k, generated("event-driven", 10, k, seed)) for k in objectives],
        "options of a period": [(m, generated("many-buses", 20, 2, seed, m)) for m in options],
    }
