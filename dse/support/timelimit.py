"""Limits of time: one for a whole command, in force around everything that it computes.

A limit is a moment of the monotonic clock, passed down to whatever has a clock of its own (a solver). The loops of
formulas, far below, look at the limit that is in force (`until`, `look_at_the_clock`). What is computed never depends
on it: a computation ends with its answer, or with `OutOfTime`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import ClassVar, TypeVar

from dse.support.errors import EXIT_INCOMPLETE, DseError

T = TypeVar("T")
GRACE = 0.1
"""A limit is kept to this share of it, or to a second where that is more."""
A_TICK_S = 1e-9
A_MOMENT_S = 0.5
"""The least time for steps without which there is no answer, also where a short limit was over before they began."""


class OutOfTime(DseError):
    """The time was up, or whoever asked was stopped, before the answer was known.

    Exit code 5; caught where a partial answer is possible.
    """

    exit_code = EXIT_INCOMPLETE

    def __init__(self, message: str = "the time limit came before there was an answer") -> None:
        super().__init__(message)


@dataclass(frozen=True)
class TimeLimit:
    """A limit of time: `seconds` from when the limit was made, until `deadline` of the monotonic clock.

    Without a limit both are None.
    """

    seconds: float | None = None
    deadline: float | None = None

    @classmethod
    def after(cls, seconds: float | None) -> TimeLimit:
        """A limit that begins now.

        `seconds` None gives `NEVER`; the clock is `time.monotonic`.
        """
        return cls() if seconds is None else cls(seconds, time.monotonic() + seconds)

    @property
    def left_s(self) -> float:
        """The seconds that are left; infinite without a limit.

        At least 0.
        """
        return math.inf if self.deadline is None else max(0.0, self.deadline - time.monotonic())

    @property
    def rest_s(self) -> float | None:
        """The seconds that are left, None without a limit: what another limit can be made of, which is never 0.

        At least `A_TICK_S`, because a limit of 0 s would mean none to some libraries.
        """
        return None if self.deadline is None else max(self.left_s, A_TICK_S)

    @property
    def is_over(self) -> bool:
        """Whether the time is up."""
        return self.deadline is not None and time.monotonic() >= self.deadline

    def check(self) -> None:
        """Go on, unless the time is up.

        Raises
        ------
        OutOfTime
            when it is.
        """
        if self.is_over:
            raise OutOfTime

    def for_the_last_steps(self) -> TimeLimit:
        """The limit, extended by half of its tolerance, for work that completes an answer that exists.

        The tolerance is a share `GRACE` of the limit, at least 1 s.
        """
        if self.seconds is None or self.deadline is None:
            return self
        more = max(1.0, GRACE * self.seconds) / 2
        return TimeLimit(self.seconds + more, self.deadline + more)

    def for_what_is_needed(self) -> TimeLimit:
        """The limit, but at least a moment from now: loading libraries may take longer than a short limit.

        At least `A_MOMENT_S` from now; for steps without which there is no answer at all.
        """
        last = self.for_the_last_steps()
        if last.seconds is None or last.deadline is None:
            return last
        more = max(0.0, time.monotonic() + A_MOMENT_S - last.deadline)
        return TimeLimit(last.seconds + more, last.deadline + more)

    def sparing(self, seconds: float) -> TimeLimit:
        """The limit, earlier by `seconds` or by a quarter of it, to leave time for writing the answer.

        A new limit; the search ends there, and the answer is written within the whole limit.
        """
        if self.seconds is None or self.deadline is None:
            return self
        less = min(seconds, self.seconds / 4)
        return TimeLimit(self.seconds - less, self.deadline - less)

    def sparing_for_the_answer(self) -> TimeLimit:
        """The limit, earlier by half of the time spent so far: what took long to read takes long to report.

        A new limit, at most a quarter earlier.
        """
        return self if self.seconds is None else self.sparing((self.seconds - self.left_s) / 2)

    def at_most(self, seconds: float) -> TimeLimit:
        """The limit, but at most `seconds` from now.

        A new limit; `seconds` may be infinite.
        """
        return TimeLimit.after(min(seconds, self.left_s))


NEVER = TimeLimit()
"""No limit."""
_DEADLINE: ContextVar[float | None] = ContextVar("deadline", default=None)


@contextmanager
def until(limit: TimeLimit | float | None) -> Iterator[None]:
    """End the computation in the ``with`` block by `OutOfTime` soon after a limit or a time of the monotonic clock.

    None is no limit; of two limits, one inside the other, the sooner holds.
    """
    inner = limit.deadline if isinstance(limit, TimeLimit) else limit
    limits = [item for item in (_DEADLINE.get(), inner) if item is not None]
    token = _DEADLINE.set(min(limits, default=None))
    try:
        yield
    finally:
        _DEADLINE.reset(token)


def in_force() -> TimeLimit:
    """The limit that is in force here, as one that begins now.

    `NEVER` outside of `until`.
    """
    deadline = _DEADLINE.get()
    return NEVER if deadline is None else TimeLimit(max(0.0, deadline - time.monotonic()), deadline)


def look_at_the_clock() -> None:
    """Go on, unless the time of the limit in force is up.

    Raises
    ------
    OutOfTime
        when it is.
    """
    deadline = _DEADLINE.get()
    if deadline is not None and time.monotonic() > deadline:
        raise OutOfTime


def in_time(items: Iterable[T], every: int = 100) -> Iterator[T]:
    """The items, with a look at the clock once in so many of them: few are done, however little time there is.

    Raises
    ------
    OutOfTime
        when the time of the limit in force is up.

    Examples
    --------
    >>> with until(TimeLimit.after(0.0)):
    ...     len(list(in_time(range(99))))
    99
    """
    for number, item in enumerate(items, start=1):
        if number % every == 0:
            look_at_the_clock()
        yield item


@dataclass
class StepCounter:
    """A count of pieces read, which checks the clock once in `EVERY` pieces.

    So what is small is always read, however little time there is.

    Examples
    --------
    >>> work = StepCounter()
    >>> with until(TimeLimit.after(0.0)):
    ...     work.go_on(999)
    """

    EVERY: ClassVar[int] = 1000
    pieces: int = 0

    def go_on(self, pieces: int = 1) -> None:
        """Count `pieces` of work as done.

        Raises
        ------
        OutOfTime
            when it is time to look at the clock, and the time of the limit in force is up.
        """
        self.pieces += pieces
        if self.pieces >= self.EVERY:
            self.pieces = 0
            try:
                look_at_the_clock()
            except OutOfTime:
                raise OutOfTime("the time limit came while the problem was read: nothing was computed") from None
