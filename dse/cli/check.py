"""``dse check``."""

from __future__ import annotations

import json
from typing import Any

import click

from dse.cli.common import (
    check_writable,
    console,
    in_time,
    json_option,
    load_told,
    problem_argument,
    question_of,
    question_options,
    write_text,
)


@click.command("check")
@problem_argument()
@question_options
@json_option
@in_time
def command(file: str, json_path: str | None, **options: Any) -> int:
    """Validate a problem file; describe its decisions, its size, and what a careful reader would remark.

    With the options of `dse solve` the question is the one that they ask.
    """
    check_writable(json_path)
    from dse.api.check import check

    description = check(load_told(file), **question_of(options))
    if json_path != "-":
        from dse.report.check import print_description

        print_description(console(), description)
    if json_path is not None:
        write_text(json_path, json.dumps(description.to_dict(), ensure_ascii=False, indent=1) + "\n")
    return 0
