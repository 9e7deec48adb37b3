"""OSATE's resource budgets: what threads and subsystems are to use of processors and memories (osate.md, part C).

Source: OSATE's `BoundResourceAnalysis` and `NotBoundResourceAnalysis`. A thread needs InstructionsPerDispatch / Period,
else its execution time / Period times the speed of its processor; a subsystem what its parts need together. Where that
is nothing its budget stands for it. What is bound to a processor or memory counts once, with the outermost that is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Annotated, Literal, TypeAlias

from dse.analysis.osate.components import period_ns
from dse.analysis.osate.findings import Finding
from dse.analysis.views import View
from dse.space.model.budgets import Budgeted, MemorySizes
from dse.space.model.space import EMPTY, Space
from dse.space.model.trees import at
from dse.support.json_fields import Unit
from dse.support.units import format_number, format_speed

Kind: TypeAlias = Literal["speed", "memory", "RAM", "ROM"]
ZERO = Fraction(0)
PER_S = 1000
"""MIPS of a processor that executes one instruction each nanosecond."""


@dataclass(frozen=True, slots=True)
class BudgetUse:
    """The demand of one entry of `budgets` for a resource.

    In the unit of the resource: MIPS or bytes.
    """

    WRITTEN = ("name", "used", "budget", "slack_ppm")

    name: Annotated[str, "The thread, device or subsystem."]
    used: Annotated[Fraction, "What it needs, or its budget where it says of nothing that it needs it."]
    budget: Annotated[Fraction | None, "What it is to use at most; null without a budget."]

    @property
    def slack_ppm(self) -> Fraction | None:
        """The unused part of the budget, as a share of the budget; null without a budget.

        In ppm, negative where more is used than budgeted.
        """
        return (self.budget - self.used) / self.budget * 10**6 if self.budget else None


@dataclass(frozen=True, slots=True)
class ResourceUse:
    """OSATE's resource budgets: of a processor, a partition, a memory, or of the whole system.

    Totals are exact, in MIPS or bytes.
    """

    WRITTEN = ("name", "resource", "unit", "capacity", "total", "slack_ppm", "users", "findings")

    name: Annotated[str, "The processor, partition or memory; `system` for all together."]
    resource: Annotated[Kind, "What is compared."]
    unit: Annotated[Unit, "What the figures count: `MIPS` or `B`."]
    capacity: Annotated[Fraction | None, "What there is of it; null where that is not stated."]
    total: Annotated[Fraction, "What is needed together."]
    users: Annotated[
        tuple[BudgetUse, ...], "The outermost that are bound to it; of the system everything with a budget."
    ]
    findings: Annotated[tuple[Finding, ...], "OSATE's errors and warnings."]

    @property
    def slack_ppm(self) -> Fraction | None:
        """The unused part of the capacity, as a share of the capacity; null where no capacity is stated.

        In ppm, negative where more is needed than there is.
        """
        return (self.capacity - self.total) / self.capacity * 10**6 if self.capacity else None


def resource_uses(space: Space, view: View) -> tuple[ResourceUse, ...]:
    """Every processor, partition and memory of which something is stated, and the system as a whole.

    Processors and partitions by speed, memories by size, RAM and ROM; nothing where the problem states no budgets.
    """
    stated = space.resources
    uses: list[ResourceUse] = []
    if stated.types or stated.partitions or any(item.speed is not None for item in stated.entries):
        uses += _processors(_Needs(space, view, "speed"))
    kinds: tuple[Kind, ...] = ("memory", "RAM", "ROM")
    for kind in kinds:
        needs = _Needs(space, view, kind)
        budgets = kind != "memory" and any(needs.budget(item) for item in range(len(stated.entries)))
        if budgets or any(_size(item, kind) for item in stated.memories.values()):
            uses += _memories(needs)
    return tuple(uses)


class _Needs:
    """The needs of entries and threads for one resource in one design; a thread without an entry is one itself.

    An item is a number: below the number of entries one of these, else a thread.
    """

    def __init__(self, space: Space, view: View, kind: Kind) -> None:
        self.space, self.view, self.kind = space, view, kind
        self.entries = space.resources.entries
        owned = {item.component for item in self.entries}
        self.threads = [
            number for number, item in enumerate(space.components) if item.category == "thread" and number not in owned
        ]

    @cached_property
    def parts(self) -> dict[int, list[int]]:
        """The items within each entry."""
        by_resource: dict[int, list[int]] = {}
        for number, item in enumerate(self.entries):
            if item.within is not None:
                by_resource.setdefault(item.within, []).append(number)
        return by_resource

    @cached_property
    def roots(self) -> list[int]:
        """The items that are within no entry."""
        inner = [number for number, item in enumerate(self.entries) if item.within is None]
        return inner + [len(self.entries) + number for number in range(len(self.threads))]

    def entry(self, item: int) -> Budgeted | None:
        """The entry that an item is; None for a thread without one."""
        return self.entries[item] if item < len(self.entries) else None

    def component(self, item: int) -> int | None:
        """The index of the thread or device that an item is."""
        entry = self.entry(item)
        return self.threads[item - len(self.entries)] if entry is None else entry.component

    def name(self, item: int) -> str:
        """The name of an item."""
        entry = self.entry(item)
        return self.space.components[self.threads[item - len(self.entries)]].name if entry is None else entry.name

    def budget(self, item: int) -> Fraction | None:
        """The budget of an item."""
        entry = self.entry(item)
        if entry is None:
            return None
        if self.kind == "speed":
            return entry.speed
        stated = {"memory": (entry.ram, entry.rom), "RAM": (entry.ram,), "ROM": (entry.rom,)}[self.kind]
        return None if set(stated) == {None} else Fraction(sum(size or 0 for size in stated))

    def used(self, item: int) -> Fraction:
        """The need of an item, else the sum of its parts' needs; 0 where none is stated."""
        component = self.component(item)
        if self.kind == "speed" and component is not None and self.space.components[component].category == "thread":
            return self._demand(component, self.entry(item))
        return self._own(self.entry(item)) + sum((self.figure(part) for part in self.parts.get(item, ())), ZERO)

    def figure(self, item: int) -> Fraction:
        """The figure that counts for an item: its need, or its budget where the need is 0."""
        return self.used(item) or self.budget(item) or ZERO

    def _own(self, entry: Budgeted | None) -> Fraction:
        if entry is None or self.kind == "speed":
            return ZERO
        sizes = {"memory": (entry.ram_used, entry.rom_used), "RAM": (entry.ram_used,), "ROM": (entry.rom_used,)}
        return Fraction(sum(sizes[self.kind]))

    def _demand(self, number: int, entry: Budgeted | None) -> Fraction:
        """The need of a thread, in MIPS."""
        component = self.space.components[number]
        period = period_ns(component, self.view)
        if not period:
            return ZERO
        if entry is not None and entry.instructions:
            return entry.instructions * PER_S / Fraction(period)
        execution = at(component.execution_ns, self.view)
        slot = self.processor_of(number)
        if execution is None or slot is None:
            return ZERO
        return Fraction(execution[1]) / Fraction(period) * (self.speed_of(slot) or ZERO)

    def processor_of(self, number: int) -> int | None:
        """The processor that a thread is bound to."""
        component = self.space.components[number]
        slot: int | None = at(component.processor, self.view) if component.bound else None
        return slot

    def speed_of(self, slot: int) -> Fraction | None:
        """The speed of a processor in MIPS."""
        item = self.space.processors[slot]
        return self.space.resources.types.get(item.types[self.view[item.type_decision]])

    def bound_to(self, kind: str, target: int | str) -> list[int]:
        """The outermost items that are bound to a processor (by index), a partition or a memory (by name)."""
        return [item for root in self.roots for item in self._outermost(root, kind, target)]

    def _outermost(self, item: int, kind: str, target: int | str) -> Iterator[int]:
        if self._is_bound(item, kind, target):
            yield item
            return
        for part in self.parts.get(item, ()):
            yield from self._outermost(part, kind, target)

    def _is_bound(self, item: int, kind: str, target: int | str) -> bool:
        entry, component = self.entry(item), self.component(item)
        if kind == "memory":
            return entry is not None and entry.memory == target
        if component is not None:
            partition = self.space.components[component].partition
            there = None if partition is None else partition.name
            return (self.processor_of(component) if kind == "processor" else there) == target
        return entry is not None and (entry.processor if kind == "processor" else entry.partition) == target

    def use(self, item: int) -> BudgetUse:
        """The counted figure of an item, and its budget."""
        return BudgetUse(self.name(item), self.figure(item), self.budget(item))


