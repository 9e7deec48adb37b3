"""What a command says of its answer: a page of sections, made once, which three writers set.

`dse.report.terminal` prints it, `dse.report.markdown` and `dse.report.html` write it: the sentences, the figures and
the cells of tables are the same in all three. Sections with details, and with what the page rests on, are for files,
whose reader has not given the command.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

from dse.report.plots.canvas import Drawing

NOTHING = "\N{EN DASH}"
"""The cell of a table where there is nothing to say."""
MORE = "--all"
"""The option of every command that prints less than it has found."""
MINUS = "\N{MINUS SIGN}"
Tone: TypeAlias = Literal["plain", "strong", "wrong", "good", "doubtful", "quiet"]


@dataclass(frozen=True)
class Text:
    """A paragraph; `tone` sets off a verdict (strong, good, doubtful) and what is amiss (wrong).

    A terminal says `brief`, if there is one, unless it shows all, and indents the further lines by `hang`.
    """

    kind: ClassVar = "text"
    text: str
    tone: Tone = "plain"
    brief: str = ""
    hang: int = 0


@dataclass(frozen=True)
class Item:
    """A line of a list, under a label if it has one; `depth` 2 belongs to the line above it.

    Of a list of decisions a terminal has no more than `told` letters, unless it shows all.
    """

    text: str
    label: str = ""
    depth: int = 1
    tone: Tone = "plain"
    told: int | None = None

    @property
    def line(self) -> str:
        """The label and the text."""
        return f"{self.label}: {self.text}" if self.label else self.text


@dataclass(frozen=True)
class Listing:
    """Lines, one below the other; a terminal shows `brief` of them unless it shows all.

    Items have a label, a depth of indentation and a tone; `brief` None shows all of them.
    """

    kind: ClassVar = "listing"
    items: tuple[Item, ...]
    brief: int | None = None


@dataclass(frozen=True)
class Table:
    """A table.

    `numbers` are the columns that align right, `total` marks the last row as a sum. `bars` has for each row a length
    from 0 to 1, drawn beside it. A terminal shows `brief` rows unless it shows all, and says `rest` of the
    others (``{}`` is how many); a file has `most`. Where there is no room for all columns a terminal leaves out those
    of `spare`, in this order: they are told elsewhere. Where there is still none, it tells the columns from `wide` on
    in one cell, or below the table by the cell of column `label`, and of each no more than `told` letters unless it is
    to show all; a table without such columns has its cells wrapped, or each row told as a paragraph. `strong` are rows
    that are set off, `paths` columns whose cells may be wrapped after points, as names of inputs are. A terminal prints
    `short` in its place, if there is one, unless it shows all.
    """

    kind: ClassVar = "table"
    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    total: bool = False
    bars: tuple[float, ...] = ()
    brief: int | None = None
    rest: str = "and {} more"
    most: int | None = None
    wide: int | None = None
    label: int = 0
    told: int | None = None
    spare: tuple[int, ...] = ()
    strong: tuple[int, ...] = ()
    paths: tuple[int, ...] = ()
    short: Table | None = None

    @property
    def written(self) -> tuple[tuple[str, ...], ...]:
        """The rows that a file has.

        At most `most` rows; the rest is in JSON and CSV.
        """
        return self.rows[: self.most]

    @property
    def left_out(self) -> str:
        """The remark on rows that a file leaves out; "" where it has all rows."""
        more = len(self.rows) - len(self.written)
        return f"{more} more rows are in JSON and CSV." if more else ""


@dataclass(frozen=True)
class Plot:
    """A plot with its caption, drawn where it is shown; `name` is the stem of its file, a table has its figures.

    `draw` makes it, only when a writer shows plots.
    """

    kind: ClassVar = "plot"
    name: str
    draw: Callable[[], Drawing]
    caption: str


@dataclass(frozen=True)
class Lane:
    """One user of a resource over time: pieces as (begin, end), from 0 to 1 of the whole time."""

    name: str
    pieces: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Timeline:
    """Lanes below each other over one time, a Gantt chart; `ends` says when it begins and ends.

    `marks` are moments with what is to be said of them, from 0 to 1 of the whole time.
    """

    kind: ClassVar = "timeline"
    caption: str
    lanes: tuple[Lane, ...]
    ends: tuple[str, str]
    marks: tuple[tuple[float, str], ...] = ()

    def lines(self, width: int) -> list[str]:
        """The lanes as lines of `width` letters: ``#`` where somebody has it, ``|`` at a moment.

        One line for each lane, its name first, and a line with both ends of the time scale. ASCII only.
        """
        beside = max(len(lane.name) for lane in self.lanes)
        room = max(10, width - beside - 1)
        drawn = []
        for lane in self.lanes:
            cells = [" ."[at % 5 == 0] for at in range(room)]
            for place, _ in self.marks:
                cells[min(room - 1, int(place * room))] = "|"
            for begin, end in lane.pieces:
                first = min(room - 1, int(begin * room))
                for at in range(first, max(first + 1, min(room, round(end * room)))):
                    cells[at] = "#"
            drawn.append(f"{lane.name:<{beside}} {''.join(cells)}".rstrip())
        scale = f"{self.ends[0]}{self.ends[1]:>{room - len(self.ends[0])}}"
        return [*drawn, f"{'':<{beside}} {scale}"]


Block: TypeAlias = Text | Listing | Table | Plot | Timeline


@dataclass(frozen=True)
class Section:
    """A part of a page; one that `is_for_files` says what a file needs beside: details, and what it rests on.

    One that `is_detail` is on a terminal only where it is told to show all.
    """

    name: str
    title: str
    blocks: tuple[Block, ...]
    is_for_files: bool = False
    is_detail: bool = False

    @property
    def plots(self) -> tuple[Plot, ...]:
        """Its plots, in order."""
        return tuple(block for block in self.blocks if isinstance(block, Plot))

    @property
    def tables(self) -> tuple[Table, ...]:
        """Its tables, in order."""
        return tuple(block for block in self.blocks if isinstance(block, Table))

    @property
    def texts(self) -> tuple[str, ...]:
        """Its paragraphs and lines, in order.

        Plain texts, without tables and plots.
        """
        paragraphs: list[str] = []
        for block in self.blocks:
            paragraphs += [block.text] if isinstance(block, Text) else []
            paragraphs += [item.line for item in block.items] if isinstance(block, Listing) else []
        return tuple(paragraphs)


@dataclass(frozen=True)
class Page:
    """An answer, ready to be written: `lead` says in a line what it is about, `title` heads a file.

    `is_amiss` tells that the answer is no good news: the frame around its lead must not look like some.
    """

    title: str
    lead: str
    sections: tuple[Section, ...]
    is_amiss: bool = False


def few(items: Sequence[str], most: int, what: str) -> str:
    """The first `most` items of a list and the number of the others; a single further item is listed, not counted.

    >>> few(["a", "b", "c"], 2, "options"), few(["a", "b", "c", "d"], 2, "options")
    ('a; b; c', 'a; b; and 2 more options (--all)')
    """
    more = len(items) - most
    return "; ".join(items if more <= 1 else [*items[:most], f"and {more} more {what} ({MORE})"])


def texts(*paragraphs: str, tone: Tone = "plain") -> list[Block]:
    """Paragraphs, without those that are empty.

    `Text` blocks in the order given, all in one tone.
    """
    return [Text(text, tone) for text in paragraphs if text]


def listing(
    lines: Iterable[str], label: str = "", depth: int = 1, tone: Tone = "plain", brief: int | None = None
) -> list[Block]:
    """A list of lines, all under one label; nothing where there are none.

    At most one `Listing`; `depth` is the indentation, `brief` the number of lines that a terminal shows.
    """
    items = tuple(Item(text, label, depth, tone) for text in lines)
    return [Listing(items, brief)] if items else []


def labelled(pairs: Iterable[tuple[str, str]]) -> list[Block]:
    """A list of lines, each under its own label; nothing where there are none.

    `pairs` are pairs of label and text; at most one `Listing`.
    """
    items = tuple(Item(text, label) for label, text in pairs)
    return [Listing(items)] if items else []
