"""What is simulated: a design with every figure read, as tasks, links and routes.

Reads the space on its own, without `dse.analysis`, so that a mistake there is not repeated here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Literal, TypeAlias

from dse.simulation.bus_turns import BusTurn, bus_turn_of
from dse.simulation.readings import ComponentFigures, Phase, PlanFigures, Range, read_figures
from dse.space.model.space import Design, Space
from dse.space.question.metrics import all_disparities
from dse.spec.kinds import ExecutorKind
from dse.support.units import Exact

NS_PER_S = 10**9
ENDLESS = 10**9
FIRST = -2
"""The urgency of an interrupt: before whatever cannot be preempted by threads."""
MANY = 20
"""How many jobs in a queue the default duration of a run allows for."""

TaskKey: TypeAlias = tuple[int, Literal["thread", "callback"]]
StepKey: TypeAlias = tuple[int, int]
"""A flow and the position of one of its steps."""


@dataclass(frozen=True)
class SimulatedTask:
    """Something that runs jobs: a thread or device, or the callback of a hybrid thread.

    `period_ns` is that of its timer (None: each arrival dispatches it); `core` a core that it shares, or None;
    `urgency` its place there, 0 first (below -1: an interrupt); for `section_ns` of a job nothing preempts it. A job
    of a `serial` task waits for the one before. `capacity` is how many arrivals may wait. A timer with a `phase` keeps
    it to the others of its clock; output leaves `logical_ns` after the release where that is set. A `queue` is that of
    an executor. Of a piece of a thread with segments `first` is the number of the thread's first one. In a `share` of a
    core its urgency is that among what else is in there. `reads_late`: a job reads when it first gets its core. Where
    a job needs a message of each trigger `rooms` has for each of these, by its number, how many wait at most; None: any
    number. In an executor that polls `keeps` jobs of it wait at most; None: all that come. A device that
    `takes_at_once` has a job for each message that comes, whatever its timer does.
    """

    key: TaskKey
    name: str
    cost_ns: Range
    period_ns: Fraction | None
    separation_ns: int | None
    core: tuple[int, int] | None
    urgency: int
    serial: bool
    capacity: int
    section_ns: int = 0
    phase: Phase | None = None
    logical_ns: int | None = None
    queue: Queue | None = None
    first: int | None = None
    share: ReservationShare | None = None
    reads_late: bool = False
    rooms: Mapping[int, int | None] = field(default_factory=dict)
    keeps: int | None = None
    takes_at_once: bool = False


@dataclass(frozen=True)
class ReservationShare:
    """A reservation by its number: a budget of a core's time in each period, and its urgency among what runs there."""

    number: int
    name: str
    core: tuple[int, int]
    budget_ns: int
    period_ns: int
    urgency: int


@dataclass(frozen=True)
class Queue:
    """The executor that runs a task's jobs, its kind, and the task's place in it: a smaller `level` goes first."""

    executor: int
    kind: ExecutorKind
    level: tuple[int, ...]


@dataclass(frozen=True)
class Gap:
    """Throttling of a core: threads run for `budget_ns` of each period."""

    name: str
    budget_ns: int
    period_ns: int


@dataclass(frozen=True)
class SimulatedConnection:
    """A connection: the delays of its virtual carriers together, and of the physical bus that it occupies.

    At least `gap_ns` lie between two messages; one without a sender has the `period_ns` of a timer. Where messages wait
    for the bus `turn` says how.
    """

    name: str
    source: int | None
    target: int | None
    soft_ns: Range
    bus: int | None
    bus_ns: Range
    gap_ns: int
    period_ns: Fraction | None
    is_trigger: bool
    capacity: int | None
    turn: BusTurn | None = None


