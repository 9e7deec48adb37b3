"""What runs on each core of a design, at which priority, and the response times that follow.

Threads are partitioned to the cores of their processor: as the user states, the others first-fit by decreasing
utilisation. On a core the more urgent go first (`dse.analysis.priorities`). Nothing says which of several threads with
the same priority goes first, so each counts as interference to each of the others: the response time holds whatever
the order, first come first served and round-robin included. A hybrid thread is two tasks of one priority, its callback
before its timer.

Event-triggered threads inherit the streams of what triggers them, with the jitter that processing and transmission add
on the way (K. Tindell and J. Clark, "Holistic schedulability analysis for distributed hard real-time systems",
Microprocessing and Microprogramming 40, 1994). Offsets between threads are never used to advantage
(docs/semantics.md, section 4.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Literal, TypeAlias

from dse.analysis.binding import transmission_ns
from dse.analysis.executors import Fellow, executor_response_ns
from dse.analysis.memo import Recall
from dse.analysis.overheads import interrupting, section_ns, switching_ns
from dse.analysis.partition import WHOLE, Room, Spread, spread
from dse.analysis.priorities import deadline_ns, inner_levels, levels_of
from dse.analysis.rates import NS_PER_S, RateKey, is_event_triggered, rate_hz
from dse.analysis.response_time import Stream, Task, most_jobs, response_time_ns, worst_job_ns
from dse.analysis.views import View
from dse.space.trees import at, leaves
from dse.space.types import Component, ExecutorKind, Space
from dse.timelimit import look_at_the_clock
from dse.units import Exact, Rounded, Unbounded

UNBOUNDED_NS = 10**14
"""Stands for a response time without a bound (27.8 h) wherever a number is needed."""
NO_BOUND = Unbounded(UNBOUNDED_NS)
ONLY = "only these groups"
"""Where a view remembers the groups of threads that count alone, in whatever space it is asked about."""
MOST_ROUNDS = 64
PLAIN = (int, Fraction, Rounded, type(None))
Part: TypeAlias = Literal["thread", "callback"]
TaskKey: TypeAlias = tuple[int, Part]


@dataclass(frozen=True)
class Delay:
    """So many jobs of a more urgent task, which take so long together, until the end of a task's worst job."""

    name: str
    jobs: int
    work_ns: Exact


@dataclass(frozen=True)
class Response:
    """The response time of a thread or a hybrid thread's callback; None where it has no bound.

    `rank` is 1 more than the number of the core's tasks that always go first, the same for threads of the same stated
    priority; `deadline_ns` is the thread's, else its period, else None; `blocked_ns` how long less urgent tasks may
    keep the core. `worst_ns` is the longest execution time, the task's own worst time has its context switches, too.
    `executor` is what runs it beside others, else empty; `rivals` are the tasks that go before it, the most urgent
    first, `delays` the jobs of these before its worst one: nothing where an executor orders it, or it has no bound.
    """

    component: int
    part: Part
    core: int
    rank: int
    task: Task
    best_ns: int
    response_ns: Exact | None
    deadline_ns: int | None
    blocked_ns: int
    worst_ns: int
    executor: str
    delays: tuple[Delay, ...] = ()
    rivals: tuple[Task, ...] = ()

    @property
    def name(self) -> str:
        """The thread, and which part of it."""
        return self.task.name

    @property
    def meets_deadline(self) -> bool | None:
        """Whether it ends by its deadline; None when there is none."""
        if self.deadline_ns is None:
            return None
        return self.response_ns is not None and self.response_ns <= self.deadline_ns


_RECALLED: Recall[tuple[Response, ...]] = Recall()


def processor_responses(space: Space, processor: int, view: View) -> tuple[Response, ...]:
    """Everything that runs on a processor, by core and priority."""
    return _RECALLED.recall(space, processor, view, _responses_on)


def response_of(space: Space, component: int, part: Part, view: View) -> Response | None:
    """The response of one task; None when it runs on no processor, or has nothing to execute there."""
    found = view.memo.get(("response", component, part))
    if found is None:
        found = _RECALLED.recall(space, (component, part), view, _response_to)
        view.memo["response", component, part] = found
    return found[0] if found else None


