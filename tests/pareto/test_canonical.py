"""Which attempts to find the first design of a point are made, and in which order the solver tries."""

from __future__ import annotations

from typing import Any

import pytest
from support import space_of

from dse.analysis.evaluate import Evaluator
from dse.encode import corelimits
from dse.encode.model import encode
from dse.pareto.answer import Answer, Found, Unfinished
from dse.pareto.canonical import InOrder
from dse.pareto.settings import BARE_IN_ORDER, CUTTING_IN_ORDER, RELAXED_IN_ORDER, Settings
from dse.pareto.subproblem import Solver

CROWD = """
dse: 1
name: three on two cores
processor_types: {duo: {cores: 2, price: 10 EUR}}
processors: {p: {type: duo}}
threads:
  small: {processor: p, period: 10 ms, compute_execution_time: 2 ms}
  large: {processor: p, period: 10 ms, compute_execution_time: 5.5 ms}
  middle: {processor: p, period: [10 ms, 20 ms], compute_execution_time: 5 ms}
flows: {f: {path: [middle]}}
requirements: ['utilisation of p <= 60 %']
objectives: [minimise latency of f]
"""


class Answering(Solver):
    """A solver that finds a design with some settings only."""

    def __init__(self, able: set[Settings]) -> None:
        super().__init__(encode(Evaluator(space_of(CROWD))))
        self.able, self.asked = able, list[Settings]()

    def run(self, settings: Settings, *_: Any) -> Answer:
        self.asked.append(settings)
        return Found((0,), ()) if settings in self.able else Unfinished()

    def asked_by(self, order: InOrder, points: int) -> list[Settings]:
        """The settings asked for so many points."""
        self.asked = []
        for _ in range(points):
            order.first(self, to_the_end=False)
        return self.asked


def test_relaxations_that_miss_once_are_not_asked_again_and_bare_settings_after_two_misses() -> None:
    order, solver = InOrder(), Answering(set())
    assert solver.asked_by(order, 4) == [BARE_IN_ORDER, RELAXED_IN_ORDER, CUTTING_IN_ORDER, BARE_IN_ORDER]
    assert solver.calls == 2, "a point for which nothing is tried is no question"
    assert solver.asked_by(order.elsewhere(), 4) == [BARE_IN_ORDER, BARE_IN_ORDER]


@pytest.mark.parametrize("able", [BARE_IN_ORDER, RELAXED_IN_ORDER, CUTTING_IN_ORDER])
def test_the_settings_that_find_a_design_come_first_at_the_next_point(able: Settings) -> None:
    order, solver = InOrder(), Answering({able})
    assert solver.asked_by(order, 1)[-1] is able
    assert solver.asked_by(order, 3) == [able] * 3
    assert solver.asked_by(order.elsewhere(), 1)[0] is BARE_IN_ORDER


def test_cores_are_packed_largest_first_where_the_model_has_rows_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(corelimits, "MOST_CLAUSES", 0)
    encoded = encode(Evaluator(space_of(CROWD)))
    assert len(encoded.in_order()) == 1, "there is nothing to pack"
    limits = encoded.core_limits
    assert limits is not None
    assert not limits.settled((0, 0), lambda _: True), "the small one is too much beside either of the others"
    use = [most for most, _ in limits.places]
    assert (use[0], use[1]) == (min(use), max(use)), "as they stand in the file"
    places = dict(limits.places)
    _, then = encoded.in_order()
    largest_first = [index for most in sorted(use, reverse=True) for index in places[most]]
    assert [expression.vars[0] for expression in then.exprs] == largest_first
