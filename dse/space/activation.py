"""Who dispatches whom: trigger connections, and the mistakes that no choice of options can mend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import networkx

from dse.space.figures import Ledger
from dse.space.trees import leaves
from dse.space.types import Component, Connection, Space
from dse.spec.model import Spec


def with_triggers(
    ledger: Ledger, spec: Spec, components: Sequence[Component], connections: Sequence[Connection]
) -> tuple[Component, ...]:
    """The components with their incoming connections and those that dispatch them."""
    names = {connection.name: number for number, connection in enumerate(connections)}
    result = []
    for number, component in enumerate(components):
        incoming = tuple(n for n, connection in enumerate(connections) if connection.target == number)
        triggers = tuple(n for n in incoming if connections[n].port != "data")
        stated = spec.threads[component.name].dispatch_trigger if component.section == "threads" else None
        if stated is not None:
            path = ("threads", component.name, "dispatch_trigger")
            own = [connections[n].name for n in incoming]
            for name in stated:
                if name not in own:
                    ledger.unknown(path, f"connection to {component.name!r}", name, own)
            triggers = tuple(names[name] for name in stated if name in own)
        result.append(replace(component, incoming=incoming, triggers=triggers))
    return tuple(result)


def may_be_event_triggered(component: Component) -> bool:
    """Whether some option makes the component aperiodic, sporadic, or leaves it without a period."""
    return any(leaf in ("aperiodic", "sporadic") for leaf in leaves(component.protocol)) or (
        any(leaf is None for leaf in leaves(component.protocol))
        and any(leaf is None for leaf in leaves(component.period_ns))
    )


def must_be_event_triggered(component: Component) -> bool:
    """Whether every option does."""
    protocols = set(leaves(component.protocol))
    periods = set(leaves(component.period_ns))
    return protocols <= {"aperiodic", "sporadic"} or (protocols <= {None, "aperiodic", "sporadic"} and periods == {None})


def trigger_graph(space: Space) -> networkx.MultiDiGraph[int]:
    """Components that may be event-triggered, and the connections between them that dispatch at the sender's rate."""
    graph: networkx.MultiDiGraph[int] = networkx.MultiDiGraph()
    eager = [may_be_event_triggered(component) for component in space.components]
    for target, component in enumerate(space.components):
        for number in component.triggers if eager[target] else ():
            connection = space.connections[number]
            stated = connection.rate_hz is not None or connection.data_rate is not None
            if connection.source is not None and eager[connection.source] and not stated:
                graph.add_edge(connection.source, target, key=number)
    return graph


def check_activation(ledger: Ledger, space: Space) -> None:
    """Report cycles of event-triggered components, and rates that are needed but come from nowhere."""
    always = [number for number, item in enumerate(space.components) if must_be_event_triggered(item)]
    for members in networkx.strongly_connected_components(trigger_graph(space).subgraph(always)):
        first = min(members)
        if len(members) > 1 or trigger_graph(space).has_edge(first, first):
            names = " -> ".join(space.components[number].name for number in sorted(members))
            component = space.components[first]
            ledger.error(
                (component.section, component.name),
                f"event-triggered cycle without a periodic source: {names} -> {component.name}",
                "make one of them periodic",
            )
    for number in sorted(_needed_rates(space)):
        component = space.components[number]
        if may_be_event_triggered(component) and not component.triggers:
            ledger.error(
                (component.section, component.name),
                "its rate is needed, but it has no period and nothing triggers it",
                "give it a `period`, or its connections a `rate`",
            )
    _check_trigger_rates(ledger, space)


def _needed_rates(space: Space) -> set[int]:
    """Components whose activation rate enters a utilisation or a load."""
    needed = {
        number
        for number, item in enumerate(space.components)
        if item.processor is not None and (item.execution_ns is not None or item.callback_ns is not None)
    }
    for connection in space.connections:
        stated = connection.rate_hz is not None or connection.data_rate is not None
        if connection.bus is not None and not stated and connection.source is not None:
            needed.add(connection.source)
    frontier = set(needed)
    while frontier:
        upstream = {
            space.connections[number].source
            for target in frontier
            for number in space.components[target].triggers
            if space.connections[number].rate_hz is None and space.connections[number].data_rate is None
            if may_be_event_triggered(space.components[target])
            or "hybrid" in set(leaves(space.components[target].protocol))
        }
        frontier = {item for item in upstream if item is not None} - needed
        needed |= frontier
    return needed


def _check_trigger_rates(ledger: Ledger, space: Space) -> None:
    """A connection from the boundary, or with a data rate, must tell how often it delivers when it triggers something."""
    needed = _needed_rates(space)
    for number in sorted(needed):
        component = space.components[number]
        if not (may_be_event_triggered(component) or "hybrid" in set(leaves(component.protocol))):
            continue
        for trigger in component.triggers:
            connection = space.connections[trigger]
            path = ("connections", connection.name)
            if connection.data_rate is not None and any(not size for size in leaves(connection.size_bytes)):
                ledger.error(path, f"it triggers {component.name!r}: its `data_rate` needs a `data_size` to tell the rate")
            elif connection.source is None and connection.rate_hz is None and connection.data_rate is None:
                ledger.error(path, f"it triggers {component.name!r} from the system boundary: give it a `rate`")
    for connection in space.connections:
        unknown = connection.source is None and connection.rate_hz is None and connection.data_rate is None
        if unknown and connection.bus is not None and not _only_in_flows(space, connection):
            ledger.error(("connections", connection.name), "its load needs a `rate` or `data_rate`")


def _only_in_flows(space: Space, connection: Connection) -> bool:
    """Whether nobody can ask for the load of what carries the connection: virtual buses without a bandwidth."""
    buses = [space.buses[leaf] for leaf in leaves(connection.bus) if leaf is not None]
    return all(bus.virtual and bus.bandwidth_bps is None and bus.carrier is None for bus in buses)
