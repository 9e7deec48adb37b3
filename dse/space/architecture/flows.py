"""End-to-end flows: from the path in the file to components and the connections between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from dse.space.architecture.calls import Calls
from dse.space.architecture.carriers import carriers
from dse.space.architecture.chains import with_chains
from dse.space.architecture.clocks import speaks_of_clocks, with_past
from dse.space.architecture.frames import Frame, is_framed
from dse.space.architecture.joins import with_way
from dse.space.model.flows import Flow, Step, StepFigures, UnreadFlow
from dse.space.model.space import Component, Connection, Space
from dse.space.model.trees import FROM_BANDWIDTH, PerProcessorType, Tree, leaves
from dse.space.properties import Ledger, Path
from dse.spec.schema.model import PathElement, Spec
from dse.support.units import format_duration, shown


def build_flows(
    ledger: Ledger, spec: Spec, components: Sequence[Component], connections: Sequence[Connection], calls: Calls
) -> tuple[Flow, ...]:
    """Every flow of the problem, connected.

    A `Flow` has its steps (components and connections, with the figures that the flow states) and its stated latency
    range in ns. One through a component that calls leads through who answers. Gaps in a path go to `ledger`.
    """
    result = []
    clocked = speaks_of_clocks(spec, components)
    by_name = {item.stated_as: number for number, item in enumerate(components) if not item.part_of}
    wires = {item.name: number for number, item in enumerate(connections) if not item.is_inner}
    ways = {
        first: [(wires[wire], number) for wire, number in way if wire in wires] for first, way in calls.ways.items()
    }
    paths = {other: item.path for other, item in spec.flows.items()}
    between: dict[tuple[int | None, int | None], list[int]] = {}
    for number, item in enumerate(connections):
        between.setdefault((item.source, item.target), []).append(number)
    for name, given in spec.flows.items():
        ledger.work.go_on(10)
        tracer = _Tracer(ledger, ("flows", name, "path"), components, connections, between, by_name, wires, paths, ways)
        steps = tracer.trace(given.path, (name,))
        steps = with_way(components, steps)
        steps = with_past(steps) if clocked else with_chains(components, connections, steps)
        required = (given.latency.min_ns, given.latency.max_ns) if given.latency else None
        result.append(Flow(name, steps, required))
    return tuple(result)


def unread_flows(ledger: Ledger, spec: Spec) -> tuple[UnreadFlow, ...]:
    """The flows of an imported model that could not be followed.

    With the requirement that the model states, the reason and the place, so that a solve can refuse what it cannot
    check.
    """
    found = []
    for name, given in spec.unread.items():
        limit = None if given.latency is None else format_duration(given.latency.max_ns)
        requirement = "" if limit is None else f"latency of {name} <= {limit}"
        found.append(UnreadFlow(name, requirement, given.reason, ledger.origin(("unread", name))))
    return tuple(found)


@dataclass
class _Tracer:
    """Follows one path; after a mistake it goes on behind it, so that every mistake of a path is reported."""

    ledger: Ledger
    path: Path
    components: Sequence[Component]
    connections: Sequence[Connection]
    between: Mapping[tuple[int | None, int | None], Sequence[int]]
    by_name: Mapping[str, int]
    wires: Mapping[str, int]
    flows: Mapping[str, Sequence[str | PathElement]]
    ways: Mapping[int, Sequence[tuple[int, int]]]
    steps: list[Step] = field(default_factory=list)
    previous: int | None = None
    wire: int | None = None
    is_broken: bool = False

    def trace(
        self, elements: Sequence[str | PathElement], within: tuple[str, ...], around: Path | None = None
    ) -> tuple[Step, ...]:
        """The steps of the path; none when it has a mistake.

        `within` are the flows that it is part of, itself among them; mistakes are told at `around` where it is part.
        """
        by_name, wires = self.by_name, self.wires
        for position, given in enumerate(elements):
            where: Path = around or (*self.path, position)
            element, figures = (given, None) if isinstance(given, str) else (given.element, _figures(given))
            where = where if figures is None else (*where, "element")
            if element in by_name:
                self._component(where, by_name[element], figures, unlinked=around is not None)
            elif element in wires:
                if figures is not None:
                    message = f"{shown(element)} is a connection: only a component has figures in a flow"
                    self.ledger.error(where, message)
                self._connection(where, wires[element])
            elif element in self.flows:
                self._part(where, element, within)
            else:
                self.ledger.unknown(where, "component or connection", element, [*by_name, *wires, *self.flows])
                self._forget()
        return () if self.is_broken else tuple(self.steps)

    def _part(self, where: Path, name: str, within: tuple[str, ...]) -> None:
        """A flow as an element of another one."""
        if name in within:
            self.ledger.error(where, f"the flow {shown(name)} leads through itself")
            self._forget()
        else:
            self.trace(self.flows[name], (*within, name), where)

    def _forget(self) -> None:
        self.is_broken, self.previous, self.wire = True, None, None

    def _component(self, where: Path, here: int, figures: StepFigures | None, *, unlinked: bool) -> None:
        pieces = self.components[here].pieces
        if pieces is not None and figures is not None:
            self.ledger.error(where, f"{shown(pieces.thread)} has segments: their figures are those of every flow")
        here, *pieces_behind = (here,) if pieces is None else pieces.members
        further = [(self.components[number].triggers[0], number) for number in pieces_behind]
        further += self.ways.get(here, ())
        if self.wire is None and self.previous is not None:
            self.wire = self._only_connection(where, self.previous, here)
            if self.wire is None:
                self._forget()
            else:
                self.steps.append(Step("connection", self.wire))
        elif self.wire is not None and self.connections[self.wire].target != here:
            connection = self.connections[self.wire]
            if not self.ledger.is_doubtful(f"{connection.name}.to", self.components[here].stated_as):
                message = (
                    f"connection {shown(connection.name)} does not lead to {shown(self.components[here].stated_as)}"
                )
                self.ledger.error(where, message)
            self._forget()
        step = Step("component", here, self.wire, self.previous, figures=figures, unlinked=unlinked)
        self.steps.append(step)
        for wire, number in further:
            self.steps.append(Step("connection", wire))
            self.steps.append(Step("component", number, wire, self.connections[wire].source))
            here = number
        self.previous, self.wire = here, None

    def _connection(self, where: Path, number: int) -> None:
        connection = self.connections[number]
        self.steps.append(Step("connection", number))
        if self.wire is not None:
            one, other = self.connections[self.wire].name, connection.name
            self.ledger.error(where, f"expected a component between {shown(one)} and {shown(other)}")
            self._forget()
        elif self.previous is not None and connection.source != self.previous:
            sender = self.components[self.previous].stated_as
            if not self.ledger.is_doubtful(f"{connection.name}.from", sender):
                self.ledger.error(where, f"connection {shown(connection.name)} does not start at {shown(sender)}")
            self._forget()
        else:
            self.wire = number
            if self.previous is None:
                self.previous = connection.source

    def _only_connection(self, where: Path, source: int, target: int) -> int | None:
        """The one connection between two neighbours of a path; none or several are mistakes."""
        found = self.between.get((source, target), [])
        if len(found) == 1:
            return found[0]
        one, other = self.components[source].stated_as, self.components[target].stated_as
        if len(found) > 1:
            names = ", ".join(self.connections[number].name for number in found)
            message = f"several connections from {shown(one)} to {shown(other)}"
            self.ledger.error(where, message, f"name one of them in the path: {names}")
        elif not self._hidden_connection(source, target):
            self.ledger.error(where, f"no connection from {shown(one)} to {shown(other)}", is_sure=True)
        return None

    def _hidden_connection(self, source: int, target: int) -> bool:
        """Whether a connection with a misnamed end may be the one that is missing, or an end's name is taken twice."""
        for item in self.connections:
            sends = item.source == source or self.ledger.is_doubtful(f"{item.name}.from")
            receives = item.target == target or self.ledger.is_doubtful(f"{item.name}.to")
            if sends and receives:
                return True
        names = [item.name for item in self.components]
        return any(names.count(names[end]) > 1 for end in (source, target))


