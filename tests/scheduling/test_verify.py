"""Fronts with deadlines proved a second time: by looking at every design, and by a model that learns from lateness."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import pytest
from ortools.sat.python import cp_model

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.views import View
from dse.questions.problem import load
from dse.support.errors import TooLargeError
from dse.verification import model, rounds, tables
from dse.verification.model import SecondModel
from dse.verification.scheduling import waiting
from dse.verification.solver_calls import Reply
from tests.helpers.documents import ROOT
from tests.helpers.effort import LONG, cases
from tests.helpers.thread_systems import KINDS, LATER_JOBS, draw, text_of


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(6))
def test_true_fronts_are_proved_again_and_false_ones_refused(
    kind: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)  # no response time is tabulated
    file = tmp_path / "drawn.yaml"
    file.write_text(text_of(draw(seed, kind=kind)), encoding="utf-8")
    check_both_ways(file)


@pytest.mark.parametrize(
    ("kind", "by_type"),
    [*((kind, False) for kind in KINDS), *((kind, True) for kind in (KINDS if LONG else KINDS[::2]))],
)
@pytest.mark.parametrize("seed", cases(5, 1_000))
def test_the_same_with_response_times_in_the_flow(
    kind: str, seed: int, by_type: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also with every region asked for each processor type by itself, as hard ones are."""
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    if by_type:
        monkeypatch.setattr(model, "MOST_AS_A_WHOLE", 0)
        monkeypatch.setattr(model.SecondModel, "_in_parts", by_type_alone(model.SecondModel._in_parts))
    file = tmp_path / "drawn.yaml"
    text = text_of(draw(seed, kind=kind)).replace("processing: execution_time", "processing: response_time")
    file.write_text(text, encoding="utf-8")
    check_both_ways(file, ["model"] if by_type else ["model", "exhaustion"])


def by_type_alone(in_parts: Callable[..., Reply]) -> Callable[..., Reply]:
    """What is asked by type is asked of the models of the types, each of which knows its own only."""

    def asked(self: SecondModel, *question: Any) -> Reply:
        types = {slot.type_decision for slot in self.tables.space.processors}
        assert [part.given for part in self._by_type] == self._by_type.combinations
        assert all(part.given.keys() == types for part in self._by_type)
        return in_parts(self, *question)

    return asked


