"""``dse solve --robust``: the robust front, printed and written like any other, with what it costs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dse.cli.common import save
from dse.cli.pages import in_what_is_left, print_front
from dse.cli.printing import tell
from dse.support.errors import EXIT_INCOMPLETE, UsageError
from dse.support.files.writing import write_files
from dse.support.timelimit import TimeLimit

if TYPE_CHECKING:
    from dse.answers.robust import RobustResult
    from dse.questions.problem import Problem
    from dse.search.front import Progress, SearchLimits


def solve_robustly(
    problem: Problem,
    resume: tuple[str, str | None] | None,
    budget: SearchLimits,
    tell: tuple[Callable[[Progress], None], Callable[[Any], None] | None],
    so_far: str | None,
) -> RobustResult:
    """Both fronts of the question of a problem, or of a stopped search: a result and its problem file, where given.

    `tell` is called with the progress, and with the state so far, which it writes to `so_far`; a refusal leaves none.

    Raises
    ------
    UsageError
        when nothing can be proved of a requirement over the stated ranges.
    """
    from dse.questions.robust.robust import RobustWatcher, robust_asked

    progress, write = tell
    written: list[bool] = []

    def keep(result: RobustResult) -> None:
        assert write is not None
        write(result)
        written.append(True)

    watcher = RobustWatcher(progress, keep if write is not None else None)
    if resume is None:
        try:
            return robust_asked(problem, budget, watcher)
        except UsageError:
            if written and so_far is not None:
                Path(so_far).unlink(missing_ok=True)
            raise
    from dse.questions.resume import resume_robust

    return resume_robust(*resume, budget, watcher)


def show_robust(
    study: RobustResult,
    rank_by: str,
    top: int | None,
    paths: tuple[str | None, str | None, Path | None, str | None],
    limit: TimeLimit,
    *,
    explain: bool | None,
) -> int:
    """Print and write what was found (`paths`: of JSON, of CSV, the folder of a report, its page); the exit code.

    Nothing is printed where `explain` is None.
    """
    json_path, csv_path, folder, page = paths
    from dse.answers.ranking.order import ranked_by
    from dse.report.content.front.document import Document
    from dse.report.content.sensitivity import robust_section

    study = replace(study, robust=ranked_by(study.robust, rank_by))
    document, sections = Document(study.robust), [robust_section(study.to_dict())]
    if explain is not None and "-" not in (json_path, csv_path):
        shown = sections if explain else [robust_section(study.to_dict(), is_brief=True)]
        print_front(document, top, limit, explain=explain, further=shown)
    failure = save((json_path, study.to_json), (csv_path, study.robust.to_csv))

    def write() -> OSError | None:
        from dse.report.output import front_text

        failed = save((page, lambda: front_text(document, page, sections))) if page else None
        if folder is not None:
            _write_report(study, folder, top, quiet=explain is None)
        return failed

    return study.exit_code if in_what_is_left(limit, write, failure) else EXIT_INCOMPLETE


def _write_report(study: RobustResult, folder: Path, top: int | None, *, quiet: bool) -> None:
    """The report of the robust front, with a section of what it costs."""
    from dse.report.content.front.document import Document
    from dse.report.content.study import sections_of
    from dse.report.output import report_files

    files = dict(report_files(Document(study.robust), None, top, sections_of(study.to_dict())))
    files = {name: study.to_json() if name.endswith(".json") else text for name, text in files.items()}
    for path in write_files(folder, files.items()):
        if not quiet:
            tell(f"report: {path}")
