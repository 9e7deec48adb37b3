"""``dse compare``."""

from __future__ import annotations

import click

from dse.cli.common import check_writable, console, in_time, json_option, report_option, save, tell_carried, write_page


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
    from dse.report.terminal import print_page

    page = comparison_page(found)
    if json_path != "-":
        print_page(console(), page)
    failure = save((json_path, found.to_json)) or write_page(report, page)
    if failure is not None:
        raise failure
    return 0
