"""Tables and texts that any terminal can show: no cell loses a letter, no line ends in blanks."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap

from rich.cells import cell_len
from rich.console import Console

GAP = 2
"""Blanks between two columns of a table."""
BAR = (10, 40)
"""The least and the greatest length of the longest bar beside the rows of a table."""
MOST_LINES = 6
"""Headings in more lines are as high as they are."""
LEAST = 16
"""A column of text is not wrapped into less than this, if its text is longer: the rows become paragraphs then."""


@dataclass(frozen=True)
class TextTable:
    """Cells of a table as text of one line each; `numbers` are the columns that align right.

    Cells may be wrapped at blanks when the table is wider than the terminal, those of the columns `paths` also after
    points; none is cropped.
    """

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    paths: tuple[int, ...] = ()

    def least(self, at: int, *, wrapped: bool) -> int:
        """The least width of a column: its longest cell (`wrapped`: word), and the longest word of its heading.

        Cells of up to `LEAST` letters, such as a number with its unit, stay in one line.
        """
        cells = [row[at] for row in self.rows]
        widest = max(map(cell_len, cells), default=0)
        pieces = [[part for part, _ in _parts(cell)] if at in self.paths else cell.split() for cell in cells]
        words = max((cell_len(word) for piece in pieces for word in piece), default=0)
        body = min(widest, max(words, LEAST)) if wrapped else widest
        return max([body, *(cell_len(part) for part, _ in _parts(self.headings[at]))])

    def most(self, at: int) -> int:
        """The width of a column without wrapping.

        In columns of the terminal: wide letters count as two.
        """
        return max(map(cell_len, [self.headings[at], *(row[at] for row in self.rows)]))

    def widths(self, room: int, *, wrapped: bool = False) -> list[int] | None:
        """The widths of the columns in a line of `room` letters; None where they do not fit.

        Headings are wrapped at spaces; cells too where they may be `wrapped`.
        """
        columns = range(len(self.headings))
        least = [self.least(at, wrapped=wrapped) for at in columns]
        rest = room - sum(least) - GAP * (len(least) - 1)
        if rest < 0:
            return None
        whole = [self.least(at, wrapped=False) for at in columns]
        # cells in one line first: the narrowest column grows until all are equally wide
        while rest and (short := [at for at in columns if least[at] < whole[at]]):
            least[min(short, key=lambda at: least[at])] += 1
            rest -= 1
        for height in range(1, MOST_LINES):  # then all headings in as few lines as there is room for
            wide = [max(least[at], _width_of(self.headings[at], height)) for at in columns]
            if sum(wide) - sum(least) <= rest:
                return wide
        return least

    def lines(self, widths: Sequence[int]) -> tuple[list[str], list[list[str]]]:
        """The lines of the headings, and those of each row.

        `widths` are columns of the terminal, one for each column of the table; each cell is wrapped to its width.
        """
        return self._set(self.headings, widths, is_head=True), [self._set(row, widths) for row in self.rows]

    def _set(self, cells: Sequence[str], widths: Sequence[int], *, is_head: bool = False) -> list[str]:
        parts = [
            _wrapped(cell, width, at_points=is_head or at in self.paths)
            for at, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        height = max(map(len, parts))
        lines = []
        for number in range(height):
            line = ""
            for at, (part, width) in enumerate(zip(parts, widths, strict=True)):
                above = height - len(part) if is_head else 0  # headings stand on the rows
                cell = part[number - above] if 0 <= number - above < len(part) else ""
                space = " " * (width - cell_len(cell))
                line += (" " * GAP if at else "") + (space + cell if at in self.numbers else cell + space)
            lines.append(line.rstrip())
        return lines

    def only(self, columns: Sequence[int]) -> TextTable:
        """The grid with the given columns only.

        `columns` are indices; headings, rows and the columns that align right are kept in that order.
        """
        rows = tuple(tuple(row[at] for at in columns) for row in self.rows)
        numbers = tuple(number for number, at in enumerate(columns) if at in self.numbers)
        paths = tuple(number for number, at in enumerate(columns) if at in self.paths)
        return TextTable(tuple(self.headings[at] for at in columns), rows, numbers, paths)


def _parts(heading: str) -> list[tuple[str, str]]:
    """The parts of a heading that stay whole, each with what joins it to the one before: a blank, or nothing.

    >>> _parts("nav.period [ms]")
    [('nav.', ''), ('period', ''), ('[ms]', ' ')]
    """
    parts = [(part, "") for part in re.split(r"(?<=\.)(?=[^\s.])", heading)]
    return [(word, join if at == 0 else " ") for part, join in parts for at, word in enumerate(part.split())]


def _wrapped(cell: str, width: int, *, at_points: bool = False) -> list[str]:
    """A cell in lines of at most `width` columns of a terminal: broken at spaces, and after points where that is said.

    >>> _wrapped("utilisation of computer", 11)
    ['utilisation', 'of computer']
    """
    if cell_len(cell) <= width:
        return [cell]
    lines: list[str] = []
    for word, join in _parts(cell) if at_points else [(word, " ") for word in cell.split()]:
        if lines and cell_len(f"{lines[-1]}{join}{word}") <= width:
            lines[-1] += f"{join}{word}"
        else:
            lines.append(word)
    return lines or [""]


def _width_of(heading: str, height: int) -> int:
    """The least width in which a heading has at most `height` lines."""
    least = max((cell_len(part) for part, _ in _parts(heading)), default=0)
    widths = range(least, cell_len(heading) + 1)
    return next((width for width in widths if len(_wrapped(heading, width, at_points=True)) <= height), least)


def is_ascii(console: Console) -> bool:
    """Whether a console shows no more than ASCII.

    Judged by the console's encoding; symbols are then replaced by plain letters.
    """
    return (console.encoding or "utf-8").lower().replace("-", "") not in ("utf8", "utf8mb4", "utf16")


def shown_text(console: Console, text: str) -> str:
    r"""The text in one line as the console prints it: what steers a terminal as escapes.

    Newlines and tabs become ``\n`` and ``\t``, so that a name from a file cannot break a table.
    """
    line = text.replace("\n", r"\n").replace("\t", r"\t")
    return console.render_str(line, markup=False, highlight=False, emoji=False).plain


def print_line(console: Console, line: str, style: str = "") -> None:
    """A line as it is, however long.

    No wrapping, no markup, no highlighting.
    """
    console.print(line, style=style, markup=False, highlight=False, soft_wrap=True)


def print_hanging(console: Console, text: str, indent: str = "  ", style: str = "", hang: str = "    ") -> None:
    """A paragraph whose further lines are indented more than its first, by `hang`.

    Wrapped at the width of the console; `indent` is in front of every line.
    """
    shown = console.render_str(text, markup=False, highlight=False, emoji=False).plain
    for part in shown.split("\n"):
        further = indent + hang
        lines = wrap(part, console.width, initial_indent=indent, subsequent_indent=further, break_on_hyphens=False)
        for line in lines or [""]:
            print_line(console, line, style)