@dataclass(frozen=True)
class Plan:
    """The tasks by key, the links in the order of the problem, and what data the flows follow.

    `places` lists for each component the flow steps at it that come over a connection, `starts` the flows that begin
    there; `exits` tells over which link data go on. `overloaded` names the tasks that alone need more than a core,
    `guessed` the threads on shared cores whose rate follows from no rate in the problem: something upstream is
    dispatched as often as seemed fit. `gaps` has the throttling of each core that is throttled. `meetings` has the flow
    steps at which a component reads what its disparity compares.
    """

    tasks: Mapping[TaskKey, SimulatedTask]
    links: Sequence[SimulatedConnection]
    places: Mapping[int, Sequence[StepKey]]
    starts: Mapping[int, Sequence[int]]
    link_starts: Mapping[int, Sequence[int]]
    exits: Mapping[StepKey, int]
    lengths: Sequence[int]
    outgoing: Mapping[int, Sequence[int]]
    overloaded: Sequence[str]
    guessed: Sequence[str]
    gaps: Mapping[tuple[int, int], Gap] = field(default_factory=dict)
    meetings: Mapping[int, Sequence[StepKey]] = field(default_factory=dict)

    @property
    def shares(self) -> list[ReservationShare]:
        """The reservations of which some task runs."""
        found = {task.share.number: task.share for task in self.tasks.values() if task.share is not None}
        return list(found.values())

    @property
    def timers(self) -> dict[str, Fraction]:
        """Everything with an offset of its own: the period in ns, by name."""
        tasks = {task.name: task.period_ns for task in self.tasks.values() if task.period_ns is not None}
        budgets: list[Gap | ReservationShare] = [*self.gaps.values(), *self.shares]
        gaps = {item.name: Fraction(item.period_ns) for item in budgets}
        return tasks | {link.name: link.period_ns for link in self.links if link.period_ns is not None} | gaps

    @property
    def phases(self) -> dict[str, Phase]:
        """The timers that keep their phase to others, with their clock and their offset on it."""
        return {task.name: task.phase for task in self.tasks.values() if task.phase is not None}

    def aligned(self, offsets_ns: Mapping[str, int], lead: str = "") -> dict[str, int]:
        """Offsets with those of a clock as far apart as they are: each clock is where its `lead`, or first, puts it."""
        found = dict(offsets_ns)
        clocks: dict[tuple[str, str], int] = {}
        phases = self.phases
        together = any(task.rooms for task in self.tasks.values())
        for name in sorted(phases, key=lambda name: name != lead):
            *clock, offset = phases[name]
            key = str(clock[0]), str(clock[1])
            start = clocks.setdefault(key, found.get(name, offset) - offset)
            if together:  # first releases are at their offsets from the beginning of the clock on, all within a period
                others = [(int(self.timers[other]), phase[2]) for other, phase in phases.items() if phase[:2] == key]
                room = min(period for period, _ in others) - max(offset for _, offset in others)
                found[name] = start % max(1, room) + offset
            else:
                found[name] = (start + offset) % max(1, int(self.timers[name]))
        return found

    @property
    def steady(self) -> set[str]:
        """The timers whose releases are counted: of what waits, one by one, for messages of others.

        Where their clocks drifted apart more and more would wait.
        """
        found: set[int] = set()
        todo = [wire for task in self.tasks.values() for wire, room in task.rooms.items() if room is None]
        names = set()
        while todo:
            link = self.links[todo.pop()]
            if link.source is None:
                names.add(link.name)
            elif link.source not in found:
                found.add(link.source)
                task = self.tasks[link.source, "thread"]
                names.add(task.name)
                todo += [
                    number
                    for number, other in enumerate(self.links)
                    if other.target == link.source and other.is_trigger
                ]
        return names

    def span_ns(self, flow: int, steps: Sequence[Any]) -> Exact:
        """A time in which data that are not lost pass the flow, if nothing is overloaded."""
        total: Exact = 0
        for step in steps:
            if step.kind == "connection":
                link = self.links[step.index]
                total += link.soft_ns[1] + link.bus_ns[1]
                continue
            for part in ("thread", "callback"):
                task = self.tasks.get((step.index, part))
                if task is not None:
                    total += (2 + min(task.capacity, MANY)) * task.cost_ns[1] + int(
                        task.period_ns or task.separation_ns or 0
                    )
                    total += task.logical_ns or 0
                    if task.rooms:
                        held = max(MANY if room is None else min(room, MANY) for room in task.rooms.values())
                        total += (1 + held) * int(max(self.timers.values(), default=0))
        return total


