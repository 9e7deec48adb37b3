"""The front against looking at every design; limits on either side of feasible; faults injected into the solver."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import build_measure
from dse.analysis.views import View
from dse.encode.linear import EXACT_LIMIT
from dse.encode.model import encode
from dse.search import canonical, front, lexicographic, workers
from dse.search.canonical import InOrder, canonical_design
from dse.search.front import FrontSearch, Progress, SearchLimits, Watch, search_front
from dse.search.solver.settings import CUTTING, SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished
from dse.space.model.space import Space
from dse.space.question.reading import read_requirements
from dse.support.errors import RefereeError
from dse.support.timelimit import TimeLimit
from tests.helpers.support import PROBLEMS, brute_front, counted_down, dominates, evaluated, load_space, space_of
from tests.helpers.tuned import tune

BY_NAME = {path.stem: path for path in PROBLEMS}
each_problem = pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)


def limited(space: Space, text: str) -> Space:
    """The space with one requirement in place of its own."""
    return replace(space, requirements=read_requirements(space, text, "test"))


def assert_complete_and_proved(space: Space, search: FrontSearch) -> None:
    """The front is that of brute force, design by design, and no feasible design lies in a refuted region."""
    evaluator = Evaluator(space)
    assert search.is_complete
    assert search.points == brute_front(evaluator)
    for evaluation in evaluated(evaluator).values():
        if evaluation.is_feasible:
            point = counted_down(space, evaluation.objectives)
            assert not any(all(a < b for a, b in zip(point, box, strict=True)) for box in search.refuted)


@each_problem
def test_the_front_is_that_of_brute_force(path: Path) -> None:
    space = load_space(path)
    assert_complete_and_proved(space, search_front(Evaluator(space)))


@each_problem
def test_seed_and_workers_change_nothing(path: Path) -> None:
    evaluator = Evaluator(load_space(path))
    expected = search_front(evaluator)
    for budget in (SearchLimits(seed=7), SearchLimits(workers=2)):
        assert search_front(evaluator, budget).points == expected.points
    assert replace(search_front(evaluator), elapsed_s=0.0) == replace(expected, elapsed_s=0.0)


@pytest.mark.parametrize("name", ["types", "bindings", "buses"])
def test_regions_searched_at_the_same_time_give_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(front, "HELP_AFTER_S", 0.0)
    space = load_space(BY_NAME[name])
    assert_complete_and_proved(space, search_front(Evaluator(space), SearchLimits(workers=3)))


@pytest.mark.parametrize("name", ["protocols", "derived", "bindings"])
def test_rates_as_variables_give_the_same_front(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dse.encode.sums.PAIR_LIMIT", 0)
    space = load_space(BY_NAME[name])
    assert_complete_and_proved(space, search_front(Evaluator(space)))


@pytest.mark.parametrize("shared_by", [1, 10**6])
@pytest.mark.parametrize("name", ["protocols", "derived", "equal", "buses", "types"])
def test_a_rounded_measure_gives_exact_feasibility(name: str, shared_by: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dse.analysis.measures.SCALE_LIMIT", 1)
    tune(monkeypatch, shared_forms={"shared_by": shared_by})
    space = load_space(BY_NAME[name])
    assert_complete_and_proved(space, search_front(Evaluator(space)))


COARSE = """
dse: 1
name: coarse
processor_types: {cpu: {}}
processors: {computer: {type: cpu}}
devices: {sensor: {period: 10 ms}}
threads:
  a: {processor: computer, period: [3 ms, 7 ms], compute_execution_time: 100 ns}
  b: {processor: computer, period: [3 ms, 7 ms], compute_execution_time: 100 ns}
  c: {period: [1 ms, 2 ms]}
