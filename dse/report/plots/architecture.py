"""The architecture of a design as SVG: components in layers, coloured by processor; connections coloured by bus.

Every element stands on a line of its own, and only texts and classes depend on the design: the drawings of two designs
of one problem differ in a few lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from html import escape
from itertools import pairwise

from dse.analysis.binding import bus_stack
from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.rates import rate_hz
from dse.analysis.views import View
from dse.report.amounts import shortened
from dse.report.theme import LIGHT, with_colours
from dse.space.model.space import EMPTY, Component, Design, Slot, Space
from dse.space.model.trees import at
from dse.support.units import format_duration, format_number, format_rate

STEP_X, STEP_Y = 178, 92
BOX_W, BOX_H = 164, 50
MARGIN = 14
NAME_LENGTH = 22
HUES = 6

STYLE = """
.arch text { font: 11px system-ui, sans-serif; fill: var(--ink); }
.arch .name { font-weight: 600; }
.arch .small { fill: var(--soft); font-size: 10px; }
.arch .box { fill: var(--panel); stroke: var(--line); stroke-width: 1.2; }
.arch .device { rx: 0; stroke-dasharray: 4 2; }
.arch .edge { fill: none; stroke: var(--soft); stroke-width: 1.3; }
.arch .flow { stroke-width: 3; }
.arch .tip { fill: var(--soft); }
.arch .p0 { fill: var(--c1); } .arch .p1 { fill: var(--c2); } .arch .p2 { fill: var(--c4); }
.arch .p3 { fill: var(--c3); } .arch .p4 { fill: var(--c5); } .arch .p5 { fill: var(--c6); }
.arch .b0 { stroke: var(--c1); } .arch .b1 { stroke: var(--c2); } .arch .b2 { stroke: var(--c4); }
.arch .b3 { stroke: var(--c3); } .arch .b4 { stroke: var(--c5); } .arch .b5 { stroke: var(--c6); }
.arch .again { stroke-dasharray: 9 3; }
.arch .local { stroke: var(--line); stroke-dasharray: 2 3; }
.arch .empty { opacity: 0.35; }
"""


class Drafter:
    """Draws the designs of a space over one common layout."""

    def __init__(self, space: Space) -> None:
        self.space = space
        self.wires = [
            (number, item.source, item.target)
            for number, item in enumerate(space.connections)
            if item.source is not None and item.target is not None
        ]
        self.layout: Layout = layered(len(space.components), [(source, target) for _, source, target in self.wires])
        self.in_flows = {
            number
            for flow in space.flows
            for step in flow.steps
            for number in ([step.index] if step.kind == "connection" else [] if step.via is None else [step.via])
        }
        self.legend_y = self.layout.height * STEP_Y + MARGIN
        used = [*space.processors, *space.buses]
        self.per_row = max(2, int((self.layout.width * STEP_X) // 230))
        self.width = max(self.layout.width * STEP_X, min(len(used), self.per_row) * 230) + 2 * MARGIN
        self.height = self.legend_y + (len(used) + self.per_row - 1) // self.per_row * 40 + MARGIN

    def lines(self, design: Design) -> Iterator[str]:
        """The drawing, an element to a line; colours are CSS variables, classes those of `STYLE`."""
        view, cores = View(design), cores_of(self.space, design)
        title = escape(f"Architecture of {self.space.name}: components, connections and bindings")
        style = f"style='max-width: {self.width:.0f}px'"
        size = f"viewBox='0 0 {self.width:.0f} {self.height:.0f}' width='{self.width:.0f}' height='{self.height:.0f}'"
        yield f"<svg class='arch' xmlns='http://www.w3.org/2000/svg' role='img' {size} {style}>"
        yield f"<title>{title}</title>"
        for (number, _, _), route in zip(self.wires, self.layout.routes, strict=True):
            yield self._edge(number, route, view)
        for number, component in enumerate(self.space.components):
            yield from self._node(number, component, view, cores)
        for position, slot in enumerate([*self.space.processors, *self.space.buses]):
            yield from self._slot(position, slot, view)
        yield "</svg>"

    def standalone(self, design: Design) -> str:
        """The drawing as a file of its own, in light colours."""
        first, *rest = self.lines(design)
        paper = f"<rect width='{self.width:.0f}' height='{self.height:.0f}' fill='var(--paper)'/>"
        style = f"<style>{STYLE}</style>"
        return "\n".join([first, with_colours(style, LIGHT), with_colours(paper, LIGHT), *rest]) + "\n"

    def _edge(self, number: int, route: tuple[tuple[float, int], ...], view: View) -> str:
        connection = self.space.connections[number]
        stack = bus_stack(self.space, connection, view)
        kind = self._bus_class(stack[0]) if stack else "local"
        names = " over ".join(self.space.buses[bus].name for bus in stack) or "no bus"
        text = escape(f"{connection.name}: {names}")
        flow = " flow" if number in self.in_flows else ""
        return f"<path class='edge {kind}{flow}' d='{_path(route)}'><title>{text}</title></path>"

    def _bus_class(self, bus: int) -> str:
        """Buses have the hues after those of the processors; where these begin again, lines are dashed."""
        position = len(self.space.processors) + bus
        return f"b{position % HUES}" + (" again" if position >= HUES else "")

    def _node(self, number: int, component: Component, view: View, cores: Mapping[int, int]) -> Iterator[str]:
        column, layer = self.layout.place[number]
        x, y = MARGIN + column * STEP_X + (STEP_X - BOX_W) / 2, MARGIN + layer * STEP_Y
        processor = at(component.processor, view)
        yield f"<g transform='translate({x:.1f} {y:.1f})'><title>{escape(component.name)}</title>"
        yield f"<rect class='box {component.section[:-1]}' width='{BOX_W}' height='{BOX_H}' rx='5'/>"
        hue = f"p{processor % HUES}" if processor is not None else "local"
        yield (
            f"<rect class='{hue}' width='5' height='{BOX_H}' rx='2'/>"
            if processor is not None
            else "<!-- no processor -->"
        )
        yield f"<text class='name' x='11' y='16'>{escape(shortened(component.name, NAME_LENGTH))}</text>"
        yield f"<text class='small' x='11' y='30'>{escape(self._activation(number, component, view))}</text>"
        runs = f"on {self.space.processors[processor].name}" if processor is not None else component.category
        if number in cores:
            runs = f"{shortened(runs, 20)}, core {cores[number]}"
        yield f"<text class='small' x='11' y='43'>{escape(shortened(runs, 28))}</text></g>"

    def _activation(self, number: int, component: Component, view: View) -> str:
        protocol, period = at(component.protocol, view), at(component.period_ns, view)
        if period is not None:
            return f"{protocol or 'periodic'}, {format_duration(period)}"
        rate = rate_hz(self.space, ("activation", number), view)
        return f"{protocol or 'event-triggered'}" + (f", {_rate(rate)}" if rate else "")

    def _slot(self, position: int, slot: Slot, view: View) -> Iterator[str]:
        processors = len(self.space.processors)
        x, y = MARGIN + position % self.per_row * 230, self.legend_y + position // self.per_row * 40
        chosen = slot.types[view[slot.type_decision]]
        empty = " class='empty'" if chosen == EMPTY else ""
        yield f"<g transform='translate({x} {y})'{empty}>"
        if position < processors:
            yield f"<rect class='p{position % HUES}' width='20' height='20' rx='3'/>"
        else:
            yield f"<path class='edge flow {self._bus_class(position - processors)}' d='M0 10 h20'/>"
        yield f"<text class='name' x='27' y='9'>{escape(shortened(slot.name, 30))}</text>"
        kind = "processor" if position < processors else "virtual bus" if getattr(slot, "virtual", False) else "bus"
        said = "empty" if chosen == EMPTY else "" if chosen == slot.name else chosen
        yield f"<text class='small' x='27' y='22'>{escape(shortened(f'{kind} {said}'.strip(), 34))}</text></g>"


def _rate(rate: Fraction) -> str:
    return (
        format_rate(rate)
        if rate.denominator == 1
        else f"{float(rate):.4g} Hz"
        if rate < 1000
        else f"{format_number(round(rate))} Hz"
    )


def _path(route: tuple[tuple[float, int], ...]) -> str:
    """A smooth line through the places of a route, downwards or upwards; a loop beside a box that leads to itself."""
    points = [(MARGIN + column * STEP_X + STEP_X / 2, MARGIN + layer * STEP_Y + BOX_H / 2) for column, layer in route]
    if len(set(points)) == 1:
        x, y = points[0][0] + BOX_W / 2, points[0][1]
        return f"M{x:.1f} {y - 8:.1f} c 16 -8 16 24 0 16"
    down = points[-1][1] > points[0][1]
    half = BOX_H / 2 if down else -BOX_H / 2
    ends = [(points[0][0], points[0][1] + half), *points[1:-1], (points[-1][0], points[-1][1] - half)]
    text = f"M{ends[0][0]:.1f} {ends[0][1]:.1f}"
    for (x0, y0), (x1, y1) in pairwise(ends):
        middle = (y0 + y1) / 2
        text += f" C{x0:.1f} {middle:.1f} {x1:.1f} {middle:.1f} {x1:.1f} {y1:.1f}"
    x, y = ends[-1]
    back = -5 if down else 5
    return f"{text} m-4 {back} l4 {-back} l4 {back}"


# A layered drawing of a directed graph: cycles broken, layers by longest path, crossings reduced by barycentres.
#
# Sugiyama, Tagawa and Toda (1981), in its simplest form; the same graph always gives the same drawing.


SWEEPS = 8


@dataclass(frozen=True)
class Layout:
    """`place` has the (column, layer) of each node, a node being 1 wide; `routes` the places that each edge passes.

    A route runs from the edge's source to its target, also where the target lies above.
    """

    place: Mapping[int, tuple[float, int]]
    routes: tuple[tuple[tuple[float, int], ...], ...]
    width: float
    height: int


def layered(count: int, edges: Sequence[tuple[int, int]]) -> Layout:
    """Lay out nodes 0 .. count - 1.

    Examples
    --------
    >>> layered(3, [(0, 1), (0, 2)]).place
    {0: (0.5, 0), 1: (0.0, 1), 2: (1.0, 1)}
    """
    down = _downward(count, edges)
    layer = _layers(count, down)
    rows, chains = _with_bends(count, down, layer)
    neighbours = _neighbours(chains)
    _reduce_crossings(rows, neighbours)
    columns = _columns(rows, neighbours)
    level = {node: number for number, row in enumerate(rows) for node in row}
    place = {node: (columns[node], level[node]) for node in range(count)}
    routes = []
    for (source, target), (upper, _), chain in zip(edges, down, chains, strict=True):
        points = [(columns[node], level[node]) for node in chain]
        routes.append(tuple(points if source in (upper, target) else points[::-1]))
    width = max(columns.values(), default=0.0) + 1
    return Layout(place, tuple(routes), width, len(rows))


def _downward(count: int, edges: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """The edges with those turned round that close a cycle, by a depth-first walk in the order of the nodes."""
    following: dict[int, list[int]] = {node: [] for node in range(count)}
    for source, target in edges:
        following[source].append(target)
    state = [0] * count
    turned: set[tuple[int, int]] = set()
    for root in range(count):
        if state[root]:
            continue
        state[root] = 1
        stack: list[tuple[int, Iterator[int]]] = [(root, iter(following[root]))]
        while stack:
            node, rest = stack[-1]
            target = next(rest, -1)
            if target < 0:
                state[node] = 2
                stack.pop()
            elif state[target] == 1:
                turned.add((node, target))
            elif not state[target]:
                state[target] = 1
                stack.append((target, iter(following[target])))
    return [(target, source) if (source, target) in turned else (source, target) for source, target in edges]


def _layers(count: int, edges: Sequence[tuple[int, int]]) -> list[int]:
    """The longest way from a source to each node; sources stand right above what they feed."""
    layer = [0] * count
    for _ in range(count):
        moved = False
        for source, target in edges:
            if source != target and layer[target] <= layer[source]:
                layer[target] = layer[source] + 1
                moved = True
        if not moved:
            break
    entered = {target for source, target in edges if source != target}
    for node in range(count):
        below = [layer[target] for source, target in edges if source == node and target != node]
        if node not in entered and below:
            layer[node] = min(below) - 1
    return layer


def _with_bends(
    count: int, edges: Sequence[tuple[int, int]], layer: Sequence[int]
) -> tuple[list[list[int]], list[list[int]]]:
    """The nodes of each layer, with a bend for every layer that an edge passes; and the chain of nodes of each edge."""
    rows: list[list[int]] = [[] for _ in range(max(layer, default=-1) + 1)]
    for node in range(count):
        rows[layer[node]].append(node)
    chains = []
    fresh = count
    for source, target in edges:
        chain = [source]
        for between in range(layer[source] + 1, layer[target]):
            rows[between].append(fresh)
            chain.append(fresh)
            fresh += 1
        chains.append([*chain, target])
    return rows, chains


def _neighbours(chains: Sequence[Sequence[int]]) -> dict[int, list[int]]:
    found: dict[int, list[int]] = {}
    for chain in chains:
        for one, other in pairwise(chain):
            if one != other:
                found.setdefault(one, []).append(other)
                found.setdefault(other, []).append(one)
    return found


def _reduce_crossings(rows: list[list[int]], neighbours: Mapping[int, list[int]]) -> None:
    """Order each layer by the mean position of its neighbours in the layer before, downwards and upwards in turn."""
    for sweep in range(SWEEPS):
        order = range(1, len(rows)) if sweep % 2 == 0 else range(len(rows) - 2, -1, -1)
        for number in order:
            fixed = {node: place for place, node in enumerate(rows[number - 1 if sweep % 2 == 0 else number + 1])}
            keys = {}
            for place, node in enumerate(rows[number]):
                near = [fixed[other] for other in neighbours.get(node, []) if other in fixed]
                keys[node] = sum(near) / len(near) if near else float(place)
            rows[number].sort(key=lambda node: keys[node])


def _columns(rows: Sequence[Sequence[int]], neighbours: Mapping[int, list[int]]) -> dict[int, float]:
    """Columns at least 1 apart within a layer, drawn towards the neighbours; the leftmost is 0."""
    widest = max((len(row) for row in rows), default=0)
    columns = {node: place + (widest - len(row)) / 2 for row in rows for place, node in enumerate(row)}
    for _ in range(SWEEPS):
        for row in rows:
            wanted = {
                node: sum(near) / len(near)
                if (near := [columns[other] for other in neighbours.get(node, [])])
                else columns[node]
                for node in row
            }
            low: list[float] = []
            for node in row:
                low.append(max(wanted[node], low[-1] + 1) if low else wanted[node])
            shift = sum(wanted[node] - place for node, place in zip(row, low, strict=True)) / (len(row) or 1)
            columns.update({node: place + shift for node, place in zip(row, low, strict=True)})
    left = min(columns.values(), default=0.0)
    return {node: round(column - left, 3) for node, column in columns.items()}
