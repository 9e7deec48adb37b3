"""Runs side by side on the cores of this machine, in fresh processes; one that dies costs its current run only.

A `ProcessPoolExecutor` loses all of its runs when one worker is killed. Here each worker has a pipe of its own: the
others do not notice, and the lost run is given to a new worker.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import socket
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from dse.support.errors import DseError, UsageError
from dse.support.timelimit import NEVER, OutOfTime, TimeLimit, until

MOST_DEATHS = 3
"""A run that has cost this many workers is given up."""
Task = Callable[[str], str]


class LostRunError(DseError):
    """A run took several workers with it: most likely it needs more memory than there is.

    The message names the run; runs that were finished are in the store.
    """


def run_all(
    task: Task, payloads: Sequence[str], workers: int, limit: TimeLimit = NEVER
) -> Generator[tuple[int, str], None, None]:
    """(number, outcome) of each payload as it is finished; in this process when there is one worker.

    Raises
    ------
    OutOfTime
        when the limit comes before the last of them; what is under way then is lost.
    LostRunError
        when a run has cost `MOST_DEATHS` workers.
    """
    if workers <= 1 or len(payloads) <= 1:
        for number, payload in enumerate(payloads):
            limit.check()
            with until(limit):
                outcome = _interruptible(task, payload)
            yield number, outcome
        return
    pool = _Pool(task, payloads, min(workers, len(payloads)), limit)
    try:
        yield from pool.outcomes()
    finally:
        pool.stop()


def _interruptible(task: Task, payload: str) -> str:
    """Run a task here; when Ctrl-C was pressed meanwhile, its outcome is not taken.

    A search takes the signal for itself and hands out what it has, which may be less than it says.
    """
    if threading.current_thread() is not threading.main_thread():
        return task(payload)
    reader, writer = socket.socketpair()
    with reader, writer:
        reader.setblocking(False)
        writer.setblocking(False)
        before = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
        try:
            outcome = task(payload)
        finally:
            signal.set_wakeup_fd(before)
        with suppress(BlockingIOError):
            if signal.SIGINT in reader.recv(4096):
                raise KeyboardInterrupt
    return outcome


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    run: int | None = None


class _Pool:
    def __init__(self, task: Task, payloads: Sequence[str], workers: int, limit: TimeLimit) -> None:
        self.task, self.payloads, self.limit = task, payloads, limit
        self.context = multiprocessing.get_context("spawn")
        self.waiting = deque(range(len(payloads)))
        self.deaths = dict.fromkeys(self.waiting, 0)
        self.workers = [self._started() for _ in range(workers)]

    def _started(self) -> _Worker:
        ours, theirs = self.context.Pipe()
        process = self.context.Process(target=_work, args=(self.task, theirs), daemon=True)
        with _interrupts_ignored():  # the child is born deaf to Ctrl-C, which is ours to handle
            process.start()
        theirs.close()
        return _Worker(process, ours)

    def outcomes(self) -> Generator[tuple[int, str], None, None]:
        left = len(self.payloads)
        while left:
            for worker in self.workers:
                self._feed(worker)
            left_s = None if self.limit.seconds is None else self.limit.left_s
            ready = wait([worker.pipe for worker in self.workers if worker.run is not None], left_s)
            if not ready:
                raise OutOfTime
            for worker in [item for item in self.workers if item.pipe in ready]:
                number = worker.run
                assert number is not None
                try:
                    good, outcome = worker.pipe.recv()
                except (EOFError, OSError):
                    self._bury(worker, number)
                    continue
                worker.run = None
                if not good:
                    raise outcome
                left -= 1
                yield number, outcome

    def _feed(self, worker: _Worker) -> None:
        if worker.run is not None or not self.waiting:
            return
        number = self.waiting.popleft()
        worker.run = number
        try:
            worker.pipe.send(self.payloads[number])
        except OSError:
            self._bury(worker, number)

    def _bury(self, worker: _Worker, number: int) -> None:
        """A worker is gone: its run goes back to the front of the queue, a new worker takes its place."""
        worker.pipe.close()
        worker.process.join()
        self.deaths[number] += 1
        if self.deaths[number] >= MOST_DEATHS:
            raise LostRunError(f"run {number + 1} has cost {MOST_DEATHS} worker processes; the others are kept")
        self.waiting.appendleft(number)
        self.workers[self.workers.index(worker)] = self._started()

    def stop(self) -> None:
        for worker in self.workers:
            worker.pipe.close()
            worker.process.terminate()
        for worker in self.workers:
            worker.process.join()


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _work(task: Task, pipe: Connection) -> None:
    """The life of a worker: Ctrl-C is the parent's to handle, and where the parent dies it ends too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()
    while True:
        try:
            payload = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer: tuple[bool, Any] = (True, task(payload))
        except Exception as error:  # noqa: BLE001 (raised again in the parent)
            answer = (False, error)
        try:
            pipe.send(answer)
        except OSError:
            return


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def usable_cores() -> int:
    """The cores that this process may use.

    The size of the CPU affinity mask where the system has one (cpusets of containers count, quotas do not), else all
    cores.
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_workers(workers: int) -> None:
    """At least one.

    Raises
    ------
    UsageError
        when it is not.
    """
    if workers < 1:
        raise UsageError(f"at least one worker, got {workers}")
