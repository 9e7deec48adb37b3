"""Every option that changes the question, in random combinations, against looking at every design.

A random problem with uncertain inputs and deadlines is asked with limits, requirements, rules, objectives, fixed
decisions, settings and robustness as they come; the search is stopped at random calls and goes on from the file that
it left. What comes out is the front of exhaustion, and `verify` confirms it, stopped or not.
"""

from __future__ import annotations

import json
import random
import re
from collections import Counter
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import build_measure, loaded_buses
from dse.analysis.osate.load import bus_budget
from dse.analysis.validity import canonical
from dse.analysis.views import View
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.questions.problem import Problem, changed, load, loads
from dse.questions.question import QuestionChanges
from dse.questions.robust.robust import RobustWatcher, robust_asked
from dse.questions.robust.worst_case import Box
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.uncertainty import read_uncertainties
from dse.questions.verbs.solve import Watcher, solve_asked
from dse.search import workers
from dse.search.front import SearchLimits
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Unfinished
from dse.space.model.criteria import Metric
from dse.space.model.space import Design, Space
from dse.space.question.settings import SETTINGS
from dse.support.errors import DseError, TooLargeError, UsageError
from tests.helpers.effort import cases
from tests.helpers.support import counted_down, dominates
from tests.oracle.generator import random_problem
from tests.oracle.osate import Model
from tests.properties.scheduled import with_scheduling

MOST_DESIGNS = 4000
PARTITIONS = [
    "partitions:",
    "  one: {period: 20 ms, offset: 1 ms, duration: 4 ms}",
    "  two: {period: 20 ms, offset: 6 ms, duration: 3 ms}",
    "  loose: {period: 25 ms}",
]
OSATE = ("osate-2.19", "osate-2.19", "osate-2.2")
PROCESSING = ("execution_time", "response_time")
LIMITED = ("latency", "jitter", "utilisation", "load", "response time", "price", "power")


@dataclass(frozen=True)
class Asked:
    """A problem file, what is asked of it beyond the file, and whether robustly."""

    path: Path
    changes: QuestionChanges
    robust: bool

    @property
    def problem(self) -> Problem:
        return changed(load(self.path), self.changes)


def question(
    seed: int, folder: Path, *, osate: bool = False, scheduled: bool = False, size: str = "tiny"
) -> Asked | None:
    """A random question; None where the drawn texts make no problem or too large a one."""
    rng = random.Random(f"question {seed}{' as OSATE' if osate else ''}{' scheduled' if scheduled else ''}")
    drawn = random_problem(seed, size)
    text = with_deadlines(with_scheduling(drawn, rng) if scheduled else drawn, rng)
    if osate:
        text = with_osates_words(text, rng)
    try:
        problem = loads(text)
    except DseError:
        return None
    robust = rng.random() < 0.5
    path = folder / "p.yaml"
    path.write_text(text + (uncertainty(problem, rng) if robust else ""), encoding="utf-8")
    try:
        problem = load(path)
        changes = settings(rng)
        if osate:
            changes = replace(changes, profile=rng.choice(OSATE))
        if scheduled:
            changes = replace(changes, profile="dse", deadlines="all", processing=rng.choice(PROCESSING))
        asked = changed(problem, changes)
        changes = replace(
            changes, objectives=objectives(asked, rng), require=demands(asked, rng), fix=fixed(asked, rng)
        )
        count = 1
        for item in changed(problem, changes).space.decisions:
            count *= len(item.options)
    except DseError:
        return None
    return Asked(path, changes, robust) if count <= MOST_DESIGNS else None


def with_deadlines(text: str, rng: random.Random) -> str:
    """Some threads get deadlines."""
    lines = text.splitlines()
    start = lines.index("threads:") + 1 if "threads:" in lines else len(lines)
    for number in range(start, len(lines)):
        if not lines[number].startswith("  "):
            break
        if rng.random() < 0.4 and lines[number].endswith("}") and "deadline" not in lines[number]:
            lines[number] = f"{lines[number][:-1]}, deadline: {rng.choice([2, 5, 20, 100])} ms}}"
    return "\n".join(lines) + "\n"


IN_FLOW = ("latency: 3 ms", "compute_execution_time: 1 ms .. 7 ms", "response_time: 2 ms .. 4 ms")


