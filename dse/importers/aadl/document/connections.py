"""Connections of a problem: their ends, sizes and rates, and the bus that carries them."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from dse.importers.aadl.document.components import DISPATCHED, NO_DATA
from dse.importers.aadl.document.hardware import MEDIA, HardwareWriter, Sheet
from dse.importers.aadl.document.values import (
    data_rate,
    message_rate,
    number_text,
    shown_place,
    size_of,
    size_text,
    text_of,
    time_range,
    whole,
    word,
)
from dse.importers.aadl.instance.connections import ConnectionInstance
from dse.importers.aadl.instance.flows import EndToEnd
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import InstanceModel
from dse.importers.aadl.instance.properties import FoundProperty, paths_in
from dse.importers.aadl.property_set import OURS
from dse.importers.aadl.syntax.predeclared import DATA_RATE_UNITS
from dse.importers.aadl.syntax.tree import Number, Path, Range, Record, Word, without_places
from dse.importers.registry import Key, Place

PORTS = {"event data port": "event_data", "event port": "event", "data port": "data", "feature": "feature",
         "feature group": "feature", "data access": "data_access"}  # fmt: skip
ACCESSES = ("data access", "subprogram access", "subprogram group access", "access")
LINKS = ("port", "feature group", "feature")


def _connections_of(flows: list[EndToEnd]) -> set[ConnectionInstance]:
    """The connections that flows run over."""
    return {step for flow in flows for step in flow.steps if isinstance(step, ConnectionInstance)}


class ConnectionWriter:
    """Writes the section ``connections``."""

    def __init__(self, model: InstanceModel, places: dict[Key, Place], hardware: HardwareWriter) -> None:
        self.model = model
        self.places = places
        self.hardware = hardware
        self._on_flows: set[ConnectionInstance] = set()
        self.names: dict[ConnectionInstance, str] = {}

    def relevant(self, flows: list[EndToEnd]) -> list[ConnectionInstance]:
        """The connections that count: between ports, and whatever a flow runs over, or data are shared one way by."""
        on_flows = _connections_of(flows)
        return [
            item
            for item in self.model.wiring.instances
            if item in on_flows
            or (item.wires[0].member.item.kind in LINKS and not (item.source is None and item.target is None))
            or (item.wires[0].member.item.kind == "data access" and self._goes_one_way(item))
        ]

    def _goes_one_way(self, item: ConnectionInstance) -> bool:
        """Whether access to shared data says that its source writes and its target reads: by Access_Right, or as ours.

        An access connection is an instance in each direction. One that we wrote leads from who provides the data.
        """
        if None in (item.source, item.target):
            return False
        if self.model.read(self._property(item, "Name", OURS), text_of, "Name") is not None:
            leaf = self.model.features.leaf(item.source or self.model.root, item.source_path)
            return leaf is not None and leaf.direction == "provides"
        rights = []
        for component, path in ((item.source, item.source_path), (item.target, item.target_path)):
            right = self.model.properties.of_feature(component or self.model.root, path, "Access_Right")
            rights.append(self.model.read(right, word, "Access_Right") if path else None)
        return rights in ([None, "read_only"], ["write_only", None], ["write_only", "read_only"])

    def _tell_accesses(self, counted: set[ConnectionInstance]) -> None:
        """Remarks on each kind of access that no flow runs over, and on locks of shared data."""
        looked_at = {wire for item in (*counted, *self._told_calls(counted)) for wire in item.wires}
        for item in self.model.wiring.instances:
            for end in (item.source, item.target):
                if end is not None and end.category == "data":
                    self._tell_lock(end)
            kind = item.wires[0].member.item.kind
            if item not in counted and kind in ACCESSES:
                text = f"{kind} connections are not looked at where no flow leads over them"
                text += " and no Access_Right says who reads" if kind == "data access" else ""
                text += ": data that they share cause no waiting, and dispatch no thread"
                for wire in item.wires:
                    if wire in looked_at:
                        continue
                    self.model.library.remark(text, wire.member.item.place)

    def _told_calls(self, counted: set[ConnectionInstance]) -> Iterator[ConnectionInstance]:
        """The accesses to subprograms over which a thread calls what another one provides, each after its remark."""
        for item in self.model.wiring.instances:
            if item in counted or item.source is None or item.target is None:
                continue
            ends = ((item.source, item.source_path, "requires"), (item.target, item.target_path, "provides"))
            features = [(self.model.features.leaf(end, path), is_given) for end, path, is_given in ends]
            is_access = item.wires[0].member.item.kind == "subprogram access"
            if is_access and all(leaf is not None and leaf.direction == is_given for leaf, is_given in features):
                text = f"{{}} calls {item.target.title}: nothing is made of that, as in OSATE; in a file that decides, "
                text += "under profile dse, it is a connection with `from`, `to` and `reply`"
                self.model.library.remark(text, item.wires[0].member.item.place, about=item.source.title)
                yield item

    def _tell_lock(self, data: Instance) -> None:
        """A remark where those that share data lock it: their waiting for each other is blocking, which is stated."""
        stated = self.model.properties.of(data, "Concurrency_Control_Protocol")
        protocol = self.model.read(stated, word, "Concurrency_Control_Protocol")
        if stated is not None and protocol not in (None, "none_specified"):
            text = f"{{}} is shared under {protocol}: that one thread waits while another one has it is not counted, "
            text += "unless the threads state how long they have it as `non_preemptive`"
            self.model.library.remark(text, stated.place, about=data.title)

    def name(self, item: ConnectionInstance) -> str:
        """The name of a connection in the problem file, after the feature that it leaves."""
        return self.names[item]

    def section(self, used: list[Instance], flows: list[EndToEnd]) -> dict[str, Any]:
        """The entries."""
        items = self.relevant(flows)
        self._tell_accesses(set(items))
        self._on_flows = _connections_of(flows)
        leaving: dict[str, int] = {}
        for item in items:
            start = self._spelled(item.source, item.source_path)
            leaving[start] = leaving.get(start, 0) + 1
        connections: dict[str, Any] = {}
        taken = {self.model.name(component) for component in (*used, *self.model.root.below())}
        for item in items:
            start, end = self._spelled(item.source, item.source_path), self._spelled(item.target, item.target_path)
            stated = self.model.read(self._property(item, "Name", OURS), text_of, "Name")
            if stated is not None:
                self.names[item] = stated
                connections[stated] = self._entry(stated, item)
                continue
            name = start if leaving[start] == 1 and start not in taken else f"{start} -> {end}"
            again = 2
            while name in connections or name in taken:
                name, again = f"{start} -> {end} ({again})", again + 1
            self.names[item] = name
            connections[name] = self._entry(name, item)
        return connections

    def _spelled(self, component: Instance | None, path: Path) -> str:
        """A feature in text, with the capitals of its declaration."""
        owner = component if component is not None else self.model.root
        names = list(path)
        leaf = self.model.features.leaf(owner, path)
        if leaf is not None and names:
            names[-1] = leaf.member.item.name + _index(names[-1])
            first = names[0].partition("[")[0]
            if len(names) > 1 and owner.flat is not None and first in owner.flat.features:
                names[0] = owner.flat.features[first].item.name + _index(names[0])
        return ".".join([*owner.path, *names])

    def _entry(self, name: str, item: ConnectionInstance) -> dict[str, Any]:
        sheet = Sheet(self.model, self.places, ("connections", name))
        self.places["connections", name] = item.wires[0].member.item.place
        sheet.sources.append(" ".join(f"{wire.member.item.name} {shown_place(wire.member.item.place)}"
                                      for wire in item.wires[:1]))  # fmt: skip
        if item.source is not None and not self.model.is_boundary(item.source):
            sheet.fields["from"] = self.model.end_name(item.source)
        if item.target is not None and not self.model.is_boundary(item.target):
            sheet.fields["to"] = self.model.end_name(item.target)
        bus = self._bus(sheet, item)
        size = self._size(sheet, item, is_bound=bus is not None)
        self._port(sheet, item)
        self._rate(sheet, item)
        sheet.read("latency", self._property(item, "Latency"), time_range, "Latency")
        budget = self._property(item, "BandWidthBudget", "SEI")
        span = self.model.read(budget, data_rate, "BandWidthBudget")
        sheet.put("budget", budget, span.text if span is not None and span.low > 0 else None)
        target = item.target or self.model.root
        sheet.extra(self.model.properties.of_feature(target, item.target_path, "Extra", OURS))
        sheet.extra(self._property(item, "Extra", OURS))
        if size is not None:
            sheet.fields["data_size"] = size_text(size)
        elif (
            bus is not None
            and "data_size" not in sheet.fields
            and ("data_rate" not in sheet.fields or item in self._on_flows)
        ):
            sheet.fields["data_size"] = "0 B"
            message = f"{{}} has no Data_Size: its messages count as 0 bytes on {bus.title}"
            self.model.library.remark(message, item.wires[0].member.item.place, about=name)
        timing = self._property(item, "Timing")
        kind = self.model.read(timing, word, "Timing")
        if kind in ("immediate", "delayed"):
            sheet.put("timing", timing, kind)
        return sheet.result()

    def _size(self, sheet: Sheet, item: ConnectionInstance, *, is_bound: bool) -> Fraction | None:
        """The size of a message, and that of its data type where the port states another one."""
        own = self.model.port_size(item.source, item.source_path)
        of_type = self.model.type_size(item.source, item.source_path)
        if item.source is not None and item.source.category == "data":
            stated = self.model.read(self.model.properties.of(item.source, "Data_Size"), size_of, "Data_Size")
            of_type = of_type if stated is None else stated.low
        if own is not None and own != (of_type or 0):
            sheet.fields["type_size"] = size_text(of_type or Fraction(0))
        elif is_bound and of_type and not item.source_path:  # data themselves, whose size OSATE's latency leaves out
            sheet.fields["type_size"] = "0 B"
        elif is_bound and own is None and of_type and self.model.is_sum(item.source, item.source_path):
            text = "OSATE's bus load counts nothing of {}, whose data type states no Data_Size"
            text += f": here the sum of its parts, {size_text(of_type)}, counts"
            start = self._spelled(item.source, item.source_path)
            self.model.library.remark(text, item.wires[0].member.item.place, about=start)
        return of_type if own is None else own

    def _property(self, item: ConnectionInstance, name: str, group: str = "") -> FoundProperty | None:
        """A property of the declared connections that it is made of: as in OSATE, of the one nearest to the source."""
        stated = (self.model.properties.of_member(wire.context, wire.member, name, group) for wire in item.wires)
        values = [one for one in stated if one is not None]
        if any(not self._is_same(values[0], other) for other in values[1:]):
            places = ", ".join(dict.fromkeys(shown_place(one.place) for one in values))
            first = shown_place(values[0].place)
            text = f"Value for property {name} not consistent along connection ({places}): that of {first} counts"
            self.model.library.remark(text, values[0].place)
        return values[0] if values else None

    def _is_same(self, one: FoundProperty, other: FoundProperty) -> bool:
        if paths_in(one.value) and paths_in(other.value):
            return self.model.targets(one) == self.model.targets(other)
        return without_places(one.value) == without_places(other.value)

    def _bus(self, sheet: Sheet, item: ConnectionInstance) -> Instance | None:
        """The buses that carry a connection, and the protocols that wrap its messages without a binding."""
        required = self._property(item, "Required_Virtual_Bus_Class")
        sheet.put("protocols", required, self.hardware.protocols(required) or None)
        binding = self._property(item, "Actual_Connection_Binding")
        bound = [one for one in self.model.targets(binding) if one.category in MEDIA]
        for name, value in self.hardware.bound_to(bound).items():
            sheet.put(name, binding, value)
        if any(self.hardware.broadcasts(one) for one in bound):
            sheet.fields["from_port"] = ".".join(item.source_path)
        return bound[0] if bound else None

    def _port(self, sheet: Sheet, item: ConnectionInstance) -> None:
        """The kind of the receiving feature, and its queue where one is stated."""
        target = item.target if item.target is not None else self.model.root
        leaf = self.model.features.leaf(target, item.target_path)
        kind = leaf.member.item.kind if leaf is not None else f"{target.category} access"
        port = PORTS.get(kind, "data")
        if port != "event_data":
            sheet.fields["port"] = port
        if self._has_no_queue(target, port):
            sheet.fields["queue_size"] = 0
        elif port in ("event", "event_data"):
            queue = self.model.properties.of_feature(target, item.target_path, "Queue_Size")
            if queue is None and leaf is not None and len(item.target_path) > 1:
                queue = self.model.properties.of_classifier(leaf.member.properties, target, "Queue_Size")
            sheet.read("queue_size", queue, whole, "Queue_Size")

    def _has_no_queue(self, target: Instance, port: str) -> bool:
        """Whether OSATE counts nothing for what is queued: each waits for a period, of which there is none."""
        stated = self.model.properties.of(target, "Dispatch_Protocol") if target.category in DISPATCHED else None
        protocol = self.model.read(stated, word, "Dispatch_Protocol")
        if protocol != "sporadic" and (protocol != "periodic" or port == "data"):
            return False
        period = self.model.read(self.model.properties.of(target, "Period"), time_range, "Period")
        return period is None or period.high <= 0

    def _rate(self, sheet: Sheet, item: ConnectionInstance) -> None:
        """A stated rate: a data rate, or messages in a second or for each dispatch."""
        source = item.source if item.source is not None else self.model.root
        properties = self.model.properties

        def of(name: str, group: str = "") -> FoundProperty | None:
            return self._property(item, name, group) or properties.of_feature(source, item.source_path, name, group)

        data = of("Data_Rate", "SEI")
        if data is not None and isinstance(data.value, Number) and data.value.unit.lower() in DATA_RATE_UNITS:
            span = self.model.read(data, data_rate, "Data_Rate")  # an amount of data, as our own models have it
            sheet.put("data_rate", data, span.text if span and span.low > 0 else None)
            return
        messages = data or of("Message_Rate", "SEI")  # for OSATE both are messages in a second
        rate = self.model.read(messages, message_rate, "Message_Rate")
        if rate:
            sheet.put("rate", messages, f"{number_text(rate)} Hz")
        elif messages is None:
            self._output_rate(sheet, source, of("Output_Rate"))

    def _output_rate(self, sheet: Sheet, source: Instance, rate: FoundProperty | None) -> None:
        """The largest Output_Rate, in a second or for each dispatch; one message for each dispatch is the default."""
        if rate is None or not isinstance(rate.value, Record):
            return
        values, unit = rate.value.get("value_range"), rate.value.get("rate_unit")
        high = values.high if isinstance(values, Range) else values
        if not isinstance(high, Number) or high.value <= 0:
            return
        if isinstance(unit, Word) and unit.name.lower() == "persecond":
            sheet.put("rate", rate, f"{number_text(high.value)} Hz")
        elif high.value != 1:
            period = self.model.read(self.model.properties.of(source, "Period"), time_range, "Period")
            if period is None or period.high <= 0:
                message = "{} has no Period: its Output_Rate for each dispatch counts as sending nothing"
                self.model.library.remark(message, rate.place, about=source.title)
                sheet.put("data_rate", rate, NO_DATA)
                return
            sheet.put("rate", rate, f"{number_text(high.value * 10**9 / period.high)} Hz")


def _index(name: str) -> str:
    """The index of an element of an array, with its brackets."""
    return name[len(name.partition("[")[0]) :]
