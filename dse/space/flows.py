"""End-to-end flows: from the path in the file to components and the connections between them."""

from __future__ import annotations

from collections.abc import Sequence

from dse.space.figures import Ledger, Path
from dse.space.types import Component, Connection, Flow, Step
from dse.spec.model import Spec


def build_flows(
    ledger: Ledger, spec: Spec, components: Sequence[Component], connections: Sequence[Connection]
) -> tuple[Flow, ...]:
    """Every flow of the problem, connected."""
    by_name = {item.name: number for number, item in enumerate(components)}
    wires = {item.name: number for number, item in enumerate(connections)}
    result = []
    for name, given in spec.flows.items():
        path: Path = ("flows", name, "path")
        unknown = [element for element in given.path if element not in by_name and element not in wires]
        for element in unknown:
            where = (*path, given.path.index(element))
            ledger.unknown(where, "component or connection", element, [*by_name, *wires])
        steps = () if unknown else _steps(ledger, path, given.path, by_name, wires, components, connections)
        required = (given.latency.min_ns, given.latency.max_ns) if given.latency else None
        result.append(Flow(name, steps, required))
    return tuple(result)


def _steps(
    ledger: Ledger,
    path: Path,
    elements: Sequence[str],
    by_name: dict[str, int],
    wires: dict[str, int],
    components: Sequence[Component],
    connections: Sequence[Connection],
) -> tuple[Step, ...]:
    steps: list[Step] = []
    previous: int | None = None
    wire: int | None = None
    for position, element in enumerate(elements):
        where = (*path, position)
        if element in by_name:
            here = by_name[element]
            if wire is None and previous is not None:
                wire = _only_connection(ledger, where, previous, here, components, connections)
                if wire is None:
                    return ()
                steps.append(Step("connection", wire))
            if wire is not None and connections[wire].target != here:
                ledger.error(where, f"connection {connections[wire].name!r} does not lead to {element!r}")
                return ()
            steps.append(Step("component", here, wire, previous))
            previous, wire = here, None
        else:
            number = wires[element]
            if wire is not None:
                ledger.error(where, f"expected a component between {connections[wire].name!r} and {element!r}")
                return ()
            if previous is not None and connections[number].source != previous:
                ledger.error(where, f"connection {element!r} does not start at {components[previous].name!r}")
                return ()
            steps.append(Step("connection", number))
            wire = number
            if previous is None:
                previous = connections[number].source
    return tuple(steps)


def _only_connection(
    ledger: Ledger,
    where: Path,
    source: int,
    target: int,
    components: Sequence[Component],
    connections: Sequence[Connection],
) -> int | None:
    """The one connection between two neighbours of a path; none or several are mistakes."""
    found = [
        number for number, item in enumerate(connections) if item.source == source and item.target == target
    ]  # fmt: skip
    one, other = components[source].name, components[target].name
    if not found:
        ledger.error(where, f"no connection from {one!r} to {other!r}")
        return None
    if len(found) > 1:
        names = ", ".join(connections[number].name for number in found)
        ledger.error(where, f"several connections from {one!r} to {other!r}", f"name one of them in the path: {names}")
        return None
    return found[0]
