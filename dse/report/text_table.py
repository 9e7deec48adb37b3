"""Tables and texts that any terminal can show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from textwrap import wrap
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from dse.space.model.space import Space
from dse.space.model.trees import leaves
from dse.space.question.settings import OSATE_SETTINGS, SETTINGS, default_deadlines


def plain_table(console: Console, title: str = "") -> Table:
    """An empty table that stays readable without UTF-8; the title is markup."""
    return Table(title=title or None, title_justify="left", box=box.ASCII2 if is_ascii(console) else box.SIMPLE_HEAD)


def is_ascii(console: Console) -> bool:
    """Whether a console shows no more than ASCII."""
    return (console.encoding or "utf-8").lower().replace("-", "") not in ("utf8", "utf8mb4", "utf16")


def basis_words(settings: Mapping[str, Any]) -> str:
    """By which rules the figures count, from settings by name (`dse.space.question.settings`), in a few words.

    >>> basis_words({"profile": "dse", "worst_case": "deadline", "processing": "response_time", "deadlines": "all",
    ...     "overload": "allowed"})
    'profile dse, processing by response time, deadlines: all, overload allowed'
    """
    found = [f"profile {settings['profile']}"]
    if settings["profile"] != "dse":
        found.append(f"worst case by {settings['worst_case'].replace('_', ' ')}")
        others = [name for name in OSATE_SETTINGS if name != "worst_case"]
        unusual = [name for name in others if settings.get(name, SETTINGS[name][0]) != SETTINGS[name][0]]
        found += [f"{name.replace('_', ' ')}: {settings[name].replace('_', ' ')}" for name in unusual]
    found.append(f"processing by {settings['processing'].replace('_', ' ')}")
    if settings["deadlines"] != default_deadlines(settings["profile"]):
        found.append(f"deadlines: {settings['deadlines']}")
    if settings["overload"] != "forbidden":
        found.append("overload allowed")
    if settings.get("robust"):
        found.append("robust: requirements hold for all stated values")
    return ", ".join(found)


def plain(text: str) -> str:
    """Text of one line in which square brackets are no markup."""
    return text.replace("[", r"\[").replace("\n", r"\n").replace("\t", r"\t")


def print_hanging(console: Console, text: str, indent: str = "  ") -> None:
    """A paragraph whose further lines are indented more than its first."""
    lines = wrap(text, console.width, initial_indent=indent, subsequent_indent=indent + "    ", break_on_hyphens=False)
    console.print("\n".join(lines), markup=False)


PER_CORE = "Utilisation counts one core as 100 %, n cores as n times that; a limit of 70 % is one of each core."


def scale_words(space: Space) -> str:
    """What 100 % of utilisation is, where that may be asked: a processor has several cores."""
    several = any(count > 1 for slot in space.processors for count in leaves(slot.cores))
    return PER_CORE if several else ""


def scale_of(names: Iterable[str]) -> str:
    """The same for a study, whose data do not say how many cores there are: where what is shown names utilisation."""
    return PER_CORE if any("utilisation" in name for name in names) else ""