def all_responses(space: Space, view: View) -> dict[TaskKey, Exact | None]:
    """The response time of every task of a whole design, in ns; found together, and kept with the view.

    Where only some threads are to count, the view's memory names them (`ONLY`), each group on a core of its own.
    """
    found: dict[TaskKey, Exact | None] | None = view.memo.get("responses")
    if found is None and ONLY in view.memo:
        found = view.memo["responses"] = subset_responses(space, view.memo[ONLY], view)
    if found is None:
        schedule = _Schedule(space, view)
        cores = [core for processor in range(len(space.processors)) for core in schedule.cores(processor)]
        found = view.memo["responses"] = _fixed_point(space, cores, view)
    return found


def subset_responses(space: Space, groups: Sequence[Sequence[int]], view: View) -> dict[TaskKey, Exact | None]:
    """Response times where only these threads are there, each group on a core of its own: never above those of more."""
    return _fixed_point(space, [_turns(space, group, view) for group in groups], view)


def response_among(
    space: Space, group: Sequence[int], number: int, view: View, known: Mapping[TaskKey, Exact | None]
) -> Exact | None:
    """The response time of a thread where the threads of `group` share its core, and what releases them ends as known.

    What `known` does not have ends after its longest execution time: no release has less jitter.
    """
    turns = _turns(space, group, view)
    tasks = [_task(space, turn.key, known, view) for turn in turns]
    before = interrupting(space, [turn.key[0] for turn in turns[:1]], view)
    for turn, task in zip(turns, tasks, strict=True):
        if turn.key == (number, "thread"):
            rivals = [*before, *(tasks[position] for position in turn.rivals(turns))]
            return _respond(task, rivals, turn.blocked_ns)
    return 0


def is_released_alone(space: Space, number: int, view: View) -> bool:
    """Whether the releases of a thread do not depend on response times of threads."""
    keys = [key for own in _keys(space, number, view) for key in _upstream(space, own, view, frozenset())]
    return all(at(space.components[key[0]].processor, view) is None for key in keys)


def _responses_on(space: Space, processor: int, view: View) -> tuple[Response, ...]:
    schedule = _Schedule(space, view)
    keys = [turn.key for core in schedule.cores(processor) for turn in core]
    return _responses(schedule, keys)


def _response_to(space: Space, key: TaskKey, view: View) -> tuple[Response, ...]:
    if at(space.components[key[0]].processor, view) is None or key not in _keys(space, key[0], view):
        return ()
    return _responses(_Schedule(space, view), [key])


def bounded_response_ns(space: Space, component: int, part: Part, view: View) -> Exact:
    """The response time as a number: `UNBOUNDED_NS` beyond that, the longest processing off the processors."""
    alone = longest_alone_ns(space, component, part, view)
    if type(view) is View:
        known = all_responses(space, view)
        if (component, part) not in known:
            return alone
        response = known[component, part]
    else:
        found = response_of(space, component, part, view)
        if found is None:
            return alone
        response = found.response_ns
    return max(alone, counted_ns(response))


def counted_ns(response_ns: Exact | None) -> Exact:
    """A response time as a number: `NO_BOUND`, an `UNBOUNDED_NS`, where it has no bound, or one beyond that."""
    return NO_BOUND if response_ns is None or response_ns >= UNBOUNDED_NS else response_ns


def longest_alone_ns(space: Space, component: int, part: Part, view: View) -> int:
    """The longest time of one job that nothing delays: no response time is shorter."""
    return _alone_ns(space.components[component], part, view)[1]


def shortest_alone_ns(space: Space, component: int, part: Part, view: View) -> int:
    """The shortest time of one job."""
    return _alone_ns(space.components[component], part, view)[0]


def work_ns(space: Space, number: int, view: View) -> int:
    """The longest time of one job of a thread (not its callback); 0 where it executes nothing."""
    executes = at(space.components[number].execution_ns, view) is not None
    return longest_alone_ns(space, number, "thread", view) if executes else 0


def _alone_ns(component: Component, part: Part, view: View) -> tuple[int, int]:
    """Best and worst time of one job that nothing delays."""
    trees = (component.callback_ns,) if part == "callback" else (component.execution_ns, component.latency_ns)
    for tree in trees:
        given = at(tree, view)
        if given is not None:
            return given[0], given[1]
    stated = at(component.response_ns, view) if part == "thread" else None
    return (0, 0) if stated is None else (stated[0], stated[1])


def members(space: Space, processor: int, view: View) -> list[int]:
    """The threads on a processor, by number."""
    return [
        number
        for number, component in enumerate(space.components)
        if component.processor is not None and at(component.processor, view) == processor
    ]


