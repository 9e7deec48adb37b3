"""`dse.analyse`: one design, row by row."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Unpack

from dse.analysis.diagnosis.front_verdicts import ContentionReferee, with_contention
from dse.analysis.evaluate import Evaluator
from dse.answers.analysis import Analysis, analyse_design
from dse.answers.contention_verdicts import judge
from dse.questions.complete_design import complete_design
from dse.questions.problem import Source, load, read_choices, with_stated_cores
from dse.questions.question import Decided, Question, decisions_as_texts
from dse.space.model.space import Space
from dse.support import arguments


@arguments.checked(also=Question.__annotations__, response_times=arguments.flag)
def analyse(
    problem: Source,
    design: Decided = None,
    *,
    response_times: bool = False,
    **question: Unpack[Question],
) -> Analysis:
    """Every figure of one design; what it keeps with contention too, where the question leaves that out.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    design
        decisions by name (or texts ``name = option``) or a point of a front, on top of the baseline; the baseline alone
        when left out.
    response_times
        whether to add the response time of every thread on a processor.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        when the file is wrong.
    UsageError
        when a decision or option does not exist, or decisions are left open.

    Examples
    --------
    >>> import dse
    >>> found = dse.analyse("pump.yaml", {"computer.type": "large", "can0.type": "can_250k",
    ...     "filter.dispatch_protocol": "aperiodic", "control.period": "5 ms"})
    >>> found.is_feasible, found.flows[0].max_ns, found.metrics["price"]
    (True, 9012000, Fraction(24000, 1))
    """
    texts = decisions_as_texts(design)
    space = with_stated_cores(load(problem).ask(**question), texts).space
    choices = {**space.fixed, **read_choices(space, texts)}
    chosen = complete_design(space, {**space.baseline, **choices})
    analysis = analyse_design(Evaluator(space), chosen, response_times=response_times)
    analysis = replace(analysis, warnings=(*analysis.warnings, *_unused(space, choices, analysis.decisions)))
    counted = with_contention(space)
    if counted is None or analysis.breaches:
        return analysis
    return replace(analysis, contended=judge(ContentionReferee(counted, of_fronts=False), analysis.design))


def _unused(space: Space, choices: Mapping[int, int], decisions: Mapping[str, str]) -> Iterator[str]:
    """Which decisions were given although the design has no use for them."""
    for index, option in choices.items():
        decision = space.decisions[index]
        if decision.is_open and decision.name not in decisions:
            yield f"{decision.name} = {decision.options[option]} was given, but changes nothing: it is not used here"
