"""What a response time is made of: what goes before the job that responds last, in its busy period.

The job's own time, earlier jobs of its thread, jobs of others, and a section of less urgent work that has begun, less
what of all that is over when the job is released, are the response time (docs/semantics.md, sections 4.3 to 4.6).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from dse.analysis.scheduling.busy_window import Task
from dse.support.json_fields import Data, Of
from dse.support.units import Exact


@dataclass(frozen=True)
class Delay:
    """Jobs of what goes before a late thread.

    Times in ns; `jobs` counts those in the busy period of the worst job.
    """

    name: Annotated[str, "The thread or interrupt."]
    jobs: Annotated[int, "How many jobs of it go before the worst one of the late thread."]
    work_ns: Annotated[Exact, "What they take together."]


class Interference(Data):
    """The interference of one more urgent thread or interrupt with the worst job of a thread."""

    WRITTEN = (
        Of("name", "The more urgent thread, or the interrupt.", key="thread", kind=str),
        Of("jobs", "How many of its jobs, from the beginning of the busy period on.", kind=int),
        Of("work_ns", "What these take together.", kind=Fraction),
    )


@dataclass(frozen=True)
class Parts:
    """The parts of the longest response time, besides the job's own execution time.

    `interference` are jobs of others, as tasks with the number of jobs; `earlier_jobs` of its own thread take
    `earlier_ns`; less urgent work that has begun takes `blocked_ns`, where it counts. Of all that `over_ns` are over
    when the job is released. Of a message `faults` of the wire cost `faults_ns`.
    """

    interference: tuple[tuple[Task, int], ...] = ()
    earlier_jobs: int = 0
    earlier_ns: Annotated[
        Exact, "What earlier jobs of its own take before its worst job; missing where there is none."
    ] = 0
    blocked_ns: Exact = 0
    over_ns: Annotated[
        Exact,
        "How much of all that goes before its worst job is over when this is released; missing where nothing is.",
    ] = 0
    faults: int = 0
    faults_ns: Exact = 0

    @property
    def waited_ns(self) -> Exact:
        """The delay of the job: its response time less its own execution time.

        In ns: earlier jobs, interference, blocking and faults, less what is over at the release.
        """
        others = sum(jobs * task.worst_ns for task, jobs in self.interference)
        return self.earlier_ns + others + self.blocked_ns + self.faults_ns - self.over_ns

    def delays(self, name_of: Callable[[Task], str] = lambda task: task.name) -> tuple[Delay, ...]:
        """The jobs of others, by the names that they are told by.

        In the order of the interference, with the work in ns.
        """
        return tuple(Delay(name_of(task), jobs, jobs * task.worst_ns) for task, jobs in self.interference)


def counted(jobs: Iterable[tuple[Task, int]]) -> tuple[tuple[Task, int], ...]:
    """The jobs of tasks that take time; tasks without an execution time, and counts of 0, are left out.

    Pairs of a task and a number of jobs, in their order.
    """
    return tuple((task, count) for task, count in jobs if task.worst_ns and count)


def before_job(
    task: Task,
    jobs: Iterable[tuple[Task, int]],
    blocked_ns: Exact,
    release_ns: Exact,
    end_ns: Exact,
    faults: Iterable[tuple[Task, int]] = (),
) -> Parts:
    """The parts before a job that is released and ends then, after the beginning of a busy period.

    What is neither its own time, nor blocking, nor of these jobs of others, nor of faults is of earlier jobs of its
    own.
    """
    others, hits = counted(jobs), counted(faults)
    lost: Exact = sum(count * item.worst_ns for item, count in hits)
    earlier = end_ns - blocked_ns - lost - sum(count * item.worst_ns for item, count in others) - task.worst_ns
    number = sum(count for _, count in hits)
    return Parts(others, int(earlier // task.worst_ns), earlier, blocked_ns, release_ns, number, lost)