def _keys(space: Space, number: int, view: View) -> Iterator[TaskKey]:
    """The tasks of a thread: its callback first."""
    component = space.components[number]
    if at(component.protocol, view) == "hybrid" and at(component.callback_ns, view) is not None:
        yield number, "callback"
    if at(component.execution_ns, view) is not None:
        yield number, "thread"


@dataclass(frozen=True, slots=True)
class _Turn:
    """A task in the order of its core: `rank` of the tasks before it always go first, up to `reach` of all may.

    Others may keep the core for `blocked_ns`. In an `executor` the tasks of a smaller `level` go first.
    """

    key: TaskKey
    rank: int
    reach: int
    blocked_ns: int = 0
    executor: int | None = None
    level: int = 0

    def rivals(self, order: Sequence[_Turn]) -> Iterator[int]:
        """The positions of what may delay the task on its core, which is not a callback's own timer.

        In an executor that may do so as well.
        """
        number, part = self.key
        for position, turn in enumerate(order[: self.reach]):
            is_own_timer = part == "callback" and turn.key[0] == number and self.executor is None
            if turn.key != self.key and not is_own_timer:
                yield position


class _Schedule:
    """The cores of a design's processors, each planned when it is asked for."""

    def __init__(self, space: Space, view: View) -> None:
        self.space, self.view = space, view
        self._planned: dict[int, list[list[_Turn]]] = {}

    def cores(self, processor: int) -> list[list[_Turn]]:
        """The tasks of each core, by priority."""
        if processor not in self._planned:
            self._planned[processor] = _cores(self.space, processor, self.view)
        return self._planned[processor]

    def place(self, key: TaskKey) -> tuple[int, int, _Turn] | None:
        """Processor, core and turn of a task; None where it runs on none."""
        processor = at(self.space.components[key[0]].processor, self.view)
        for core, turns in enumerate(self.cores(processor) if processor is not None else ()):
            for turn in turns:
                if turn.key == key:
                    return processor, core, turn
        return None

    def needed(self, wanted: Sequence[TaskKey]) -> list[list[_Turn]]:
        """What decides the response times of `wanted`: whatever may delay them, and what releases any of these."""
        depth: dict[tuple[int, int], int] = {}
        todo = list(wanted)
        while todo:
            place = self.place(todo.pop())
            if place is None:
                continue
            processor, core, turn = place
            known = depth.get((processor, core), 0)
            for other in self.cores(processor)[core][known : turn.reach]:
                todo += _upstream(self.space, other.key, self.view, frozenset())
            depth[processor, core] = max(known, turn.reach)
        return [self.cores(processor)[core][:count] for (processor, core), count in depth.items()]


def _upstream(space: Space, key: TaskKey, view: View, seen: frozenset[int]) -> list[TaskKey]:
    """The tasks whose response times are jitter of the task's releases."""
    number, part = key
    component = space.components[number]
    if number in seen or (part == "thread" and not is_event_triggered(component, view)):
        return []
    found: list[TaskKey] = []
    for connection in (space.connections[wire] for wire in component.triggers):
        if connection.sender is None:
            continue
        found.append((connection.sender, "thread"))
        if at(space.components[connection.sender].processor, view) is None:
            found += _upstream(space, found[-1], view, seen | {number})
    return found


def core_of_each(space: Space, processor: int, view: View) -> dict[int, int]:
    """The core, from 1, of each thread that runs on a processor, by the thread's number in `Space.components`.

    Threads whose core is stated or decided run there. The others are put on cores such that none is used beyond what
    the space's requirements allow, else beyond all of it: each, those that use most first, on the first core with room
    (first-fit by decreasing utilisation), by a complete search where that is in vain. Where there is no such partition,
    each is put on the first core with room, else on the one that is used least.
    """
    return dict(placement(space, processor, view).cores)


def placement(space: Space, processor: int, view: View) -> Spread:
    """The threads of a processor on its cores as `core_of_each` has them; its status is about what requirements allow.

    It tells whether a partition was found that keeps all of them, proved absent, or left undecided.
    """
    here = members(space, processor, view)
    used: dict[int, Fraction] = {}
    for number in here:
        unit = space.unit(number)
        used[unit] = used.get(unit, Fraction(0)) + utilisation(space, number, view)
    found = spread(space, processor, used, view, core_room(space, processor))
    if found.status != "found":
        found = replace(spread(space, processor, used, view, WHOLE), status=found.status)
    return replace(found, cores={number: found.cores[space.unit(number)] for number in here})


