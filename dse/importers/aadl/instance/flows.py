"""End-to-end flows: flattened to the components that work and the connections between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from dse.importers.aadl.instance.connections import ConnectionInstance, Wire, Wiring
from dse.importers.aadl.instance.inheritance import Member
from dse.importers.aadl.instance.instance import Instance, is_active
from dse.importers.aadl.instance.library import Library
from dse.importers.aadl.syntax.tree import Flow, FlowSpec, Path
from dse.importers.allowance import spend
from dse.importers.registry import Place

MAX_DEPTH = 60


@dataclass(frozen=True, eq=False)
class NestedFlow:
    """One place of a flow at which another one stands."""

    name: str


@dataclass(frozen=True, eq=False)
class Stop:
    """A component on a flow; `spec` is its flow specification, None where the flow names the component alone.

    `part` is the flow that it belongs to where that is an element of this one.
    """

    component: Instance
    spec: Member[FlowSpec] | None
    place: Place
    part: NestedFlow | None = None


@dataclass(frozen=True, eq=False)
class EndToEnd:
    """An end-to-end flow: components and connections in turn; `context` declares it."""

    name: str
    context: Instance
    member: Member[Flow]
    steps: tuple[Stop | ConnectionInstance, ...]


@dataclass(frozen=True, eq=False)
class _Through:
    """A feature of the declaring component in the middle of a flow: what the connection behind it leads to."""

    place: Place


Element: TypeAlias = Stop | Wire | _Through


class _Broken(Exception):
    """The flow cannot be followed; why is told already."""


class Flows:
    """Follows the end-to-end flows of a tree."""

    def __init__(self, library: Library, wiring: Wiring) -> None:
        self.library = library
        self._by_source: dict[Instance | None, list[ConnectionInstance]] = defaultdict(list)
        for item in wiring.instances:
            self._by_source[item.source].append(item)

    def of(self, root: Instance) -> Iterator[EndToEnd]:
        """All flows of a tree; what cannot be followed is told and left out."""
        for context in (root, *root.below()):
            for member in context.flat.flows.values() if context.flat else ():
                if member.item.kind != "end to end" or not is_active(member.item.modes, context.mode):
                    continue
                try:
                    steps = list(self._joined(context, list(self._elements(context, member, 0)), member))
                except _Broken:
                    continue
                yield EndToEnd(".".join((*context.path, member.item.name)), context, member, tuple(steps))

    def _tell(self, message: str, place: Place) -> _Broken:
        self.library.remark(f"{message}: the flow is left out", place)
        return _Broken()

    # --- elements: components that work, and declared connections --------------------------------------------------

    def _elements(self, context: Instance, member: Member[Flow], depth: int) -> Iterator[Element]:
        if depth > MAX_DEPTH or context.flat is None:
            raise self._tell(f"the flow {member.item.name} leads through itself", member.item.place)
        for number, path in enumerate(member.item.elements):
            spend(1 + depth)
            key = tuple(name.lower() for name in path)
            is_end = number in (0, len(member.item.elements) - 1)
            if len(key) == 1 and key[0] in context.flat.connections:
                yield Wire(context, context.flat.connections[key[0]])
            elif context.named(key[0]):
                yield from self._component(context, path, member, depth)
            elif len(key) == 1 and key[0] in context.flat.flows and member.item.kind == "end to end":
                inner = context.flat.flows[key[0]]
                part = NestedFlow(".".join((*context.path, inner.item.name)))
                for element in self._elements(context, inner, depth + 1):
                    yield replace(element, part=part) if isinstance(element, Stop) else element
            elif key[0] in context.flat.subcomponents:
                raise self._tell(f"{path[0]} is not there in this mode", member.item.place)
            elif key[0] in context.flat.features:
                if not is_end and member.item.kind == "end to end":
                    yield _Through(member.item.place)
            else:
                raise self._tell(f"there is no {'.'.join(path)}", member.item.place)

    def _component(self, context: Instance, path: Path, member: Member[Flow], depth: int) -> Iterator[Element]:
        component, rest = context.descend(path)[0]
        if not rest:
            yield Stop(component, None, member.item.place)
            return
        key, flat = rest[0].lower(), component.flat
        if flat is not None and len(rest) == 1:
            inner = flat.flows.get(key)
            if (
                inner is not None
                and is_active(inner.item.modes, component.mode)
                and self._leads_inside(component, inner)
            ):
                self._budgeted(inner)
                yield from self._elements(component, inner, depth + 1)
                return
            if key in flat.specs:
                yield Stop(component, flat.specs[key], member.item.place)
                return
        if flat is not None and key in flat.features:
            yield Stop(component, None, member.item.place)
            return
        raise self._tell(f"{component.title} has no flow {'.'.join(rest)}", member.item.place)

    def _budgeted(self, inner: Member[Flow]) -> None:
        """A Latency of a flow implementation is not looked at, by OSATE either: what it leads through counts."""
        for owned in inner.properties:
            if owned.association.key == "latency" and not owned.association.applies:
                text = (
                    f"Latency of the flow implementation {inner.item.name}: OSATE counts what it leads through instead"
                )
                self.library.remark(text, owned.association.place)

    def _leads_inside(self, component: Instance, flow: Member[Flow]) -> bool:
        """Whether a flow implementation names subcomponents."""
        return any(component.named(path[0].lower()) for path in flow.item.elements)

    # --- the connections between them ------------------------------------------------------------------------------

    def _joined(
        self, context: Instance, elements: list[Element], member: Member[Flow]
    ) -> Iterator[Stop | ConnectionInstance]:
        previous: Stop | None = None
        wires: list[Wire] = []
        for element in elements:
            if isinstance(element, Wire):
                wires.append(element)
                continue
            if isinstance(element, _Through):
                element = self._reached(previous, wires, element, member)
            if previous is not None:
                yield self._connection(previous, element, wires, member)
            elif wires[-1:] and wires[0].context is context:  # else it begins within a component
                yield self._from_outside(element, wires, member)
            yield element
            previous, wires = element, []
        if previous is not None and wires:
            leaving = [item for item in self._from(previous) if item.target is None and _runs(item, wires)]
            if leaving and wires[-1].context is context:
                yield leaving[0]
            elif wires[-1].context is context:
                raise self._tell(f"the connection {wires[-1].member.item.name} leads nowhere", member.item.place)
        if previous is None:
            raise self._tell("it names no component", member.item.place)

    def _reached(self, previous: Stop | None, wires: list[Wire], through: _Through, member: Member[Flow]) -> Stop:
        """The component that the connection behind a feature leads to."""
        ends = [item.target for item in self._from(previous) if _runs(item, wires)] if previous is not None else []
        if not ends or ends[0] is None:
            raise self._tell("it leads through a feature that leads nowhere", member.item.place)
        return Stop(ends[0], None, through.place)

    def _from(self, stop: Stop) -> list[ConnectionInstance]:
        """The connections that leave a component."""
        return self._by_source.get(stop.component, [])

    def _connection(self, one: Stop, other: Stop, wires: list[Wire], member: Member[Flow]) -> ConnectionInstance:
        candidates = [item for item in self._from(one) if item.target is other.component and _runs(item, wires)]
        fitting = [item for item in candidates if _fits(item, one, other)] or candidates
        if not fitting:
            names = " and ".join(wire.member.item.name for wire in wires) or "any connection"
            message = f"{names} does not lead from {one.component.title} to {other.component.title}"
            raise self._tell(message, member.item.place)
        return fitting[0]

    def _from_outside(self, stop: Stop, wires: list[Wire], member: Member[Flow]) -> ConnectionInstance:
        for item in self._by_source.get(None, ()):
            if item.target is stop.component and _runs(item, wires):
                return item
        raise self._tell(f"{wires[0].member.item.name} does not lead to {stop.component.title}", member.item.place)


def _runs(item: ConnectionInstance, wires: list[Wire]) -> bool:
    """Whether a connection runs over all of some declared ones."""
    return all(wire in item.wires for wire in wires)


def _fits(item: ConnectionInstance, one: Stop, other: Stop) -> bool:
    """Whether it leaves and enters by the features that the flow specifications name."""
    leaving = one.spec.item.exit if one.spec else ()
    entry = other.spec.item.entry if other.spec else ()
    pairs = ((leaving, item.source_path), (entry, item.target_path))
    return all(tuple(name.lower() for name in path) == there[: len(path)] for path, there in pairs)


def grouped(flow: EndToEnd, flows: Mapping[str, EndToEnd]) -> Iterator[Stop | ConnectionInstance | EndToEnd]:
    """The elements of a flow, with the flows that it is composed of in their places, where these are read alike."""
    number = 0
    while number < len(flow.steps):
        step = flow.steps[number]
        inner = flows.get(step.part.name) if isinstance(step, Stop) and step.part is not None else None
        if inner is not None and inner is not flow and _is_at(flow, number, inner):
            yield inner
            number += len(inner.steps)
        else:
            yield step
            number += 1


def _is_at(flow: EndToEnd, number: int, inner: EndToEnd) -> bool:
    """Whether the steps of a flow from one on are those of another one."""
    there = flow.steps[number : number + len(inner.steps)]
    parts = {step.part for step in there if isinstance(step, Stop)}
    ends = [inner.steps[0], inner.steps[-1]]
    mine, theirs = ([_what(step) for step in steps] for steps in (there, inner.steps))
    return mine == theirs and len(parts) == 1 and all(isinstance(step, Stop) for step in ends)


def _what(step: Stop | ConnectionInstance) -> Instance | ConnectionInstance:
    return step.component if isinstance(step, Stop) else step
