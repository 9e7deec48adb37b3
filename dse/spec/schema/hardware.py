"""The types of processors and buses as the user wrote them, and the forms that their figures have."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Tag, WithJsonSchema

from dse.spec.kinds import StatedArbitration
from dse.spec.schema.fields import Cores, Count, Items, Line, Name, Options, Respelt, describe, field_error
from dse.spec.schema.frames import FrameType
from dse.spec.schema.parts import ReadBy, SpecMapping
from dse.spec.schema.quantity_fields import (
    Bandwidth,
    DataSize,
    Demand,
    Duration,
    Money,
    Period,
    Power,
    SizeRange,
    Speed,
    TimeRange,
    Total,
    Transmission,
)
from dse.support import units


class Priced(SpecMapping):
    """The contributions of a type to the system's totals: money in cents, power in mW, and declared totals."""

    price: Options[Money] | None = None
    power: Options[Power] | None = None
    totals: dict[Name, Options[Total]] = {}
    source: Line | None = None


class Interrupt(SpecMapping):
    """An interrupt of each core: at least `period` apart, each takes up to its longest execution time."""

    compute_execution_time: TimeRange
    period: Period
    source: Line | None = None


class Throttling(SpecMapping):
    """The throttling by an operating system: threads get at most `budget` of each `period`, on each core."""

    budget: Duration
    period: Period
    source: Line | None = None


# Tags of unions appear in the locations of errors: the blanks around them keep them apart from names in the file.
ONE, BY_PROCESSOR_TYPE, BY_GROUP, IN_WORDS = " one ", " by processor type ", " by group ", " in words "


def _which_cores(value: Any) -> str:
    return BY_GROUP if isinstance(value, dict) else ONE


CoresOrGroups: TypeAlias = Annotated[
    Annotated[Options[Cores], Tag(ONE)] | Annotated[dict[Name, Cores], Tag(BY_GROUP)], Discriminator(_which_cores)
]
"""Equal cores, or how many there are of each kind."""


Service: TypeAlias = Literal["fifo", "priority"]
TransmitQueue: TypeAlias = Literal["priority", "fifo"]
"""Which message of a sender competes for a bus: its most urgent one, or the one that has waited longest."""


class ProcessorType(Priced):
    """A computer that can fill a processor slot, with the overheads that response times count."""

    cores: CoresOrGroups = (1,)
    context_switch: Options[Demand] | None = None
    interrupts: dict[Name, Interrupt] = {}
    throttling: Throttling | None = None
    priority_levels: Options[Count] | None = None
    serves: Service | None = None
    transmit_queue: Options[TransmitQueue] | None = None
    speed: Speed | None = None


INSTANTLY = units.TimeRange(0, 0)


FROM_BANDWIDTH = "from bandwidth"
"""Asks for size / bandwidth as the transmission time of a bus."""


class TransmissionTime(SpecMapping):
    """AADL's Transmission_Time: `fixed` per message and `per_byte`, each a time range in ns, exact.

    `sizes` are those of messages, with protocol overheads, for which both hold, as where they were measured.
    """

    fixed: Options[Transmission] = (INSTANTLY,)
    per_byte: Options[Transmission] = (INSTANTLY,)
    sizes: SizeRange | None = None


def _from_bandwidth(value: Any) -> str:
    if value != FROM_BANDWIDTH:
        hint = f'or "{FROM_BANDWIDTH}", for size / bandwidth'
        raise field_error(f"expected a mapping of `fixed` and `per_byte`, got {describe(value)}", hint)
    return FROM_BANDWIDTH


FromBandwidth: TypeAlias = Annotated[
    str,
    ReadBy(_from_bandwidth),
    WithJsonSchema({"const": FROM_BANDWIDTH, "description": "The size of a message over the bandwidth."}),
]


def _which_transmission(value: Any) -> str:
    if isinstance(value, str):
        return IN_WORDS
    if isinstance(value, dict) and value and not set(value) & set(TransmissionTime.model_fields):
        return BY_PROCESSOR_TYPE
    return ONE


def _which_range(value: Any) -> str:
    return BY_PROCESSOR_TYPE if isinstance(value, dict) else ONE


TransmissionTimes: TypeAlias = Annotated[
    Annotated[TransmissionTime, Tag(ONE)]
    | Annotated[dict[Name, TransmissionTime], Tag(BY_PROCESSOR_TYPE)]
    | Annotated[FromBandwidth, Tag(IN_WORDS)],
    Discriminator(_which_transmission),
]


TimeRanges: TypeAlias = Annotated[
    Annotated[Options[TimeRange], Tag(ONE)] | Annotated[dict[Name, Options[TimeRange]], Tag(BY_PROCESSOR_TYPE)],
    Discriminator(_which_range),
]


Demands: TypeAlias = Annotated[
    Annotated[Options[Demand], Tag(ONE)] | Annotated[dict[Name, Options[Demand]], Tag(BY_PROCESSOR_TYPE)],
    Discriminator(_which_range),
]


Arbitration: TypeAlias = Annotated[StatedArbitration, Respelt()]
"""Which of the messages that wait for a bus goes next."""


AssignmentRule: TypeAlias = Annotated[Literal["audsley", "deadline_monotonic", "robust"], Respelt()]
"""Which of the messages with any identifier that may be the last on a bus is."""


class BusType(Priced):
    """A bus or virtual bus; `overhead` is in bytes per message, `bandwidth` in bit/s.

    An `exclusive` bus carries one message at a time. With a `frame`, load and time are those of the wire. Its
    `arbitration` says which message goes next.
    """

    virtual: bool = False
    exclusive: bool = False
    arbitration: Arbitration | None = None
    broadcast: bool = False
    fault_interval: Options[Period] | None = None
    fault_burst: Options[Count] | None = None
    bandwidth: Options[Bandwidth] | None = None
    transmission_time: TransmissionTimes | None = None
    frame: FrameType | None = None
    latency: TimeRanges | None = None
    overhead: Options[DataSize] = (0,)
    period: Options[Period] | None = None
    protocols: Items[Name] = ()
