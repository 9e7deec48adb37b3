"""End-to-end flows: flattened to the components that work and the connections between them.

One declared flow is several where a flow specification has several implementations, or where several connections lead
on: over a feature group there is one for each of its features (AS5506, section 10.3; OSATE numbers them, `e_1`, `e_2`).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, product
from typing import TypeAlias

from dse.importers.aadl.instance.connections import ConnectionInstance, Declared, Wiring, beyond
from dse.importers.aadl.instance.inheritance import Member
from dse.importers.aadl.instance.instance import Instance, is_active
from dse.importers.aadl.instance.library import Library
from dse.importers.aadl.syntax.tree import Flow, FlowSpec, Path
from dse.importers.allowance import spend
from dse.importers.registry import Place

MAX_DEPTH = 60
SENDING = ("abstract", "system", "process", "thread group", "thread", "device", "processor")
"""Categories of subcomponents without which a component counts as a leaf of flows."""


@dataclass(frozen=True, eq=False)
class NestedFlow:
    """One place of a flow at which another one stands, by its declared name."""

    name: str


@dataclass(frozen=True, eq=False)
class Stop:
    """A component on a flow; `spec` is its flow specification, None where the flow names the component alone.

    `entry` and `exit` are the features by which the flow comes and goes (() where it does not matter), `part` is the
    flow that it belongs to where that is an element of this one. `is_hollow`: it has subcomponents, and no flow
    implementation says how the flow leads through them.
    """

    component: Instance
    spec: Member[FlowSpec] | None
    place: Place
    entry: Path = ()
    exit: Path = ()
    part: NestedFlow | None = None
    is_hollow: bool = False


@dataclass(frozen=True, eq=False)
class EndToEnd:
    """An end-to-end flow: components and connections in turn; `context` declares it.

    `declared` is the path of its declaration; `suffix` tells the flows of one declaration apart ("" where there is
    one).
    """

    declared: str
    suffix: str
    context: Instance
    member: Member[Flow]
    steps: tuple[Stop | ConnectionInstance, ...]

    @property
    def name(self) -> str:
        """The name of the flow in OSATE."""
        return self.declared + self.suffix


@dataclass(frozen=True)
class UnreadFlow:
    """A declared flow of which not everything could be followed, and why.

    Becomes an entry of `unread` in the problem file.
    """

    name: str
    context: Instance
    member: Member[Flow]
    reason: str


@dataclass(frozen=True, eq=False)
class _Through:
    """A feature of the declaring component in the middle of a flow: what the connection behind it leads to."""

    place: Place


Element: TypeAlias = Stop | Declared | _Through
Steps: TypeAlias = tuple[Stop | ConnectionInstance, ...]


class _Broken(Exception):
    """The flow cannot be followed; the text says why."""


class _Inactive(Exception):
    """The flow is not there in the modes of its components; the text says why."""


@dataclass(frozen=True)
class _Partial:
    """A flow as far as it is followed: the next element, the last component, the connections since, the steps."""

    at: int
    previous: Stop | None
    wires: tuple[Declared, ...]
    steps: Steps


class Flows:
    """Follows the end-to-end flows of a tree; `unread` are those that could not be followed, when `of` has ended."""

    def __init__(self, library: Library, wiring: Wiring) -> None:
        self.library = library
        self.unread: list[UnreadFlow] = []
        self._reasons: list[str] = []
        self._by_source: dict[Instance | None, list[ConnectionInstance]] = defaultdict(list)
        for item in wiring.instances:
            self._by_source[item.source].append(item)

    def of(self, root: Instance) -> Iterator[EndToEnd]:
        """All flows of a tree; those that cannot be followed are left out with a remark.

        `EndToEnd` objects; several ways through arrays get the suffixes ``_1``, ``_2`` and so on.
        """
        contexts = (root, *root.below())
        declared = [
            (context, member)
            for context in contexts
            for member in (context.flat.flows.values() if context.flat else ())
            if is_active(member.item.modes, context.mode)
        ]
        taken = {_title(context, member) for context, member in declared}
        for context, member in declared:
            title, paths = _title(context, member), self._followed(context, member)
            for number, steps in enumerate(paths, 1):
                suffix = f"_{number}" if len(paths) > 1 else ""
                while suffix and title + suffix in taken:
                    suffix += "_"
                yield EndToEnd(title, suffix, context, member, steps)

    def _followed(self, context: Instance, member: Member[Flow]) -> list[Steps]:
        """Every way that a declared flow takes."""
        paths: list[Steps] = []
        self._reasons.clear()
        try:
            for elements in self._elements(context, member, 0):
                paths += self._joined(context, elements)
        except _Broken as error:
            self._reasons.append(str(error))
        except _Inactive as error:
            text = f"the flow {member.item.name} is not there in this mode ({error}): it is left out"
            self.library.remark(text, member.item.place)
        if self._reasons:
            title, reasons = _title(context, member), "; and ".join(dict.fromkeys(self._reasons))
            reason = f"Cannot create end to end flow '{title}' because {reasons}"
            self.unread.append(UnreadFlow(title, context, member, reason))
            self.library.remark(reason, member.item.place)
        return paths

    # --- elements: components that work, and declared connections --------------------------------------------------

    def _elements(self, context: Instance, member: Member[Flow], depth: int) -> Iterator[tuple[Element, ...]]:
        """The elements of a flow, flow implementations in their places: once for each choice of these."""
        if depth > MAX_DEPTH or context.flat is None:
            raise _Broken(f"the flow {member.item.name} leads through itself")
        choices = [
            list(self._of_element(context, member, number, path, depth))
            for number, path in enumerate(member.item.elements)
        ]
        yield from _combined(choices)

    def _of_element(
        self, context: Instance, member: Member[Flow], number: int, path: Path, depth: int
    ) -> Iterator[tuple[Element, ...]]:
        """The elements that one element of a flow stands for, for each choice of flow implementations."""
        spend(1 + depth)
        assert context.flat is not None
        key = tuple(name.lower() for name in path)
        is_end = number in (0, len(member.item.elements) - 1)
        if len(key) == 1 and key[0] in context.flat.connections:
            wire = Declared(context, context.flat.connections[key[0]])
            if not is_active(wire.member.item.modes, context.mode):
                raise _Inactive(f"connection {wire.member.item.name}")
            yield (wire,)
        elif context.named(key[0]):
            yield from self._component(context, path, member, depth)
        elif len(key) == 1 and key[0] in context.flat.flows and member.item.kind == "end to end":
            inner = context.flat.flows[key[0]]
            part = NestedFlow(_title(context, inner))
            for elements in self._elements(context, inner, depth + 1):
                yield tuple(replace(one, part=part) if isinstance(one, Stop) else one for one in elements)
        elif key[0] in context.flat.subcomponents:
            raise _Inactive(f"component {path[0]}")
        elif key[0] in context.flat.features:
            through = not is_end and member.item.kind == "end to end"
            yield (_Through(member.item.place),) if through else ()
        else:
            raise _Broken(f"there is no {'.'.join(path)}")

    def _component(
        self, context: Instance, path: Path, member: Member[Flow], depth: int
    ) -> Iterator[tuple[Element, ...]]:
        (component, rest), *others = context.descend(path)
        place, flat = member.item.place, component.flat
        if others:
            text = (
                f"the flow {member.item.name} names {path[0]}, an array: its first element alone, {component.title}, "
            )
            self.library.remark(f"{text}is followed, as by OSATE", place)
        if not rest:
            yield (Stop(component, None, place),)
            return
        key = rest[0].lower()
        if flat is not None and len(rest) == 1 and (key in flat.specs or key in flat.implementations):
            yield from self._specified(component, key, place, depth)
        elif flat is not None and key in flat.features:
            yield (Stop(component, None, place),)
        else:
            raise _Broken(f"{component.title} has no flow {'.'.join(rest)}")

    def _specified(self, component: Instance, key: str, place: Place, depth: int) -> Iterator[tuple[Element, ...]]:
        """A flow specification: the component itself, or what each of its implementations leads through."""
        assert component.flat is not None
        spec, implementations = component.flat.specs.get(key), component.flat.implementations.get(key, [])
        if spec is not None and not is_active(spec.item.modes, component.mode):
            raise _Inactive(f"flow {spec.item.name} of {component.title}")
        active = [item for item in implementations if is_active(item.item.modes, component.mode)]
        absent = [f"flow {implementations[0].item.name} of {component.title}"] if implementations else []
        ways = 0
        entry, leaving = (spec.item.entry, spec.item.exit) if spec is not None else ((), ())
        stop = Stop(component, spec, place, _plain(entry), _plain(leaving))
        if not implementations:
            yield (replace(stop, is_hollow=_is_hollow(component)),)
        for item in active:
            try:
                yield from self._implemented(component, item, stop, depth)
                ways += 1
            except _Inactive as error:
                absent.append(str(error))
            except _Broken as error:
                self._reasons.append(str(error))
        if absent and not ways and not self._reasons:
            raise _Inactive(absent[-1])

    def _implemented(
        self, component: Instance, flow: Member[Flow], stop: Stop, depth: int
    ) -> Iterator[tuple[Element, ...]]:
        """The elements that a flow implementation leads through; the component itself where it has none."""
        if not _inside(flow.item):  # perhaps by one feature of a group
            ends, kind = flow.item.elements, flow.item.kind
            entry = ends[0] if ends and kind != "source" else ()
            leaving = ends[-1] if ends and kind != "sink" else ()
            yield (replace(stop, entry=_plain(entry), exit=_plain(leaving)),)
        elif component.category == "thread":  # what it calls is not looked at
            yield (stop,)
        else:
            self._budgeted(flow)
            yield from self._elements(component, flow, depth + 1)

    def _budgeted(self, inner: Member[Flow]) -> None:
        """A Latency of a flow implementation is not looked at, by OSATE either: what it leads through counts."""
        for owned in inner.properties:
            if owned.association.key == "latency" and not owned.association.applies:
                text = (
                    f"Latency of the flow implementation {inner.item.name}: OSATE counts what it leads through instead"
                )
                self.library.remark(text, owned.association.place)

    # --- the connections between them ------------------------------------------------------------------------------

    def _joined(self, context: Instance, elements: Sequence[Element]) -> Iterator[Steps]:
        """The elements with the connections between them, once for each way."""
        stack = [_Partial(0, None, (), ())]
        while stack:
            partial = stack.pop()
            spend(1 + len(partial.steps))
            try:
                if partial.at < len(elements):
                    stack += reversed(list(self._next(context, elements[partial.at], partial)))
                else:
                    yield self._ended(context, partial)
            except _Broken as error:
                self._reasons.append(str(error))

    def _next(self, context: Instance, element: Element, partial: _Partial) -> Iterator[_Partial]:
        """A flow with one element more, once for each connection that leads there."""
        at, previous, wires = partial.at + 1, partial.previous, partial.wires
        if isinstance(element, Declared):
            yield replace(partial, at=at, wires=(*wires, element))
            return
        ways: Sequence[ConnectionInstance | None] = (None,)
        if previous is not None:
            ways = self._between(previous, element, wires)
        elif isinstance(element, _Through):
            raise _Broken("it leads through a feature that leads nowhere")
        elif wires and wires[0].context is context:  # else it begins within a component
            ways = self._from_outside(element, wires)
        for way in ways:
            stop = element if isinstance(element, Stop) else _reached(way, element)
            yield _Partial(at, stop, (), (*partial.steps, *(() if way is None else (way,)), stop))

    def _ended(self, context: Instance, partial: _Partial) -> Steps:
        """The whole flow, with the connection by which it leaves the component that declares it."""
        previous, wires = partial.previous, partial.wires
        if previous is None:
            raise _Broken("it names no component")
        if not wires or wires[-1].context is not context:
            return partial.steps
        leaving = [item for item in self._from(previous) if item.target is None and _runs(item, wires)]
        if not leaving:
            raise _Broken(f"the connection {wires[-1].member.item.name} leads nowhere")
        return (*partial.steps, leaving[0])

    def _from(self, stop: Stop) -> list[ConnectionInstance]:
        """The connections that leave a component; of one that is named without a flow, those from within it, too."""
        connections = self._by_source.get(stop.component, [])
        if stop.spec is not None or not stop.component.children:
            return connections
        return [*connections, *(item for one in stop.component.below() for item in self._by_source.get(one, ()))]

    def _between(self, one: Stop, other: Stop | _Through, wires: Sequence[Declared]) -> list[ConnectionInstance]:
        """The connections over some declared ones that continue a flow, by the features that it names."""
        candidates = [item for item in self._from(one) if _runs(item, wires) and _leads(one.exit, item.source_path)]
        if isinstance(other, _Through):
            fitting = [item for item in candidates if item.target is not None]
        else:
            fitting = [
                item for item in candidates
                if item.target is other.component and _leads(other.entry, item.target_path)
            ]  # fmt: skip
        if fitting:
            return fitting
        for stop in (one, other):
            if isinstance(stop, Stop) and stop.is_hollow and stop.spec is not None:
                raise _Broken(
                    f"component '{stop.component.title}' has subcomponents but no flow implementation for flow "
                    f"'{stop.spec.item.name}'"
                )
        names = " and ".join(wire.member.item.name for wire in wires) or "no connection"
        if isinstance(other, _Through):
            raise _Broken(f"{names} leads to no component from {one.component.title}")
        ends = ".".join((*other.component.path, *other.entry))
        raise _Broken(f"{names} does not lead from {'.'.join((*one.component.path, *one.exit))} to {ends}")

    def _from_outside(self, stop: Stop, wires: Sequence[Declared]) -> list[ConnectionInstance]:
        connections = [
            item for item in self._by_source.get(None, ())
            if item.target is stop.component and _runs(item, wires) and _leads(stop.entry, item.target_path)
        ]  # fmt: skip
        if not connections:
            raise _Broken(f"{wires[0].member.item.name} does not lead to {stop.component.title}")
        return connections


def _title(context: Instance, member: Member[Flow]) -> str:
    """The path of a declared flow."""
    return ".".join((*context.path, member.item.name))


def _combined(choices: Sequence[Sequence[tuple[Element, ...]]]) -> Iterator[tuple[Element, ...]]:
    """One of each, in the order of the first; each combination counts of the allowance."""
    for chosen in product(*choices):
        spend(1 + len(choices))
        yield tuple(chain.from_iterable(chosen))


def _inside(flow: Flow) -> tuple[Path, ...]:
    """The elements of a flow implementation between the features that it begins and ends at."""
    ends = {"source": (0, 1), "sink": (1, 0)}.get(flow.kind, (1, 1))
    return flow.elements[ends[0] : len(flow.elements) - ends[1]]


def _is_hollow(component: Instance) -> bool:
    return any(child.category in SENDING for child in component.children.values())


def _reached(way: ConnectionInstance | None, through: _Through) -> Stop:
    """The component that the connection behind a feature leads to."""
    assert way is not None and way.target is not None
    return Stop(way.target, None, through.place)


def _runs(item: ConnectionInstance, wires: Sequence[Declared]) -> bool:
    """Whether a connection runs over all of some declared ones."""
    return all(wire in item.wires for wire in wires)


def _plain(path: Path) -> Path:
    """A path of features in small letters."""
    return tuple(name.lower() for name in path)


def _leads(feature: Path, end: Path) -> bool:
    """Whether the end of a connection is a feature, or one within it."""
    return not feature or beyond(feature, end) is not None


def grouped(flow: EndToEnd, flows: Mapping[str, Sequence[EndToEnd]]) -> Iterator[Stop | ConnectionInstance | EndToEnd]:
    """The elements of a flow, with the flows that it is composed of in their places, where these are read alike.

    `flows` are all flows, by the path of their declaration.
    """
    number = 0
    while number < len(flow.steps):
        step = flow.steps[number]
        there = flows.get(step.part.name, ()) if isinstance(step, Stop) and step.part is not None else ()
        inner = next((item for item in there if item is not flow and _is_at(flow, number, item)), None)
        yield step if inner is None else inner
        number += 1 if inner is None else len(inner.steps)


def _is_at(flow: EndToEnd, number: int, inner: EndToEnd) -> bool:
    """Whether the steps of a flow from one on are those of another one."""
    there = flow.steps[number : number + len(inner.steps)]
    parts = {step.part for step in there if isinstance(step, Stop)}
    ends = [inner.steps[0], inner.steps[-1]]
    mine, theirs = ([_what(step) for step in steps] for steps in (there, inner.steps))
    return mine == theirs and len(parts) == 1 and all(isinstance(step, Stop) for step in ends)


def _what(step: Stop | ConnectionInstance) -> Instance | ConnectionInstance:
    return step.component if isinstance(step, Stop) else step