def build_plan(
    space: Space, design: Design, *, cores: Mapping[int, int] | None = None, endless_queues: bool = False
) -> Plan:
    """The plan of a valid design.

    Parameters
    ----------
    space, design
        a problem, and an option for each of its decisions.
    cores
        threads share the cores of their processors: the core, from 1, of each by its number (else the first). Without,
        each task has a core of its own.
    endless_queues
        every queue holds whatever arrives; otherwise as many as `queue_size` says, none where it says nothing.
    """
    contention = cores is not None
    figures = read_figures(space, design, cores or {})
    links = _links(space, figures, endless=endless_queues)
    tasks = _tasks(space, figures, contention=contention, endless=endless_queues)
    shared = sorted({task.core for task in tasks.values() if task.core is not None})
    tasks |= _interrupts(space, figures, shared)
    dropping = {task.name for task in tasks.values() if task.keeps is not None and task.core is not None}
    places: dict[int, list[StepKey]] = {}
    starts: dict[int, list[int]] = {}
    link_starts: dict[int, list[int]] = {}
    exits: dict[StepKey, int] = {}
    for flow, item in enumerate(space.flows):
        for position, step in enumerate(item.steps):
            if step.kind == "component" and step.via is not None:
                places.setdefault(step.index, []).append((flow, position))
            elif position == 0:
                (starts if step.kind == "component" else link_starts).setdefault(step.index, []).append(flow)
            if position + 1 < len(item.steps) and item.steps[position + 1].kind == "connection":
                exits[flow, position] = item.steps[position + 1].index
    outgoing: dict[int, list[int]] = {}
    for number, connection in enumerate(space.connections):
        if connection.source is not None:
            outgoing.setdefault(connection.source, []).append(number)
    return Plan(
        tasks=tasks,
        links=links,
        places=places,
        starts=starts,
        link_starts=link_starts,
        exits=exits,
        lengths=[len(item.steps) for item in space.flows],
        outgoing=outgoing,
        overloaded=[name for name, share in figures.shares.items() if share > 1 and name not in dropping],
        guessed=_guessed(space, figures, tasks, links),
        gaps={place: gap for place in shared if (gap := _gap(space, figures, place)) is not None},
        meetings=_meetings(space, places),
    )


def _meetings(space: Space, places: Mapping[int, Sequence[StepKey]]) -> dict[int, Sequence[StepKey]]:
    """The first step of each flow at a component whose inputs are compared."""
    found: dict[int, Sequence[StepKey]] = {}
    for metric in all_disparities(space, range(len(space.components))):
        parts = [part for operand in metric.operands for _, part in operand]
        flows, number = {part.index for part in parts}, int(parts[0].key)
        found[number] = [next(key for key in places[number] if key[0] == flow) for flow in sorted(flows, key=str)]
    return found


def _interrupts(space: Space, figures: PlanFigures, cores: Sequence[tuple[int, int]]) -> dict[TaskKey, SimulatedTask]:
    """The interrupts of each core, as tasks of nobody that go before all others."""
    found: dict[TaskKey, SimulatedTask] = {}
    for processor, core in cores:
        for item in figures.overheads[processor].interference:
            if item.is_throttling:
                continue
            name = f"{space.processors[processor].name} core {core + 1} {item.name}"
            key: TaskKey = (-1 - len(found), "thread")
            time, period = (item.worst_ns, item.worst_ns), Fraction(item.period_ns)
            found[key] = SimulatedTask(key, name, time, period, None, (processor, core), FIRST - len(found), True, 0)
    return found


def _gap(space: Space, figures: PlanFigures, place: tuple[int, int]) -> Gap | None:
    for item in figures.overheads[place[0]].interference:
        if item.is_throttling:
            name = f"{space.processors[place[0]].name} core {place[1] + 1} {item.name}"
            return Gap(name, item.period_ns - item.worst_ns, item.period_ns)
    return None


def _guessed(
    space: Space, figures: PlanFigures, tasks: Mapping[TaskKey, SimulatedTask], links: Sequence[SimulatedConnection]
) -> list[str]:
    """Follows the triggers downstream from whatever is dispatched at a rate that the problem does not state."""
    todo = [number for number, part in enumerate(figures.components) if part.period_ns is None and not part.rate_hz]
    todo += [
        link.target
        for link, part in zip(links, figures.connections, strict=True)
        if link.source is None and not part.stated_hz and link.is_trigger and link.target is not None
    ]
    found: set[int] = set()
    while todo:
        number = todo.pop()
        if number in found:
            continue
        found.add(number)
        todo += [
            link.target
            for link, part in zip(links, figures.connections, strict=True)
            if link.source == number and link.is_trigger and link.target is not None and not part.stated_hz
            if tasks[link.target, "thread"].period_ns is None or (link.target, "callback") in tasks
        ]
    return [task.name for key, task in tasks.items() if key[0] in found and task.core is not None]


