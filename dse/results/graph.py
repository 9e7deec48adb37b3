"""The architecture of a design as a networkx graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dse.analysis.binding import bus_stack
from dse.analysis.views import View
from dse.space.trees import at
from dse.space.types import EMPTY, Design, Space

if TYPE_CHECKING:
    import networkx


def architecture_graph(space: Space, design: Design) -> networkx.MultiDiGraph[str]:
    """Threads, devices, processors and buses as nodes; connections and bindings as edges.

    Nodes have `kind` (``thread``, ``device``, ``abstract``, ``processor``, ``bus``) and, where they apply, `type`,
    `dispatch_protocol`, `period_ns`, `process`. Edges have `kind`: ``connection`` (key: its name; `buses`,
    `size_bytes`), ``runs on`` (thread to processor), ``carried by`` (virtual bus to bus). Empty slots are left out.
    """
    import networkx

    graph: networkx.MultiDiGraph[str] = networkx.MultiDiGraph(name=space.name)
    view = View(design)
    for kind, slots in (("processor", space.processors), ("bus", space.buses)):
        for slot in slots:
            chosen = slot.types[view[slot.type_decision]]
            if chosen != EMPTY:
                graph.add_node(slot.name, kind=kind, type=chosen)
    for component in space.components:
        facts = {
            "dispatch_protocol": at(component.protocol, view),
            "period_ns": at(component.period_ns, view),
            "process": at(component.process, view),
        }
        graph.add_node(component.name, kind=component.category, **{k: v for k, v in facts.items() if v is not None})
        processor = at(component.processor, view)
        if processor is not None:
            graph.add_edge(component.name, space.processors[processor].name, key="runs on", kind="runs on")
    for connection in space.connections:
        ends = [
            space.components[end].name if end is not None else None for end in (connection.source, connection.target)
        ]
        if ends[0] is None or ends[1] is None:
            continue
        buses = [space.buses[number].name for number in bus_stack(space, connection, view)]
        facts = {"buses": buses, "size_bytes": at(connection.size_bytes, view)}
        graph.add_edge(ends[0], ends[1], key=connection.name, kind="connection", **facts)
    for bus in space.buses:
        if bus.name in graph:
            carrier = at(bus.carrier, view)
            if carrier is not None:
                graph.add_edge(bus.name, space.buses[carrier].name, key="carried by", kind="carried by")
    return graph
