"""The figures of one design, read from the space: times, rates, bindings, cores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, TypeAlias

from dse.space.architecture.clocks import AT_RELEASE
from dse.space.architecture.frames import Frame, ethernet_frames_ns, wire_ns
from dse.space.model.space import Component, Connection, Design, Interference, Space, at_home
from dse.space.model.trees import FROM_BANDWIDTH, PerProcessorType, at
from dse.spec.kinds import Arbitration, ExecutorKind
from dse.support.units import Exact

Range: TypeAlias = tuple[Exact, Exact]
"""Least and most, in ns; exact where messages and their bytes take less than 1 ns."""
Phase: TypeAlias = tuple[str, str, int]
"""A clock by its name (or the one member that it has), and the offset on it in ns."""
NS_PER_S = 10**9
PROBE_NS = 100_000_000
"""Period at which a flow is fed whose beginning nothing dispatches, in a problem without periods."""


@dataclass(frozen=True)
class ComponentFigures:
    """A component in a design.

    `cost_ns` is the time of a job that runs alone (a stated response time stands for contention), `demand_ns` its
    execution time; `executes` tells whether it is an execution time at all, or the latency of a data sheet, which
    occupies nothing. On a core each job takes `switching_ns` more, and for `section_ns` of it nothing preempts it.
    `phase` is set where its timer keeps it, `logical_ns` where data pass so long after its releases and not when a job
    ends; `reads_late` tells whether a job reads when it first gets its core, and not at its release. One that `joins`
    needs a message of each trigger for a job, the newest of each where it `takes_newest`.
    """

    period_ns: Fraction | None
    separation_ns: int | None
    cost_ns: Range
    demand_ns: Range
    callback_ns: Range | None
    executes: bool
    queue_size: int | None
    rate_hz: Fraction
    input_hz: Fraction
    switching_ns: int = 0
    section_ns: int = 0
    phase: Phase | None = None
    logical_ns: int | None = None
    reads_late: bool = False
    joins: bool = False
    takes_newest: bool = False


@dataclass(frozen=True)
class FaultFigures:
    """Faults of a CAN wire: up to `burst` at once, others `interval_ns` apart, each with an error frame."""

    interval_ns: int
    burst: int
    error_ns: Range


@dataclass(frozen=True)
class ConnectionFigures:
    """A connection in a design: what virtual carriers take, and the physical bus under them.

    On Ethernet the `identifier` is the lower, the higher its priority is.

    `frames` are the times of its frames where messages wait for that bus, in the order of `arbitration`. One that
    `is_shared` is one message with the others of its port that are as long; so are those of a `frame`.
    """

    soft_ns: Range
    bus: int | None
    bus_ns: Range
    stated_hz: Fraction | None
    queue_size: int | None
    arbitration: Arbitration | None = None
    frames: tuple[Range, ...] = ()
    is_shared: bool = False
    identifier: int | None = None
    frame: tuple[int, ...] = ()
    faults: FaultFigures | None = None


@dataclass(frozen=True)
class Overheads:
    """The overheads of a processor: the time of two context switches for each job, and the interrupts.

    In ns.
    """

    switching_ns: int
    interference: Sequence[Interference]


@dataclass(frozen=True)
class Reserved:
    """The place of a thread in its reservation, and what that gets.

    Times in ns; `rank` orders the threads inside of the reservation.
    """

    number: int
    rank: int
    budget_ns: int
    period_ns: int


@dataclass(frozen=True)
class PlanFigures:
    """Everything, by index.

    `placed` gives each thread on a processor its core and its place there; `shares` the use of one core by each
    component; `reserved` those that are in a reservation; `queues` names what queues the messages of each component as
    they come.
    """

    space: Space
    components: Sequence[ComponentFigures]
    connections: Sequence[ConnectionFigures]
    placed: Mapping[int, tuple[tuple[int, int], int]]
    shares: Mapping[str, Fraction]
    probe_ns: int
    overheads: Sequence[Overheads]
    inner: Mapping[int, tuple[int, ...]]
    numbered: Mapping[int, tuple[int, int]]
    kinds: Sequence[ExecutorKind]
    executors: Sequence[int | None]
    reserved: Mapping[int, Reserved]
    queues: Sequence[str]

    def transmit_queue(self, source: int | None) -> str:
        """The name of what queues the messages of a component as they come; empty where nothing does."""
        return "" if source is None else self.queues[source]

    def takes_at_once(self, number: int) -> bool:
        """Whether a device takes data when they come, as no timer and no message dispatches it."""
        item, is_timed = self.space.components[number], self.components[number].period_ns is not None
        return not (is_timed or item.triggers or item.section == "threads") and self.space.profile == "dse"

    def stimulus_ns(self, number: int) -> Fraction | None:
        """The period of what nothing dispatches: its fastest outgoing stated rate, or the longest period there is.

        None where something may dispatch it after all.
        """
        if self.space.components[number].triggers:
            return None
        leaving = [
            self.connections[index].stated_hz
            for index, item in enumerate(self.space.connections)
            if item.source == number
        ]
        rates = [rate for rate in leaving if rate]
        return NS_PER_S / max(rates) if rates else Fraction(self.probe_ns)


def read_figures(space: Space, design: Design, cores: Mapping[int, int]) -> PlanFigures:
    """The figures of a valid design; `cores` has the core, from 1, of each thread by number (else the first).

    Read directly from the space, without the formulas of the analysis, so that the simulation is a witness of its own.
    """
    reader = _DesignReader(space, design)
    components = [reader.component(number) for number in range(len(space.components))]
    connections = [reader.connection(number, item) for number, item in enumerate(space.connections)]
    periods = [int(item.period_ns) for item in components if item.period_ns is not None]
    shares = {
        item.name: _share(figures)
        for item, figures in zip(space.components, components, strict=True)
        if figures.executes
    }
    return PlanFigures(
        space,
        components,
        connections,
        _placed(space, design, components, cores),
        shares,
        max(periods, default=PROBE_NS),
        [Overheads(2 * reader.at(slot.switch_ns), reader.at(slot.interference)) for slot in space.processors],
        _inner(space, design, components),
        _numbered(space, design),
        [at(item.kind, design) for item in space.executors],
        [at(item.executor, design) for item in space.components],
        _reserved(space, design, components),
        [reader.queue(number) for number in range(len(space.components))],
    )


def _share(figures: ComponentFigures) -> Fraction:
    """The use of one core, of the thread or of its callback, whichever is more: each is a task of its own."""
    callback = figures.callback_ns[1] * figures.input_hz if figures.callback_ns is not None else Fraction(0)
    return max(figures.cost_ns[1] * figures.rate_hz, callback) / NS_PER_S


class _DesignReader:
    """Reads a design; keeps the rates that it has found."""

    def __init__(self, space: Space, design: Design) -> None:
        self.space, self.design = space, design
        self._rates: dict[int, Fraction] = {}
        self.on_clocks = any(step.since for flow in space.flows for step in flow.steps)

    def at(self, tree: Any) -> Any:
        return at(tree, self.design)

    def queue(self, number: int) -> str:
        """The computer or component that sends messages of a component as they come; empty: by identifier."""
        item = self.space.components[number]
        own = self.at(item.transmit_queue)
        if own is not None:
            return item.stated_as if own == "fifo" else ""
        place = self.at(at_home(self.space.components, number).processor)
        computer = None if place is None else self.space.processors[place]
        return computer.name if computer is not None and self.at(computer.transmit_queue) == "fifo" else ""

    def component(self, number: int) -> ComponentFigures:
        item = self.space.components[number]
        protocol, period = self.at(item.protocol), self.at(item.period_ns)
        timed = protocol in ("periodic", "hybrid") or (protocol is None and period is not None)
        execution, stated, latency = (self.at(tree) for tree in (item.execution_ns, item.response_ns, item.latency_ns))
        demand = execution or latency or stated or (0, 0)
        least = (execution or latency or (0, 0))[0]
        cost = (min(least, stated[1]), stated[1]) if stated is not None else demand
        callback = self.at(item.callback_ns) if protocol == "hybrid" else None
        slot = self.at(item.processor)
        return ComponentFigures(
            period_ns=Fraction(period) if timed else None,
            separation_ns=period if protocol == "sporadic" else None,
            cost_ns=(cost[0], cost[1]),
            demand_ns=(demand[0], demand[1]),
            callback_ns=None if callback is None else (callback[0], callback[1]),
            executes=execution is not None,
            queue_size=self.at(item.queue_size),
            rate_hz=self.rate(number),
            input_hz=self.input_rate(item),
            switching_ns=0 if slot is None else 2 * self.at(self.space.processors[slot].switch_ns),
            section_ns=self.at(item.section_ns) or 0,
            phase=self.phase(item) if timed else None,
            logical_ns=self.logical_ns(item, period) if timed else None,
            reads_late=self.polls(item) or (timed and self.on_clocks and self.at(item.communication) not in AT_RELEASE),
            joins=self.at(item.join) == "all",
            takes_newest=self.at(item.pairing) == "latest",
        )

    def polls(self, item: Component) -> bool:
        """Whether an executor that polls runs it, whose jobs read when they begin."""
        number = self.at(item.executor)
        return number is not None and self.at(self.space.executors[number].kind) == "polling"

    def phase(self, item: Component) -> Phase | None:
        """The clock and the offset of a timer, where both are known and the profile counts them."""
        offset, clock = self.at(item.offset_ns), self.at(item.clock)
        if offset is None or clock is None or self.space.profile != "dse":
            return None
        return clock.name, "" if clock.name else clock.member, offset

    def logical_ns(self, item: Component, period: int) -> int | None:
        """The deadline, at which data pass under logical execution time."""
        if self.at(item.communication) != "let" or self.space.profile != "dse":
            return None
        deadline: int | None = self.at(item.deadline_ns)
        return period if deadline is None else deadline

    def rate(self, number: int) -> Fraction:
        """How often the component runs, in the long run and at most."""
        if number not in self._rates:
            item = self.space.components[number]
            protocol, period = self.at(item.protocol), self.at(item.period_ns)
            own = Fraction(NS_PER_S, period) if period is not None else None
            if protocol == "hybrid" and own is not None and self.at(item.join) == "all":
                self._rates[number] = min(own, self.set_rate(item))
            elif protocol in ("aperiodic", "sporadic") or own is None:
                arriving = self.set_rate(item) if self.at(item.join) == "all" else self.input_rate(item)
                self._rates[number] = min(arriving, own) if protocol == "sporadic" and own is not None else arriving
            else:
                self._rates[number] = own
        return self._rates[number]

    def input_rate(self, item: Component) -> Fraction:
        return sum((self.delivery_rate(self.space.connections[wire]) for wire in item.triggers), Fraction(0))

    def set_rate(self, item: Component) -> Fraction:
        """How often a message of each trigger has come: as often as the slowest sends."""
        return min((self.delivery_rate(self.space.connections[wire]) for wire in item.triggers), default=Fraction(0))

    def delivery_rate(self, item: Connection) -> Fraction:
        stated = self.stated_rate(item)
        if stated is not None:
            return stated
        return Fraction(0) if item.source is None else self.rate(item.source)

    def stated_rate(self, item: Connection) -> Fraction | None:
        rate, data_rate, size = (self.at(tree) for tree in (item.rate_hz, item.data_rate, item.size_bytes))
        if rate is not None:
            return Fraction(rate)
        if data_rate is None:
            return None
        return Fraction(data_rate) / size if size else Fraction(0)  # of messages without a size nothing is known

    def frame_of(self, number: int) -> list[int]:
        """The connections whose data are in one message with those of a connection, whose message it is first."""
        leaders = [self.at(item.carried_in) for item in self.space.connections]
        leader = number if leaders[number] is None else leaders[number]
        return [leader, *(other for other, found in enumerate(leaders) if found == leader != other)]

    def connection(self, number: int, item: Connection) -> ConnectionFigures:
        first = None if self.is_local(item) else self.at(item.bus)
        frame = self.frame_of(number)
        data = sum(self.at(self.space.connections[one].size_bytes) or 0 for one in frame)
        sizes: dict[tuple[int, ...], int] = {}
        for bus in () if first is None else (first, *item.further):
            self.wrap(bus, [], data, sizes)
        buses = list(dict.fromkeys(way[-1] for way in sizes))
        times: dict[int, Range | None] = dict.fromkeys(buses)
        for way, size in sizes.items():
            taken, before = self.carrying_ns(way[-1], item, size), times[way[-1]]
            if taken is not None:
                times[way[-1]] = taken if before is None else (before[0] + taken[0], before[1] + taken[1])
        given = [time for time in times.values() if time is not None]
        hard = next((bus for bus in buses if not self.space.buses[bus].virtual), None)
        own = self.at(item.latency_ns)
        if not given and own is not None and not self.is_local(item):
            soft: Range = own[0], own[1]
            on_bus: Range = 0, 0
        else:
            on_bus = (times.get(hard) if hard is not None else None) or (0, 0)
            soft = (sum(time[0] for time in given) - on_bus[0], sum(time[1] for time in given) - on_bus[1])
        found = ConnectionFigures(soft, hard, on_bus, self.stated_rate(item), self.at(item.queue_size))
        arbitration = None if hard is None else self.at(self.space.buses[hard].arbitration)
        if hard is None or arbitration is None or self.space.profile != "dse" or self.space.bus_queuing != "counted":
            return found
        size = next(size for way, size in sizes.items() if way[-1] == hard)
        frames = self.frames(hard, size, on_bus) if arbitration in ("priority", "classes") else (on_bus,)
        is_shared = bool(self.at(self.space.buses[hard].broadcast)) and first == hard and found.stated_hz is None
        return replace(
            found,
            arbitration=arbitration,
            frames=frames,
            is_shared=is_shared,
            identifier=self.at(item.identifier) if arbitration != "classes" else -self.at(item.priority),
            frame=tuple(frame) if len(frame) > 1 else (),
            faults=self.faults(hard),
        )

    def faults(self, number: int) -> FaultFigures | None:
        """The faults of the wire of a bus; an error frame has 14 to 28 bits and the gap of 3 behind it."""
        slot = self.space.buses[number]
        interval = self.at(slot.fault_interval_ns)
        if interval is None:
            return None
        bit = Fraction(NS_PER_S, self.at(slot.bandwidth_bps))
        return FaultFigures(interval, self.at(slot.fault_burst) or 1, (17 * bit, 31 * bit))

    def frames(self, number: int, size: int, whole: Range) -> tuple[Range, ...]:
        """The times (ns) of the frames of a message of a size in bytes; each frame competes for the bus."""
        frame, bandwidth = self.at(self.space.buses[number].fixed_ns), self.at(self.space.buses[number].bandwidth_bps)
        if isinstance(frame, Frame) and frame.protocol == "ethernet":
            return ethernet_frames_ns(frame, size, bandwidth)
        most = {"can": 8, "can_fd": 64}.get(frame.protocol) if isinstance(frame, Frame) else None
        if most is None or size <= most:
            return (whole,)
        full = -(-size // most) - 1
        last = wire_ns(frame, size - full * most, bandwidth)
        each = (Fraction(whole[0] - last[0]) / full, Fraction(whole[1] - last[1]) / full)
        return (*[each] * full, last)

    def wrap(self, bus: int, above: list[int], size: int, sizes: dict[tuple[int, ...], int]) -> None:
        """The size of a message on each way down to a bus, with the overheads of the way from top to bottom."""
        way = [*above, bus]
        carrier = self.at(self.space.buses[bus].carrier)
        if carrier is not None:
            for one in (carrier, *self.space.buses[bus].further):
                self.wrap(one, way, size, sizes)
            return
        total = size + sum(self.at(self.space.buses[one].overhead_bytes) for one in way)
        for length in range(1, len(way) + 1):
            sizes.setdefault(tuple(way[:length]), total)

    def carrying_ns(self, number: int, item: Connection, size: int) -> Range | None:
        """What one carrier takes for the message: its transmission time, or its latency without one."""
        bus = self.space.buses[number]
        fixed = self.carried(bus.fixed_ns, item)
        if isinstance(fixed, Frame):
            return wire_ns(fixed, size, self.at(bus.bandwidth_bps))
        if fixed is FROM_BANDWIDTH and self.space.profile == "dse":
            time = Fraction(size * 8 * NS_PER_S) / self.at(bus.bandwidth_bps)
            return time, time
        if fixed is not None and fixed is not FROM_BANDWIDTH:
            per_byte = self.carried(bus.per_byte_ns, item)
            return fixed[0] + per_byte[0] * size, fixed[1] + per_byte[1] * size
        latency = self.carried(bus.latency_ns, item)
        return None if latency is None else (latency[0], latency[1])

    def carried(self, tree: Any, item: Connection) -> Any:
        """A bus's figure; per processor type it is that of the sender's machine, else of the receiver's."""
        leaf = self.at(tree)
        if not isinstance(leaf, PerProcessorType):
            return leaf
        ends = [at_home(self.space.components, end).processor for end in (item.source, item.target) if end is not None]
        slot = next(self.space.processors[found] for found in map(self.at, ends) if found is not None)
        return self.at(leaf.by_type[slot.types[self.design[slot.type_decision]]])

    def is_local(self, item: Connection) -> bool:
        if item.source is None or item.target is None:
            return False
        one, other = (self.at(at_home(self.space.components, end).process) for end in (item.source, item.target))
        return one is not None and bool(one == other)


