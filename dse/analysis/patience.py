"""A limit of time on analyses that can take long: whoever has one states it, and the long loops look at the clock.

The figures themselves never depend on it: an analysis ends with its answer, or with `OutOfTime`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar


class OutOfTime(Exception):
    """The time was up, or whoever asked was stopped, before the answer was known."""


_DEADLINE: ContextVar[float | None] = ContextVar("deadline", default=None)


@contextmanager
def until(deadline: float | None) -> Iterator[None]:
    """What is analysed inside ends with `OutOfTime` soon after `deadline`, in seconds of the monotonic clock.

    None is no limit; of two limits, one inside the other, the sooner holds.
    """
    outer = _DEADLINE.get()
    limits = [item for item in (outer, deadline) if item is not None]
    token = _DEADLINE.set(min(limits, default=None))
    try:
        yield
    finally:
        _DEADLINE.reset(token)


def look_at_the_clock() -> None:
    """Go on, unless the time is up.

    Raises
    ------
    OutOfTime
        when the time that `until` gave is up.
    """
    deadline = _DEADLINE.get()
    if deadline is not None and time.monotonic() > deadline:
        raise OutOfTime
