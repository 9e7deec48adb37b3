"""The space of designs: integers, ids and tuples, ready for analysis and search.

Components are referred to by their index in the tuples of `Space`; times are integer nanoseconds (what a message or a
byte takes on a bus, and the latency that a flow states, are exact fractions where they are no integers), sizes bytes,
bandwidths bit/s, rates exact fractions of Hz, prices cents, powers mW. Fields called trees hold a value or a `Choice`
over decisions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal, TypeAlias

from dse.space.model.budgets import Partition, Resources
from dse.space.model.criteria import Derived, Objective, Requirement, Rule
from dse.space.model.flows import Flow, UnreadFlow
from dse.space.model.trees import DesignView, Tree, at, leaves

EMPTY = "none"
UNKNOWN_TYPE = "?\n"
"""The type of a slot whose types are all misnamed, while other mistakes are looked for; no name has a line break."""
INACTIVE = -1

AssignmentRule: TypeAlias = Literal["audsley", "deadline_monotonic", "robust"]
Design: TypeAlias = tuple[int, ...]
"""The option of each decision, by index; `INACTIVE` where the design does not use the decision."""


@dataclass(frozen=True)
class Decision:
    """One decision of a problem, such as ``computer.type`` or ``control.period``.

    `options` are texts as the file has them, `values` what formulas use (ns, indices, names). A design holds the
    index of an option for each decision. `home` is the tree of decisions that says in which designs it is used at all.
    """

    name: str
    component: str
    field: str
    kind: str
    options: tuple[str, ...]
    values: tuple[Any, ...]
    home: Tree = None

    @property
    def is_open(self) -> bool:
        """Whether there is anything to decide."""
        return len(self.options) > 1

    @property
    def follows(self) -> bool:
        """Whether it is the type of an optional slot of one type: filled exactly when something is bound to it."""
        return self.field == "type" and len(self.options) == 2 and EMPTY in self.options


@dataclass(frozen=True)
class AdditiveFigures:
    """Additive figures: trees of integers (cents, mW) or None, and of exact fractions for declared totals."""

    price_ct: Tree = None
    power_mw: Tree = None
    totals: Mapping[str, Tree] = field(default_factory=dict)


@dataclass(frozen=True)
class Slot:
    """A processor or bus slot: `types[k]` is the type's name for option k of decision `type_decision`."""

    name: str
    types: tuple[str, ...]
    type_decision: int
    optional: bool
    figures: AdditiveFigures


@dataclass(frozen=True)
class Processor(Slot):
    """A processor slot; an empty one has 0 cores. `overload` tells whether more than all of a core may be used.

    Leaves of `switch_ns` say what a context switch takes, those of `interference` are tuples of `Interference`.
    `groups` are the kinds of cores of each type (by its name) that has several, each with the number of its cores.
    `priority_levels` are those of its operating system, None where nothing limits them. Leaves of `serves` are ``fifo``
    or ``priority`` of an accelerator, which runs one job at a time; those of `transmit_queue` are as of a `Component`.
    """

    cores: Tree
    overload: bool = False
    switch_ns: Tree = 0
    interference: Tree = ()
    priority_levels: Tree = None
    groups: Mapping[str, tuple[tuple[str, int], ...]] = field(default_factory=dict)
    serves: Tree = None
    transmit_queue: Tree = None


@dataclass(frozen=True)
class Bus(Slot):
    """A bus slot. Leaves of `fixed_ns`, `per_byte_ns` and `latency_ns` are time ranges, `PerProcessorType` or None.

    Both parts of the transmission time are None where there is none, `FROM_BANDWIDTH` where it follows from that;
    `carrier` leaves are bus indices or None. `direct` is a virtual bus type used without an entry: it is there, and
    costs, where something is bound to it. Leaves of `exclusive` say whether the chosen type carries one message at a
    time; `overload` tells whether the bus may be used beyond its bandwidth and its time. `period_ns` is the interval at
    which it carries messages, leaves of `protocols` what wraps them without being bound, both for OSATE alone.
    `further` buses carry it as well as `carrier`, all at once. `budget` is AADL's, in B/s, which only verdicts look at.
    Leaves of `sizes_bytes` are the sizes of messages that the transmission time holds for: a `SizeRange`, None where
    nobody says, or `PerProcessorType`. Leaves of `arbitration` say which waiting message goes next; it is None
    where waiting is not counted, and `uncounted` says what is missing. `fault_burst` faults come at once, others
    `fault_interval_ns` apart (None: none). `assignment` places `any`.
    """

    virtual: bool
    bandwidth_bps: Tree
    fixed_ns: Tree
    per_byte_ns: Tree
    latency_ns: Tree
    overhead_bytes: Tree
    carrier: Tree
    direct: bool = False
    exclusive: Tree = False
    overload: bool = False
    period_ns: Tree = None
    further: tuple[int, ...] = ()
    protocols: Tree = ()
    broadcast: Tree = False
    budget: Fraction | None = None
    sizes_bytes: Tree = None
    arbitration: Tree = None
    uncounted: str = ""
    fault_interval_ns: Tree = None
    fault_burst: Tree = None
    assignment: AssignmentRule = "audsley"


