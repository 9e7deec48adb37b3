"""The busy period in which a job of a thread responds last, played piece by piece.

Whatever goes before the thread is released at once and then as early as it can be (the critical instant of
J. P. Lehoczky, "Fixed priority scheduling of periodic task sets with arbitrary deadlines", RTSS 1990), behind the
longest section of less urgent work that has just begun. Its last piece ends with the response time that is found
(docs/semantics.md, section 4.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

from dse.analysis.response_time import Task, densest_releases_ns, most_jobs, worst_job_ns
from dse.analysis.scheduling import Response
from dse.units import Exact

MOST_JOBS = 400
"""A busy period of more jobs is not played: nobody can look at it."""
SECTION = "less urgent"
"""What a piece of less urgent work is called, which cannot be interrupted."""


@dataclass(frozen=True)
class Piece:
    """Some job of a thread (from 1) has the core, from the beginning of the busy period on."""

    name: str
    job: int
    start_ns: Exact
    end_ns: Exact


@dataclass(frozen=True)
class BusyPeriod:
    """The pieces of a busy period of `core` up to the end of the job of `name` that responds last."""

    core: int
    name: str
    pieces: tuple[Piece, ...]
    released_ns: Exact
    end_ns: Exact
    deadline_ns: int | None


def worst_busy_period(core: int, responses: Sequence[Response]) -> BusyPeriod | None:
    """The busy period of the thread of a core that has the least time left to its deadline.

    Of threads without deadlines it is the one that responds last. None where an executor orders all that runs there,
    where no response time has a bound, and where there are more than `MOST_JOBS` jobs.
    """
    here = [item for item in responses if item.core == core and item.response_ns is not None and item.task.worst_ns]
    for item in sorted((item for item in here if not item.executor and not item.is_piece), key=_urgency):
        found = worst_job_ns(item.task, item.rivals, item.blocked_ns)
        if found is None:
            continue
        if sum(most_jobs(rival, found[1]) for rival in (*item.rivals, item.task)) > MOST_JOBS:
            return None
        pieces = played(item.task, item.rivals, item.blocked_ns, found)
        return BusyPeriod(core, item.name, pieces, found[0], found[1], item.deadline_ns)
    return None


def _urgency(item: Response) -> tuple[bool, Exact]:
    assert item.response_ns is not None
    if item.deadline_ns is None:
        return True, -item.response_ns
    return False, item.deadline_ns - item.response_ns


def played(task: Task, rivals: Sequence[Task], blocked_ns: Exact, worst_job: tuple[Exact, Exact]) -> tuple[Piece, ...]:
    """Who has the core until the end of the task's worst job, given as `worst_job_ns` gives it; no gaps.

    >>> from dse.analysis.response_time import periodic
    >>> a, b = periodic("a", 2, 5), periodic("b", 4, 20)
    >>> [(item.name, item.start_ns, item.end_ns) for item in played(b, [a], 1, worst_job_ns(b, [a], 1))]
    [('less urgent', 0, 1), ('a', 1, 3), ('b', 3, 5), ('a', 5, 7), ('b', 7, 9)]
    """
    released_ns, end_ns = worst_job
    waiting: list[tuple[Exact, int, int, Exact]] = []  # release, level, job, work
    for level, item in enumerate((*rivals, task)):
        for job, release in enumerate(densest_releases_ns(item), 1):
            if not item.worst_ns or release >= end_ns or (item is task and release > released_ns):
                break
            waiting.append((release, level, job, item.worst_ns))
    heapify(waiting)
    names = [item.name for item in (*rivals, task)]
    pieces = [Piece(SECTION, 1, 0, blocked_ns)] if blocked_ns else []
    ready: list[tuple[int, int, Exact]] = []
    now: Exact = blocked_ns
    while now < end_ns:
        while waiting and waiting[0][0] <= now:
            _, level, job, work = heappop(waiting)
            heappush(ready, (level, job, work))
        level, job, work = heappop(ready)
        until = min(now + work, waiting[0][0]) if waiting else now + work
        if pieces and (pieces[-1].name, pieces[-1].job) == (names[level], job):
            pieces[-1] = Piece(names[level], job, pieces[-1].start_ns, until)
        else:
            pieces.append(Piece(names[level], job, now, until))
        if until - now < work:
            heappush(ready, (level, job, work - (until - now)))
        now = until
    return tuple(pieces)
