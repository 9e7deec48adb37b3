"""A page as text for a terminal: tables that stay readable in a pipe, in 80 columns and without UTF-8."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import ceil
from typing import TypeVar

from rich.console import Console

from dse.report.page import MINUS, MORE, NOTHING, Block, Item, Listing, Page, Plot, Table, Text, Timeline
from dse.report.text_table import BAR, GAP, TextTable, is_ascii, print_hanging, print_line, shown_text

T = TypeVar("T")
STYLES = {"plain": "", "strong": "bold", "wrong": "bold red", "good": "green", "doubtful": "yellow", "quiet": "dim"}
FEW = 3
"""Beside more columns the longest bar is half as long."""
ASCII = str.maketrans({NOTHING: "-", MINUS: "-"})
EMPTY = (NOTHING, "-")
DECISIONS = "decisions"
MANY = 8
"""Where more decisions are told together, a row is told by what differs from the first."""
ROOM = 44
"""Columns of a terminal that the decisions of a row need beside the others."""
LONGEST = 100
"""Letters of a line of a Gantt chart."""
PAGE = "--report PAGE.html is a page."


def print_page(console: Console, page: Page, *, every: bool = False, lines: int | None = None) -> None:
    """Print the lead and the sections of a page, but for those that say what a file rests on, and the details.

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
    lead = [Text(page.lead, "wrong" if page.is_amiss else "strong")] if page.lead else []
    rest = f"{MORE} shows the rest: {'; '.join(left_out)}. {PAGE}" if left_out else ""
    if lines is not None and not every:
        beside = _height(console, *lead) + (_lines_of(console, lambda: print_hanging(console, rest, "")) if rest else 0)
        shown = _cut_to(console, shown, lines - beside)
    for block in (*lead, *shown):
        print_block(console, block, every=every)
    if rest:
        print_hanging(console, rest, "")


def page_height(console: Console, page: Page) -> int:
    """The height of a page that is printed in full, in lines.

    Counted by printing into a buffer with the console's width; decides between the whole page and its brief form.
    """
    return _lines_of(console, lambda: print_page(console, page))


def _lines_of(console: Console, tell: Callable[[], None]) -> int:
    with console.capture() as said:
        tell()
    return said.get().count("\n")


def _height(console: Console, *blocks: Block) -> int:
    return sum(_lines_of(console, partial(print_block, console, block)) for block in blocks)


def _cut_to(console: Console, blocks: Sequence[Block], lines: int) -> list[Block]:
    """The blocks cut to `lines` lines as far as possible: the longest table or list loses a row at a time."""
    kept = list(blocks)
    heights = [_height(console, block) for block in kept]
    while sum(heights) > lines:
        smaller = {at: less for at, block in enumerate(kept) if (less := _smaller(block)) is not None}
        if not smaller:
            break
        at = max(smaller, key=lambda at: heights[at])
        kept[at] = smaller[at]
        heights[at] = _height(console, kept[at])
    return kept


def _smaller(block: Block) -> Block | None:
    """The block with one row less; None for a text, and for a table or list of one row."""
    if not isinstance(block, Listing | Table) or block.brief is None:
        return None
    every = block.items if isinstance(block, Listing) else block.rows
    shown = len(_first(every, block.brief))
    less = shown - (2 if shown == len(every) else 1)  # one more than `brief` is shown rather than told of
    return replace(block, brief=less) if less >= 1 else None


def print_block(console: Console, block: Block, *, every: bool = False) -> None:
    """A paragraph, a list or a table; a plot is left out, for a table has the same figures.

    `every` prints all rows and texts in full; else `brief` forms with a hint at the option that shows the rest.
    """
    if isinstance(block, Text):
        said = block.text if every or not block.brief else block.brief
        print_hanging(console, said, "", STYLES[block.tone], " " * block.hang)
    elif isinstance(block, Listing):
        shown = _first(block.items, None if every else block.brief)
        for item in shown:
            _print_item(console, item if every else replace(item, text=_cut(item.text, item.told)))
        if len(block.items) > len(shown):
            _print_item(console, Item(f"and {len(block.items) - len(shown)} more ({MORE})", depth=shown[0].depth))
    elif isinstance(block, Table):
        _print_table(console, block if every or block.short is None else block.short, every=every)
    elif isinstance(block, Timeline):
        print_hanging(console, block.caption)
        for line in block.lines(min(console.width, LONGEST)):
            print_line(console, shown_text(console, line))
        for _, text in block.marks:
            print_hanging(console, text)
    else:
        assert isinstance(block, Plot)


def _first(rows: tuple[T, ...], most: int | None) -> tuple[T, ...]:
    """The first `most`; all where one more than these takes no more room than to say that there is one."""
    return rows if most is None or len(rows) <= most + 1 else rows[:most]


def _print_item(console: Console, item: Item) -> None:
    print_hanging(console, item.line, "  " * item.depth, STYLES[item.tone])


