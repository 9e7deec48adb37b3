"""The response times of a design, and tables of what runs on each core at which priority.

Threads are partitioned to the cores of their processor (`dse.analysis.placement.first_fit`). On a core the more urgent
go first (`dse.analysis.scheduling.priorities`, `dse.analysis.scheduling.order`): the response time holds whatever the
order of those with the same priority, first come first served and round-robin included. Response times and the jitter
that they pass on are found together (`dse.analysis.scheduling.fixed_point`). Offsets between threads are never used to
advantage (docs/semantics.md, section 4.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Annotated, Any

from dse.analysis.memo import Recall
from dse.analysis.messages.stages import bus_of, counted_buses, message_key, message_stage
from dse.analysis.scheduling.busy_window import Part, Task, TaskKey
from dse.analysis.scheduling.fixed_point import Solution, Window, response_ns, solve
from dse.analysis.scheduling.model import EndKey, Ends, lag_of
from dse.analysis.scheduling.order import upstream
from dse.analysis.scheduling.parts import Delay, Interference, Parts
from dse.analysis.scheduling.priorities import deadline_ns
from dse.analysis.scheduling.resolve import among, resolve, resolve_buses
from dse.analysis.scheduling.subsets import Subsets
from dse.analysis.scheduling.tasks import elapsed_ns, longest_alone_ns, task_keys
from dse.analysis.scheduling.waits import blocking_name, stated_name
from dse.analysis.terms import PPM
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.json_fields import Json, Of
from dse.support.units import Exact, Unbounded, picked

UNBOUNDED_NS = 10**14
"""Stands for a response time without a bound (27.8 h) wherever a number is needed."""
NO_BOUND = Unbounded(UNBOUNDED_NS)


@dataclass(frozen=True)
class Response:
    """The response time of a thread on its core, or of a hybrid thread's callback.

    `rank` is 1 more than the number of the core's tasks that always go first, the same for threads of the same stated
    priority; `deadline_ns` is the thread's, else its period, else None. `worst_ns` is the longest execution time; the
    task's own worst time has its context switches, too. `executor` is what runs it beside others, and `reservation`
    what both are in, else empty. Of one that `is_piece` of a thread with segments the response time counts from the
    release of the thread. An accelerator has one core, which has no number to anybody: what it runs `is_served`.
    `window` is what decides the time from its own release to its end, `whole` that from the release of its thread on
    after `before_ns`; None where it has no bound.
    """

    JSON_NAME = "ResponseTime"
    WRITTEN = (
        *(Of("name", "The thread.", key="thread"), "core", "executor", "reservation", "rank", "execution_ns"),
        *(Of("task.streams", "What releases it.", key="releases"), "switching_ns", "blocked_ns", "blocked_by"),
        *("delays", Of("parts.earlier_ns", default=0), Of("before_ns", default=0), Of("parts.over_ns", default=0)),
        *("response_ns", "deadline_ns", "meets_deadline", Of("because", default=())),
        Of("needed_ppm", default=None),
    )

    component: int
    part: Part
    core: Annotated[int, "Its core, from 1."]
    rank: Annotated[int, "Its rank among the threads of the core, from 1, the most urgent."]
    task: Task
    best_ns: int
    response_ns: Annotated[
        Exact | None,
        "The longest time from release to completion; null where it has no bound. It is the longest execution, "
        "switching, blocking, interference, earlier jobs and what comes before a later piece, less what is over.",
    ]
    deadline_ns: Annotated[int | None, "The deadline that it is compared with; null where there is none."]
    worst_ns: int
    executor: Annotated[str, "The executor that runs it beside others, where one does.", Json(default="")]
    reservation: Annotated[str, "The reservation that it runs in, where it is in one.", Json(default="")] = ""
    is_piece: bool = False
    is_served: bool = False
    window: Window | None = None
    whole: Window | None = None
    before_ns: Annotated[
        Exact,
        "Of a later piece of a thread what comes before it from the release of the thread on: the end of the piece "
        "before, or the work and the times away until then; missing where there is none.",
    ] = 0
    because: Annotated[
        tuple[str, ...],
        "Of one without a bound the threads that have none themselves and because of which it has none; missing where "
        "there is none.",
    ] = ()
    needed_ppm: Annotated[
        Fraction | None,
        "Of one without a bound of which no other is the cause: the share of its core that it and all with higher "
        "priority need together, in ppm, where that is all or more; missing elsewhere.",
    ] = None
    blocking_ns: Exact = 0
    blocking_name: str = ""

    @property
    def name(self) -> str:
        """The thread, and which part of it."""
        return self.task.name

    @property
    def execution_ns(self) -> tuple[int, int]:
        """Its shortest and its longest execution time."""
        return self.best_ns, self.worst_ns

    @property
    def switching_ns(self) -> int:
        """The time of the context switches of a job, in ns."""
        return self.task.worst_ns - self.worst_ns

    @property
    def meets_deadline(self) -> bool | None:
        """Whether it is met; null where there is none."""
        if self.deadline_ns is None:
            return None
        return self.response_ns is not None and self.response_ns <= self.deadline_ns

    @cached_property
    def parts(self) -> Parts:
        """The parts of the response time besides the task's own time and `before_ns`; empty without a bound."""
        if self.response_ns is None or self.whole is None:
            return Parts()
        return self.whole.parts() or Parts()

    @property
    def delays(self) -> Annotated[tuple[Delay, ...], Json("interference", kind=tuple[Interference, ...])]:
        """The interference with the worst job of the thread, by task; empty where the response time has no bound."""
        return self.parts.delays()

    @property
    def blocked_ns(self) -> Annotated[Exact, Json("blocking_ns")]:
        """How long a less urgent thread of the core keeps it; 0 where that does not count."""
        return self.parts.blocked_ns

    @property
    def blocked_by(self) -> Annotated[str, Json(default="")]:
        """That thread; missing where there is none."""
        return self.blocking_name if self.blocked_ns else ""


