"""Data in a port that does not dispatch wait for the next dispatch: by hand, and never longer in simulation."""

from __future__ import annotations

import random
from fractions import Fraction
from pathlib import Path
from typing import Literal

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from tests.helpers.effort import cases
from tests.helpers.support import brute_front

METHODS: tuple[Literal["model", "exhaustion"], ...] = ("model", "exhaustion")
STORED = """
dse: 1
name: stored
processor_types: {pc: {cores: 4}}
bus_types: {can: {virtual: true, transmission_time: {fixed: 1 ms .. 3 ms}}}
buses: {b: {type: can}}
processors: {pc: {type: pc}}
devices:
  camera: {period: 100 ms}
  tick: {period: 50 ms}
  motor: {}
threads:
  store: {processor: pc, core: 1, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  wake: {processor: pc, core: 2, dispatch_protocol: aperiodic, compute_execution_time: 2 ms .. 5 ms}
  send: {processor: pc, core: 3, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections:
  image: {from: camera, to: store}
  stored: {from: store, to: send, port: data}
  beat: {from: tick, to: wake}
  drive: {from: wake, to: send}
  out: {from: send, to: motor}
flows: {f: {path: [camera, store, stored, send, motor]}}
objectives: [minimise latency of f]
"""


def range_ms(text: str, processing: str = "execution_time") -> tuple[float, float | None]:
    """The least and the greatest latency of the only design, in ms; None without a bound."""
    (found,) = dse.analyse(dse.loads(text), processing=processing).flows
    least, most = sum(row.min_ns for row in found.rows), sum(row.max_ns for row in found.rows)
    return float(least) / 10**6, None if most >= UNBOUNDED_NS else float(most) / 10**6


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
@pytest.mark.parametrize(
    ("change", "most_ms"),
    [
        (("name: stored", "name: a period, and what the thread between takes more or less"), 2 + 50 + 3),
        (("drive: {from: wake", "drive: {bus: b, data_size: 1 B, from: wake"), 2 + 50 + 3 + 2),
        (("send: {processor: pc, core: 3, dispatch_protocol: aperiodic",
          "send: {processor: pc, core: 3, dispatch_protocol: sporadic, period: 20 ms"), 2 + 50 + 3),
        (("send: {processor: pc, core: 3, dispatch_protocol: aperiodic",
          "send: {processor: pc, core: 3, dispatch_protocol: sporadic, period: 60 ms"), 2 + 50 + 3 + 60),
        (("drive: {from: wake, to: send}", "drive: {from: wake, to: send}\n  soon: {from: quick, to: send}"), 2 + 7),
        (("drive: {from: wake, to: send}", "drive: {to: send, rate: 40 Hz}"), 2 + 25),
        (("wake: {processor: pc, core: 2,", "wake: {processor: pc, core: 2, response_time: 9 ms,"), 2 + 50 + 7),
        (("wake: {processor: pc, core: 2, dispatch_protocol: aperiodic",
          "wake: {processor: pc, core: 2, dispatch_protocol: hybrid, period: 30 ms"), 2 + 30 + 3),
    ],
)  # fmt: skip
def test_data_wait_for_the_longest_time_between_two_dispatches(
    change: tuple[str, str], most_ms: float, processing: str
) -> None:
    text = STORED.replace("  motor: {}", "  motor: {}\n  quick: {period: 7 ms}").replace(*change)
    busy_ms = 2 if processing == "response_time" else 1  # of two messages one may wait for the job of the other
    more_ms = 2 * busy_ms - 1 if "soon" in text else 0  # one that comes while a job runs is lost
    assert range_ms(text, processing) == (2, most_ms + more_ms)


def test_a_port_that_dispatches_adds_nothing() -> None:
    assert range_ms(STORED.replace(", port: data", "")) == (2, 2)


def test_what_dispatch_trigger_leaves_out_waits() -> None:
    text = STORED.replace(", port: data", "").replace(
        "send: {processor: pc, core: 3,", "send: {processor: pc, core: 3, dispatch_trigger: [drive],"
    )
    assert range_ms(text) == (2, 55)


def test_a_device_that_nothing_dispatches_takes_what_comes() -> None:
    text = STORED.replace(", port: data", "").replace("to: motor}", "to: motor, port: data}")
    assert range_ms(text) == (2, 2)


def test_a_dispatcher_without_a_bound_leaves_none() -> None:
    """A thread that is late without a bound dispatches at any time."""
    other = (
        "  other: {processor: pc, core: 2, period: 10 ms, priority: 9, compute_execution_time: 10 ms, deadline: 1 s}"
    )
    full = STORED.replace("2 ms .. 5 ms}", f"2 ms .. 5 ms, deadline: 1 s}}\n{other}")
    text = full.replace("wake: {", "wake: {priority: 1, ") + "overload: allowed\n"
    assert range_ms(text)[1] == 55
    assert range_ms(text, "response_time")[1] is None


