"""``dse solve --robust``: the robust front, printed and written like any other, with what it costs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from dse.cli.common import console, write_text

if TYPE_CHECKING:
    from dse.api.problem import Changes
    from dse.pareto.front import Budget, Progress
    from dse.results.robust import RobustResult


def solve_robustly(file: str, changes: Changes, budget: Budget, progress: Callable[[Progress], None]) -> RobustResult:
    """Both fronts of a problem file."""
    from dse.api.problem import load
    from dse.api.solving import Watcher
    from dse.study.robust import solve_robust

    return solve_robust(load(file), changes, budget, Watcher(progress))


def show_robust(
    study: RobustResult, rank_by: str, top: int | None, json_path: str | None, csv_path: str | None, *, quiet: bool
) -> int:
    """Print and write what was found; the exit code."""
    from dse.results.order import ranked_by

    study = replace(study, robust=ranked_by(study.robust, rank_by))
    if not quiet and "-" not in (json_path, csv_path):
        from dse.report.studies import print_robust
        from dse.report.terminal import print_result

        print_result(console(), study.robust, top)
        print_robust(console(), study)
    if json_path is not None:
        write_text(json_path, study.to_json())
    if csv_path is not None:
        write_text(csv_path, study.robust.to_csv())
    return study.exit_code
