"""When the state of a running search is handed out: often, but never for more than a small share of the time."""

from __future__ import annotations

import time
from collections.abc import Callable

from dse.records import dataclass

CHECKPOINT_S = 1.0
"""The least seconds from the end of one checkpoint to the next; a quarter of it to the first, which is small."""
SHARE = 0.02
"""Of the time, so much is meant for checkpoints; it stays below 5 %, as one may cost more than was expected."""
AGAIN = 0.25
"""What was in the checkpoint before costs this share of what is new: its figures are known, it is written again."""


@dataclass
class Pace:
    """Checkpoints of a search that began at `started`, in seconds of the monotonic clock.

    The next one is expected to cost what the last one did, in proportion to what is new and what is written again. The
    clock starts when a checkpoint ends, so that a slow disk or a large result make them rare instead of filling the
    time.
    """

    started: float
    ended: float | None = None
    size: int = 0
    spent_s: float = 0.0
    per_unit_s: float = 0.0

    def _units(self, size: int) -> float:
        """How much work a checkpoint of so many points and regions is."""
        return max(1.0, size - self.size + AGAIN * size)

    def is_due(self, size: int) -> bool:
        """Whether there is time for a checkpoint of so many points and regions."""
        now = time.monotonic()
        if self.ended is None:
            return now - self.started >= CHECKPOINT_S / 4
        expected_s = self.per_unit_s * self._units(size)
        return now - self.ended >= CHECKPOINT_S and self.spent_s + expected_s <= SHARE * (now - self.started)

    def spend(self, size: int, checkpoint: Callable[[], None]) -> None:
        """Make a checkpoint of so many points and regions."""
        began = time.monotonic()
        checkpoint()
        self.ended = time.monotonic()
        cost_s = self.ended - began
        self.spent_s += cost_s
        self.per_unit_s = cost_s / self._units(size)
        self.size = size
