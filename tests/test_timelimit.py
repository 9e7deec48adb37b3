"""A limit of time is kept by the analysis itself, and changes no figure."""

from __future__ import annotations

import time

import pytest

from dse.analysis.evaluate import Evaluator
from dse.search.front import SearchLimits, search_front
from dse.support.timelimit import OutOfTime, TimeLimit, look_at_the_clock, until
from tests.helpers.support import space_of

PRIMES = (10007, 10009, 10037, 10039, 10061, 10067, 10069, 10079, 10091, 10093, 10099, 10103)
THREADS = "".join(
    f"  t{number}: {{processor: p, period: {prime} us, compute_execution_time: {prime * 1000 // 12} ns}}\n"
    for number, prime in enumerate(PRIMES)
)
COPRIME = f"""
dse: 1
name: coprime
processing: response_time
processor_types: {{cpu: {{}}}}
processors: {{p: {{type: cpu}}}}
threads:
{THREADS}
connections: {{}}
requirements: [{", ".join(f"response time of t{number} <= 1 s" for number in range(len(PRIMES)))}]
"""


def test_an_analysis_ends_when_its_time_is_up() -> None:
    """Periods without a common divisor fill the core almost: the busy period of the last thread is very long."""
    evaluator = Evaluator(space_of(COPRIME))
    started = time.monotonic()
    with pytest.raises(OutOfTime), until(started + 0.05):
        evaluator.evaluate((0,) * len(evaluator.space.decisions))
    assert time.monotonic() - started < 5


def test_many_figures_look_at_the_clock_and_few_are_always_found() -> None:
    limits = ", ".join(f"price <= {euros} EUR" for euros in range(1, 121))
    text = COPRIME[: COPRIME.index("requirements")].replace("response_time", "execution_time")
    few, space = space_of(text), space_of(f"{text}requirements: [{limits}]")
    with until(time.monotonic() - 1):
        assert Evaluator(few).evaluate(()).is_feasible
        with pytest.raises(OutOfTime):
            Evaluator(space)
    evaluator = Evaluator(space)
    with until(time.monotonic() - 1), pytest.raises(OutOfTime):
        evaluator.evaluate(())
    assert evaluator.evaluate(()).is_feasible


def test_what_was_long_to_read_has_time_to_be_told() -> None:
    limit = TimeLimit(100.0, time.monotonic() + 60.0)  # 40 are spent
    assert round(limit.left_s - limit.sparing_for_the_answer().left_s) == 20
    # never more than a quarter
    late = TimeLimit(100.0, time.monotonic() + 5.0)
    assert round((late.deadline or 0) - (late.sparing_for_the_answer().deadline or 0)) == 25
    assert TimeLimit().sparing_for_the_answer() == TimeLimit()


def test_todays_design_is_an_answer_however_late_it_is() -> None:
    """A short limit can be over, and seconds ago, before anything is asked: libraries take that long to load."""
    listed = "requirements: [response time of t0 <= 1 s]\nobjectives: [minimise price]\n"
    space = space_of(COPRIME[: COPRIME.index("  t4:")] + "connections: {}\n" + listed)
    late = TimeLimit(0.001, time.monotonic() - 5)
    search = search_front(Evaluator(space), SearchLimits(late), start=())
    assert list(search.points.values()) == [()]
    assert not search.is_complete and search.not_first
    assert (late.for_what_is_needed().deadline or 0) > time.monotonic()
    future = TimeLimit.after(1000)
    assert future.for_what_is_needed() == future.for_the_last_steps()
    assert TimeLimit().for_what_is_needed() == TimeLimit()


def test_the_sooner_of_two_limits_holds() -> None:
    look_at_the_clock()
    with until(None):
        look_at_the_clock()
    past, future = time.monotonic() - 1, time.monotonic() + 1000
    for outer, inner in ((past, future), (past, None), (future, past)):
        with until(outer), until(inner), pytest.raises(OutOfTime):
            look_at_the_clock()
    look_at_the_clock()