@dataclass(frozen=True)
class ClockReading:
    """The clock of a processor or device, its `member`: a shared one by its name, or its own (""), and how exact it is.

    `error_ns` is the most by which what two members show may differ at one moment.
    """

    name: str
    member: str
    error_ns: int


@dataclass(frozen=True)
class Component:
    """A thread, device or abstract component. Leaves are None where the user gave nothing.

    `period_ns` is None in designs whose protocol has no period; `protocol` None where none is stated.
    `priority`: a number (a larger one is more urgent), or the rule that orders it; None is rate-monotonic. `core`
    counts from 1. Leaves of `executor` are the index of what runs its jobs beside those of others; its priority then
    orders it among these. `reservation` is the index of the share of a core that it, or its executor, runs in: its
    priority, or the executor's, then orders it in there.
    `section_ns`: the longest part of a job during which no other thread of its core gets the CPU. `transmit_queue`:
    ``fifo`` where of its messages the oldest competes for a bus, ``priority`` the most urgent; None as its processor.
    `clock` leaves are `ClockReading`; `offset_ns` is when on it the first release is, None where that is not known;
    `communication` says when data pass: ``let`` at release and release + deadline, ``at_dispatch`` at release and when
    the job ends, else (``implicit``) when it begins and ends.
    `triggers` are the connections that dispatch it when it is event-triggered; `incoming` all that end in it. `join` is
    ``all`` where a job needs a message of each trigger, `pairing` which messages that takes together.
    `stated_period_ns` is the period also where the protocol has none (unless it was to be decided), and `bound` whether
    the thread is bound to its processor or only has figures of it, and `partition` where it runs there, all for OSATE
    alone. A piece of a thread that has segments knows all its `pieces`: each but the first is dispatched by the one
    before. `part_of` is the thread or device of the file of which calls make this a further job ("" of one itself).
    """

    name: str
    section: Literal["devices", "threads"]
    category: str
    processor: Tree
    process: Tree
    protocol: Tree
    period_ns: Tree
    execution_ns: Tree
    callback_ns: Tree
    latency_ns: Tree
    deadline_ns: Tree
    response_ns: Tree
    queue_size: Tree
    figures: AdditiveFigures
    priority: Tree = None
    core: Tree = None
    executor: Tree = None
    reservation: int | None = None
    section_ns: Tree = None
    clock: Tree = None
    offset_ns: Tree = None
    communication: Tree = None
    join: Tree = None
    pairing: Tree = None
    incoming: tuple[int, ...] = ()
    triggers: tuple[int, ...] = ()
    stated_period_ns: Tree = None
    bound: bool = True
    partition: Partition | None = None
    pieces: Pieces | None = None
    part_of: str = ""
    transmit_queue: Tree = None

    @property
    def is_lone(self) -> bool:
        """Whether it is an OS thread by itself, without executor, reservation or segments."""
        return self.executor is None and self.reservation is None and self.pieces is None

    @property
    def stated_as(self) -> str:
        """The name of the thread or device in the file, of which this may be a piece or a further job."""
        return self.part_of or (self.name if self.pieces is None else self.pieces.thread)


@dataclass(frozen=True)
class Connection:
    """A connection; `source` and `target` index components (None: system boundary).

    `bus` leaves are bus indices, or None where the connection is unbound or inside one process; `stated_bus` is the
    same wherever its ends are (unless it was to be decided), `timing` AADL's and `protocols` what wraps its messages
    without being bound, `type_bytes` the size of the port's data type where that is not the size of the port, all for
    OSATE alone. `further` buses carry it as well as `bus`, all at once. An `is_inner` one is none of the file: it leads
    from a piece of a thread to the next. Of the messages on a bus the lowest `identifier` goes first (``any``: a
    chosen one), on Ethernet the highest `priority`; `deadline_ns` is from sending to receipt. Leaves of `carried_in`
    are the connection whose message has its data, None of one of its own; `riders` may be carried in its own.
    """

    name: str
    source: int | None
    target: int | None
    size_bytes: Tree
    bus: Tree
    rate_hz: Tree
    data_rate: Tree
    port: str
    queue_size: Tree
    latency_ns: Tree
    timing: str = "sampled"
    stated_bus: Tree = None
    further: tuple[int, ...] = ()
    protocols: tuple[int, ...] = ()
    from_port: str | None = None
    is_inner: bool = False
    budget: Fraction | None = None
    type_bytes: Tree = None
    identifier: Tree = None
    priority: Tree = None
    deadline_ns: Tree = None
    carried_in: Tree = None
    riders: tuple[int, ...] = ()

    @property
    def states_rate(self) -> bool:
        """Whether it says itself how often messages leave, by its rate or its data rate."""
        return self.rate_hz is not None or self.data_rate is not None

    @property
    def sender(self) -> int | None:
        """The component at whose rate messages leave; None where it states one, or comes from outside."""
        return None if self.states_rate else self.source


