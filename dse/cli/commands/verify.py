"""``dse verify``."""

from __future__ import annotations

import click

from dse.cli.common import ExistingPath, all_option, check_writable, json_option, quiet_option, time_limit_option
from dse.cli.grouping import GroupedCommand
from dse.cli.pages import answer, page_path, report_option
from dse.cli.progress import Working
from dse.support.timelimit import TimeLimit


@click.command("verify", cls=GroupedCommand)
@click.argument("result", type=ExistingPath(dir_okay=False, allow_dash=True))
@click.option(
    "--problem",
    type=ExistingPath(dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="The problem file, if it has moved.",
)
@click.option(
    "--method",
    type=click.Choice(["auto", "exhaustion", "model"]),
    default="auto",
    show_default=True,
    help="Enumerate every design, or solve a second model; auto enumerates up to 200 000 designs.",
)
@time_limit_option("and say what was confirmed")
@all_option
@report_option
@json_option
@quiet_option
def command(
    result: str,
    problem: str | None,
    method: str,
    time_limit: TimeLimit,
    every: bool,
    report: str | None,
    json_path: str | None,
    quiet: bool,
) -> int:
    """Prove a result again, without the search and the encoding that made it.

    Exit code 0 when everything the result says was confirmed, 4 when it is rejected (with what is wrong), 5 when
    nothing is wrong but not everything could be proved again.
    """
    check_writable(json_path, page_path(report))
    from dse.questions.verify.verify import verify

    with Working("proving the front again", quiet=quiet):
        verification = verify(result, problem=problem, method=method, time_limit_s=time_limit.rest_s)  # type: ignore[arg-type]
    from dse.report.content.verify import verification_page

    answer(verification_page(verification), (json_path, verification.to_json), report=report, quiet=quiet, every=every)
    return verification.exit_code