def _placed(
    space: Space, design: Design, components: Sequence[ComponentFigures], cores: Mapping[int, int]
) -> dict[int, tuple[tuple[int, int], int]]:
    """Core and rank of each thread; ranked by priority, else by the time that orders it. One priority is one rank."""
    queues: dict[tuple[int, int], list[int]] = {}
    for index, item in enumerate(space.components):
        processor = at(item.processor, design)
        if processor is not None:
            queues.setdefault((processor, cores.get(index, 1) - 1), []).append(index)
    result: dict[int, tuple[tuple[int, int], int]] = {}
    for core, queue in queues.items():
        ranks = {index: _rank(space, components, design, index) for index in queue}
        order = sorted(set(ranks.values()))
        slot = space.processors[core[0]]
        levels = at(slot.priority_levels, design) or len(order)
        result |= {index: (core, min(order.index(rank), levels - 1)) for index, rank in ranks.items()}
    return result


def _rank(space: Space, components: Sequence[ComponentFigures], design: Design, index: int) -> tuple[Any, ...]:
    """The rank of a thread on its core, or of the reservation that it is in, which has its period."""
    reservation = space.components[index].reservation
    if reservation is None:
        return _rank_of_thread(space, components, design, index)
    item = space.reservations[reservation]
    priority = at(item.priority, design)
    return (1, Fraction(at(item.period_ns, design)), item.members[0]) if priority is None else (0, -priority)