def processor_responses(space: Space, processor: int, view: View) -> tuple[Response, ...]:
    """Everything that runs on a processor in a whole design, by core and priority."""
    resources = [item for item in solution_of(space, view).system.resources if item.processor == processor]
    return tuple(_responses(space, [entry.key for item in resources for entry in item.entries], view))


def response_of(space: Space, component: int, part: Part, view: View) -> Response | None:
    """The response of one task in a whole design; None when it runs on no processor, or executes nothing there."""
    key = (component, part)
    found: Response | None = view.memo.get(("response", key))
    if found is None and solution_of(space, view).system.place(key) is not None:
        found = view.memo["response", key] = next(_responses(space, [key], view))
    return found


def all_responses(space: Space, view: View) -> Ends:
    """The response time of every task of a whole design, in ns; found together, and kept with the view.

    Where only some threads are to count, the view names them, each group on a core of its own (`View.groups`).
    """
    found: Ends | None = view.memo.get("responses")
    if found is None:
        groups = view.groups
        found = solution_of(space, view).ends if groups is None else subset_responses(space, groups, view)
        view.memo["responses"] = found
    return found


def solution_of(space: Space, view: View) -> Solution:
    """The system of a whole design with its response times, kept with the view."""
    found: Solution | None = view.memo.get("solution")
    if found is None:
        found = view.memo["solution"] = solve(resolve(space, view))
    return found


def messages_of(space: Space, view: View) -> Solution:
    """The system of a whole design with the response times of its messages, kept with the view.

    Where latencies count no response times of threads it has the buses alone.
    """
    if space.processing == "response_time":
        return solution_of(space, view)
    found: Solution | None = view.memo.get("messages")
    if found is None:
        found = view.memo["messages"] = solve(resolve_buses(space, view))
    return found


def message_waits_ns(space: Space, number: int, view: View, *, has_source: bool = False) -> Exact:
    """For how long the message of a connection waits for its bus at most, in ns; `NO_BOUND` where that has no bound.

    Counted from when it is queued, or (`has_source`) from the latest time at which it may be queued after a release
    of the source of its sender's chain (docs/semantics.md, section 5.4). Where only some threads are to count
    (`View.groups`) no message waits: that is never above what it waits for.
    """
    if view.groups is not None or bus_of(space, number, view) is None:
        return 0
    key = message_key(space, number, view)
    response: Any
    if (ends := view.memo.get("message ends")) is not None:  # variables of whoever follows them over a range of inputs
        response, alone = ends[key], message_stage(space, key[0], view).worst_ns
        response = ends.get(lag_of(key), response) if has_source else response
    elif type(view) is View:
        solution = messages_of(space, view)
        response, alone = solution.ends[key], solution.system.stages[key].worst_ns
        response = solution.ends.get(lag_of(key), response) if has_source else response
    else:
        alone = message_stage(space, key[0], view).worst_ns
        ends = _message_ends(space, bus_of(space, key[0], view), view)
        response = ends[key]
        response = ends.get(lag_of(key), response) if has_source else response
    return NO_BOUND if response is None or response >= UNBOUNDED_NS else response - alone


_MESSAGES: Recall[Ends] = Recall(256)


def _message_ends(space: Space, bus: int | None, view: View) -> Ends:
    """Response times of all messages on a bus, with their lags: found together, and kept with the view."""
    key = None if space.processing == "response_time" else bus
    found: Ends | None = view.memo.get(("waits", key))
    if found is None:
        found = view.memo["waits", key] = _MESSAGES.recall(space, key, view, _ends_on)
    return found


def _ends_on(space: Space, bus: int | None, view: View) -> Ends:
    """Response times of the messages on a bus; with those of threads of all buses (None), for all may have a part."""
    return solve(resolve(space, view) if bus is None else resolve_buses(space, view, bus)).ends


