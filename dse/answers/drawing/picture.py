"""The architecture of a problem, or of one of its designs, as SVG.

Processors are boxes with their threads in layers, from source to sink; physical buses are bars between them and the
devices; open decisions have a colour of their own. Every element stands on a line of its own, and only texts and
classes depend on the design: the drawings of two designs of one problem differ in a few lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from itertools import pairwise

from dse.analysis.binding import bus_stack
from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.views import View
from dse.answers.drawing.places import BAR_H, BOX_W, LEGEND, LINE_H, MARGIN, PAD, DrawnPlaces, Placed, buses_of
from dse.answers.drawing.texts import TextLine, Texts, shortened
from dse.space.model.space import EMPTY, Design
from dse.space.model.trees import leaves
from dse.support.theme import LIGHT, with_colours

NAME_LENGTH, TEXT_LENGTH = 25, 32

STYLE = """
.arch text { font: 11px system-ui, sans-serif; fill: var(--ink); }
.arch .title { font-size: 14px; font-weight: 600; }
.arch .name { font-weight: 600; }
.arch .small { fill: var(--soft); font-size: 10.5px; }
.arch .area { fill: var(--panel); stroke: var(--soft); stroke-width: 1.4; }
.arch .box { fill: var(--paper); stroke: var(--line); stroke-width: 1.2; }
.arch .inflow { stroke: var(--c1); stroke-width: 1.6; }
.arch .end { stroke-width: 3; }
.arch .bar { fill: var(--paper); stroke: var(--soft); stroke-width: 1.6; }
.arch .edge { fill: none; stroke: var(--soft); stroke-width: 1.1; }
.arch .local { stroke-dasharray: 2 3; }
.arch .option { stroke-dasharray: 7 4; }
.arch .decision { stroke: var(--c2); stroke-width: 1.8; }
.arch .flow { stroke: var(--c1); stroke-width: 2.6; }
.arch .tip { stroke-dasharray: none; }
.arch text.decision, .arch tspan.decision { fill: var(--c2); stroke: none; }
.arch .over tspan { paint-order: stroke; stroke: var(--panel); stroke-width: 4; }
.arch .unused { opacity: 0.25; }
"""


class Drafter(DrawnPlaces):
    """Draws a space, and its designs, over one common layout.

    The layout is computed once, so that the drawings of two designs can be compared by eye.
    """

    def lines(self, design: Design | None) -> Iterator[str]:
        """The drawing, an element to a line; without a design that of the problem, its decisions open.

        Colours are CSS variables, classes those of `STYLE`.
        """
        view = None if design is None else View(design)
        texts = Texts(self.space, view, {} if design is None else cores_of(self.space, design))
        size = f"viewBox='0 0 {self.width:.0f} {self.height:.0f}' width='{self.width:.0f}' height='{self.height:.0f}'"
        style = f"style='max-width: {self.width:.0f}px'"
        yield f"<svg class='arch' xmlns='http://www.w3.org/2000/svg' role='img' {size} {style}>"
        yield f"<title>{escape(f'Architecture of {self.space.name}')}</title>"
        yield f"<text class='title' x='{MARGIN}' y='{MARGIN + 12}'>{escape(self.space.name)}</text>"
        for one in self.placed:
            yield from self._area(one, texts)
        for one in self.placed:
            yield from self._edges(one, view)
        yield from self._outer(view)
        for one in self.placed:
            name, kind = self.area_title(one.area, texts)
            place = f"class='over' x='{one.x + PAD:.1f}' y='{self.area_y + 19:.1f}'"
            yield f"<text {place}>{_bold_and(name, kind)}</text>"
        for bus in self.bars:
            yield from self._bar(bus, texts)
        for number in range(len(self.space.components)):
            yield from self._box(number, texts)
        for number, (look, text) in enumerate(self.legend(decided=view is not None)):
            x, y = MARGIN + number % self.per_row * LEGEND, self.legend_y + number // self.per_row * 20
            yield f"<path class='edge {look}' d='M{x} {y + 7:.0f} h26'/>"
            yield f"<text class='small' x='{x + 33}' y='{y + 11:.0f}'>{escape(shortened(text, 32))}</text>"
        yield "</svg>"

    def standalone(self, design: Design | None) -> str:
        """The drawing as a file of its own, in light colours.

        SVG text with its own style sheet; `design` None draws the problem with its open decisions.
        """
        first, *rest = self.lines(design)
        paper = f"<rect width='{self.width:.0f}' height='{self.height:.0f}' fill='var(--paper)'/>"
        style = f"<style>{STYLE}</style>"
        return "\n".join([first, with_colours(style, LIGHT), with_colours(paper, LIGHT), *rest]) + "\n"

    def _area(self, one: Placed, texts: Texts) -> Iterator[str]:
        kind = self.area_title(one.area, texts)[1]
        if not one.area.processors:
            return
        look = "area decision" if kind.is_open else "area"
        rect = f"x='{one.x:.1f}' y='{self.area_y:.1f}' width='{one.width:.1f}' height='{self.area_h:.1f}' rx='8'"
        yield f"<rect class='{look}' {rect}/>"

    def _edges(self, one: Placed, view: View | None) -> Iterator[str]:
        """Lines inside an area, and from its threads through its doors."""
        for edge, (source, target), route in zip(one.edges, one.ends, one.layout.routes, strict=True):
            door = next((key for key in (one.nodes[source], one.nodes[target]) if key[0] != "thread"), ("", -1))
            line = self.line(one, route, door)
            shape = _curve(line, at_start=edge.at_start, at_end=edge.at_end)
            yield self._drawn(edge.connections, shape, view, edge.bus)

    def _outer(self, view: View | None) -> Iterator[str]:
        """Lines from devices to bars, and what leads from one area to another without a physical bus."""
        by_device: dict[int, list[int]] = {}
        for component, bus in self.parts.uses:
            if component in self.device_x:
                by_device.setdefault(component, []).append(bus)
        for number, buses in by_device.items():
            above = number in self.devices_above
            order = sorted(buses, key=lambda bus: self.bars[bus])
            for place, bus in enumerate(order):
                x = self.device_x[number] + (place - (len(order) - 1) / 2) * BOX_W / (len(order) + 1)
                use = self.parts.uses[number, bus]
                at = self.on_bar(bus, x)
                line = [(x, self.above_y + self.box_h), (at, self.bar_y[bus])]
                if not above:
                    line = [(x, self.below_y), (at, self.bar_y[bus] + BAR_H)]
                yield self._drawn(use.connections, _curve(line, at_start=use.receives, at_end=use.sends), view, bus)
        for lane, pair in self.lanes.items():
            start, end = self.doors["lane", lane]
            y = self.lane_y[lane]
            yield self._drawn(self.parts.links[pair], _curve([(start, y), (end, y)], at_end=False), view, None)
        home = self.parts.home
        for pair, connections in self.parts.links.items():
            far = [one for one in pair if one in home]
            if not far or (len(far) == 2 and home[pair[0]] != home[pair[1]] and pair not in self.lanes.values()):
                yield self._drawn(connections, _curve(self.straight(*pair), at_end=True), view, None)

    def _drawn(self, connections: Sequence[int], shape: str, view: View | None, bus: int | None) -> str:
        """A line; dashed where a connection may take another bus, faint where it does in the design."""
        items = [self.space.connections[number] for number in connections]
        looks = ["edge"]
        if self.in_flow(connections):
            looks.append("flow")
        titles = []
        used = []
        for item in items:
            options = {leaf for leaf in leaves(item.bus, dict(self.space.fixed)) if leaf is not None}
            stack = bus_stack(self.space, item, view) if view is not None else None
            names = [self.space.buses[one].name for one in (sorted(options) if stack is None else stack)]
            titles.append(f"{item.name}: {(' or ' if stack is None else ' over ').join(names) or 'no bus'}")
            used.append(stack is None or bus is None or bus in stack)
            if bus is not None and len(options) > 1 and "option" not in looks:
                looks += ["option", "decision"]
        if bus is None and all(not list(buses_of(item)) for item in items):
            looks.append("local")
        if not any(used):
            looks.append("unused")
        return f"<g class='{' '.join(looks)}'><title>{escape('; '.join(titles))}</title>{shape}</g>"

    def _bar(self, bus: int, texts: Texts) -> Iterator[str]:
        slot, (start, end), y = self.space.buses[bus], self.bars[bus], self.bar_y[bus]
        kind = texts.slot(slot)
        unused = texts.view is not None and slot.types[texts.view[slot.type_decision]] == EMPTY
        look = f"class='bar{' decision' if kind.is_open else ''}{' unused' if unused else ''}'"
        size = f"width='{end - start:.1f}' height='{BAR_H}' rx='{BAR_H / 2:.0f}'"
        yield f"<rect {look} x='{start:.1f}' y='{y:.1f}' {size}/>"
        middle = f"x='{(start + end) / 2:.1f}' y='{y + 16:.1f}' text-anchor='middle'"
        yield f"<text {middle}>{_bold_and(slot.name, kind)}</text>"

    def _box(self, number: int, texts: Texts) -> Iterator[str]:
        """The box of a component: its name, and the lines of `Texts` below."""
        item, (x, y) = self.space.components[number], self.box_at[number]
        lines = texts.component(number)
        looks = ["box"]
        if number in self.parts.components_in_flows:
            looks.append("inflow")
        if number in self.parts.flow_ends:
            looks.append("end")
        if any(line.is_open for line in lines):
            looks.append("decision")
        yield f"<g transform='translate({x - BOX_W / 2:.1f} {y:.1f})'><title>{escape(item.name)}</title>"
        corner = "0" if item.section == "devices" else "5"
        yield f"<rect class='{' '.join(looks)}' width='{BOX_W}' height='{self.box_h}' rx='{corner}'/>"
        yield f"<text class='name' x='9' y='18'>{escape(shortened(item.name, NAME_LENGTH))}</text>"
        for place, line in enumerate(lines):
            look = "small decision" if line.is_open else "small"
            text = escape(shortened(line.text, TEXT_LENGTH))
            yield f"<text class='{look}' x='9' y='{18 + LINE_H * (place + 1)}'>{text}</text>"
        if number in self.parts.from_outside:
            yield f"<path class='edge' d='M{BOX_W - 14} -14 v13 m-3 -4 l3 4 l3 -4'><title>from outside</title></path>"
        yield "</g>"


def _bold_and(name: str, line: TextLine) -> str:
    look = "small decision" if line.is_open else "small"
    return f"<tspan class='name'>{escape(name)}</tspan> <tspan class='{look}' dx='4'>{escape(line.text)}</tspan>"


def _curve(line: Sequence[tuple[float, float]], *, at_end: bool, at_start: bool = False) -> str:
    """A smooth line through points, with open arrows; a loop beside a box where both ends are one point."""
    if len({*line}) == 1:
        x, y = line[0][0] + BOX_W / 2, line[0][1]
        loop, tip = f"M{x:.1f} {y - 8:.1f} c 16 -8 16 24 0 16", f"M{x + 5:.1f} {y + 4:.1f} l-5 4 l5 4"
        return f"<path d='{loop}'/><path class='tip' d='{tip}'/>"
    text = f"M{line[0][0]:.1f} {line[0][1]:.1f}"
    for (x0, y0), (x1, y1) in pairwise(line):
        middle = (y0 + y1) / 2
        flat = x0 == x1 or y0 == y1
        text += f" L{x1:.1f} {y1:.1f}" if flat else f" C{x0:.1f} {middle:.1f} {x1:.1f} {middle:.1f} {x1:.1f} {y1:.1f}"
    tips = [_arrow(line[-2], line[-1])] * at_end + [_arrow(line[1], line[0])] * at_start
    return f"<path d='{text}'/>" + (f"<path class='tip' d='{' '.join(tips)}'/>" if tips else "")


def _arrow(before: tuple[float, float], tip: tuple[float, float]) -> str:
    """An open arrow that points up or down, or sideways for a level line."""
    (x0, y0), (x, y) = before, tip
    if y == y0:
        back = 5 if x0 > x else -5
        return f"M{x + back:.1f} {y - 4:.1f} L{x:.1f} {y:.1f} L{x + back:.1f} {y + 4:.1f}"
    back = 5 if y0 > y else -5
    return f"M{x - 4:.1f} {y + back:.1f} L{x:.1f} {y:.1f} L{x + 4:.1f} {y + back:.1f}"