def carried(section: str, line: str, problem: dict[str, Any], rng: random.Random) -> list[str]:
    """Protocols that wrap messages without being bound, and several buses at once."""
    budget = f"budget: {rng.choice([1, 3, 100])} KB/s"
    protocols = [name for name, item in (problem.get("bus_types") or {}).items() if item.get("virtual")]
    buses = [name for name, item in (problem.get("buses") or {}).items() if not item.get("optional")]
    words = [budget] if section in ("buses", "connections") and rng.random() < 0.3 else []
    words += ["broadcast: true"] if section == "bus_types" and rng.random() < 0.5 else []
    words += [f"from_port: {rng.choice('op')}"] if section == "connections" and "from: " in line else []
    if section == "bus_types" and len(protocols) > 1 and line.strip().startswith(f"{protocols[-1]}:"):
        words += [f"protocols: [{rng.choice(protocols[:-1])}]"]
    if section == "connections" and protocols and rng.random() < 0.3:
        words += [f"protocols: [{', '.join(rng.sample(protocols, rng.randint(1, len(protocols))))}]"]
    if section == "connections" and "bus: " in line and buses and rng.random() < 0.4:
        own = re.search(r"\bbus: (\[[^\]]*\]|\w+)", line)
        others = [name for name in buses if own is None or name not in re.findall(r"\w+", own[1])]
        words += [f"further_buses: [{rng.choice(others)}]"] if others else []
    return words


def with_osates_words(text: str, rng: random.Random) -> str:
    """Ports, timing, periods of buses and of what events dispatch, threads that only have figures of a processor."""
    lines, section = text.splitlines(), ""
    problem = yaml.safe_load(text)
    partitioned = rng.random() < 0.4
    if partitioned:
        lines += PARTITIONS
    for number, line in enumerate(lines):
        if not line.startswith(" "):
            section = line.rstrip(":")
            continue
        words = []
        if section == "connections" and "port" not in line:
            words += [f"port: {rng.choice(['data', 'data_access', 'feature', 'event_data'])}"]
            words += [f"timing: {rng.choice(['immediate', 'delayed'])}"] * (rng.random() < 0.4)
        words += carried(section, line, problem, rng)
        if section == "bus_types" and rng.random() < 0.3:
            words += [f"period: {rng.choice(['2 ms', '[1 ms, 5 ms]'])}"]
        if section == "threads" and "aperiodic" in line and "period:" not in line and rng.random() < 0.5:
            words += ["period: 5 ms"]
        if section == "threads" and rng.random() < 0.2:
            lines[number] = line.replace("processor: computer", "figures_of: computer")
        if section == "threads" and partitioned and rng.random() < 0.8:
            words += [f"partition: {rng.choice(['one', 'one', 'two', 'loose'])}"]
        if section == "flows" and rng.random() < 0.3 and (path := re.search(r"path: \[(.*)\]", line)):
            last = path[1].split(", ")[-1]
            named = f"{{element: {last}, {rng.choice(IN_FLOW)}}}"
            lines[number] = line.replace(path[0], f"{path[0][: -1 - len(last)]}{named}]")
        if words and line.endswith("}") and not line.endswith("{}"):
            lines[number] = f"{lines[number][:-1]}, {', '.join(words)}}}"
        if section == "flows" and line.startswith(" ") and rng.random() < 0.15:
            name = line.partition(":")[0].strip()
            lines[number] += f"\n  around {name}: {{path: [{name}]}}"
    return "\n".join(lines) + "\n"


def uncertainty(problem: Problem, rng: random.Random) -> str:
    """One to three quantities with a range around what is stated."""
    variables = [item for item in InputSpace(problem).variables if item.nominal and item.unit not in ("", "mW")]
    chosen = rng.sample(variables, min(len(variables), rng.randint(1, 3)))
    lines = [
        f"  '{item.path}': {{factor: {rng.choice(['0.8', '1'])} .. {rng.choice(['1', '1.2', '2'])}}}" for item in chosen
    ]
    return "\n".join(["uncertainty:", *lines]) + "\n" if lines else ""


def settings(rng: random.Random) -> QuestionChanges:
    """Each setting as the file has it, or one of its values."""
    names = {name: rng.choice([None, *values]) for name, values in SETTINGS.items() if rng.random() < 0.5}
    return QuestionChanges(**names)  # type: ignore[arg-type]


def objectives(problem: Problem, rng: random.Random) -> tuple[str, ...]:
    names = [item.metric.name for item in Evaluator(problem.space).metrics]
    if rng.random() < 0.5 or not names:
        return ()
    chosen = rng.sample(names, min(len(names), rng.randint(1, 3)))
    return tuple(f"{rng.choice(['minimise', 'minimise', 'maximise'])} {name}" for name in chosen)


