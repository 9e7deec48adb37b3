"""Threads that may dispatch each other in a cycle: fronts of the other designs, as the oracle finds them.

Threads that take no time, equal times, and executors of one thread are among them.
"""

from __future__ import annotations

import random
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.search.front import search_front
from dse.support.errors import ProblemError, TooLargeError
from tests.helpers.effort import cases
from tests.properties.pair import Pair
from tests.properties.test_against_oracle import figures_agree, fronts_agree

PROTOCOLS = ("periodic", "aperiodic", "hybrid", "sporadic")
FEEDBACK = """
dse: 1
name: feedback
processing: response_time
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
devices: {s: {period: 50 ms}}
threads:
  t0: {processor: c, compute_execution_time: 0 us .. 8858 us}
  t1: {processor: c, dispatch_protocol: [periodic, aperiodic], period: 20 ms, compute_execution_time: 585 us}
  t2: {}
connections: {c0: {from: s, to: t0}, c2: {from: t2, to: t1}, c4: {from: t1, to: t2}}
flows: {f: {path: [s, t0]}}
objectives: [minimise response time of t0]
"""
"""Where events dispatch t1 it and t2 release each other, for ever."""
HYBRID = """
dse: 1
name: a callback that its own timer releases
processing: response_time
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
threads:
  t0: {processor: c, compute_execution_time: 1 ms, priority: 2}
  t2: {processor: c, dispatch_protocol: hybrid, period: 50 ms, compute_execution_time: 3 ms,
       callback_execution_time: 1 ms, priority: 2}
connections: {z4: {from: t2, to: t0}, z5: {from: t0, to: t2}}
objectives: [minimise response time of t0]
"""


def draw(seed: int) -> str:
    """Up to five threads, some of which may be dispatched by events, and a connection backwards or two."""
    rng = random.Random(f"loops {seed}")
    number = rng.randint(2, 5)
    has_executor, is_used = rng.random() < 0.5, False
    threads = []
    for name in range(number):
        where = rng.choice(("processor: c, core: 1", "processor: d, core: 1", "processor: [c, d], core: 1"))
        if has_executor and rng.random() < 0.6:
            where, is_used = "executor: e", True
        least = rng.choice((0, 0, 1, 2))
        protocols = list(dict.fromkeys(["aperiodic", *rng.sample(PROTOCOLS, rng.choice((1, 2)))]))[rng.choice((0, 1)) :]
        fields = [where, f"compute_execution_time: {least} ms .. {least + rng.choice((0, 0, 1))} ms"]
        fields.append(f"dispatch_protocol: [{', '.join(protocols or PROTOCOLS[:1])}]")
        if protocols != ["aperiodic"]:
            fields.append(f"period: {rng.choice((8, 10, 20, 40))} ms")
        if "hybrid" in protocols:
            fields.append(f"callback_execution_time: {rng.choice((0, 1))} ms")
        threads.append(f"  t{name}: {{{', '.join(fields)}}}")
    wires = ["  w: {from: s, to: t0}"]
    wires += [f"  v{target}: {{from: t{rng.randrange(target)}, to: t{target}}}" for target in range(1, number)]
    for back in range(rng.choice((1, 1, 2))):
        last = rng.randrange(number)
        wires.append(f"  x{back}: {{from: t{last}, to: t{rng.randrange(last + 1)}}}")
    kinds = rng.sample(("fifo", "callback_group", "wait_set"), rng.choice((1, 2)))
    executors = [f"executors: {{e: {{kind: [{', '.join(kinds)}], processor: c, core: 1}}}}"] if is_used else []
    lines = [
        "dse: 1",
        f"name: loops {seed}",
        f"processing: {rng.choice(('response_time', 'response_time', 'execution_time'))}",
        f"overload: {rng.choice(('allowed', 'forbidden'))}",
        "deadlines: none",
        f"processor_types: {{P: {{}}, Q: {{cores: {rng.choice((1, 2))}, price: 5 EUR}}}}",
        "processors: {c: {type: [P, Q]}, d: {type: P}}",
        f"devices: {{s: {{period: {rng.choice((5, 10, 20))} ms, latency: 0 ms .. {rng.choice((0, 3, 12, 25))} ms}}}}",
        *executors,
        "threads:",
        *threads,
        "connections:",
        *wires,
        f"objectives: [minimise price, minimise response time of t{rng.randrange(number)}]",
    ]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("seed", cases(200))
def test_the_front_is_that_of_the_designs_without_a_cycle(seed: int) -> None:
    text = draw(seed)
    try:
        pair = Pair(text)
        figures_agree(pair)
        found = search_front(pair.evaluator)
    except ProblemError as error:  # none without a cycle
        assert "dispatch each other in a cycle" in str(error)
        return
    except TooLargeError:  # sums of response times without a bound
        return
    fronts_agree(pair, found.points)


@pytest.mark.parametrize("asked", ["minimise response time of t0", "minimise price"])
def test_every_command_leaves_out_the_designs_with_a_cycle(
    asked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("loop.yaml").write_text(FEEDBACK.replace("minimise response time of t0", asked))
    excluded = "dispatch each other in a cycle: t1 -> t2 -> t1"
    assert run(["check", "loop.yaml"]) == 0
    assert excluded in capsys.readouterr().out
    assert run(["solve", "loop.yaml", "--json", "result.json"]) == 0
    assert "complete, proved: 1 design" in capsys.readouterr().out
    assert run(["verify", "result.json"]) == 0
    assert run(["verify", "result.json", "--method", "exhaustion"]) == 0
    assert run(["explain", "loop.yaml"]) == 0
    sweep = ["sweep", "loop.yaml", "--no-store", "--workers", "1"]
    assert run([*sweep, "--vary", "threads.t1.compute_execution_time=1 ms,2 ms"]) == 0
    capsys.readouterr()
    cyclic = ["--design", "t1.dispatch_protocol = aperiodic"]
    assert run(["analyse", "loop.yaml", *cyclic]) == 4
    assert "dispatch each other in a cycle" in capsys.readouterr().out
    assert run(["simulate", "loop.yaml", *cyclic]) == 2


def test_what_a_timer_releases_closes_no_cycle() -> None:
    """1 ms, and 1 of the callback; the timer before it is over when it is released."""
    [point] = dse.solve(dse.loads(HYBRID)).front
    assert point.objectives == {"response time of t0": 2 * 10**6}
