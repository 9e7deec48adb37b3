"""A page as Markdown, for a pull request."""

from __future__ import annotations

import re
from collections.abc import Iterator

from dse.report.page import Block, Listing, Page, Section, Table, Text, Timeline

LINE = 100
"""Letters of a line that a forge shows without scrolling."""


def markdown_page(page: Page) -> str:
    """The page as Markdown; its plots are left out, for tables have their figures.

    GitHub-flavoured Markdown; characters with a meaning in Markdown are escaped.
    """
    lines = [f"# {escaped(page.title)}", ""]
    lines += [escaped(page.lead), ""] if page.lead else []
    for section in page.sections:
        lines += _section_lines(section)
    return "\n".join(lines) + "\n"


def escaped(text: str) -> str:
    r"""Text that Markdown and the HTML inside it show as it is, also in a table cell.

    >>> escaped("<b> a|b *c* [d](e)")
    '&lt;b&gt; a\\|b \\*c\\* \\[d\\](e)'
    """
    plain = " ".join(text.split())
    marked = re.sub(
        r"([\\`*\[\]|~$]|(?<!\w)_|_(?!\w))",
        r"\\\1",
        plain.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;"),
    )
    marked = re.sub(r"(https?|ftp):", r"\1&#58;", marked).replace("www.", "www&#46;").replace("@", "&#64;")
    return re.sub(r"^([#=+-]+(?=\s|$)|\d+(?=[.)](\s|$)))", _unmarked, marked)


def _unmarked(match: re.Match[str]) -> str:
    """A beginning that would make a heading, a list or a rule."""
    text = match.group(1)
    return f"&#{ord(text[0])};{text[1:]}"


def _section_lines(section: Section) -> Iterator[str]:
    yield f"## {escaped(section.title)}".replace(" #", " \\#")  # a forge would make it the link of an issue
    yield ""
    for block in section.blocks:
        yield from _block_lines(block)


def _block_lines(block: Block) -> Iterator[str]:
    if isinstance(block, Text):
        yield escaped(block.text) if block.tone == "plain" else f"**{escaped(block.text)}**"
        yield ""
    elif isinstance(block, Listing):
        for item in block.items:
            label = f"**{escaped(item.label)}**: " if item.label else ""
            yield f"{'  ' * max(0, item.depth - 1)}- {label}{escaped(item.text)}"
        yield ""
    elif isinstance(block, Table):
        yield from _table_lines(block)
    elif isinstance(block, Timeline):
        yield from (f"**{escaped(block.caption)}**", "", "```text")
        yield from (line.replace("`", "'") for line in block.lines(LINE))
        yield from ("```", "", *(escaped(text) for _, text in block.marks), "")


def _table_lines(table: Table) -> Iterator[str]:
    """A table as lines of Markdown."""
    if table.caption:
        yield f"**{escaped(table.caption)}**"
        yield ""
    yield _row(table.headings)
    yield "|" + "|".join(" ---: " if at in table.numbers else " --- " for at in range(len(table.headings))) + "|"
    for row in table.written:
        yield _row(row)
    yield ""
    if table.left_out:
        yield escaped(table.left_out)
        yield ""


def _row(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(escaped(cell) or " " for cell in cells) + " |"
