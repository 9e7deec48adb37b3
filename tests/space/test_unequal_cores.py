"""Groups of cores of one processor, with execution times of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.analysis.scheduling.tasks import utilisation
from dse.analysis.views import View

TEXT = """
dse: 1
name: big and little
deadlines: all
processor_types: {soc: {cores: {big: 1, little: 2}, price: 9 EUR}, mono: {cores: 1, price: 20 EUR}}
processors: {p: {type: [soc, mono]}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {soc/big: 2 ms, soc/little: 5 ms, mono: 1 ms}}
  b: {processor: p, period: 20 ms, compute_execution_time: {soc: 6 ms, mono: 3 ms}, core: little}
  c: {processor: p, period: 20 ms, compute_execution_time: {soc/little: 20 ms, soc/big: [4 ms, 6 ms], mono: 3 ms}}
objectives: [minimise utilisation of p, minimise price]
"""


def test_a_thread_takes_the_time_of_its_core() -> None:
    space = dse.loads(TEXT).space
    names = [item.name for item in space.decisions]
    assert names == ["p.type", "c.compute_execution_time", "a.core", "b.core", "c.core"]
    assert [item.options for item in space.decisions[2:]] == [("1", "2", "3"), ("2", "3"), ("1", "2", "3")]
    shares = [utilisation(space, 0, View((0, 0, core, 0, 0))) * 10 for core in range(3)]
    assert shares == [2, 5, 5]
    assert utilisation(space, 0, View((1, 0, -1, -1, -1))) * 10 == 1


def test_the_core_is_a_decision_that_utilisation_depends_on_whatever_is_asked(tmp_path: Path) -> None:
    problem = dse.loads(TEXT.replace("deadlines: all\n", ""))
    result = dse.solve(problem)
    assert [tuple(point.objectives.values()) for point in result.front] == [
        (400_000, 2000),
        (700_000, 900),  # a and c, with 4 ms, on the big core: 20 % each, b 30 %
    ]
    assert dse.verify(result, problem=problem).status == "verified"
    again = dse.loads(dse.export(result, result.front[1].id, folder=tmp_path))
    assert dse.analyse(again).is_feasible
    assert dse.simulate(problem, design=["p = soc", "c.compute_execution_time = 4 ms", "a.core = 1", "b.core = 2",
                                         "c.core = 1"]).contradictions == ()  # fmt: skip


def test_the_big_core_is_no_more_than_one_core() -> None:
    text = TEXT.replace("period: 10 ms", "period: 5 ms")
    text = text.replace("c: {processor: p, period: 20 ms", "c: {processor: p, period: 8 ms")
    result = dse.solve(dse.loads(text.replace("type: [soc, mono]", "type: soc")))
    assert [point.decisions["a.core"] for point in result.front] == ["1"]
    (point,) = result.front  # a 40 %, c 50 % of the big core: c ends after 4 + 2 * 2 = 8 ms
    assert point.objectives["utilisation of p"] == pytest.approx(1_200_000)
