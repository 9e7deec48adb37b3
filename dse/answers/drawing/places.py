"""Where everything of a drawing stands: areas side by side, devices and bars above and below, lines between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from dse.answers.drawing.layout import Graph, Layers, apart, layered, ranks
from dse.answers.drawing.parts import Area, DrawnParts
from dse.answers.drawing.texts import TextLine, Texts, columns
from dse.space.model.space import Connection, Space
from dse.space.model.trees import leaves

STEP_X, BOX_W = 210, 194
GAP_Y = 24
LINE_H = 14
MARGIN, PAD = 16, 12
HEADER = 30
BAR_H, BAR_STEP = 22, 40
LANE = 9
LETTER = 6.6
"""The width of a column of text, a little generously, for who draws without measuring letters."""
LEGEND = 230


@dataclass(frozen=True)
class Edge:
    """A line of an area: over these connections, on to the bar of a bus where there is one, arrows at its ends."""

    connections: Sequence[int]
    bus: int | None = None
    at_start: bool = False
    at_end: bool = True


@dataclass(frozen=True)
class Placed:
    """An area on the drawing: its layout and its place.

    `nodes` are threads, and doors to buses, devices and lanes outside, each as its kind and index; `edges` lead from
    node to node, by their `ends`.
    """

    area: Area
    layout: Layers
    nodes: tuple[tuple[str, int], ...]
    edges: tuple[Edge, ...]
    ends: tuple[tuple[int, int], ...]
    x: float
    width: float


class DrawnPlaces:
    """The places of the parts of a space, for the problem and for each of its designs.

    Coordinates are in px from the upper left corner. They depend on the problem only; a design changes texts and styles
    of lines.
    """

    def __init__(self, space: Space, *, for_designs: bool = True) -> None:
        """`for_designs` leaves room for the core of each thread, which only drawings of designs show."""
        self.space = space
        self.parts = DrawnParts(space)
        above, self.upper_buses = self.parts.above
        self.devices_above = [one for one in self.parts.alone if one in above]
        self.devices_below = [one for one in self.parts.alone if one not in above]
        self.texts = Texts(space, None, {})
        lines = max((len(self.texts.component(number)) for number in range(len(space.components))), default=1)
        self.box_h = 12 + LINE_H * (1 + max(lines, 2 if for_designs and self._names_cores() else 1))
        self.step_y = self.box_h + GAP_Y
        self.rows = self._rows()
        self.height_in_rows = max(self.rows.values(), default=-1) + 1
        self.lanes = self._lanes()
        self.doors: dict[tuple[str, int], list[float]] = {}
        self.placed: list[Placed] = []
        x: float = MARGIN
        for area in self.parts.areas:
            one = self._laid_out(area, x)
            self.placed.append(one)
            x += one.width + MARGIN * 1.5
            for (kind, number), centre in zip(one.nodes, one.layout.centres, strict=True):
                if kind != "thread":
                    self.doors.setdefault((kind, number), []).append(self._node_x(one, centre))
        self._place_devices()
        self._place_bars()
        self._stack()

    def _names_cores(self) -> bool:
        return any(count is not None and count > 1 for item in self.space.processors for count in leaves(item.cores))

    # ------------------------------------------------------------------------------------------------------ places

    def _rows(self) -> dict[int, int]:
        """The row of each thread, one for all areas: below what it gets its data from."""
        threads = list(self.parts.home)
        index = {number: place for place, number in enumerate(threads)}
        edges = [
            (index[item.source], index[item.target])
            for item in self.space.connections
            if item.source in index and item.target in index
        ]
        row_of = ranks(len(threads), edges)
        used = {row: place for place, row in enumerate(sorted(set(row_of)))}
        return {number: used[row_of[place]] for number, place in index.items()}

    def _lanes(self) -> dict[int, tuple[int, int]]:
        """Links from an area to another that do not lead to the next row: each takes a lane below the areas."""
        home = self.parts.home
        return dict(
            enumerate(
                (source, target)
                for source, target in self.parts.links
                if source in home
                and target in home
                and home[source] != home[target]
                and self.rows[target] != self.rows[source] + 1
            )
        )

    def _laid_out(self, area: Area, x: float) -> Placed:
        """The layout of an area: its threads, and a door for each bus and device outside that these are linked with."""
        nodes: list[tuple[str, int]] = [("thread", number) for number in area.members]
        index = {key: node for node, key in enumerate(nodes)}
        layers = [self.rows[number] for number in area.members]
        lanes = {pair: lane for lane, pair in self.lanes.items()}
        ends: list[tuple[int, int]] = []
        edges: list[Edge] = []

        def join(thread: int, door: tuple[str, int], edge: Edge, *, above: bool) -> None:
            """An edge between a thread and a door; that of the upper one to the lower one."""
            if door not in index:
                index[door] = len(nodes)
                nodes.append(door)
                layers.append(-1 if above else self.height_in_rows)
            both = index["thread", thread], index[door]
            ends.append(both[::-1] if above else both)
            edges.append(edge)

        for (number, bus), use in self.parts.uses.items():
            if ("thread", number) in index:
                above = bus in self.upper_buses
                arrows = (use.sends, use.receives) if above else (use.receives, use.sends)
                join(number, ("bus", bus), Edge(use.connections, bus, *arrows), above=above)
        for (source, target), connections in self.parts.links.items():
            sends, receives = ("thread", source) in index, ("thread", target) in index
            if sends and receives:
                ends.append((index["thread", source], index["thread", target]))
                edges.append(Edge(connections))
            elif (sends or receives) and (lane := lanes.get((source, target))) is not None:
                join(
                    source if sends else target,
                    ("lane", lane),
                    Edge(connections, None, receives, at_end=False),
                    above=False,
                )
            elif (receives and source in self.parts.alone) or (sends and target in self.parts.alone):
                thread, device = (target, source) if receives else (source, target)
                above = device in self.devices_above
                edge = Edge(connections, None, above != receives, above == receives)
                join(thread, ("device", device), edge, above=above)
        heavy = [number for number, edge in enumerate(edges) if self.in_flow(edge.connections)]
        layout = layered(Graph(layers, ends, self.height_in_rows, heavy))
        name, kind = self.area_title(area, self.texts)
        width = max(layout.width * STEP_X + 2 * PAD, LETTER * columns(f"{name}  {kind.text}") + 4 * PAD)
        return Placed(area, layout, tuple(nodes), tuple(edges), tuple(ends), x, width)

    def in_flow(self, connections: Sequence[int]) -> bool:
        """Whether a flow passes one of the connections."""
        return not self.parts.in_flows.isdisjoint(connections)

    def _node_x(self, one: Placed, column: float) -> float:
        """The place across of a node of an area, in pixels."""
        return one.x + one.width / 2 + (column - one.layout.width / 2) * STEP_X

    def _place_devices(self) -> None:
        """Devices stand where the doors to them and to their buses are."""
        self.device_x: dict[int, float] = {}
        for devices in (self.devices_above, self.devices_below):
            wanted: dict[int, float] = {}
            for one in devices:
                keys = [("device", one), *(("bus", bus) for other, bus in self.parts.uses if other == one)]
                near = [x for key in keys for x in self.doors.get(key, [])]
                wanted[one] = sum(near) / len(near) if near else max(wanted.values(), default=MARGIN + BOX_W / 2)
            order = sorted(devices, key=lambda one: wanted[one])
            self.device_x |= _inside(apart(order, wanted, dict.fromkeys(order, float(STEP_X))), BOX_W)

    def _place_bars(self) -> None:
        """Bars reach from the first to the last of their users; short ones stand side by side."""
        self.bars: dict[int, tuple[float, float]] = {}
        for is_upper in (True, False):
            wanted: dict[int, float] = {}
            spans: dict[int, float] = {}
            for bus, slot in enumerate(self.space.buses):
                users = [self.device_x[one] for one, other in self.parts.uses if other == bus and one in self.device_x]
                places = [*self.doors.get(("bus", bus), []), *users]
                if not places or (bus in self.upper_buses) != is_upper:
                    continue
                length = LETTER * columns(f"{slot.name}  {self.texts.slot(slot).text}") + 24
                reach = max(places) - min(places) + 24
                middle = (max(places) + min(places)) / 2
                if len(places) > 2 and reach > length:
                    self.bars[bus] = (middle - reach / 2, middle + reach / 2)
                else:
                    wanted[bus], spans[bus] = middle, length + 12
            order = sorted(wanted, key=lambda bus: wanted[bus])
            centres = apart(order, wanted, spans)
            shift = max([0.0, *(MARGIN + spans[bus] / 2 - x for bus, x in centres.items())])
            self.bars |= {
                bus: (x + shift - spans[bus] / 2 + 6, x + shift + spans[bus] / 2 - 6) for bus, x in centres.items()
            }

    def on_bar(self, bus: int, x: float) -> float:
        """The place on a bar that is nearest to a place.

        A horizontal coordinate in px, at least 14 px from the ends of the bar of `bus`.
        """
        start, end = self.bars[bus]
        return min(max(x, start + 14), end - 14)

    def _stack(self) -> None:
        """Heights: devices, bars, areas, bars, devices, legend, from above to below."""
        y: float = MARGIN + HEADER
        self.above_y = y
        y += self.box_h + GAP_Y if self.devices_above else 0
        self.bar_y: dict[int, float] = {}
        y = self._stack_bars([bus for bus in self.bars if bus in self.upper_buses], y)
        self.area_y = y
        self.area_h = HEADER + self.height_in_rows * self.step_y
        y += self.area_h + GAP_Y
        self.lane_y = {lane: y - GAP_Y / 2 + place * LANE for place, lane in enumerate(self.lanes)}
        y += len(self.lanes) * LANE
        y = self._stack_bars([bus for bus in self.bars if bus not in self.upper_buses], y)
        self.below_y = y
        y += self.box_h + GAP_Y if self.devices_below else 0
        right = [one.x + one.width for one in self.placed]
        right += [x + BOX_W / 2 for x in self.device_x.values()] + [end for _, end in self.bars.values()]
        self.width = max([*right, MARGIN + 2 * LEGEND, MARGIN + 7.6 * columns(self.space.name)]) + MARGIN
        self.legend_y = y
        self.per_row = max(1, int((self.width - 2 * MARGIN) // LEGEND))
        self.height = y + -(-len(self.legend(decided=False)) // self.per_row) * 20 + MARGIN

    def _stack_bars(self, buses: Sequence[int], y: float) -> float:
        """Bars on lines, each on the first line with room; where the lines end."""
        lines: list[list[tuple[float, float]]] = []
        for bus in sorted(buses, key=lambda bus: self.bars[bus][1] - self.bars[bus][0]):
            start, end = self.bars[bus]
            row = next(
                (
                    number
                    for number, line in enumerate(lines)
                    if all(end + 2 < other or last + 2 < start for other, last in line)
                ),
                len(lines),
            )
            lines += [[]] * (row == len(lines))
            lines[row] = [*lines[row], (start, end)]
            self.bar_y[bus] = y + row * BAR_STEP
        return y + len(lines) * BAR_STEP

    def _row_y(self, layer: int) -> float:
        """The upper edge of the boxes of a row."""
        return self.area_y + HEADER + layer * self.step_y

    def _device_y(self, number: int) -> float:
        """The upper edge of the box of a device."""
        return self.above_y if number in self.devices_above else self.below_y

    def area_title(self, area: Area, texts: Texts) -> tuple[str, TextLine]:
        """The name of an area, and its type or the options of it.

        The title is empty where threads have no processor, "on A or B" where the processor is open.
        """
        names = [self.space.processors[one].name for one in area.processors]
        if len(names) != 1:
            return (f"on {' or '.join(names)}" if names else ""), TextLine("", is_open=len(names) > 1)
        return names[0], texts.slot(self.space.processors[area.processors[0]])

    def line(self, one: Placed, route: Sequence[tuple[float, int]], door: tuple[str, int]) -> list[tuple[float, float]]:
        """The points of a route: from the edge of a box, or what is behind a door, to another.

        Pairs (x, y) in px. `route` has a column and a layer for each bend, `door` says what lies behind the frame of
        the area: a bus, a lane or a device.
        """
        half, height = self.box_h / 2, self.height_in_rows
        kind, number = door
        downwards = route[0][1] <= route[-1][1]
        corners: list[tuple[float, float]] = []
        for place, (column, layer) in enumerate(route):
            x, y = self._node_x(one, column), self._row_y(layer) + half
            if layer in (-1, height):
                frame = self.area_y if layer == -1 else self.area_y + self.area_h
                far = (x, self.above_y + self.box_h if layer == -1 else self.below_y)
                if kind == "bus":
                    far = (self.on_bar(number, x), self.bar_y[number] + (BAR_H if layer == -1 else 0))
                elif kind == "lane":
                    far = (x, self.lane_y[number])
                elif kind == "device":
                    far = (self.device_x[number], far[1])
                corners += [far, (x, frame)] if place == 0 else [(x, frame), far]
            elif place in (0, len(route) - 1):
                other = route[1][1] if place == 0 else route[-2][1]
                corners.append((x, y + half * (0 if other == layer else 1 if other > layer else -1)))
            else:
                corners += [(x, y - half), (x, y + half)] if downwards else [(x, y + half), (x, y - half)]
        return corners

    def straight(self, source: int, target: int) -> list[tuple[float, float]]:
        """The ends of a line from box to box, without regard to what lies between.

        Two points in px: on the sides of the boxes where both stand at one height, else on the lower edge of the upper
        box and the upper edge of the lower one.
        """
        (x0, y0), (x1, y1) = self.box_at[source], self.box_at[target]
        if y0 == y1:
            side = BOX_W / 2 if x1 > x0 else -BOX_W / 2
            return [(x0 + side, y0 + self.box_h / 2), (x1 - side, y1 + self.box_h / 2)]
        return [(x0, y0 + self.box_h), (x1, y1)] if y1 > y0 else [(x0, y0), (x1, y1 + self.box_h)]

    @cached_property
    def box_at(self) -> dict[int, tuple[float, float]]:
        """The middle of the upper edge of the box of each component.

        Component indices to (x, y) in px, devices outside of areas included.
        """
        place_of = {number: (x, self._device_y(number)) for number, x in self.device_x.items()}
        for one in self.placed:
            for node, (kind, number) in enumerate(one.nodes):
                if kind == "thread":
                    place_of[number] = (self._node_x(one, one.layout.centres[node]), self._row_y(self.rows[number]))
        return place_of

    def legend(self, *, decided: bool) -> list[tuple[str, str]]:
        """The legend of line styles: pairs of class and words.

        Only looks that appear in this drawing. The class is the one of the SVG's style sheet.
        """
        entries = [("flow", f"flow {flow.name}") for flow in self.parts.main_flows]
        connections = [item for item in self.space.connections if item.source is not None and item.target is not None]
        entries += [("", "messages")] * any(True for item in connections for _ in buses_of(item))
        entries += [("local", "data without a bus")] * any(not list(buses_of(item)) for item in connections)
        entries += [("decision", "decided" if decided else "open decision")] * bool(self.texts.open)
        return entries


def _inside(centres: dict[int, float], width: float) -> dict[int, float]:
    """Centres moved to the right of the margin, all alike."""
    shift = max(0.0, MARGIN + width / 2 - min(centres.values(), default=MARGIN + width / 2))
    return {one: x + shift for one, x in centres.items()}


def buses_of(item: Connection) -> Iterator[int]:
    """The buses that may carry a connection directly.

    Indices of buses: the leaves of the connection's decision tree, without "no bus".
    """
    return (leaf for leaf in leaves(item.bus) if leaf is not None)