def demands(problem: Problem, rng: random.Random) -> tuple[str, ...]:
    """Limits around what a random design has, and rules."""
    space, found = problem.space, []
    design = tuple(rng.randrange(len(item.options)) for item in space.decisions)
    evaluator = Evaluator(space)
    if not evaluator.invalid(design):
        for measure in evaluator.metrics:
            if measure.metric.kind in LIMITED and measure.unit in ("ns", "ct", "B/s") and rng.random() < 0.25:
                value = int(measure.value(View(design)) * rng.choice([0.8, 1, 1, 1.2]))
                unit = {"ns": "ns", "B/s": "B/s", "ct": space.currency}[measure.unit]
                figure = value / 100 if measure.unit == "ct" else value
                found.append(f"{measure.metric.name} {rng.choice(['<=', '<=', '<', '>='])} {figure} {unit}")
    open_ = [item for item in space.decisions if item.is_open and item.kind != "type" and "'" not in item.name]
    if open_ and rng.random() < 0.3:
        item = rng.choice(open_)
        found.append(
            f"{rng.choice(['require', 'forbid'])} '{item.component}'.{item.field} == '{rng.choice(item.options)}'"
        )
    return tuple(found)


def fixed(problem: Problem, rng: random.Random) -> tuple[str, ...]:
    open_ = [item for item in problem.space.decisions if item.is_open]
    if not open_ or rng.random() < 0.6:
        return ()
    cores = [item for item in open_ if item.field == "core"]
    item = rng.choice(cores if cores and rng.random() < 0.5 else open_)
    return (f"'{item.name}' = {rng.choice(item.options)}",)


def exhausted(asked: Asked) -> dict[tuple[int, ...], Design]:
    """The front, by looking at every design: at the figures of the file, and robustly at every corner."""
    problem = asked.problem
    space = problem.space
    evaluators = [Evaluator(space)]
    if asked.robust:
        inputs = InputSpace(problem)
        box = Box(read_uncertainties(problem, inputs))
        for corner in product((0, 1), repeat=len(box.ends)):
            evaluators.append(Evaluator(inputs.at(box.values(inputs.nominal, corner))))
    found: dict[tuple[int, ...], Design] = {}
    for raw in product(*(range(len(item.options)) for item in space.decisions)):
        first = evaluators[0].evaluate(raw)
        if first.is_feasible and all(item.evaluate(raw).is_feasible for item in evaluators[1:]):
            design = canonical(space, raw)
            if first.objectives not in found or design < found[first.objectives]:
                found[first.objectives] = design
    points = {vector: counted_down(space, vector) for vector in found}
    return {
        vector: design
        for vector, design in found.items()
        if not any(dominates(other, points[vector]) for other in points.values())
    }


def solved(asked: Asked) -> Result | RobustResult:
    if asked.robust:
        return robust_asked(asked.problem, SearchLimits())
    return dse.solve(asked.problem, workers=1)


def kept_by_the_way(asked: Asked, monkeypatch: pytest.MonkeyPatch) -> list[Result | RobustResult]:
    """What a search hands out while it goes on, after every call."""
    kept: list[Result | RobustResult] = []
    with monkeypatch.context() as patch:
        for name, value in (("CHECKPOINT_S", 0.0), ("SHARE", 1e9), ("SECOND", 1e9)):
            patch.setattr(workers, name, value)
        if asked.robust:
            robust_asked(asked.problem, SearchLimits(), RobustWatcher(checkpoint=kept.append))
        else:
            solve_asked(asked.problem, SearchLimits(), Watcher(checkpoint=kept.append))
    return kept


def front_of(result: Result | RobustResult) -> Result:
    return result.robust if isinstance(result, RobustResult) else result


