"""The report as Markdown, for a pull request."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from dse.report.document import Alternative, Document, Table
from dse.report.parts import Section

DETAILED = 3


def markdown_report(document: Document, top: int | None = None, studies: Sequence[Section] = ()) -> str:
    """Summary, the whole ranked table, the first three alternatives (or `top`, if fewer) in detail, the foundations.

    Near-identical alternatives do not count among the three. `studies` come before the foundations.
    """
    return "\n".join(_lines(document, min(top or DETAILED, DETAILED), studies)) + "\n"


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


def _unmarked(found: re.Match[str]) -> str:
    """A beginning that would make a heading, a list or a rule."""
    text = found.group(1)
    return f"&#{ord(text[0])};{text[1:]}"


def _lines(document: Document, detailed: int, studies: Sequence[Section]) -> Iterator[str]:
    result = document.result
    yield f"# {escaped(document.title)}"
    yield ""
    for text in document.summary:
        yield escaped(text)
        yield ""
    for text, items in document.conflicts:
        yield escaped(text)
        yield ""
        if items:
            yield from (f"- {escaped(item)}" for item in items)
            yield ""
    if result.front:
        yield "## Alternatives"
        yield ""
        yield from table_lines(document.front_table, caption=True)
        if document.common:
            shared = "; ".join(f"{name} {value}" for name, value in document.common)
            yield escaped(f"In all of them: {shared}.")
            yield ""
    leading = document.leading[:detailed]
    for alternative in leading:
        yield from _alternative(alternative)
    hidden = len(document.alternatives) - len(leading)
    if hidden > 0:
        yield f"The other {hidden} alternatives are in the table above, and in full in the HTML report."
        yield ""
    for section in studies:
        yield from section_lines(section)
    yield from _foundations(document)


def _alternative(alternative: Alternative) -> Iterator[str]:
    yield f"## Alternative \\#{alternative.point.id}, rank {alternative.rank}"
    yield ""
    for sentence in alternative.sentences:
        yield f"- **{escaped(sentence.label)}**: {escaped(sentence.text)}"
    yield ""
    yield from table_lines(alternative.decisions)
    yield from table_lines(alternative.requirements)
    yield "<details><summary>Latency, processors and buses</summary>"
    yield ""
    for flow in alternative.flows:
        yield from table_lines(flow.table, caption=True)
    for table in alternative.usage_tables:
        yield from table_lines(table, caption=True)
    yield "</details>"
    yield ""
    for others in alternative.others:
        yield escaped(others.words)
        yield ""
        for name, text in others.designs:
            yield f"- {escaped(name)}: {escaped(text)}"
        yield ""


def section_lines(section: Section) -> Iterator[str]:
    """A section as lines of Markdown."""
    yield f"## {escaped(section.title)}"
    yield ""
    for text in section.texts:
        yield escaped(text)
        yield ""
    for table in section.tables:
        yield from table_lines(table, caption=True)


def table_lines(table: Table, caption: bool = False) -> Iterator[str]:
    """A table as lines of Markdown."""
    if caption:
        yield f"**{escaped(table.caption)}**"
        yield ""
    yield _row(table.headings)
    yield "|" + "|".join(" ---: " if at in table.numbers else " --- " for at in range(len(table.headings))) + "|"
    for row in table.rows:
        yield _row(row)
    yield ""


def _row(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(escaped(cell) or " " for cell in cells) + " |"


def _foundations(document: Document) -> Iterator[str]:
    yield "## What this rests on"
    yield ""
    for label, text in document.provenance:
        yield f"- **{escaped(label)}**: {escaped(text)}"
    yield ""
    for title, texts in (
        ("Assumptions of the problem", document.space.assumptions),
        ("Known gaps of the model", document.gaps),
    ):
        if texts:
            yield f"**{title}**"
            yield ""
            for text in texts:
                yield f"- {escaped(text)}"
            yield ""
