"""Tables of two objectives without the limits: the fronts and designs of exhaustion, and calls that they save."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

import pytest

from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.search import tuning
from dse.search.canonical import any_solution
from dse.search.front import search_front
from dse.search.solver.knapsack import Knapsacks, knapsacks_of
from dse.search.solver.settings import CUTTING, RELAXED, SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver.subspaces import AllSubspaces
from dse.search.solver_answer import Answer, Found, Unfinished
from tests.helpers.effort import cases
from tests.helpers.support import brute_front, space_of
from tests.helpers.tuned import tune


def drawn(seed: int) -> str:
    """Threads with a choice of rates in flows, two types of computers, an optional part; limits that often bind."""
    rng = random.Random(f"knapsack {seed}")
    count = rng.randint(2, 4)
    lines = [
        "dse: 1",
        "name: drawn",
        "processor_types: {small: {cores: 2, price: 60 EUR}, large: {cores: 4, price: 240 EUR}}",
        "processors:",
        "  one: {type: [small, large]}",
        "  two: {type: [small, large]}" if rng.random() < 0.7 else "  two: {type: small, optional: true}",
        "threads:",
    ]
    for number in range(count):
        periods = sorted(rng.sample((4, 5, 8, 10, 20), rng.choice((1, 2, 2, 3))))
        where = rng.choice(("one", "one", "two", "[one, two]"))
        low = rng.randint(100, 900)
        lines.append(
            f"  t{number}: {{processor: {where}, period: [{', '.join(f'{period} ms' for period in periods)}], "
            f"compute_execution_time: {{small: {low} us .. {2 * low} us, large: {low // 2} us .. {low} us}}}}"
        )
    lines.append("connections:")
    lines += [f"  c{number}: {{from: t{number}, to: t{number + 1}}}" for number in range(count - 1)]
    lines.append(f"flows: {{f: {{path: [{', '.join(f't{number}' for number in range(count))}]}}}}")
    limits = [f"latency of f <= {rng.randint(8, 50)} ms", f"utilisation of one <= {rng.randint(5, 60)} %"]
    lines.append(f"requirements: [{', '.join(rng.sample(limits, rng.randint(0, 2)))}]")
    wanted = ["minimise latency of f", "minimise utilisation of one", "minimise price", "maximise utilisation of two"]
    lines.append(f"objectives: [{', '.join(rng.sample(wanted, 2))}]")
    return "\n".join(lines)


def told(monkeypatch: pytest.MonkeyPatch, name: str) -> list[bool]:
    """Whether the tables had a design, each time they were asked for one."""
    heard: list[bool] = []
    ask: Callable[..., object] = getattr(Knapsacks, name)

    def asked(self: Knapsacks, *given: object) -> object:
        answer = ask(self, *given)
        heard.append(answer is not None)
        return answer

    monkeypatch.setattr(Knapsacks, name, asked)
    return heard


def test_fronts_and_designs_are_those_of_exhaustion(monkeypatch: pytest.MonkeyPatch) -> None:
    tune(monkeypatch, knapsack_tables={"after": 0.0}, shared_forms={"shared_by": 1})
    found, first = told(monkeypatch, "design"), told(monkeypatch, "first")
    for seed in cases(150):
        evaluator = Evaluator(space_of(drawn(seed)))
        search = search_front(evaluator)
        assert search.is_complete, seed
        assert search.points == brute_front(evaluator), seed
    assert True in found
    assert True in first


def test_tables_bound_every_design(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a table has beside a value along it is no more than any design of its part has; regions likewise."""
    tune(monkeypatch, shared_forms={"shared_by": 1})
    compared = 0
    for seed in cases(50):
        evaluator = Evaluator(space_of(drawn(seed)))
        encoded = encode(evaluator)
        divided = AllSubspaces(encoded, tuning.DEFAULT)
        tables = divided.knapsacks
        if tables is None:
            continue
        for design in brute_front(evaluator).values():
            point = encoded.weigh(design)
            assert point is not None
            beside = [(table, table.value_beside(point)) for table in tables.tables]
            assert any(value is not None and value <= point[1 - table.axis] for table, value in beside)
            region = tuple(value + 1 for value in point)
            least = [found.weighted for table in tables.tables if (found := table.least((3, 1), region)) is not None]
            assert min(least) <= 3 * point[0] + point[1]
            compared += 1
    assert compared


