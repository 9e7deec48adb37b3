"""The plots of any answer as files of their own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from dse.errors import UsageError
from dse.files.guard import guarding
from dse.files.writing import write_files
from dse.fitting.fit import Fit
from dse.report.answers import Told, page_of
from dse.report.document import Document
from dse.report.plot_files import figure_files, page_figures
from dse.report.study_files import study_figures
from dse.report.writing import check_alternative, problem_files
from dse.results.measured import MeasuredComparison
from dse.results.robust import RobustResult
from dse.results.sensitivity import SensitivityResult
from dse.results.solve import Result
from dse.results.sweep import SweepResult

FORMATS = ("png", "svg")


def write_figures(
    answer: Told, to: str | Path = "figures", formats: Sequence[str] = ("svg",), alternative: int | None = None
) -> list[Path]:
    """Write the plots of an answer as pictures, for a paper or slides; the paths. Needs the extra `plots`.

    Parameters
    ----------
    answer
        what `dse.solve` or any other verb returned.
    to
        the folder, which is made if need be.
    formats
        ``svg``, ``png``, or both.
    alternative
        of a front, the id of the point whose latencies, loads and architecture are drawn; None: the first in rank.

    Raises
    ------
    UsageError
        when the extra is not installed, there is no such format or alternative, or there is nothing to draw.
    OSError
        when a file cannot be written.

    Examples
    --------
    >>> import dse
    >>> [path.name for path in dse.write_figures(dse.solve("pump.yaml"), "figures")][:2]
    ['pump-scatter.svg', 'pump-parallel.svg']
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise UsageError(f"{unknown[0]}: expected png, svg or both")
    front = answer.robust if isinstance(answer, RobustResult) else answer
    with guarding(*(problem_files(front) if isinstance(front, Result) else [])):
        files = list(_figures(front, tuple(formats), alternative))
        if not files:
            raise UsageError("there is nothing to draw in this answer")
        target = Path(to)
        target.mkdir(parents=True, exist_ok=True)
        return write_files(target, files)


def _figures(answer: Told, formats: tuple[str, ...], alternative: int | None) -> Iterator[tuple[str, str | bytes]]:
    if isinstance(answer, Result):
        check_alternative(answer, alternative, "the result")
        return figure_files(Document(answer), formats, alternative)
    if alternative is not None:
        raise UsageError("only a front has alternatives")
    if isinstance(answer, SweepResult | SensitivityResult):
        return study_figures(answer.to_dict(), formats)
    page = page_of(answer)
    is_measured = isinstance(answer, Fit | MeasuredComparison)
    return page_figures(page, formats, Path(answer.files[0]).stem if is_measured else page.title)  # type: ignore[union-attr]
