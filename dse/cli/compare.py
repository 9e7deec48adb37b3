"""``dse compare``."""

from __future__ import annotations

import click

from dse.cli.common import check_writable, in_time, json_option, tell_carried
from dse.cli.pages import answer, report_option


@click.command("compare")
@click.argument("one", metavar="A")
@click.argument("other", metavar="B")
@click.option(
    "--problem",
    type=click.Path(exists=True, dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="The problem file, if it has moved.",
)
@report_option
@json_option
@in_time
def command(one: str, other: str, problem: str | None, report: str | None, json_path: str | None) -> int:
    """Two results (RESULT.json), two designs (RESULT.json#ID), or a design and baseline, side by side."""
    check_writable(json_path, report)
    from dse.api.compare import compare

    found = compare(one, other, problem)
    for file in found.carried:
        tell_carried(file, is_carried=True)
    from dse.report.compare import comparison_page

    answer(comparison_page(found), (json_path, found.to_json), report=report)
    return 0
