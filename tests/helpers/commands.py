"""The reference of options in docs/commands.md: `python -m tests.helpers.commands` writes it anew."""

from __future__ import annotations

import re
from pathlib import Path

import click

from dse.cli.main import COMMANDS, cli

PAGE = Path(__file__).parents[2] / "docs" / "commands.md"
MARK = "<!-- the rest of this page is made of the commands: python -m tests.helpers.commands -->\n"
Option = tuple[str, str]


def page(text: str) -> str:
    """The page with its reference as the commands say it."""
    head, mark, _ = text.partition(MARK)
    assert mark, f"{PAGE.name} has lost its mark"
    commands = {name: _command(name) for name in COMMANDS}
    options = {name: _options(name, command) for name, command in commands.items()}
    users: dict[Option, list[str]] = {}
    for name, found in options.items():
        for option in found:
            users.setdefault(option, []).append(name)
    shared = {option: names for option, names in users.items() if len(names) > 2}
    told = "\n## Options of several commands\n\n| option | meaning | commands |\n|---|---|---|\n"
    told += "".join(f"{_row(option)} {', '.join(names)} |\n" for option, names in shared.items())
    for name, command in commands.items():
        words = "\n\n".join(" ".join(part.split()) for part in (command.help or "").replace("\b", "").split("\n\n"))
        called = " ".join(command.collect_usage_pieces(click.Context(command, info_name=name)))
        told += f"\n## dse {name}\n\n`dse {name} {called}`\n\n{words}\n"
        own = [option for option in options[name] if option not in shared]
        if own:
            told += "\n| option | meaning |\n|---|---|\n" + "".join(f"{_row(option)}\n" for option in own)
    return head + mark + told


def _command(name: str) -> click.Command:
    assert isinstance(cli, click.Group)
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    return command


def _options(name: str, command: click.Command) -> list[Option]:
    context = click.Context(command, info_name=name)
    records = [item.get_help_record(context) for item in command.params if isinstance(item, click.Option)]
    return [record for record in records if record is not None]


def _row(option: Option) -> str:
    named, meaning = (re.sub(r"\s+", " ", part).replace("|", "\\|") for part in option)
    return f"| `{named}` | {meaning.replace('<', '&lt;')} |"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
