"""A problem file's design as a complete AADL model: one package, with a property set for what AADL has no word for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from dse.answers.exports.aadl.budgets import state_budgets
from dse.answers.exports.aadl.fixed_document import Decided
from dse.answers.exports.aadl.flows import FlowWriter
from dse.answers.exports.aadl.names import (
    bandwidth,
    comment,
    extra,
    identifier,
    output_rate,
    quoted,
    size,
    speed,
    times,
    written_range,
)
from dse.answers.exports.aadl.package import ComponentDraft, package_text, section_lines
from dse.answers.exports.aadl.paths import entered_times
from dse.importers.aadl.property_set import OURS
from dse.space.model.space import Design, Space
from dse.space.question.settings import settings_of
from dse.support.arguments import respelt
from dse.support.units import Exact, parse_rate_hz

SETTINGS = (
    "name", "offset_grid", "assumptions", "totals", "clocks", "metrics", "requirements", "objectives",
)  # fmt: skip
"""Keys of the top level that go along as they are."""
PORTS = {
    "event_data": "event data port", "event": "event port", "data": "data port", "data_access": "data access",
    "feature": "feature",
}  # fmt: skip
GIVING = {"data access": ("provides", "requires")}
"""Keywords before features of the sending and the receiving end, where not ``out`` and ``in``."""
BOUND = ("from", "to", "bus", "further_buses", "source")
"""Fields of connections and buses that say where they are: as ends and bindings."""
PROTOCOLS = {"periodic": "Periodic", "aperiodic": "Aperiodic", "sporadic": "Sporadic", "hybrid": "Hybrid"}


class WholeModel:
    """Writes one design of a problem.

    The model is read back by `dse import` to a problem with equal figures, which `dse export` checks before it writes.
    """

    def __init__(
        self,
        document: Mapping[str, Any],
        space: Space,
        design: Design,
        title: str,
        responses: Mapping[str, tuple[Exact, Exact]] | None = None,
    ) -> None:
        self.responses = responses or {}
        self.document = document
        self.decided = Decided(document, space, design)
        self.title = title
        self.taken: set[str] = set()
        self.package = identifier(str(document.get("name", "model")), set())
        self.root = ComponentDraft(self.package, "system", "system")
        self.types: list[str] = []
        self.parts: dict[str, ComponentDraft] = {}
        self.processes: dict[str, ComponentDraft] = {}
        self.links: dict[str, str] = {}
        self.required: dict[str, str] = {}
        self.paths: dict[str, str] = {}

    def text(self, left_out: Iterable[str] = ()) -> str:
        """The package; `left_out` are requirements, objectives and metrics (by name) that make no sense here.

        AADL source. What AADL cannot state is kept in the property ``Extra`` of dse's own property set.
        """
        self._slots()
        self._components()
        self._connections()
        self._write_flows()
        settings = {key: self.document[key] for key in SETTINGS if self.document.get(key) not in (None, [], {})}
        settings |= settings_of(self.decided.space)
        for key in ("executors", "reservations", "partitions", "memories", "budgets"):
            entries: Mapping[str, Any] = self.decided.section(key)
            entries = state_budgets(entries, self.parts) if key == "budgets" else entries
            settings |= {key: entries} if entries else {}
        dropped = list(left_out)
        for key in ("requirements", "objectives"):
            if key in settings:
                settings[key] = [item for item in settings[key] if item not in dropped]
        if "metrics" in settings:
            settings["metrics"] = {key: item for key, item in settings["metrics"].items() if key not in dropped}
        stated = extra(settings.items())
        if stated:
            self.root.properties.append(f"{OURS}::Extra => {stated};")
        parts = [*self.parts.values(), *([self.environment] if self.environment else [])]
        package = package_text(self.package, self.types, parts, [*self.processes.values(), self.root])
        said = [f"left out, for it speaks of what this design does not have: {item}" for item in dropped]
        return comment([self.title, *said]) + package

    # --- hardware -------------------------------------------------------------------------------------------------

    def _slots(self) -> None:
        for section, categories in (("processors", ("processor",)), ("buses", ("bus", "virtual bus"))):
            for name, entry in self.decided.section(section).items():
                figures = self.decided.type_of(section, name)
                category = categories[-1] if figures.get("virtual") else categories[0]
                own = self._named(name)
                type_name = self._type(category, f"{entry['type']} {own}", str(entry["type"]), figures)
                rest = {key: value for key, value in entry.items() if key not in (*BOUND, "type", "optional")}
                block = self._block(name, own, extra(rest.items()), "Slot")
                self.root.subcomponents.append(f"{own} : {category} {type_name}{block};")
                self.paths[name] = own
        wires = self.decided.section("connections")
        used = {entry.get("bus") for entry in wires.values()}
        used |= {one for section in (wires, self.decided.section("buses")) for entry in section.values()
                 for one in entry.get("further_buses", ())}  # fmt: skip
        known = set(self.document.get("bus_types") or {})
        for name in sorted(known & used - set(self.paths)):  # a virtual bus type that is used without an entry
            own = self._named(name)
            type_name = self._type("virtual bus", own, name, self._bus_type(name))
            block = f"{{{OURS}::Name => {quoted(name)}; {OURS}::By_Type => true;}}"
            self.root.subcomponents.append(f"{own} : virtual bus {type_name} {block};")
            self.paths[name] = own
        for name, entry in self.decided.section("buses").items():
            carriers = self._carriers(entry)
            if carriers:
                self._bind("Actual_Connection_Binding", carriers, self.paths[name])

    def _bus_type(self, name: str) -> dict[str, Any]:
        figures = dict(self.document["bus_types"][name])
        values = {key: self.decided.value("buses", name, key, value) for key, value in figures.items()}
        return {key: value for key, value in values.items() if value is not None}

    def _carriers(self, entry: Mapping[str, Any]) -> str:
        """References to what carries a connection or virtual bus, all at once; "" where nothing does."""
        names = [str(one) for one in (entry["bus"], *entry.get("further_buses", ()))] if "bus" in entry else []
        return ", ".join(f"reference ({self.paths[one]})" for one in names if one in self.paths)

    def _protocols(self, names: Iterable[str]) -> str:
        """The classifiers of protocols that are required, without being bound."""
        for name in names:
            if name not in self.required:
                self.required[name] = self._type("virtual bus", name, name, self._bus_type(name))
        return f"Required_Virtual_Bus_Class => ({', '.join(f'classifier ({self.required[name]})' for name in names)});"

    def _bind(self, property_name: str, target: str, path: str) -> None:
        self.root.properties.append(f"{property_name} => ({target}) applies to {path};")

    def _named(self, name: str) -> str:
        return identifier(name, self.taken)

    def _block(self, name: str, own: str, stated: str | None, key: str = "Extra") -> str:
        """The properties of a declaration: its name in the problem file, and what AADL has no word for."""
        properties = [f"{OURS}::Name => {quoted(name)};"]
        properties += [f"{OURS}::{key} => {stated};"] if stated else []
        return f" {{{' '.join(properties)}}}" if properties else ""

    def _type(self, category: str, name: str, called: str, figures: Mapping[str, Any]) -> str:
        """Declare a type of hardware; returns its name."""
        own = self._named(f"{name} type")
        properties = [f"{OURS}::Type_Name => {quoted(called)};"]
        rest = dict(figures)
        rest.pop("virtual", None)
        rest.pop("source", None)
        for key, word, reader in (
            ("bandwidth", "SEI::BandWidthCapacity", bandwidth),
            ("speed", "SEI::MIPSCapacity", speed),
            ("latency", "Latency", times),
            ("overhead", "Data_Size", size),
        ):
            value = reader(rest[key]) if key in rest else None
            if value is not None:
                properties.append(f"{word} => {value};")
                del rest[key]
        transmission = rest.get("transmission_time")
        if isinstance(transmission, dict):
            parts = {key: times(transmission.get(key, "0 ns")) for key in ("fixed", "per_byte")}
            if all(parts.values()):
                record = f"[Fixed => {parts['fixed']}; PerByte => {parts['per_byte']};]"
                properties.append(f"Transmission_Time => {record};")
                if "sizes" not in transmission:  # AADL has no word for these: all of it stands there once more
                    del rest["transmission_time"]
        period = times(rest["period"], as_range=False) if "period" in rest and "bus" in category else None
        if period is not None:
            properties.append(f"Period => {period};")
            del rest["period"]
        if rest.get("protocols"):
            properties.append(self._protocols(rest.pop("protocols")))
        stated = extra(rest.items())
        properties += [f"{OURS}::Extra => {stated};"] if stated else []
        self.types += [f"  {category} {own}", *section_lines("properties", properties), f"  end {own};", ""]
        return own

    # --- software and devices ----------------------------------------------------------------------------------------

    def _components(self) -> None:
        self.positions = self._positions()
        for section in ("devices", "threads"):
            for name, entry in self.decided.section(section).items():
                self._component(section, name, entry)
        self.environment: ComponentDraft | None = None
        for entry in self.decided.section("connections").values():
            if "from" not in entry or "to" not in entry:
                own = self._named("environment")
                self.environment = ComponentDraft("environment", "abstract", own)
                self.root.subcomponents.append(f"{own} : abstract {own}_type {{{OURS}::Boundary => true;}};")
                self.environment.name = f"{own}_type"
                self.taken.add(f"{own}_type".lower())
                self.paths[""] = own
                break

    def _positions(self) -> dict[str, int]:
        """The places of threads, from 1, where the processes that hold them would mix these up."""
        names = [*self.decided.section("threads")]
        homes = [entry.get("process", name) for name, entry in self.decided.section("threads").items()]
        in_model = sorted(homes, key=homes.index)
        return {name: number for number, name in enumerate(names, 1)} if in_model != homes else {}

    def _component(self, section: str, name: str, entry: Mapping[str, Any]) -> None:
        usual = "device" if section == "devices" else "thread"
        rest = {key: value for key, value in entry.items() if key not in ("source", "processor")}
        category = rest.pop("category", usual)
        if name in self.responses:
            rest["response_time"] = written_range(self.responses[name])
        if (category == "device") != (section == "devices") or category not in ("thread", "device", "abstract"):
            rest["category"] = category
            category = usual
        own = self._named(name)
        part = self.parts[name] = ComponentDraft(f"{own}_type", category, own)
        self.taken.add(part.name.lower())
        if self._is_latency_of_flows(name):
            rest.pop("latency", None)
        part.properties = list(self._figures(rest, category, is_bound="processor" in entry))
        stated = extra(rest.items())
        if name in self.positions:
            part.properties.append(f"{OURS}::Position => {self.positions[name]};")
        block = self._block(name, own, stated)
        declared = f"{own} : {category} {part.name}{block};"
        if category == "thread":
            process = self._process(entry.get("process"), own)
            part.parent = process.own
            process.subcomponents.append(declared)
            self.paths[name] = f"{process.own}.{own}"
        else:
            self.root.subcomponents.append(declared)
            self.paths[name] = own
        if entry.get("processor") in self.paths:
            processor = self.paths[str(entry["processor"])]
            self._bind("Actual_Processor_Binding", f"reference ({processor})", self.paths[name])

    def _is_latency_of_flows(self, name: str) -> bool:
        """Whether each flow through a component states its latency there, so that its own counts nowhere."""
        paths = [entry["path"] for entry in self.decided.section("flows").values()]
        here = [
            item
            for path in paths
            for item in path
            if item == name or (isinstance(item, dict) and item["element"] == name)
        ]
        return bool(here) and all(isinstance(item, dict) and "latency" in item for item in here)

    def _process(self, name: Any, own: str) -> ComponentDraft:
        key = str(name) if name is not None else f"\n{own}"
        if key not in self.processes:
            called = self._named(str(name) if name is not None else f"{own} process")
            part = self.processes[key] = ComponentDraft(f"{called}_type", "process", called)
            self.taken.add(part.name.lower())
            self.root.subcomponents.append(f"{called} : process {part.name}.i;")
        return self.processes[key]

    def _figures(self, rest: dict[str, Any], category: str, *, is_bound: bool) -> Iterator[str]:
        """The properties that AADL has words for; takes them out of `rest`."""
        protocol = rest.pop("dispatch_protocol", None)
        if protocol is not None:
            yield f"Dispatch_Protocol => {PROTOCOLS[protocol]};"
        if protocol == "aperiodic" and self.decided.space.profile == "dse":
            rest.pop("period", None)  # OSATE counts it
        for key, word, as_range in (
            ("period", "Period", False),
            ("compute_execution_time", "Compute_Execution_Time", True),
            ("response_time", "SEI::Response_Time", True),
            ("callback_execution_time", f"{OURS}::Callback_Execution_Time", True),
            ("deadline", "Deadline", False),
            ("offset", "Dispatch_Offset", False),
        ):
            is_said = key in rest and (key != "offset" or (category == "thread" and is_bound))
            value = times(rest[key], as_range=as_range) if is_said else None
            if value is not None:
                yield f"{word} => {value};"
                del rest[key]
        if isinstance(rest.get("priority"), int):
            yield f"Priority => {rest.pop('priority')};"

    # --- connections -------------------------------------------------------------------------------------------------

    def _connections(self) -> None:
        sizes: dict[str, str] = {}
        wires = self.decided.section("connections")
        entered = entered_times(self.decided.section("flows"), self.parts, wires)
        for name, entry in wires.items():
            own = self.links[name] = self._named(name)
            rest = {key: value for key, value in entry.items() if key not in BOUND}
            kind = PORTS[respelt(rest.pop("port", "event_data"), PORTS)]
            data = size(rest["data_size"]) if "data_size" in rest else None
            classifier, sending = "", []
            if data is not None and kind != "event port":
                del rest["data_size"]
                if "type_size" in rest:
                    sending, data = [f"Data_Size => {data};"], str(size(rest.pop("type_size")))
                if data not in sizes:
                    sizes[data] = self._named("{1} {0}".format(*data.lower().split()))
                    declared = [f"  data {sizes[data]}", "    properties", f"      Data_Size => {data};"]
                    self.types += [*declared, f"  end {sizes[data]};", ""]
                classifier = f" {sizes[data]}"
            waiting = [f"{word} => {value};" for word, value in entered.get(name, {}).items()]
            waiting += self._queue(rest.pop("queue_size", None) if kind.startswith("event") else None)
            latency = times(rest["latency"]) if "latency" in rest else None
            if latency is not None:
                del rest["latency"]
            bus = self._carriers(entry)
            sent = output_rate(parse_rate_hz(str(rest["rate"]))) if "rate" in rest else None
            if sent is not None:
                del rest["rate"]
                sending.append(f"{sent};")
            self._connection(own, entry, f"{kind}{classifier}", sending, waiting)
            block = [f"Latency => {latency};"] if latency is not None else []
            block += [f"Actual_Connection_Binding => ({bus});"] if bus and not self._is_inside(entry) else []
            block += [self._protocols(rest.pop("protocols"))] if rest.get("protocols") else []
            stated = extra(rest.items())
            head = self._block(name, own, stated).strip().removeprefix("{").removesuffix("}")
            block += [head] if head else []
            self._declare(own, entry, f" {{{' '.join(block)}}}" if block else "", kind)
            if bus and self._is_inside(entry):
                self._bind("Actual_Connection_Binding", bus, f"{self.parts[entry['from']].parent}.{own}")

    def _end(self, name: Any) -> ComponentDraft:
        if name is None:
            assert self.environment is not None
            return self.environment
        return self.parts[name]

    def _is_inside(self, entry: Mapping[str, Any]) -> bool:
        """Whether both ends are in one process."""
        one, other = (self._end(entry.get(key)).parent for key in ("from", "to"))
        return bool(one) and one == other

    def _queue(self, queue: Any) -> list[str]:
        if queue is None:
            return []
        known = isinstance(queue, int) and queue > 0
        return [f"Queue_Size => {queue};" if known else f'{OURS}::Extra => ("queue_size: {queue}");']

    def _connection(
        self, own: str, entry: Mapping[str, Any], kind: str, sending: list[str], waiting: list[str]
    ) -> None:
        """The features of both ends with their properties, and of the processes around; `kind` with the classifier."""
        words = next((pair for start, pair in GIVING.items() if kind.startswith(start)), ("out", "in"))
        sides = (("from", "out", words[0], sending), ("to", "in", words[1], waiting))
        for key, direction, gives, stated in sides:
            block = f" {{{' '.join(stated)}}}" if stated else ""
            end = self._end(entry.get(key))
            feature = f"{own}_{direction} : {gives} {kind}"
            end.features.append(f"{feature}{block};")
            process = self._process_of(end)
            if process is not None and not self._is_inside(entry):
                process.features.append(f"{feature};")
                ends = (f"{end.own}.{own}_out", f"{own}_out") if key == "from" else (f"{own}_in", f"{end.own}.{own}_in")
                word = _connection_word(kind)
                process.connections.append(f"{own}_{direction}side : {word} {ends[0]} -> {ends[1]};")

    def _process_of(self, part: ComponentDraft) -> ComponentDraft | None:
        return next((item for item in self.processes.values() if item.own == part.parent), None)

    def _declare(self, own: str, entry: Mapping[str, Any], block: str, kind: str) -> None:
        one, other = self._end(entry.get("from")), self._end(entry.get("to"))
        word = _connection_word(kind)
        process = self._process_of(one)
        if self._is_inside(entry) and process is not None:
            process.connections.append(f"{own} : {word} {one.own}.{own}_out -> {other.own}.{own}_in{block};")
            return
        ends = [self._process_of(item) or item for item in (one, other)]
        self.root.connections.append(f"{own} : {word} {ends[0].own}.{own}_out -> {ends[1].own}.{own}_in{block};")

    # --- flows -------------------------------------------------------------------------------------------------------

    def _write_flows(self) -> None:
        stated = {**self.decided.section("threads"), **self.decided.section("devices")}
        FlowWriter(
            flows=self.decided.section("flows"),
            wires=self.decided.section("connections"),
            parts=self.parts,
            links=self.links,
            latencies={name: entry["latency"] for name, entry in stated.items() if "latency" in entry},
            root=self.root,
            end=lambda name: self._end(name or None),
            process_of=self._process_of,
            named=self._named,
            is_inside=self._is_inside,
            profile=self.decided.space.profile,
        ).write()


def _connection_word(kind: str) -> str:
    """The keyword before a connection between features of a kind."""
    return next((word for word in ("feature", *GIVING) if kind.startswith(word)), "port")
