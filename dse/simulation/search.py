"""The worst and the best case of a flow, searched over offsets.

Coordinate search from random starts: along the flow, each timer is moved so that it has just missed the datum that
took longest to get there (or just caught the quickest); with contention, what shares a core with the flow is then
moved, one by one, to be released together with it. A move is kept unless it makes the observation better than it was.
What is found is an observed latency, not a bound.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from dse.simulation.engine import simulate_once
from dse.simulation.observing import Execution, Observation, Setting
from dse.simulation.plan import Plan
from dse.space.model.flows import Flow
from dse.support.units import Exact


@dataclass
class Observations:
    """Everything observed over many runs: latencies by flow, responses by task, losses, and the extreme settings.

    `extremes` maps (flow, "max" or "min") to the latency in ns and the setting that showed it.
    """

    latencies: list[Counter[Exact]]
    responses: dict[str, Exact] = field(default_factory=dict)
    lost: Counter[str] = field(default_factory=Counter)
    extremes: dict[tuple[int, str], tuple[Exact, Setting]] = field(default_factory=dict)
    disparities: dict[int, Exact] = field(default_factory=dict)
    runs: int = 0
    events: int = 0

    def add(self, seen: Observation, setting: Setting) -> None:
        """Take in one run.

        Longest responses and disparities, latencies with their counts, and the setting of each new extreme.
        """
        self.runs += 1
        self.events += seen.events
        for name, response in seen.responses.items():
            self.responses[name] = max(self.responses.get(name, 0), response)
        for number, disparity in seen.disparities.items():
            self.disparities[number] = max(self.disparities.get(number, 0), disparity)
        self.lost.update(seen.lost)
        for flow, counter in enumerate(seen.latencies):
            self.latencies[flow].update(counter)
            for goal, value in (("max", max(counter, default=None)), ("min", min(counter, default=None))):
                known = self.extremes.get((flow, goal))
                if value is not None and (known is None or _is_further(value, known[0], goal)):
                    self.extremes[flow, goal] = (value, setting)


def _is_further(value: Exact, other: Exact, goal: str) -> bool:
    return value > other if goal == "max" else value < other


def random_offsets(plan: Plan, rng: random.Random) -> dict[str, int]:
    """An offset within its period for every timer; those that keep their phase to others move together.

    In ns by name of the timer.
    """
    return plan.aligned({name: rng.randrange(max(1, int(period))) for name, period in plan.timers.items()})


def search_flow(plan: Plan, flow: int, item: Flow, setting: Setting, runs: int, record: Observations) -> None:
    """Search the longest and the shortest latency of a flow, half of `runs` each; every run goes into the record.

    Hill climbing from random offsets, with the longest execution times for the maximum and the shortest for the
    minimum. Results go to `record`.
    """
    rng = random.Random(f"{setting.seed} {flow}")
    for goal in ("max", "min"):
        left = max(1, runs // 2)
        while left > 0:
            execution: Execution = "max" if goal == "max" else "min"
            start = replace(setting, offsets_ns=random_offsets(plan, rng), execution=execution)
            left -= _climb(plan, flow, item, start, goal, left, record)


def _climb(plan: Plan, flow: int, item: Flow, setting: Setting, goal: str, budget: int, record: Observations) -> int:
    """One start of the search; returns the number of runs that it took."""
    seen = _observe(plan, setting, record)
    best, used = _extreme(seen, flow, goal), 1
    for kind, position, name in _moves(plan, flow, item):
        if used >= budget:
            break
        reached = (seen.latest if goal == "max" else seen.earliest).get((flow, position))
        if reached is None:
            continue
        moment = reached[1]
        if kind == "miss":
            moment += -1 if goal == "max" else 0
        elif goal == "min":  # keep rivals away from the flow: release them right after it has read its input
            moment += 1
        period = max(1, int(plan.timers[name]))
        to = int(moment) if name in plan.phases else moment % period
        moved = replace(setting, offsets_ns=plan.aligned({**setting.offsets_ns, name: to}, name))  # type: ignore[dict-item]
        latency = _observe(plan, moved, record)
        used += 1
        value = _extreme(latency, flow, goal)
        if value is not None and (best is None or not _is_further(best, value, goal)):
            setting, seen, best = moved, latency, value
    return used


def _observe(plan: Plan, setting: Setting, record: Observations) -> Observation:
    seen = simulate_once(plan, setting)
    record.add(seen, setting)
    return seen


def _extreme(seen: Observation, flow: int, goal: str) -> Exact | None:
    counter = seen.latencies[flow]
    if not counter:
        return None
    return max(counter) if goal == "max" else min(counter)


def _moves(plan: Plan, flow: int, item: Flow) -> Iterator[tuple[str, int, str]]:
    """Timers to move, and the flow step that says where to: those of the flow, then those that share their cores."""
    own = []
    for position, step in enumerate(item.steps):
        task = plan.tasks[step.index, "thread"] if step.kind == "component" else None
        if task is None or step.via is None:
            continue
        own.append((position, task))
        if task.period_ns is not None:
            yield "miss", position, task.name
    flowing = {task.name for _, task in own}
    for position, task in own:
        for other in plan.tasks.values():
            if other.core == task.core is not None and other.period_ns is not None and other.name not in flowing:
                yield "meet", position, other.name


def histogram(counter: Mapping[Exact, int], least: Exact, most: Exact, bins: int) -> list[dict[str, Any]]:
    """Counts in equal bins from `least` to `most`; the last bin is closed.

    Mappings with ``from_ns``, ``to_ns`` and ``count``; at most `bins` of them.
    """
    width = max(1, -(-(most - least + 1) // bins))
    counts = [0] * min(bins, max(1, -(-(most - least + 1) // width)))
    for value, count in counter.items():
        counts[min(len(counts) - 1, (value - least) // width)] += count
    return [
        {"from_ns": least + index * width, "to_ns": least + (index + 1) * width, "count": count}
        for index, count in enumerate(counts)
    ]
