"""Partitions of processors, memories and budgets, as the user wrote them: what the OSATE profiles alone look at."""

from __future__ import annotations

from dse.spec.schema.fields import Line, Reference
from dse.spec.schema.parts import SpecMapping
from dse.spec.schema.quantity_fields import DataSize, Duration, Instructions, Period, Speed


class Partition(SpecMapping):
    """A partition of a processor in time (ARINC 653; AADL's virtual processor), for the OSATE profiles; times in ns.

    It has a window of `duration` from `offset` on in each `period` (the major frame; without one the duration); without
    a duration no window is known.
    """

    period: Period | None = None
    offset: Duration = 0
    duration: Duration | None = None
    speed: Speed | None = None
    source: Line | None = None


class Memory(SpecMapping):
    """A memory, for OSATE's resource budgets: what it has altogether, and of RAM and ROM; in bytes."""

    size: DataSize | None = None
    ram: DataSize | None = None
    rom: DataSize | None = None
    source: Line | None = None


class ResourceBudget(SpecMapping):
    """The budget of a thread, device or subsystem for processors and memories, for `osate-2.19`.

    `speed` is in MIPS, `instructions` are those of one dispatch of a thread, sizes in bytes. A subsystem says what it
    is bound to itself; a thread has its processor and its partition.
    """

    within: Reference | None = None
    processor: Reference | None = None
    partition: Reference | None = None
    memory: Reference | None = None
    speed: Speed | None = None
    instructions: Instructions | None = None
    ram: DataSize | None = None
    rom: DataSize | None = None
    ram_used: DataSize | None = None
    rom_used: DataSize | None = None
    source: Line | None = None
