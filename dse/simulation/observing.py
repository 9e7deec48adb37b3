"""What a run of the simulation is given, and what it showed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from dse.simulation.plan import StepKey
from dse.support.units import Exact

Execution: TypeAlias = Literal["max", "min", "random"]


@dataclass(frozen=True)
class Setting:
    """One run: offsets in ns and drifts in ppm by name (0 where missing), how execution times are drawn, and how long.

    `births_until_ns`: later data are not followed.
    """

    duration_ns: int
    births_until_ns: int
    offsets_ns: Mapping[str, Exact] = field(default_factory=dict)
    drift_ppm: Mapping[str, int] = field(default_factory=dict)
    execution: Execution = "random"
    bus_contention: bool = False
    seed: int = 0


@dataclass
class Observation:
    """The observations of a run: latencies by flow, longest response times by task, lost messages by place.

    `dropped` has for each connection how many of its messages made place for newer ones before a join of all took them.

    `disparities` has the largest difference of age of what a component reads by two flows, by its number.
    `latest` and `earliest` hold for each flow step the datum that took longest (shortest) to get there: its age and
    the time.
    """

    latencies: list[Counter[Exact]]
    responses: dict[str, Exact] = field(default_factory=dict)
    lost: Counter[str] = field(default_factory=Counter)
    dropped: Counter[str] = field(default_factory=Counter)
    latest: dict[StepKey, tuple[Exact, Exact]] = field(default_factory=dict)
    earliest: dict[StepKey, tuple[Exact, Exact]] = field(default_factory=dict)
    disparities: dict[int, Exact] = field(default_factory=dict)
    events: int = 0
