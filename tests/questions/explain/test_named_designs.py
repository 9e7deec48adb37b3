"""Every design that an explanation names breaks what is said of it and nothing else, wherever the work is cut off."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.validity import canonical
from dse.answers.explanation import Demand, Example, Explanation
from dse.answers.forms.codec import written
from dse.answers.result import Clash, decisions_of
from dse.cli.main import run
from dse.examples.shipped import example_path
from dse.questions.explain.brief import conflicts_of
from dse.questions.explain.explain import Explainer, Wishes, explain_asked
from dse.questions.problem import Problem
from dse.questions.result_question import named_design
from dse.search.feasibility.oracle import Oracle
from dse.space.model.space import INACTIVE, Design
from dse.support.timelimit import OutOfTime
from tests.helpers.conflicting import Brute, infeasible
from tests.helpers.effort import LONG, count

PROBLEMS = max(6, count(40))


def examples(found: Explanation) -> Iterator[tuple[Example, frozenset[str] | None]]:
    """Every design that is named, and the demands that it may not break where that is said."""
    for conflict in found.conflicts:
        texts = [demand.text for demand, _ in conflict.members]
        for demand, example in conflict.members:
            yield example, frozenset(texts) - {demand.text}
    helping = [item for item in found.relaxations if item.helps]
    for item in helping:
        yield item.example, None
    if found.give_up is not None:
        yield found.give_up.example, None
        for item in found.give_up.members:
            if item.is_sought:
                yield item.example, None


def broken_texts(problem: Problem, design: Design) -> set[str]:
    """What the analysis, rules and fixed decisions say against a design."""
    space = problem.space
    free = Evaluator(replace(space, rules=(), fixed={})).evaluate(design)
    assert not free.breaches
    broken = {verdict.requirement.text for verdict in free.verdicts if not verdict.holds}
    broken |= set(Evaluator(replace(space, fixed={})).evaluate(design).breaches)
    for number, option in space.fixed.items():
        decision = space.decisions[number]
        if free.design[number] not in (option, INACTIVE):
            broken.add(f"{decision.name} = {decision.options[option]}")
    return broken


def check(problem: Problem, found: Explanation) -> int:
    """All that is named is true; how much was named."""
    count = 0
    for example, kept in examples(found):
        design = named_design(problem.space, example.design)
        assert {demand.text for demand in example.breaks} == broken_texts(problem, design)
        if kept is not None:
            assert not kept & {demand.text for demand in example.breaks}
        count += 1
    return count


def problems() -> list[tuple[int, Problem, list[Design]]]:
    found = []
    for seed in range(10_000):
        made = infeasible(seed)
        if made is not None:
            found.append((seed, *made))
        if len(found) == PROBLEMS:
            return found
    raise AssertionError("too few problems")


@pytest.fixture(scope="module")
def drawn() -> list[tuple[int, Problem, list[Design]]]:
    return problems()


def test_named_designs_break_what_is_said_and_nothing_more(drawn: list[tuple[int, Problem, list[Design]]]) -> None:
    named = further = 0
    for seed, problem, designs in drawn:
        found = Explainer.of(problem, Wishes(every=True), 0.0).explanation()
        assert found.complete and not found.left_open
        named += check(problem, found)
        oracle = Brute(problem.space).oracle
        met = [oracle.met_by(design) for design in designs]
        number_of = {(item.text, item.origin): number for number, item in enumerate(oracle.members)}
        for conflict in found.conflicts:
            for demand, example in conflict.members:
                left_out = number_of[demand.text, demand.origin]
                own = oracle.met_by(canonical(problem.space, named_design(problem.space, example.design)))
                more = [kept for kept in met if kept - {left_out} > own - {left_out}]
                assert not more, f"seed {seed}: {example} breaks {demand.text}, and more than it must"
                further += len(example.breaks) > 1
    assert named > 3 * PROBLEMS and further


@contextmanager
def cut_off(after: int, error: type[BaseException]) -> Iterator[None]:
    """The time is over, or Ctrl-C comes, when so many questions are answered."""
    own, count = Oracle._spent, 0

    @contextmanager
    def spent(self: Oracle) -> Iterator[None]:
        nonlocal count
        with own(self):
            count += 1
            if count > after:
                raise error
            yield

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Oracle, "_spent", spent)
        yield


@pytest.mark.parametrize("error", [OutOfTime, KeyboardInterrupt])
def test_what_was_not_looked_at_is_said_and_the_rest_is_true(
    drawn: list[tuple[int, Problem, list[Design]]], error: type[BaseException]
) -> None:
    rng, reduced, half = random.Random(1), 0, 0
    for _, problem, _ in drawn if LONG else drawn[:4]:
        whole = Explainer.of(problem, Wishes(every=True), 0.0).explanation()
        for after in sorted(rng.sample(range(whole.solver_calls), min(whole.solver_calls, 8 if LONG else 5))):
            with cut_off(after, error):
                found = Explainer.of(problem, Wishes(every=True), 0.0).explanation()
            check(problem, found)
            assert not found.complete and found.exit_code == 5
            assert found.left_open, after
            if found.reduced:
                reduced += 1
                members = {(demand.text, demand.origin) for demand in found.reduced}
                assert any({(d.text, d.origin) for d, _ in item.members} <= members for item in whole.conflicts)
            named = {item.demand for item in found.relaxations}
            missing = {item.demand for item in whole.relaxations if item.demand not in named}
            looked = {demand for item in found.conflicts for demand, _ in item.members}
            for demand in missing & looked:
                half += 1
                assert any(demand.text in text for text in found.left_open)
    assert reduced and half


def test_the_conflicts_of_a_stopped_solve_are_confirmed(drawn: list[tuple[int, Problem, list[Design]]]) -> None:
    """`dse.solve` states no closest limit that it did not look for, and `dse.verify` accepts that."""
    seen = 0
    for _, problem, _ in drawn if LONG else drawn[:5]:
        whole = Explainer.of(problem, Wishes(), 0.0).explanation().solver_calls
        for after in range(2, whole, 3):
            with cut_off(after, OutOfTime):
                conflicts, _ = conflicts_of(problem, Wishes())
            for conflict in conflicts:
                for clash in conflict.members:
                    if not clash.is_sought:
                        seen += 1
                        assert (clash.limit, clash.closest, written(Clash, clash)["looked_for"]) == (None, None, False)
    assert seen


SAME = """
dse: 1
name: nine
processor_types: {cpu: {}}
processors: {one: {type: cpu}}
threads:
  first: {processor: one, period: [10 ms, 20 ms], compute_execution_time: 5 ms}
  last: {processor: one, period: 30 ms, compute_execution_time: 5 ms}