flows: {main: {path: [sensor, a, c]}}
connections: {sa: {from: sensor, to: a}, ac: {from: a, to: c}}
"""


def test_designs_that_only_rounding_admits_are_refused_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two threads at 3 ms use 66.67 ppm: 66 when rounded down term by term, which the limit admits, but not exactly."""
    monkeypatch.setattr("dse.analysis.measures.SCALE_LIMIT", 1)
    excluded = []
    exclude = Strategy.exclude
    monkeypatch.setattr(Strategy, "exclude", lambda self, design: excluded.append(design) or exclude(self, design))
    for objective in ("minimise latency of main", "minimise jitter of main, minimise power"):
        space = space_of(f"{COARSE}requirements: [utilisation of computer <= 66.5 ppm]\nobjectives: [{objective}]\n")
        assert_complete_and_proved(space, search_front(Evaluator(space)))
    assert excluded


# --- each family: trivial, just feasible, just infeasible ----------------------------------------------------------

FAMILIES = [
    ("protocols", "latency of main"),
    ("protocols", "min latency of main"),
    ("protocols", "jitter of side"),
    ("protocols", "utilisation of computer"),
    ("bindings", "utilisation of main"),
    ("buses", "load of field"),
    ("buses", "load of spare"),
    ("types", "price"),
    ("types", "power"),
    ("types", "mass"),
    ("types", "price of sensor"),
    ("derived", "margin"),
    ("derived", "spare"),
    ("derived", "path"),
]
UNITS = {"B/s": "B/s", "ns": "ns", "nm": "nm", "ppm": "ppm", "ct": "EUR", "mW": "mW", "g": "g"}


def attained(space: Space, metric: str) -> list[Fraction]:
    """Every value of a metric over the valid designs, in its unit, sorted."""
    [requirement] = read_requirements(space, f"{metric} >= 0 {unit_of(space, metric)}", "test")
    measure = build_measure(space, requirement.metric)
    verdicts = evaluated(Evaluator(replace(space, requirements=())))
    return sorted({measure.value(View(design)) for design, item in verdicts.items() if not item.breaches})


def unit_of(space: Space, metric: str) -> str:
    """A unit in which the metric can be limited."""
    kind = metric.partition(" of ")[0]
    units = {"price": "EUR", "power": "mW", "mass": "g", "utilisation": "ppm", "load": "B/s"}
    return {**units, "margin": "ns", "spare": "B/s", "path": "nm"}.get(kind, "ns")


def quantity(value: Fraction, unit: str) -> str:
    """Exact text of a value given in ct where the unit is EUR."""
    scaled = value / 100 if unit == "EUR" else value
    return f"{scaled.numerator}/{scaled.denominator} {unit}"


