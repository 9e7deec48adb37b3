"""Which attempts to find the first design of a point are made, and in which order the solver tries."""

from __future__ import annotations

import random
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.search.canonical import InOrder
from dse.search.solver.settings import BARE, BARE_IN_ORDER, CUTTING_IN_ORDER, FINDING, RELAXED_IN_ORDER, SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished
from tests.helpers.effort import cases
from tests.helpers.support import space_of
from tests.helpers.tuned import tune

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

ENDLESS = 1e9
STARTER = Path(__file__).parents[2] / "problems" / "starter.yaml"


class Answering(Strategy):
    """A solver that finds a design with some settings only, each with so much work."""

    def __init__(self, able: dict[SolverSettings, float]) -> None:
        super().__init__(encode(Evaluator(space_of(CROWD))))
        self.able, self.asked = able, list[SolverSettings]()

    def run(self, settings: SolverSettings, work: float, *_: Any) -> Answer:
        self.asked.append(settings)
        self.work += min(work, self.able.get(settings, work))
        return Found((0,), ()) if self.able.get(settings, ENDLESS) <= work else Unfinished()

    def asked_by(self, order: InOrder, points: int) -> list[SolverSettings]:
        """The settings asked for so many points."""
        self.asked = []
        for _ in range(points):
            order.first(self, to_the_end=False)
        return self.asked


def test_relaxations_that_miss_once_are_not_asked_again_and_bare_settings_after_two_misses() -> None:
    order, strategy = InOrder(), Answering({})
    assert strategy.asked_by(order, 4) == [BARE_IN_ORDER, RELAXED_IN_ORDER, CUTTING_IN_ORDER, BARE_IN_ORDER]
    assert strategy.calls == 2, "a point for which nothing is tried is no question"
    assert strategy.asked_by(order.elsewhere(), 4) == [BARE_IN_ORDER, BARE_IN_ORDER]


@pytest.mark.parametrize("able", [BARE_IN_ORDER, RELAXED_IN_ORDER, CUTTING_IN_ORDER])
def test_in_the_end_the_settings_that_find_a_design_are_asked_alone(able: SolverSettings) -> None:
    order, strategy = InOrder(), Answering({able: 0.008})
    assert strategy.asked_by(order, 2)[-1] is able
    assert strategy.asked_by(order, 3) == [able] * 3
    assert strategy.asked_by(order.elsewhere(), 4)[-1] is able


def test_the_settings_with_which_a_design_costs_least_come_first() -> None:
    """Those that just miss one point are dear beside those that find it, and cheap again after some more points."""
    order, strategy = InOrder(), Answering({BARE_IN_ORDER: 0.008, RELAXED_IN_ORDER: 0.021})
    assert strategy.asked_by(order, 6) == [BARE_IN_ORDER] * 6
    strategy.able[BARE_IN_ORDER] = 0.011
    assert strategy.asked_by(order, 1) == [BARE_IN_ORDER, RELAXED_IN_ORDER]
    strategy.able[BARE_IN_ORDER] = 0.008
    assert strategy.asked_by(order, 3) == [BARE_IN_ORDER] * 3, "one miss does not make relaxation cheaper"
    strategy.able = {BARE_IN_ORDER: 0.01, RELAXED_IN_ORDER: 0.001}
    order.missed[BARE_IN_ORDER] = 0
    order.found.clear()
    order.spent.clear()
    assert strategy.asked_by(order, 3) == [BARE_IN_ORDER] * 3
    strategy.able[BARE_IN_ORDER] = 0.02
    assert strategy.asked_by(order, 2) == [BARE_IN_ORDER, RELAXED_IN_ORDER] * 2
    assert strategy.asked_by(order, 2) == [RELAXED_IN_ORDER] * 2


def test_cores_are_packed_largest_first_where_the_model_has_rows_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    tune(monkeypatch, core_limit_clauses={"is_on": False})
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


def waiting(seed: int) -> str:
    """A flow whose threads wait for others on the cores of one or two processors."""
    rng = random.Random(seed)
    lines = [
        "dse: 1\nname: waiting\nprocessing: response_time",
        f"processor_types: {{A: {{cores: {rng.choice((2, 3))}}}}}\nprocessors: {{p: {{type: A}}}}\nthreads:",
    ]
    count = rng.choice((4, 5))
    for number in range(count):
        periods = rng.sample((8, 10, 12, 20, 40), rng.choice((1, 1, 2)))
        stated = ", ".join(f"{period} ms" for period in sorted(periods))
        work = rng.randint(1, min(periods) // 2)
        lines.append(f"  t{number}: {{processor: p, period: [{stated}], compute_execution_time: {work} ms}}")
    path = rng.sample(range(count), 3)
    wires = ", ".join(f"w{to}: {{from: t{begin}, to: t{to}}}" for begin, to in pairwise(path))
    lines.append(f"connections: {{{wires}}}\nflows: {{f: {{path: [{', '.join(f't{each}' for each in path)}]}}}}")
    lines.append("objectives: [minimise latency of f, minimise utilisation of p]")
    return "\n".join(lines)


@pytest.mark.parametrize("settings", [RELAXED_IN_ORDER, CUTTING_IN_ORDER])
@pytest.mark.parametrize("seed", [11, *cases(20, 100)])
def test_first_designs_by_relaxation_where_threads_wait(
    seed: int, settings: SolverSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows that a solution teaches change nothing of the order: threads are not moved to whatever cores will do."""
    tune(monkeypatch, first_designs={"ways": ((settings, 5.0, 99),)})
    problem = dse.loads(waiting(seed))
    found = dse.solve(problem, workers=1)
    assert dse.verify(found, problem=problem, method="exhaustion").status == "verified"


def test_a_design_that_presolve_finds_counts_and_that_there_is_none_does_not() -> None:
    """Presolve may lose solutions (`sound_solver`), and makes none; settings after it do without again."""
    evaluator = Evaluator(dse.load(STARTER).space)
    strategy = Strategy(encode(evaluator))
    points = [point.objectives for point in dse.solve(STARTER).front]
    offsets = [(objective.offset, objective.step) for objective in strategy.encoded.objectives]
    for values in points:
        pairs = zip(values.values(), offsets, strict=True)
        strategy.set_point(tuple((value - offset) // step for value, (offset, step) in pairs))
        answer = strategy.run(FINDING, 1.0)
        assert isinstance(answer, Found)
        assert evaluator.evaluate(answer.design).objectives == tuple(values.values())
    strategy.set_point((0,) * len(offsets))
    assert isinstance(strategy.run(FINDING, 1.0), Unfinished)
    assert isinstance(strategy.run(BARE, 1.0), NoSuchDesign)
    parameters = strategy.limited(FINDING, 1.0).parameters
    assert parameters.cp_model_presolve and parameters.repair_hint
    BARE.apply(parameters, 1.0)
    assert not parameters.cp_model_presolve and not parameters.repair_hint
