"""A page as text for a terminal: tables that stay readable in a pipe, in 80 columns and without UTF-8."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import ceil
from typing import TypeVar

from rich.console import Console
from rich.table import Table as Grid

from dse.report.page import MINUS, MORE, NOTHING, Block, Item, Listing, Page, Plot, Table, Text, Timeline
from dse.report.text_table import is_ascii, plain, plain_table, print_hanging

T = TypeVar("T")
STYLES = {"plain": "", "strong": "bold", "wrong": "bold red"}
ANY_WIDTH = 10_000
BAR = 40
"""How long the longest bar beside the rows of a table is drawn; half as long beside more columns than a `FEW`."""
FEW = 3
ASCII = str.maketrans({NOTHING: "-", MINUS: "-"})
BROKEN_BEYOND = (12, 8, 4, 1)
"""Words that are longer may be broken where a table is too wide: the first of these with which it fits."""
DECISIONS = "decisions"
MANY = 8
"""Where more columns are told together, a row is told by what differs from the first."""
ROOM = 44
"""Columns of a terminal that what can be told below a table needs beside it."""

WIDE = 110
"""Columns of a terminal on which a table that tells some of its columns below has its bars."""
LONGEST = 100
"""Letters of a line of a Gantt chart."""
PAGE = "--report PAGE.html is a page."
SCREEN = 39
"""Lines of a screen of 40 without that of the prompt."""


def print_page(console: Console, page: Page, *, every: bool = False, lines: int | None = None) -> None:
    """Its lead and its sections, but for those that say what a file rests on, and the details.

    With `every` also these, and every row of each table; without, the last line says what is left out. Where it has
    more than so many `lines` the longest of the tables and lists that have a `brief` show less of themselves.
    """
    left_out: dict[str, None] = {}
    shown: list[Block] = []
    for section in page.sections:
        if section.is_for_files:
            continue
        if section.is_detail and not every:
            left_out[section.title[:1].lower() + section.title[1:]] = None
        else:
            shown += section.blocks
    lead = [Text(page.lead, tone="strong")] if page.lead else []
    rest = f"{MORE} shows the rest: {'; '.join(left_out)}. {PAGE}" if left_out else ""
    if lines is not None and not every:
        beside = _height(console, *lead) + (_lines_of(console, lambda: print_hanging(console, rest, "")) if rest else 0)
        shown = _cut_to(console, shown, lines - beside)
    for block in (*lead, *shown):
        print_block(console, block, every=every)
    if rest:
        print_hanging(console, rest, "")


def page_height(console: Console, page: Page, lines: int | None = None) -> int:
    """How many lines a page takes that is printed with these `lines`."""
    return _lines_of(console, lambda: print_page(console, page, lines=lines))


def _lines_of(console: Console, tell: Callable[[], None]) -> int:
    with console.capture() as said:
        tell()
    return said.get().count("\n")


def _height(console: Console, *blocks: Block) -> int:
    return sum(_lines_of(console, partial(print_block, console, block)) for block in blocks)


def _cut_to(console: Console, blocks: Sequence[Block], lines: int) -> list[Block]:
    """The blocks in so many lines, as far as that can be had: each time the longest gives up a row."""
    found = list(blocks)
    heights = [_height(console, block) for block in found]
    while sum(heights) > lines:
        smaller = {at: less for at, block in enumerate(found) if (less := _smaller(block)) is not None}
        if not smaller:
            break
        at = max(smaller, key=lambda at: heights[at])
        found[at] = smaller[at]
        heights[at] = _height(console, found[at])
    return found


def _smaller(block: Block) -> Block | None:
    """The same with a row less; None where nothing is left to give up."""
    if not isinstance(block, Listing | Table) or block.brief is None:
        return None
    every = block.items if isinstance(block, Listing) else block.rows
    shown = len(_first(every, block.brief))
    less = shown - (2 if shown == len(every) else 1)  # one more than `brief` is shown rather than told of
    return replace(block, brief=less) if less >= 1 else None


def print_block(console: Console, block: Block, *, every: bool = False) -> None:
    """A paragraph, a list or a table; a plot is left out, for a table has the same figures."""
    if isinstance(block, Text):
        said = block.text if every or not block.brief else block.brief
        console.print(said, style=STYLES[block.tone], markup=False)
    elif isinstance(block, Listing):
        shown = _first(block.items, None if every else block.brief)
        for item in shown:
            _print_item(console, item if every else replace(item, text=_cut(item.text, item.told)))
        if len(block.items) > len(shown):
            _print_item(console, Item(f"and {len(block.items) - len(shown)} more ({MORE})", depth=shown[0].depth))
    elif isinstance(block, Table):
        _print_table(console, block, every=every)
    elif isinstance(block, Timeline):
        print_hanging(console, block.caption)
        for line in block.lines(min(console.width, LONGEST)):
            console.print(plain(line), markup=False, highlight=False, soft_wrap=True)
        for _, text in block.marks:
            print_hanging(console, text)
    else:
        assert isinstance(block, Plot)


def _first(found: tuple[T, ...], most: int | None) -> tuple[T, ...]:
    """The first `most`; all where one more than these takes no more room than to say that there is one."""
    return found if most is None or len(found) <= most + 1 else found[:most]


def _print_item(console: Console, item: Item) -> None:
    if item.tone == "plain":
        print_hanging(console, item.line, "  " * item.depth)
    else:
        console.print(f"{'  ' * item.depth}{item.line}", style=STYLES[item.tone], markup=False)


def _print_table(console: Console, table: Table, *, every: bool) -> None:
    """The rows that are shown; what there is no room for below them."""
    shown = _first(table.rows, None if every else table.brief)
    more = len(table.rows) - len(shown)
    if table.wide is None:
        console.print(_fitting(console, table, shown))
    else:
        _print_wide(console, table if not every else replace(table, told=None), shown)
    if more:
        console.print(table.rest.format(more), markup=False)


def _fitting(console: Console, table: Table, shown: tuple[tuple[str, ...], ...]) -> Grid:
    """The whole table; words are broken as far as must be."""
    for longest in BROKEN_BEYOND:
        grid = _grid(console, table, shown, len(table.headings), longest=longest)
        if console.measure(grid, options=console.options.update(width=ANY_WIDTH)).minimum <= console.width:
            break
    return grid


def _print_wide(console: Console, table: Table, shown: tuple[tuple[str, ...], ...]) -> None:
    """What a row says from column `wide` on beside it in one cell, or below the table, or all of it as a list."""
    if table.bars and console.width < WIDE:
        table = replace(table, bars=())
    assert table.wide is not None
    told = [_joined(table, row, shown[0]) for row in shown]
    bare = _grid(console, table, shown, table.wide)
    width = console.measure(bare, options=console.options.update(width=ANY_WIDTH))
    room = console.width - width.minimum
    if room >= ROOM:
        is_tight = console.width - width.maximum < ROOM
        console.print(_grid(console, table, shown, table.wide, told, is_tight=is_tight))
        return
    if room >= 0:
        console.print(bare)
        if table.told == 0:
            return
    for row, text in zip(shown, told, strict=True):
        figures = "" if room >= 0 else f"{_figures(table, row)}; "
        print_hanging(console, f"{_name(table, row)}: {figures}{_cut(text, table.told)}")


def _cut(text: str, most: int | None) -> str:
    """A comma-separated list as far as there is room, and how many more there are.

    >>> _cut("computer large, can0 can_500k, nav.period 5 ms", 32)
    'computer large and 2 more (--all)'
    """
    if most is None or len(text) <= most:
        return text
    items = text.split(", ")
    rest = f" and {len(items)} more ({MORE})"
    told = max(1, len(text[: most - len(rest)].split(", ")) - 1)
    return f"{', '.join(items[:told])} and {len(items) - told} more ({MORE})" if told < len(items) else text


def _joined(table: Table, row: tuple[str, ...], first: tuple[str, ...]) -> str:
    """What a row says in its wide columns, in a few words: ``computer large, can0 can_500k``.

    Of many it is what differs from the first row, where that is shorter.
    """
    assert table.wide is not None
    if _last_heading(table) != DECISIONS or table.headings[table.wide :] == (DECISIONS,):
        return row[table.wide]
    pairs = list(zip(table.headings, row, strict=True))[table.wide :]
    text = _pairs(pairs)
    if len(pairs) <= MANY or row is first:
        return text
    rest = _pairs([pair for pair, other in zip(pairs, first[table.wide :], strict=True) if pair[1] != other])
    begin = f"as {_name(table, first)}"
    return min(f"{begin}, but {rest}" if rest else begin, text, key=len)


def _pairs(pairs: Iterable[tuple[str, str]]) -> str:
    """Headings with their cells; the type of a slot goes by the slot's name."""
    return ", ".join(f"{name.removesuffix('.type')} {value}" for name, value in pairs if value not in ("", NOTHING))


