"""``dse schema``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from dse.cli.common import check_writable, write_text
from dse.cli.grouping import GroupedCommand
from dse.support.errors import UsageError
from dse.support.files.reading import beginning

FORMATS = (
    "problem",
    "result",
    "analysis",
    "check",
    "comparison",
    "explanation",
    "fit",
    "sensitivity",
    "simulation",
    "sizes",
    "sweep",
    "verification",
)
MOST_BYTES = 200
"""Bytes of a file in which a schema names the language that it is written in."""


@click.command("schema", cls=GroupedCommand)
@click.option(
    "--of",
    "name",
    type=click.Choice(FORMATS),
    default="problem",
    show_default=True,
    help="Of which files: problems, or what a command writes with --json.",
)
@click.option("-o", "--output", default="-", metavar="PATH", help="Where to write it; - (default) for standard output.")
def command(name: str, output: str) -> int:
    """Print the JSON Schema of problem files, for completion and checks in an editor, or of what commands write."""
    check_writable(output)
    _check_replaced(output)
    from dse.answers.forms.registry import schema

    write_text(output, json.dumps(schema(name), ensure_ascii=False, indent=1) + "\n")
    return 0


def _check_replaced(output: str) -> None:
    """What a schema takes the place of is a schema: the command reads nothing by which a slip could be noticed.

    Raises
    ------
    UsageError
        when there is another file, such as a problem.
    """
    path = Path(output)
    if output == "-" or not path.is_file() or not path.stat().st_size:
        return
    begins = beginning(path, MOST_BYTES).lstrip()
    if not begins.startswith(b"{") or b'"$schema"' not in begins:
        raise UsageError(f"{output}: is no JSON Schema, and is not overwritten; give another name")
