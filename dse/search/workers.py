"""Strategies at work on different regions at the same time, and Ctrl-C that loses nothing."""

from __future__ import annotations

import queue
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from dse.search.solver.strategy import Strategy
from dse.support.timelimit import until

Tag = TypeVar("Tag")
Outcome = TypeVar("Outcome")

END_S = 5.0
"""Seconds to wait for a call that was told to stop; it takes milliseconds."""
STEP_S = 0.2


class StrategyPool(Generic[Tag, Outcome]):
    """Runs one job at a time for each strategy, in daemon threads; the main thread waits in short steps.

    OR-tools' own signal handler can deadlock, and an interrupted join breaks on Python 3.11: hence the queue.
    """

    def __init__(self, strategies: Sequence[Strategy] = ()) -> None:
        self.strategies = list(strategies)
        self.busy: dict[Strategy, Tag] = {}
        self._threads: list[threading.Thread] = []
        self._answers: queue.Queue[tuple[Strategy, Outcome | BaseException]] = queue.Queue()

    @property
    def idle(self) -> Sequence[Strategy]:
        """The strategies without a job."""
        return [strategy for strategy in self.strategies if strategy not in self.busy]

    @property
    def calls(self) -> int:
        """The number of questions asked."""
        return sum(strategy.calls for strategy in self.strategies)

    @property
    def stopped(self) -> bool:
        """Whether the pool was asked to stop."""
        return any(strategy.stopped for strategy in self.strategies)

    def start(self, strategy: Strategy, tag: Tag, job: Callable[[], Outcome]) -> None:
        """Begin a job of an idle strategy, whose deadline is in force around it.

        The job runs in a thread; CP-SAT releases the interpreter lock while it solves.
        """

        def work() -> None:
            try:
                with until(strategy.deadline):
                    answer = job()
                self._answers.put((strategy, answer))
            except BaseException as error:  # noqa: BLE001 (handed to the waiting thread, which raises it)
                self._answers.put((strategy, error))

        self.busy[strategy] = tag
        thread = threading.Thread(target=work, daemon=True)
        self._threads = [*(other for other in self._threads if other.is_alive()), thread]
        thread.start()

    def wait(self, meanwhile: Callable[[], None] = lambda: None) -> tuple[Tag, Outcome]:
        """The next finished job; raises what it raised. Now and then `meanwhile` is called until there is one.

        `meanwhile` is called about every `STEP_S` seconds; checkpoints are written there.
        """
        while True:
            try:
                strategy, answer = self._answers.get(timeout=STEP_S)
            except queue.Empty:
                if self.stopped:
                    self.stop()  # again, for a call that was about to begin the first time
                meanwhile()
                continue
            tag = self.busy.pop(strategy)
            if isinstance(answer, BaseException):
                self.stop()
                raise answer
            return tag, answer

    def stop(self) -> None:
        """End all running jobs soon; they answer that they are unfinished.

        May be called more than once, and from a signal handler.
        """
        for strategy in self.strategies:
            strategy.stop()

    def end(self) -> None:
        """Stop, and wait until no job is inside the solver any more: Python, leaving, would end it there by abort.

        At most `END_S` seconds are waited.
        """
        until = time.monotonic() + END_S
        while any(thread.is_alive() for thread in self._threads) and time.monotonic() < until:
            self.stop()  # again, for a call that was about to begin the first time
            time.sleep(0.01)

    def drain(self) -> Iterator[tuple[Tag, Outcome]]:
        """Let the running jobs end.

        Yields tags with outcomes, in the order in which jobs end.
        """
        while self.busy:
            yield self.wait()


def heard(strategy: Strategy, question: Callable[[], Outcome]) -> Outcome:
    """The answer to one question, in a thread of its own: Ctrl-C is heard at once and ends it.

    Raises `KeyboardInterrupt` after the solver has ended.
    """
    pool: StrategyPool[None, Outcome] = StrategyPool([strategy])
    try:
        pool.start(strategy, None, question)
        return pool.wait()[1]
    except KeyboardInterrupt:
        pool.end()
        raise


@contextmanager
def stop_on_interrupt(stop: Callable[[], None]) -> Iterator[None]:
    """Ctrl-C calls `stop` instead of raising; a second one raises. Outside the main thread nothing changes.

    The earlier handler is put back at the end.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handler(number: int, frame: Any) -> None:
        signal.signal(signal.SIGINT, before)
        stop()

    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


# When the state of a running search is handed out: often, but never for more than a small share of the time.


CHECKPOINT_S = 1.0
"""The least seconds from the end of one checkpoint to the next; a quarter of it to the first, which is small."""
SHARE = 0.02
"""Of the time, so much is meant for checkpoints; it stays below 5 %, as one may cost more than was expected."""
WAIT_S = 0.04
"""Waiting in a checkpoint that is taken for other work of the machine or of the search; more than that counts."""
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
        """Make a checkpoint of a number of points and regions, if it is time.

        The first checkpoint is not measured, because it also imports what writes results.
        """
        if self.is_due(size):
            if self.ended is None:
                checkpoint()  # loads what writes a result, which the end needs in any case
            self.spend(size, checkpoint)

    def is_due(self, size: int) -> bool:
        """Whether there is time for a checkpoint of a number of points and regions.

        True where the expected cost keeps checkpoints within a share `SHARE` of the elapsed time.
        """
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
        """Make a checkpoint of a number of points and regions.

        CPU time is measured, to predict the cost of the next checkpoint from its size.
        """
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