connections: {wire: {from: first, to: last}}
flows: {chain: {path: [first, last]}}
requirements: [latency of chain <= 1 ms, jitter of chain <= 1 ms, utilisation of one <= 1 %]
rules: [first.period == 10 ms]
objectives: [minimise jitter of chain]
"""


def test_one_design_is_described_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "nine.yaml"
    path.write_text(SAME, encoding="utf-8")
    assert run(["explain", str(path), "--all"]) == 4
    said = " ".join(capsys.readouterr().out.split())
    assert "only design" not in said and said.count("first.period 10 ms") == 1
    assert "design A violates it and further requirements" in said
    all_three = "latency of chain <= 1 ms; jitter of chain <= 1 ms; utilisation of one <= 1 %"
    assert f"A violates {all_three}: first.period 10 ms" in said  # it keeps the rule: `dse analyse` takes it


def test_designs_without_open_decisions_are_the_only_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "closed.yaml"
    path.write_text(SAME.replace("[10 ms, 20 ms]", "10 ms"), encoding="utf-8")
    assert run(["explain", str(path), "--all"]) == 4
    assert "the only one that the file describes" in capsys.readouterr().out


UNBOUNDED = """
dse: 1
name: overloaded
processing: response_time
overload: allowed
processor_types: {one: {cores: 1, price: 10 EUR}, two: {cores: 1, price: 30 EUR}}
processors: {cpu: {type: [one, two]}}
threads:
  a: {processor: cpu, period: 10 ms, priority: 3, compute_execution_time: 6 ms}
  b: {processor: cpu, period: [10 ms, 12 ms], priority: 2, compute_execution_time: 6 ms}
  c: {processor: cpu, period: 20 ms, priority: 1, compute_execution_time: 1 ms}
