"""The nearest design beyond a limit: against all designs, and on the page."""

from __future__ import annotations

import random
from pathlib import Path

import dse
from dse.analysis.evaluate import Evaluator
from dse.examples.shipped import example_path
from dse.questions.beyond_limit import SAVED, beyond
from dse.report.content.front.document import Document
from dse.report.content.front.pages import written_page
from dse.report.html import html_report
from dse.report.markdown import markdown_page
from dse.support.errors import ProblemError, TooLargeError
from dse.support.timelimit import NEVER, TimeLimit
from dse.support.units import is_unbounded
from tests.helpers.effort import FACTOR, cases
from tests.helpers.support import raw_designs
from tests.oracle.generator import random_problem

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"


def limited(seed: int) -> tuple[dse.Result, dse.Problem, str, int] | None:
    """The front of a random problem under a limit on the jitter of a flow, the problem without it, and the limit."""
    rng = random.Random(seed)
    try:
        problem = dse.loads(random_problem(seed, "tiny"))
        flow = problem.space.flows[0].name
        other = rng.choice(["minimise price", "minimise power"])
        problem = problem.ask(objectives=[f"minimise jitter of '{flow}'", other])
        whole = dse.solve(problem)
    except (ProblemError, TooLargeError, dse.UsageError):
        return None
    name = f"jitter of {flow}"
    values = sorted({point.objectives[name] for point in whole.front})
    if len(values) < 2 or is_unbounded(values[-1]):
        return None
    limit = values[rng.randrange(len(values) - 1)]
    return dse.solve(problem, require=f"jitter of '{flow}' <= {limit} ns"), problem, name, limit


def test_no_design_that_saves_as_much_exceeds_the_limit_less() -> None:
    """Of random problems all designs are looked at, by the analysis alone."""
    outcomes = []
    for seed in cases(600):
        drawn = limited(seed)
        if drawn is None:
            continue
        result, problem, name, limit = drawn
        answer = beyond(result, NEVER)
        [saved] = [info.name for info in result.objectives if info.name != name]
        least = min(point.objectives[saved] for point in result.front)
        evaluator = Evaluator(problem.space)
        reached = []
        for design in raw_designs(problem.space):
            evaluation = evaluator.evaluate(design)
            if evaluation.breaches:
                continue
            jitter, other = evaluation.objectives
            bounds = [item.requirement for item in evaluation.verdicts if not item.holds]
            is_met = all(item.metric.name == name and item.is_upper for item in bounds)
            if least > 0 and is_met and other <= least * (1 - SAVED):
                reached.append(jitter)
        if answer is None:
            assert not reached or is_unbounded(min(reached)), seed
        else:
            assert (answer.limited, answer.saved, answer.limit) == (name, saved, limit)
            assert answer.value == answer.objectives[name] == min(reached) >= limit, seed
        outcomes.append(answer is not None)
    assert FACTOR < 1 or any(outcomes)


def test_a_limit_on_every_flow_is_exceeded_by_the_worst() -> None:
    """Both flows of the robot are limited; the design says which computer a little more jitter allows."""
    result = dse.solve(example_path("inmark"), max_jitter="18ms", processing="execution_time")
    answer = beyond(result, NEVER)
    assert answer is not None and answer.limited == "jitter" and answer.decisions["computer.type"] == "RT101"
    looser = dse.solve(example_path("inmark"), max_jitter=f"{answer.value} ns", processing="execution_time")
    assert min(point.objectives["price"] for point in looser.front) == answer.objectives["price"]
    tighter = dse.solve(example_path("inmark"), max_jitter=f"{answer.value - 1} ns", processing="execution_time")
    best = min(point.objectives["price"] for point in result.front)
    assert min(point.objectives["price"] for point in tighter.front) > best * (1 - SAVED)


def test_it_is_told_on_the_page_and_in_the_reasons() -> None:
    document = Document(dse.solve(PUMP, max_jitter="10ms"))
    said = "price 165 EUR lower than in any design of the front"
    above = "jitter of sensor_to_valve 3.444 ms above the limit of 10 ms"
    page, text = html_report(document), markdown_page(written_page(document))
    card = page.partition('id="beyond"')[2].partition("</div>")[0]
    assert said in card and above in card and "small" in card
    assert f"Beyond the limit: {said}" in text.replace("\\", "") and "13.444 ms" in card
    free = Document(dse.solve(PUMP))
    assert free.beyond is None and 'id="beyond"' not in html_report(free)


def test_without_time_nothing_is_told() -> None:
    result = dse.solve(PUMP, max_jitter="10ms")
    assert beyond(result, TimeLimit.after(0.0)) is None
