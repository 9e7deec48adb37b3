"""A bus that messages wait for: one frame at a time, to its end, in the order that its arbitration gives."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from dse.simulation.bus_turns import BusTurn
from dse.simulation.core import Births
from dse.simulation.readings import FaultFigures, Range
from dse.support.units import Exact


@dataclass
class QueuedMessage:
    """A message that waits, the frames that it has left, and since when it waits.

    `left` are the ranges of time, in ns, of the frames that are still to be sent.
    """

    link: int
    births: Births
    since: Exact
    number: int
    turn: BusTurn
    left: deque[Range]


@dataclass
class Bus:
    """The messages that wait for a line of a bus, and until when a frame occupies it.

    Times in ns; frames are not preempted. At `fault_at` so many faults are left that may come at once.
    """

    waiting: list[QueuedMessage] = field(default_factory=list)
    busy_until: Exact = 0
    last_sender: int = -1
    fault_at: Exact | None = None
    faults_left: Exact = 0

    def may_fail(self, time: Exact, faults: FaultFigures) -> bool:
        """Whether another fault may come at a time: as many as the burst, and one more with each interval.

        A fault is counted by `fail`.
        """
        if self.fault_at is None:
            self.faults_left = faults.burst
        else:
            since = Fraction(time - self.fault_at) / faults.interval_ns
            self.faults_left = min(Fraction(faults.burst), self.faults_left + since)
        self.fault_at = time
        return self.faults_left >= 1

    def fail(self) -> None:
        """Count a fault at the time that was asked about last."""
        self.faults_left -= 1

    def next(self, senders: Sequence[int]) -> QueuedMessage:
        """The message whose frame goes next.

        By its identifier (of a queue only the oldest competes); by its class, then as it came; as it came; or the
        oldest one of the sender that follows the last one, in the order of `senders`.
        """
        kind = self.waiting[0].turn.arbitration
        if kind == "classes":
            return min(self.waiting, key=lambda item: (item.turn.identifier, item.number))
        if kind == "priority":
            oldest: dict[str, QueuedMessage] = {}
            for item in self.waiting:
                if item.turn.queue and item.number < oldest.setdefault(item.turn.queue, item).number:
                    oldest[item.turn.queue] = item
            competing = [item for item in self.waiting if oldest.get(item.turn.queue, item) is item]
            return min(competing, key=lambda item: (item.turn.identifier, item.number))
        if kind != "round_robin":
            return min(self.waiting, key=lambda item: item.number)
        last = senders.index(self.last_sender) if self.last_sender in senders else -1

        def turn(item: QueuedMessage) -> tuple[int, int]:
            return (senders.index(item.turn.sender) - last - 1) % len(senders), item.number

        return min(self.waiting, key=turn)
