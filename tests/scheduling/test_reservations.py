"""Reservations: what a budget of each period is to its threads, and to others (random ones are in the other files)."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.analysis.scheduling.busy_window import Stream, Task, periodic, response_time_ns
from dse.analysis.scheduling.policies.reservations import server, supply_gaps
from dse.analysis.scheduling.responses import processor_responses
from dse.analysis.views import View
from dse.questions.problem import load, loads
from dse.report.words.contention import bound_words
from dse.support.errors import ProblemError
from tests.helpers.support import space_of
from tests.helpers.thread_executors import supplied

MS = 10**6
FILE = """
dse: 1
name: reserved
deadlines: all
processor_types: {{cpu: {{cores: {cores}{cpu}}}}}
processors: {{p: {{type: cpu}}}}
reservations:
  nav: {{processor: p, budget: {budget}, period: 5 ms{nav}}}
executors:
  node: {{kind: fifo, reservation: nav}}
threads:
  a: {{reservation: nav, period: 40 ms, compute_execution_time: 2 ms}}
  b: {{executor: node, period: 80 ms, compute_execution_time: 3 ms}}
  c: {{executor: node, period: 80 ms, compute_execution_time: 1 ms}}
  other: {{processor: p, period: 10 ms, compute_execution_time: 2 ms{other}}}
objectives: [minimise power]
"""


def text(budget: str = "3 ms", nav: str = "", other: str = "", cores: int = 1, cpu: str = "") -> str:
    return FILE.format(budget=budget, nav=nav, other=other, cores=cores, cpu=cpu)


def responses_ms(**fields: str) -> dict[str, float | None]:
    space = space_of(text(**fields))  # type: ignore[arg-type]
    found = processor_responses(space, 0, View([0] * len(space.decisions)))
    return {item.name: None if item.response_ns is None else float(item.response_ns) / MS for item in found}


def test_the_example_of_the_document_and_published_figures() -> None:
    """docs/semantics.md, section 4.8; the source's 7 is that of Casini and others' analysis (ECRTS 2019)."""
    gaps = supply_gaps("nav", 3, 5)
    assert response_time_ns(Task("source", 2, (Stream(5, 2),)), [gaps]) == 7
    assert response_time_ns(Task("first", 2, ()), [gaps]) == 6
    assert response_time_ns(periodic("behind", 2, 10), [server("nav", 3, 5)]) == 8


@pytest.mark.parametrize(("budget", "period"), [(3, 5), (1, 5), (4, 5), (5, 5), (2, 7), (1, 1)])
def test_the_gaps_are_those_of_the_supply_bound_function(budget: int, period: int) -> None:
    """A job of any length ends when the supply of Shin and Lee's (6) has reached it."""
    for work in range(1, 40):
        end = next(time for time in range(1, 400) if supplied((budget, period), time) >= work)
        assert response_time_ns(Task("job", work, ()), [supply_gaps("r", budget, period)]) == end


def test_threads_and_an_executor_in_a_reservation_by_hand() -> None:
    """Of 3 every 5: 2 are there after 4 + 2; a, b and c together, 6, after 4 + 3 + 2 + 3 (a goes before the node).

    `other` waits for two budgets, up to 2 ms late: 2 + 2 * 3. Of 2 every 5: a 6 + 2, the node 6 + 2 + 3 + 2 + 3 + 2.
    """
    assert responses_ms() == {"a": 6, "b": 12, "c": 12, "other": 8}
    assert responses_ms(budget="2 ms") == {"a": 8, "b": 18, "c": 18, "other": 6}
    assert responses_ms(budget="5 ms", other=", priority: 1")["b"] is None, "the core has no room for all of it"
    assert responses_ms(budget="5 ms", other=", core: 2", cores=2)["b"] == 6  # type: ignore[arg-type]


def test_a_budget_that_is_not_always_there_bounds_nothing() -> None:
    """2 ms before 3 ms end within 5 ms; with a section of 1 ms of another thread, or switches, they do not."""
    assert responses_ms(other=", priority: 1") == {"other": 2, "a": 6, "b": 12, "c": 12}
    late = {"other": 2, "a": None, "b": None, "c": None}
    assert responses_ms(budget="3001 us", other=", priority: 1") == late
    assert responses_ms(other=", priority: 1", cpu=", context_switch: 1 us")["a"] is None
    assert responses_ms(budget="4 ms", other=", non_preemptive: 1001 us, deadline: 40 ms")["a"] is None
    assert responses_ms(budget="4 ms", other=", non_preemptive: 1 ms, deadline: 40 ms")["a"] == 4


def test_priorities_of_reservations_and_in_them() -> None:
    """Outside the number of the reservation counts, inside that of its threads alone."""
    assert responses_ms(other=", priority: 5", nav=", priority: 6")["other"] == 8
    assert responses_ms(other=", priority: 5", nav=", priority: 4")["other"] == 2
    inside = text().replace("reservation: nav, period: 40 ms", "reservation: nav, priority: 1, period: 100 ms")
    found = processor_responses(space_of(inside), 0, View([0] * 9))
    assert {item.name: item.response_ns for item in found if item.name == "a"} == {"a": 6 * MS}


def test_budgets_and_cores_are_decisions() -> None:
    """With `other` at 5 ms and less the budget is too large, or on another core."""
    problem = loads(text(budget="[2 ms, 3 ms]", other=", deadline: 7 ms"))
    [point] = dse.solve(problem).front
    assert point.decisions == {"nav.budget": "2 ms"}
    wide = loads(text(budget="3 ms", other=", deadline: 7 ms", cores=2))
    [point] = dse.solve(wide).front
    assert point.decisions["nav.core"] != point.decisions["other.core"]
    assert dse.solve(loads(text(budget="3 ms", other=", deadline: 7 ms"))).status == "infeasible"
    [fixed] = dse.solve(loads(text(budget="[2 ms, 3 ms]")), fix=["nav.budget = 3 ms"]).front
    assert fixed.decisions["nav.budget"] == "3 ms"


def test_reports_simulation_and_conflicts_know_reservations(tmp_path: Path) -> None:
    file = tmp_path / "reserved.yaml"
    file.write_text(text(), encoding="utf-8")
    problem = load(file)
    assert "reservations supply a, b, c" in bound_words(problem.space)
    assert dse.verify(dse.solve(problem), method="model").status == "verified"
    assert not dse.simulate(problem, runs=4).contradictions
    late = dse.explain(loads(text(other=", deadline: 7 ms")))
    assert "other" in str(late.to_dict())


def test_a_thread_of_several_types_may_be_in_a_reservation() -> None:
    """None of the types has a section; one that has is told."""
    types = "thread_types: {slow: {compute_execution_time: 1 ms}, quick: {compute_execution_time: 500 us}}\n"
    typed = text().replace(
        "threads:\n", types + "threads:\n  d: {type: [slow, quick], reservation: nav, period: 40 ms}\n"
    )
    assert "d.type" in {item.name for item in loads(typed).space.decisions}
    with pytest.raises(ProblemError, match="in a reservation nothing is non-preemptive"):
        loads(typed.replace("quick: {", "quick: {non_preemptive: 10 us, "))