def core_room(space: Space, processor: int) -> Room:
    """What requirements allow to use of each core of a processor, at most all."""
    limits = [
        Room(item.limit.value, item.operator == "<")
        for item in space.requirements
        if (item.metric.kind, item.metric.index) == ("utilisation", processor) and item.operator in ("<=", "<")
    ]
    return min([*limits, WHOLE], key=lambda room: (room.share, not room.is_strict))


def _cores(space: Space, processor: int, view: View) -> list[list[_Turn]]:
    """The tasks of each core, by priority."""
    placed = core_of_each(space, processor, view)
    cores = range(1, max(1, at(space.processors[processor].cores, view)) + 1)
    return [_turns(space, [number for number, found in placed.items() if found == core], view) for core in cores]


def _turns(space: Space, numbers: Sequence[int], view: View) -> list[_Turn]:
    """The tasks of one core in their order (`dse.analysis.priorities`)."""
    units: dict[int, list[int]] = {}
    for number in numbers:
        units.setdefault(space.unit(number), []).append(number)
    turns: list[_Turn] = []
    for level in levels_of(space, numbers, view):
        parts = [(unit, [key for number in units[unit] for key in _keys(space, number, view)]) for unit in level]
        before, reach = len(turns), len(turns) + sum(len(keys) for _, keys in parts)
        for unit, keys in parts:
            executor = space.components[unit].executor
            if executor is not None:
                inner = _inner(space, units[unit], view)
                turns += (_Turn(key, before, reach, 0, executor, inner[key]) for key in keys)
                continue
            ends = [reach] * len(keys) if len(level) > 1 else range(before + 1, reach + 1)
            turns += (_Turn(key, before + own, end) for own, (key, end) in enumerate(zip(keys, ends, strict=True)))
    return _blocked(space, turns, view)


def _inner(space: Space, numbers: Sequence[int], view: View) -> dict[TaskKey, int]:
    """The level of each task of an executor among its own, the most urgent first."""
    found: dict[TaskKey, int] = {}
    for level in inner_levels(space, numbers, view):
        first = len(found)
        for key in (key for number in level for key in _keys(space, number, view)):
            found[key] = first if len(level) > 1 else len(found)
    return found


def _blocked(space: Space, turns: list[_Turn], view: View) -> list[_Turn]:
    """The same with the time for which what never goes before a task may keep the core all the same."""
    if all(space.components[turn.key[0]].section_ns is None for turn in turns):
        return turns
    sections = [
        section_ns(space, turn.key[0], _alone_ns(space.components[turn.key[0]], turn.key[1], view)[1], view)
        for turn in turns
    ]
    found = []
    for turn in turns:
        rivals = set(turn.rivals(turns))
        others = [
            section
            for position, section in enumerate(sections)
            if position not in rivals and turns[position].key != turn.key
        ]
        found.append(replace(turn, blocked_ns=max(others, default=0)))
    return found


def utilisation(space: Space, number: int, view: View) -> Fraction:
    """The share of one core that a thread uses, callback and timer together."""
    share = Fraction(0)
    for _, part in _keys(space, number, view):
        key: RateKey = ("input", number) if part == "callback" else ("activation", number)
        share += _alone_ns(space.components[number], part, view)[1] * rate_hz(space, key, view) / NS_PER_S
    return share


def _fixed_point(space: Space, cores: Sequence[Sequence[_Turn]], view: View) -> dict[TaskKey, Exact | None]:
    """Response times and inherited jitter, raised together until both stand still; what keeps growing has no bound."""
    known: dict[TaskKey, Exact | None] = {
        turn.key: _alone_ns(space.components[turn.key[0]], turn.key[1], view)[1] for turns in cores for turn in turns
    }
    interrupts = [interrupting(space, [turn.key[0] for turn in turns[:1]], view) for turns in cores]
    rounds, changed, horizon = 0, True, _horizon_ns(space)
    lone = {
        turn.key: _task(space, turn.key, known, view)
        for turns in cores
        for turn in turns
        if _is_lone(space, turn, view)
    }
    before_that: list[list[Task | None]] = [[] for _ in cores]
    while changed:
        rounds, changed = rounds + 1, False
        look_at_the_clock()
        for place, (turns, before) in enumerate(zip(cores, interrupts, strict=True)):
            tasks = [lone[turn.key] if turn.key in lone else _task(space, turn.key, known, view) for turn in turns]
            if rounds > 1 and all(map(_is_same, tasks, before_that[place])):
                continue  # as in the round before
            before_that[place] = tasks
            for turn, task in zip(turns, tasks, strict=True):
                key = turn.key
                positions = list(turn.rivals(turns))
                if turn.executor is None:
                    rivals = [*before, *(tasks[position] for position in positions)]
                    found = _respond(task, rivals, turn.blocked_ns)
                else:
                    found = _respond_in(space, turns, tasks, before, turn, view)
                if found is not None and rounds > 1 and (found > horizon or rounds > MOST_ROUNDS):
                    found = found if found == known[key] else None
                if known[key] is not None and found != known[key]:
                    known[key], changed = found, True
    return known


