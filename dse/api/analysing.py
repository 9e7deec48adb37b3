"""`dse.analyse`: one design, row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from dse.analysis.contention import ContentionReferee, with_contention
from dse.analysis.evaluate import Evaluator
from dse.api.problem import Changes, Problem, changed, complete_design, load, read_choices
from dse.results.analysis import Analysis
from dse.results.contention import judge
from dse.results.tables import analyse_design


def analyse(
    problem: Problem | str | Path,
    design: Mapping[str, str] | Sequence[str] | None = None,
    *,
    profile: str | None = None,
    worst_case: str | None = None,
    processing: str | None = None,
    deadlines: str | None = None,
    response_times: bool = False,
    changes: Changes | None = None,
) -> Analysis:
    """Every figure of one design; what it keeps with contention too, where the question leaves that out.

    Parameters
    ----------
    problem
        a loaded problem, or the path of a problem file.
    design
        decisions by name (or texts ``name = option``), on top of the baseline; the baseline alone when left out.
    profile, worst_case, processing, deadlines
        replace those of the file: ``dse``, ``osate-2.2``, ``osate-2.19``; ``execution_time``, ``deadline``;
        ``execution_time``, ``response_time``; ``stated``, ``all``, ``none``.
    response_times
        whether to add the response time of every thread on a processor.
    changes
        further changes to the question, as for `dse.solve`.

    Raises
    ------
    ProblemError
        when the file is wrong.
    UsageError
        when a decision or option does not exist, or decisions are left open.
    """
    loaded = problem if isinstance(problem, Problem) else load(problem)
    settings = {"profile": profile, "worst_case": worst_case, "processing": processing, "deadlines": deadlines}
    asked = changed(loaded, (changes or Changes()).with_settings(**settings))
    space = asked.space
    texts = [f"'{name}' = {option}" for name, option in design.items()] if isinstance(design, Mapping) else design or ()
    choices = {**space.baseline, **space.fixed, **read_choices(space, texts)}
    chosen = complete_design(space, choices)
    analysis = analyse_design(Evaluator(space), chosen, response_times=response_times)
    counted = with_contention(space)
    if counted is None or analysis.breaches:
        return analysis
    return replace(analysis, contended=judge(ContentionReferee(counted), analysis.design))