def _processors(needs: _Needs) -> Iterator[ResourceUse]:
    space, stated = needs.space, needs.space.resources
    speeds: list[Fraction | None] = []
    for number, slot in enumerate(space.processors):
        if slot.types[needs.view[slot.type_decision]] != EMPTY:
            speeds.append(needs.speed_of(number))
            yield _use(needs, slot.name, speeds[-1], needs.bound_to("processor", number))
    for name in _partitions_of(space):
        yield _use(needs, name, stated.partitions.get(name), needs.bound_to("partition", name))
    yield _system(needs, speeds, "processors")


def _partitions_of(space: Space) -> list[str]:
    """The names of the partitions that something is bound to, in order."""
    names = {item.partition.name for item in space.components if item.partition is not None}
    return sorted(names | {item.partition for item in space.resources.entries if item.partition is not None})


def _memories(needs: _Needs) -> Iterator[ResourceUse]:
    sizes = {name: _size(item, needs.kind) for name, item in needs.space.resources.memories.items()}
    for name, size in sizes.items():
        if size:
            yield _use(needs, name, size, needs.bound_to("memory", name))
    yield _system(needs, list(sizes.values()), "memories")


def _size(memory: MemorySizes, kind: Kind) -> Fraction | None:
    size = {"memory": memory.size, "RAM": memory.ram}.get(kind, memory.rom)
    return None if size is None else Fraction(size)


