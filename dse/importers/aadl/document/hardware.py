"""Processors, buses and virtual buses of a model, and the types that they have or may have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import yaml

from dse.importers.aadl.document.values import (
    Span,
    data_rate,
    is_true,
    number_text,
    power_text,
    size_of,
    speed_mips,
    text_of,
    time_range,
    told,
    whole,
)
from dse.importers.aadl.instance.inheritance import Flat
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import CARRIERS, InstanceModel
from dse.importers.aadl.instance.properties import FoundProperty, reference_in, references_in
from dse.importers.aadl.property_set import OURS
from dse.importers.aadl.syntax.tree import Listed, Record, Reference, StringLiteral
from dse.importers.registry import Key, Place

MEDIA = (*CARRIERS, "processor", "virtual processor", "device", "memory", "system", "process", "abstract")
"""Categories to which a connection may be bound: OSATE counts the transmission time and latency of each."""
PERIODIC = ("bus", "virtual bus", "virtual processor", "device", "system", "process", "abstract")
"""The media whose Period samples."""
SPEEDS = (("MIPSCapacity", "SEI"), ("Processor_Capacity", ""))
"""Properties that state the speed of a processor, in the order in which they count."""
OF_PARTITIONS = (*SPEEDS, ("MIPSBudget", "SEI"))
"""Properties that state the share of a processor that a virtual processor has."""


class Sheet:
    """The fields of one entry as they are found, with where each is from."""

    def __init__(self, model: InstanceModel, places: dict[Key, Place], key: Key) -> None:
        self.model = model
        self.places = places
        self.key = key
        self.fields: dict[str, Any] = {}
        self.sources: list[str] = []
        self.bases: dict[str, Instance] = {}

    def put(self, name: str, stated: FoundProperty | None, value: Any) -> None:
        """A field, where there is a value."""
        if stated is None or value is None:
            return
        self.fields[name] = value
        self.places[*self.key, name] = stated.place
        self.sources.append(f"{name} {told(stated)}")
        self.bases[name] = stated.base

    def read(self, name: str, stated: FoundProperty | None, reader: Callable[[Any], Any], what: str) -> Any:
        """A field by its reader; a `Span` gives its text."""
        value = self.model.read(stated, reader, what)
        self.put(name, stated, value.text if isinstance(value, Span) else value)
        return value

    def extra(self, association: FoundProperty | None) -> None:
        """Further fields of ours, ``key: value``, each a text of a list."""
        if association is None:
            return
        items = association.value.items if isinstance(association.value, Listed) else (association.value,)
        for item in items:
            try:
                stated = yaml.safe_load(item.text) if isinstance(item, StringLiteral) else None
            except yaml.YAMLError:
                stated = None
            if not isinstance(stated, dict):
                self.model.library.fail('Extra: expected a list of texts "key: value"', association.place)
                return
            self.fields |= {str(key): value for key, value in stated.items()}
            for key in stated:
                self.places[*self.key, str(key)] = association.place

    def result(self) -> dict[str, Any]:
        """The fields, and ``source``."""
        return {**self.fields, "source": ", ".join(self.sources)} if self.sources else dict(self.fields)


class HardwareWriter:
    """Writes processor types, bus types, processors and buses."""

    def __init__(
        self, model: InstanceModel, places: dict[Key, Place], choices: Mapping[str, Mapping[str, list[str]]]
    ) -> None:
        self.model = model
        self.places = places
        self.choices = choices
        self.clocks: dict[str, dict[str, Any]] = {}
        self.required: dict[str, str] = {}
        self.types: dict[str, dict[str, dict[str, Any]]] = {"processor_types": {}, "bus_types": {}}
        self.type_flats: dict[str, Flat | None] = {}
        self.slots: dict[str, dict[str, dict[str, Any]]] = {"processors": {}, "buses": {}}
        for item in model.root.below():
            if item.category == "processor":
                self._slot("processors", item)
            elif item.category in CARRIERS:
                self._slot("buses", item)

    def sections(self) -> dict[str, dict[str, Any]]:
        """The sections of the document."""
        return {**self.types, "clocks": self.clocks, **self.slots}

    def mips(self, type_name: str) -> Any:
        """The speed of a processor type in MIPS, or None."""
        flat = self.type_flats.get(type_name)
        return None if flat is None else self.speed(self.standing(flat))

    def speed(self, component: Instance) -> Any:
        """The speed of a processor in MIPS, or None."""
        return self._stated_speed(component, *SPEEDS)[1]

    def reference_speed(self, component: Instance) -> Any:
        """The speed in MIPS of the processor for which the execution times of a component are stated, or None."""
        reference = self.model.properties.of(component, "Reference_Processor")
        named = reference_in(reference.value) if reference is not None else None
        classifier = self.model.library.find(named, reference.package) if named is not None and reference else None
        return None if classifier is None else self.speed(self.standing(self.model.flattener.flat(classifier)))

    def _stated_speed(self, component: Instance, *names: tuple[str, str]) -> tuple[FoundProperty | None, Any]:
        """The first of these properties that gives a speed, and that in MIPS."""
        for name, group in names:
            speed = self.model.properties.of(component, name, group)
            value = self.model.read(speed, speed_mips, name)
            if value:
                return speed, value
        return None, None

    def put_speed(self, sheet: Sheet, component: Instance, *names: tuple[str, str]) -> None:
        """``speed``, by the first of these properties."""
        speed, value = self._stated_speed(component, *names)
        sheet.put("speed", speed, f"{number_text(value)} MIPS" if value else None)

    def standing(self, flat: Flat) -> Instance:
        """A component of a classifier that stands by itself: for what the classifier alone says."""
        item = flat.classifier
        return Instance(item.name, item.category, flat, None, None, item.place)

    def classifier(self, name: str, categories: tuple[str, ...]) -> Flat | None:
        """The classifier that a file beside the model names; None where there is none of these categories."""
        package, _, own = name.rpartition("::")
        place = self.model.root.place
        packages = [package] if package else [item.name for item in self.model.library.packages.values()]
        classifiers = [
            item for one in packages
            if (item := self.model.library.find(Reference(one, own, place), one)) is not None
            and item.category in categories
        ]  # fmt: skip
        unique = list(dict.fromkeys(classifiers))
        return self.model.flattener.flat(unique[0]) if len(unique) == 1 else None

    def _slot(self, section: str, component: Instance) -> None:
        name = self.model.name(component)
        key = (section, name)
        self.places[key] = component.place
        wanted = self.choices.get(section, {}).get(name)
        types = [self._type_of(section, component)]
        for one in wanted or ():
            flat = self.classifier(one, (component.category, "abstract"))
            if flat is not None:
                self._type(section, one, self.standing(flat), flat)
        if self.model.is_marked(component, "By_Type") and types[0] == name:
            return
        slot = Sheet(self.model, self.places, key)
        if component.category == "processor":
            self.clocked(slot, component)
        else:
            budget = self.model.properties.of(component, "BandWidthBudget", "SEI")
            span = self.model.read(budget, data_rate, "BandWidthBudget")
            slot.put("budget", budget, span.text if span is not None and span.low > 0 else None)
        slot.extra(self.model.properties.of(component, "Slot", OURS))
        sheet: dict[str, Any] = {"type": types[0], **slot.fields}
        self.slots[section][name] = sheet
        if component.category == "virtual bus":
            sheet |= self.bound_to(self.carriers(component))

    def bound_to(self, carriers: list[Instance]) -> dict[str, Any]:
        """``bus``, and ``further_buses`` where it is bound to several at once."""
        names = [self.medium(item) for item in carriers]
        bound: dict[str, Any] = {"bus": names[0]} if names else {}
        return bound | ({"further_buses": names[1:]} if names[1:] else {})

    def medium(self, component: Instance) -> str:
        """The name of the bus that a component is; one of another category is written as one that carries messages."""
        name = self.model.medium_name(component)
        if component.category not in CARRIERS and name not in self.slots["buses"]:
            self.places["buses", name] = component.place
            self.slots["buses"][name] = {"type": name}
            self.types["bus_types"][name] = self._bus_type(component, name)
            self.type_flats[name] = None
            self.places["bus_types", name] = component.place
        return name

    def carriers(self, component: Instance) -> list[Instance]:
        """The components that a virtual bus is bound to, or the bus that contains it."""
        bound = self.model.targets(self.model.properties.of(component, "Actual_Connection_Binding"))
        media = [item for item in bound if item.category in MEDIA and item is not component]
        around = component.parent
        if not media and around is not None and around.category in CARRIERS:
            media = [around]
        return media

    def protocols(self, value: FoundProperty | None) -> list[str]:
        """The names of the types of virtual buses that a Required_Virtual_Bus_Class lists."""
        names = []
        for reference in [] if value is None else references_in(value.value):
            classifier = self.model.library.find(reference, value.package) if value is not None else None
            if classifier is None or classifier.category != "virtual bus":
                text = f"Required_Virtual_Bus_Class: {reference.name} is no virtual bus that is known: not looked at"
                self.model.library.remark(text, reference.place)
                continue
            flat = self.model.flattener.flat(classifier)
            names.append(self._protocol(flat))
        return names

    def _protocol(self, flat: Flat) -> str:
        """The type that messages are wrapped in by a classifier alone."""
        stated = self.model.properties.of(self.standing(flat), "Type_Name", OURS)
        own = f"{flat.title} as a protocol"
        name = self.required.setdefault(flat.title, self.model.read(stated, text_of, "Type_Name") or own)
        known = self.types["bus_types"].get(name)
        if known is None or (
            self.type_flats.get(name) is not flat and known != self._bus_type(self.standing(flat), name)
        ):
            name = self.required[flat.title] = name if known is None else own
            self.places["bus_types", name] = flat.classifier.place
            self.types["bus_types"][name] = {}
            self.types["bus_types"][name] = self._bus_type(self.standing(flat), name)
            self.type_flats[name] = flat
        return name

    def _type_of(self, section: str, component: Instance) -> str:
        """The name of the type of a component: its classifier's, or its own where its figures are its own."""
        flat = component.flat
        own = self.model.name(component)
        wanted = flat.classifier.name if flat is not None else own
        if flat is not None:
            stated = self.model.properties.of(self.standing(flat), "Type_Name", OURS)
            wanted = self.model.read(stated, text_of, "Type_Name") or wanted
        for name in dict.fromkeys((wanted, flat.title if flat is not None else own, f"{own} type")):
            if self._type(section, name, component, flat):
                return name
        raise AssertionError("a type named by its component is its own")

    def _type(self, section: str, name: str, component: Instance, flat: Flat | None) -> bool:
        """Note a type; whether there is none of that name with other figures."""
        catalogue = "processor_types" if section == "processors" else "bus_types"
        entry = self._processor_type(component, name) if section == "processors" else self._bus_type(component, name)
        there = self.types[catalogue].setdefault(name, entry)
        if there is entry:
            self.type_flats[name] = flat
            self.places.setdefault((catalogue, name), flat.classifier.place if flat else component.place)
        return {**there, "source": ""} == {**entry, "source": ""}

    def _processor_type(self, component: Instance, name: str) -> dict[str, Any]:
        sheet = Sheet(self.model, self.places, ("processor_types", name))
        self.priced(sheet, component)
        sheet.read("cores", self.model.properties.of(component, "Cores", OURS), whole, "Cores")
        self.put_speed(sheet, component, *SPEEDS)
        sheet.extra(self.model.properties.of(component, "Extra", OURS))
        return sheet.result()

    def clocked(self, sheet: Sheet, component: Instance) -> None:
        """The clock that a processor or device runs by: what its Reference_Time refers to."""
        clock = self.model.properties.of(component, "Reference_Time")
        for target in self.model.targets(clock)[:1]:
            name = self.model.name(target) or self.model.root.name
            self.clocks.setdefault(name, {})
            sheet.put("clock", clock, name)

    def priced(self, sheet: Sheet, component: Instance) -> None:
        """Price and power: ours, or SEI's budget."""
        properties = self.model.properties
        sheet.read("price", properties.of(component, "Price", OURS), text_of, "Price")
        power = properties.of(component, "Power", OURS)
        if power is not None:
            sheet.read("power", power, text_of, "Power")
        else:
            sheet.read("power", properties.of(component, "PowerBudget", "SEI"), power_text, "PowerBudget")

    def _bus_type(self, component: Instance, name: str) -> dict[str, Any]:
        sheet = Sheet(self.model, self.places, ("bus_types", name))
        properties = self.model.properties
        is_carrier = component.category in CARRIERS
        if component.category == "virtual bus":
            sheet.fields["virtual"] = True
            required = properties.of(component, "Required_Virtual_Bus_Class")
            sheet.put("protocols", required, self.protocols(required) or None)
        bandwidth = properties.of(component, "BandWidthCapacity", "SEI")
        span = self.model.read(bandwidth, data_rate, "BandWidthCapacity")
        if is_carrier and span is not None and span.low > 0:
            sheet.put("bandwidth", bandwidth, span.text)
        transmission = properties.of(component, "Transmission_Time")
        self._transmission(sheet, transmission)
        sheet.read("latency", properties.of(component, "Latency"), time_range, "Latency")
        period = properties.of(component, "Period") if component.category in PERIODIC else None
        span = self.model.read(period, time_range, "Period")
        sheet.put("period", period, span.text if span is not None and span.high > 0 else None)
        overhead = properties.of(component, "Data_Size")
        if overhead is None and not is_carrier:  # OSATE does not look for it at buses
            overhead = properties.of(component, "Source_Data_Size")
        sheet.read("overhead", overhead, size_of, "Data_Size")
        if not is_carrier:
            return sheet.result()
        sheet.read("exclusive", properties.of(component, "Exclusive", OURS), is_true, "Exclusive")
        if self.broadcasts(component):
            sheet.put("broadcast", properties.of(component, "Broadcast_Protocol", "SEI"), True)
        self.priced(sheet, component)
        sheet.extra(properties.of(component, "Extra", OURS))
        return sheet.result()

    def broadcasts(self, component: Instance) -> bool:
        """Whether a bus or virtual bus carries what leaves one port once for all receivers."""
        protocol = self.model.properties.of(component, "Broadcast_Protocol", "SEI")
        return component.category in CARRIERS and protocol is not None and is_true(protocol.value)

    def _transmission(self, sheet: Sheet, time: FoundProperty | None) -> None:
        """``[Fixed => …; PerByte => …;]``; a time of 0 or less is none for OSATE."""
        if time is None:
            return
        if not isinstance(time.value, Record):
            self.model.library.fail("Transmission_Time: expected [Fixed => …; PerByte => …;]", time.place)
            return
        parts = {}
        for name, field in (("fixed", "fixed"), ("per_byte", "perbyte")):
            value = time.value.get(field)
            if value is None:
                continue
            inner = FoundProperty(value, time.place, time.base, time.package, time.via)
            span = self.model.read(inner, time_range, f"Transmission_Time, {field}")
            if span is None:
                continue
            if span.low < 0:
                self.model.library.remark("a negative transmission time is read as 0", time.place)
                continue
            if span.high > 0:
                parts[name] = span.text
        if parts:
            sheet.put("transmission_time", time, parts)

    def budgets(self) -> list[str]:
        """A requirement for each bus whose bandwidth has a budget."""
        budgets = []
        for item in self.model.root.below():
            if item.category in CARRIERS:
                budget = self.model.properties.of(item, "BandWidthBudget", "SEI")
                span = self.model.read(budget, data_rate, "BandWidthBudget")
                if span is not None and span.low > 0:
                    budgets.append(f'load of "{self.model.name(item)}" <= {span.text}')
        return budgets
