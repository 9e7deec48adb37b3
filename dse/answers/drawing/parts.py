"""The parts of a drawing of an architecture: areas of components, links between them, uses of physical buses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from dse.space.architecture.carriers import carriers
from dse.space.model.flows import Flow
from dse.space.model.space import Connection, Space
from dse.space.model.trees import leaves


@dataclass(frozen=True)
class Area:
    """Components, by index, that run on one processor, or on one of several (open); none where none is stated.

    Several processors mean that the decision is open; the areas of a drawing do not depend on the design.
    """

    processors: tuple[int, ...]
    members: tuple[int, ...]


@dataclass
class BusUser:
    """The use of a physical bus by a component: whether it sends and receives there, and over which connections.

    `always` tells whether one of the connections can be on no other bus.
    """

    sends: bool = False
    receives: bool = False
    always: bool = False
    connections: tuple[int, ...] = ()

    def add(self, connection: int, *, sends: bool, always: bool) -> None:
        """Note a connection of which the component is one end.

        `sends` tells the direction, `always` whether the connection uses the bus in every design.
        """
        self.sends |= sends
        self.receives |= not sends
        self.always |= always
        self.connections += (connection,)


class DrawnParts:
    """The parts of the drawing of a space; the designs of a space have all of them in common.

    Numbers are indices into the space's components, connections and processors. Computed once and shared by the
    drawings of all designs.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self.links: dict[tuple[int, int], list[int]] = {}
        """Connections from a component to another that are drawn without a bus between, by both ends."""
        self.uses: dict[tuple[int, int], BusUser] = {}
        """By component and physical bus."""
        self.from_outside: set[int] = set()
        for number, item in enumerate(space.connections):
            self._sort(number, item)

    @cached_property
    def areas(self) -> tuple[Area, ...]:
        """Processors with their threads, in the order of the file; those without a processor last.

        Every processor has an area, even without threads. Threads whose processor is open between several form an area
        of their own.
        """
        threads_of: dict[tuple[int, ...], list[int]] = {}
        for number, item in enumerate(self.space.components):
            processors = self._processors(number)
            if processors or item.section == "threads":
                threads_of.setdefault(processors, []).append(number)
        for processor in range(len(self.space.processors)):
            threads_of.setdefault((processor,), [])
        order = sorted(threads_of, key=lambda processors: (not processors, sum(processors) / max(len(processors), 1)))
        return tuple(Area(processors, tuple(threads_of[processors])) for processors in order)

    @cached_property
    def home(self) -> Mapping[int, int]:
        """The area of each component that has one; the others are devices that stand by themselves.

        Indices of components to positions in `areas`.
        """
        return {number: place for place, area in enumerate(self.areas) for number in area.members}

    @cached_property
    def alone(self) -> tuple[int, ...]:
        """Devices outside every area."""
        return tuple(number for number in range(len(self.space.components)) if number not in self.home)

    def _receives(self, component: int) -> bool:
        return any(item.target == component for item in self.space.connections)

    @cached_property
    def above(self) -> tuple[frozenset[int], frozenset[int]]:
        """The devices and the physical buses above the processors: nothing leads to these devices.

        A bus is above when all its devices are, a device when nothing leads to it and all its buses are.
        """
        devices = frozenset(one for one in self.alone if not self._receives(one))
        while True:
            buses = frozenset(
                bus
                for bus in {bus for one, bus in self.uses if one in devices}
                if all(one in devices for one, other in self.uses if other == bus and one not in self.home)
            )
            kept = frozenset(one for one in devices if all(bus in buses for other, bus in self.uses if other == one))
            if kept == devices:
                return devices, buses
            devices = kept

    @cached_property
    def in_flows(self) -> frozenset[int]:
        """Connections that a flow passes."""
        return frozenset(number for flow in self.space.flows for number in _passed(flow))

    @cached_property
    def components_in_flows(self) -> frozenset[int]:
        """Components that a flow passes."""
        return frozenset(step.index for flow in self.space.flows for step in flow.steps if step.kind == "component")

    @cached_property
    def flow_ends(self) -> Mapping[int, str]:
        """The component that each longest flow begins with (``source``) and ends with (``sink``).

        Indices of components to ``source`` or ``sink``; a component that is both for two flows is shown as the one that
        was found last.
        """
        ends: dict[int, str] = {}
        for flow in self.main_flows:
            components = [step.index for step in flow.steps if step.kind == "component"]
            if components:
                ends |= {components[-1]: "sink", components[0]: "source"}
        return ends

    @cached_property
    def main_flows(self) -> tuple[Flow, ...]:
        """The flows that are no part of another one.

        A flow whose connections are all on the path of another flow is left out; of two equal paths the first name in
        the alphabet stays.
        """
        paths = {flow.name: frozenset(_passed(flow)) for flow in self.space.flows}
        return tuple(
            flow
            for flow in self.space.flows
            if not any(
                paths[flow.name] < other or (paths[flow.name] == other and name < flow.name)
                for name, other in paths.items()
                if name != flow.name
            )
        )

    def _processors(self, component: int) -> tuple[int, ...]:
        item = self.space.components[component]
        if item.processor is None and item.part_of:  # a job that takes no time is where its thread is
            item = self.space.components[self.space.component_numbers[item.part_of]]
        options = set(leaves(item.processor, dict(self.space.fixed)))
        return tuple(sorted(options - {None}))

    def _sort(self, number: int, item: Connection) -> None:
        """A connection is a link, or two uses of each physical bus that may carry it."""
        ends = [end for end in (item.source, item.target) if end is not None]
        homes = {self._processors(end) or end for end in ends}
        physical = [bus for bus in sorted(carriers(self.space.buses, item)) if not self.space.buses[bus].virtual]
        if len(ends) == 2 and (len(homes) == 1 or not physical):
            self.links.setdefault((ends[0], ends[1]), []).append(number)
        elif physical:
            options = [bus for bus in set(leaves(item.bus)) if bus is not None]
            for end in ends:
                for bus in physical:
                    use = self.uses.setdefault((end, bus), BusUser())
                    use.add(number, sends=end == item.source, always=len(options) == 1)
        elif item.target is not None:
            self.from_outside.add(item.target)


def _passed(flow: Flow) -> Iterator[int]:
    """The connections that a flow passes."""
    for step in flow.steps:
        if step.kind == "connection":
            yield step.index
        elif step.via is not None:
            yield step.via
