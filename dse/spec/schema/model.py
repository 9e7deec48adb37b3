"""The problem as the user wrote it: a strict, frozen schema with quantities already read.

`Options[T]` is the decision language: one value or a non-empty list of values in the file, always a tuple here.
The JSON Schema of `dse schema` is generated from these classes.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema

from dse.spec import kinds
from dse.spec.schema.fields import (
    Carrier,
    Core,
    Identifier,
    Items,
    Length,
    Line,
    MessagePriority,
    Name,
    Options,
    Priority,
    QueueSize,
    Reference,
    Respelt,
    Setting,
    SlotType,
    SomeItems,
    Version,
    Weight,
    field_error,
)
from dse.spec.schema.frames import CanFdFrame as CanFdFrame
from dse.spec.schema.frames import CanFrame as CanFrame
from dse.spec.schema.frames import EthercatFrame as EthercatFrame
from dse.spec.schema.frames import EthernetFrame as EthernetFrame
from dse.spec.schema.frames import FlexrayFrame as FlexrayFrame
from dse.spec.schema.frames import SerialFrame as SerialFrame
from dse.spec.schema.hardware import (
    ONE,
    AssignmentRule,
    BusType,
    Demands,
    Priced,
    ProcessorType,
    TimeRanges,
    TransmitQueue,
)
from dse.spec.schema.hardware import Interrupt as Interrupt
from dse.spec.schema.hardware import Throttling as Throttling
from dse.spec.schema.hardware import TransmissionTime as TransmissionTime
from dse.spec.schema.parts import SpecMapping
from dse.spec.schema.quantity_fields import (
    DataRate,
    DataSize,
    Demand,
    Duration,
    Offset,
    Period,
    Rate,
    TimeRange,
    Transmission,
)
from dse.spec.schema.resources import Memory as Memory
from dse.spec.schema.resources import Partition as Partition
from dse.spec.schema.resources import ResourceBudget as ResourceBudget

Protocol: TypeAlias = Literal["periodic", "aperiodic", "sporadic", "hybrid"]
ExecutorKind: TypeAlias = Annotated[kinds.ExecutorKind, Respelt()]
Communication: TypeAlias = Annotated[Literal["implicit", "at_dispatch", "let"], Respelt()]
Join: TypeAlias = Literal["any", "all"]
Pairing: TypeAlias = Literal["fifo", "latest"]
Category: TypeAlias = Annotated[Literal[
    "thread", "device", "abstract", "process", "system", "thread_group", "processor", "virtual_processor", "memory",
    "bus", "virtual_bus", "data", "subprogram", "subprogram_group",
], Respelt()]  # fmt: skip
Timing: TypeAlias = Literal["sampled", "immediate", "delayed"]
Port: TypeAlias = Annotated[Literal["event_data", "event", "data", "data_access", "feature"], Respelt()]

WITH_FIGURES = " with figures "


class DeviceType(Priced):
    """The figures of a device; times in ns."""

    category: Category | None = None
    period: Options[Period] | None = None
    dispatch_protocol: Options[Protocol] | None = None
    compute_execution_time: TimeRanges | None = None
    latency: Options[TimeRange] | None = None
    deadline: Options[Duration] | None = None
    response_time: TimeRanges | None = None
    queue_size: Options[QueueSize] | None = None
    transmit_queue: Options[TransmitQueue] | None = None
    offset: Options[Offset] | None = None


class ThreadType(DeviceType):
    """The figures of a thread; times in ns."""

    callback_execution_time: TimeRanges | None = None
    non_preemptive: Demands | None = None
    communication: Options[Communication] | None = None


class Device(DeviceType):
    """A device of the architecture."""

    type: Options[Reference] | None = None
    clock: Reference | None = None
    partition: Reference | None = None


class Segment(SpecMapping):
    """A piece of a thread's work: on the thread's own processor, or while the thread waits on an accelerator."""

    compute_execution_time: TimeRanges
    processor: Reference | None = None
    source: Line | None = None


def _figure_text(value: Any) -> Any:
    """A plain number, such as the mean of a factor, as text."""
    return repr(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


FigureText: TypeAlias = Annotated[
    Line,
    BeforeValidator(_figure_text),
    WithJsonSchema({"type": ["string", "number"], "description": "A quantity with its unit, or a plain factor."}),
]


class Parameter(SpecMapping):
    """A parameter of a thread: the range of what it may be, its value, and what the thread takes with each value."""

    range: Line | None = None
    value: Options[FigureText] | None = None
    compute_execution_time: dict[Name, TimeRanges] | None = None
    source: Line | None = None


class Thread(ThreadType):
    """A thread (or abstract component) of the architecture.

    `figures_of` names a processor as `processor` does, without binding the thread to it for OSATE.
    """

    type: Options[Reference] | None = None
    processor: Options[Reference] | None = None
    figures_of: Options[Reference] | None = None
    partition: Reference | None = None
    process: Options[Reference] | None = None
    priority: Options[Priority] | None = None
    core: Options[Core] | None = None
    executor: Options[Reference] | None = None
    reservation: Reference | None = None
    dispatch_trigger: Items[Reference] | None = None
    join: Options[Join] | None = None
    pairing: Options[Pairing] | None = None
    segments: SomeItems[Segment] | None = None
    parameters: dict[Name, Parameter] = {}


class Clock(SpecMapping):
    """A clock that processors and devices share.

    `synchronisation_error` (ns) is the most by which what two of them show may differ at one moment.
    """

    synchronisation_error: Demand = 0
    source: Line | None = None


class Executor(SpecMapping):
    """An OS thread that runs the jobs of several threads of the architecture (callbacks), which wait for each other."""

    kind: Options[ExecutorKind]
    processor: Options[Reference] | None = None
    priority: Options[QueueSize] | None = None
    core: Options[Core] | None = None
    reservation: Reference | None = None
    source: Line | None = None


class Reservation(SpecMapping):
    """A share of a core: its threads get at least `budget` of each `period` (ns), and at most that."""

    processor: Options[Reference]
    budget: Options[Period]
    period: Options[Period]
    priority: Options[QueueSize] | None = None
    core: Options[Core] | None = None
    source: Line | None = None


class Slot(SpecMapping):
    """A slot that a type fills; `overload` lifts the limits that are implied."""

    type: Options[SlotType]
    optional: bool = False
    overload: Literal["allowed"] | None = None
    source: Line | None = None


class Processor(Slot):
    """A processor slot."""

    clock: Reference | None = None


class Bus(Slot):
    """A bus slot; `bus` is what carries a virtual bus, `further_buses` carry it as well, all at once."""

    bus: Options[Reference] | None = None
    further_buses: Items[Reference] = ()
    budget: DataRate | None = None
    assignment: AssignmentRule | None = None


class Messages(SpecMapping):
    """Where the types of ROS messages are defined that connections name, and which size of theirs counts."""

    distribution: Line | None = None
    definitions: Options[Line] | None = None
    size: Literal["serialised", "rule"] = "serialised"
    source: Line | None = None


class Reply(SpecMapping):
    """The reply of a call: the size of the answer, and the work of the caller when the answer arrives."""

    data_size: DataSize | None = None
    compute_execution_time: TimeRanges | None = None
    latency: TimeRange | None = None
    identifier: Identifier | None = None
    priority: MessagePriority | None = None
    source: Line | None = None


class Connection(SpecMapping):
    """A connection; sizes in bytes, rates exact fractions of Hz and B/s."""

    from_: Reference | None = Field(default=None, alias="from")
    to: Reference | None = None
    from_port: Reference | None = None
    data_size: Options[DataSize] | None = None
    type_size: Options[DataSize] | None = None
    message: Line | None = None
    lengths: dict[Name, Length] = {}
    bus: Options[Carrier] | None = None
    further_buses: Items[Reference] = ()
    protocols: Items[Reference] = ()
    rate: Options[Rate] | None = None
    data_rate: Options[DataRate] | None = None
    budget: DataRate | None = None
    port: Port = "event_data"
    timing: Timing = "sampled"
    queue_size: Options[QueueSize] | None = None
    latency: Options[TimeRange] | None = None
    identifier: Options[Identifier] | None = None
    priority: Options[MessagePriority] | None = None
    carried_in: Options[Name] | None = None
    deadline: Options[Duration] | None = None
    reply: Reply | None = None
    source: Line | None = None


class PathElement(SpecMapping):
    """A component of a flow with figures that it has in this flow alone.

    `latency` is that of AADL's flow specification; `compute_execution_time` and `response_time` are those of the port
    that it is entered by, and count for events where the component is not periodic.
    """

    element: Reference
    latency: TimeRange | None = None
    compute_execution_time: TimeRange | None = None
    response_time: TimeRange | None = None


def _which_element(value: Any) -> str:
    return WITH_FIGURES if isinstance(value, dict | PathElement) else ONE


PathItem: TypeAlias = Annotated[
    Annotated[Name, Tag(ONE)] | Annotated[PathElement, Tag(WITH_FIGURES)], Discriminator(_which_element)
]


class Flow(SpecMapping):
    """An end-to-end flow: components in order, connections where they must be named."""

    path: SomeItems[PathItem]
    latency: Transmission | None = None
    source: Line | None = None


class UnreadFlow(SpecMapping):
    """A flow of a model that the import could not follow: why, and the latency range (ns) that it was to keep."""

    reason: Line
    latency: Transmission | None = None
    source: Line | None = None


def _rule_text(value: Any) -> Any:
    """``{require: X}`` and ``{forbid: X}`` mean the same as the text ``require X`` and ``forbid X``."""
    if isinstance(value, dict) and len(value) == 1:
        [(verb, text)] = value.items()
        if verb in ("require", "forbid") and isinstance(text, str):
            return f"{verb} {text}"
    if isinstance(value, dict):
        raise field_error("expected a rule, got a mapping", 'write "require CONDITION" or "forbid CONDITION"')
    return value


RuleText: TypeAlias = Annotated[
    Line,
    BeforeValidator(_rule_text),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string"},
                {
                    "type": "object",
                    "properties": {
                        "require": {
                            "type": "string",
                            "description": "What every design has to fulfil: a condition on its decisions.",
                            "examples": ["nav.processor = front"],
                        },
                        "forbid": {
                            "type": "string",
                            "description": "What no design may fulfil: a condition on its decisions.",
                            "examples": ["nav.processor = front and nav.period = 5 ms"],
                        },
                    },
                    "minProperties": 1,
                    "maxProperties": 1,
                    "additionalProperties": False,
                },
            ]
        }
    ),
]


class Uncertainty(SpecMapping):
    """The uncertainty of a quantity: a range of values or factors, a distribution, or measured samples."""

    range: Line | None = None
    factor: Line | None = None
    distribution: Literal["uniform", "normal", "triangular"] | None = None
    mean: FigureText | None = None
    deviation: FigureText | None = None
    mode: FigureText | None = None
    samples: Line | Items[Line] | None = None
    column: Line | None = None
    unit: Line | None = None
    source: Line | None = None


Deadlines: TypeAlias = Literal["stated", "all", "none"]
Processing: TypeAlias = Annotated[Literal["execution_time", "response_time"], Respelt()]


class Catalogue(SpecMapping):
    """The content that an included file may have."""

    source: Line | None = None
    description: str | None = None
    assumptions: Items[str] = ()
    include: Options[Line] | None = None
    processor_types: dict[Name, ProcessorType] = {}
    bus_types: dict[Name, BusType] = {}
    device_types: dict[Name, DeviceType] = {}
    thread_types: dict[Name, ThreadType] = {}
    totals: dict[Name, Line] = {}
    clocks: dict[Name, Clock] = {}
    partitions: dict[Name, Partition] = {}
    memories: dict[Name, Memory] = {}
    budgets: dict[Name, ResourceBudget] = {}
    processors: dict[Name, Processor] = {}
    buses: dict[Name, Bus] = {}
    devices: dict[Name, Device] = {}
    threads: dict[Name, Thread] = {}
    executors: dict[Name, Executor] = {}
    reservations: dict[Name, Reservation] = {}
    connections: dict[Name, Connection] = {}
    flows: dict[Name, Flow] = {}
    metrics: dict[Name, Line] = {}
    uncertainty: dict[Name, Uncertainty] = {}


class Imported(SpecMapping):
    """Where a problem file was imported from: the model, its root, the mode that it is in, and further folders."""

    from_: Line = Field(alias="from")
    root: Line
    mode: Line | None = None
    library: Items[Line] = ()


class Ros2(SpecMapping):
    """How ROS 2 calls what the file names, for exports: nodes, parameters, and callback groups of OS threads."""

    nodes: dict[Name, Line] = {}
    parameters: dict[Name, Line] = {}
    callback_groups: dict[Name, Line] = {}
    source: Line | None = None


class Spec(Catalogue):
    """A whole problem file."""

    dse: Version
    name: Line
    of: Line | None = None
    root: Line | None = None
    mode: Line | None = None
    library: Options[Line] | None = None
    imported: Imported | None = None
    unread: dict[Name, UnreadFlow] = {}
    profile: Literal["dse", "osate-2.2", "osate-2.19"] = "dse"
    worst_case: Annotated[Literal["execution_time", "deadline"], Respelt()] = "execution_time"
    system: Literal["asynchronous", "synchronous"] = "asynchronous"
    partition_output: Annotated[Literal["major_frame", "partition_end"], Respelt()] = "major_frame"
    best_case: Annotated[Literal["empty_queue", "full_queue"], Respelt()] = "empty_queue"
    bus_queuing: Annotated[Literal["counted", "not_counted"], Respelt()] = "counted"
    processing: Processing | None = None
    deadlines: Deadlines | None = None
    priorities: Annotated[Literal["rate_monotonic", "deadline_monotonic", "any"], Respelt()] = "rate_monotonic"
    overload: Literal["forbidden", "allowed"] = "forbidden"
    offset_grid: Period | None = None
    packing: dict[Name, Literal["any", "stated"]] = {}
    messages: Messages | None = None
    ros2: Ros2 | None = None
    requirements: Items[Line] = ()
    rules: Items[RuleText] = ()
    objectives: Items[Line] = ()
    baseline: dict[Name, dict[Name, Setting]] = {}
    cost_of_change: dict[Name, dict[Name, Weight]] = {}
