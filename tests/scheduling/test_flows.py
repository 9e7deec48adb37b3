"""Response times in flows: rows, what they leave open, and that what is found on the way is refereed."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import build_limit, excess
from dse.analysis.scheduling.responses import all_responses
from dse.analysis.scheduling.tasks import longest_alone_ns
from dse.analysis.views import View
from dse.encode.model import encode
from dse.encode.scheduling import contention, waiting_forms
from dse.encode.scheduling.waiting import WaitRows
from dse.questions.problem import loads
from dse.search.feasibility.guarded_model import Switchboard
from dse.search.front import SearchLimits, search_front
from dse.search.solver.settings import BARE, BARE_IN_ORDER
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Found
from dse.space.model.space import Space
from tests.helpers.effort import cases
from tests.helpers.support import brute_front
from tests.helpers.thread_systems import KINDS, LATER_JOBS, draw, front, text_of


@pytest.fixture(autouse=True)
def _nothing_is_tabulated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)


def asked(seed: int, kind: str, *objectives: str) -> Space:
    text = text_of(draw(seed, kind=kind), *((objectives,) if objectives else ()))
    return loads(text.replace("processing: execution_time", "processing: response_time")).space


def found(space: Space, workers: int = 1) -> set[tuple[int, ...]]:
    search = search_front(Evaluator(space), SearchLimits(workers=workers))
    assert search.is_complete
    return set(search.points)


@pytest.mark.parametrize("kind", ["plain", "fixed"])
@pytest.mark.parametrize("seed", cases(12))
def test_jobs_alone_say_how_long_periodic_threads_wait(kind: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Deadlines are periods, nothing is late: rows of jobs leave nothing open, so that no clause is needed."""

    def none(*_: object) -> None:
        raise AssertionError("a clause is needed")

    monkeypatch.setattr(contention, "reason_of_value", none)
    assert found(asked(seed, kind)) == front(draw(seed, kind=kind), by_response=True)


@pytest.mark.parametrize("kind", ["plain", "chained", "stated", "blocked", "ordered", "best", "grouped", "unequal"])
@pytest.mark.parametrize("seed", cases(12, 1_000))
def test_clauses_alone_are_exact(kind: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(WaitRows, "refine", lambda *_: False)
    assert found(asked(seed, kind)) == front(draw(seed, kind=kind), by_response=True)


@pytest.mark.parametrize("kind", ["plain", "chained", "stated", "ordered", "best", "unequal"])
@pytest.mark.parametrize("seed", cases(12, 2_000))
def test_a_multiple_of_a_latency_is_searched_like_the_latency(kind: str, seed: int) -> None:
    text = text_of(draw(seed, kind=kind), ("minimise price", "minimise way"))
    text = text.replace("processing: execution_time", "processing: response_time\nmetrics: {way: latency of f * 2}")
    expected = {(price, 2 * latency) for price, latency in front(draw(seed, kind=kind), by_response=True)}
    assert found(loads(text).space, workers=2) == expected


@pytest.mark.parametrize("seed", [*cases(12), 7013])
def test_no_row_is_above_what_the_analysis_says(seed: int) -> None:
    """Any design that the analysis accepts is one of the model's, with the waiting times that it has."""
    for kind in ("plain", "chained", "stated", "blocked", "grouped"):
        evaluator = Evaluator(asked(seed, kind))
        search = search_front(evaluator)
        encoded = encode(evaluator)
        assert encoded.contention is not None
        for design in search.points.values():
            view = View(evaluator.evaluate(design).design)
            waiting = encoded.contention.waiting
            if waiting is None:
                continue
            for number in list(waiting.variables):
                waiting.refine(number, view)
            strategy = Strategy(encoded)
            for literals, chosen in zip(encoded.options, view.design, strict=True):
                if chosen >= 0 and len(literals) > 1:
                    encoded.model.add_bool_and([encoded.model.get_bool_var_from_proto_index(literals[chosen].index)])
            known = all_responses(evaluator.space, view)
            for number, index in waiting.variables.items():
                response = known.get((number, "thread"))
                if response is not None:
                    waited = Fraction(response) - longest_alone_ns(evaluator.space, number, "thread", view)
                    encoded.model.add(encoded.model.get_int_var_from_proto_index(index) == int(waited * waiting.scale))
            assert isinstance(strategy.ask(), Found)
            encoded = encode(evaluator)
            assert encoded.contention is not None


def test_a_later_job_of_a_busy_period_may_wait_longer_than_the_first() -> None:
    """With 9 ms the second job does, not the first: taken for a first one it made two of three designs too slow."""
    space = loads(LATER_JOBS).space
    assert found(space) == set(brute_front(Evaluator(space)))


@pytest.mark.parametrize("seed", cases(12))
def test_any_design_comes_with_the_figures_that_it_has(seed: int) -> None:
    """A search that is stopped hands it out: figures that nothing minimises are not what the solver says they are."""
    evaluator = Evaluator(asked(seed, "plain"))
    strategy = Strategy(encode(evaluator))
    answer = strategy.any_design([(BARE_IN_ORDER, 0.1), (BARE, 0.5)])
    if isinstance(answer, Found):
        claimed = [
            item.offset + item.step * value
            for item, value in zip(strategy.encoded.objectives, answer.point, strict=True)
        ]
        assert evaluator.evaluate(answer.design).objectives == tuple(claimed)
    else:
        assert not front(draw(seed, kind="plain"), by_response=True)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(5, 3_000))
