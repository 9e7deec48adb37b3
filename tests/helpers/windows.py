"""Response times of tasks that an executor runs, as tests write them."""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.scheduling.busy_window import Task
from dse.analysis.scheduling.policies.executors import Fellow, Queued
from dse.spec.kinds import ExecutorKind
from dse.support.units import Exact


def queued_response_ns(
    kind: ExecutorKind,
    task: Task,
    fellows: Sequence[Fellow],
    higher: Sequence[Task],
    blocked_ns: Exact = 0,
    *,
    is_in_line: bool = False,
) -> Exact | None:
    """The longest time from the release of a job of an executor to its end, in ns; None where it has no bound."""
    return Queued(kind, task, tuple(fellows), tuple(higher), blocked_ns, is_in_line).response_ns()
