"""``dse schema``."""

from __future__ import annotations

import json

import click

from dse.cli.common import check_writable, write_text

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
    "sweep",
    "verification",
)


@click.command("schema")
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
    from dse.results.forms.registry import schema

    write_text(output, json.dumps(schema(name), ensure_ascii=False, indent=1) + "\n")
    return 0
