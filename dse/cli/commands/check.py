"""``dse check``."""

from __future__ import annotations

import os
import shlex
from typing import Any

import click

from dse.cli.common import all_option, check_writable, in_time, json_option, load_told, problem_argument, quiet_option
from dse.cli.grouping import GroupedCommand
from dse.cli.options import question_of, question_options
from dse.cli.pages import answer, page_path, report_option
from dse.cli.printing import say, tell


@click.command("check", cls=GroupedCommand)
@problem_argument()
@question_options
@all_option
@report_option
@json_option
@quiet_option
@in_time
def command(
    file: str | os.PathLike[str], every: bool, report: str | None, json_path: str | None, quiet: bool, **options: Any
) -> int:
    """Validate a problem file; describe its decisions, its size, and what a careful reader would remark.

    Options that change the question do so as for `dse solve`. Exit code 3 also when `dse solve` would refuse the
    problem: as too large to search exactly, or for a requirement on a flow that the import could not follow.
    """
    check_writable(json_path, page_path(report))
    from dse.questions.verbs.check import check
    from dse.space.question.unchecked import unchecked_words

    question = question_of(options)
    description = check(load_told(file), **question)
    from dse.report.content.check import description_page

    page = description_page(description)
    answer(page, (json_path, description.to_json), report=report, every=every, quiet=quiet)
    is_shown = not quiet and json_path != "-" and not description.exit_code
    if is_shown and isinstance(file, str) and file != "-" and not any(question.values()):
        say(f"Next       dse solve {shlex.quote(file)}")
    if description.too_large:
        tell(f"dse: {description.too_large}")
    if description.space.unchecked:
        tell(f"dse: {unchecked_words(description.space)}")
    return description.exit_code
