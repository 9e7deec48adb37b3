"""Who dispatches whom: trigger connections, and the mistakes that no choice of options can mend."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from dse.importers.registry import STORED_PORTS
from dse.space.architecture.joins import ALL, BY_MESSAGES, may_join
from dse.space.model.arrivals import BY_INPUTS
from dse.space.model.space import Component, Connection, Space
from dse.space.model.trees import leaves
from dse.space.properties import Ledger, closest
from dse.spec.schema.model import Spec
from dse.support.graphs import shortest_cycle, strong_components
from dse.support.units import shown


def with_triggers(
    ledger: Ledger, spec: Spec, components: Sequence[Component], connections: Sequence[Connection]
) -> tuple[Component, ...]:
    """The components with their incoming connections and those that dispatch them.

    New components; `incoming` and `triggers` are indices of connections. A stated `dispatch_trigger` selects among the
    event connections.
    """
    names = {connection.name: number for number, connection in enumerate(connections)}
    arriving: list[list[int]] = [[] for _ in components]
    for number, connection in enumerate(connections):
        if connection.target is not None:
            arriving[connection.target].append(number)
    result: list[Component] = []
    for component, found in zip(components, arriving, strict=True):
        incoming = tuple(found)
        triggers = tuple(n for n in incoming if _dispatches(connections[n], component))
        stated = spec.threads[component.stated_as].dispatch_trigger if component.section == "threads" else None
        if component.part_of or (component.pieces is not None and len(result) != component.pieces.members[0]):
            stated = None
        if stated is not None:
            own = [connections[n].name for n in incoming]
            _check_triggers(ledger, component, stated, own, names)
            triggers = tuple(names[name] for name in stated if name in own)
        result.append(replace(component, incoming=incoming, triggers=triggers))
    return tuple(result)


def _dispatches(connection: Connection, target: Component) -> bool:
    """Whether what comes over a connection dispatches its target, where no triggers are stated.

    Shared data (``category: data``) take whatever is written, at once: they only pass on how often that is.
    """
    is_written = connection.port == "data_access" and target.category == "data"
    return is_written or connection.port not in STORED_PORTS


def _check_triggers(
    ledger: Ledger, component: Component, stated: Sequence[str], own: Sequence[str], names: Mapping[str, int]
) -> None:
    """Every stated trigger is an incoming connection."""
    for position, name in enumerate(stated):
        if name in own:
            continue
        path = ("threads", component.stated_as, "dispatch_trigger", position)
        if name not in names:
            ledger.unknown(path, "connection", name, own or names)
        elif not ledger.is_doubtful(f"{name}.to", name, component.stated_as):
            message = f"connection {shown(name)} does not lead to {shown(component.stated_as)}"
            ledger.error(path, message, closest(name, own))
        ledger.doubt(f"{component.stated_as}.dispatch_trigger")


def may_be_event_triggered(component: Component) -> bool:
    """Whether some option makes the component aperiodic, sporadic, or leaves it without a period.

    Judged over all leaves of protocol and period, without a design.
    """
    return any(leaf in BY_INPUTS for leaf in leaves(component.protocol)) or (
        any(leaf is None for leaf in leaves(component.protocol))
        and any(leaf is None for leaf in leaves(component.period_ns))
    )


def must_be_event_triggered(component: Component) -> bool:
    """Whether every option does."""
    protocols = set(leaves(component.protocol))
    periods = set(leaves(component.period_ns))
    return protocols <= set(BY_INPUTS) or (protocols <= {None, *BY_INPUTS} and periods == {None})


def _may_pass_rates_on(component: Component) -> bool:
    """Whether the rate of a component follows from its inputs, in some design."""
    is_hybrid = "hybrid" in set(leaves(component.protocol))
    return may_be_event_triggered(component) or (is_hybrid and may_join(component))


def _must_pass_rates_on(component: Component) -> bool:
    """Whether it does in every design."""
    if must_be_event_triggered(component):
        return True
    return set(leaves(component.protocol)) <= BY_MESSAGES and set(leaves(component.join)) == {ALL}


def trigger_graph(space: Space) -> dict[int, set[int]]:
    """For each component those that it dispatches at its own rate, where the rates of both may follow from inputs.

    Indices of components. A cycle in it is a set of components whose rates would follow from each other.
    """
    graph: dict[int, set[int]] = {number: set() for number in range(len(space.components))}
    eager = [_may_pass_rates_on(component) for component in space.components]
    for target, component in enumerate(space.components):
        for number in component.triggers if eager[target] else ():
            connection = space.connections[number]
            if connection.sender is not None and eager[connection.sender]:
                graph[connection.sender].add(target)
    return graph


def check_activation(ledger: Ledger, space: Space) -> None:
    """Report cycles of event-triggered components, and rates that are needed but come from nowhere.

    Mistakes go to `ledger` with their places. The OSATE profiles accept components that nothing dispatches (rate 0).
    """
    _check_cycles(ledger, space)
    if not ledger.loaded.remains.is_whole:  # what was taken out may have told a rate
        return
    if space.profile != "dse":  # OSATE analyses what is there: what nothing starts runs at a rate of 0
        return
    needed = _needed_rates(space)
    _check_sources(ledger, space, needed)
    for connection in space.connections:
        _check_delivery(ledger, space, connection, needed)


def _possible_cycles(space: Space) -> Iterator[str]:
    """Components that would dispatch each other in a cycle in some designs: ``a -> b -> a``.

    One shortest cycle for each set of components that all reach each other. Such designs have no rates and are none.
    """
    graph = {source: sorted(targets) for source, targets in trigger_graph(space).items()}
    for members in strong_components(graph):
        first = min(members)
        if len(members) > 1 or first in graph[first]:
            cycle = [space.components[number].name for number in shortest_cycle(graph, first)]
            yield " -> ".join([*cycle, cycle[0]])


def exclusions(space: Space) -> Iterator[str]:
    """Which combinations of options are no designs, though nothing in the file forbids them: sentences for people.

    Such designs are left out of the space, and every answer says so.
    """
    for cycle in _possible_cycles(space):
        yield f"designs are excluded in which event-triggered components dispatch each other in a cycle: {cycle}"


def _check_cycles(ledger: Ledger, space: Space) -> None:
    """A cycle of components that are event-triggered whatever is chosen has no rate in any design."""
    always = {number for number, item in enumerate(space.components) if _must_pass_rates_on(item)}
    graph = {source: sorted(targets & always) for source, targets in trigger_graph(space).items() if source in always}
    for members in strong_components(graph):
        first = min(members)
        if len(members) == 1 and first not in graph[first]:
            continue
        cycle = [space.components[number] for number in shortest_cycle(graph, first)]
        if ledger.is_doubtful(*(item.name for item in cycle)):
            continue
        names = " -> ".join(item.name for item in [*cycle, cycle[0]])
        message = f"event-triggered components dispatch each other in a cycle and have no rate: {names}"
        hint = "make one of them periodic, or state the `rate` of a connection of the cycle"
        ledger.error((cycle[0].section, cycle[0].stated_as), message, hint)


def _check_sources(ledger: Ledger, space: Space, needed: set[int]) -> None:
    """A component whose rate matters has a period, or something that triggers it."""
    misdirected = any(ledger.is_doubtful(f"{connection.name}.to") for connection in space.connections)
    for number in sorted(needed):
        component = space.components[number]
        name = component.stated_as
        if component.triggers or not may_be_event_triggered(component):
            continue
        if misdirected or ledger.is_doubtful(name, f"{name}.dispatch_trigger", f"{name}.period"):
            continue
        silent = [space.connections[wire].name for wire in component.incoming]
        hint = f"{silent[0]} leads to a `data` port, which triggers nothing" if silent else ""
        if any(leaf in BY_INPUTS for leaf in leaves(component.protocol)):
            path = (component.section, name, "dispatch_protocol")
            hint = hint or _as_timer(component)
            ledger.error(path, "event-triggered, but no connection triggers it, and its rate is needed", hint)
        else:
            message = "its rate is needed, but it has no `period` and no connection triggers it"
            ledger.error((component.section, name), message, hint or "give it a `period`, or its connections a `rate`")


def _as_timer(component: Component) -> str:
    """The hint for a sporadic thread that something outside the file triggers."""
    is_sporadic = "sporadic" in leaves(component.protocol) and any(leaves(component.period_ns))
    return "as often as it may come, once in each `period`, it is `periodic`" if is_sporadic else ""


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


def _check_delivery(ledger: Ledger, space: Space, connection: Connection, needed: set[int]) -> None:
    """A connection whose rate matters must tell it where no sender does: from the boundary, or with a data rate."""
    path, name = ("connections", connection.name), connection.name
    target = _triggered(space, connection) if connection.target in needed else None
    if connection.data_rate is not None:
        if target is not None and any(not size for size in leaves(connection.size_bytes)):
            message = f"it triggers {shown(target.name)}: its `data_rate` needs a `data_size` to tell the rate"
            ledger.error(path, message)
            ledger.doubt(f"{name}.data_size")
        return
    if connection.source is not None or connection.rate_hz is not None or ledger.is_doubtful(name, f"{name}.from"):
        return
    loads = connection.bus is not None and not _only_in_flows(space, connection)
    if target is not None and not ledger.is_doubtful(target.name):
        ledger.error(path, f"it triggers {shown(target.name)} from the system boundary: give it a `rate`")
    elif loads:
        ledger.error(path, "it comes from the system boundary: its load needs a `rate` or `data_rate`")


def _triggered(space: Space, connection: Connection) -> Component | None:
    """The component that works at the rate of the connection, in some design; None when there is none."""
    if connection.target is None:
        return None
    target = space.components[connection.target]
    listens = may_be_event_triggered(target) or "hybrid" in set(leaves(target.protocol))
    is_trigger = any(space.connections[number] is connection for number in target.triggers)
    return target if listens and is_trigger else None


def _only_in_flows(space: Space, connection: Connection) -> bool:
    """Whether nobody can ask for the load of what carries the connection: virtual buses without a bandwidth."""
    buses = [space.buses[leaf] for leaf in leaves(connection.bus) if leaf is not None]
    return all(bus.virtual and bus.bandwidth_bps is None and bus.carrier is None for bus in buses)
