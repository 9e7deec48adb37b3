"""When the state of a running search is handed out: often, but never for more than a small share of the time."""

from __future__ import annotations

import time
from collections.abc import Callable

from dse.records import dataclass

CHECKPOINT_S = 1.0
"""The least seconds from the end of one checkpoint to the next; a quarter of it to the first, which is small."""
SHARE = 0.02
"""Of the time, so much is meant for checkpoints; it stays below 5 %, as one may cost more than was expected."""
WAIT_S = 0.04
"""So much waiting in a checkpoint is other work of the machine, or of the thread that searches; what is more counts."""
SECOND = 0.25
"""The second checkpoint waits until the first one is no larger share of the time."""


@dataclass
class Pace:
    """Checkpoints of a search that began at `started`, in seconds of the monotonic clock.

    All is written again each time, which costs something for each point and something whatever there is: both are
    estimated from the last two. The clock starts when a checkpoint ends, so that a slow disk or a large result make
    them rare instead of filling the time.
    """

    started: float
    ended: float | None = None
    spent_s: float = 0.0
    last_s: float = 0.0
    last_size: int = 0
    per_unit_s: float | None = None

    def keep(self, size: int, checkpoint: Callable[[], None]) -> None:
        """Make a checkpoint of so many points and regions, if it is time."""
        if self.is_due(size):
            if self.ended is None:
                checkpoint()  # loads what writes a result, which the end needs in any case
            self.spend(size, checkpoint)

    def is_due(self, size: int) -> bool:
        """Whether there is time for a checkpoint of so many points and regions."""
        now = time.monotonic()
        if self.ended is None:
            return now - self.started >= CHECKPOINT_S / 4
        if now - self.ended < CHECKPOINT_S:
            return False
        if self.per_unit_s is None:
            return self.last_s <= SECOND * (now - self.started)
        expected_s = self.last_s + self.per_unit_s * max(0, size - self.last_size)
        return self.spent_s + expected_s <= SHARE * (now - self.started)

    def spend(self, size: int, checkpoint: Callable[[], None]) -> None:
        """Make a checkpoint of so many points and regions."""
        began, worked = time.monotonic(), time.thread_time()
        checkpoint()
        is_first, self.ended = self.ended is None, time.monotonic()
        cost_s = max(time.thread_time() - worked, self.ended - began - WAIT_S)
        if not is_first:
            more = size - self.last_size
            per_unit_s = (cost_s - self.last_s) / more if more > 0 else self.per_unit_s or 0.0
            self.per_unit_s = min(max(per_unit_s, 0.0), cost_s / max(1, size))
        self.spent_s += cost_s
        self.last_s, self.last_size = cost_s, size