def _reserved(space: Space, design: Design, components: Sequence[ComponentFigures]) -> dict[int, Reserved]:
    """The threads in reservations, each ranked among the others there."""
    found: dict[int, Reserved] = {}
    for number, item in enumerate(space.reservations):
        ranks = {index: _rank_of_thread(space, components, design, index) for index in item.members}
        order = sorted(set(ranks.values()))
        budget, period = at(item.budget_ns, design), at(item.period_ns, design)
        found |= {index: Reserved(number, order.index(rank), budget, period) for index, rank in ranks.items()}
    return found


def _rank_of_thread(
    space: Space, components: Sequence[ComponentFigures], design: Design, index: int
) -> tuple[Any, ...]:
    """The rank of a thread, or of the executor that runs it, which has the rate of its fastest thread."""
    executor = at(space.components[index].executor, design)
    pieces = space.components[index].pieces
    if executor is None and pieces is not None:  # its pieces on its core have one priority
        index = next(item for item in pieces.members if space.components[item].executor is None)
    if executor is None:
        return _turn(space.components[index], components[index], design, index)
    item = space.executors[executor]
    priority = at(item.priority, design)
    if priority is not None:
        return (0, -priority)
    members = space.in_executor(executor, design)
    rate = max(components[number].rate_hz for number in members)
    return (1, NS_PER_S / rate, members[0]) if rate else (2, members[0])


