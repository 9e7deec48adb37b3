"""``dse analyse``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from dse.cli.common import all_option, check_writable, in_time, json_option, load_told, problem_argument, quiet_option
from dse.cli.grouping import GroupedCommand
from dse.cli.options import question_of, question_options
from dse.cli.pages import answer, page_path, report_option
from dse.cli.printing import tell
from dse.support.errors import EXIT_COMPLETE, EXIT_NO

if TYPE_CHECKING:
    from dse.questions.named_design import NamedDesign
    from dse.questions.problem import Problem


@click.command("analyse", cls=GroupedCommand)
@problem_argument()
@click.option(
    "--design",
    multiple=True,
    metavar="'DECISION = OPTION'",
    help="The design: RESULT.json#ID (an alternative, with its question), or a decision other than the baseline's.",
)
@click.option(
    "--response-times", is_flag=True, help="Also print the response time of every thread, by core and priority."
)
@question_options
@all_option
@report_option
@json_option
@quiet_option
@in_time
def command(
    file: str,
    design: tuple[str, ...],
    response_times: bool,
    every: bool,
    report: str | None,
    json_path: str | None,
    quiet: bool,
    **options: Any,
) -> int:
    """One design, by default the baseline: its verdict, the nearest limits, its latencies.

    With --all also each contribution to each latency, the load of processors and buses by thread and connection, and
    every metric. Exit code 4 when the design is not valid, violates a requirement, or a requirement cannot be checked.
    """
    check_writable(json_path, page_path(report))
    from dse.questions.verbs.analyse import analyse

    design_asked = named(design, load_told(file).ask(**question_of(options)))
    analysis = analyse(design_asked.problem, design_asked.texts, response_times=response_times)
    from dse.report.content.analyse import analysis_page

    page, lead = analysis_page(analysis), f"{analysis.space.name}: {design_asked.called}"
    answer(page, (json_path, analysis.to_json), report=report, every=every, quiet=quiet, lead=lead)
    return EXIT_COMPLETE if analysis.is_feasible else EXIT_NO


def named(texts: tuple[str, ...], problem: Problem) -> NamedDesign:
    """The design that `texts` name; where its result asks otherwise than the file, standard error says so.

    Raises `UsageError` where a result cannot be read or the decisions do not fit.
    """
    from dse.questions.named_design import named_design

    design = named_design(problem, texts)
    for remark in design.remarks:
        tell(f"dse: {remark}")
    return design