COUNT = 12
THREADS = "\n".join(
    f"  t{number}: {{processor: computer, period: [5 ms, 10 ms, 20 ms, 50 ms], "
    f"compute_execution_time: {90 + 7 * number} us}}"
    for number in range(COUNT)
)
MANY = f"""
dse: 1
name: many rates
processor_types: {{cpu: {{cores: 8}}}}
processors: {{computer: {{type: cpu}}}}
threads:
{THREADS}
connections: {{{", ".join(f"c{number}: {{from: t{number}, to: t{number + 1}}}" for number in range(COUNT - 1))}}}
flows: {{f: {{path: [{", ".join(f"t{number}" for number in range(COUNT))}]}}}}
requirements: [latency of f <= 600 ms]
objectives: [minimise latency of f, minimise utilisation of computer]
"""


def test_what_the_tables_tell_no_call_is_made_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many designs as the front has are looked up; without tables each of them takes calls of the solver."""
    runs = 0
    run = Strategy.solved

    def counted(self: Strategy, *given: object) -> object:
        nonlocal runs
        runs += 1
        return run(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(Strategy, "solved", counted)
    tune(monkeypatch, knapsack_tables={"after": 0.0})
    evaluator = Evaluator(space_of(MANY))
    search = search_front(evaluator)
    assert search.is_complete
    assert len(search.points) > 20
    assert not runs
    assert not search.not_first
    tune(monkeypatch, knapsack_tables={"is_on": False})
    plain = search_front(evaluator)
    assert plain.points == search.points
    assert runs > len(search.points)


def test_where_limits_bind_the_solver_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    tune(monkeypatch, knapsack_tables={"after": 0.0})
    evaluator = Evaluator(space_of(MANY.replace("f <= 600 ms", "f <= 200 ms")))
    found = told(monkeypatch, "design")
    search = search_front(evaluator)
    tune(monkeypatch, knapsack_tables={"is_on": False})
    assert search_front(evaluator).points == search.points
    assert set(found) == {True, False}


def test_a_design_that_is_forbidden_is_not_told() -> None:
    """Nor is one with other options than those that are fixed, or where the tables would be too large."""
    evaluator = Evaluator(space_of(MANY))
    strategy = Strategy(encode(evaluator))
    region = strategy.encoded.everywhere
    answer = strategy.parts.bounded((10**7, 1), [region], 1.0)[0]
    assert isinstance(answer, Found)
    assert strategy.encoded.weigh(answer.design) == answer.point
    strategy.exclude(answer.design)
    assert strategy.parts.bounded((10**7, 1), [region], 1.0) == (None, None)
    assert strategy.parts.first(answer.point) is None


def test_fixed_options_are_kept() -> None:
    space = space_of(MANY)
    decision = next(index for index, item in enumerate(space.decisions) if len(item.options) > 1)
    encoded = encode(Evaluator(replace(space, fixed={decision: 2})))
    tables = knapsacks_of(encoded, [()], tuning.KnapsackTables())
    assert tables is not None
    least = tables.tables[0].least((1, 1), encoded.everywhere)
    assert least is not None
    assert [design[decision] for design in tables.tables[0].designs(least.point)][:1] == [2]


def test_large_tables_are_not_made() -> None:
    encoded = encode(Evaluator(space_of(MANY)))
    assert knapsacks_of(encoded, [()], tuning.KnapsackTables(most_cells=100)) is None


def test_another_relaxation_has_its_turn_before_one_is_asked_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of designs with given figures: one relaxation may take a hundred times as long as the other."""
    strategy = Strategy(encode(Evaluator(space_of(MANY))))
    answer = strategy.minimise((1, 1), [strategy.encoded.everywhere])
    assert isinstance(answer, Found)
    run, asked = Strategy.run, []

    def missing(self: Strategy, settings: SolverSettings, work: float) -> Answer:
        asked.append((settings, work))
        return run(self, settings, work) if settings is RELAXED else Unfinished()

    monkeypatch.setattr(Strategy, "run", missing)
    strategy.set_point(answer.point)
    strategy.encoded.model.clear_objective()
    found = any_solution(strategy, answer.point)
    assert isinstance(found, Found)
    assert found.point == answer.point
    assert CUTTING in dict(asked)
    assert max(work for _, work in asked) <= 1.0
