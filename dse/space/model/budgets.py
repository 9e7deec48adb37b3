"""Data of OSATE's resource budgets: entries of threads, devices and subsystems, and the capacities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class Budgeted:
    """An entry of ``budgets``: a thread or device (`component`, its index) or a subsystem, within another by index.

    `processor` is the index of the slot that a subsystem is bound to, `speed` in MIPS, `instructions` of one dispatch,
    sizes in bytes; None where nothing is stated.
    """

    name: str
    component: int | None
    within: int | None
    processor: int | None
    partition: str | None
    memory: str | None
    speed: Fraction | None
    instructions: Fraction | None
    ram: int | None
    rom: int | None
    ram_used: int
    rom_used: int


@dataclass(frozen=True, slots=True)
class MemorySizes:
    """The sizes of a memory, in bytes.

    None where the file states nothing.
    """

    size: int | None
    ram: int | None
    rom: int | None


@dataclass(frozen=True)
class Resources:
    """Everything stated of resource budgets; speeds in MIPS, of processor types and of partitions by name.

    Looked at by the verdicts of the OSATE profiles only (docs/semantics.md).
    """

    entries: tuple[Budgeted, ...] = ()
    memories: Mapping[str, MemorySizes] = field(default_factory=dict)
    types: Mapping[str, Fraction] = field(default_factory=dict)
    partitions: Mapping[str, Fraction] = field(default_factory=dict)


@dataclass(frozen=True)
class Partition:
    """A partition of a processor: `period_ns` is the major frame, `duration_ns` None where no window is known."""

    name: str
    period_ns: Exact
    offset_ns: Exact
    duration_ns: Exact | None
