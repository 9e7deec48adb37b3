"""Families of random problems: what kind of system is drawn."""

from __future__ import annotations

from dataclasses import dataclass

from dse.examples.random.published import (
    AUTOMOTIVE_MACHINES,
    AUTOMOTIVE_PERIODS_MS,
    AUTOMOTIVE_SENSORS_MS,
    ROBOT_MACHINES,
    ROBOT_PERIODS_MS,
    ROBOT_SENSORS_MS,
    MachineType,
)

ROBOT_ROLES = ("driver", "filter", "fusion", "localiser", "tracker", "planner", "controller", "monitor", "logger")
AUTOMOTIVE_ROLES = ("acquire", "filter", "observer", "torque", "brake", "steer", "diagnose", "gateway", "state")


@dataclass(frozen=True)
class Family:
    """The parameters of a family of problems; shares are of all threads or connections, in percent.

    `event` and `both` are the threads that are dispatched by events only, or by either protocol; the others have a
    timer only. `movable` threads may run on either of two processors, `rerouted` connections take either of two buses.
    """

    name: str
    title: str
    threads_per_processor: int
    buses_per_processor: int
    event: int
    both: int
    movable: int
    rerouted: int
    automotive: bool = False
    least_processors: int = 1
    most_processors: int = 40

    def processors(self, threads: int) -> int:
        """The number of processor slots of a system with this many threads."""
        wanted = -(-threads // self.threads_per_processor)
        return max(self.least_processors, min(self.most_processors, wanted))

    @property
    def machines(self) -> tuple[MachineType, ...]:
        """The catalogue of processors."""
        return AUTOMOTIVE_MACHINES if self.automotive else ROBOT_MACHINES

    @property
    def periods_ms(self) -> tuple[int, ...]:
        """The periods that options are taken from."""
        return AUTOMOTIVE_PERIODS_MS if self.automotive else ROBOT_PERIODS_MS

    @property
    def sensors_ms(self) -> tuple[int, ...]:
        """The periods of sensors."""
        return AUTOMOTIVE_SENSORS_MS if self.automotive else ROBOT_SENSORS_MS

    @property
    def roles(self) -> tuple[str, ...]:
        """The roles that threads are named after."""
        return AUTOMOTIVE_ROLES if self.automotive else ROBOT_ROLES


FAMILIES = {
    family.name: family
    for family in (
        Family("robot", "Robot with one computer", 10**6, 2, 15, 70, 0, 0),
        Family("two-computers", "Robot with two computers", 10**6, 1, 10, 75, 20, 0, least_processors=2),
        Family("event-driven", "Event-driven perception chains", 40, 1, 50, 40, 0, 0, least_processors=2),
        Family("many-buses", "Distributed machine with many buses", 12, 1, 10, 75, 0, 40, least_processors=3),
        Family("automotive", "Automotive control units", 25, 1, 15, 65, 0, 15, automotive=True, least_processors=3),
    )
}
"""By name; the first is the default."""
