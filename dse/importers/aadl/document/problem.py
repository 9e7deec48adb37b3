"""A model's instance as the document of a problem: components, connections and flows with their figures.

Each figure is what the property look-up gives (`dse.importers.aadl.instance.properties`), and the component's
``source`` says where it stands. Rows, rules and names are OSATE's; what it looks at and we do not is a remark, never
silence.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from os.path import relpath
from pathlib import Path as FilePath
from typing import Any

from dse.importers.aadl.document.budgets import BudgetWriter
from dse.importers.aadl.document.components import NO_DATA, ComponentWriter, broken_cycles
from dse.importers.aadl.document.connections import ConnectionWriter
from dse.importers.aadl.document.hardware import HardwareWriter, Sheet
from dse.importers.aadl.document.values import shown_place, text_of, time_range
from dse.importers.aadl.instance.connections import ConnectionInstance
from dse.importers.aadl.instance.flows import EndToEnd, Stop, UnreadFlow, grouped
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import InstanceModel, libraries
from dse.importers.aadl.property_set import OURS
from dse.importers.registry import Key, Place

PROFILE = "osate-2.19"
WORKING = ("thread", "device")


class ProblemWriter:
    """Makes the document of one model; `places` tell where its values stand."""

    def __init__(self, model: InstanceModel, path: FilePath, options: Mapping[str, Any]) -> None:
        self.model = model
        self.path = path
        self.options = options
        self.places: dict[Key, Place] = {}
        choices: Mapping[str, Mapping[str, list[str]]] = options.get("choices", {})
        self.hardware = HardwareWriter(model, self.places, choices)
        self.components = ComponentWriter(model, self.places, choices, self.hardware)
        self.connections = ConnectionWriter(model, self.places, self.hardware)

    def document(self) -> dict[str, Any]:
        """The whole problem."""
        root = self.model.root
        title = f"{root.flat.title}" if root.flat else root.name
        file = self.path.name if self.path.name not in ("", "..") else self.path.resolve().name or "/"
        imported: dict[str, Any] = {"from": file, "root": title}
        if self.options.get("mode"):
            imported["mode"] = self.options["mode"]
        base = self.path if self.path.is_dir() else self.path.parent
        if folders := [_from(base, folder) for folder in libraries(self.options)]:
            imported["library"] = folders
        document: dict[str, Any] = {
            "dse": 1,
            "name": title,
            "source": f"{file}, {title}",
            "profile": PROFILE,
            "worst_case": "deadline",  # what OSATE has unless told otherwise, since December 2016
            "imported": imported,
        }
        used = self._used()
        sections = self.components.sections(used, self.model.flows)
        wires = self.connections.section(used, self.model.flows)
        declared: dict[str, list[EndToEnd]] = {}
        for item in self.model.flows:
            declared.setdefault(item.declared, []).append(item)
        flows = dict(self._flow(item, declared) for item in self.model.flows)
        requirements = self.hardware.budgets()
        resources = BudgetWriter(self.model, self.places, self.components).sections(used)
        for name in list(broken_cycles({**sections, "connections": wires})):
            wires[name]["data_rate"] = NO_DATA
            message = "{} closes a cycle of components without a Period: it counts as sending nothing"
            self.model.library.remark(message, self.places["connections", name], about=name)
        document |= {name: entries for name, entries in self.hardware.sections().items() if entries}
        document |= {name: entries for name, entries in (*sections.items(), *resources.items()) if entries}
        document |= {name: entries for name, entries in (("connections", wires), ("flows", flows)) if entries}
        if self.model.unread:
            document["unread"] = dict(self._unread(item) for item in self.model.unread)
        settings = Sheet(self.model, self.places, ())
        settings.extra(self.model.properties.of(root, "Extra", OURS))
        if requirements:
            document["requirements"] = requirements
        stated = settings.fields.get("budgets")
        if isinstance(stated, dict):  # what AADL has no word for, of the same components
            there = resources["budgets"]
            both = {
                name: {**there.get(name, {}), **entry} if isinstance(entry, dict) else entry
                for name, entry in stated.items()
            }
            settings.fields["budgets"] = {**both, **{name: there[name] for name in there if name not in both}}
        document |= settings.fields
        return document

    def _used(self) -> list[Instance]:
        """The components that work: threads, devices, and whatever a flow or a connection begins or ends at."""
        on_flows = {step.component for flow in self.model.flows for step in flow.steps if isinstance(step, Stop)}
        ends = {
            end
            for wire in self.connections.relevant(self.model.flows)
            for end in (wire.source, wire.target)
            if end is not None
        }
        return [
            item
            for item in self.model.root.below()
            if not self.model.is_boundary(item)
            and (item.category in WORKING or item in on_flows or item in ends
            or (item.category == "abstract" and not item.children))
        ]  # fmt: skip

    def _flow_name(self, flow: EndToEnd) -> str:
        stated = self.model.properties.of_member(flow.context, flow.member, "Name", OURS)
        return (self.model.read(stated, text_of, "Name") or flow.declared) + flow.suffix

    def _element(self, step: Stop | ConnectionInstance | EndToEnd) -> str | dict[str, Any]:
        """An element of a path: a component, a connection, or another flow."""
        if isinstance(step, Stop):
            return self.components.element(step)
        return self._flow_name(step) if isinstance(step, EndToEnd) else self.connections.name(step)

    def _unread(self, flow: UnreadFlow) -> tuple[str, dict[str, Any]]:
        """A flow that could not be followed: its name, why, and the latency that it was to keep."""
        entry: dict[str, Any] = {"reason": flow.reason}
        latency = self.model.properties.of_member(flow.context, flow.member, "Latency")
        span = self.model.read(latency, time_range, "Latency")
        if span is not None:
            entry["latency"] = span.text if " .. " in span.text else f"0 ms .. {span.text}"
        entry["source"] = shown_place(flow.member.item.place)
        self.places["unread", flow.name] = flow.member.item.place
        return flow.name, entry

    def _flow(self, flow: EndToEnd, flows: Mapping[str, Sequence[EndToEnd]]) -> tuple[str, dict[str, Any]]:
        """A flow: its name, and its path and required latency."""
        name = self._flow_name(flow)
        names = [
            self._element(step)
            for step in grouped(flow, flows)
            if not (isinstance(step, Stop) and self.model.is_boundary(step.component))
        ]
        entry: dict[str, Any] = {"path": names}
        self.places["flows", name] = flow.member.item.place
        latency = self.model.properties.of_member(flow.context, flow.member, "Latency")
        span = self.model.read(latency, time_range, "Latency")
        sources = [f"path {shown_place(flow.member.item.place)}"]
        if latency is not None and span is not None:
            entry["latency"] = span.text if " .. " in span.text else f"0 ms .. {span.text}"
            self.places["flows", name, "latency"] = latency.place
            sources.append(f"latency {shown_place(latency.place)}")
        sheet = Sheet(self.model, self.places, ("flows", name))
        sheet.extra(self.model.properties.of_member(flow.context, flow.member, "Extra", OURS))
        entry |= sheet.fields
        entry["source"] = ", ".join(sources)
        return name, entry


def _from(base: FilePath, folder: FilePath) -> str:
    """The path of a folder as seen from another one."""
    try:
        return FilePath(relpath(folder, base)).as_posix()
    except ValueError:  # on another drive
        return folder.resolve().as_posix()


def unique(wanted: str, taken: Iterable[str], longer: str) -> str:
    """A name, or the longer one where it is taken."""
    return longer if wanted in taken else wanted
