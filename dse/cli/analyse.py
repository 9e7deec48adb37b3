"""``dse analyse``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dse.cli.common import (
    check_writable,
    console,
    in_time,
    json_option,
    problem_argument,
    question_of,
    question_options,
    write_text,
)
from dse.errors import EXIT_COMPLETE, EXIT_NO, about

if TYPE_CHECKING:
    from dse.api.problem import Problem


@click.command("analyse")
@problem_argument
@click.option(
    "--design",
    multiple=True,
    metavar="'DECISION = OPTION'",
    help="A decision of the design, on top of the baseline; or RESULT.json#ID, an alternative of a solve.",
)
@click.option("--response-times", is_flag=True, help="Also the response time of every thread, by core and priority.")
@question_options
@json_option
@in_time
def command(file: str, design: tuple[str, ...], response_times: bool, json_path: str | None, **options: Any) -> int:
    """One design (the baseline, unless told otherwise): latency contributors, CPU and bus tables, verdicts.

    Exit code 4 when the design breaks a requirement or is not valid.
    """
    check_writable(json_path)
    from dse.api.analysing import analyse
    from dse.api.problem import load

    problem = load(Path(file)).ask(**question_of(options))
    analysis = analyse(problem, choices_of(design, problem), response_times=response_times)
    if json_path != "-":
        from dse.report.terminal import print_analysis

        print_analysis(console(), analysis)
    if json_path is not None:
        write_text(json_path, analysis.to_json())
    return EXIT_COMPLETE if analysis.is_feasible else EXIT_NO


def choices_of(texts: tuple[str, ...], problem: Problem) -> list[str]:
    """Texts ``a = b``; ``RESULT.json#ID`` stands for all decisions of that alternative, which the problem must have."""
    from dse.api.problem import read_choices
    from dse.results.reading import decisions_in_file

    found: list[str] = []
    for text in texts:
        path, mark, number = text.rpartition("#")
        if mark and path.endswith(".json"):
            chosen = [f"'{name}' = {option}" for name, option in decisions_in_file(path, number).items()]
            with about(path):
                read_choices(problem.space, chosen)
            found += chosen
        else:
            found.append(text)
    return found