@dataclass(frozen=True)
class Reference:
    """A name that a rule can refer to: a tree of values of one kind."""

    name: str
    kind: str
    tree: Tree
    texts: Mapping[Any, str]


@dataclass(frozen=True)
class OpenCore:
    """The core of a thread as a decision, which stands behind all others, and only where something asked depends on it.

    `index` is its place in `Space.decisions` when it is there. Threads of one reservation or executor share it:
    `others` are those behind the first. `tree` is what a thread has there; an executor without one decides nothing.
    """

    component: int
    index: int
    decision: Decision
    others: tuple[int, ...] = ()
    tree: Tree = None

    @property
    def threads(self) -> tuple[int, ...]:
        """Every thread whose core it is."""
        return (self.component, *self.others)


@dataclass(frozen=True)
class OpenPriority(OpenCore):
    """The priority of a thread that asks for the best order, as a decision behind those on cores."""


@dataclass(frozen=True)
class Space:
    """A problem, ready to analyse and to search. See the module docstring for units."""

    name: str
    profile: str
    worst_case: str
    decisions: tuple[Decision, ...]
    processors: tuple[Processor, ...]
    buses: tuple[Bus, ...]
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    flows: tuple[Flow, ...]
    totals: Mapping[str, str]
    derived: tuple[Derived, ...]
    requirements: tuple[Requirement, ...]
    rules: tuple[Rule, ...]
    objectives: tuple[Objective, ...]
    references: Mapping[str, Reference]
    currency: str
    baseline: Mapping[int, int]
    fixed: Mapping[int, int] = field(default_factory=dict)
    open_cores: tuple[OpenCore, ...] = ()
    open_priorities: tuple[OpenPriority, ...] = ()
    unequal_cores: bool = False
    """Whether some thread takes longer on some cores of a processor than on others."""
    is_traced: bool = False
    """Whether figures remember how they were made (`dse.questions.sensitivity`): nothing found of them is kept."""
    assumptions: tuple[str, ...] = ()
    processing: str = "execution_time"
    """What a flow counts as the longest processing of a thread: ``execution_time`` or ``response_time``."""
    catalogue: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """The names of all types by section (``processor_types``, …), also of those that nothing may have."""
    deadlines: str = "none"
    """Which deadlines of threads count: ``stated``, ``all`` (a thread without one ends by its period) or ``none``."""
    states_baseline: bool = False
    """Whether the file states a baseline, also of fixed fields alone, which `baseline` leaves out."""
    cost_of_change: Mapping[int, int] = field(default_factory=dict)
    """The cost of changing a decision of the baseline, by decision; 1 where none is stated."""
    partition_output: str = "major_frame"
    """OSATE's setting for when output leaves a partition: or ``partition_end``."""
    system: str = "asynchronous"
    """OSATE's setting for ends of which it is not known whether they share a clock: or ``synchronous``."""
    best_case: str = "empty_queue"
    """OSATE's setting for queues at best: or ``full_queue``."""
    bus_queuing: str = "counted"
    """Whether messages wait for buses: ``counted`` where all that decides it is stated, or ``not_counted``."""
    packed: tuple[str, ...] = ()
    """The buses on which the search chooses which connections share a frame."""
    executors: tuple[Executor, ...] = ()
    reservations: tuple[Reservation, ...] = ()
    offset_grid_ns: int = 0
    """The grid on which some offsets are chosen; 0 where none is chosen on one."""
    resources: Resources = field(default_factory=Resources)
    """OSATE's resource budgets, which only verdicts look at."""
    unread: tuple[UnreadFlow, ...] = ()
    """The flows of an imported model that could not be followed."""
    overload: str = "forbidden"
    """Whether cores and buses may be used beyond all of them: ``forbidden`` or ``allowed`` (`dse.space.question`)."""

    @property
    def unchecked(self) -> tuple[UnreadFlow, ...]:
        """The unread flows with a stated latency: requirements that no design is compared with."""
        return tuple(item for item in self.unread if item.requirement)

    @property
    def first_open(self) -> int:
        """The index of the first decision on a core or a best order; the number of decisions where there is none."""
        return min((item.index for item in (*self.open_cores, *self.open_priorities)), default=len(self.decisions))

    @property
    def first_order(self) -> int:
        """The index of the first decision on a best order, which tells no design from others; see `first_open`."""
        return min((item.index for item in self.open_priorities), default=len(self.decisions))

    @property
    def has_open_groups(self) -> bool:
        """Whether the executor of some thread is a decision."""
        return any(item.is_open for item in self.executors)

    def unit(self, number: int, view: DesignView) -> int:
        """The first thread of the reservation or executor of a thread, or its first piece on its core; else it itself.

        What has the same unit shares a core, and a priority there.
        """
        return self.together(number, view)[0]

    def together(self, number: int, view: DesignView) -> tuple[int, ...]:
        """All threads of the reservation of a thread, else what one OS thread runs with it (`os_thread`)."""
        reservation = self.components[number].reservation
        if reservation is not None:
            members: tuple[int, ...] = self.reservations[reservation].members
            return members
        return self.os_thread(number, view)

    def os_thread(self, number: int, view: DesignView) -> tuple[int, ...]:
        """All threads of the executor that runs a thread, or its pieces on its core; else the thread alone."""
        component = self.components[number]
        if component.executor is not None:
            return self.in_executor(at(component.executor, view), view)
        if component.pieces is None:
            return (number,)
        return tuple(item for item in component.pieces.members if self.components[item].executor is None)

    def core_owners(self, component: Component) -> tuple[str, ...]:
        """The names of all that may have the core of a thread (`core_owner`)."""
        if component.reservation is None and component.executor is not None:
            return tuple(dict.fromkeys(self.executors[item].name for item in leaves(component.executor)))
        return (self.core_owner(component, []),)

    def in_executor(self, number: int, view: DesignView) -> tuple[int, ...]:
        """The threads of an executor; none where all that may be in it are in others."""
        item = self.executors[number]
        if not item.is_open:
            return item.members
        return tuple(one for one in item.members if at(self.components[one].executor, view) == number)

    def core_owner(self, component: Component, view: DesignView) -> str:
        """The name of what has the core of a thread: its reservation, its executor, or the thread itself."""
        hosts = ((self.reservations, component.reservation), (self.executors, at(component.executor, view)))
        return next((str(these[index].name) for these, index in hosts if index is not None), component.stated_as)

    def is_last_piece(self, number: int) -> bool:
        """Whether a component is a whole thread or the last piece of one, with which its job ends."""
        pieces = self.components[number].pieces
        return pieces is None or pieces.members[-1] == number

    def decision_index(self, name: str) -> int | None:
        """The index of the decision called `name`, or None."""
        return self._decision_numbers.get(name)

    @cached_property
    def component_numbers(self) -> Mapping[str, int]:
        """The number of each component, by name."""
        return {item.name: number for number, item in enumerate(self.components)}

    @cached_property
    def _decision_numbers(self) -> Mapping[str, int]:
        return {decision.name: index for index, decision in reversed(tuple(enumerate(self.decisions)))}


