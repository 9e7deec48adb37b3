"""Robust fronts of problems whose messages wait for buses, against looking at every design at every corner."""

from __future__ import annotations

from math import ceil
from pathlib import Path
from random import Random
from typing import Any

import pytest
import yaml
from click.testing import CliRunner

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.views import View
from dse.cli.main import cli
from dse.questions.robust.robust import solve_robust
from dse.questions.robust.worst_case import Box
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.uncertainty import read_uncertainties
from tests.helpers.bus_systems import draw_bus_problem
from tests.helpers.effort import cases
from tests.scheduling.test_robust import FACTORS, places


def drawn(seed: int, decisions: int) -> dict[str, Any]:
    """A drawn problem with buses, in which up to three execution times, and times of a type of bus, vary."""
    rng = Random(f"robust buses {seed}")
    document: dict[str, Any] = yaml.safe_load(draw_bus_problem(seed, decisions=decisions))
    executing = [
        f"{section}.{name}"
        for section in ("devices", "threads")
        for name, body in document[section].items()
        if "compute_execution_time" in body
    ]
    varied = [
        f"{path}.compute_execution_time" for path in rng.sample(executing, min(len(executing), rng.randint(1, 2)))
    ]
    if rng.random() < 0.5:
        varied.append("bus_types.ipc.transmission_time.fixed")
    if document["buses"].get("can1", {}).get("type") == "plain" and rng.random() < 0.7:
        varied.append(f"bus_types.plain.transmission_time.{rng.choice(('fixed', 'per_byte'))}")
    for body in document["connections"].values():
        body.pop("deadline", None)  # a figure alone is to decide
    for body in document["buses"].values():
        body.pop("assignment", None)
    document["uncertainty"] = {path: {"factor": rng.choice(FACTORS)} for path in varied}
    flow = rng.choice(list(document["flows"]))
    document["figure"] = f"{rng.choice(('latency', 'latency', 'jitter'))} of {flow}"
    return document


def status_of(document: dict[str, Any], requirement: str) -> str:
    """``complete``, ``infeasible``, or ``refused`` where no proof over the ranges is had."""
    try:
        return solve_robust(dse.loads(yaml.safe_dump({**document, "requirements": [requirement]}))).robust.status
    except dse.UsageError as error:
        assert any(words in str(error) for words in ("rise and fall", "moves in steps", "more comparisons than"))
        return "refused"


@pytest.mark.parametrize("seed", cases(20, 1_000))
def test_a_figure_is_proved_at_its_greatest(seed: int) -> None:
    """The greatest figure over all corners and some places inside is a limit that holds, and 1 ns less is none."""
    document = drawn(seed, 0)
    figure = document.pop("figure")
    document["objectives"] = [f"minimise {figure}"]
    problem = dse.loads(yaml.safe_dump(document))
    inputs = InputSpace(problem)
    box = Box(read_uncertainties(problem, inputs))
    design = tuple(0 for _ in problem.space.decisions)
    evaluators = [Evaluator(space) for space in map(inputs.at, places(inputs, box))]
    if not all(item.evaluate(design).is_feasible for item in evaluators):
        return
    greatest = max(item.objectives[0].value(View(design)) for item in evaluators)
    if greatest >= UNBOUNDED_NS / 2:
        return
    assert status_of(document, f"{figure} <= {ceil(greatest)} ns") in ("complete", "refused")
    assert status_of(document, f"{figure} <= {ceil(greatest) - 1} ns") in ("infeasible", "refused")


STEPS = """
dse: 1
name: steps
processor_types: {slow: {cores: 1, price: 10 EUR}, fast: {cores: 1, price: 30 EUR}}
bus_types: {can: {bandwidth: 125 kbit/s, FRAME}}
processors: {p: {type: [slow, fast]}}
buses: {can0: {type: can}}
devices: {sink: {}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {slow: 1 ms .. 2 ms, fast: 1 ms}}
  b: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections:
  ab: {from: a, to: b}
  m: {from: b, to: sink, data_size: 4 B, bus: can0, identifier: 7}
  n: {from: a, to: sink, data_size: 8 B, bus: can0, identifier: 5, port: data}
flows: {f: {path: [a, ab, b, m, sink]}}
requirements: [latency of f <= LIMIT]
objectives: [minimise latency of f, minimise price]
uncertainty: {WHAT}
"""
PLAIN = "arbitration: priority, transmission_time: {fixed: 0 ms, per_byte: 100 us}"


def steps(frame: str, limit: str, what: str) -> dse.Problem:
    """Two threads and two messages; `m` waits for the wire behind `n`."""
    return dse.loads(STEPS.replace("FRAME", frame).replace("LIMIT", limit).replace("WHAT", what))


