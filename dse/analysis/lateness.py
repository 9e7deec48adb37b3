"""Why a thread is late on its core, and how much shorter it or what goes before it would have to be.

What goes before the worst job is what the analysis of its response time counts (docs/semantics.md, section 4.3). A
time that would do is found by asking that analysis again with a shorter one, all release jitter as it is: shorter jobs
never make it larger, so that what is said suffices.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

from dse.analysis.budgets import Budget, budget_of, least
from dse.analysis.limits import HOLDS, Verdict
from dse.analysis.placement import core_of_each
from dse.analysis.releases import task_of
from dse.analysis.reservations import gaps_name
from dse.analysis.responding import counts_once
from dse.analysis.response_time import Task, response_time_ns
from dse.analysis.scheduling import Delay, Response, all_responses, response_of
from dse.analysis.segments import elapsed_ns
from dse.analysis.turns import Schedule
from dse.analysis.views import View
from dse.records import dataclass
from dse.space.trees import at
from dse.space.types import Space
from dse.units import Exact


@dataclass(frozen=True)
class Shorter:
    """Each job of a thread (or of an interrupt) takes so much less, and the late thread is in time."""

    name: str
    by_ns: int


@dataclass(frozen=True)
class Late:
    """A thread that ends too late: `late_ns` behind its limit on a core (from 1), None without a bound.

    `work_ns` is what its own jobs take up to then, `blocked_ns` what has begun before, `delays` what goes before it;
    of an `executor` the others that it runs do. Each of `shorter` is enough by itself. A thread that `has_segments`
    waits for what its pieces wait for, also on `accelerators`. `budget` is that of the reservation it is in. Of one
    without a bound `endless` are the threads that may go before it and come without a bound themselves.
    """

    thread: str
    processor: str
    core: int
    late_ns: Exact | None
    work_ns: int
    blocked_ns: int
    executor: str
    delays: tuple[Delay, ...]
    shorter: tuple[Shorter, ...]
    has_segments: bool = False
    budget: Budget | None = None
    accelerators: tuple[str, ...] = ()
    endless: tuple[str, ...] = ()


def late_threads(space: Space, verdicts: Sequence[Verdict], view: View) -> Iterator[Late]:
    """The threads that break an upper limit on their response time, in the order of the limits."""
    seen = set()
    for verdict in verdicts:
        metric = verdict.requirement.metric
        number, operator = metric.index or 0, verdict.requirement.operator
        if verdict.holds or metric.kind != "response time" or operator not in ("<=", "<") or number in seen:
            continue
        seen.add(number)
        found = response_of(space, number, "thread", view)
        if found is not None:
            yield _late(space, found, verdict, view)


def _late(space: Space, found: Response, verdict: Verdict, view: View) -> Late:
    processor = at(space.components[found.component].processor, view)
    late = None if found.response_ns is None else found.response_ns - verdict.limit
    core = core_of_each(space, processor, view)[found.component]
    shorter = (
        tuple(_shorter(space, found, verdict)) if late is not None and not found.executor and not found.is_piece else ()
    )
    name, work = space.processors[processor].name, found.task.worst_ns
    if found.is_piece:
        work = elapsed_ns(space, found.component, view)[1]
    budget = budget_of(space, found.component, view, lambda response: _holds(verdict, response))
    return Late(
        found.name, name, core, late, work, found.blocked_ns, found.executor, found.delays, shorter, found.is_piece,
        budget, tuple(_accelerators(space, found.component, view)) if found.is_piece else (),
        tuple(_endless(space, found, view)) if late is None else (),
    )  # fmt: skip


def _endless(space: Space, found: Response, view: View) -> dict[str, None]:
    """The threads that may go before a late one and of whose jobs nobody knows how closely they follow each other."""
    schedule, known = Schedule(space, view), all_responses(space, view)
    place = schedule.place((found.component, found.part))
    if place is None:
        return {}
    processor, core, turn = place
    turns = schedule.cores(processor)[core]
    before = {*turn.rivals(turns), *(turn.outside(turns) if turn.reservation is not None else ())}
    return dict.fromkeys(
        space.components[other.key[0]].stated_as
        for other in map(turns.__getitem__, sorted(before))
        if task_of(space, other.key, known, view) is None and not counts_once(space, turn, other, view)
    )


def _accelerators(space: Space, number: int, view: View) -> dict[str, None]:
    """The processors that serve pieces of a thread as they come, or by priority."""
    pieces = space.components[number].pieces
    served = (space.components[one] for one in (pieces.members if pieces is not None else ()))
    return dict.fromkeys(
        space.processors[at(item.processor, view)].name for item in served if at(item.executor, view) is not None
    )


def _holds(verdict: Verdict, response_ns: Exact | None) -> bool:
    return response_ns is not None and HOLDS[verdict.requirement.operator](Fraction(response_ns), verdict.limit)


def _shorter(space: Space, found: Response, verdict: Verdict) -> Iterator[Shorter]:
    """The least cut of a single task's jobs that is enough, of the late one first; where none is it is left out.

    So are reservations, whose budgets come later where they are cut.
    """
    reserved = {item.name for item in space.reservations} | {gaps_name(item.name) for item in space.reservations}
    for index, item in enumerate((found.task, *found.rivals)):
        if item.name in reserved:
            continue

        def is_enough(by_ns: int, index: int = index, item: Task = item) -> bool:
            tasks = [found.task, *found.rivals]
            tasks[index] = replace(item, worst_ns=item.worst_ns - by_ns)
            return _holds(verdict, response_time_ns(tasks[0], tasks[1:], found.blocked_ns))

        if item.worst_ns > 1 and is_enough(item.worst_ns - 1):
            yield Shorter(item.name, least(is_enough, item.worst_ns - 1))