@pytest.mark.parametrize(("name", "metric"), FAMILIES)
def test_limits_are_exact_on_either_side(name: str, metric: str) -> None:
    space = replace(load_space(BY_NAME[name]), requirements=())
    values, unit = attained(space, metric), unit_of(space, metric)
    assert len(values) > 1
    least, most = quantity(values[0], unit), quantity(values[-1], unit)
    step = min(b - a for a, b in pairwise(values)) / 3
    just_less, just_more = quantity(values[0] - step, unit), quantity(values[-1] + step, unit)
    inner = quantity(values[len(values) // 2], unit)
    for holds_somewhere, text in [
        (True, f"<= {least}"),
        (False, f"< {least}"),
        (False, f"<= {just_less}"),
        (True, f">= {most}"),
        (False, f"> {most}"),
        (False, f">= {just_more}"),
        (True, f"== {inner}"),
        (False, f"== {just_more}"),
        (True, f"<= {most}"),
        (True, f">= {least}"),
    ]:
        if metric.startswith("utilisation") and "<" in text:
            continue  # a limit per core as well: see the test below
        search = search_front(Evaluator(limited(space, f"{metric} {text}")))
        assert search.is_complete
        assert bool(search.points) is holds_somewhere, text
    for text in (f"<= {inner}", f"> {inner}"):
        changed = limited(space, f"{metric} {text}")
        assert_complete_and_proved(changed, search_front(Evaluator(changed)))


CORES = """
dse: 1
name: cores
processor_types: {two: {cores: 2}}
bus_types: {line: {bandwidth: 8 kbit/s}}
processors: {computer: {type: two}}
buses: {link: {type: line}}
devices: {sensor: {period: 10 ms}}
threads:
  a: {processor: computer, period: 10 ms, compute_execution_time: 5 ms}
  b: {processor: computer, period: 10 ms, compute_execution_time: 3 ms}
connections: {sa: {from: sensor, to: a, data_size: 4 B, bus: link}}
objectives: [minimise utilisation of computer]
"""


@pytest.mark.parametrize(
    ("requirement", "holds"),
    [
        ("utilisation of computer <= 50 %", True),  # 80 % of 100 %, and the larger thread 50 % of one core
        ("utilisation of computer <= 49.9999 %", False),  # the larger thread alone
        ("utilisation of computer < 50 %", False),
        ("utilisation of computer < 50.0001 %", True),
        ("utilisation of computer >= 40 %", True),  # 80 % of 200 %
        ("utilisation of computer > 40 %", False),
        ("utilisation of computer == 40 %", True),
        ("load of link <= 40 %", True),  # 400 B/s of 1000 B/s
        ("load of link < 40 %", False),
        ("load of link <= 399.999 B/s", False),
        ("load of link == 400 B/s", True),
        ("load <= 1 MB/s", True),
    ],
)
def test_shares_of_capacity(requirement: str, holds: bool) -> None:
    search = search_front(Evaluator(space_of(f"{CORES}requirements: [{requirement}]\n")))
    assert search.is_complete
    assert bool(search.points) is holds


# --- the question itself -------------------------------------------------------------------------------------------


def test_without_objectives_one_design_or_a_proof_that_there_is_none() -> None:
    space = replace(load_space(BY_NAME["types"]), objectives=())
    search = search_front(Evaluator(space))
    assert search.is_complete
    assert list(search.points) == [()]
    assert Evaluator(space).evaluate(search.points[()]).is_feasible
    assert not search_front(Evaluator(limited(space, "price <= 1 EUR"))).points


def test_every_combination_of_objectives() -> None:
    space = load_space(BY_NAME["bindings"])
    for number in range(1, 8):
        chosen = tuple(item for bit, item in enumerate(space.objectives) if number >> bit & 1)
        part = replace(space, objectives=chosen)
        assert search_front(Evaluator(part)).points == brute_front(Evaluator(part))


def test_fixed_decisions() -> None:
    space = load_space(BY_NAME["rules"])
    for index, decision in enumerate(space.decisions):
        for option in range(len(decision.options)):
            fixed = replace(space, fixed={index: option})
            assert search_front(Evaluator(fixed)).points == brute_front(Evaluator(fixed))


def test_objectives_too_large_for_one_weighted_sum_take_two_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluator = Evaluator(load_space(BY_NAME["bindings"]))
    expected = search_front(evaluator)
    calls = [expected.calls]
    for limit in (10**6, 1):  # of the others, too: one call for each objective
        monkeypatch.setattr(lexicographic, "EXACT_LIMIT", limit)
        search = search_front(evaluator)
        assert search.points == expected.points
        calls.append(search.calls)
    assert calls == sorted(set(calls))


@pytest.mark.parametrize("limit", [canonical.EXACT_LIMIT, 40 << 4])
@pytest.mark.parametrize("name", ["large_rule", "bindings", "protocols", "buses"])
def test_canonical_designs_by_digits_are_those_of_the_depth_first_search(
    name: str, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the depth-first search takes too long, options become digits, as many to a call as stay exact."""
    evaluator = Evaluator(load_space(BY_NAME[name]))
    expected = search_front(evaluator)
    monkeypatch.setattr(InOrder, "first", lambda self, strategy, to_the_end: Unfinished())
    monkeypatch.setattr(front, "canonical_design", lambda *given, strictly: canonical_design(*given, strictly=True))
    monkeypatch.setattr(canonical, "EXACT_LIMIT", limit)
    search = search_front(evaluator)
    assert search.points == expected.points
    assert not search.not_first


@pytest.mark.parametrize("name", ["equal", "bindings", "protocols", "buses"])
def test_canonical_designs_from_a_fresh_start_do_not_depend_on_the_way(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the depth-first search takes too long: the same designs with other hints, orders and workers."""
    tune(monkeypatch, knapsack_tables={"is_on": False})
    evaluator = Evaluator(load_space(BY_NAME[name]))
    monkeypatch.setattr(InOrder, "first", lambda self, strategy, to_the_end: Unfinished())
    monkeypatch.setattr(front, "HELP_AFTER_S", 0.0)
    expected = search_front(evaluator)
    assert expected.not_first == expected.points.keys()
    assert search_front(evaluator, SearchLimits(workers=3)).points == expected.points
    minimise = Strategy.minimise
    monkeypatch.setattr(Strategy, "minimise", lambda self, weights, regions, hint: minimise(self, weights, regions))
    assert search_front(evaluator).points == expected.points


def test_the_canonical_design_leaves_the_model_as_it_was() -> None:
    encoded = encode(Evaluator(load_space(BY_NAME["bindings"])))
    strategy = Strategy(encoded)
    answer = strategy.minimise([1, 0, 0], [encoded.everywhere])
    assert isinstance(answer, Found)
    options = {literal.index for literals in encoded.options for literal in literals}
    before = [list(encoded.model.proto.variables[index].domain) for index in sorted(options)]
    assert canonical_design(strategy, answer, None, InOrder()) is not None
    assert [list(encoded.model.proto.variables[index].domain) for index in sorted(options)] == before


def test_progress_is_reported_after_every_call() -> None:
    reports: list[Progress] = []
    search = search_front(Evaluator(load_space(BY_NAME["types"])), watch=Watch(progress=reports.append))
    assert [item.calls for item in reports] == list(range(1, len(reports) + 1))
    assert reports[-1].open_regions == 0
    assert reports[-1].points == len(search.points)


# --- faults --------------------------------------------------------------------------------------------------------


def failing(monkeypatch: pytest.MonkeyPatch, first: int, calls: Iterator[int]) -> None:
    """Every solver run from the one with number `first` on is stopped before it can tell."""
    solve = Strategy._solve_whole

    def stopped(self: Strategy, settings: SolverSettings, work: float) -> Answer:
        if next(calls) >= first:
            self.stop()
            return Unfinished()
        return solve(self, settings, work)

    monkeypatch.setattr(Strategy, "_solve_whole", stopped)


@pytest.mark.parametrize("name", ["types", "bindings", "buses"])
def test_a_stopped_search_says_so_and_claims_nothing_more(name: str) -> None:
    space = load_space(BY_NAME[name])
    evaluator = Evaluator(space)
    expected = brute_front(evaluator)
    runs = search_front(evaluator).calls
    for first in range(runs):
        with pytest.MonkeyPatch.context() as monkeypatch:
            failing(monkeypatch, first, count())
            search = search_front(evaluator)
        assert set(search.points) <= set(expected)
        missing = [counted_down(space, vector) for vector in set(expected) - set(search.points)]
        for point in missing:
            assert any(all(a < b for a, b in zip(point, region, strict=True)) for region in search.unexplored)
        assert search.is_complete == (not search.unexplored)
        if missing:
            assert not search.is_complete
        for design in search.points.values():
            assert evaluator.evaluate(design).is_feasible


@pytest.mark.parametrize("name", ["types", "bindings", "derived"])
def test_a_stopped_search_is_taken_up_where_it_ended(name: str) -> None:
    evaluator = Evaluator(load_space(BY_NAME[name]))
    expected = search_front(evaluator)
    for first in range(0, expected.calls, 2):
        with pytest.MonkeyPatch.context() as monkeypatch:
            failing(monkeypatch, first, count())
            stopped = search_front(evaluator)
        again = search_front(evaluator, earlier=stopped)
        assert again.is_complete
        assert again.points == expected.points
        assert again.calls > stopped.calls or stopped.is_complete


def test_the_state_of_a_running_search_is_handed_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "CHECKPOINT_S", 0.0)
    evaluator = Evaluator(load_space(BY_NAME["bindings"]))
    states: list[FrontSearch] = []
    search = search_front(evaluator, watch=Watch(checkpoint=states.append))
    assert states
    assert not states[0].is_complete
    assert all(set(state.points) <= set(search.points) for state in states)
    assert search_front(evaluator, earlier=states[0]).points == search.points


def test_a_run_that_only_the_light_settings_cannot_finish_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluator = Evaluator(load_space(BY_NAME["types"]))
    expected = search_front(evaluator)
    solve = Strategy._solve_whole

    def only_heavy(self: Strategy, settings: SolverSettings, work: float) -> Answer:
        return solve(self, settings, work) if settings is CUTTING and work > 1 else Unfinished()

    monkeypatch.setattr(Strategy, "_solve_whole", only_heavy)
    assert search_front(evaluator).points == expected.points


def test_no_time_at_all() -> None:
    search = search_front(Evaluator(load_space(BY_NAME["types"])), SearchLimits(TimeLimit.after(0.0)))
    assert not search.is_complete
    assert search.points == {}
    assert len(search.unexplored) == 1


def test_a_worker_that_dies_is_an_error_and_not_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    def die(self: object, model: object) -> None:
        raise MemoryError("out of memory")

    monkeypatch.setattr("ortools.sat.python.cp_model.CpSolver.solve", die)
    with pytest.raises(MemoryError, match="out of memory"):
        search_front(Evaluator(load_space(BY_NAME["types"])))


def test_stop_ends_the_search() -> None:
    encoded = encode(Evaluator(load_space(BY_NAME["types"])))
    strategy = Strategy(encoded)
    strategy.stop()
    assert isinstance(strategy.minimise([1, 1, 1], [encoded.everywhere]), Unfinished)


def test_empty_regions_need_no_solver() -> None:
    encoded = encode(Evaluator(load_space(BY_NAME["types"])))
    strategy = Strategy(encoded)
    bounds = encoded.everywhere
    assert isinstance(strategy.minimise([1, 0, 0], [(0, *bounds[1:]), (*bounds[:2], -1)]), NoSuchDesign)
    assert strategy.calls == 0
    with pytest.raises(AssertionError, match="exact arithmetic"):
        strategy.minimise([EXACT_LIMIT, 0, 0], [(2, *bounds[1:])])


@pytest.mark.parametrize("claim", ["objectives", "feasibility", "region"])
def test_a_solver_that_lies_is_caught_by_the_referee(claim: str, monkeypatch: pytest.MonkeyPatch) -> None:
    evaluator = Evaluator(load_space(BY_NAME["types"]))
    run = Strategy.run

    def lie(self: Strategy, settings: SolverSettings, work: float, *further: Any) -> Answer:
        answer = run(self, settings, work, *further)
        if not isinstance(answer, Found):
            return answer
        if claim == "objectives":
            return Found((answer.point[0] + 1, *answer.point[1:]), answer.design)
        if claim == "region":
            return Found(tuple(value + 10**6 for value in answer.point), answer.design)
        return Found(answer.point, tuple(0 for _ in answer.design))

    monkeypatch.setattr(Strategy, "run", lie)
    with pytest.raises(RefereeError):
        search_front(evaluator)


def test_found_points_do_not_dominate_each_other() -> None:
    for path in PROBLEMS:
        space = load_space(path)
        points = [counted_down(space, vector) for vector in search_front(Evaluator(space)).points]
        assert not any(dominates(one, other) for one in points for other in points)
