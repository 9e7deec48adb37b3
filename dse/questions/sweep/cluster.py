"""Runs on a Dask cluster: the same outcomes, by way of a scheduler's address."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Generator, Sequence
from typing import TYPE_CHECKING, Any

from dse.questions.sweep.workers import MOST_DEATHS, Task
from dse.support.errors import DseError, UsageError
from dse.support.extras import needed_for
from dse.support.timelimit import NEVER, OutOfTime, TimeLimit

if TYPE_CHECKING:
    from distributed import Client

REACH_S = 5
"""Seconds within which something has to answer at all."""
CONNECT_S = 10
"""Seconds within which what answers has to turn out to be a scheduler."""
LAST_PORT = 65535
NO_SCHEDULER = (OSError, TimeoutError, EOFError, LookupError, MemoryError, TypeError, ValueError)
"""What Dask makes of a peer that does not answer, or of an answer that is not of Dask (a length read from its text)."""


LOGGERS = ("distributed", "tornado", "bokeh", "asyncio")


class ClusterError(DseError):
    """The cluster went away, or cannot do the work; what was finished is in the store.

    A `DseError` with one sentence; `dse sweep` with the same store goes on with the runs that are missing.
    """


def run_on_cluster(
    task: Task, payloads: Sequence[str], address: str, limit: TimeLimit = NEVER
) -> Generator[tuple[int, str], None, None]:
    """(number, outcome) of each payload as it is finished, wherever that was.

    A worker that dies costs its current run only: the scheduler gives it to another.

    Raises
    ------
    UsageError
        when there is no scheduler at the address, it has no workers, or the extra ``cluster`` is not installed.
    ClusterError
        when the scheduler goes away, or a run has cost several workers.
    OutOfTime
        when the limit comes before the last of them; what is under way then is lost.
    """
    client = _connected(address)
    try:
        yield from _outcomes(client, task, payloads, limit)
    finally:
        _quieten()  # also what it says of connections that we close
        client.close(timeout=5)


def _connected(address: str) -> Client:
    with needed_for("--scheduler", "cluster"):
        import distributed
    _check_reachable(address)
    _quieten()
    try:
        asyncio.run(_greeted(address))
    except Exception as error:
        raise UsageError(f"--scheduler {address}: there is no Dask scheduler ({_brief(error)})") from error
    try:
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False, name="dse")
    except NO_SCHEDULER as error:
        raise UsageError(f"--scheduler {address}: there is no Dask scheduler ({_brief(error)})") from error
    if not client.scheduler_info(n_workers=-1)["workers"]:
        client.close()
        raise UsageError(f"--scheduler {address}: the scheduler has no workers (dask worker {address})")
    return client


def _quieten() -> None:
    """Leave out what Dask logs, tracebacks for the most part: errors that matter are raised, and printed in one line.

    Its loggers have levels of their own, so that quietening the first of them is not enough.
    """
    for name in (*LOGGERS, *logging.root.manager.loggerDict):
        if name.partition(".")[0] in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _check_reachable(address: str) -> None:
    """Whether something listens there: Dask itself tries again and again until its time is up.

    Raises
    ------
    UsageError
        when nothing does, or the address is none.
    """
    scheme, mark, place = address.partition("://")
    if mark and scheme not in ("tcp", "tls"):
        raise UsageError(f"--scheduler {address!r}: expected tcp://HOST:PORT or tls://HOST:PORT")
    host, _, port = (place if mark else address).rpartition(":")
    if not host or not port.isdecimal() or int(port) > LAST_PORT:
        raise UsageError(f"--scheduler {address!r}: expected tcp://HOST:PORT, such as tcp://localhost:8786")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=REACH_S).close()
    except OSError as error:
        raise UsageError(f"--scheduler {address}: nothing listens there ({_brief(error)})") from error


async def _greeted(address: str) -> None:
    """Exchange greetings with what listens: a client would wait without end for one that never answers.

    Raises
    ------
    OSError, TimeoutError
        when it is no part of Dask, or does not answer in time.
    """
    from distributed.comm import connect
    from distributed.security import Security

    options = Security().get_connection_args("client")
    comm = await asyncio.wait_for(connect(address, timeout=CONNECT_S, **options), CONNECT_S)
    comm.abort()


def _brief(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]


def _outcomes(
    client: Client, task: Task, payloads: Sequence[str], limit: TimeLimit
) -> Generator[tuple[int, str], None, None]:
    import distributed

    submitted: list[Any] = client.map(task, list(payloads), pure=False, retries=MOST_DEATHS)
    numbers = {future.key: number for number, future in enumerate(submitted)}
    try:
        left_s = None if limit.seconds is None else limit.left_s
        for future in distributed.as_completed(submitted, loop=client.loop, timeout=left_s):
            if future.status == "cancelled" or future.status == "lost":
                raise ClusterError("the scheduler is gone; run the same command again to go on")
            error = future.exception()
            if isinstance(error, distributed.KilledWorker):
                raise ClusterError(
                    f"run {numbers[future.key] + 1} has cost several workers: {_brief(error)}"
                ) from error
            yield numbers[future.key], future.result()
            future.release()
    except TimeoutError as error:
        if limit.is_over:
            raise OutOfTime from error
        raise ClusterError(f"the scheduler is gone ({_brief(error)}); run the same command again to go on") from error
    except (OSError, distributed.client.FutureCancelledError) as error:
        raise ClusterError(f"the scheduler is gone ({_brief(error)}); run the same command again to go on") from error
    finally:
        client.cancel([future for future in submitted if not future.done()])
