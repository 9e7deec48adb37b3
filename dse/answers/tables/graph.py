"""The architecture of a design as a networkx graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dse.analysis.binding import bus_stack
from dse.analysis.diagnosis.front_verdicts import core_by, cores_of
from dse.analysis.views import View
from dse.space.model.space import EMPTY, Design, Space, at_home
from dse.space.model.trees import at

if TYPE_CHECKING:
    import networkx


SHOWN = ("type", "dispatch_protocol", "period", "process", "processor", "bus", "data_size")
"""Fields that nodes and edges show in a form of their own."""


def architecture_graph(space: Space, design: Design) -> networkx.MultiDiGraph[str]:
    """Threads, devices, processors and buses as nodes; connections and bindings as edges.

    Nodes have `kind` (``thread``, ``device``, ``abstract``, ``processor``, ``bus``) and, where they apply, `type`,
    `dispatch_protocol`, `period_ns`, `process`, and on a processor with several cores `core` (from 1) and `core_by`
    (``stated``, ``decided`` or ``first-fit``). Edges have `kind`: ``connection`` (key: its name; `buses`,
    `size_bytes`), ``runs on`` (thread to processor), ``carried by`` (virtual bus to bus). What else was decided of a
    component, slot or connection stands there by the name of its field, as text. Empty slots are left out.

    Parameters
    ----------
    space
        the space of the problem: `Problem.space`, `Result.space`.
    design
        one of its designs, such as `Point.design`.

    Examples
    --------
    >>> import dse
    >>> result = dse.solve("pump.yaml")
    >>> sorted(architecture_graph(result.space, result.front[0].design))[:3]
    ['can0', 'computer', 'control']
    """
    import networkx

    graph: networkx.MultiDiGraph[str] = networkx.MultiDiGraph(name=space.name)
    view = View(design)
    decided = _decided(space, view)
    for kind, slots in (("processor", space.processors), ("bus", space.buses)):
        for slot in slots:
            chosen = slot.types[view[slot.type_decision]]
            if chosen != EMPTY:
                graph.add_node(slot.name, kind=kind, type=chosen, **decided.get(slot.name, {}))
    cores = cores_of(space, design)
    for number, component in enumerate(space.components):
        facts = {
            "dispatch_protocol": at(component.protocol, view),
            "period_ns": at(component.period_ns, view),
            "process": at(at_home(space.components, number).process, view),
            "type": _type(space, component.name, view),
            **decided.get(component.name, {}),
            "core": cores.get(number),
            "core_by": core_by(space, component, view) if number in cores else None,
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
        facts |= decided.get(connection.name, {})
        graph.add_edge(ends[0], ends[1], key=connection.name, kind="connection", **facts)
    for bus in space.buses:
        if bus.name in graph:
            carrier = at(bus.carrier, view)
            if carrier is not None:
                graph.add_edge(bus.name, space.buses[carrier].name, key="carried by", kind="carried by")
    return graph


def _decided(space: Space, view: View) -> dict[str, dict[str, str]]:
    """The options that a design takes in its other open decisions, by component and field."""
    decided: dict[str, dict[str, str]] = {}
    for decision, option in zip(space.decisions, view.design, strict=True):
        if decision.is_open and option >= 0 and decision.field not in SHOWN:
            decided.setdefault(decision.component, {})[decision.field] = decision.options[option]
    return decided


def _type(space: Space, name: str, view: View) -> str | None:
    """The type that a thread or device takes its fields from, decided or not."""
    reference = space.references.get(f"{name}.type")
    return None if reference is None else reference.texts.get(at(reference.tree, view))
