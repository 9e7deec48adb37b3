"""The utilisation of single cores: what it means, what it refuses, and the search against an enumeration of its own."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.answers.result import Result
from dse.search.solver.settings import SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer
from dse.support.errors import ProblemError
from tests.helpers.effort import cases

PERIODS = ("8 ms", "10 ms", "12 ms", "20 ms")
TYPES = {"duo": (2, 10), "trio": (3, 20), "solo": (1, 5)}
CATALOGUE = ", ".join(f"{name}: {{cores: {count}, price: {price} EUR}}" for name, (count, price) in TYPES.items())
PAIR = f"""
dse: 1
name: Pair
processor_types: {{{CATALOGUE}}}
processors: {{p: {{type: duo}}}}
threads:
  a: {{processor: p, period: 10 ms, compute_execution_time: 6 ms, core: 1}}
  b: {{processor: p, period: 10 ms, compute_execution_time: 3 ms}}
"""


class Drawn:
    """A problem that is drawn, and its designs by an enumeration that knows nothing but its few words."""

    def __init__(self, seed: int) -> None:
        rng = random.Random(seed)
        self.types = rng.choice([["duo"], ["trio"], ["duo", "trio"], ["solo", "duo"]])
        most = max(TYPES[name][0] for name in self.types)
        self.threads = {
            f"t{number}": (
                rng.sample(PERIODS, rng.choice([1, 1, 2])),
                Fraction(rng.randint(10, 60), 10),
                rng.choice([list(range(1, most + 1))] * 3 + [[1], [1, 2]]),
            )
            for number in range(rng.randint(2, 4))
        }
        self.core, self.share = rng.randint(1, most), rng.choice([30, 50, 70])
        self.most, self.sense = most, rng.choice(["<=", ">=", "<"])
        self.minimised = rng.choice(["core 1 of p", "each core of p", f"core {most} of p"])
        self.is_overloaded = rng.random() < 0.3

    @property
    def text(self) -> str:
        """The problem file."""
        lines = [
            "dse: 1",
            "name: drawn",
            f"processor_types: {{{CATALOGUE}}}",
            f"processors: {{p: {{type: [{', '.join(self.types)}]}}}}",
            f"overload: {'allowed' if self.is_overloaded else 'forbidden'}",
            "threads:",
        ]
        for name, (periods, worst, cores) in self.threads.items():
            lines.append(
                f"  {name}: {{processor: p, period: [{', '.join(periods)}], compute_execution_time: {float(worst)} ms,"
                f" core: {cores if len(cores) < self.most else 'any'}}}"
            )
        lines.append(f"requirements: ['utilisation of core {self.core} of p {self.sense} {self.share} %']")
        lines.append(f"objectives: [minimise utilisation of {self.minimised}, minimise price, maximise utilisation]")
        return "\n".join(lines) + "\n"

    def vectors(self, low: Fraction = Fraction(1), high: Fraction = Fraction(1)) -> Iterator[tuple[Fraction, ...]]:
        """The objectives of each feasible design, those that are maximised negated; shares of one core.

        Feasible with every execution time anywhere between `low` and `high` times what is stated.
        """
        for kind in self.types:
            count, price = TYPES[kind]
            ways = [
                [(period, core) for period in periods for core in cores if core <= count]
                if count > 1
                else [(period, 1) for period in periods]
                for periods, _, cores in self.threads.values()
            ]
            for chosen in itertools.product(*ways):
                used = [Fraction(0)] * max(3, self.most)
                for (period, core), (_, worst, _) in zip(chosen, self.threads.values(), strict=True):
                    used[core - 1] += worst / int(period.removesuffix(" ms"))
                met = all(self._is_met(used[self.core - 1] * factor) for factor in (low, high))
                if (max(used) * high > 1 and not self.is_overloaded) or not met:
                    continue
                asked = max(used) if "each" in self.minimised else used[int(self.minimised.split()[1]) - 1]
                yield asked, Fraction(price), -sum(used, Fraction(0))

    def _is_met(self, used: Fraction) -> bool:
        limit = Fraction(self.share, 100)
        return {"<=": used <= limit, "<": used < limit, ">=": used >= limit}[self.sense]


def _front(vectors: set[tuple[Fraction, ...]]) -> set[tuple[Fraction, ...]]:
    return {
        one
        for one in vectors
        if not any(other != one and all(a <= b for a, b in zip(other, one, strict=True)) for other in vectors)
    }


@pytest.mark.parametrize("seed", cases(50))
def test_the_front_is_that_of_the_enumeration(seed: int) -> None:
    drawn = Drawn(seed)
    problem = dse.loads(drawn.text)
    result = dse.solve(problem)
    assert _found(problem, result) == _expected(drawn.vectors())
    if seed % 5 == 0:
        for method in ("exhaustion", "model"):
            assert dse.verify(result, problem=problem, method=method).status == "verified"


def _found(problem: dse.Problem, result: Result) -> set[tuple[Fraction, ...]]:
    scales = [measure.scale for measure in Evaluator(problem.space).objectives]
    return {
        tuple(Fraction(value, scale) for value, scale in zip(point.objectives.values(), scales, strict=True))
        for point in result.front
    }


def _expected(vectors: Iterator[tuple[Fraction, ...]]) -> set[tuple[Fraction, ...]]:
    return {(used * 10**6, price * 100, -whole * 10**6) for used, price, whole in _front(set(vectors))}


@pytest.mark.parametrize("seed", cases(12, 2000))
def test_a_robust_front_is_that_of_the_enumeration(seed: int) -> None:
    """Execution times between 80 and 120 %: limits on single cores, stated and implied, hold for all of them."""
    drawn = Drawn(seed)
    uncertain = (f"threads.{name}.compute_execution_time: {{factor: 0.8 .. 1.2}}" for name in drawn.threads)
    problem = dse.loads(f"{drawn.text}uncertainty: {{{', '.join(uncertain)}}}\n")
    found = dse.solve_robust(problem)
    assert _found(problem, found.nominal) == _expected(drawn.vectors())
    assert _found(problem, found.robust) == _expected(drawn.vectors(Fraction(8, 10), Fraction(12, 10)))
    if seed % 4 == 0:
        assert dse.verify(found.to_dict(), problem=problem).status == "verified"


@pytest.mark.parametrize("seed", cases(12, 3000))
def test_a_resumed_front_is_that_of_the_enumeration(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = Drawn(seed)
    path, out = tmp_path / "p.yaml", tmp_path / "r.json"
    path.write_text(drawn.text, encoding="utf-8")
    left = [1 + seed % 4]
    solve = Strategy._solve_whole

    def failing(self: Strategy, settings: SolverSettings, work: float) -> Answer:
        left[0] -= 1
        if left[0] < 0:
            self.stop()
        return solve(self, settings, work)

    with monkeypatch.context() as patch:
        patch.setattr(Strategy, "_solve_whole", failing)
        stopped = dse.solve(path)
    out.write_text(stopped.to_json(), encoding="utf-8")
    whole = dse.resume(out)
    assert isinstance(whole, dse.Result)
    assert whole.status in ("complete", "infeasible")
    assert _found(dse.load(path), whole) == _expected(drawn.vectors())


def test_a_core_is_used_by_the_threads_that_are_stated_and_chosen_to_run_there() -> None:
    front = dse.solve(dse.loads(PAIR + "objectives: [minimise utilisation of core 1 of p]\n")).front
    assert [point.objectives for point in front] == [{"utilisation of core 1 of p": 600_000}]
    assert front[0].decisions["b.core"] == "2"
    assert front[0].metrics["utilisation of core 2 of p"] == 300_000
    tight = PAIR + "requirements: ['utilisation of each core of p <= 50 %']\n"
    assert dse.solve(dse.loads(tight), minimise=["price"]).status == "infeasible"


def test_stated_cores_are_told_without_being_asked_for() -> None:
    text = PAIR.replace("execution_time: 3 ms", "execution_time: 3 ms, core: 2")
    assert "p" in dse.loads(text).space.processors[0].name
    found = dse.analyse(dse.loads(text)).metrics
    assert found["utilisation of core 1 of p"] == 600_000
    assert found["utilisation of core 2 of p"] == 300_000


@pytest.mark.parametrize(
    ("objective", "message"),
    [
        ("utilisation of core 3 of p", 'core 3 of "p" does not exist: there are 2 at most'),
        ("utilisation of core 0 of p", 'core 0 of "p" does not exist: there are 2 at most'),
        ("utilisation of core 1 of q", 'no processor is called "q"'),
    ],
)
def test_cores_that_are_not_there_are_refused(objective: str, message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        dse.loads(PAIR + f"objectives: [minimise {objective}]\n")


def test_threads_that_ask_for_first_fit_are_named() -> None:
    text = PAIR.replace("execution_time: 3 ms", "execution_time: 3 ms, core: first_fit")
    with pytest.raises(ProblemError, match='on which core of "p" "b" runs is first-fit\'s to say'):
        dse.loads(text + "objectives: [minimise utilisation of core 2 of p]\n")


def test_limits_of_cores_are_swept_explained_and_fixed() -> None:
    problem = dse.loads(PAIR + "objectives: [minimise utilisation of core 2 of p]\n")
    sweep = dse.sweep(problem, "utilisation of core 1 of p=50 %..100 %")
    (run,) = sweep.runs
    assert run.outcome is not None
    assert [(stretch["from"]) for stretch in run.outcome["stretches"]] == [600_000, 900_000]
    advice = dse.explain(problem, require=["utilisation of core 1 of p <= 50 %"]).relaxations
    assert [item.text for item in advice] == ["utilisation of core 1 of p <= 60 %"]
    fixed = dse.solve(problem, fix=["b.core=1"]).front
    assert [point.objectives["utilisation of core 2 of p"] for point in fixed] == [0]
    limited = dse.solve(problem, max_utilisation=["core 1 of p=60 %"]).front
    assert [point.objectives["utilisation of core 2 of p"] for point in limited] == [300_000]
