"""Deadlines and open cores in the search against looking at every design, with a response-time iteration of its own."""

from __future__ import annotations

from itertools import product
from math import inf
from typing import Any

import pytest

from dse.analysis.evaluate import Evaluator
from dse.encode.scheduling import contention, waiting_forms
from dse.questions.problem import Problem, changed, loads
from dse.questions.question import QuestionChanges
from dse.search.front import SearchLimits, search_front
from dse.search.solver import bounding, strategy
from dse.search.solver.settings import BARE, CLOSING_RANGE, NARROWING, SolverSettings
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished
from tests.helpers.effort import LONG, cases, count
from tests.helpers.support import brute_front
from tests.helpers.thread_systems import KINDS, draw, front, text_of
from tests.helpers.tuned import tune

SEEDS = count(20)


def found(text: str, workers: int = 1) -> set[tuple[int, ...]]:
    search = search_front(Evaluator(loads(text).space), SearchLimits(workers=workers))
    assert search.is_complete
    return set(search.points)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(10))
def test_the_front_is_that_of_looking_at_every_design(kind: str, seed: int) -> None:
    system = draw(seed, kind=kind)
    assert found(text_of(system)) == front(system)


@pytest.mark.parametrize("kind", ["plain", "chained", "stated", "ordered", "best", "unequal"])
@pytest.mark.parametrize("seed", cases(10, 3 * SEEDS))
def test_designs_are_the_first_of_all_with_their_figures(kind: str, seed: int) -> None:
    evaluator = Evaluator(loads(text_of(draw(seed, kind=kind))).space)
    search = search_front(evaluator, SearchLimits(workers=2))
    expected = brute_front(evaluator)
    assert search.points.keys() == expected.keys()
    first = search.points.keys() - search.not_first
    end = evaluator.space.first_order  # of orders whichever will do
    assert {vector: search.points[vector][:end] for vector in first} == {
        vector: expected[vector][:end] for vector in first
    }
    assert kind in ("chained", "ordered", "best", "unequal") or len(first) == len(expected)


@pytest.mark.parametrize(
    "kind", ["plain", "chained", "stated", "blocked", "ordered", "best", "grouped", "joined", "unequal"]
)
@pytest.mark.parametrize("seed", cases(10, SEEDS))
def test_rows_and_clauses_alone_are_exact(kind: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """No other cores are tried: whatever the solver proposes stands or teaches."""
    monkeypatch.setattr(contention, "placements", lambda *_: ())
    system = draw(seed, kind=kind)
    assert found(text_of(system), workers=2) == front(system)


@pytest.mark.parametrize(
    "kind", ["plain", "chained", "stated", "blocked", "ordered", "best", "grouped", "joined", "reserved", "unequal"]
)
@pytest.mark.parametrize("seed", cases(10, 2 * SEEDS))
def test_clauses_alone_are_exact(kind: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contention, "placements", lambda *_: ())
    monkeypatch.setattr(contention, "add_rows", lambda *_: [])
    system = draw(seed, kind=kind)
    assert found(text_of(system)) == front(system)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if LONG or kind != "mixed"])  # which takes as long as the rest