def _figures(given: PathElement) -> StepFigures:
    """The figures that a component has in this flow alone."""
    ranges = (given.latency, given.compute_execution_time, given.response_time)
    return StepFigures(*(None if item is None else (item.min_ns, item.max_ns) for item in ranges))


def check_flow_sizes(ledger: Ledger, space: Space) -> None:
    """A connection of a flow whose transmission takes time per byte must tell how many bytes there are.

    So must one with a data rate on a bus with frames, whether a flow has it or not.
    """
    for connection in space.connections:
        framed = [bus for bus in carriers(space.buses, connection) if is_framed(space.buses[bus].fixed_ns)]
        sizes = [0] if connection.size_bytes is None else leaves(connection.size_bytes)
        is_known = ledger.is_doubtful(f"{connection.name}.data_size") or all(sizes)
        if connection.data_rate is not None and framed and not is_known:
            ledger.doubt(f"{connection.name}.data_size")
            names = " and ".join(shown(space.buses[bus].name) for bus in sorted(framed))
            message = f"needs a `data_size` above 0: {names} has frames, a data rate does not say how many they are"
            ledger.error(("connections", connection.name), message)
    for flow in space.flows:
        for step in flow.steps:
            if step.kind != "connection":
                continue
            connection = space.connections[step.index]
            if ledger.is_doubtful(f"{connection.name}.data_size"):
                continue
            buses = [space.buses[bus] for bus in carriers(space.buses, connection)]
            only_rate = connection.data_rate is not None and connection.size_bytes is None
            if only_rate and any(_takes_time_per_byte(bus.per_byte_ns) for bus in buses):
                ledger.doubt(f"{connection.name}.data_size")
                path = ("connections", connection.name)
                ledger.error(path, f"needs a `data_size`, it is part of flow {shown(flow.name)}")


def _takes_time_per_byte(per_byte_ns: Tree) -> bool:
    for leaf in leaves(per_byte_ns):
        if leaf is FROM_BANDWIDTH or isinstance(leaf, Frame):
            return True
        subtrees = leaf.by_type.values() if isinstance(leaf, PerProcessorType) else (leaf,)
        if any(value and value[1] for tree in subtrees for value in leaves(tree)):
            return True
    return False
