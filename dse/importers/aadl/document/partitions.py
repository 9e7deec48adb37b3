"""Virtual processors as partitions in time: their frame, and the window that a schedule gives them."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from dse.importers.aadl.document.hardware import OF_PARTITIONS, HardwareWriter, Sheet
from dse.importers.aadl.document.values import Span, number_text, time_range
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import InstanceModel
from dse.importers.aadl.instance.properties import FoundProperty
from dse.importers.aadl.syntax.tree import Listed, Record
from dse.importers.registry import Key, Place

MODULES = ("processor", "abstract")
"""Categories from which a virtual processor has its frame and its windows."""


class PartitionWriter:
    """Writes the section ``partitions``: the virtual processors that something is bound to."""

    def __init__(self, model: InstanceModel, places: dict[Key, Place], hardware: HardwareWriter) -> None:
        self.model = model
        self.hardware = hardware
        self.places = places
        self.entries: dict[str, dict[str, Any]] = {}

    def named(self, partition: Instance) -> str:
        """The name of a partition, which is written where it is not yet."""
        name = self.model.name(partition)
        if name not in self.entries:
            self.entries[name] = {}
            self.places["partitions", name] = partition.place
            self.entries[name] = self._entry(Sheet(self.model, self.places, ("partitions", name)), partition)
        return name

    def _entry(self, sheet: Sheet, partition: Instance) -> dict[str, Any]:
        """The major frame of the module, else the partition's own Period; its window, else its Execution_Time."""
        module = self._module(partition)
        stated = [(partition, "Period", ""), (partition, "Module_Major_Frame", "ARINC653")]
        if module is not None:
            stated.insert(0, (module, "Module_Major_Frame", "ARINC653"))
        frame: Span | None = None
        for component, name, group in stated:
            value = self.model.properties.of(component, name, group)
            frame = self.model.read(value, time_range, name)
            if frame is not None and frame.high > 0:
                sheet.put("period", value, frame.text)
                break
        schedule = None if module is None else self.model.properties.of(module, "Module_Schedule", "ARINC653")
        windows = self._windows(schedule)
        if schedule is None or not windows:
            value = self.model.properties.of(partition, "Execution_Time")
            span = self.model.read(value, time_range, "Execution_Time")
            sheet.put("duration", value, _positive(None if span is None else span.high))
        else:
            self._scheduled(sheet, partition, schedule, windows)
        self.hardware.put_speed(sheet, partition, *OF_PARTITIONS)
        return sheet.result()

    def _module(self, partition: Instance) -> Instance | None:
        """The first processor that a partition is bound to, else the one around it; no virtual processor."""
        bound = self.model.targets(self.model.properties.of(partition, "Actual_Processor_Binding"))
        module = next((item for item in bound if item is not partition), partition.parent)
        return module if module is not None and module.category in MODULES else None

    def _windows(self, schedule: FoundProperty | None) -> list[tuple[list[Instance], Fraction]]:
        """The windows that are of a partition, in order, each with its length in ns."""
        if schedule is None:
            return []
        records = schedule.value.items if isinstance(schedule.value, Listed) else (schedule.value,)
        windows = []
        for record in records:
            partition = record.get("partition") if isinstance(record, Record) else None
            if not isinstance(record, Record) or partition is None:
                continue
            length = record.get("duration")
            read = [] if length is None else [self._inner(schedule, length)]
            spans = [self.model.read(item, time_range, "Module_Schedule, Duration") for item in read]
            targets = self.model.targets(self._inner(schedule, partition))
            windows.append((targets, sum((span.high for span in spans if span is not None), Fraction(0))))
        return windows

    def _inner(self, schedule: FoundProperty, value: Any) -> FoundProperty:
        return FoundProperty(value, schedule.place, schedule.base, schedule.package, schedule.via)

    def _scheduled(
        self, sheet: Sheet, partition: Instance, schedule: FoundProperty, windows: list[tuple[list[Instance], Fraction]]
    ) -> None:
        """The first window of a partition, which begins when those before it end."""
        start = Fraction(0)
        for targets, length in windows:
            if partition in targets:
                sheet.put("offset", schedule, _positive(start))
                sheet.put("duration", schedule, _positive(length))
                return
            start += length
        message = f"{partition.title} is not in this schedule: no window of it is known"
        self.model.library.remark(message, schedule.place)


def _positive(time_ns: Fraction | None) -> str | None:
    """A time as text, where it is above 0."""
    return f"{number_text(time_ns)} ns" if time_ns else None
