"""``dse schema``."""

from __future__ import annotations

import json

import click

from dse.cli.common import check_writable, write_text


@click.command("schema")
@click.option("-o", "--output", default="-", metavar="PATH", help="Where to write it; - (default) for standard output.")
def command(output: str) -> int:
    """Print the JSON Schema of problem files, for completion and checks in an editor."""
    check_writable(output)
    from dse.spec.schema import json_schema

    write_text(output, json.dumps(json_schema(), ensure_ascii=False, indent=1) + "\n")
    return 0