def _last_heading(table: Table) -> str:
    """What is told in one cell: the decisions of alternatives, which have numbers; else a column of its own name."""
    is_alternatives = all(row[table.label].removeprefix("#").isdecimal() for row in table.rows)
    return DECISIONS if is_alternatives or len(table.headings) != (table.wide or 0) + 1 else table.headings[-1]


def _name(table: Table, row: tuple[str, ...]) -> str:
    """By what a row is called: alternatives by their number."""
    name = row[table.label].removeprefix("#")
    return f"#{name}" if name.isdecimal() else name


def _figures(table: Table, row: tuple[str, ...]) -> str:
    """The other columns of a row that is told as a line."""
    pairs = [(name, value) for name, value in zip(table.headings, row[: table.wide], strict=False) if value]
    return ", ".join(f"{name} {value}" for at, (name, value) in enumerate(pairs) if at != table.label)


def _grid(
    console: Console,
    table: Table,
    rows: tuple[tuple[str, ...], ...],
    columns: int,
    told: list[str] | None = None,
    *,
    is_tight: bool = False,
    longest: int = ANY_WIDTH,
) -> Grid:
    """The first columns as a table, `told` as a last one.

    `is_tight` breaks headings into lines of one word; a word of a cell that is no longer than `longest` stays whole.
    """
    grid = plain_table(console, plain(table.caption))
    for at, heading in enumerate(table.headings[:columns]):
        cells = [row[at] for row in rows]
        parts = cells if table.wide is not None else [word[:longest] for cell in cells for word in cell.split()]
        least = max(map(len, [*parts, *(word[:longest] for word in heading.split())]), default=0)
        grid.add_column(
            plain(heading),
            justify="right" if at in table.numbers else "left",
            overflow="fold",
            min_width=least,
            max_width=least if is_tight else None,
        )
    if told is not None:
        grid.add_column(plain(_last_heading(table)), overflow="fold")
    if table.bars:
        grid.add_column("")
    signs = ASCII if is_ascii(console) else {}
    room = BAR if columns <= FEW else BAR // 2
    for number, row in enumerate(rows):
        if table.total and number == len(table.rows) - 1:
            grid.add_section()
        cells = [plain(cell).translate(signs) for cell in row[:columns]]
        cells += [plain(told[number])] if told is not None else []
        cells += ["#" * ceil(room * table.bars[number])] if table.bars else []
        grid.add_row(*cells)
    return grid
