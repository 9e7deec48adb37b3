"""Windows of chains through executors (docs/semantics.md, section 4.9): examples, runs and parts."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction

import pytest

import dse
from dse.analysis.latency.contributors import flow_rows
from dse.analysis.scheduling.chained import chain_of, least_cut
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses, solution_of
from dse.analysis.scheduling.waits import Waits
from dse.analysis.views import View
from dse.space.model.space import Space
from tests.helpers import chained_callbacks
from tests.helpers.core_chains import some_groups
from tests.helpers.effort import cases
from tests.helpers.support import space_of

MS = 10**6
HEAD = """
dse: 1
name: windows through executors
processing: response_time
deadlines: none
processor_types: {p: {}}
processors: {p: {type: p}, q: {type: p}}
objectives: [minimise latency of f]
"""
FOUR = """
executors: {e: {processor: p, kind: KIND}}
threads:
  t: {executor: e, period: 10 ms, compute_execution_time: 2 ms}
  a: {executor: e, period: 20 ms, compute_execution_time: 1 ms}
  b: {executor: e, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  c: {executor: e, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  d: {executor: e, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}, cd: {from: c, to: d}}
flows: {f: {path: [a, b, c, d]}}
"""
BEGUN = """
executors: {e: {processor: p, kind: callback_group, priority: 2}}
threads:
  a: {executor: e, period: 40 ms, compute_execution_time: 1 ms, priority: 5}
  b: {executor: e, dispatch_protocol: aperiodic, compute_execution_time: 1 ms, priority: 4}
  x: {executor: e, period: 100 ms, compute_execution_time: 5 ms, priority: 2}
  y: {executor: e, period: 100 ms, compute_execution_time: 3 ms, priority: 1}
  t: {processor: p, period: 100 ms, compute_execution_time: 1 ms, priority: LEVEL}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
"""
MORE = BEGUN.replace("3 ms, priority: 1}", "5 ms, priority: 1}").replace(
    "  t: {", "  z: {executor: e, period: 100 ms, compute_execution_time: 5 ms, priority: 1}\n  t: {"
)
BETWEEN = """
executors: {e: {processor: p, kind: wait_set, priority: 2}}
threads:
  a: {executor: e, period: 40 ms, compute_execution_time: 1 ms}
  b: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms, priority: LEVEL}
  c: {executor: e, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  x: {executor: e, period: 50 ms, compute_execution_time: 4 ms}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}}