@pytest.mark.parametrize("kind", ["stated", "ordered", "mixed"])
@pytest.mark.parametrize("seed", cases(4, 1_500))
def test_the_same_with_the_deadlines_that_are_stated(
    kind: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    file = tmp_path / "drawn.yaml"
    file.write_text(text_of(draw(seed, kind=kind) | {"deadlines": "stated"}), encoding="utf-8")
    check_both_ways(file)


@pytest.mark.parametrize("kind", KINDS if LONG else ["chained", "grouped", "late"])
@pytest.mark.parametrize("seed", cases(4, 3_000))
def test_the_same_with_latencies_that_are_rounded_up(
    kind: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A message takes a 21st of a ms. Also with a limit that the latency of one design just meets, not rounded up."""
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    text = text_of(draw(seed, kind=kind)).replace(
        "deadlines: all\nprocessing: execution_time", "processing: response_time"
    )
    sent = "data_size: 1 B, bus: line}"
    order = ", priority: any" if kind == "best" else ""
    echo = f"echo: {{processor: c, compute_execution_time: 1 ms, dispatch_protocol: aperiodic{order}}}"
    text = re.sub(r"(w\d*: {from: \w+, to: \w+)}", rf"\1, {sent}", text)
    text = text.replace("threads:\n", f"threads:\n  {echo}\n")
    text = text.replace("connections:\n", f"connections:\n  e: {{from: sensor, to: echo, {sent}\n")
    text += (
        "\nbus_types: {odd: {transmission_time: {per_byte: 1000/21 us .. 2000/21 us}}}\nbuses: {line: {type: odd}}\n"
    )
    file = tmp_path / "drawn.yaml"
    file.write_text(text, encoding="utf-8")
    problem = load(file)
    try:
        found = dse.solve(problem, workers=1)
    except TooLargeError:  # so many threads each of which may wait without end are beyond exact arithmetic
        return
    assert "latency of f" in found.rounded
    check_both_ways(file)
    if found.front:
        view = View(found.front[seed % len(found.front)].design)
        exact = Evaluator(problem.space).objectives[1].value(view)
        if exact < UNBOUNDED_NS:
            file.write_text(f"{text}requirements: ['latency of f <= {exact} ns']\n", encoding="utf-8")
            check_both_ways(file)


def test_middlewares_are_proved_again_with_waiting() -> None:
    """Seven threads on four cores, whose chains wait for others: too many cases for a table."""
    problem = load(ROOT / "problems/report/middleware.yaml")
    found = dse.solve(problem, processing="response_time")
    assert found.rounded and len(found.front) == 3
    assert dse.verify(found, problem=problem).status == "verified"


@pytest.mark.parametrize("seed", cases(6, 2_000))
def test_waiting_that_only_lessons_raise_is_proved_as_well(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    monkeypatch.setattr(waiting.WaitVariables, "count", lambda *_: False)
    file = tmp_path / "drawn.yaml"
    text = text_of(draw(seed, kind="chained")).replace(
        "deadlines: all\nprocessing: execution_time", "processing: response_time"
    )
    file.write_text(text, encoding="utf-8")
    check_both_ways(file, ["model"])


def test_the_second_model_knows_that_a_later_job_may_wait_longer_than_the_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three designs: two were lost once the third had taught the model that the first job ends no earlier."""
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    model = SecondModel(tables.build_tables(Evaluator(dse.loads(LATER_JOBS).space)))
    for price, latency_ms in ((10, 62), (20, 61), (30, 60)):
        asked = price * 100 + 1, latency_ms * 1_000_000 + 1
        assert model.in_region(asked).answer == "design"


def test_a_solution_whose_threads_wait_less_than_it_says_is_a_design(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that is asked for any solution may let threads wait for long, where nothing bounds that."""
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    model = SecondModel(tables.build_tables(Evaluator(dse.loads(LATER_JOBS).space)))
    as_before = rounds.ask

    def slow(asked: cp_model.CpModel, *others: Any, **more: Any) -> Any:
        longest = [asked.get_int_var_from_proto_index(item.index) for item in model.objectives]
        asked.maximize(sum(longest))
        return as_before(asked, *others, **more)

    monkeypatch.setattr(rounds, "ask", slow)
    for price in (10, 20, 30):
        assert model.in_region([price * 100 + 1, None]).answer == "design"
    assert model.in_region([1, None]).answer == "none"


def check_both_ways(file: Path, methods: Sequence[Literal["model", "exhaustion"]] = ("model", "exhaustion")) -> None:
    result = dse.solve(load(file), workers=1)
    data = json.loads(json.dumps(result.to_dict()))
    is_falsified = bool(data["front"]) and None not in data["front"][-1]["objectives"].values()
    if is_falsified:
        last = data["front"].pop()
        data["refuted"] = [{name: value + 1 for name, value in last["objectives"].items()}] + data["refuted"]
    for method in methods:
        proved = dse.verify(result, method=method)
        assert (proved.status, proved.findings, proved.left_open) == ("verified", (), ()), method
        assert not is_falsified or dse.verify(data, method=method).status == "rejected", method


ONE_OBJECTIVE = """
dse: 1
name: one objective
processing: response_time
priorities: any
processor_types: {trio: {cores: 3, price: 30 EUR}}
processors: {p: {type: trio}}
threads:
  t0: {processor: p, period: 20 ms, compute_execution_time: 12 ms}
  t1: {processor: p, period: 5 ms, compute_execution_time: 3 ms, core: 1}
  t2: {processor: p, period: [5 ms, 20 ms], compute_execution_time: 4 ms}
flows: {f: {path: [t0]}}
objectives: [minimise latency of f]
"""


@pytest.mark.parametrize("method", ["model", "exhaustion"])
def test_a_region_that_ends_at_the_only_point_is_not_widened(method: Literal["model", "exhaustion"]) -> None:
    """Before, it was taken for an outermost one, and then held the point itself."""
    problem = dse.loads(ONE_OBJECTIVE)
    found = dse.solve(problem)
    assert [point.objectives for point in found.front] == [{"latency of f": 12_000_000}]
    assert dse.verify(found, problem=problem, method=method).status == "verified"
    told = json.loads(found.to_json())
    told["refuted"] = [{"latency of f": 12_000_001}]
    assert dse.verify(told, problem=problem, method=method).status == "rejected"
    told["refuted"] = []
    assert dse.verify(told, problem=problem, method=method).status == "rejected"


FIRST_FIT = """
dse: 1
name: first fit
processor_types: {duo: {cores: 2, price: 20 EUR}}
processors: {p: {type: duo}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 4 ms, core: first_fit}
  b: {processor: p, period: 10 ms, compute_execution_time: 5 ms, core: first_fit}
requirements: [utilisation of p <= 80 %]
objectives: [minimise price]
"""


@pytest.mark.parametrize("method", ["model", "exhaustion"])
def test_what_first_fit_puts_together_is_not_spread(method: Literal["model", "exhaustion"]) -> None:
    """It fills the first core to 90 %; before, looking at every design was content with there being another way."""
    problem = dse.loads(FIRST_FIT)
    found = dse.solve(problem)
    assert found.status == "infeasible"
    assert dse.verify(found, problem=problem, method=method).status == "verified"


def test_a_requirement_that_is_stated_twice_on_a_line_is_given_up_twice() -> None:
    """One for all threads beside the same of one thread: two demands, although they are equal."""
    found = dse.solve("""
dse: 1
name: twice
processor_types: {cpu: {cores: 1}}
processors: {p: {type: cpu}}
threads:
  t: {period: 20 ms, compute_execution_time: 2 ms, processor: p}
  u: {period: 20 ms, compute_execution_time: 2 ms, processor: p}
objectives: [minimise price]
requirements: [response time of t <= 1 ms, response time <= 1 ms]
""")
    assert len(found.give_up) == 2
    assert not dse.verify(found, method="exhaustion").findings