def _turn(component: Component, figures: ComponentFigures, design: Design, index: int) -> tuple[Any, ...]:
    """Numbers first, a larger one before; then the times between jobs, or until their deadlines."""
    priority = at(component.priority, design)
    if isinstance(priority, int):
        return (0, -priority)
    times = [at(component.deadline_ns, design), figures.period_ns, figures.separation_ns]
    if priority == "deadline_monotonic" and any(time is not None for time in times):
        return (1, next(time for time in times if time is not None), index)
    return (1, NS_PER_S / figures.rate_hz, index) if figures.rate_hz else (2, index)


def _numbered(space: Space, design: Design) -> dict[int, tuple[int, int]]:
    """For each thread its turn by its priority in a round of an executor that polls: those with a number first."""
    priorities = {number: at(item.priority, design) for number, item in enumerate(space.components)}
    return {number: (0, -item) if isinstance(item, int) else (1, 0) for number, item in priorities.items()}


def _inner(space: Space, design: Design, components: Sequence[ComponentFigures]) -> dict[int, tuple[int, ...]]:
    """For each thread of an executor its place among the others there; equals together."""
    found: dict[int, tuple[int, ...]] = {}
    for executor in range(len(space.executors)):
        members = space.in_executor(executor, design)
        ranks = {number: _turn(space.components[number], components[number], design, number) for number in members}
        order = sorted(set(ranks.values()))
        found |= {number: (order.index(rank),) for number, rank in ranks.items()}
    return found