flows: {f: {path: [a, b, c]}}
"""


def latencies(space: Space, view: View) -> dict[str, Fraction]:
    """The greatest latency of each flow in ns."""
    return {flow.name: Fraction(sum(row.max_ns for row in flow_rows(space, flow, view))) for flow in space.flows}


@pytest.mark.parametrize(
    ("text", "latency_ms"),
    [
        *((FOUR.replace("KIND", kind), 6) for kind in ("fifo", "wait_set", "callback_group", "polling")),
        (BEGUN.replace("LEVEL", "1"), 10),  # one of x and y has begun, and the other one when a ends
        (BEGUN.replace("LEVEL", "3"), 11),  # and t goes first
        (BEGUN.replace("LEVEL", "2"), 11),  # t is as urgent: jobs of x and y may have held it up
        (MORE.replace("LEVEL", "1"), 12),  # one of x, y and z has begun, and another one when a ends
        (BETWEEN.replace("LEVEL", "3"), 7),
        (BETWEEN.replace("LEVEL", "1"), 7),
    ],
)
def test_examples(text: str, latency_ms: int) -> None:
    space = space_of(HEAD + text)
    assert latencies(space, View(())) == {"f": latency_ms * MS}
    assert dse.simulate(HEAD + text, runs=40).exit_code == 0


@pytest.mark.parametrize(("longest_ms", "latency_ms"), [(5, 10), (6, None)])
def test_what_may_be_dropped_has_a_window_where_its_jobs_never_meet(longest_ms: int, latency_ms: int | None) -> None:
    """Of 2 + 1 + 5 + 1 + 1 ms every 10 ms nothing is dropped; of a ms more it may be, and messages wait for ever."""
    lines = FOUR.replace("KIND", "polling").replace("20 ms", "10 ms").splitlines()
    lines = [line.replace("1 ms", f"{longest_ms} ms") if line.startswith("  b:") else line for line in lines]
    known = latencies(space_of(HEAD + "overload: allowed" + "\n".join(lines)), View(()))["f"]
    assert known == latency_ms * MS if latency_ms is not None else known >= UNBOUNDED_NS


def drawn(seed: int, *, breaks: bool = False) -> tuple[random.Random, chained_callbacks.Core, Space]:
    """A drawn system with a flow to each callback; with `breaks` some connections take time, and sections hold it."""
    rng = random.Random(f"windows through executors {seed}")
    core = chained_callbacks.draw(rng)
    more = chained_callbacks.flows_of(core) + "\nobjectives: [minimise price]"
    for item in core.callbacks if breaks else ():
        item.holds = rng.random() < 0.1
    text = chained_callbacks.text_of(core, more=more)
    for item in core.callbacks if breaks else ():
        latency = rng.choice(("", ", latency: 0 ms .. 1 ms", ", latency: 2 ms .. 3 ms"))
        text = text.replace(f", to: {item.name}}}", f", to: {item.name}{latency}}}")
    return rng, core, space_of(text)


@pytest.mark.parametrize("seed", cases(600))
def test_no_run_takes_longer_than_its_bound(seed: int) -> None:
    rng, core, space = drawn(seed)
    bounds = latencies(space, View(()))
    for _ in range(4):
        for name, taken in chained_callbacks.chains_played(core, rng).items():
            assert taken * MS <= bounds[f"f_{name}"], (name, taken, bounds[f"f_{name}"])


@pytest.mark.parametrize("seed", cases(300, 10_000))
def test_no_bound_of_a_part_is_above_that_of_the_whole(seed: int) -> None:
    """What the search learns of some threads of a core holds of more."""
    rng, core, space = drawn(seed, breaks=seed % 2 > 0)
    whole = latencies(space, View(()))
    ends = all_responses(space, View(()))
    homes: dict[str, list[int]] = {}
    for number, (component, item) in enumerate(zip(space.components, core.callbacks, strict=True)):
        assert component.name == item.name
        homes.setdefault(item.name if item.elsewhere else "", []).append(number)
    for _ in range(6):
        part = View((), some_groups(rng, list(homes.values())))
        for name, bound in latencies(space, part).items():
            assert bound <= whole[name] or whole[name] >= UNBOUNDED_NS
        for key, end in all_responses(space, part).items():
            known = ends[key] if isinstance(key[1], str) else None
            assert known is None or (end is not None and end <= known)


@pytest.mark.parametrize("seed", cases(300, 20_000))
def test_what_threads_of_a_flow_wait_for_adds_up_to_its_latency(seed: int) -> None:
    _, _, space = drawn(seed, breaks=seed % 2 > 0)
    view = View(())
    whole, solution = latencies(space, view), solution_of(space, view)
    waits = Waits(space, solution.system, solution.ends)
    for flow in (flow for flow in space.flows if whole[flow.name] < UNBOUNDED_NS):
        total, steps = Fraction(0), [step for step in flow.steps if step.kind == "component"]
        for part in (part for chain in dict.fromkeys(map(chain_of, steps)) for part in least_cut(space, chain, view)):
            found = waits.of_part(part)
            assert found
            assert all(item.earlier_ns >= 0 and item.blocked_ns >= 0 for item in found)
            total += sum(item.response_ns for item in found)
        total += sum(Fraction(row.max_ns) for row in flow_rows(space, flow, view) if row.category != "thread")
        assert total == whole[flow.name]


def test_bounds_come_close_to_runs() -> None:
    """Else the tests above would say little: of every two bounds one is reached by drawn runs, or nearly."""
    ratios = []
    for seed in range(60):
        rng, core, space = drawn(seed)
        bounds = latencies(space, View(()))
        runs = [chained_callbacks.chains_played(core, rng) for _ in range(20)]
        for name in (item.name for item in core.callbacks if item.before is not None):
            longest = max(run.get(name, 0) for run in runs)
            if bounds[f"f_{name}"] < UNBOUNDED_NS and longest:
                ratios.append(bounds[f"f_{name}"] / (longest * MS))
    assert sorted(ratios)[len(ratios) // 2] < Fraction(5, 4)


def test_what_has_begun_is_told() -> None:
    space = space_of(HEAD + MORE.replace("LEVEL", "3"))
    solution = solution_of(space, View(()))
    (flow,) = space.flows
    (part,) = least_cut(space, chain_of(flow.steps[0]), View(()))
    (wait,) = Waits(space, solution.system, solution.ends).of_part(part) or ()
    assert (wait.name, wait.blocked_by, wait.blocked_ns) == ("a, b", "x", 2 * 5 * MS)
    assert [(delay.name, delay.jobs) for delay in wait.delays] == [("t", 1)]


def test_a_group_takes_its_next_job_before_what_one_sends_is_there() -> None:
    """Two jobs below the level hold up a chain of two callbacks, one before each."""
    text = (HEAD + BEGUN.replace("LEVEL", "1")).replace("40 ms", "100 ms")
    result = dse.simulate(text, runs=400, seed=3, offsets="random", execution="max")
    (flow,) = result.flows
    assert flow.worst is not None and 7 * MS < flow.worst.latency_ns <= 10 * MS


@pytest.mark.parametrize("seed", cases(20, 30_000))
def test_fronts_of_open_kinds_and_cores(seed: int) -> None:
    """Their bounds on the latency of each chain are those that a simulation with the design stays below."""
    core = replace(chained_callbacks.draw(random.Random(seed)), is_open=True)
    name = core.callbacks[-1].name
    more = chained_callbacks.flows_of(core) + f"\nobjectives: [minimise latency of f_{name}]"
    problem = dse.loads(chained_callbacks.text_of(core, more=more))
    result = dse.solve(problem, workers=1)
    assert dse.verify(result, problem=problem, method="model").status == "verified"
    if result.front:
        assert dse.simulate(problem, result.front[0].decisions, runs=4).exit_code == 0