@pytest.mark.parametrize(
    ("what", "longest"),
    [
        ("threads.b.compute_execution_time: {factor: 1 .. 1.5}", 2_000 + 1_500 + 400 + 800),
        ("connections.m.data_size: {range: 2 B .. 8 B}", 2_000 + 1_000 + 800 + 800),
        ("connections.n.data_size: {range: 2 B .. 12 B}", 2_000 + 1_000 + 400 + 1_200),
        ("bus_types.can.transmission_time.per_byte: {factor: 1 .. 2}", 2_000 + 1_000 + 800 + 1_600),
    ],
)
@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
def test_times_of_threads_and_messages_vary(what: str, longest: int, processing: str) -> None:
    """Of the slow processor 2 ms of `a`, 1 ms of `b`, 0.4 ms of `m` and 0.8 ms of `n`, each as long as it may be."""
    for limit, types in ((longest, {"slow", "fast"}), (longest - 1, {"fast"})):
        problem = steps(PLAIN, f"{limit} us", what).ask(processing=processing)
        found = solve_robust(problem)
        assert {point.decisions["p.type"] for point in found.robust.front} == types
        assert dse.verify(found, problem=problem).status == "verified"


STATED = """
dse: 1
name: stated response times
processing: execution_time
bus_types: {wire: {bandwidth: 1 Mbit/s, arbitration: priority, transmission_time: {fixed: 100 us}}}
buses: {bus: {type: wire}}
devices:
  a: {period: 2 ms, compute_execution_time: 100 us .. 200 us, response_time: 100 us .. 1.6 ms}
  b: {period: 5 ms}
  sink: {}
connections:
  urgent: {from: a, to: sink, bus: bus, data_size: 1 B, identifier: 1}
  other: {from: b, to: sink, bus: bus, data_size: 1 B, identifier: 2}
flows: {f: {path: [b, other, sink]}}
requirements: [response time of other <= LIMIT]
objectives: [minimise latency of f]
uncertainty: {WHAT}
"""


@pytest.mark.parametrize("what", ["", ".max"])
def test_stated_response_times_of_senders_vary(what: str) -> None:
    """A message that comes up to 1.98 ms late, and again 2 ms after its time, goes twice before another: 300 us."""
    for limit, status in (("300 us", "complete"), ("299 us", "infeasible")):
        text = STATED.replace("LIMIT", limit).replace("WHAT", f"devices.a.response_time{what}: {{factor: 0.8 .. 1.3}}")
        assert solve_robust(dse.loads(text)).robust.status == status


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
def test_a_shortest_time_before_a_stated_response_time_is_refused(processing: str) -> None:
    """The longer the shortest execution, the less jitter the message has; the message's receiver may wait longer."""
    text = STATED.replace("processing: execution_time", f"processing: {processing}")
    text = text.replace("LIMIT", "1 ms").replace("WHAT", "devices.a.compute_execution_time: {factor: 1 .. 2}")
    with pytest.raises(dse.UsageError, match=r"rise and fall with .*state one value \(.*bus_queuing: not_counted\)"):
        solve_robust(dse.loads(text))


CHOSEN = """
dse: 1
name: an order that changes with sizes
bus_types: {wire: {bandwidth: 1 Mbit/s, arbitration: priority, transmission_time: {fixed: 0 ms, per_byte: 100 us}}}
buses: {bus: {type: wire}}
devices: {a: {period: 20 ms}, b: {period: 1.2 ms}, c: {period: 20 ms}, sink: {}}
connections:
  first: {from: a, to: sink, bus: bus, data_size: 5 B, identifier: any, deadline: 4 ms}
  second: {from: b, to: sink, bus: bus, data_size: 10 B, identifier: any, deadline: 5 ms}
  third: {from: c, to: sink, bus: bus, data_size: 3 B, identifier: any}
flows: {f: {path: [c, third, sink]}}
requirements: [response time of first <= 9 ms]
objectives: [minimise latency of f]
uncertainty: {connections.first.deadline: {range: 4 ms .. 6 ms}}
"""


def test_an_order_that_changes_inside_a_range_is_refused() -> None:
    """The later of two deadlines has the last place: with one below 5 ms `first` responds within 1.8 ms, else 2.8."""
    with pytest.raises(dse.UsageError, match=r"moves in steps .* one value of connections\.first\.deadline"):
        solve_robust(dse.loads(CHOSEN))
    found = solve_robust(dse.loads(CHOSEN.replace("<= 9 ms", "<= 1.8 ms").replace("4 ms .. 6 ms", "4 ms .. 4.9 ms")))
    assert found.robust.status == "complete"


def test_a_refusal_says_what_helps_and_leaves_no_result(tmp_path: Path) -> None:
    """The bits of a frame move in steps with its size: one value of it is what helps, whatever waits."""
    what = "connections.m.data_size: {range: 2 B .. 8 B}"
    with pytest.raises(dse.UsageError, match=r"state one value of connections\.m\.data_size .*bus_queuing"):
        solve_robust(steps("frame: can", "20 ms", what))
    quiet = {"deadlines": "none", "processing": "execution_time", "bus_queuing": "not_counted"}
    with pytest.raises(dse.UsageError, match=r"state one value of connections\.m\.data_size$"):
        solve_robust(steps("frame: can", "20 ms", what).ask(**quiet))
    file, result = tmp_path / "steps.yaml", tmp_path / "result.json"
    file.write_text(STEPS.replace("FRAME", "frame: can").replace("LIMIT", "20 ms").replace("WHAT", what), "utf-8")
    run = CliRunner().invoke(cli, ["solve", str(file), "--robust", "--json", str(result)])
    assert run.exit_code == 2 or isinstance(run.exception, dse.UsageError)
    assert not result.exists()
