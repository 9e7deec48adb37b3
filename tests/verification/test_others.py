"""Further designs at or near points: true ones are accepted, altered ones and altered words about them rejected."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Iterator
from typing import Any, Literal

import pytest

import dse
from dse.answers.result import Result
from dse.questions.problem import Problem
from dse.support.errors import ProblemError
from tests.helpers.effort import LONG, count
from tests.oracle.generator import random_problem
from tests.verification.shared import all_designs_once, copied

METHODS: tuple[Literal["exhaustion", "model"], ...] = ("exhaustion", "model")
FREE = """
dse: 1
name: Free
processor_types: {slow: {price: 100 EUR}, fast: {price: 104 EUR}, lavish: {price: 103 EUR}}
bus_types: {one: {bandwidth: 100 kbit/s}, two: {bandwidth: 200 kbit/s}}
processors: {cpu: {type: [slow, fast, lavish]}}
buses: {net: {type: [one, two]}}
devices: {source: {period: 10 ms}}
threads:
  worker:
    processor: cpu
    dispatch_protocol: periodic
    period: 10 ms
    deadline: [7 ms, 8 ms, 9 ms]
    compute_execution_time: {slow: 0 ns .. 4 ms, fast: 0 ns .. 1 ms, lavish: 0 ns .. 4 ms}
connections: {wire: {from: source, to: worker, data_size: 8 B, bus: net}}
flows: {main: {path: [source, worker]}}
objectives: [minimise jitter of main, minimise price]
"""


def asked(problem: Problem, count: int, within: str | None, top: int | None = None) -> dict[str, Any]:
    """A result with further designs, as a program would read it."""
    result = dse.with_further_designs(dse.solve(problem, workers=1), count, within, top)
    data: dict[str, Any] = json.loads(result.to_json())
    return data


def altered(data: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """(what is wrong, the result): false words about further designs."""
    ids = [point["id"] for point in data["front"]]
    for at, group in enumerate(data["others"]):
        for other in [*[number for number in ids if number != group["of"]][:2], max(ids) + 1]:
            yield f"others[{at}].of is {other}", changed(data, at, of=other)
        for within in ("1/3", "1/1000", 0, "1/20"):
            if within != group["within"]:
                yield f"others[{at}].within is {within}", changed(data, at, within=within)
        if group["more"] is not None:
            yield f"others[{at}].more is not {group['more']}", changed(data, at, more=not group["more"])
            if group["designs"]:
                yield f"others[{at}] lacks a design", changed(data, at, designs=group["designs"][:-1])
        mutated = copied(data)
        del mutated["others"][at]
        yield f"others[{at}] left out", mutated
        for number, design in enumerate(group["designs"]):
            for key, value in (
                ("different_decisions", design["different_decisions"] + 1),
                ("id", f"{group['of']}.99"),
                ("id", "x"),
                ("dominated_by", [*design["dominated_by"], max(ids) + 1]),
            ):
                mutated = copied(data)
                mutated["others"][at]["designs"][number][key] = value
                if key != "id" or len(group["designs"]) > 1 or value == "x":
                    yield f"others[{at}].designs[{number}].{key}", mutated
            mutated = copied(data)
            mutated["others"][at]["designs"].append(copied(design))
            yield f"others[{at}].designs[{number}] twice", mutated
            objective = data["objectives"][0]["name"]
            mutated = copied(data)
            mutated["others"][at]["designs"][number]["objectives"][objective] += 1
            yield f"others[{at}].designs[{number}] has other figures", mutated
    asked = data["others_asked"]
    for key, value in (
        ("points", asked["points"][1:]),
        ("points", [*asked["points"], max(ids) + 1]),
        ("within", "1/7" if asked["within"] != "1/7" else None),
        ("count", 0),
        ("count", "3"),
    ):
        mutated = copied(data)
        mutated["others_asked"][key] = value
        yield f"others_asked.{key} is {value}", mutated
    mutated = copied(data)
    mutated["others"] = []
    yield "all left out", mutated


def changed(data: dict[str, Any], at: int, **values: Any) -> dict[str, Any]:
    mutated = copied(data)
    mutated["others"][at].update(values)
    return mutated


def check(problem: Problem, data: dict[str, Any], method: Literal["exhaustion", "model"], most: int) -> Counter[str]:
    """A true result is accepted, and every alteration of it rejected."""
    seen: Counter[str] = Counter()
    found = dse.verify(data, problem=problem, method=method)
    assert found.status == "verified", (found.findings, found.left_open)
    cases = list(altered(data))
    rng = random.Random(len(cases))
    for name, mutated in rng.sample(cases, min(most, len(cases))):
        assert mutated != data, name
        verdict = dse.verify(mutated, problem=problem, method=method)
        assert verdict.status == "rejected", (name, data["others"], data["others_asked"])
        seen["rejected"] += 1
    for group in data["others"]:
        seen["designs"] += len(group["designs"])
        seen[f"more {group['more']}"] += 1
        seen["near"] += bool(group["within"])
    return seen


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("count", "within", "top"), [(2, None, None), (5, "3%", None), (1, "2%", 1), (100, "5%", 2)])
def test_all_alterations_of_a_small_problem(
    method: Literal["exhaustion", "model"],
    count: int,
    within: str | None,
    top: int | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All by exhaustion; the second model, which is made anew for each of them, judges some."""
    all_designs_once(monkeypatch)
    problem = dse.loads(FREE)
    most = 1000 if LONG or method == "exhaustion" else 20
    assert check(problem, asked(problem, count, within, top), method, most)["rejected"] >= 15


@pytest.mark.parametrize("method", METHODS)
def test_random_problems(method: Literal["exhaustion", "model"], monkeypatch: pytest.MonkeyPatch) -> None:
    all_designs_once(monkeypatch)
    seen: Counter[str] = Counter()
    for seed in range(500, 540):
        try:
            problem = dse.loads(random_problem(seed, "tiny"))
        except ProblemError:
            continue
        number, within = 1 + seed % 4, (None, "10%", "50%")[seed % 3]
        data = asked(problem, number, within)
        if data["front"]:
            seen += check(problem, data, method, 6 if LONG else 4)
        kinds = [seen[name] for name in ("rejected", "designs", "more True", "more False", "near")]
        if seen["rejected"] > (count(110) if method == "exhaustion" else count(75)) and min(kinds) >= (
            5 if LONG else 2
        ):
            return
    pytest.fail(f"too few of some kind: {seen}")


def test_what_was_stopped_claims_nothing(tmp_path: Any) -> None:
    """Where the time was too short nothing is said about more, in results that are read again, too."""
    problem = dse.loads(FREE)
    result: Result = dse.with_further_designs(dse.solve(problem), 2, "3%", time_limit_s=1e-9)
    assert {group.more for group in result.others} == {None}
    assert dse.verify(result, problem=problem).status == "verified"
    path = tmp_path / "r.json"
    whole = dse.with_further_designs(dse.solve(problem), 2, "3%", 2)
    path.write_text(whole.to_json(), encoding="utf-8")
    assert dse.reopen(path).others_asked == whole.others_asked


def test_a_result_with_others_that_does_not_say_what_was_asked_is_rejected() -> None:
    problem = dse.loads(FREE)
    data = asked(problem, 2, "3%")
    del data["others_asked"]
    found = dse.verify(data, problem=problem)
    assert found.status == "rejected" and found.findings[0].place == "others_asked"
