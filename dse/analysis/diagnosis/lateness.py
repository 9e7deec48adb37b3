"""Why a thread is late, and how much shorter it or what goes before it would have to be.

What goes before the worst job is what the analysis of its response time counts (`dse.analysis.scheduling.waits`;
docs/semantics.md, section 4.3), of a thread with segments piece by piece. A time that would do is found by asking that
analysis again with a shorter one (`dse.analysis.diagnosis.shortening`). Of threads without a bound it is told which of
them have none because of others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Annotated

from dse.analysis.diagnosis.reservation_budgets import ReservationBudget, budget_of
from dse.analysis.diagnosis.shortening import Shorter, Trials
from dse.analysis.limits import HOLDS, Verdict
from dse.analysis.scheduling.busy_window import TaskKey
from dse.analysis.scheduling.fixed_point import Loss
from dse.analysis.scheduling.parts import Delay
from dse.analysis.scheduling.responses import Response, response_of, solution_of
from dse.analysis.scheduling.waits import Wait, Waits, stated_name
from dse.analysis.terms import PPM
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.json_fields import FIGURE
from dse.support.units import Exact


@dataclass(frozen=True)
class Full:
    """A core of which all or more is needed.

    Where `is_served` it has no number to anybody.
    """

    processor: Annotated[str, "The processor or accelerator."]
    core: Annotated[int, "The core, from 1."]
    is_served: bool
    share_ppm: Annotated[
        Exact, "The share that a thread and all with higher priority on its core need together, in ppm."
    ]


@dataclass(frozen=True)
class Late:
    """A thread that ends too late, and why.

    `blocked_ns` and `delays` are those of a thread without segments, `waits` also of one that `has_segments`.
    """

    WRITTEN = (
        *("thread", "processor", "core", "late_ns", "work_ns", "blocked_ns", "executor", "delays", "shorter", "budget"),
        *("accelerators", "endless", "limit_ns", "waits", "full", "ends_ns", "apart_ns"),
    )

    thread: Annotated[str, "The thread."]
    processor: Annotated[str, "The processor that it runs on."]
    core: Annotated[int, "The core, from 1."]
    late_ns: Annotated[Exact | None, "How long after its limit it ends; null where it has no bound."]
    work_ns: Annotated[int, FIGURE, "What its own jobs take up to then."]
    blocked_ns: Annotated[Exact, "What less urgent work takes that has begun before."]
    executor: Annotated[str, "The executor or accelerator in which it waits for others; empty where there is none."]
    delays: Annotated[
        tuple[Delay, ...],
        "The threads of higher priority that it waits for, highest first; empty without a bound, and of segments.",
    ]
    shorter: Annotated[tuple[Shorter, ...], "Each of these is enough by itself."]
    has_segments: bool = False
    budget: Annotated[ReservationBudget | None, "Of the reservation that it is in; null outside of any."] = None
    accelerators: Annotated[
        tuple[str, ...],
        "The accelerators that its segments wait for, in the order of these; empty where it has none.",
    ] = ()
    endless: Annotated[
        tuple[str, ...],
        "Of one without a bound, the threads that have none themselves and because of which it has none.",
    ] = ()
    limit_ns: Annotated[Fraction | None, "The limit that it misses; null where it has none of its own."] = None
    waits: Annotated[
        tuple[Wait, ...],
        "What it waits for, with segments piece by piece; the response times add up to its own. Without a bound and "
        "with segments what would make a job end after `ends_ns`, at the least; else empty without a bound.",
    ] = ()
    full: Annotated[
        Full | None,
        "Of one without a bound, where it and the threads of higher priority need all there is or more; else null.",
    ] = None
    apart_ns: Annotated[
        Exact | None,
        "Of one with segments and without a bound, how long after its release the next job may come, before which it "
        "has to end; else null.",
    ] = None

    @property
    def is_late_alone(self) -> bool:
        """Whether the thread's own work alone exceeds its limit.

        No order of threads can help then.
        """
        return self.limit_ns is not None and self.work_ns > self.limit_ns

    @property
    def ends_ns(self) -> Exact | None:
        """The latest end of a job after its release, where `waits` has it; else null.

        In ns: the sum of the segments' response times.
        """
        return sum(item.response_ns for item in self.waits) if self.waits else None


def late_threads(space: Space, verdicts: Sequence[Verdict], view: View) -> Iterator[Late]:
    """The threads that break an upper limit on their response time, in the order of the limits.

    One `Late` for each thread, with the lowest limit that it breaks, what it waits for, and which single shorter time
    would be enough.
    """
    yield from Teller(space, view).late_threads(verdicts)


class Teller:
    """The late threads of one design.

    Response times are solved once and shared by all questions about the design.
    """

    def __init__(self, space: Space, view: View) -> None:
        self.space, self.view = space, view
        self.solution, self.trials = solution_of(space, view), Trials(space, view)

    @cached_property
    def waits(self) -> Waits:
        """The waits of each thread of the design: own work, jobs of others, blocking.

        For each thread in ns: what adds up to its response time.
        """
        return Waits(self.space, self.solution.system, self.solution.ends)

    def _because(self, loss: Loss) -> tuple[str, ...]:
        """The threads without a bound because of which a thread has none; none where it has none by itself."""
        keys = self.solution.because(loss)
        return tuple(dict.fromkeys(stated_name(self.space, key) for key in keys))

    def late_threads(self, verdicts: Sequence[Verdict]) -> Iterator[Late]:
        """The threads that break an upper limit on their response time, in the order of the limits.

        One `Late` for each thread, however many limits it breaks.
        """
        broken: dict[int, Verdict] = {}
        for verdict in verdicts:
            if not verdict.holds and verdict.requirement.is_deadline:
                broken.setdefault(verdict.requirement.metric.index or 0, verdict)
        for number, verdict in broken.items():
            response = response_of(self.space, number, "thread", self.view)
            if response is not None:
                yield self._late(response, verdict.limit, partial(_holds, verdict))

    def unbounded(self, number: int) -> Late | None:
        """The reason why a thread without a limit has no response-time bound; None where it has a bound.

        A `Late` without a limit; the cause is an overloaded core, or a thread of higher priority without a bound.
        """
        response = response_of(self.space, number, "thread", self.view)
        if response is None or response.response_ns is not None:
            return None
        return self._late(response, None, _is_bounded)

    def _late(self, response: Response, limit: Fraction | None, is_in_time: Callable[[Exact | None], bool]) -> Late:
        space, view, key = self.space, self.view, (response.component, response.part)
        component = space.components[response.component]
        members = component.pieces.members if component.pieces is not None else (response.component,)
        keys: list[TaskKey] = [(number, "thread") for number in members]
        late = None if response.response_ns is None or limit is None else response.response_ns - limit
        loss = self.solution.loss_of(key)
        because = () if loss is None else self._because(loss)
        known = self.solution.system
        waits = self.waits if loss is None or because else Waits(space, known, loss.ends, loss=loss)
        is_told = late is not None or (loss is not None and not because and response.is_piece)
        causes = [] if late is not None or loss is None else self._keys_of(because)
        budget = budget_of(space, response.component, view, is_in_time)
        return Late(
            response.name if component.pieces is None else component.stated_as,
            space.processors[at(component.processor, view)].name,
            response.core,
            late,
            self.solution.system.stages[key].elapsed_ns[1] if response.is_piece else response.task.worst_ns,
            response.blocked_ns, response.executor, response.delays,
            tuple(self.trials.shorter(keys, causes, is_in_time)),
            response.is_piece,
            budget,
            tuple(self._accelerators(members)) if response.is_piece else (),
            () if late is not None or loss is None else because,
            limit,
            (waits.of_thread(key) if is_told else None) or (),
            self._full(keys, waits) if late is None and (loss is None or not because) else None,
            self._apart(keys[0]) if late is None and response.is_piece else None,
        )  # fmt: skip

    def _keys_of(self, names: Sequence[str]) -> list[TaskKey]:
        """The tasks of threads, by their names."""
        return [key for key in self.solution.tasks if stated_name(self.space, key) in names]

    def _full(self, keys: Sequence[TaskKey], waits: Waits) -> Full | None:
        """The core or accelerator that a thread and its interference overload most; None where none is overloaded."""
        overloads: list[Full] = []
        for key in keys:
            place = self.solution.system.place(key)
            assert place is not None
            resource, share = place[0], waits.share(*place)
            name = self.space.processors[resource.processor].name
            if share is not None and share >= 1:
                overloads.append(Full(name, resource.core + 1, resource.is_accelerator, share * PPM))
        return max(overloads, key=lambda item: item.share_ppm, default=None)

    def _apart(self, first: TaskKey) -> Exact | None:
        """How far apart the releases of a thread with segments are, whose first piece is given."""
        place = self.solution.system.place(first)
        assert place is not None
        return self.waits.segments.apart_ns(place[0].entries[place[1]])

    def _accelerators(self, members: Sequence[int]) -> dict[str, None]:
        """The processors that serve pieces of a thread as they come, or by priority."""
        served = (self.space.components[one] for one in members)
        return dict.fromkeys(
            self.space.processors[at(item.processor, self.view)].name
            for item in served
            if at(item.executor, self.view) is not None
        )


def _holds(verdict: Verdict, response_ns: Exact | None) -> bool:
    return response_ns is not None and HOLDS[verdict.requirement.operator](Fraction(response_ns), verdict.limit)


def _is_bounded(response_ns: Exact | None) -> bool:
    return response_ns is not None