def _use(needs: _Needs, name: str, capacity: Fraction | None, bound: list[int]) -> ResourceUse:
    """The use of one processor, partition or memory by the items that are bound to it."""
    users = tuple(needs.use(item) for item in bound)
    total = sum((item.used for item in users), ZERO)
    return _result(needs, name, capacity, total, users, tuple(_of_bound(needs, name, capacity, total, bound)))


def _of_bound(
    needs: _Needs, name: str, capacity: Fraction | None, total: Fraction, bound: list[int]
) -> Iterator[Finding]:
    if not bound:
        return
    what = needs.kind
    if not capacity:
        severity: Literal["error", "warning"] = "warning" if name in _partitions_of(needs.space) else "error"
        yield Finding(severity, f"{name} has no {what} stated, but something is bound to it")
    if total > (capacity or ZERO):
        if capacity:
            said = f"what is bound to {name} needs {_told(needs, total)}"
            yield Finding("error", f"{said}, more than its {what} of {_told(needs, capacity)}")
    elif not total:
        yield Finding("warning", f"what is bound to {name} states no {what} that it needs")
    counted = [number for item in bound for number in _threads_within(needs, item)]
    other = [needs.space.components[number].name for number in counted if _is_elsewhere(needs, name, number)]
    if needs.kind == "speed" and other:
        text = f"counted for {name} with what they are within, and for what they are bound to: {', '.join(other)}"
        yield Finding("warning", text)


def _threads_within(needs: _Needs, item: int) -> Iterator[int]:
    """The threads and devices that are part of a subsystem."""
    for part in needs.parts.get(item, ()):
        component = needs.component(part)
        if component is not None:
            yield component
        yield from _threads_within(needs, part)


def _is_elsewhere(needs: _Needs, name: str, number: int) -> bool:
    slot = needs.processor_of(number)
    partition = needs.space.components[number].partition
    here = {None if slot is None else needs.space.processors[slot].name, None if partition is None else partition.name}
    return slot is not None and name not in here


def _system(needs: _Needs, capacities: list[Fraction | None], what: str) -> ResourceUse:
    """Everything against what there is altogether, bound or not; and each budget against what its owner needs."""
    capacity = sum((item or ZERO for item in capacities), ZERO)
    total = sum((needs.figure(item) for item in needs.roots), ZERO)
    findings: list[Finding] = []
    stated = [item for item in range(len(needs.entries)) if needs.budget(item)]
    users = tuple(BudgetUse(needs.name(item), needs.used(item), needs.budget(item)) for item in stated)
    for item in users:
        if item.used > (item.budget or ZERO):
            said = f"{item.name} needs {_told(needs, item.used)}, more than its {needs.kind} budget of"
            findings.append(Finding("error", f"{said} {_told(needs, item.budget or ZERO)}"))
    if total > capacity:
        of = "" if needs.kind == "speed" else f" of {needs.kind}"
        said = f"all together need {_told(needs, total)}{of}, the {what} have {_told(needs, capacity)}"
        findings.append(Finding("error", said))
    having = sum(1 for item in capacities if item)
    if having < len(capacities):
        findings.append(Finding("warning", f"{having} of {len(capacities)} {what} state their {needs.kind}"))
    return _result(needs, "system", capacity, total, users, tuple(findings))


def _result(
    needs: _Needs,
    name: str,
    capacity: Fraction | None,
    total: Fraction,
    users: tuple[BudgetUse, ...],
    findings: tuple[Finding, ...],
) -> ResourceUse:
    return ResourceUse(name, needs.kind, "MIPS" if needs.kind == "speed" else "B", capacity, total, users, findings)


def _told(needs: _Needs, value: Fraction) -> str:
    return format_speed(value) if needs.kind == "speed" else f"{format_number(value)} B"
