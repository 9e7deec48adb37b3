"""A design of an AADL model as an implementation that extends it and sets what was decided (ECE-TR-25, Listing 2.3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.views import View
from dse.answers.exports.aadl.message_sizes import ResizedPorts
from dse.answers.exports.aadl.names import (
    applies_to,
    comment,
    identifier,
    output_rate,
    real,
    size_in_units,
    times,
    written_range,
)
from dse.importers.aadl.document.problem import ProblemWriter
from dse.importers.aadl.instance.connections import ConnectionInstance
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import InstanceModel
from dse.importers.aadl.syntax.tree import Classifier, Path
from dse.space.model.space import EMPTY, Component, Connection, Design, Space
from dse.space.model.trees import NotOffered, Tree, at
from dse.support.errors import UsageError
from dse.support.units import Exact, format_duration, format_time_range, unrounded

PROTOCOLS = {"periodic": "Periodic", "aperiodic": "Aperiodic", "sporadic": "Sporadic", "hybrid": "Hybrid"}
TIMES = (
    ("execution_ns", "compute_execution_time", "Compute_Execution_Time"),
    ("response_ns", "response_time", "SEI::Response_Time"),
)
SAID = ("period", "dispatch_protocol", "compute_execution_time", "response_time", "latency", "deadline", "priority",
        "offset", "processor", "bus", "queue_size", "data_size", "rate", "type")  # fmt: skip
"""Fields of decisions that an implementation can set."""


@dataclass
class Side:
    """A space with one of its designs."""

    space: Space
    design: Design
    view: View = field(init=False)

    def __post_init__(self) -> None:
        """The view that trees are looked at with."""
        self.view = View(self.design)

    def value(self, tree: Tree) -> Any:
        """A leaf; None where it is not offered.

        None means that the decision has no effect in this design, such as the bus of a connection that stays on one
        computer.
        """
        try:
            return at(tree, self.view)
        except NotOffered:
            return None


class ChosenModel:
    """Writes a design of a problem that came from `model`, whose own problem is `base`.

    `implementations` are those that subsystems of the root have in `model` instead of their own.
    """

    def __init__(
        self,
        model: InstanceModel,
        writer: ProblemWriter,
        base: Side,
        chosen: Side,
        title: str,
        name: str,
        implementations: Mapping[Instance, Classifier] | None = None,
    ) -> None:
        self.model = model
        self.implementations = dict(implementations or {})
        self.writer = writer
        self.base = base
        self.chosen = chosen
        self.title = title
        self.name = name
        self.lines: dict[str, list[str]] = {}
        self.refined: list[str] = []
        self.withs: dict[str, None] = {}
        self.remarks: list[str] = []
        root = model.root.flat
        assert root is not None
        self.root = root.classifier
        self.type = next(item for item in root.chain if not item.is_implementation)
        self.resized = ResizedPorts(model, {self.type.name.lower()})
        self.components = {
            name: item
            for item in model.root.below()
            for name in (model.medium_name(item), model.end_name(item), model.name(item))
        }
        self.wires = {name: item for item, name in writer.connections.names.items()}

    def text(self, response_times: Mapping[str, tuple[Exact, Exact]] | None = None) -> str:
        """The package; `response_times`, best and worst in ns, go in as SEI::Response_Time.

        AADL source whose system implementation extends the imported one and refines types, bindings and properties.
        """
        self._slots()
        self._components(response_times or {})
        self._connections()
        self._left_out()
        self.refined += self.resized.refined()
        for component, classifier in self.implementations.items():
            if component not in self.resized.components:
                self._refined(component, classifier)
        self.withs |= self.resized.withs
        stem = self.root.name.partition(".")[0]
        package = identifier(self.name, set())
        used = dict.fromkeys([self.root.package, self.type.package, *self.withs])
        uses_sei = any(line.startswith("SEI::") for line in self.lines)
        names = ", ".join([*used, *(["SEI"] if uses_sei else [])])
        lines = [f"package {package}", "public", f"  with {names};", ""]
        lines += self.resized.declarations()
        lines += [f"  system {stem} extends {self.type.package}::{stem}", f"  end {stem};", ""]
        lines += [f"  system implementation {stem}.chosen extends {self.root.package}::{self.root.name}"]
        lines += ["    subcomponents", *(f"      {line}" for line in self.refined)] if self.refined else []
        stated = [
            f"      {value} applies to {', '.join(paths)};" for value, paths in self.lines.items()
        ]  # fmt: skip
        lines += ["    properties", *stated] if stated else []
        lines += [f"  end {stem}.chosen;", f"end {package};"]
        return comment([self.title, *self.remarks]) + "\n".join(lines) + "\n"

    def _set(self, value: str, path: str) -> None:
        self.lines.setdefault(value, []).append(path)

    def _is_decided(self, component: str, key: str) -> bool:
        return any(
            item.is_open and item.component == component and item.field == key for item in self.chosen.space.decisions
        )

    # --- processors and buses --------------------------------------------------------------------------------------

    def _slots(self) -> None:
        for section in ("processors", "buses"):
            before = {slot.name: slot for slot in getattr(self.base.space, section)}
            for slot in getattr(self.chosen.space, section):
                kind = slot.types[self.chosen.view[slot.type_decision]]
                old = before.get(slot.name)
                if old is None or kind == EMPTY:
                    continue
                if kind != old.types[self.base.view[old.type_decision]]:
                    self._refine(slot.name, kind)

    def _refine(self, name: str, kind: str) -> None:
        component = self.components[name]
        flat = self.writer.hardware.classifier(kind, (component.category, "abstract"))
        if flat is None or component.parent is not self.model.root:
            where = "is no classifier of the model" if flat is None else "is not directly in the root"
            raise UsageError(f"AADL cannot say that {name} has the type {kind}: it {where}")
        self._refined(component, flat.classifier)

    def _refined(self, component: Instance, classifier: Classifier) -> None:
        self.withs[classifier.package] = None
        title = f"{classifier.package}::{classifier.name}"
        self.refined.append(f"{component.name} : refined to {component.category} {title};")

    # --- threads and devices ---------------------------------------------------------------------------------------

    def _components(self, response_times: Mapping[str, tuple[Exact, Exact]]) -> None:
        before = {item.name: item for item in self.base.space.components}
        for item in self.chosen.space.components:
            instance = self.components.get(item.name)
            if instance is None or item.name not in before:
                continue
            path = instance.title
            for value in self._figures(item, before[item.name], instance):
                if applies_to(value.partition(" =>")[0], instance.category):
                    self._set(value, path)
                else:
                    kind = f"{'an' if instance.category[0] in 'aeiou' else 'a'} {instance.category}"
                    self.remarks.append(f"Not set, for AADL has no such property of {kind}: {value} of {path}")
            self._specified(item, before[item.name], instance)
            self._bound(item, before[item.name], path)
            if item.name in response_times and applies_to("SEI::Response_Time", instance.category):
                text = times(written_range(response_times[item.name]))
                self._set(f"SEI::Response_Time => {text}", path)

    def _figures(self, item: Component, old: Component, instance: Instance) -> Iterator[str]:
        def pair(name: str) -> tuple[Any, Any]:
            return self.chosen.value(getattr(item, name)), self.base.value(getattr(old, name))

        protocol, former = pair("protocol")
        if protocol is not None and (protocol != former or self._is_decided(item.name, "dispatch_protocol")):
            yield f"Dispatch_Protocol => {PROTOCOLS[protocol]}"
        period, former = pair("period_ns")
        stated = self.model.properties.of(instance, "Period")
        if period is not None and (period != former or self._is_decided(item.name, "period")):
            yield f"Period => {times(format_duration(period), as_range=False)}"
        elif period is None and former is not None and stated is not None and not self._counts_period(item):
            yield "Period => 0 ms"
        for name, key, word in TIMES:
            now, former = pair(name)
            if now is not None and (now != former or self._is_decided(item.name, key)):
                yield f"{word} => {times(format_time_range(now))}"
        deadline, former = pair("deadline_ns")
        if deadline is not None and (deadline != former or self._is_decided(item.name, "deadline")):
            yield f"Deadline => {times(format_duration(deadline), as_range=False)}"
        offset, former = pair("offset_ns")
        if offset is not None and (offset != former or self._is_decided(item.name, "offset")):
            yield f"Dispatch_Offset => {times(format_duration(offset), as_range=False)}"
        priority, former = pair("priority")
        if priority is not None and (priority != former or self._is_decided(item.name, "priority")):
            yield f"Priority => {priority}"

    def _counts_period(self, item: Component) -> bool:
        """Whether the period that an aperiodic component states still counts, as for OSATE."""
        return self.chosen.space.profile != "dse" and self.chosen.value(item.stated_period_ns) is not None

    def _specified(self, item: Component, old: Component, instance: Instance) -> None:
        """The latency of a component is that of its flow specifications."""
        now, former = self.chosen.value(item.latency_ns), self.base.value(old.latency_ns)
        if now is not None and now != former and instance.flat is not None:
            for member in instance.flat.specs.values():
                self._set(f"Latency => {times(format_time_range(now))}", f"{instance.title}.{member.item.name}")

    def _bound(self, item: Component, old: Component, path: str) -> None:
        now, former = self.chosen.value(item.processor), self.base.value(old.processor)
        names = [
            None if number is None else side.space.processors[number].name
            for number, side in ((now, self.chosen), (former, self.base))
        ]
        if names[0] is not None and (names[0] != names[1] or self._is_decided(item.name, "processor")):
            target = self.components[names[0]].title
            self._set(f"Actual_Processor_Binding => (reference ({target}))", path)
            comment = "Threads that are bound to one processor are synchronous for OSATE: what samples between them is "
            comment += "rounded up to its period instead of adding a whole one."
            if comment not in self.remarks:
                self.remarks.append(comment)

    # --- connections -------------------------------------------------------------------------------------------------

    def _connections(self) -> None:
        before = {item.name: item for item in self.base.space.connections}
        bound: dict[str, str] = {}
        for item in self.chosen.space.connections:
            wire, old = self.wires.get(item.name), before.get(item.name)
            if wire is None or old is None:
                continue
            self._carried(item, old, wire, bound)
            size, former = self.chosen.value(item.size_bytes), self.base.value(old.size_bytes)
            differs = size is not None and unrounded(size) != unrounded(former)
            if differs and (item.type_bytes is not None or not self.resized.add(wire, size)):
                self._set(f"Data_Size => {size_in_units(size)}", ".".join([*_names(wire.source), *wire.source_path]))
            queue, former = self._queue(item, self.chosen), self._queue(old, self.base)
            if queue is not None and queue != former and item.port.startswith("event"):
                self._set(f"Queue_Size => {queue}", ".".join([*_names(wire.target), *wire.target_path]))
            latency, former = self.chosen.value(item.latency_ns), self.base.value(old.latency_ns)
            if latency is not None and latency != former:
                self._set(f"Latency => {times(format_time_range(latency))}", self._declared(wire))
            rate, former = self.chosen.value(item.rate_hz), self.base.value(old.rate_hz)
            if rate is not None and rate != former and wire.source is not None:
                self._set(
                    self._rate(wire.source, wire.source_path, rate), ".".join([*wire.source.path, *wire.source_path])
                )

    def _queue(self, item: Connection, side: Side) -> Any:
        """The size of the queue that a connection fills: its own, else that of the component it leads to."""
        own = side.value(item.queue_size)
        if own is not None or item.target is None or not item.port.startswith("event"):
            return own
        return side.value(side.space.components[item.target].queue_size)

    def _rate(self, source: Instance, path: Path, rate: Fraction) -> str:
        """Messages in a second, by the property that the model has for them; Output_Rate where it has none."""
        text = real(rate)
        if text is None:
            raise UsageError(f"AADL cannot say that messages come at {rate} Hz: that has no end as a decimal number")
        for name in ("Data_Rate", "Message_Rate"):
            if self.model.properties.of_feature(source, path, name, "SEI") is not None:
                return f"SEI::{name} => {text} perSecond"
        return str(output_rate(rate))

    @staticmethod
    def _declared(wire: ConnectionInstance) -> str:
        """The outermost of the declarations that a connection runs over."""
        outermost = min(wire.wires, key=lambda one: len(one.context.path))
        return ".".join([*outermost.context.path, outermost.member.item.name])

    def _carried(self, item: Connection, old: Connection, wire: ConnectionInstance, bound: dict[str, str]) -> None:
        now, former = self.chosen.value(item.bus), self.base.value(old.bus)
        names = [
            None if number is None else side.space.buses[number].name
            for number, side in ((now, self.chosen), (former, self.base))
        ]
        if names[0] is None or (names[0] == names[1] and not self._is_decided(item.name, "bus")):
            return
        path = self._declared(wire)
        if bound.setdefault(path, names[0]) != names[0]:
            raise UsageError(f"AADL cannot say that {item.name} takes {names[0]}: {path} takes {bound[path]} already")
        value = f"Actual_Connection_Binding => (reference ({self.components[names[0]].title}))"
        if path not in self.lines.get(value, ()):
            self._set(value, path)

    def _left_out(self) -> None:
        """The decisions that AADL cannot express."""
        space = self.chosen.space
        for number, item in enumerate(space.decisions):
            option = self.chosen.design[number] if number < len(self.chosen.design) else -1
            if item.is_open and item.field not in SAID and option >= 0:
                self.remarks.append(f"Decided, and without a word in AADL: {item.name} = {item.options[option]}")
        for number, core in cores_of(space, self.chosen.design).items():
            component = space.components[number]
            if self.chosen.value(component.core) is None:
                self.remarks.append(f"By first-fit, and without a word in AADL: {component.name} on core {core}")


def _names(component: Instance | None) -> Sequence[str]:
    return component.path if component is not None else ()
