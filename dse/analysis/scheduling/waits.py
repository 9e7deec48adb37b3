"""What a job waits for where it runs, up to the end of the one that responds last.

The same busy periods as those of the response times (docs/semantics.md, sections 4.3 and 4.5 to 4.8), told by what is
in them: a job's own work, earlier jobs of its thread, jobs of others that go before it, a section of less urgent work
that has begun, less what of all that is over when the job is released. So much is its response time. Of a thread with
segments each piece has a wait of its own, and they add up to the response time of the thread; where that is bounded
by its core alone, all its work there has one (docs/semantics.md, section 4.7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from operator import itemgetter
from typing import Annotated

from dse.analysis.scheduling.busy_window import Task, TaskKey
from dse.analysis.scheduling.fixed_point import Loss, Window, Windows, paired_in
from dse.analysis.scheduling.model import Ends, Entry, Resource, System
from dse.analysis.scheduling.parts import Delay, Parts
from dse.analysis.scheduling.policies import chains
from dse.analysis.scheduling.policies.chains import Chain
from dse.analysis.scheduling.policies.preemptive import Preempted
from dse.analysis.scheduling.policies.successions import sources_in
from dse.analysis.scheduling.tasks import task_name
from dse.analysis.terms import FlowChain
from dse.space.model.space import Space
from dse.support.units import Exact


@dataclass(frozen=True)
class Wait:
    """The response time of a thread or piece on a core or accelerator: its own work, interference and blocking.

    Where `is_served` the core has no number to anybody.
    """

    WRITTEN = (
        *("name", "processor", "core", "work_ns", "earlier_jobs", "earlier_ns", "delays", "blocked_by"),
        *("blocked_ns", "over_ns", "response_ns"),
    )

    name: Annotated[
        str,
        "The thread or the piece; the thread where all its pieces on the core are taken together; or threads in a row "
        "that wait as one.",
    ]
    processor: Annotated[str, "The processor or accelerator."]
    core: Annotated[int, "The core, from 1."]
    is_served: bool
    work_ns: Annotated[Exact, "What it does itself."]
    delays: Annotated[tuple[Delay, ...], "The jobs of others that go before it."] = ()
    earlier_jobs: Annotated[int, "How many earlier jobs of its own thread go before it."] = 0
    earlier_ns: Annotated[Exact, "What these take."] = 0
    blocked_ns: Annotated[Exact, "What that takes."] = 0
    blocked_by: Annotated[
        str, "The thread whose section or job that nothing interrupts has begun before; empty where none has."
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


class Waits(Windows):
    """Tells what the threads of a design wait for, as its response times are known."""

    def __init__(self, space: Space, system: System, ends: Ends, *, loss: Loss | None = None) -> None:
        super().__init__(system, ends, loss=loss)
        self.space = space

    def of_thread(self, key: TaskKey) -> tuple[Wait, ...] | None:
        """The waits of a thread, with segments piece by piece up to the one of the key; None without a bound."""
        pieces = self.system.stages[key].pieces
        found: list[Wait] = []
        for index, piece in enumerate(pieces[: pieces.index(key) + 1] if pieces else (key,)):
            resource, position = self._place(piece)
            wait = self._alone(resource, position)
            if wait is None:
                return None
            found.append(wait)
            self.segments.spans[piece] = wait.response_ns
            whole = self._together(resource, position, pieces[: index + 1]) if index else None
            if whole is not None:
                served = [item for item in found if item.is_served]
                end = sum(item.response_ns for item in found)
                if whole.response_ns + sum(item.response_ns for item in served) < end:
                    found = [*served, whole]
        return tuple(found)

    def of_part(self, part: FlowChain) -> tuple[Wait, ...] | None:
        """The waits of a thread of a flow, or of threads in a row with one window; None without a bound.

        With its source, what is over counts to the latest release of the first thread, as in its lag; so it does where
        that thread takes messages in order.
        """
        first: TaskKey = (part.threads[0], "thread")
        has_lag = part.has_source and (len(part.threads) > 1 or self._is_alone(first))
        source = sources_in(self.system).get(first) if has_lag else None
        paired = paired_in(self.system).get(first) if part.is_paired else None
        if len(part.threads) == 1 and source is None and paired is None:
            return self.of_thread(first)
        resource, position = self._place(first)
        ways: list[tuple[Chain | None, Window | None]] = []
        if len(part.threads) == 1:
            ways.append((None, self.of(resource, position)))
        else:
            whole = self.chains[part.threads[-1], first[0]]
            ways += chains.windows_of(resource, whole, self.tasks(resource), self.succession(resource))
        jobs = paired if source is None else self.events.source_task(source)
        if jobs is None and (source is not None or paired is not None):
            return None
        given = [(chain, window) for chain, window in ways if isinstance(window, Preempted)]
        counted = [(chain, window if jobs is None else window.counted_from(jobs)) for chain, window in given]
        known = [(end, chain, window) for chain, window in counted if (end := window.response_ns()) is not None]
        if not known:
            return None
        _, chain, window = min(known, key=itemgetter(0))
        parts = window.parts()
        if parts is None:
            return None
        members, begun = ((position,), ()) if chain is None else (chain.members, chain.begun)
        lowest, sent = (position, Fraction(0)) if chain is None else (chain.lowest, Fraction(chain.sent_ns))
        own = [resource.entries[item].key for item in members]
        work = sum(self.system.stages[key].cost_ns for key in own)
        waited = window.task.worst_ns + parts.waited_ns - work - sent
        others = tuple((task, jobs) for task, jobs in parts.interference if task.stage not in own)
        in_blocked = 0 if window.kin is None else sent  # else each job of the chain is as long as it is on its way
        parts = replace(parts, interference=others, blocked_ns=parts.blocked_ns - in_blocked, earlier_ns=0)
        parts = replace(parts, earlier_ns=waited - parts.waited_ns)
        name = ", ".join(told_name(self.space, key) for key in own)
        made = self._made(resource, lowest, work, parts, name)
        longest = max((resource.entries[item].key for item in begun), key=self._cost_ns, default=None)
        if longest is not None and made.blocked_ns and self._cost_ns(longest) > resource.entries[lowest].blocking_ns:
            made = replace(made, blocked_by=told_name(self.space, longest))
        return (made,)

    def _cost_ns(self, key: TaskKey) -> int:
        """The longest time of a job of a stage with its context switches, in ns."""
        return self.system.stages[key].cost_ns

    def _is_alone(self, key: TaskKey) -> bool:
        """Whether a stage is an OS thread by itself."""
        resource, position = self._place(key)
        return resource.entries[position].executor is None

    def _alone(self, resource: Resource, position: int) -> Wait | None:
        """What a stage waits for from its own release on; None where it has no bound."""
        tasks = self._tasks_beside(resource, position)
        window = self.of(resource, position, tasks)
        found = None if window is None else window.parts()
        work_ns = self.system.stages[resource.entries[position].key].cost_ns
        return None if found is None else self._made(resource, position, work_ns, found)

    def _together(self, resource: Resource, position: int, pieces: Sequence[TaskKey]) -> Wait | None:
        """What all work of a thread on its core waits for there, as if it and the times away were one job."""
        window = self.segments.together(resource, position, self._tasks_beside(resource, position))
        found = None if window is None else window.parts()
        if window is None or found is None:
            return None
        work = window.task.worst_ns - self.segments.away_ns(pieces)
        return self._made(resource, position, work, found, self.space.components[pieces[0][0]].stated_as)

    def _tasks_beside(self, resource: Resource, position: int) -> list[Task | None]:
        """The stages of a resource, the one at a position as if its thread had a bound."""
        tasks, entry = list(self.tasks(resource)), resource.entries[position]
        if entry.is_piece:
            tasks[position] = self.events.bounded_task(entry.key)
        return tasks

    def _place(self, key: TaskKey) -> tuple[Resource, int]:
        place = self.system.place(key)
        assert place is not None
        return place

    def _made(self, resource: Resource, position: int, work_ns: Exact, found: Parts, name: str = "") -> Wait:
        """The wait that was found, with its names."""
        entry = resource.entries[position]
        return Wait(
            name or told_name(self.space, entry.key),
            self.space.processors[resource.processor].name,
            resource.core + 1,
            resource.is_accelerator,
            work_ns,
            found.delays(self._name_of),
            found.earlier_jobs,
            found.earlier_ns,
            found.blocked_ns,
            blocking_name(self.space, entry) if found.blocked_ns else "",
            found.over_ns,
        )

    def _name_of(self, task: Task) -> str:
        return task.name if task.stage is None else told_name(self.space, task.stage)


def told_name(space: Space, key: TaskKey) -> str:
    """The name of a task or message among others; each piece of a thread has its number, from 1."""
    if key[1] == "message":
        return space.connections[key[0]].name
    component = space.components[key[0]]
    if component.pieces is None:
        return task_name(component, key[1])
    return f"{component.pieces.thread} (piece {component.pieces.members.index(key[0]) + 1})"


def blocking_name(space: Space, entry: Entry) -> str:
    """The thread or message whose section may keep a stage waiting longest; the first of several, "" where none may."""
    longest = max((section for _, section in entry.blockers), default=0)
    return next((stated_name(space, key) for key, section in entry.blockers if section == longest), "")


def stated_name(space: Space, key: TaskKey) -> str:
    """The name in the file of the thread, device or connection of a stage."""
    number, part = key
    return space.connections[number].name if part == "message" else space.components[number].stated_as
