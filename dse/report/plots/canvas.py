"""The drawing board of plots: SVG whose widths are shares, so that one text fits a phone, a screen, paper and a file.

Places across are shares of the width, from 0 to 1, and are written in per cent; places down and letters are in pixels.
Colours are classes of `STYLE`, with the names of `dse.support.theme`; every text is escaped where it is written.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, log10
from textwrap import wrap

from dse.report.amounts import shortened
from dse.support.theme import LIGHT, with_colours

WIDTH, EDGE = 760, 12
"""Pixels of a plot in a file of its own, and of the paper around it."""
LEFT, RIGHT = 0.025, 0.965
"""Where the axis across begins and ends."""
LETTER = 6.3
"""Pixels of a letter, about."""
NARROW = 350
"""Pixels of a plot on a phone: what is written beside each other has room there."""
MOST_TICKS = 6
TICKS_HEIGHT, TITLE_HEIGHT, LEGEND_HEIGHT = 18, 15, 17
COLOURS = ("c1", "c2", "c3", "c4", "c5", "c6", "s1", "s2", "s3", "s4", "accent", "soft", "line", "ink")
STYLE = (
    """
.chart { display: block; }
.chart text { font: 11px system-ui, sans-serif; fill: var(--ink); }
.chart .title { font-size: 12px; font-weight: 600; }
.chart .rim { paint-order: stroke; stroke: var(--paper); stroke-width: 4px; stroke-linejoin: round; }
.chart .strong { font-weight: 700; fill: var(--accent); }
.chart text.on { fill: var(--paper); }
.chart .grid { stroke: var(--line); stroke-opacity: 0.6; }
.chart .pale { opacity: 0.55; }
.chart .faint { opacity: 0.18; }
.chart .dashed { stroke-dasharray: 4 3; }
.chart .two { stroke-width: 2; }
.chart .three { stroke-width: 3; }
.chart .hollow { fill: none; }
"""
    + "\n".join(
        f".chart .f-{name} {{ fill: var(--{name}); }}\n.chart .l-{name} {{ stroke: var(--{name}); }}"
        for name in COLOURS
    )
    + "\n"
)


@dataclass(frozen=True)
class Drawing:
    """A plot as SVG: what a screen reader says of it, its height in pixels, and its elements, one to a line.

    `lines` are for a page, which holds `STYLE`; `standalone` is a file.
    """

    description: str
    height: float
    elements: tuple[str, ...]

    def lines(self) -> Iterator[str]:
        """The plot for a page, an element to a line: as wide as there is room.

        Colours are CSS variables, classes those of `STYLE`.
        """
        yield from self._whole(f"width='100%' height='{self.height:.0f}'")

    def standalone(self) -> str:
        """The plot as a file of its own, in light colours, `WIDTH` pixels wide.

        SVG text with its own style sheet and white paper around it.
        """
        wide, tall = WIDTH + 2 * EDGE, self.height + 2 * EDGE
        size = f"viewBox='0 0 {wide} {tall:.0f}' width='{wide}' height='{tall:.0f}'"
        first = f"<svg xmlns='http://www.w3.org/2000/svg' {size}>"
        paper = f"<rect width='100%' height='100%' fill='{LIGHT['paper']}'/>"
        inside = self._whole(f"x='{EDGE}' y='{EDGE}' width='{WIDTH}' height='{self.height:.0f}'")
        return "\n".join([first, with_colours(f"<style>{STYLE}</style>", LIGHT), paper, *inside, "</svg>\n"])

    def _whole(self, size: str) -> Iterator[str]:
        yield f"<svg class='chart' role='img' {size}>"
        yield f"<title>{escape(self.description)}</title>"
        yield from self.elements
        yield "</svg>"


@dataclass(frozen=True)
class Scale:
    """A linear scale: the number `low` is drawn at `start`, the number `high` at `end`."""

    low: float
    high: float
    start: float = LEFT
    end: float = RIGHT

    def __call__(self, value: float) -> float:
        """The place of a number.

        A share of the width, or pixels from the top, as `start` and `end` are.
        """
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)

    def ticks(self) -> list[float]:
        """Round numbers from `low` to `high`, at most `MOST_TICKS` and one.

        >>> Scale(0, 23).ticks()
        [0.0, 5.0, 10.0, 15.0, 20.0]
        """
        rough = (self.high - self.low) / MOST_TICKS
        power = 10.0 ** floor(log10(rough))
        step = next(one * power for one in (1, 2, 2.5, 5, 10) if one * power >= rough * 0.999)
        first, last = ceil(self.low / step - 1e-9), floor(self.high / step + 1e-9)
        return [float(f"{number * step:.12g}") for number in range(first, last + 1)]


def scale_of(values: Sequence[float], start: float = LEFT, end: float = RIGHT, room: float = 0.0) -> Scale:
    """The scale that holds all values, and at both ends a `room` as a share of their range.

    A scale of some width also where all values are equal, or where there are none.
    """
    low, high = min(values, default=0.0), max(values, default=1.0)
    if low == high:
        low, high = low - (abs(low) or 1.0) / 2, high + (abs(high) or 1.0) / 2
    wide = (high - low) * room
    return Scale(low - wide, high + wide, start, end)


class Canvas:
    """Collects the elements of a plot; `tip` is what is said of an element when it is pointed at.

    `look` is a list of classes of `STYLE`: ``f-c1`` fills with a colour, ``l-c1`` draws lines in it.
    """

    def __init__(self) -> None:
        self.elements: list[str] = []

    def bar(self, left: float, right: float, top: float, height: float, look: str, tip: str = "") -> None:
        """A filled rectangle from `left` to `right`, shares of the width.

        `top` and `height` are in pixels.
        """
        size = f"x='{_share(left)}' y='{top:.1f}' width='{_share(max(0.0, right - left))}' height='{height:.1f}'"
        self._add("rect", f"class='{look}' {size}", tip)

    def line(self, one: tuple[float, float], other: tuple[float, float], look: str, tip: str = "") -> None:
        """A straight line between two places, each a share of the width and pixels from the top."""
        ends = f"x1='{_share(one[0])}' y1='{one[1]:.1f}' x2='{_share(other[0])}' y2='{other[1]:.1f}'"
        self._add("line", f"class='{look}' {ends}", tip)

    def dot(self, place: tuple[float, float], radius: float, look: str, tip: str = "") -> None:
        """A circle about a place; `radius` is in pixels."""
        self._add("circle", f"class='{look}' cx='{_share(place[0])}' cy='{place[1]:.1f}' r='{radius}'", tip)

    def text(
        self, x: float, y: float, text: str, look: str = "", *, shift: float = 0, anchor: str = "start", tip: str = ""
    ) -> None:
        """A text whose base line is at `y`; `shift` moves it to the right, in pixels."""
        place = f"x='{_share(x)}' y='{y:.1f}'" + (f" dx='{shift:g}'" if shift else "")
        kind = f"class='{look}' " if look else ""
        more = "" if anchor == "start" else f" text-anchor='{anchor}'"
        self.elements.append(f"<text {kind}{place}{more}>{escape(text)}{_tip(tip)}</text>")

    def name_in(self, left: float, right: float, top: float, height: float, name: str, look: str) -> None:
        """A name inside a bar, cut off where the bar ends; none where the bar is too short for a part of it."""
        room = int(((right - left) * WIDTH - 8) / LETTER)
        if room < min(len(name), 6):
            return
        size = f"x='{_share(left)}' y='{top:.1f}' width='{_share(right - left)}' height='{height:.1f}'"
        text = f"<text class='{look}' x='4' y='{height / 2 + 4:.1f}'>{escape(shortened(name, room))}</text>"
        self.elements.append(f"<svg aria-hidden='true' {size}>{text}</svg>")

    def legend(self, names: Sequence[tuple[str, str]], top: float) -> float:
        """Names with their colours, side by side where they are short; how many pixels they take."""
        room = int((NARROW / 3 - 16) / LETTER)
        columns = 3 if all(len(name) <= room + 2 for name, _ in names) else 1
        for number, (name, colour) in enumerate(names):
            x, y = (number % columns) / columns, top + number // columns * LEGEND_HEIGHT
            self.bar(x, x + 0.012, y + 3, 9, f"f-{colour}")
            self.text(x + 0.012, y + 12, shortened(name, 52), shift=5)
        return ceil(len(names) / columns) * LEGEND_HEIGHT + 4 if names else 0

    def axis_across(self, scale: Scale, top: float, bottom: float, title: str) -> float:
        """The grid of the axis across, its numbers and its title below `bottom`; the height of the plot in pixels."""
        for value in scale.ticks():
            x = scale(value)
            self.line((x, top), (x, bottom), "grid")
            self.text(x, bottom + 14, _number(value), anchor="middle")
        y = bottom + TICKS_HEIGHT
        for line in wrap(title, int(NARROW / LETTER)):
            y += TITLE_HEIGHT
            self.text(RIGHT, y, line, "title", anchor="end")
        return y + 8

    def axis_up(self, scale: Scale, title: str) -> None:
        """The grid of the axis up, its numbers above the lines of the grid, and its title on top."""
        for value in scale.ticks():
            self.line((0, scale(value)), (1, scale(value)), "grid")
            self.text(0, scale(value) - 3, _number(value), "rim")
        lines = wrap(title, int(NARROW / LETTER))
        for number, line in enumerate(lines):
            self.text(0, scale.end - 16 - TITLE_HEIGHT * (len(lines) - 1 - number), line, "title")

    def drawing(self, description: str, height: float) -> Drawing:
        """The plot of all that was drawn so far.

        `height` is in pixels.
        """
        return Drawing(description, height, tuple(self.elements))

    def _add(self, tag: str, attributes: str, tip: str) -> None:
        self.elements.append(f"<{tag} {attributes}>{_tip(tip)}</{tag}>" if tip else f"<{tag} {attributes}/>")


def title_height(title: str) -> float:
    """The pixels that the title of an axis up takes.

    Its lines, and the numbers of the grid below it.
    """
    return TITLE_HEIGHT * len(wrap(title, int(NARROW / LETTER))) + 12


def _tip(text: str) -> str:
    return f"<title>{escape(text)}</title>" if text else ""


def _share(share: float) -> str:
    """A share of the width.

    >>> _share(0.125), _share(1)
    ('12.5%', '100%')
    """
    return f"{100 * share:.2f}".rstrip("0").rstrip(".") + "%"


def _number(value: float) -> str:
    """A number of an axis, thousands with a space.

    >>> _number(1250.0), _number(0.25)
    ('1 250', '0.25')
    """
    text = f"{abs(value):,.6f}".rstrip("0").rstrip(".").replace(",", " ")
    return f"\N{MINUS SIGN}{text}" if value < 0 else text
