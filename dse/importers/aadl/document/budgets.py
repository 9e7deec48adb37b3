"""Budgets of processors and memories, as OSATE's resource analyses read them: MIPS, RAM and ROM, stated and used."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from math import ceil
from typing import Any

from dse.importers.aadl.document.components import ComponentWriter
from dse.importers.aadl.document.hardware import Sheet
from dse.importers.aadl.document.values import number_text, size_of, speed_mips, time_range
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import InstanceModel
from dse.importers.aadl.instance.properties import FoundProperty
from dse.importers.registry import Key, Place

HARDWARE = ("bus", "virtual bus", "processor", "virtual processor", "memory", "data")
"""Categories that OSATE counts nothing of."""
HOLDING = ("memory", "system", "processor", "virtual processor", "abstract")
"""Categories that may have a size of memory."""
SIZES = (("size", "Memory_Size", ""), ("ram", "RAMCapacity", "SEI"), ("rom", "ROMCapacity", "SEI"))
BUDGETS = (("ram", "RAMBudget"), ("rom", "ROMBudget"))
NS_OF_MIPS = 1000
"""Nanoseconds that an instruction takes at 1 MIPS."""


class BudgetWriter:
    """Writes the sections ``memories`` and ``budgets``, where a model says anything of either."""

    def __init__(self, model: InstanceModel, places: dict[Key, Place], components: ComponentWriter) -> None:
        self.model = model
        self.places = places
        self.components = components
        self.entries: dict[Instance, dict[str, Any]] = {}

    def sections(self, used: Iterable[Instance]) -> dict[str, dict[str, Any]]:
        """The sections; `used` are the components that the problem has as threads and devices."""
        everything = (self.model.root, *self.model.root.below())
        memories = {}
        for item in everything:
            if item.category in HOLDING and (fields := self._memory(item)):
                memories[self._name(item)] = fields
        software = [item for item in everything if not _is_hardware(item)]
        has_memory = bool(memories) or any(self._states(item, "RAMBudget", "ROMBudget") for item in software)
        has_speed = any(self._states(item, "MIPSBudget", "InstructionsPerDispatch") for item in software)
        has_speed |= any(item.category == "processor" and self.components.hardware.speed(item) for item in everything)
        listed = set(used)
        for item in software:
            fields = self._entry(item, item in listed, memories, has_memory=has_memory, has_speed=has_speed)
            if fields or (item in listed and self._around(item) is not None):
                self.entries[item] = fields
        budgets = {self._name(item): self._placed(item, item in listed) for item in self.entries}
        return {"memories": memories, "budgets": budgets}

    def _name(self, item: Instance) -> str:
        if item.parent is None:
            return item.flat.title if item.flat is not None else item.name
        return self.components.name(item) if item.category not in HOLDING else self.model.name(item)

    def _states(self, item: Instance, *names: str) -> bool:
        return any(self.model.properties.of(item, name, "SEI") is not None for name in names)

    def _around(self, item: Instance) -> Instance | None:
        """The nearest component around that has an entry."""
        return next((one for one in item.around() if one in self.entries), None)

    def _memory(self, item: Instance) -> dict[str, Any]:
        sheet = Sheet(self.model, self.places, ("memories", self._name(item)))
        for field, name, group in SIZES:
            self._size(sheet, field, self.model.properties.of(item, name, group), name)
        if sheet.fields:
            self.places["memories", self._name(item)] = item.place
        return sheet.result()

    def _size(self, sheet: Sheet, field: str, value: FoundProperty | None, name: str) -> None:
        span = self.model.read(value, size_of, name)
        sheet.put(field, value, span.text if span is not None and span.high > 0 else None)

    def _entry(
        self, item: Instance, is_listed: bool, memories: dict[str, Any], *, has_memory: bool, has_speed: bool
    ) -> dict[str, Any]:
        """The budgets that a component states, and its own use."""
        sheet = Sheet(self.model, self.places, ("budgets", self._name(item)))
        properties = self.model.properties
        budget = properties.of(item, "MIPSBudget", "SEI")
        speed = self.model.read(budget, speed_mips, "MIPSBudget")
        sheet.put("speed", budget, f"{number_text(speed)} MIPS" if speed else None)
        if has_speed and item.category == "thread" and is_listed:
            self._instructions(sheet, item)
        for field, name in BUDGETS:
            self._size(sheet, field, properties.of(item, name, "SEI"), name)
        if has_memory and item.category not in ("subprogram", "subprogram group"):
            self._sizes_used(sheet, item)
        if not sheet.fields:
            return {}
        bound = self.model.targets(properties.of(item, "Actual_Memory_Binding"))
        named = [self._name(one) for one in bound if self._name(one) in memories]
        sheet.put("memory", properties.of(item, "Actual_Memory_Binding"), named[0] if named else None)
        return sheet.result()

    def _instructions(self, sheet: Sheet, item: Instance) -> None:
        """Of one dispatch: as stated, else what the execution time is on the reference processor."""
        properties = self.model.properties
        stated = properties.of(item, "InstructionsPerDispatch", "SEI")
        count = self.model.read(stated, speed_mips, "InstructionsPerDispatch")
        if count:
            sheet.put("instructions", stated, f"{number_text(count)} IPD")
            return
        execution = properties.of(item, "Compute_Execution_Time")
        span = self.model.read(execution, time_range, "Compute_Execution_Time")
        speed = self.components.hardware.reference_speed(item)
        if speed and span is not None and span.high > 0:
            sheet.put("instructions", execution, f"{number_text(span.high * Fraction(speed) / NS_OF_MIPS)} IPD")

    def _sizes_used(self, sheet: Sheet, item: Instance) -> None:
        """RAM is for data, stack and heap, ROM for code."""
        ram = [self._first_size(item, name) for name in ("Stack_Size", "Heap_Size")]
        data = self._first_size(item, "Data_Size")
        if data[0] is None and (size := self.model.size_of_data(item.flat, item)):
            sheet.fields["ram_used"] = f"{ceil(size)} B"
        total = sum((size for _, size in (data, *ram)), Fraction(0))
        place = next((value for value, _ in (data, *ram) if value is not None), None)
        if place is not None and total:
            stated = sheet.fields.get("ram_used", "0 B").partition(" ")[0]
            sheet.put("ram_used", place, f"{number_text(Fraction(-(-(total + int(stated)) // 1)))} B")
        code, used = self._first_size(item, "Code_Size")
        sheet.put("rom_used", code, f"{number_text(Fraction(-(-used // 1)))} B" if used else None)

    def _first_size(self, item: Instance, name: str) -> tuple[FoundProperty | None, Fraction]:
        """A size in bytes, as stated of the component or of its source text."""
        for one in (name, f"Source_{name}"):
            value = self.model.properties.of(item, one)
            span = self.model.read(value, size_of, one)
            if span is not None:
                return value, span.high
        return None, Fraction(0)

    def _placed(self, item: Instance, is_listed: bool) -> dict[str, Any]:
        """An entry with what it is within, and what a subsystem is bound to."""
        around = self._around(item)
        placed: dict[str, Any] = {} if around is None else {"within": self._name(around)}
        self.places["budgets", self._name(item)] = item.place
        if not is_listed:
            bound = self.model.targets(self.model.properties.of(item, "Actual_Processor_Binding"))
            virtual = next((one for one in bound if one.category == "virtual processor"), None)
            processor = self.model.physical(bound[0]) if bound else None
            placed |= {} if virtual is None else {"partition": self.components.partitions.named(virtual)}
            placed |= {} if processor is None else {"processor": self.model.name(processor)}
        return placed | self.entries[item]


def _is_hardware(item: Instance) -> bool:
    """Whether a component has nothing to do with software: so are leaves whose features are accesses to buses alone."""
    if item.category in HARDWARE:
        return True
    if item.category not in ("system", "device") or item.children or item.parent is None:
        return False
    features = item.flat.features.values() if item.flat is not None else ()
    return all(member.item.kind == "bus access" for member in features)
