"""``dse compare``."""

from __future__ import annotations

import json

import click

from dse.cli.common import check_writable, console, in_time, json_option, tell_carried, write_text


@click.command("compare")
@click.argument("one", metavar="A")
@click.argument("other", metavar="B")
@click.option(
    "--problem",
    type=click.Path(exists=True, dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="The problem file, if it has moved.",
)
@json_option
@in_time
def command(one: str, other: str, problem: str | None, json_path: str | None) -> int:
    """Two results (RESULT.json), two designs (RESULT.json#ID), or a design and baseline, side by side."""
    check_writable(json_path)
    from dse.api.compare import compare

    found = compare(one, other, problem)
    for file in found.carried:
        tell_carried(file, is_carried=True)
    if json_path != "-":
        from dse.report.compare import print_comparison

        print_comparison(console(), found)
    if json_path is not None:
        write_text(json_path, json.dumps(found.to_dict(), ensure_ascii=False, indent=1) + "\n")
    return 0