def _is_lone(space: Space, turn: _Turn, view: View) -> bool:
    """Whether a task's releases depend on no other task."""
    number, part = turn.key
    return part == "thread" and not is_event_triggered(space.components[number], view)


def _is_same(one: Task | None, other: Task | None) -> bool:
    """Whether two tasks have the same response time for sure."""
    if one is other:
        return True
    return one is not None and other is not None and _is_plain(one) and _is_plain(other) and one == other


def _horizon_ns(space: Space) -> int:
    """Ten times the longest period: response times that grow beyond it by their own jitter have no bound."""
    periods = [leaf for item in space.components for leaf in leaves(item.period_ns) if leaf is not None]
    return 10 * max(periods, default=NS_PER_S)


def _respond(task: Task | None, rivals: Sequence[Task | None], blocked_ns: Exact) -> Exact | None:
    """The response time of a task under those that may delay it."""
    given = [rival for rival in rivals if rival is not None]
    if task is None or len(given) < len(rivals):
        return None
    if type(blocked_ns) in PLAIN and all(map(_is_plain, (task, *given))):
        return _respond_alone(task, tuple(given), blocked_ns)
    return response_time_ns(task, given, blocked_ns)


def _respond_in(
    space: Space, turns: Sequence[_Turn], tasks: Sequence[Task | None], before: Sequence[Task], turn: _Turn, view: View
) -> Exact | None:
    """The response time of a task in an executor."""
    assert turn.executor is not None
    task, higher, fellows = None, list(before), []
    for position in (*turn.rivals(turns), turns.index(turn)):
        found, other = tasks[position], turns[position]
        if found is None:
            return None
        if other is turn:
            task = found
        elif other.executor == turn.executor:
            fellows.append(Fellow(found, other.level <= turn.level))
        else:
            higher.append(found)
    assert task is not None
    kind: ExecutorKind = at(space.executors[turn.executor].kind, view)
    if type(turn.blocked_ns) in PLAIN and all(map(_is_plain, (task, *higher, *(item.task for item in fellows)))):
        return _respond_in_alone(kind, task, tuple(fellows), tuple(higher), turn.blocked_ns)
    return executor_response_ns(kind, task, fellows, higher, turn.blocked_ns)


@lru_cache(16384)
def _respond_in_alone(
    kind: ExecutorKind, task: Task, fellows: tuple[Fellow, ...], higher: tuple[Task, ...], blocked_ns: Exact
) -> Exact | None:
    return executor_response_ns(kind, task, fellows, higher, blocked_ns)


def _is_plain(task: Task) -> bool:
    """Whether its times are mere numbers; what carries more (`dse.study.trace`) may be equal, and is not the same."""
    if type(task.worst_ns) not in PLAIN or type(task.separation_ns) not in PLAIN:
        return False
    return all(type(item.period_ns) in PLAIN and type(item.jitter_ns) in PLAIN for item in task.streams)


@lru_cache(16384)
def _respond_alone(task: Task, rivals: tuple[Task, ...], blocked_ns: Exact) -> Exact | None:
    """`response_time_ns`, remembered: from round to round, and from design to design, most tasks meet the same."""
    return response_time_ns(task, rivals, blocked_ns)


def _task(space: Space, key: TaskKey, known: Mapping[TaskKey, Exact | None], view: View) -> Task | None:
    """The task with the streams that release it; None when their jitter has no bound."""
    number, part = key
    component = space.components[number]
    streams = _releases(space, number, part, known, view)
    if streams is None:
        return None
    sporadic = part == "thread" and at(component.protocol, view) == "sporadic"
    separation = at(component.period_ns, view) if sporadic else None
    worst = _alone_ns(component, part, view)[1] + switching_ns(space, number, view)
    return Task(_task_name(component, part), worst, streams, separation)


