"""The busy period of a bus in which a message responds last, played frame by frame.

All that is more urgent is queued at once and then as early as it can be, behind the longest less urgent frame that has
just begun, with faults of the wire as soon as they may come; what comes less than a bit after a start still goes first.
The last piece ends with the response time that is found (docs/semantics.md, section 5.4).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import takewhile

from dse.analysis.diagnosis.timelines import MOST_JOBS, SECTION, BusyPeriod, Piece, of_executor, urgency_of
from dse.analysis.messages.waits import MessageResponse
from dse.analysis.scheduling.busy_window import Task, densest_releases_ns, most_jobs
from dse.analysis.scheduling.policies.buses import Arbitrated, InTurn
from dse.support.units import Exact


def worst_bus_period(messages: Sequence[MessageResponse]) -> BusyPeriod | None:
    """The busy period of the message of a bus that has the least time left to its deadline.

    Of messages without deadlines it is the one that responds last. None where it has no bound, where its bound is one
    that no run has to reach (senders that take turns, or queue messages as they come), or beyond `MOST_JOBS` frames.
    """
    for item in sorted((item for item in messages if item.response_ns is not None), key=urgency_of):
        window = item.window
        if isinstance(window, InTurn) and not window.turns:
            return of_executor(item.name, item.deadline_ns, window.in_line)
        if isinstance(window, Arbitrated):
            worst_job = window.worst_job()
            if worst_job is None:
                continue
            tasks = (window.task, *window.urgent, *window.of_wire)
            if sum(most_jobs(one, worst_job[1]) for one in tasks) > MOST_JOBS:
                return None
            return BusyPeriod(item.name, played_on_bus(window, worst_job), *worst_job, item.deadline_ns)
    return None


def played_on_bus(window: Arbitrated, worst_job: tuple[Exact, Exact]) -> tuple[Piece, ...]:
    """The frames and faults on a bus until the end of the worst job of a message, which `worst_job` tells; no gaps.

    Pieces in ns from the beginning of the busy period; a message of several frames is one piece where nothing comes
    between them.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> a, b = periodic("a", 2, 9), periodic("b", 4, 20)
    >>> window = Arbitrated(b, (a,), 3, 4, 1, periodic("faults", 5, 100))
    >>> [(item.name, item.start_ns, item.end_ns) for item in played_on_bus(window, window.worst_job())]
    [('less urgent', 0, 3), ('faults', 3, 8), ('a', 8, 10), ('a', 10, 12), ('b', 12, 16)]
    """
    end = worst_job[1]
    urgent = [_jobs(item, end) for item in window.urgent if item.worst_ns]
    faults, own = _jobs(window.of_wire[0], end) if window.of_wire else [], _jobs(window.task, end)
    own = [(release, job, task) for release, job, task in own if release <= worst_job[0]]
    pieces = [Piece(SECTION, 1, 0, window.blocked_ns)] if window.blocked_ns else []
    now: Exact = window.blocked_ns
    left: Exact = window.task.worst_ns
    work: Exact
    while now < end:
        waits = [jobs for jobs in urgent if jobs and window.competes(jobs[0][0], now)]
        if faults and faults[0][0] < now + (window.last_ns if not waits and left == window.last_ns else 0):
            work, queue = faults[0][2].worst_ns, faults
        elif waits:
            work, queue = waits[0][0][2].worst_ns, waits[0]
        else:
            work, queue = (left - window.last_ns) or left, own
        _, job, task = queue[0]
        pieces.append(Piece(task.name, job, now, now + work))
        now += work
        if queue is own and work < left:
            left = window.last_ns
            continue
        queue.pop(0)
        left = window.task.worst_ns if queue is own else left
    return tuple(_together(pieces))


def _jobs(task: Task, end: Exact) -> list[tuple[Exact, int, Task]]:
    """The jobs of a task that are released before `end`, or right then, each with its number, from 1."""
    releases = takewhile(lambda release: release <= end, densest_releases_ns(task))
    return [(release, job, task) for job, release in enumerate(releases, 1)]


def _together(pieces: Iterable[Piece]) -> Iterator[Piece]:
    """The frames of one message that follow each other as one piece."""
    before: Piece | None = None
    for piece in pieces:
        if before is not None and (before.name, before.job) == (piece.name, piece.job):
            before = Piece(before.name, before.job, before.start_ns, piece.end_ns)
            continue
        if before is not None:
            yield before
        before = piece
    if before is not None:
        yield before
