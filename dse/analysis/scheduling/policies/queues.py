"""The longest wait of a piece of a thread on an accelerator that serves jobs in the order of their arrival.

(docs/semantics.md, section 4.7)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import merge

from dse.analysis.scheduling.policies.executor_work import EndlessError, Work, jobs_by, until_end
from dse.analysis.scheduling.response_time import Task, densest_releases_ns, is_late, load
from dse.support.units import Exact


def queued_ns(task: Task, own: Sequence[Task], fellows: Sequence[Task]) -> Exact | None:
    """The longest time that a job waits and runs where jobs run as they come, when all `own` before it have ended.

    It comes a after the executor was idle last. What the `fellows` released until then has run for a, less what its
    `own` jobs took of that, and these are not before it: they have ended.

    Examples
    --------
    While a piece of 8 runs, three jobs of 2 every 4 come, before the next piece of 2; strangers would take 8 + 2 + 2.

    >>> from dse.analysis.scheduling.response_time import periodic
    >>> queued_ns(periodic("last", 2, 40), [periodic("first", 8, 40)], [periodic("other", 2, 4)])
    8
    """
    found = queued_job(task, own, fellows)
    return None if found is None else found.waited_ns + task.worst_ns


@dataclass(frozen=True, slots=True)
class QueuedJob:
    """The job that waits longest (`queued_ns`): behind all of others that came `until` then, which ran for `ran_ns`."""

    waited_ns: Exact = 0
    until_ns: Exact = 0
    ran_ns: Exact = 0


def queued_job(task: Task, own: Sequence[Task], fellows: Sequence[Task]) -> QueuedJob | None:
    """The job whose time `queued_ns` is."""
    inside = [item for item in (*own, *fellows) if item.worst_ns]
    used = load((task, *inside))
    if used > 1 or (used == 1 and any(map(is_late, (task, *inside)))):
        return None
    work = Work(task, inside, (), 0)
    longest = QueuedJob(-1)
    try:
        busy = work.busy_ns(repeats=False)
        for arrival in until_end(merge(*map(densest_releases_ns, (task, *inside))), busy):
            work.step()
            came = sum(jobs_by(item, arrival) * item.worst_ns for item in fellows)
            ended = sum(jobs_by(item, arrival) * item.worst_ns for item in (task, *own)) - task.worst_ns
            ran = max(0, arrival - ended)
            if came - ran > longest.waited_ns:
                longest = QueuedJob(came - ran, arrival, ran)
    except EndlessError:
        return None
    return longest
