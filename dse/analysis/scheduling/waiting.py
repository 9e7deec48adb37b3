"""What a job waits for where it runs, up to the end of the one that responds last.

The same busy periods as those of the response times (docs/semantics.md, sections 4.3 and 4.5 to 4.8), told by what is
in them: a job's own work, earlier jobs of its thread, jobs of others that go before it, a section of less urgent work
that has begun, less what of all that is over when the job is released. So much is its response time. Of a thread with
segments each piece has a wait of its own, and they add up to the response time of the thread; where that is bounded
by its core alone, all its work there has one (docs/semantics.md, section 4.7).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from operator import attrgetter
from typing import Annotated

from dse.analysis.scheduling.overheads import interrupting
from dse.analysis.scheduling.parts import Delay, Parts, delays_of, executed, preempted
from dse.analysis.scheduling.releases import bounded_task, task_of, thread_releases
from dse.analysis.scheduling.responding import around, beside_piece
from dse.analysis.scheduling.response_time import Task
from dse.analysis.scheduling.servers.executor_work import jobs_by
from dse.analysis.scheduling.servers.executors import Fellow
from dse.analysis.scheduling.servers.queues import queued_job
from dse.analysis.scheduling.servers.reservations import before_task, blocking_ns
from dse.analysis.scheduling.servers.segments import Segments, single
from dse.analysis.scheduling.servers.succession import Succession, longest_of_each
from dse.analysis.scheduling.tasks import TaskKey, task_name
from dse.analysis.scheduling.turns import Schedule, Turn, blocking_name
from dse.space.model.space import ExecutorKind, Space
from dse.space.model.trees import at
from dse.support.units import Exact

Known = Mapping[TaskKey, "Exact | None"]


@dataclass(frozen=True)
class Wait:
    """What a thread does on a core, or a piece of it does there or on an accelerator, and what it waits for there.

    Where `is_served` the core has no number to anybody.
    """

    WRITTEN = (
        *("name", "processor", "core", "work_ns", "earlier_jobs", "earlier_ns", "delays", "blocked_by"),
        *("blocked_ns", "over_ns", "response_ns"),
    )

    name: Annotated[str, "The thread or the piece; the thread where all its pieces on the core are taken together."]
    processor: Annotated[str, "The processor or accelerator."]
    core: Annotated[int, "The core, from 1."]
    is_served: bool
    work_ns: Annotated[Exact, "What it does itself."]
    delays: Annotated[tuple[Delay, ...], "The jobs of others that go before it."] = ()
    earlier_jobs: Annotated[int, "How many earlier jobs of its own thread go before it."] = 0
    earlier_ns: Annotated[Exact, "What these take."] = 0
    blocked_ns: Annotated[Exact, "What that takes."] = 0
    blocked_by: Annotated[
        str, "The thread whose section that nothing interrupts has begun before; empty where none has."
    ] = ""
    over_ns: Annotated[Exact, "How much of all this is over when it is released."] = 0

    @property
    def waited_ns(self) -> Exact:
        """How much later than by itself it ends."""
        return self.earlier_ns + sum(item.work_ns for item in self.delays) + self.blocked_ns - self.over_ns

    @property
    def response_ns(self) -> Exact:
        """From its release to its end: all of this without what is over by then."""
        return self.work_ns + self.waited_ns


class SharedCore:
    """The core of a task, and all that shares it, as what is `known` of response times lets them be released."""

    def __init__(self, schedule: Schedule, key: TaskKey, known: Known) -> None:
        place = schedule.place(key)
        assert place is not None
        self.schedule, self.known, self.key = schedule, known, key
        self.processor, self.core, self.turn = place
        space, view = schedule.space, schedule.view
        self.turns: Sequence[Turn] = schedule.cores(self.processor)[self.core]
        self.tasks = [self._named(other.key, task_of(space, other.key, known, view)) for other in self.turns]
        self.tasks[self.turns.index(self.turn)] = self._named(key, bounded_task(space, key, known, view))
        self.interrupts = interrupting(space, [key[0]], view)

    def _named(self, key: TaskKey, task: Task | None) -> Task | None:
        name = told_name(self.schedule.space, key)
        return task if task is None or task.name == name else replace(task, name=name)

    @property
    def task(self) -> Task | None:
        """The task itself."""
        return self.tasks[self.turns.index(self.turn)]

    @property
    def succession(self) -> Succession:
        """The chains of its core."""
        return Succession(self.schedule.space, self.turns, self.known, self.schedule.view)

    @property
    def is_served(self) -> bool:
        """Whether it is an accelerator, which has one core without a number."""
        return at(self.schedule.space.processors[self.processor].serves, self.schedule.view) is not None

    @property
    def first(self) -> list[Task | None]:
        """What goes before it beside its rivals: interrupts and reservations."""
        space, view = self.schedule.space, self.schedule.view
        return before_task(space, self.turns, self.turn, self.tasks, self.interrupts, view)

    @property
    def rivals(self) -> list[Task | None]:
        """All that goes before it where it is in no executor."""
        return [*self.first, *(self.tasks[position] for position in self.turn.rivals(self.turns))]

    @property
    def siblings(self) -> list[Task]:
        """The other pieces of its thread here."""
        found = (self.tasks[position] for position in self.turn.siblings(self.turns))
        return [item for item in found if item is not None]

    def share(self) -> Fraction | None:
        """The share of the core that it and what goes before it need; None where what goes before it has no bound."""
        space, turn = self.schedule.space, self.turn
        if turn.executor is None:
            counted = self.rivals
        else:
            found = around(space, self.turns, self.tasks, self.first, turn, self.succession)
            if found is None:
                return None
            kind, fellows, higher, _ = found
            inside = (item.task for item in fellows.values() if item.goes_first or kind != "callback_group")
            counted = [*higher, *inside]
        given = [item for item in (self.task, *self.siblings, *counted) if item is not None]
        return sum((item.utilisation for item in given), Fraction(0)) if None not in counted else None

    def made(self, work_ns: Exact, found: Parts, name: str = "") -> Wait:
        """The wait that was found, with its names."""
        blocked_by = (
            blocking_name(self.schedule.space, self.turns, self.turn, self.schedule.view) if found.blocked_ns else ""
        )
        return Wait(
            name or told_name(self.schedule.space, self.key),
            self.schedule.space.processors[self.processor].name, self.core + 1, self.is_served,
            work_ns, found.delays, found.earlier_jobs, found.earlier_ns, found.blocked_ns, blocked_by, found.over_ns,
        )  # fmt: skip


def told_name(space: Space, key: TaskKey) -> str:
    """What a task is called beside others: the last piece of a thread too by its number, from 1."""
    component = space.components[key[0]]
    if component.pieces is None:
        return task_name(component, key[1])
    return f"{component.pieces.thread} (piece {component.pieces.members.index(key[0]) + 1})"


def wait_of(place: SharedCore, since_ns: Mapping[int, Exact] | None = None) -> Wait | None:
    """What a task waits for where it runs; None where it has no bound there.

    Each piece of its thread has ended so long `since_ns` before the release of a piece that is served by priority.
    """
    turn, task, space = place.turn, place.task, place.schedule.space
    if task is None:
        return None
    blocked = blocking_ns(turn)
    found: Parts | None
    if not task.worst_ns and not turn.pieces:
        found = Parts()
    elif turn.executor is None:
        job, rivals = beside_piece(turn, place.turns, place.tasks, place.rivals)
        given = [item for item in rivals if item is not None]
        found = None if job is None or len(given) < len(rivals) else preempted(job, given, blocked)
    else:
        beside = around(space, place.turns, place.tasks, place.first, turn, place.succession)
        if beside is None:
            return None
        kind, fellows, higher, is_in_line = beside
        if turn.pieces:
            found = _served(place, task, kind, fellows, higher, since_ns or {})
        else:
            found = executed(kind, task, list(fellows.values()), higher, blocked, is_in_line=is_in_line)
    return None if found is None else place.made(task.worst_ns, found)


def _served(
    place: SharedCore,
    task: Task,
    kind: ExecutorKind,
    beside: Mapping[int, Fellow],
    higher: Sequence[Task],
    since_ns: Mapping[int, Exact],
) -> Parts | None:
    """That of a piece on an accelerator (`dse.analysis.scheduling.responding.respond_in`)."""
    turn, turns, blocked = place.turn, place.turns, blocking_ns(place.turn)
    own, fellows = place.siblings, list(beside.values())
    if kind == "fifo" and not higher:
        longest = longest_of_each([(item.task, item.line) for item in fellows])
        if longest is not None:
            return Parts(delays_of((item, 1) for item in longest), blocked_ns=turn.blocked_ns)
        queued = queued_job(task, own, [item.task for item in fellows])
        if queued is None:
            return None
        came = delays_of((item.task, jobs_by(item.task, queued.until_ns)) for item in fellows)
        return Parts(came, blocked_ns=turn.blocked_ns, over_ns=queued.ran_ns)
    if kind != "callback_group" or higher or turn.shares_turn(turns):
        return executed(kind, task, [*fellows, *(Fellow(item, True) for item in own)], higher, blocked)
    job = single(task)
    found = executed("callback_group", job, fellows, [], blocked)
    urgent = [item for item in fellows if item.goes_first]
    ran = ((place.tasks[at], since_ns[one.key[0]]) for at, one in enumerate(turns) if one.key[0] in since_ns)
    for item, time in ran if urgent else ():
        if item is None or found is None:
            continue
        behind = executed("callback_group", job, urgent, [], item.worst_ns)
        if behind is None:
            return None
        other = replace(behind, earlier_jobs=1, earlier_ns=item.worst_ns, blocked_ns=0, over_ns=item.worst_ns + time)
        found = max(found, other, key=attrgetter("waited_ns"))
    return found


def waits_of(schedule: Schedule, key: TaskKey, known: Known) -> tuple[Wait, ...] | None:
    """What a thread waits for, with segments piece by piece up to the one of the key; None without a bound."""
    space, view = schedule.space, schedule.view
    pieces = space.components[key[0]].pieces
    if pieces is None:
        alone = wait_of(SharedCore(schedule, key, known))
        return None if alone is None else (alone,)
    members = pieces.members[: pieces.members.index(key[0]) + 1]
    cores = [schedule.cores(place[0])[place[1]] for place in map(schedule.place, _keys(members)) if place is not None]
    segments = Segments(space, cores, view)
    released = thread_releases(space, pieces.members[0], known, view)
    found: list[Wait] = []
    for position, number in enumerate(members):
        place = SharedCore(schedule, (number, "thread"), known)
        wait = wait_of(place, segments.since_ns(place.turn, known, *released))
        if wait is None:
            return None
        found.append(wait)
        segments.spans[number] = wait.response_ns
        if position and not place.is_served:
            whole = _together(place, segments, members[: position + 1], released)
            served = [item for item in found if item.is_served]
            end = sum(item.response_ns for item in found)
            if whole is not None and whole.response_ns + sum(item.response_ns for item in served) < end:
                found = [*served, whole]
    return tuple(found)


def _keys(members: Iterable[int]) -> list[TaskKey]:
    return [(number, "thread") for number in members]


def _together(
    place: SharedCore, segments: Segments, members: Sequence[int], released: tuple[object, ...]
) -> Wait | None:
    """What all work of a thread on its core waits for there, as if it and the times away were one job."""
    found = segments.together_ns(members)
    rivals = [item for item in place.rivals if item is not None]
    if found is None or len(rivals) < len(place.rivals):
        return None
    taken, blocked = found
    components = segments.space.components
    away = sum(segments.spans[one] or 0 for one in members if components[one].executor is not None)
    task = Task("", taken, ())
    if place.turn.shares_turn(place.turns):
        task = Task("", taken, released[0] or (), released[1])  # type: ignore[arg-type]
    before = preempted(task, rivals, blocked)
    return None if before is None else place.made(taken - away, before, components[members[0]].stated_as)