def test_how_far_a_limit_is_from_what_can_be_is_exact(kind: str, seed: int) -> None:
    """What explains a conflict asks one model again and again, with limits switched on and off."""
    system = draw(seed, kind=kind)
    text = text_of(system).replace("processing: execution_time", "processing: response_time")
    space = loads(text + "requirements: [latency of f <= 1 ms, response time of t0 <= 500 ms]\n").space
    limits = [build_limit(space, item) for item in space.requirements]
    tight = next(number for number, item in enumerate(limits) if item.requirement.metric.kind == "latency")
    others = frozenset(range(len(limits))) - {tight}
    board, points = Switchboard(space), front(system, by_response=True)
    for kept in (others, frozenset[int](), others):
        design = board.find(kept, excess(space, limits[tight]))
        assert kept == frozenset() or (design is None) == (not points)
        if design is None:
            continue
        latency = limits[tight].measure.value(View(design))
        if kept:
            assert latency == min(point[1] for point in points)
        else:
            assert latency <= min((point[1] for point in points), default=latency)


ROBUST = """
dse: 1
name: robust
processing: response_time
processor_types: {cpu: {price: 10 EUR}}
processors: {p: {type: cpu}}
devices: {s: {period: 7 ms}}
threads:
  urgent: {processor: p, period: [10 ms, 12 ms], compute_execution_time: 2 ms}
  last: {processor: p, period: 20 ms, compute_execution_time: 4 ms}
connections: {w: {from: s, to: last}}
flows: {f: {path: [s, last]}}
requirements: [latency of f >= LIMIT]
objectives: [minimise utilisation of p]
uncertainty: {threads.urgent.compute_execution_time: {range: 1 ms .. 3 ms}}
"""


@pytest.mark.parametrize(("limit", "status"), [("25 ms", "complete"), ("25001 us", "infeasible")])
def test_at_other_inputs_threads_wait_as_long_as_they_do_there(limit: str, status: str) -> None:
    """At worst 20 + 4 + 1 ms: the rows of the nominal threads, which make it 26, are none there."""
    study = dse.solve_robust(dse.loads(ROBUST.replace("LIMIT", limit)))
    assert study.robust.status == status


@pytest.mark.parametrize("kind", ["plain", "chained", "fixed"])
@pytest.mark.parametrize("seed", cases(6, 2_000))
def test_with_clocks_that_nobody_names_nothing_changes(kind: str, seed: int) -> None:
    """Where a file has clocks, what is sampled without offsets counted a period less in the search than it does."""
    text = text_of(draw(seed, kind=kind)).replace("processing: execution_time", "processing: response_time")
    expected = front(draw(seed, kind=kind), by_response=True)
    assert found(loads(f"{text}clocks: {{other: {{}}}}\n").space) == expected
    spread = text.replace("minimise latency of f", "minimise run jitter of f")
    space = loads(f"{spread}clocks: {{other: {{}}}}\n").space
    assert found(space) == set(brute_front(Evaluator(space)))


OFF_PROCESSORS = """
dse: 1
name: off processors
processing: response_time
processor_types: {cpu: {}}
processors: {p: {type: cpu}}
devices:
  s: {period: [7 ms, 9 ms], compute_execution_time: [1 ms, 2 ms .. 3 ms]}
threads:
  a: {processor: p, period: [10 ms, 20 ms], compute_execution_time: 1 ms .. 2 ms}
  b: {processor: p, period: 5 ms, compute_execution_time: 1 ms}
  away: {period: [4 ms, 5 ms], compute_execution_time: [1 ms, 2 ms .. 3 ms]}
connections: {c: {from: s, to: a}, d: {from: a, to: away}}
flows: {f: {path: [s, a, away]}}
objectives: [minimise jitter of f, minimise utilisation, maximise min latency of f]
"""


@pytest.mark.parametrize("clocks", ["", "clocks: {other: {}}\n"])
def test_what_runs_on_no_processor_waits_for_none(clocks: str) -> None:
    space = loads(OFF_PROCESSORS + clocks).space
    assert found(space) == set(brute_front(Evaluator(space)))


@pytest.mark.parametrize("seed", [*cases(15, 2), 994_007])  # the last has a front whose latencies have no bound
def test_further_designs_have_the_response_times_that_count(seed: int) -> None:
    """All designs at a point, and some near it: `verify` looks at every design for what was left out."""
    text = text_of(draw(seed, kind=KINDS[seed % len(KINDS)]))
    problem = loads(text.replace("processing: execution_time", "processing: response_time"))
    result = dse.solve(problem, workers=1)
    for number, within in ((100, None), (2, "20%")):
        verified = dse.verify(dse.with_further_designs(result, number, within), problem=problem)
        assert verified.status == "verified", verified.findings
