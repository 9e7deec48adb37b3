"""Tables and texts that any terminal can show."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table


def plain_table(console: Console, title: str = "") -> Table:
    """An empty table that stays readable without UTF-8; the title is markup."""
    ascii_only = (console.encoding or "utf-8").lower().replace("-", "") not in ("utf8", "utf8mb4", "utf16")
    return Table(title=title or None, title_justify="left", box=box.ASCII2 if ascii_only else box.SIMPLE_HEAD)


def plain(text: str) -> str:
    """Text in which square brackets are no markup."""
    return text.replace("[", r"\[")