@dataclass(frozen=True)
class Executor:
    """An OS thread for the jobs of `members`, threads by number in the order of the file, of which one runs at a time.

    Leaves of `kind` are `ExecutorKind`, those of `priority` None where none is stated. Where its group `is_open` some
    of the members may be in another executor (`Space.os_thread`). It runs on `processor`; `core` is the stated one.
    """

    name: str
    kind: Tree
    members: tuple[int, ...]
    priority: Tree = None
    is_open: bool = False
    processor: Tree = None
    core: Tree = None


@dataclass(frozen=True)
class Reservation:
    """A share of a core for `members`, threads by number in the order of the file: `budget_ns` of each `period_ns`.

    Leaves of `priority`, that of the reservation among what else its core runs, are None where none is stated.
    """

    name: str
    members: tuple[int, ...]
    budget_ns: Tree
    period_ns: Tree
    priority: Tree = None


@dataclass(frozen=True)
class Pieces:
    """The pieces of a thread's work, components by number in their order; the last one has the thread's name.

    `home` is the first of them that runs where the thread does, on no accelerator.
    """

    thread: str
    members: tuple[int, ...]
    home: int


def at_home(components: Sequence[Component], number: int) -> Component:
    """The component that has the processor and the process of a thread or device, wherever its last piece runs."""
    pieces = components[number].pieces
    return components[number if pieces is None else pieces.home]


@dataclass(frozen=True)
class Interference:
    """An interrupt or throttling that takes each core of a processor: up to `worst_ns`, at least `period_ns` apart."""

    name: str
    worst_ns: int
    period_ns: int
    is_throttling: bool = False
