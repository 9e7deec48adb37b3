"""A limit of time is kept by the analysis itself, and changes no figure."""

from __future__ import annotations

import time

import pytest
from support import space_of

from dse.analysis.evaluate import Evaluator
from dse.timelimit import OutOfTime, look_at_the_clock, until

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


def test_the_sooner_of_two_limits_holds() -> None:
    look_at_the_clock()
    with until(None):
        look_at_the_clock()
    past, future = time.monotonic() - 1, time.monotonic() + 1000
    for outer, inner in ((past, future), (past, None), (future, past)):
        with until(outer), until(inner), pytest.raises(OutOfTime):
            look_at_the_clock()
    look_at_the_clock()