def subset_responses(space: Space, groups: Sequence[Sequence[int]], view: View) -> Ends:
    """Response times where only these threads are there, each group on a core of its own: never above those of more."""
    are_slow = any(space.components[number].executor is not None for group in groups for number in group)
    if are_slow and type(view) is View:
        return _SUBSETS.recall(space, groups, view, _among)
    return _among(space, groups, view)


_SUBSETS = Subsets()


def _among(space: Space, groups: Sequence[Sequence[int]], view: View) -> dict[EndKey, Exact | None]:
    return dict(solve(among(space, groups, view)).ends)


def with_threads(space: Space, groups: Sequence[Sequence[int]], design: Sequence[int]) -> View:
    """A view of a design in which only these threads wait for each other, each group on a core of its own.

    All messages wait for their buses: response times are never above those of more threads.
    """
    view = View(design)
    view.memo["solution"] = solve(among(space, groups, view, has_buses=True))
    return view


def response_among(space: Space, group: Sequence[int], number: int, view: View, known: Ends) -> Exact | None:
    """The response time of a thread where the threads of `group` share its core, and what releases them ends as known.

    What `known` does not have ends after its longest execution time: no release has less jitter.
    """
    key: TaskKey = (number, "thread")
    system = among(space, [group], view)
    return 0 if system.place(key) is None else response_ns(system, key, known)


def is_released_alone(space: Space, number: int, view: View) -> bool:
    """Whether the releases of a thread do not depend on response times of threads, nor on waits for buses."""
    if counted_buses(space):
        return False
    keys = [key for own in task_keys(space, number, view) for key in upstream(space, own, view, frozenset())]
    return all(at(space.components[key[0]].processor, view) is None for key in keys)


_ENDS: Recall[tuple[Exact | None, ...]] = Recall()


def _end_of(space: Space, key: TaskKey, view: View) -> tuple[Exact | None, ...]:
    """The response time of a task in ns, None without a bound; nothing when it runs on no processor."""
    if at(space.components[key[0]].processor, view) is None or key not in task_keys(space, key[0], view):
        return ()
    return (solve(resolve(space, view, [key])).ends[key],)


def bounded_response_ns(space: Space, component: int, part: Part, view: View) -> Exact:
    """The response time as a number: `UNBOUNDED_NS` beyond that, the longest processing off the processors."""
    alone = longest_alone_ns(space, component, part, view)
    if type(view) is View:
        known = all_responses(space, view)
        if (component, part) not in known:
            return alone
        response = known[component, part]
    else:
        key = ("end", component, part)
        if key not in view.memo:
            view.memo[key] = _ENDS.recall(space, (component, part), view, _end_of)
        if not view.memo[key]:
            return alone
        (response,) = view.memo[key]
    longest: Exact = picked("max", alone, counted_ns(response))
    return longest


def waited_ns(space: Space, component: int, view: View, response_ns: Exact) -> Exact:
    """How much later than if nothing delayed it a thread ends that responds after so long; of a piece all so far."""
    alone = elapsed_ns(space, component, view)[1]
    waited: Exact = picked("max", response_ns, alone) - alone
    return waited


def counted_ns(response_ns: Exact | None) -> Exact:
    """A response time as a number: `NO_BOUND`, an `UNBOUNDED_NS`, where it has no bound, or one beyond that."""
    return NO_BOUND if response_ns is None or response_ns >= UNBOUNDED_NS else response_ns


def _responses(space: Space, wanted: Sequence[TaskKey], view: View) -> Iterator[Response]:
    """The responses of tasks of a whole design, each with its names."""
    solution = solution_of(space, view)
    windows = solution.windows
    for key in wanted:
        place = solution.system.place(key)
        assert place is not None
        resource, entry = place[0], place[0].entries[place[1]]
        component, stage = space.components[key[0]], solution.system.stages[key]
        is_whole = key[1] == "thread" and space.is_last_piece(key[0])
        executor, reservation = at(component.executor, view), component.reservation
        task, window = windows.tasks(resource)[place[1]], windows.of(*place)
        before_ns, whole = windows.since_thread(*place, window)
        loss = solution.loss_of(key)
        because = () if loss is None else solution.because(loss)
        needed = None if loss is None or because else solution.overload(loss)
        yield Response(
            *key,
            resource.core + 1,
            entry.rank + 1,
            task or Task(stage.name, stage.cost_ns, ()),
            stage.elapsed_ns[0] if stage.pieces else stage.best_ns,
            solution.ends[key],
            deadline_ns(component, view) if is_whole else None,
            stage.worst_ns,
            "" if executor is None else space.executors[executor].name,
            "" if reservation is None else space.reservations[reservation].name,
            bool(stage.pieces),
            at(space.processors[resource.processor].serves, view) is not None,
            window,
            whole,
            before_ns,
            tuple(dict.fromkeys(stated_name(space, item) for item in because)),
            None if needed is None else needed * PPM,
            entry.blocking_ns,
            blocking_name(space, entry) if entry.blocking_ns else "",
        )
