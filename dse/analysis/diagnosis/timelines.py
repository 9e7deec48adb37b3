"""The busy period in which a job of a thread responds last, played piece by piece.

Whatever goes before the thread is released at once and then as early as it can be (the critical instant of
J. P. Lehoczky, "Fixed priority scheduling of periodic task sets with arbitrary deadlines", RTSS 1990), behind the
longest section of less urgent work that has just begun. Its last piece ends with the response time that is found
(docs/semantics.md, section 4.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import heapify, heappop, heappush
from itertools import takewhile

from dse.analysis.messages.waits import MessageResponse
from dse.analysis.scheduling.busy_window import (
    BusyJob,
    Task,
    densest_releases_ns,
    in_window_of,
    most_jobs,
    worst_job_ns,
)
from dse.analysis.scheduling.policies.executors import Queued, WorstJob
from dse.analysis.scheduling.policies.preemptive import Preempted
from dse.analysis.scheduling.responses import Response
from dse.support.units import Exact

MOST_JOBS = 400
"""A busy period of more jobs is not played: nobody can look at it."""
SECTION = "less urgent"
"""What a piece of less urgent work is called, which cannot be interrupted."""


@dataclass(frozen=True)
class Piece:
    """A piece of a busy period: an interval in which one job of a thread runs; `job` counts from 1.

    Times in ns from the beginning of the busy period; a preempted job has several pieces.
    """

    name: str
    job: int
    start_ns: Exact
    end_ns: Exact


@dataclass(frozen=True)
class BusyPeriod:
    """The pieces of a busy period up to the end of the job of `name` that responds last.

    Of one that `is_segment` of a thread it begins with the release of the segment, and of the thread the deadline is.
    """

    name: str
    pieces: tuple[Piece, ...]
    released_ns: Exact
    end_ns: Exact
    deadline_ns: int | None
    is_segment: bool = False


def worst_busy_period(core: int, responses: Sequence[Response]) -> BusyPeriod | None:
    """The busy period of the thread of a core that has the least time left to its deadline.

    Of threads without deadlines it is the one that responds last. Where all others are segments of threads it is that
    of the segment which takes longest on the core. None where no response time has a bound but those of wait sets and
    accelerators' segments, which no run has to reach, and where there are more than `MOST_JOBS` jobs.
    """
    here = [item for item in responses if item.core == core and item.response_ns is not None and item.task.worst_ns]
    for item in sorted((item for item in here if not item.is_piece), key=urgency_of):
        window = item.window
        if isinstance(window, Queued):
            if window.kind not in ("wait_set", "polling"):
                return of_executor(item.name, item.deadline_ns, window)
        elif isinstance(window, Preempted):
            worst_job = worst_job_ns(window.task, window.rivals, window.blocked_ns)
            if worst_job is None:
                continue
            if any(rival.behind is not None for rival in window.rivals):
                return None  # jobs that its own jobs release: how many come is known, not when
            if worst_job.end_ns - worst_job.over_ns != item.response_ns:
                return None  # of what its chain did before it is known how long it took, not when
            rivals = in_window_of(window.rivals, worst_job.earlier, worst_job.released_ns)
            if sum(most_jobs(rival, worst_job.end_ns) for rival in (*rivals, window.task)) > MOST_JOBS:
                return None
            pieces = played(window.task, rivals, window.blocked_ns, worst_job)
            return BusyPeriod(item.name, pieces, worst_job.over_ns, worst_job.end_ns, item.deadline_ns)
    return _of_segments([item for item in here if item.is_piece])


def _of_segments(segments: Sequence[Response]) -> BusyPeriod | None:
    """The busy period of the segment that ends longest after its own release: one job, as earlier ones ended."""
    busy = []
    for item in segments:
        window = item.window
        if isinstance(window, Preempted):
            job = window.task.single()
            worst_job = worst_job_ns(job, window.rivals, window.blocked_ns)
            if worst_job is not None:
                rivals = in_window_of(window.rivals, worst_job.earlier, worst_job.released_ns)
                busy.append((worst_job, item, replace(window, task=job, rivals=rivals)))
    if not busy:
        return None
    worst_job, item, window = max(busy, key=lambda one: one[0].end_ns)
    if sum(most_jobs(rival, worst_job.end_ns) for rival in window.rivals) > MOST_JOBS:
        return None
    pieces = played(window.task, window.rivals, window.blocked_ns, worst_job)
    return BusyPeriod(item.name, pieces, 0, worst_job.end_ns, None, is_segment=True)


def of_executor(name: str, deadline_ns: int | None, window: Queued) -> BusyPeriod | None:
    """The busy period of a thread in an executor, or of a message in a line, where jobs run one by one to their end.

    As they come, or by priority. None where it has no bound, or more than `MOST_JOBS` jobs.
    """
    worst_job, parts = window.worst_job(), window.parts()
    if (
        worst_job is None
        or parts is None
        or sum(jobs for _, jobs in parts.interference) > MOST_JOBS
        or (worst_job.chain_ns is not None and worst_job.release_ns)
    ):
        return None  # of what its chain did before it is known how long it took, not when
    pieces = _played_in(window, worst_job)
    return BusyPeriod(name, pieces, worst_job.release_ns, worst_job.end_ns, deadline_ns)


def _played_in(item: Queued, worst_job: WorstJob) -> tuple[Piece, ...]:
    """The jobs on the core until the end of the worst job in an executor; no gaps.

    What preempts the executor goes first. Its own jobs run one after the other: as they come, that one last of those
    that come with it, or the most urgent that waits.
    """
    rivals = list(item.higher)
    counted = [one for one in item.fellows if worst_job.chain_ns is None or not one.is_kin]
    inner = [one.task for one in counted if one.goes_first or item.kind == "fifo"] + [item.task]
    outside = [
        (release, level, job, one)
        for level, one in enumerate(rivals)
        for job, release in enumerate(_until(one, worst_job.end_ns), 1)
        if release < worst_job.end_ns
    ]
    inside = [
        (release, level, job, one)
        for level, one in enumerate(inner)
        for job, release in enumerate(_until(one, worst_job.until_ns), 1)
        if (release <= worst_job.release_ns if one is item.task else job <= worst_job.jobs(one))
    ]
    begun = max(item.blocked_ns, worst_job.behind_ns)
    name = SECTION
    if worst_job.behind_ns > item.blocked_ns:
        name = next(one.task.name for one in counted if not one.goes_first and one.task.worst_ns == begun)
    running: tuple[Exact, str, int] | None = (begun, name, 1) if begun else None
    is_held = begun > worst_job.behind_ns  # a section: nothing preempts it
    pieces: list[Piece] = []
    left: dict[int, Exact] = {id(entry): entry[3].worst_ns for entry in outside}
    now: Exact = 0
    while now < worst_job.end_ns:
        urgent = [entry for entry in outside if entry[0] <= now and left[id(entry)]]
        later = [entry[0] for entry in outside if entry[0] > now]
        if urgent and not (is_held and running is not None):
            entry = min(urgent, key=lambda one: (one[1], one[2]))
            until = min([now + left[id(entry)], *later])
            left[id(entry)] -= until - now
            _note(pieces, Piece(entry[3].name, entry[2], now, until))
        else:
            if running is None:
                ready = [one for one in inside if one[0] <= now]
                order = (lambda one: (one[0], one[1])) if item.kind == "fifo" else (lambda one: (one[1], one[2]))
                chosen = min(ready, key=order)
                inside.remove(chosen)
                running, is_held = (chosen[3].worst_ns, chosen[3].name, chosen[2]), False
            work, name, job = running
            until = now + work if is_held else min([now + work, *later])
            running = (work - (until - now), name, job) if work > until - now else None
            _note(pieces, Piece(name, job, now, until))
        now = until
    return tuple(pieces)


def _until(task: Task, end: Exact) -> Iterator[Exact]:
    """The releases of a task up to a time, that time included."""
    return takewhile(lambda release: release <= end, densest_releases_ns(task))


def _note(pieces: list[Piece], piece: Piece) -> None:
    """Another piece, or more of the last one."""
    if pieces and (pieces[-1].name, pieces[-1].job) == (piece.name, piece.job):
        piece = replace(piece, start_ns=pieces.pop().start_ns)
    pieces.append(piece)


def urgency_of(item: Response | MessageResponse) -> tuple[bool, Exact]:
    """The order in which busy periods are shown: the least slack in ns first, then the longest without a deadline."""
    assert item.response_ns is not None
    if item.deadline_ns is None:
        return True, -item.response_ns
    return False, item.deadline_ns - item.response_ns


def played(task: Task, rivals: Sequence[Task], blocked_ns: Exact, worst_job: BusyJob) -> tuple[Piece, ...]:
    """The jobs on the core until the end of the task's worst job, given as `worst_job_ns` gives it; no gaps.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> a, b = periodic("a", 2, 5), periodic("b", 4, 20)
    >>> [(item.name, item.start_ns, item.end_ns) for item in played(b, [a], 1, worst_job_ns(b, [a], 1))]
    [('less urgent', 0, 1), ('a', 1, 3), ('b', 3, 5), ('a', 5, 7), ('b', 7, 9)]
    """
    released_ns, end_ns = worst_job.over_ns, worst_job.end_ns
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