def stopped_at(call: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """From that call on the solver has no answer."""
    asked: list[bool] = []
    minimise = Strategy.minimise

    def failing(self: Strategy, *arguments: Any, **more: Any) -> Answer:
        asked.append(True)
        return Unfinished() if len(asked) > call else minimise(self, *arguments, **more)

    monkeypatch.setattr(Strategy, "minimise", failing)


def comparable(result: Result | RobustResult) -> dict[str, Any]:
    """A result without what tells of the run itself; why there is no design is asked of a solver that is stopped."""
    data: dict[str, Any] = json.loads(result.to_json())
    data.get("robust", {}).pop("corners", None)
    return {name: value for name, value in data.items() if name not in ("search", "conflicts", "give_up")}


@pytest.mark.parametrize("seed", cases(12))
def test_osates_rules_are_answered_as_by_looking_at_every_design(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record_property: Any
) -> None:
    """And every latency of every design is that of an own writing of these rules."""
    asked = question(seed, tmp_path, osate=True)
    if asked is None:
        pytest.skip("no problem")
    try:
        whole = solved(asked)
    except UsageError as error:
        pytest.skip(f"refused: {error}")
    space = asked.problem.space
    if space.processing == "execution_time" or space.profile == "osate-2.2":
        held_to_osate(space, random.Random(f"designs {seed}"))
    held_to_exhaustion(whole, asked, seed)


def held_to_osate(space: Space, rng: random.Random) -> None:
    for _ in range(40):
        design = tuple(rng.randrange(len(item.options)) for item in space.decisions)
        if Evaluator(space).invalid(design):
            continue
        design, view = canonical(space, design), View(canonical(space, design))
        for number, flow in enumerate(space.flows):
            least, most = (Model(space, design).total(flow, end) for end in (0, 1))
            for kind, value in (("latency", most), ("min latency", least), ("jitter", most - least)):
                assert build_measure(space, Metric("", kind, number)).value(view) == value, (flow.name, kind, design)
        for number in loaded_buses(space):
            load, name = Model(space, design).load(number), space.buses[number].name
            if load is not None:
                assert build_measure(space, Metric("", "load", number)).value(view) == load, (name, design)
            if (found := bus_budget(space, number, {}, None, view)) is not None:
                assert found.required == Model(space, design).required(number), (name, design)


@pytest.mark.parametrize("seed", cases(16))
def test_any_question_is_answered_as_by_looking_at_every_design(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record_property: Any
) -> None:
    asked = question(seed, tmp_path)
    if asked is None:
        pytest.skip("no problem")
    held_stopped_or_not(asked, seed, tmp_path, monkeypatch, record_property)


@pytest.mark.parametrize("seed", cases(10))
def test_threads_that_wait_for_each_other(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record_property: Any
) -> None:
    """Priorities as decisions, groups of cores, executors, sections and overheads, with everything else."""
    asked = question(seed, tmp_path, scheduled=True)
    if asked is None:
        pytest.skip("no problem")
    held_stopped_or_not(asked, seed, tmp_path, monkeypatch, record_property)


@pytest.mark.parametrize("seed", cases(20, 111))
def test_executors_that_are_chosen_and_may_move(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record_property: Any
) -> None:
    asked = question(seed, tmp_path, size="hosted")
    if asked is None:
        pytest.skip("no problem")
    held_stopped_or_not(asked, seed, tmp_path, monkeypatch, record_property)


def held_stopped_or_not(
    asked: Asked, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record_property: Any
) -> None:
    """A search that is stopped at random calls and goes on from its file ends like the whole one, which is true.

    So does one that goes on from what was kept while it was under way.
    """
    try:
        whole = solved(asked)
    except (TooLargeError, UsageError) as error:
        pytest.skip(f"refused: {error}")
    expected = held_to_exhaustion(whole, asked, seed)
    space = asked.problem.space
    kind = Counter(robust=asked.robust, points=len(expected), stops=0)
    rng, out = random.Random(f"stops {seed}"), tmp_path / "r.json"
    for _ in range(2):
        with monkeypatch.context() as patch:
            stopped_at(rng.randint(0, 6), patch)
            stopped = solved(asked)
        while front_of(stopped).status == "incomplete":
            kind["stops"] += 1
            check(stopped, asked, seed)
            out.write_text(stopped.to_json(), encoding="utf-8")
            with monkeypatch.context() as patch:
                stopped_at(rng.randint(1, 9), patch)
                stopped = dse.resume(out, workers=1)
            assert isinstance(stopped, RobustResult) == asked.robust
        if all(point.is_first for point in front_of(stopped).front):
            assert comparable(stopped) == comparable(whole)
        else:  # it was stopped before it could say which design of a vector is the first
            assert vectors(stopped) == vectors(whole)
    kept = rng.choice(kept_by_the_way(asked, monkeypatch))
    check(kept, asked, seed)
    out.write_text(kept.to_json(), encoding="utf-8")
    assert vectors(dse.resume(out, workers=1)) == vectors(whole)
    record_property("kind", dict(kind))
    assert space.decisions is not None


def vectors(result: Result | RobustResult) -> list[tuple[int | None, ...]]:
    return sorted(tuple(point.objectives.values()) for point in front_of(result).front)


def held_to_exhaustion(whole: Result | RobustResult, asked: Asked, seed: int) -> dict[tuple[int, ...], Design]:
    expected, found = exhausted(asked), front_of(whole)
    assert {tuple(point.objectives.values()) for point in found.front} == set(expected)
    assert found.status == ("complete" if expected else "infeasible")
    for point in found.front:
        if point.is_first:  # of orders whichever will do
            end = asked.problem.space.first_order
            assert point.design[:end] == expected[tuple(point.objectives.values())][:end]
    check(whole, asked, seed)
    return expected


def check(result: Result | RobustResult, asked: Asked, seed: int) -> None:
    """`verify` confirms it, also from its file, except where that cannot be proved again."""
    data = json.loads(result.to_json())
    method = "exhaustion" if seed % 3 else "model"
    found = dse.verify(data, problem=asked.path, method=method)  # type: ignore[arg-type]
    assert found.status != "rejected", found.findings
    assert found.status == "verified" or any("combinations" in text or "proved" in text for text in found.left_open)
