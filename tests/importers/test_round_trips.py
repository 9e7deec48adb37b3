"""Random problems to AADL and back, and from there to a problem file: the same figures, rows and settings."""

from __future__ import annotations

import random
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.validity import canonical
from dse.answers.analysis import analyse_design
from dse.questions.complete_design import complete_design
from dse.questions.verbs.export import figures
from dse.space.model.space import Design, Space
from dse.space.question.settings import settings_of
from dse.support.errors import DseError, UsageError
from tests.clocks.test_open_offsets import drawn, to_yaml
from tests.helpers.effort import cases
from tests.oracle.generator import random_problem
from tests.properties.scheduled import with_scheduling
from tests.properties.test_every_question import OSATE, with_deadlines, with_osates_words

DRAWN = ("plain", "osate", "osate", "scheduled", "offsets")
REFUSED = r"(is used from|must join the flows|other figures: {'(extreme|spread|budget))"
"""What AADL has no word for: one bus with two figures, flows joined within a process, the least over empty slots."""


def problem_text(seed: int) -> str:
    """A problem of the kind that the seed has, without what few designs meet."""
    return re.sub(r"^(requirements|rules):\n(  .*\n)+", "", stated_text(seed), flags=re.MULTILINE)


def stated_text(seed: int) -> str:
    rng, kind = random.Random(f"round trip {seed}"), DRAWN[seed % len(DRAWN)]
    if kind == "offsets":
        return to_yaml(drawn(rng))
    text = with_deadlines(random_problem(seed, "tiny"), rng)
    if kind == "osate":
        return composed(with_osates_words(text, rng)) + f"profile: {rng.choice(OSATE)}\n"
    return with_scheduling(text, rng) if kind == "scheduled" else text


def composed(text: str) -> str:
    """Flows that are nothing but another one get a part of it and the rest instead; no bus is bound to twice."""
    text = re.sub(r"(bus: [^:]*\b(\w+)\b.*), further_buses: \[\2\]", r"\1", text)
    paths = dict(re.findall(r"^  (\w+): \{path: \[([^{}\[\]]*)\]", text, re.MULTILINE))

    def parts(found: re.Match[str]) -> str:
        items = paths.get(found[1], "").split(", ")
        if len(items) < 3 or items[0].startswith("c"):
            return ""
        if items[1].startswith("c"):
            return ""
        part, rest = ", ".join(items[:2]), ", ".join(items[2:])
        return f"  part of {found[1]}: {{path: [{part}]}}\n  around {found[1]}: {{path: [part of {found[1]}, {rest}]}}"

    return re.sub(r"^  around (\w+): \{path: \[\w+\]\}", parts, text, flags=re.MULTILINE)


def told(space: Space, design: Design) -> dict[str, Any]:
    """What an analysis says of a design: response times by thread, rows by flow."""
    found = analyse_design(Evaluator(space), design, response_times=True)
    responses = {item.name: (item.best_ns, item.response_ns) for some in found.responses.values() for item in some}
    rows = {
        flow.name: [(row.contributor, row.min_ns, row.min_method, row.max_ns, row.max_method) for row in flow.rows]
        for flow in found.flows
    }
    return {"responses": responses, "rows": rows}


def same(mine: dict[str, Fraction], theirs: dict[str, Fraction]) -> bool:
    """What both have is the same.

    A model with nothing to decide has some more, says on which cores threads run, and has no empty slots to speak of.
    """
    lost = {name for name in mine.keys() - theirs.keys() if mine[name] and not re.search(r"core |^extreme", name)}
    return not lost and all(theirs[name] == value for name, value in mine.items() if name in theirs)


def assert_osate_reads(text: str) -> None:
    """Its grammar has quotes within texts behind a backslash; its Time is an aadlinteger, SEI's rates are aadlreal."""
    bare = re.sub(r"""--[^\n]*|"(?:\\[btnfru"'\\]|[^\\"])*\"""", "TEXT", text)
    assert '"' not in bare and "TEXT" * 2 not in bare
    assert not re.search(r"\d\.\d+ (ps|ns|us|ms|sec|min|hr)\b", bare)
    assert all("." in found for found in re.findall(r"BandWidth\w+ => ([\d.]+)", bare))


@pytest.mark.parametrize("seed", cases(15))
def test_a_problem_comes_back(seed: int, tmp_path: Path) -> None:
    path, there = tmp_path / "p.yaml", tmp_path / "m.aadl"
    path.write_text(problem_text(seed), encoding="utf-8")
    try:
        problem = dse.load(path)
        result = dse.solve(problem, minimise="price")
    except DseError:
        pytest.skip("no problem")
    if not result.front:
        pytest.skip("no design")
    try:
        there.write_text(dse.export(result, 1, "aadl"), encoding="utf-8")
    except UsageError as error:
        assert re.search(REFUSED, str(error))
        return
    assert_comes_back(result, there)


EMPTY = """
dse: 1
name: two executors
processor_types: {P: {price: 10 EUR}}
processors: {computer: {type: P}}
threads:
  camera: {dispatch_protocol: periodic, period: 10 ms, compute_execution_time: 1 ms .. 2 ms, executor: [left, right]}
  control: {dispatch_protocol: periodic, period: 10 ms, compute_execution_time: 1 ms .. 2 ms, executor: left}
connections: {c: {from: camera, to: control, data_size: 8 B}}
flows: {f: {path: [camera, c, control]}}
executors: {left: {kind: fifo, processor: computer, priority: 1}, right: {kind: fifo, processor: computer, priority: 2}}
objectives: [minimise jitter of f]
"""


def test_an_executor_without_threads_is_left_out(tmp_path: Path) -> None:
    """A design in which no thread runs in an executor was refused."""
    result = dse.solve(dse.loads(EMPTY), fix={"camera.executor": "left"})
    there = tmp_path / "m.aadl"
    there.write_text(dse.export(result, 1, "aadl"), encoding="utf-8")
    assert_comes_back(result, there)


def assert_comes_back(result: dse.Result, there: Path) -> None:
    space, design = result.space, canonical(result.space, result.front[0].design)
    assert_osate_reads(there.read_text(encoding="utf-8"))
    read = dse.load(there).space
    chosen = complete_design(read, read.baseline)
    mine, theirs = figures(space, design), figures(read, chosen)
    assert same(mine, theirs)
    assert told(space, design) == told(read, chosen)
    assert settings_of(read) == settings_of(space)
    plain = dse.loads(dse.import_file(there).text).space
    assert figures(plain, complete_design(plain, plain.baseline)) == theirs
