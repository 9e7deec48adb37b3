"""The page of any answer: what its command prints and `--report` writes."""

from __future__ import annotations

from typing import TypeAlias

from dse.answers.analysis import Analysis
from dse.answers.comparison import DesignComparison, ResultComparison
from dse.answers.explanation import Explanation
from dse.answers.measured import MeasuredComparison
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.answers.simulation import Simulation
from dse.answers.studies.sensitivity import SensitivityResult
from dse.answers.studies.sweep import SweepResult
from dse.answers.verification import Verification
from dse.fitting.fitted import Fit
from dse.questions.verbs.check import Description
from dse.questions.verbs.sizes import Sizes
from dse.report.content.analyse import analysis_page
from dse.report.content.check import description_page
from dse.report.content.compare import comparison_page
from dse.report.content.explain import explanation_page
from dse.report.content.fit import fit_page
from dse.report.content.front.document import Document
from dse.report.content.front.pages import written_page
from dse.report.content.measured import measured_page
from dse.report.content.sensitivity import robust_section
from dse.report.content.simulate import simulation_page
from dse.report.content.sizes import sizes_page
from dse.report.content.study import study_page
from dse.report.content.verify import verification_page
from dse.report.html import html_page, html_report
from dse.report.markdown import markdown_page
from dse.report.page import Page, Section

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
    """The complete page of an answer.

    A `Page` for the answer of any verb, chosen by its type.
    """
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
    """The page of an answer as HTML or as Markdown; that of a front is one to choose on in HTML.

    One file as text. The HTML page of a front has filters, plots and details; Markdown has tables only.
    """
    if is_html and isinstance(answer, Result | RobustResult):
        document, studies = _front_of(answer)
        return html_report(document, None, studies)
    return html_page(page_of(answer)) if is_html else markdown_page(page_of(answer))


def _front_of(answer: Result | RobustResult) -> tuple[Document, list[Section]]:
    if isinstance(answer, Result):
        return Document(answer), []
    return Document(answer.robust), [robust_section(answer.to_dict())]