def _tasks(space: Space, figures: PlanFigures, *, contention: bool, endless: bool) -> dict[TaskKey, SimulatedTask]:
    placed = figures.placed if contention else {}
    found: dict[TaskKey, SimulatedTask] = {}
    for number, component in enumerate(space.components):
        part = figures.components[number]
        core, urgency = placed.get(number, (None, 0))
        share = _share(space, figures, number) if core is not None else None
        urgency = urgency if share is None else figures.reserved[number].rank
        capacity = ENDLESS if endless else 0 if part.joins else part.queue_size or 0
        if part.callback_ns is not None:
            key: TaskKey = (number, "callback")
            at_core = core if part.callback_ns[1] else None
            wait = ENDLESS if endless or part.joins else 0
            name = f"{component.name} (callback)"
            cost, section = _on_core(part, part.callback_ns, at_core)
            queue = _queue(space, figures, key)
            is_serial = at_core is not None or not part.joins
            found[key] = SimulatedTask(
                key, name, cost, None, None, at_core, 2 * urgency + bool(queue), is_serial, wait, section, queue=queue,
                share=share if at_core is not None else None, keeps=_keeps(space, figures, key, endless=endless),
            )  # fmt: skip
        period = part.period_ns if part.period_ns is not None or part.rate_hz else figures.stimulus_ns(number)
        key = (number, "thread")
        at_core = core if part.executes and part.cost_ns[1] else None
        cost, section = _on_core(part, part.demand_ns if contention and at_core is not None else part.cost_ns, at_core)
        at_once = figures.takes_at_once(number)
        found[key] = SimulatedTask(
            key, component.name, cost, period, part.separation_ns, at_core, 2 * urgency + 1,
            part.executes and not at_once, capacity, section, part.phase, part.logical_ns, _queue(space, figures, key),
            None if component.pieces is None else component.pieces.members[0], share if at_core is not None else None,
            part.reads_late, _rooms(space, figures, number), _keeps(space, figures, key, endless=endless), at_once,
        )  # fmt: skip
    return found


def _rooms(space: Space, figures: PlanFigures, number: int) -> dict[int, int | None]:
    """The triggers of a component that needs a message of each, with how many of each wait."""
    part, found = figures.components[number], dict[int, int | None]()
    for wire in space.components[number].triggers if part.joins else ():
        size = figures.connections[wire].queue_size
        size = part.queue_size if size is None else size
        takes_all = part.takes_newest or part.period_ns is not None
        found[wire] = 1 if takes_all else None if size is None else max(1, size)
    return found


def _keeps(space: Space, figures: PlanFigures, key: TaskKey, *, endless: bool) -> int | None:
    """The most jobs of a task that wait in an executor that polls; None in other executors, and where all wait."""
    number, part = key
    figure, executor = figures.components[number], figures.executors[number]
    if executor is None or figures.kinds[executor] != "polling" or figure.joins or figure.separation_ns is not None:
        return None
    if part == "thread" and figure.period_ns is not None:
        return 1
    wires = space.components[number].triggers
    if endless or len(wires) != 1:
        return None
    size = figures.connections[wires[0]].queue_size
    size = figure.queue_size if size is None else size
    return None if size is None else max(1, size)


def _share(space: Space, figures: PlanFigures, number: int) -> ReservationShare | None:
    """The reservation of a thread that runs on a core."""
    found = figures.reserved.get(number)
    if found is None:
        return None
    core, rank = figures.placed[number]
    name = space.reservations[found.number].name
    return ReservationShare(found.number, name, core, found.budget_ns, found.period_ns, 2 * rank + 1)


def _queue(space: Space, figures: PlanFigures, key: TaskKey) -> Queue | None:
    """The place of a task in the executor that runs it."""
    number, part = key
    executor = figures.executors[number]
    if executor is None:
        return None
    kind = figures.kinds[executor]
    is_thread = int(part == "thread")
    if kind in ("wait_set", "polling"):  # timers first, then in the order of the file
        turns = (int(figures.components[number].period_ns is None), number, is_thread)
        return Queue(executor, kind, turns if kind == "wait_set" else (*figures.numbered[number], *turns))
    return Queue(executor, kind, (*figures.inner[number], is_thread))


def _on_core(part: ComponentFigures, time: Range, core: tuple[int, int] | None) -> tuple[Range, int]:
    """The time of a job with its context switches, and the section in it, where it shares a core."""
    if core is None:
        return time, 0
    return (time[0] + part.switching_ns, time[1] + part.switching_ns), int(min(part.section_ns, time[1]))


def _links(space: Space, figures: PlanFigures, *, endless: bool) -> list[SimulatedConnection]:
    found = []
    for number, connection in enumerate(space.connections):
        part = figures.connections[number]
        gap = NS_PER_S / part.stated_hz if part.stated_hz else None
        period = None
        if connection.source is None:
            period = gap if gap is not None else Fraction(figures.probe_ns)
        found.append(
            SimulatedConnection(
                name=connection.name,
                source=connection.source,
                target=connection.target,
                soft_ns=part.soft_ns,
                bus=part.bus,
                bus_ns=part.bus_ns,
                gap_ns=int(gap) if gap is not None and connection.source is not None else 0,
                period_ns=period,
                is_trigger=connection.target is not None and number in space.components[connection.target].triggers,
                capacity=ENDLESS if endless or connection.is_inner else part.queue_size,
                turn=bus_turn_of(space, figures, number),
            )
        )
    return found
