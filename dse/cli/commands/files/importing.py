"""``dse import``."""

from __future__ import annotations

from typing import Any

import click

from dse.cli.common import ExistingPath, all_option, check_writable, in_time, write_text
from dse.cli.grouping import GroupedCommand
from dse.cli.printing import in_a_line, tell
from dse.importers.registry import importers

REPEATED = ("library",)
"""Options that may be given several times: their texts are joined by commas."""


def _format_options(command: GroupedCommand) -> GroupedCommand:
    """The options of every format, each once."""
    texts: dict[str, dict[str, list[str]]] = {}
    for importer in importers():
        for name, text in importer.options.items():
            texts.setdefault(name, {}).setdefault(text, []).append(importer.name)
    for name, formats in texts.items():
        said = " ".join(f"{', '.join(names)}: {text}" for text, names in formats.items())
        command.params.append(click.Option([f"--{name}"], metavar="TEXT", help=said, multiple=name in REPEATED))
    return command


@click.command(
    "import",
    cls=GroupedCommand,
    epilog="Formats: " + "; ".join(f"{item.name}, {item.what}" for item in importers()) + ".",
)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=ExistingPath())
@click.option(
    "--format", "form", type=click.Choice([item.name for item in importers()]), help="What FILE is; else by its suffix."
)
@click.option(
    "--times",
    multiple=True,
    type=ExistingPath(),
    metavar="PATH",
    help="Measured execution times for the threads of FILE: CSV as `dse fit` reads them, or a trace.",
)
@click.option(
    "--bag",
    "bags",
    multiple=True,
    type=ExistingPath(),
    metavar="PATH",
    help="A recording of ROS: the sizes of FILE's topics, and the rates of those that come from outside.",
)
@click.option("-o", "--output", default="-", metavar="PATH", help="The file to write; standard output if left out.")
@all_option
@in_time
def command(
    files: tuple[str, ...],
    form: str | None,
    times: tuple[str, ...],
    bags: tuple[str, ...],
    output: str,
    every: bool,
    **options: str | tuple[str, ...] | None,
) -> int:
    """A file of another format, or several, as a problem file, or as a file that problem files include.

    Where several files differ, the first one counts, with a remark. Each figure has its place in the file (`source`).
    Standard error lists the fields to fill in (with unit and reason), guesses, and what was not understood, with its
    place; warnings that differ only in names are counted.
    """
    check_writable(output, replaces_problems=True)
    from dse.questions.verbs.import_file import import_file

    texts = {name: ",".join(value) or None if isinstance(value, tuple) else value for name, value in options.items()}
    stated: dict[str, Any] = {name.replace("_", "-"): value for name, value in texts.items()}
    imported = import_file(files, form, times, bags, **stated)
    write_text(output, imported.text)
    from dse.report.words.imported import import_block

    for line in import_block(imported.document, imported.remarks, every=every):
        tell(in_a_line(line))
    return 0


command = _format_options(command)