connections: {w: {from: b, to: c}}
flows: {f: {path: [b, c]}}
metrics: {line: latency of f * 0.6 m/s}
requirements: [REQUIREMENT, price <= 20 EUR]
objectives: [minimise price]
"""


@pytest.mark.parametrize(
    ("requirement", "threads"),
    [("latency of f <= 100 ms", ("b", "c")), ("jitter of f < 1 ms", ("b", "c")), ("line <= 3 cm", ("b", "c")),
     ("response time of c <= 100 ms", ("c",)), ("response time of c == 3 ms", ("c",))],
)  # fmt: skip
def test_unbounded_is_said_and_no_number_stands_for_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], requirement: str, threads: tuple[str, ...]
) -> None:
    path, out = tmp_path / "unbounded.yaml", tmp_path / "out.json"
    text = UNBOUNDED.replace("REQUIREMENT", requirement)
    path.write_text(text, encoding="utf-8")
    assert run(["explain", str(path), "--all", "--json", str(out)]) == 4
    said, data = capsys.readouterr().out, out.read_text(encoding="utf-8")
    assert "unbounded" in said and "no limit helps" in said
    assert "000 000" not in said and "000000000" not in data.replace("100000000,", "")
    found = dse.explain(path, every=True)
    (moved,) = [item for item in found.relaxations if item.demand.text == requirement]
    assert (moved.helps, moved.closest, moved.unbounded, moved.text) == (True, None, threads, "")
    assert run(["solve", str(path), "--json", str(out)]) == 4
    assert "no limit helps" in (said := capsys.readouterr().out) and "000 000" not in said
    assert run(["verify", str(out)]) == 0


def test_a_limit_that_has_a_bound_is_not_called_unbounded() -> None:
    """At 20 ms b ends after 6 ms of its own and two jobs of a."""
    text = UNBOUNDED.replace("REQUIREMENT", "response time of b <= 10 ms").replace("12 ms]", "20 ms]")
    (moved,) = [item for item in dse.explain(dse.loads(text)).relaxations if item.helps]
    assert (moved.closest, moved.unbounded) == (Fraction(18_000_000), ())


def test_offers_that_were_not_tried_are_said() -> None:
    problem = dse.loads(SAME)
    found = explain_asked(problem, Wishes(offers=("first.period += 5 ms",), time_limit_s=0.0))
    assert found.status == "incomplete" and found.left_open == ("whether there is a design",)
    assert isinstance(found.to_dict()["left_open"], list)
    assert written(Demand, Demand("rule", "x", "y")) == {"kind": "rule", "text": "x", "origin": "y"}
    assert decisions_of(problem.space, (0,) * len(problem.space.decisions))


def test_an_infeasible_solve_that_was_stopped_is_verified() -> None:
    """Cut off after any question, between a conflict and its closest limits as well; what is left out is remarked."""
    problem = dse.load(example_path("starter"))
    limits: dict[str, Any] = {"max_jitter": "1 ms", "max_price": "50 EUR"}
    whole = dse.solve(problem, **limits).to_dict()
    assert dse.verify(whole, problem=problem).status == "verified"
    remarked = 0
    for after in range(30):
        with cut_off(after, OutOfTime):
            data = dse.solve(problem, **limits).to_dict()
        found = dse.verify(data, problem=problem)
        assert (found.status, found.findings) == ("verified", ()), after
        members = [clash for item in data["conflicts"] for clash in item["members"]] + data.get("give_up", [])
        unsought = [clash for clash in members if "looked_for" in clash]
        unlisted = [text for text in found.remarks if text.startswith("no conflict is listed")]
        assert bool(unlisted) == (not data["conflicts"])
        assert len([text for text in found.remarks if "was not looked for" in text]) == len(unsought)
        remarked += len(unsought)
        for item in data["conflicts"]:
            for clash in item["members"]:
                if "looked_for" in clash:  # a limit that was not looked for is not made up
                    clash["closest"] = 1
                    assert dse.verify(data, problem=problem).status == "rejected"
                    clash["closest"] = None
        if data["conflicts"] == whole["conflicts"]:
            break
    assert remarked
