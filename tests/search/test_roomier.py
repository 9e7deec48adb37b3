"""An optimum that fills its cores to the brim has others with its figures that do not."""

from __future__ import annotations

from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.search.solver.repair import roomier
from dse.search.solver.strategy import Strategy
from tests.helpers.support import space_of

PROBLEM = """
dse: 1
name: brim
deadlines: all
processor_types: {one: {cores: 2, price: 10 EUR}, two: {cores: 4, price: 20 EUR}}
processors: {p: {type: [one, two]}}
threads:
  t0: {processor: p, period: 10 ms, compute_execution_time: 3 ms}
%s
flows: {f: {path: [t0]}}
objectives: [minimise price, minimise latency of f]
"""


def brim(periods: str) -> Evaluator:
    """Three threads beside the one of the flow, 3 ms each, whose periods matter to nothing that is asked."""
    lines = [f"  t{number}: {{processor: p, period: {periods}, compute_execution_time: 3 ms}}" for number in (1, 2, 3)]
    return Evaluator(space_of(PROBLEM % "\n".join(lines)))


def test_rates_fall_until_cores_are_found() -> None:
    """At 5 ms each of the three needs a core of its own, of two; at 10 ms three share one."""
    evaluator = brim("[5 ms, 10 ms]")
    encoded = encode(evaluator)
    strategy = Strategy(encoded)
    full = tuple(0 for _ in evaluator.space.decisions)
    assert encoded.settled(full, lambda _: 0, is_best=False) is None
    point = tuple(0 for _ in encoded.objectives)
    found = roomier(strategy, full, point)
    assert found is not None
    evaluation = evaluator.evaluate(found)
    assert evaluation.is_feasible
    assert evaluation.objectives[0] == evaluator.evaluate(full).objectives[0], "the cheaper processor"
    assert encoded.contention is not None
    assert not encoded.contention.known, "and no rows are learnt"


def test_there_may_be_none() -> None:
    evaluator = brim("5 ms")
    encoded = encode(evaluator)
    full = tuple(0 for _ in evaluator.space.decisions)
    assert roomier(Strategy(encoded), full, tuple(0 for _ in encoded.objectives)) is None


def test_first_designs_are_not_exchanged() -> None:
    """Where the first design with some figures is looked for, another one with them will not do."""
    evaluator = brim("[5 ms, 10 ms]")
    encoded = encode(evaluator)
    assert encoded.contention is not None
    encoded.contention.seek_first(patient=True)
    full = tuple(0 for _ in evaluator.space.decisions)
    assert roomier(Strategy(encoded), full, tuple(0 for _ in encoded.objectives)) is None