def _print_table(console: Console, table: Table, *, every: bool) -> None:
    """The rows that are shown, as columns where these fit, else each as a paragraph; how many more rows there are."""
    shown = _first(table.rows, None if every else table.brief)
    more = len(table.rows) - len(shown)
    grid = TextTable(
        tuple(shown_text(console, text) for text in table.headings),
        tuple(tuple(shown_text(console, cell).translate(_signs(console)) for cell in row) for row in shown),
        table.numbers,
        table.paths,
    )
    print_line(console, "")
    print_hanging(console, table.caption, "", "italic", "") if table.caption else None
    columns, widths = _columns(console, table if not every else replace(table, spare=()), grid)
    if widths is not None:
        _print_grid(console, table, grid.only(columns), widths)
    elif table.wide is not None:
        _print_told(console, table, grid, None if every else table.told)
    else:
        few = grid.only(columns)
        for row, whole in zip(few.rows, grid.rows, strict=True):
            print_hanging(console, f"{_name(table, whole)}: {_pairs_of(table, few.headings, row)}")
    if more:
        print_hanging(console, table.rest.format(more), "")


def _signs(console: Console) -> dict[int, str]:
    return ASCII if is_ascii(console) else {}


def _columns(console: Console, table: Table, grid: TextTable) -> tuple[list[int], list[int] | None]:
    """The columns that are shown and their widths; None where they do not fit.

    Columns that can be spared go first; of a table with decisions the cells stay in one line.
    """
    columns = list(range(len(grid.headings)))
    for spared in (None, *table.spare):
        columns = [at for at in columns if at != spared]
        widths = grid.only(columns).widths(console.width)
        if widths is not None:
            return columns, widths
    return columns, grid.only(columns).widths(console.width, wrapped=True) if table.wide is None else None


def _print_grid(console: Console, table: Table, grid: TextTable, widths: list[int]) -> None:
    """Columns below each other, with bars beside them where there is room."""
    heads, rows = grid.lines(widths)
    for line in heads:
        print_line(console, line, "bold")
    used = sum(widths) + GAP * (len(widths) - 1)
    room = min(BAR[1] if len(widths) <= FEW else BAR[1] // 2, console.width - used - GAP)
    for number, lines in enumerate(rows):
        if table.total and number == len(table.rows) - 1:
            print_line(console, ("-" if is_ascii(console) else "─") * used)
        bar = "#" * ceil(room * table.bars[number]) if table.bars and room >= BAR[0] else ""
        for line in [f"{lines[0]:<{used}}{' ' * GAP}{bar}".rstrip() if bar else lines[0], *lines[1:]]:
            print_line(console, line, "bold" if number in table.strong else "")


def _print_told(console: Console, table: Table, grid: TextTable, most: int | None) -> None:
    """Print the columns from `wide` on in one cell of each row, or below the table, or each row as a paragraph."""
    assert table.wide is not None
    texts = [_cut(_joined(table, grid, row), most) for row in grid.rows]
    bare = grid.only(range(table.wide))
    widths = bare.widths(console.width - ROOM)
    if widths is not None:
        rows = tuple((*row[: table.wide], text) for row, text in zip(grid.rows, texts, strict=True))
        heading = DECISIONS if len(grid.headings) > table.wide + 1 else grid.headings[table.wide]
        beside = TextTable((*bare.headings, heading), rows, table.numbers)
        beside_widths = beside.widths(console.width, wrapped=True)
        assert beside_widths is not None
        _print_grid(console, table, beside, beside_widths)
        return
    widths = bare.widths(console.width)
    if widths is not None:
        _print_grid(console, table, bare, widths)
    for row, text in zip(grid.rows, texts, strict=True):
        figures = "" if widths is not None else f"{_pairs_of(table, bare.headings, row)}; "
        print_hanging(console, f"{_name(table, row)}: {figures}{text}")


def _cut(text: str, most: int | None) -> str:
    """A comma-separated list as far as there is room, and how many more there are.

    >>> _cut("computer large, can0 can_500k, nav.period 5 ms", 32)
    'computer large and 2 more (--all)'
    """
    if most is None or len(text) <= most:
        return text
    items = text.split(", ")
    rest = f" and {len(items)} more ({MORE})"
    count = max(1, len(text[: most - len(rest)].split(", ")) - 1)
    return f"{', '.join(items[:count])} and {len(items) - count} more ({MORE})" if count < len(items) else text


def _joined(table: Table, grid: TextTable, row: tuple[str, ...]) -> str:
    """The decisions of a row in a few words: ``computer large, can0 can_500k``.

    Of many it is what differs from the first row, where that is shorter.
    """
    assert table.wide is not None
    if len(grid.headings) == table.wide + 1:
        return row[table.wide]
    first = grid.rows[0]
    pairs = list(zip(grid.headings, row, strict=True))[table.wide :]
    text = _pairs(pairs)
    if len(pairs) <= MANY or row is first:
        return text
    rest = _pairs([pair for pair, other in zip(pairs, first[table.wide :], strict=True) if pair[1] != other])
    begin = f"as {_name(table, first)}"
    return min(f"{begin}, but {rest}" if rest else begin, text, key=len)


def _pairs(pairs: Iterable[tuple[str, str]]) -> str:
    """Headings with their cells; the type of a slot goes by the slot's name."""
    return ", ".join(f"{name.removesuffix('.type')} {value}" for name, value in pairs if value not in ("", *EMPTY))


def _name(table: Table, row: tuple[str, ...]) -> str:
    """By what a row is called: alternatives by their number."""
    name = row[table.label].removeprefix("#")
    return f"#{name}" if name.isdecimal() else name


def _pairs_of(table: Table, headings: Sequence[str], row: tuple[str, ...]) -> str:
    """The other columns of a row with a remark as a paragraph."""
    pairs = [(name, value) for name, value in zip(headings, row, strict=False) if value]
    return ", ".join(f"{name} {value}".strip() for at, (name, value) in enumerate(pairs) if at != table.label)