Streams: TypeAlias = tuple[Stream, ...] | None


def _releases(space: Space, number: int, part: Part, known: Mapping[TaskKey, Exact | None], view: View) -> Streams:
    component = space.components[number]
    if part == "thread" and not is_event_triggered(component, view):
        return (Stream(at(component.period_ns, view)),)
    streams: list[Stream] = []
    for wire in component.triggers:
        found = _deliveries(space, wire, known, view)
        if found is None:
            return None
        streams += found
    return tuple(streams)


def _deliveries(space: Space, wire: int, known: Mapping[TaskKey, Exact | None], view: View) -> Streams:
    """What a connection delivers: what its sender releases, later by the jitter of processing and transmission."""
    connection = space.connections[wire]
    least, most, _ = transmission_ns(space, connection, view)
    if connection.sender is None:
        rate = rate_hz(space, ("delivery", wire), view)
        period = NS_PER_S // rate if rate else 0
        return (Stream(max(1, period), most - least),) if rate else ()
    leaving = _leaving(space, connection.sender, known, view)
    return None if leaving is None else tuple(Stream(item.period_ns, item.jitter_ns + most - least) for item in leaving)


def _leaving(space: Space, number: int, known: Mapping[TaskKey, Exact | None], view: View) -> Streams:
    component = space.components[number]
    released = _releases(space, number, "thread", known, view)
    best, worst = _alone_ns(component, "thread", view)
    response = known.get((number, "thread"), worst)
    if released is None or response is None:
        return None
    if at(component.protocol, view) == "sporadic":
        # holding back what comes early keeps the bound of the streams (Le Boudec and Thiran, "Network Calculus", 1.5:
        # shaping keeps arrival constraints); of this and the separation, the one with the lower rate goes on
        separation = at(component.period_ns, view)
        if sum((Fraction(1) / item.period_ns for item in released), Fraction(0)) * separation >= 1:
            released = (Stream(separation),)
    return tuple(Stream(item.period_ns, item.jitter_ns + max(response, worst) - best) for item in released)


def _responses(schedule: _Schedule, wanted: Sequence[TaskKey]) -> tuple[Response, ...]:
    space, view = schedule.space, schedule.view
    known = _fixed_point(space, schedule.needed(wanted), view)
    found = []
    for key in wanted:
        place = schedule.place(key)
        assert place is not None
        component = space.components[key[0]]
        task = _task(space, key, known, view)
        best, worst = _alone_ns(component, key[1], view)
        deadline = deadline_ns(component, view) if key[1] == "thread" else None
        lost = Task(_task_name(component, key[1]), worst, ())
        rank, blocked = place[2].rank + 1, place[2].blocked_ns
        name = "" if component.executor is None else space.executors[component.executor].name
        rivals = _rivals(schedule, place, task, known)
        response = known[key]
        found.append(
            Response(*key, place[1] + 1, rank, task or lost, best, response, deadline, blocked, worst, name, *rivals)
        )
    return tuple(found)


def _rivals(
    schedule: _Schedule, place: tuple[int, int, _Turn], task: Task | None, known: Mapping[TaskKey, Exact | None]
) -> tuple[tuple[Delay, ...], tuple[Task, ...]]:
    """The jobs before the worst one of a task, and what they are of; nothing where it has no bound, or an executor."""
    space, view = schedule.space, schedule.view
    processor, core, turn = place
    turns = schedule.cores(processor)[core]
    if task is None or known[turn.key] is None or turn.executor is not None or not task.worst_ns:
        return (), ()
    rivals = [_task(space, turns[position].key, known, view) for position in turn.rivals(turns)]
    given = [item for item in (*interrupting(space, [turn.key[0]], view), *rivals) if item is not None]
    found = worst_job_ns(task, given, turn.blocked_ns)
    if found is None:
        return (), ()
    jobs = [(item, most_jobs(item, found[1])) for item in given if item.worst_ns]
    return tuple(Delay(item.name, count, count * item.worst_ns) for item, count in jobs), tuple(given)


def _task_name(component: Component, part: Part) -> str:
    return component.name if part == "thread" else f"{component.name} (callback)"
