"""The kinds of executors, and of the arbitration of buses, by the names that files give them."""

from __future__ import annotations

from typing import Literal, TypeAlias

ExecutorKind: TypeAlias = Literal["fifo", "callback_group", "wait_set", "polling"]
POLLING: ExecutorKind = "polling"
"""The kind of an executor that drops what it has no room for."""
StatedArbitration: TypeAlias = Literal["priority", "fifo", "round_robin", "none"]
Arbitration: TypeAlias = StatedArbitration | Literal["classes"]
"""Which of the messages that wait for a bus goes next: as stated, or by the priorities of Ethernet."""
