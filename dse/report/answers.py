"""The page of any answer: what its command prints and `--report` writes."""

from __future__ import annotations

from typing import TypeAlias

from dse.api.check import Description
from dse.api.sizes import Sizes
from dse.fitting.fit import Fit
from dse.report.analyse import analysis_page
from dse.report.check import description_page
from dse.report.compare import comparison_page
from dse.report.document import Document
from dse.report.explain import explanation_page
from dse.report.fit import fit_page
from dse.report.html import html_page, html_report
from dse.report.markdown import markdown_page
from dse.report.measured import measured_page
from dse.report.page import Page, Section
from dse.report.robust import robust_section
from dse.report.simulate import simulation_page
from dse.report.sizes import sizes_page
from dse.report.solve import written_page
from dse.report.study import study_page
from dse.report.verify import verification_page
from dse.results.analyse import Analysis
from dse.results.compare import DesignComparison, ResultComparison
from dse.results.explain import Explanation
from dse.results.measured import MeasuredComparison
from dse.results.robust import RobustResult
from dse.results.sensitivity import SensitivityResult
from dse.results.simulate import Simulation
from dse.results.solve import Result
from dse.results.sweep import SweepResult
from dse.results.verify import Verification

Comparison: TypeAlias = DesignComparison | ResultComparison
Told: TypeAlias = (
    Result
    | RobustResult
    | Analysis
    | Description
    | Comparison
    | Explanation
    | Fit
    | MeasuredComparison
    | SensitivityResult
    | Simulation
    | Sizes
    | SweepResult
    | Verification
)


def page_of(answer: Told) -> Page:
    """What is said of an answer, whole."""
    if isinstance(answer, Result | RobustResult):
        document, studies = _front_of(answer)
        return written_page(document, None, studies)
    if isinstance(answer, SweepResult | SensitivityResult):
        return study_page(answer.to_dict())
    if isinstance(answer, Analysis):
        return analysis_page(answer)
    if isinstance(answer, Description):
        return description_page(answer)
    if isinstance(answer, Explanation):
        return explanation_page(answer)
    if isinstance(answer, Simulation):
        return simulation_page(answer)
    if isinstance(answer, Fit):
        return fit_page(answer)
    if isinstance(answer, Sizes):
        return sizes_page(answer)
    if isinstance(answer, MeasuredComparison):
        return measured_page(answer)
    if isinstance(answer, Verification):
        return verification_page(answer)
    return comparison_page(answer)


def text_of(answer: Told, *, is_html: bool) -> str:
    """The page of an answer as HTML or as Markdown; that of a front is one to choose on in HTML."""
    if is_html and isinstance(answer, Result | RobustResult):
        document, studies = _front_of(answer)
        return html_report(document, None, studies)
    return html_page(page_of(answer)) if is_html else markdown_page(page_of(answer))


def _front_of(answer: Result | RobustResult) -> tuple[Document, list[Section]]:
    if isinstance(answer, Result):
        return Document(answer), []
    return Document(answer.robust), [robust_section(answer.to_dict())]