@pytest.mark.parametrize("seed", cases(10, 7 * SEEDS))
def test_response_times_in_flows_are_exact(kind: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """No response time is tabulated: bounds first, and what solutions teach."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    system = draw(seed, kind=kind)
    text = text_of(system).replace("processing: execution_time", "processing: response_time")
    assert found(text) == front(system, by_response=True)


@pytest.mark.parametrize("kind", ["stated", "ordered", "mixed", "chained"])
@pytest.mark.parametrize("seed", cases(5, 6 * SEEDS))
def test_deadlines_that_are_stated_are_met(kind: str, seed: int) -> None:
    """Others may be missed: with response times in the flow, and without."""
    system = draw(seed, kind=kind) | {"deadlines": "stated"}
    text = text_of(system)
    assert found(text) == front(system)
    assert found(text.replace("processing: execution_time", "processing: response_time")) == front(
        system, by_response=True
    )


@pytest.mark.parametrize(("least_quick", "asked"), [(inf, CLOSING_RANGE), (0.0, BARE)])
def test_bounds_from_below_and_limits_from_above_meet(
    least_quick: float, asked: SolverSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Calls that prove bounds end at their first solution, so that limits on what is minimised do the rest.

    With bare settings first, and without.
    """
    tune(monkeypatch, bounding={"least_quick": least_quick})
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    monkeypatch.setattr(strategy, "WAYS_WITH_WAITING", (NARROWING, BARE))
    monkeypatch.setattr(bounding, "_counts_one", lambda _: True)
    apply = SolverSettings.apply
    limits = []
    run = strategy.Strategy.run

    def hasty(self: SolverSettings, parameters: Any, work: float) -> None:
        apply(self, parameters, work)
        parameters.stop_after_first_solution = self.from_below

    def watched(self: strategy.Strategy, settings: SolverSettings, work: float, *further: Any) -> Answer:
        answer = run(self, settings, work, *further)
        if self.encoded.is_loose and isinstance(answer, Unfinished) and answer.best is not None:
            assert self.encoded.weigh(answer.best.design) == answer.best.point, "what is known has its own figures"
        if settings is asked and further:
            limits.append(Found if isinstance(answer, Unfinished) and answer.best is not None else type(answer))
        return answer

    monkeypatch.setattr(SolverSettings, "apply", hasty)
    monkeypatch.setattr(strategy.Strategy, "run", watched)
    for kind, seed in product(KINDS, cases(5, 4 * SEEDS)):
        system = draw(seed, kind=kind)
        text = text_of(system).replace("processing: execution_time", "processing: response_time")
        assert found(text) == front(system, by_response=True), (kind, seed)
    assert {Found, NoSuchDesign} <= set(limits)


SAME_CHOICE = """
dse: 1
name: one choice gives the rate of two threads
overload: allowed
deadlines: all
processor_types: {slow: {cores: 1, price: 10 EUR}, fast: {cores: 1, price: 30 EUR}}
processors: {c: {type: [slow, fast]}}
devices: {sensor: {period: 3 ms}}
threads:
  t0: {processor: c, compute_execution_time: {slow: 4 ms, fast: 2 ms}, period: [5 ms, 12 ms]}
  t1: {processor: c, compute_execution_time: {slow: 3 ms, fast: 1 ms}, period: [6 ms, 10 ms]}
  t2: {processor: c, compute_execution_time: {slow: 4 ms, fast: 4 ms}, dispatch_protocol: aperiodic}
  t3: {processor: c, compute_execution_time: {slow: 2 ms, fast: 1 ms}, period: [4 ms, 8 ms]}
connections: {w: {from: sensor, to: t0}, w1: {from: t0, to: t1}, w2: {from: t1, to: t2}, w3: {from: t2, to: t3}}
flows: {f: {path: [sensor, t0, t1, t2, t3]}}
objectives: [minimise price, minimise latency of f]
"""


def test_that_one_thread_must_be_in_time_says_nothing_of_another_with_the_same_rate() -> None:
    """Where t1 has a deadline and t2, which it dispatches, has none."""
    assert found(SAME_CHOICE) == set(brute_front(Evaluator(loads(SAME_CHOICE).space)))


ONE_CORE = """
dse: 1
name: one core
deadlines: all
processor_types: {{cpu: {{cores: {cores}, price: 1 EUR}}}}
processors: {{p: {{type: cpu}}}}
devices: {{s: {{period: 7 ms}}}}
threads:
{threads}
objectives: [minimise price]
"""


def points(threads: str, cores: int = 1, **fields: str) -> int:
    lines = "\n".join(f"  {line.strip()}" for line in threads.strip().splitlines())
    text = ONE_CORE.format(cores=cores, threads=lines)
    for name, value in fields.items():
        text += f"{name}: {value}\n"
    return len(found(text))


LEHOCZKY = """
a: {{processor: p, period: 100 ms, compute_execution_time: 52 ms, priority: {a}, deadline: {da} ms}}
b: {{processor: p, period: 140 ms, compute_execution_time: 52 ms, priority: {b}, deadline: {db} ms}}
"""


@pytest.mark.parametrize(
    ("orders", "deadlines", "expected"),
    [((2, 1), (52, 156), 1), ((2, 1), (52, 155), 0), ((1, 2), (108, 52), 1), ((1, 2), (107, 52), 0)],
)
def test_lehoczkys_example_just_fits(orders: tuple[int, int], deadlines: tuple[int, int], expected: int) -> None:
    """Responses 52 and 156, later than the period; in the other order 108 and 52 (RTSS 1990)."""
    text = LEHOCZKY.format(a=orders[0], b=orders[1], da=deadlines[0], db=deadlines[1])
    assert points(text) == expected


def test_three_harmonic_threads_use_the_whole_core() -> None:
    threads = """
    a: {processor: p, period: 4 ms, compute_execution_time: 1 ms}
    b: {processor: p, period: 8 ms, compute_execution_time: 2 ms}
    c: {processor: p, period: 16 ms, compute_execution_time: LAST}
    """
    assert points(threads.replace("LAST", "8 ms")) == 1
    assert points(threads.replace("LAST", "8001 us")) == 0


def test_the_jitter_of_what_goes_first_counts() -> None:
    """A (2 ms every 10 ms, up to 8 ms late) delays B (5 ms every 12 ms) twice: 9 ms, where rows by rate say 7 ms."""
    threads = """
    source: {processor: p, core: 2, period: 10 ms, compute_execution_time: 0 ms .. 8 ms}
    A: {processor: p, core: 1, compute_execution_time: 2 ms}
    B: {processor: p, core: 1, period: 12 ms, compute_execution_time: 5 ms, deadline: LATEST}
    """
    for latest, expected in (("8 ms", 0), ("9 ms", 1)):
        found_points = points(threads.replace("LATEST", latest), cores=2, connections="{w: {from: source, to: A}}")
        assert found_points == expected


PAIR = """
a: {processor: p, period: 10 ms, compute_execution_time: 6 ms}
b: {processor: p, period: 10 ms, compute_execution_time: 6 ms, core: CORE}
"""


def test_the_core_is_chosen_from_those_that_may_be() -> None:
    assert points(PAIR.replace("CORE", "any"), cores=2) == 1
    assert points(PAIR.replace("CORE", "any"), cores=1) == 0
    assert points(PAIR.replace("CORE", "[1, 2]"), cores=2) == 1
    assert points(PAIR.replace("a: {", "a: {core: 1, ").replace("CORE", "1"), cores=2) == 0


def test_first_fit_loses_what_open_cores_have() -> None:
    """First-fit by decreasing utilisation puts the short thread beside one that it makes late."""
    threads = """
    a: {processor: p, period: 10 ms, deadline: 6 ms, compute_execution_time: 6 ms, core: RULE}
    b: {processor: p, period: 10 ms, compute_execution_time: 5 ms, core: RULE}
    c: {processor: p, period: 8 ms, compute_execution_time: 1 ms, core: RULE}
    """
    assert points(threads.replace("RULE", "first_fit"), cores=2) == 0
    assert points(threads.replace("RULE", "any"), cores=2) == 1


def test_cores_are_not_alike_beside_first_fit() -> None:
    """First-fit puts b on core 1 even where a is there, which is late then; a on core 2 is in time."""
    threads = """
    a: {processor: p, period: 20 ms, deadline: 2 ms, compute_execution_time: 2 ms, core: any}
    b: {processor: p, period: 5 ms, compute_execution_time: 3 ms, core: first_fit}
    """
    assert points(threads, cores=2) == 1
    assert points(threads.replace("core: any", "core: 1"), cores=2) == 0


TWO = ONE_CORE.format(cores=2, threads="  a: {processor: p, period: [10 ms, 20 ms], compute_execution_time: 6 ms}\n"
    "  b: {processor: p, period: 10 ms, compute_execution_time: 6 ms}")  # fmt: skip


def open_names(problem: Problem) -> list[str]:
    return [item.name for item in problem.space.decisions if item.is_open]


def test_cores_are_decisions_only_where_something_asked_depends_on_them() -> None:
    idle = loads(TWO.replace("deadlines: all", "deadlines: stated"))
    assert open_names(idle) == ["a.period"]
    asked = changed(idle, QuestionChanges(require=["response time of a <= 7 ms"]))
    assert open_names(asked) == ["a.period", "a.core", "b.core"]
    fixed = changed(idle, QuestionChanges(fix=["b.core = 2"]))
    assert list(fixed.space.fixed.values()) == [1]
    ruled = changed(idle, QuestionChanges(require=["a.core != b.core"]))
    assert len(open_names(ruled)) == 3


def test_rules_and_fixed_decisions_bind_cores() -> None:
    problem = loads(TWO)
    for changes, expected in (
        (QuestionChanges(fix=["a.core = 2"]), {"a.core": "2", "b.core": "1"}),
        (QuestionChanges(require=["b.core == 1"]), {"a.core": "2", "b.core": "1"}),
        (QuestionChanges(), {"a.core": "1", "b.core": "2"}),
    ):
        space = changed(problem, changes).space
        [design] = search_front(Evaluator(space), SearchLimits()).points.values()
        chosen = {item.name: item.options[design[number]] for number, item in enumerate(space.decisions)}
        assert expected.items() <= chosen.items()
    assert not search_front(
        Evaluator(changed(problem, QuestionChanges(require=["a.core == b.core", "a.period == 10 ms"])).space),
        SearchLimits(),
    ).points


def test_a_thread_without_work_waits_for_nobody() -> None:
    """Its jobs end at their release, as the analysis says: neither its deadline nor a flow refuses what is before it.

    Where it may have work, 1 ms behind 3 ms, the option without is the only one in time.
    """
    text = """
    dse: 1
    name: idle
    processor_types: {one: {price: 10 EUR}}
    processors: {p: {type: one}}
    processing: response_time
    threads:
      a: {processor: p, period: 5 ms, compute_execution_time: [3 ms, 4 ms]}
      b: {processor: p, period: [7 ms, 6 ms], compute_execution_time: 0 ns}
      c: {processor: p, period: 8 ms, compute_execution_time: [1 ms, 0 ns]}
    connections: {x: {from: b, to: c}}
    flows: {f: {path: [b, c]}}
    requirements: [response time of b <= 1 ms, response time of c <= 2 ms]
    objectives: [minimise latency of f]
    """
    assert found(text) == {(8_000_000,)}
    assert found(text.replace("minimise latency of f", "minimise price")) == {(1000,)}


ALONE_LONGER = """
dse: 1
name: a thread alone waits longer than its chain
processing: response_time
deadlines: none
processor_types: {s: {cores: 1, price: 5 EUR}}
processors: {p: {type: s}, q: {type: s}}
threads:
  a: {processor: p, period: [20 ms, 30 ms], priority: 7, compute_execution_time: 9100 us}
  b: {processor: [p, q], dispatch_protocol: aperiodic, priority: 7, compute_execution_time: 1500 us .. 3600 us}
  c: {processor: p, period: 12 ms, compute_execution_time: 1200 us .. 1300 us}
  d: {processor: p, dispatch_protocol: aperiodic, priority: 6, compute_execution_time: 1700 us .. 2500 us}
connections: {ab: {from: a, to: b}, cd: {from: c, to: d}}
flows: {f: {path: [a, b]}, g: {path: [c, d]}}
objectives: [minimise latency of f, minimise price, minimise data age of g]
"""


def test_a_flow_counts_more_than_its_chain_where_a_thread_alone_may_take_longer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """C responds within 17.9 ms, and d has ended by then: the flow adds 2.5 ms, in which no second job of a counts."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    evaluator = Evaluator(loads(ALONE_LONGER).space)
    found, expected = search_front(evaluator, SearchLimits()), brute_front(evaluator)
    assert found.points == expected and not found.not_first
