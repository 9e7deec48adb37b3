"""What a search comes across, and where its next solver begins, where response times are longer than models know."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.encode.scheduling import waiting_forms
from dse.search.front import _in_time
from dse.search.solver.settings import CUTTING, CUTTING_IN_ORDER, SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Unfinished
from dse.support.timelimit import OutOfTime
from tests.helpers.effort import cases
from tests.helpers.support import space_of
from tests.helpers.thread_systems import draw, text_of


@pytest.mark.parametrize(("settings", "begins"), [(CUTTING_IN_ORDER, False), (CUTTING, True)])
def test_the_next_solver_begins_where_the_last_one_ended_unless_an_order_counts(
    settings: SolverSettings, begins: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hint is tried before the order of the file: the design that it leads to was taken for the first one."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    hinted, learnt = False, 0
    for seed in cases(12):
        text = text_of(draw(seed, kind="reserved"))
        text = text.replace("processing: execution_time", "processing: response_time")
        encoded = encode(Evaluator(space_of(text)))
        strategy, latency = Strategy(encoded), len(encoded.objectives) - 1
        strategy.weights = [int(number == latency) for number in range(len(encoded.objectives))]
        encoded.model.minimize(encoded.objectives[latency].variable)
        known = len(encoded.model.proto.constraints)
        strategy.run(settings, 10.0)
        hinted |= bool(encoded.model.proto.solution_hint.vars)
        learnt += len(encoded.model.proto.constraints) > known
    assert learnt and hinted == begins


ENGINE = """
dse: 1
name: periods from 0.7 ms to a second, three cores 88 % full
deadlines: all
processing: response_time
processor_types: {tc3: {cores: 3, price: 15 EUR, context_switch: 2 us}}
processors: {ecu: {type: tc3}}
threads:
WORK
connections: {a: {from: t18, to: t15}, b: {from: t15, to: t12}}
flows: {chain: {path: [t18, t15, t12]}}
objectives: [minimise latency of chain]
"""
TIMES = (
    (9500, 20), (9500, 30), (9500, 30), (1500, 40), (900, 30), (1100, 40), (4900, 50), (1700, 60), (6000, 80),
    (700, 20), (5000, 70), (1000, 450), (2000, 500), (5000, 900), (6660, 3200), (10000, 6200), (20000, 6500),
    (50000, 1500), (100000, 7700), (200000, 150), (1000000, 140),
)  # fmt: skip
"""Period and execution time in us, of the order of an engine control's (the WATERS 2017 industrial challenge)."""


def test_a_search_that_is_stopped_has_the_design_that_it_came_across() -> None:
    """The first solution of the model is late; on other cores nobody is, whatever the objective is there."""
    work = [
        f"  t{number}: {{processor: ecu, period: {period} us, compute_execution_time: {time} us}}"
        for number, (period, time) in enumerate(TIMES)
    ]
    evaluator = Evaluator(space_of(ENGINE.replace("WORK", "\n".join(work))))
    strategy = Strategy(encode(evaluator))
    everything = [tuple(1 << 40 for _ in evaluator.objectives)]
    calls: list[int] = []

    def stopped() -> bool:
        calls.append(1)
        return len(calls) > 3

    strategy.out_of_time = stopped  # type: ignore[method-assign]
    strategy.minimise([1], everything)
    assert strategy.incumbent is not None
    assert evaluator.evaluate(strategy.incumbent.design).is_feasible

    def over() -> Answer:
        raise OutOfTime("")

    answer = _in_time(SimpleNamespace(evaluator=evaluator), strategy, over)  # type: ignore[arg-type]
    assert isinstance(answer, Unfinished)
    assert answer.best is strategy.incumbent
