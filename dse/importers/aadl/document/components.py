"""Threads, devices and whatever else a flow leads through: their figures, and what they run on."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any

from dse.importers.aadl.document.hardware import HardwareWriter, Sheet
from dse.importers.aadl.document.partitions import PartitionWriter
from dse.importers.aadl.document.values import (
    Span,
    first_number,
    number_text,
    plain_range,
    shown_place,
    text_of,
    time_range,
    whole,
    word,
)
from dse.importers.aadl.instance.flows import EndToEnd, Stop
from dse.importers.aadl.instance.inheritance import Flat
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import InstanceModel
from dse.importers.aadl.instance.properties import FoundProperty
from dse.importers.aadl.property_set import OURS
from dse.importers.aadl.syntax.tree import Path
from dse.importers.registry import STORED_PORTS, Key, Place

EXECUTING = ("thread", "device", "subprogram", "abstract")
"""Categories that OSATE reads execution times of."""
PERIODIC = (*EXECUTING[:2], "abstract", "thread group", "process", "system", "virtual processor", "virtual bus")
"""Categories that have a Period."""
DISPATCHED = ("thread", "device", "abstract")
"""Categories whose Dispatch_Protocol counts."""
LATENT = ("bus", "virtual bus", "device", "processor", "virtual processor", "system", "memory", "abstract")
"""Categories whose own Latency counts where a flow names no flow specification."""
OF_PARAMETERS = ("Integer_Range", "Real_Range", "Measurement_Unit", "Initial_Value")
TAKEN = frozenset(
    ("period", "deadline", "priority", "core", "offset", "type", "processor", "latency", "price", "power")
)
"""Names that a parameter of a thread cannot have, for its fields have them."""
_UNIT = re.compile(r"[A-Za-zµ%°][^\s,]*")
EVENTS = ("event port", "event data port")
TIMES = (("compute_execution_time", "Compute_Execution_Time", ""), ("response_time", "Response_Time", "SEI"))
PROTOCOLS = {"periodic": "periodic", "sporadic": "sporadic", "aperiodic": "aperiodic", "timed": "aperiodic",
             "hybrid": "hybrid"}  # fmt: skip


class ComponentWriter:
    """Writes devices and threads, and the types that a file beside the model offers for them."""

    def __init__(
        self,
        model: InstanceModel,
        places: dict[Key, Place],
        choices: Mapping[str, Mapping[str, list[str]]],
        hardware: HardwareWriter,
    ) -> None:
        self.model = model
        self.places = places
        self.choices = choices
        self.hardware = hardware
        self.partitions = PartitionWriter(model, places, hardware)
        self._latencies: dict[Instance, str] = {}
        self._runs_on: dict[Instance, Instance] = {}

    def name(self, component: Instance) -> str:
        """The name of a component in the problem file."""
        return self.model.end_name(component)

    def sections(self, used: list[Instance], flows: list[EndToEnd]) -> dict[str, dict[str, Any]]:
        """The sections ``partitions``, ``device_types``, ``thread_types``, ``devices`` and ``threads``."""
        sections: dict[str, dict[str, Any]] = {
            name: {} for name in ("device_types", "thread_types", "devices", "threads")
        }
        stops: dict[Instance, list[Stop]] = {}
        for flow in flows:
            for step in flow.steps:
                if isinstance(step, Stop):
                    stops.setdefault(step.component, []).append(step)
        for component in sorted(used, key=self._position):
            section = "devices" if component.category == "device" else "threads"
            name = self.name(component)
            self.places[section, name] = component.place
            sheet = self._sheet((section, name), component, stops.get(component, []))
            offered = self.choices.get(section, {}).get(name, [])
            flats = {one: self.hardware.classifier(one, (component.category,)) for one in offered}
            known = {one: flat for one, flat in flats.items() if flat is not None}
            for one, flat in known.items():
                entry = self._sheet((f"{section[:-1]}_types", one), self.hardware.standing(flat), [])
                sections[f"{section[:-1]}_types"].setdefault(one, _as_type(entry.result()))
            if known:
                for field, base in sheet.bases.items():
                    if base is component:
                        sheet.fields.pop(field, None)
            sections[section][name] = sheet.result()
        return {"partitions": self.partitions.entries, **sections}

    def _position(self, component: Instance) -> int:
        """The place of a component among all, where an export states it."""
        position = self.model.properties.of(component, "Position", OURS)
        value = self.model.read(position, whole, "Position")
        return value if isinstance(value, int) else 0

    def _sheet(self, key: Key, component: Instance, stops: list[Stop]) -> Sheet:
        sheet = Sheet(self.model, self.places, key)
        category = component.category
        if category != ("device" if key[0] in ("devices", "device_types") else "thread"):
            sheet.fields["category"] = category.replace(" ", "_")
        processor = self._processor(sheet, component)
        self._dispatch(sheet, component)
        if category in EXECUTING:
            self._executing(sheet, component, processor)
        self._latency(sheet, component, stops)
        deadline = self.model.properties.of(component, "Deadline")
        span = self.model.read(deadline, time_range, "Deadline") if category in PERIODIC else None
        if span is not None:
            sheet.put("deadline", deadline, span.text)
        if span is not None and not span.high and deadline is not None:
            text = "the Deadline of {} is 0: OSATE takes it in place of execution times"
            self.model.library.remark(text, deadline.place, about=component.title or component.name)
        if category == "thread":
            sheet.read("priority", self.model.properties.of(component, "Priority"), whole, "Priority")
            self._parameters(sheet, component)
        if category == "device":
            self.hardware.clocked(sheet, component)
        self.hardware.priced(sheet, component)
        sheet.extra(self.model.properties.of(component, "Extra", OURS))
        return sheet

    def _parameters(self, sheet: Sheet, thread: Instance) -> None:
        """Data of a thread with a range or an initial value (AADL's Data_Model): its parameters."""
        parameters: dict[str, Any] = {}
        for data in (item for item in thread.below() if item.category == "data"):
            stated = {key: self.model.properties.of(data, key, "Data_Model") for key in OF_PARAMETERS}
            places = [item.place for item in stated.values() if item is not None]
            entry = self._parameter(stated)
            if entry:
                name = data.name
                if name.lower() in TAKEN or name in parameters:
                    name = "_".join(data.path[-2:])
                parameters[name] = {**entry, "source": shown_place(places[0])}
            elif places:
                text = "{} is no parameter here: it has no range of numbers, and no number as its value"
                self.model.library.remark(text, places[0], about=data.title)
        if parameters:
            sheet.fields["parameters"] = parameters

    def _parameter(self, stated: Mapping[str, FoundProperty | None]) -> dict[str, str]:
        """The range and the value of a parameter, as far as both are numbers and the value is within the range."""
        unit = self.model.read(stated["Measurement_Unit"], text_of, "Measurement_Unit") or ""
        unit = unit if _UNIT.fullmatch(unit) else ""
        value = self.model.read(stated["Initial_Value"], first_number, "Initial_Value")
        entry: dict[str, str] = {}
        for key in ("Integer_Range", "Real_Range"):
            ends = self.model.read(stated[key], plain_range, key)
            initial = stated["Initial_Value"]
            if ends is not None:
                entry["range"] = " .. ".join(f"{number_text(end)} {unit}".strip() for end in ends)
            if ends is not None and value is not None and initial is not None and not ends[0] <= value <= ends[1]:
                self.model.library.remark("an Initial_Value beyond its range: it is left out", initial.place)
                value = None
        if value is not None:
            entry["value"] = f"{number_text(value)} {unit}".strip()
        return entry

    def _dispatch(self, sheet: Sheet, component: Instance) -> None:
        """Period and dispatch protocol, as OSATE looks at them."""
        properties, category = self.model.properties, component.category
        stated_period = properties.of(component, "Period") if category in PERIODIC else None
        period = self.model.read(stated_period, time_range, "Period")
        has_period = period is not None and period.high > 0
        stated = properties.of(component, "Dispatch_Protocol") if category in DISPATCHED else None
        protocol = self.model.read(stated, word, "Dispatch_Protocol")
        known = PROTOCOLS.get(protocol or "")
        if protocol == "timed" and stated is not None:
            text = "Timed is read as Aperiodic: what its time-out dispatches is not counted"
            self.model.library.remark(text, stated.place)
        if known in ("periodic", "hybrid", "sporadic") and not has_period and stated is not None:
            text = f"{{}} is {protocol} and has no Period: read as Aperiodic"
            self.model.library.remark(text, stated.place, about=component.title or component.name)
            known = "aperiodic" if known == "sporadic" else None
        if protocol is not None and stated is not None and known is not None:
            sheet.put("dispatch_protocol", stated, known)
        if has_period and period is not None:
            sheet.put("period", stated_period, period.text)
        if category == "thread":
            self._offset(sheet, component, is_timed=has_period and known in (None, "periodic", "hybrid"))

    def _offset(self, sheet: Sheet, component: Instance, *, is_timed: bool) -> None:
        """When it is first released, on the clock of its processor."""
        stated = self.model.properties.of(component, "Dispatch_Offset")
        offset = self.model.read(stated, time_range, "Dispatch_Offset")
        if stated is None or offset is None:
            return
        if is_timed and "processor" in sheet.fields:
            sheet.put("offset", stated, offset.text)
            return
        name = component.title or component.name
        why = "is bound to no processor, whose clock it would be on" if is_timed else "is released by no timer"
        self.model.library.remark(f"Dispatch_Offset of {{}}, which {why}: not looked at", stated.place, about=name)

    def _processor(self, sheet: Sheet, component: Instance) -> Instance | None:
        """The processor that it runs on; through a virtual one where it is bound to that."""
        binding = self.model.properties.of(component, "Actual_Processor_Binding")
        bound = self.model.targets(binding)
        if not bound or binding is None:
            return None
        virtual = next((item for item in bound if item.category == "virtual processor"), None)
        if virtual is not None:
            sheet.put("partition", binding, self.partitions.named(virtual))
        is_device = component.category == "device"  # it runs on itself: a processor scales its times and no more
        if len(bound) > 1 and not is_device:
            self.model.library.remark("bound to several processors: only the first is looked at", binding.place)
        processor = self.model.physical(bound[0])
        if processor is None:
            if not is_device:
                self.model.library.remark("{} runs on no processor", binding.place, about=bound[0].title)
            return None
        self._runs_on[component] = processor
        if is_device:
            return None
        sheet.put("processor", binding, self.model.name(processor))
        return processor

    def _executing(self, sheet: Sheet, component: Instance, processor: Instance | None) -> None:
        """Execution and response times; by processor type where they differ."""
        properties, is_device = self.model.properties, component.category == "device"
        for field, name, group in (
            *TIMES,
            ("callback_execution_time", "Callback_Execution_Time", OURS),
        ):
            time = properties.of(component, name, group)
            span = self.model.read(time, time_range, name)
            by_type = self._by_type(component, name, group, processor)
            if len(set(by_type.values())) > 1 and len(self.hardware.types["processor_types"]) > 1:
                first = next(iter(self._stated(component, name, group)), time)
                sheet.put(field, first, by_type)
            elif by_type and processor is not None:
                mine = by_type.get(self._type_name(processor)) or next(iter(by_type.values()))
                sheet.put(field, next(iter(self._stated(component, name, group)), time), mine)
            elif span is not None and span.high > 0:
                sheet.put(field, time, self._of_device(component, span) if is_device else span.text)

    def _of_device(self, component: Instance, span: Span) -> str:
        """A time of a device, scaled to the processor that it is bound to, if any."""
        processor = self._runs_on.get(component)
        if processor is None:
            return span.text
        name, there = self._type_name(processor), self.model.name(processor)
        scaled = self._scaled(span, component, name, self.hardware.type_flats.get(name))
        if scaled != span.text and len(self.choices.get("processors", {}).get(there, ())) > 1:
            text = f"the times of {{}} are scaled to the type {name} of {there}, whichever is chosen"
            self.model.library.remark(text, component.place, about=component.title)
        return scaled

    def _stated(self, component: Instance, name: str, group: str) -> list[FoundProperty]:
        """The values on the processor types of the problem."""
        flats = self.hardware.type_flats.values()
        values = [self.model.properties.of(component, name, group, flat) for flat in flats]
        return [item for item in values if item is not None]

    def _type_name(self, processor: Instance) -> str:
        name: str = self.hardware.slots["processors"][self.model.name(processor)]["type"]
        return name

    def _by_type(self, component: Instance, name: str, group: str, processor: Instance | None) -> dict[str, str]:
        """A time on each processor type: stated ``in binding``, or scaled from the reference processor's speed."""
        if processor is None:
            return {}
        by_type: dict[str, str] = {}
        for type_name in self.hardware.types["processor_types"]:
            flat = self.hardware.type_flats.get(type_name)
            value = self.model.properties.of(component, name, group, flat)
            span = self.model.read(value, time_range, name)
            if span is None or span.high <= 0:
                continue
            by_type[type_name] = self._scaled(span, component, type_name, flat)
        return by_type

    def _scaled(self, span: Span, component: Instance, type_name: str, flat: Flat | None) -> str:
        """By (MIPS of the reference processor) / (MIPS of the type), in whole ns, pessimistically rounded."""
        own = self.hardware.reference_speed(component)
        there = self.hardware.mips(type_name) if own else None
        if not own or not there or own == there:
            return span.text
        factor = Fraction(own) / Fraction(there)
        low, high = span.low * factor // 1, -(-span.high * factor // 1)
        return f"{number_text(Fraction(low))} ns .. {number_text(Fraction(high))} ns"

    def _latency(self, sheet: Sheet, component: Instance, stops: list[Stop]) -> None:
        """The specified latency of the first flow specification that leads through it, else its own."""
        for stop in stops:
            latency, span = self._specified(stop)
            if span is not None:
                sheet.put("latency", latency, span.text)
                self._latencies[component] = span.text
                return

    def _specified(self, stop: Stop) -> tuple[FoundProperty | None, Span | None]:
        """The Latency of the flow specification of a stop, else of the component."""
        properties, latency = self.model.properties, None
        if stop.spec is not None:
            latency = properties.of_member(stop.component, stop.spec, "Latency")
        elif stop.component.category in LATENT:
            latency = properties.of(stop.component, "Latency")
        span = self.model.read(latency, time_range, "Latency")
        return latency, span if span is not None and span.high > 0 else None

    def element(self, stop: Stop) -> str | dict[str, Any]:
        """A component on a flow: its name, with what it has in this flow alone."""
        name = self.name(stop.component)
        fields: dict[str, Any] = {}
        usual = self._latencies.get(stop.component)
        span = self._specified(stop)[1]
        if usual is not None and (span is None or span.text != usual):
            fields["latency"] = "0 ms" if span is None else span.text
        if stop.spec is not None and stop.spec.item.kind in ("path", "sink"):
            fields |= self._entered(stop.component, stop.spec.item.entry)
        return {"element": name, **fields} if fields else name

    def _entered(self, component: Instance, port: Path) -> dict[str, str]:
        """The times that an event or event data port states for what enters by it."""
        leaf = self.model.features.leaf(component, port) if port else None
        if component.category not in EXECUTING or leaf is None or leaf.member.item.kind not in EVENTS:
            return {}
        processor = self._runs_on.get(component)
        type_name = None if processor is None else self._type_name(processor)
        times_of = {}
        for field, name, group in TIMES:
            value = self.model.properties.of_feature(component, port, name, group)
            span = self.model.read(value, time_range, name)
            if span is None or span.high <= 0:
                continue
            flat = self.hardware.type_flats.get(type_name) if type_name is not None else None
            times_of[field] = span.text if type_name is None else self._scaled(span, component, type_name, flat)
        return times_of


def _as_type(entry: dict[str, Any]) -> dict[str, Any]:
    """The fields that a type may have."""
    return {key: value for key, value in entry.items() if key not in ("processor", "priority")}


# Components without a period that would dispatch each other in a cycle: what nothing starts sends nothing.


NO_DATA = "0 B/s"


def broken_cycles(document: Mapping[str, Any]) -> Iterator[str]:
    """The connections that close cycles of event-triggered components, by name.

    For OSATE a component without a Period sends nothing; we let it send at the rate of what triggers it, which a cycle
    has not: so these are to state a rate of 0.
    """
    components = {**document.get("devices", {}), **document.get("threads", {})}
    eager = {
        name
        for name, item in components.items()
        if item.get("dispatch_protocol") in ("aperiodic", "sporadic")
        or ("dispatch_protocol" not in item and "period" not in item)
    }
    following: dict[str, list[tuple[str, str]]] = {name: [] for name in eager}
    for name, item in document.get("connections", {}).items():
        one, other = item.get("from"), item.get("to")
        is_trigger = item.get("port") not in STORED_PORTS and "rate" not in item and "data_rate" not in item
        is_trigger = is_trigger and name in components.get(other, {}).get("dispatch_trigger", [name])
        if one in eager and other in eager and is_trigger:
            following[one].append((name, other))
    done: set[str] = set()
    for start in (name for name in components if name in eager):
        yield from _closing(start, following, done)


def _closing(start: str, following: Mapping[str, list[tuple[str, str]]], done: set[str]) -> Iterator[str]:
    """The connections that lead back to where a walk came through; without recursion, for long chains."""
    if start in done:
        return
    path = {start}
    stack = [(start, iter(following[start]))]
    while stack:
        here, rest = stack[-1]
        for name, other in rest:
            if other in path:
                yield name
            elif other not in done:
                path.add(other)
                stack.append((other, iter(following[other])))
                break
        else:
            stack.pop()
            path.discard(here)
            done.add(here)
