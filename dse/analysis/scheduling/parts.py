"""What a response time is made of: what goes before the job that responds last, in its busy period.

The job's own time, earlier jobs of its thread, jobs of others, and a section of less urgent work that has begun, less
what of all that is over when the job is released, are the response time (docs/semantics.md, sections 4.3 to 4.6).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from dse.analysis.scheduling.response_time import Task, most_jobs, worst_job_ns
from dse.analysis.scheduling.servers.executors import Fellow, executor_worst_job, jobs_before
from dse.space.model.space import ExecutorKind
from dse.support.json_fields import Data, Of
from dse.support.units import Exact


@dataclass(frozen=True)
class Delay:
    """Jobs of what goes before a late thread."""

    name: Annotated[str, "The thread or interrupt."]
    jobs: Annotated[int, "How many jobs of it go before the worst one of the late thread."]
    work_ns: Annotated[Exact, "What they take together."]


class Interference(Data):
    """What goes before the worst job of a thread."""

    WRITTEN = (
        Of("name", "The more urgent thread, or the interrupt.", key="thread", kind=str),
        Of("jobs", "How many of its jobs, from the beginning of the busy period on.", kind=int),
        Of("work_ns", "What these take together.", kind=Fraction),
    )


@dataclass(frozen=True)
class Parts:
    """What goes before the job that responds last, beside its own time.

    `delays` are jobs of others; `earlier_jobs` of its own thread take `earlier_ns`; less urgent work that has begun
    takes `blocked_ns`, where it counts. Of all that `over_ns` are over when the job is released.
    """

    delays: tuple[Delay, ...] = ()
    earlier_jobs: int = 0
    earlier_ns: Annotated[
        Exact, "What earlier jobs of its own take before its worst job; missing where there is none."
    ] = 0
    blocked_ns: Exact = 0
    over_ns: Annotated[
        Exact,
        "How much of all that goes before its worst job is over when this is released; missing where nothing is.",
    ] = 0

    @property
    def waited_ns(self) -> Exact:
        """How much later than by itself the job ends."""
        return self.earlier_ns + sum(item.work_ns for item in self.delays) + self.blocked_ns - self.over_ns


def delays_of(jobs: Iterable[tuple[Task, int]]) -> tuple[Delay, ...]:
    """What so many jobs of tasks delay, without what takes no time."""
    return tuple(Delay(item.name, count, count * item.worst_ns) for item, count in jobs if item.worst_ns and count)


def preempted(task: Task, given: Sequence[Task], blocked_ns: Exact) -> Parts | None:
    """The parts for a task of a core under fixed priorities; None without a bound.

    Examples
    --------
    Of 26 every 70 and 62 every 100 the fifth job of the second responds last: released at 400, it ends at 518.

    >>> from dse.analysis.scheduling.response_time import periodic
    >>> found = preempted(periodic("b", 62, 100), [periodic("a", 26, 70)], 0)
    >>> found.delays, found.earlier_jobs, found.over_ns, 62 + found.waited_ns
    ((Delay(name='a', jobs=8, work_ns=208),), 4, 400, 118)
    """
    if not task.worst_ns:
        return Parts()
    found = worst_job_ns(task, given, blocked_ns)
    if found is None:
        return None
    return _before(task, delays_of((item, most_jobs(item, found[1])) for item in given), blocked_ns, *found)


def executed(
    kind: ExecutorKind,
    task: Task,
    fellows: Sequence[Fellow],
    higher: Sequence[Task],
    blocked_ns: Exact,
    *,
    is_in_line: bool = False,
) -> Parts | None:
    """The parts for a task in an executor, whose fellows and what preempts it go before it; None without a bound.

    One of the fellows may have begun, or less urgent work outside: the longer of the two counts.
    """
    if not task.worst_ns:
        return Parts()
    found = executor_worst_job(kind, task, fellows, higher, blocked_ns, is_in_line=is_in_line)
    if found is None:
        return None
    jobs = jobs_before(kind, found, fellows, higher, blocked_ns)
    blocked_ns = blocked_ns if blocked_ns >= found.behind_ns else 0
    delays = delays_of(jobs)
    if found.chain_ns is None:
        return _before(task, delays, blocked_ns, found.release_ns, found.end_ns)
    blocked_ns = found.end_ns - task.worst_ns - found.chain_ns - sum(item.work_ns for item in delays)
    return Parts(delays, blocked_ns=blocked_ns, over_ns=found.release_ns - found.chain_ns)


def _before(task: Task, delays: tuple[Delay, ...], blocked_ns: Exact, release_ns: Exact, end_ns: Exact) -> Parts:
    """The parts before a job that is released and ends then, after the beginning of a busy period."""
    earlier = end_ns - blocked_ns - sum(item.work_ns for item in delays) - task.worst_ns
    return Parts(delays, int(earlier // task.worst_ns), earlier, blocked_ns, release_ns)