def drawn(seed: int) -> str:
    """Chains whose parts pass data by ports that dispatch or do not; protocols, periods and cores open."""
    rng = random.Random(seed)
    lines = ["dse: 1", f"name: stored {seed}", "processor_types: {pc: {cores: 2, price: 1 EUR}}"]
    lines += ["bus_types: {can: {virtual: true, transmission_time: {fixed: 1 ms .. 2 ms}}}", "buses: {b: {type: can}}"]
    lines += [
        "processors: {pc: {type: pc}}",
        "devices:",
        "  s: {period: [20 ms, 30 ms]}",
        "  u: {period: 40 ms}",
        "  v: {period: 33 ms}",
        "threads:",
    ]
    names = ["s"]
    wires, path = [], ["s"]
    for number in range(rng.randint(2, 4)):
        name = f"t{number}"
        protocol = rng.choice(["aperiodic", "sporadic", "[periodic, aperiodic]", "hybrid", "[sporadic, periodic]"])
        timed = "" if protocol == "aperiodic" else f", period: {rng.choice(['10 ms', '40 ms', '[20 ms, 50 ms]'])}"
        core = rng.choice(["1", "2", "[1, 2]"])
        time = rng.choice(["1 ms", "1 ms .. 3 ms", "[1 ms, 2 ms .. 3 ms]"])
        callback = ", callback_execution_time: 1 ms" if protocol == "hybrid" else ""
        lines.append(f"  {name}: {{processor: pc, core: {core}, dispatch_protocol: {protocol}{timed}, "
                     f"compute_execution_time: {time}{callback}, deadline: 1 s}}")  # fmt: skip
        bus = rng.choice(["", ", bus: b, data_size: 1 B"])
        is_stored = rng.random() < 0.6
        wires.append(f"  w{number}: {{from: {names[-1]}, to: {name}{bus}{', port: data' if is_stored else ''}}}")
        other = rng.choice(["u", *names])
        if is_stored or rng.random() < 0.3:
            wires.append(f"  d{number}: {{from: {other}, to: {name}}}")
        if is_stored and rng.random() < 0.5:  # a second dispatcher, of which a job makes the other lose messages
            wires.append(f"  e{number}: {{from: {rng.choice(['u', 'v'])}, to: {name}}}")
        path += [f"w{number}", name]
        names.append(name)
    lines += ["connections:", *wires, f"flows: {{f: {{path: [{', '.join(path)}]}}}}"]
    lines += [f"requirements: [latency of f <= {rng.choice([60, 120, 400])} ms]", "overload: allowed"]
    first = rng.choice(["latency", "jitter", "reaction time", "exact latency"])
    lines += [f"objectives: [minimise {first} of f, minimise data age of f]"]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
@pytest.mark.parametrize("seed", cases(10, 400))
def test_fronts_are_those_of_all_designs(seed: int, processing: str) -> None:
    """And proved again by looking at every design, and by the second model."""
    problem = dse.loads(drawn(seed) + f"processing: {processing}\n")
    result = dse.solve(problem, workers=1)
    expected = brute_front(Evaluator(problem.space))
    assert result.status in ("complete", "infeasible")
    assert {tuple(point.objectives.values()) for point in result.front} == set(expected), drawn(seed)
    for method in METHODS:
        proved = dse.verify(result, problem=problem, method=method)
        assert (proved.status, proved.findings, proved.left_open) == ("verified", (), ()), drawn(seed)


@pytest.mark.parametrize("seed", cases(10, 2_000))
def test_no_run_takes_longer(seed: int) -> None:
    problem = dse.loads(drawn(seed).replace("requirements: ", "# ") + "processing: response_time\n")
    rng = random.Random(seed)
    for _ in range(2):
        chosen = {item.name: str(rng.choice(item.options)) for item in problem.space.decisions if item.is_open}
        found = dse.simulate(problem, chosen, runs=20, seed=seed)
        assert not found.contradictions, (drawn(seed), chosen, found.contradictions)


FRACTIONS_ELSEWHERE = """
dse: 1
name: the dispatch takes parts of a nanosecond
processor_types: {p: {cores: 2}}
bus_types: {b: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 1 us, per_byte: 1.25 ns .. 3.75 ns}}}
processors: {cpu: {type: p}}
buses: {wire: {type: b}}
devices: {gnss: {period: 7 ms, compute_execution_time: 1 ms}}
threads:
  driver: {processor: cpu, dispatch_protocol: aperiodic, dispatch_trigger: [tick], compute_execution_time: 1 ms}
  nav: {processor: cpu, period: [5 ms, 10 ms], compute_execution_time: 1 ms}
connections:
  fix: {from: gnss, to: driver, data_size: 8 B}
  tick: {to: driver, data_size: 3 B, rate: 100 Hz, bus: wire}
  pose: {from: driver, to: nav}
flows: {f: {path: [gnss, driver, nav]}}
objectives: [minimise jitter of f, minimise utilisation of cpu]
"""


def test_times_of_what_dispatches_count_in_their_own_parts_of_a_nanosecond(tmp_path: Path) -> None:
    """Ticks come 10 ms apart, and 3 times 2.5 ns later at most: 10 000 007.5 ns."""
    path = tmp_path / "fractions.yaml"
    path.write_text(FRACTIONS_ELSEWHERE, encoding="utf-8")
    result = dse.solve(path)
    assert [point.metrics["jitter of f"] for point in result.front] == [
        Fraction(30_000_015, 2),
        Fraction(40_000_015, 2),
    ]
