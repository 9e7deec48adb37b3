"""The simulation's own rules, and what it must and must not say of the analysis."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import dse
from dse.answers.simulation import Simulation
from dse.cli.main import run
from dse.questions.verbs.simulate import simulate
from dse.report.content.simulate import simulation_page
from dse.support.errors import UsageError
from tests.helpers.effort import LONG
from tests.helpers.small import quick

MS = 10**6
PROBLEMS = Path(__file__).parents[2] / "problems"

CHAIN = """
dse: 1
name: chain
processor_types: {cpu: {}}
processors: {p: {type: cpu}}
bus_types: {can: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 1 ms .. 2 ms, per_byte: 10 us}}}
buses: {b: {type: can}}
devices:
  sensor: {period: 30 ms, latency: 1 ms .. 4 ms}
threads:
  filter: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms .. 3 ms}
  control: {processor: p, period: 7 ms, compute_execution_time: 2 ms .. 3 ms}
connections:
  raw: {from: sensor, to: filter, data_size: 100 B, bus: b}
  clean: {from: filter, to: control, port: data}
flows: {main: {path: [sensor, filter, control]}}
processing: execution_time
"""


RIVAL = "  rival: {processor: p, priority: 9, period: 60 ms, compute_execution_time: 9 ms}\n"


def run_text(text: str, **options: object) -> Simulation:
    return simulate(dse.loads(text), **options)  # type: ignore[arg-type]


def test_best_and_worst_are_found_to_the_nanosecond() -> None:
    """Min 1 + (1 + 1) + 1 + 2; max 4 + (2 + 1) + 3 + 7 + 3, of which sampling misses by 1 ns at least."""
    [flow] = run_text(CHAIN, contention=False).flows
    assert flow.bounds_ns == (6 * MS, 20 * MS)
    assert (min(flow.latencies), max(flow.latencies)) == (6 * MS, 20 * MS - 1)
    assert not flow.outside and flow.worst is not None and flow.worst.latency_ns == 20 * MS - 1


def test_the_extremes_can_be_shown_again() -> None:
    from dse.simulation.engine import simulate_once
    from dse.simulation.observing import Setting
    from dse.simulation.plan import build_plan

    result = run_text(CHAIN, contention=False)
    worst = result.flows[0].worst
    assert worst is not None
    plan = build_plan(result.space, result.design)
    setting = Setting(10**9, 9 * 10**8, worst.offsets_ns, worst.drift_ppm, "max", seed=worst.seed)
    assert max(simulate_once(plan, setting).latencies[0]) == worst.latency_ns


def test_same_seed_same_bytes() -> None:
    one, other, third = (run_text(CHAIN, seed=seed, runs=8, drift_ppm=50).to_json() for seed in (1, 1, 2))
    assert one == other != third


def test_contention_exceeds_execution_times_and_response_times_hold() -> None:
    """A more urgent thread delays the flow beyond the additive bound, which is said; the response times contain it."""
    text = CHAIN.replace("  control:", RIVAL + "  control:")
    text = text.replace("period: 7 ms", "period: 20 ms")
    result = run_text(text, runs=60)
    [flow] = result.flows
    assert flow.scheduled_ns is not None and max(flow.latencies) > flow.bounds_ns[1]
    assert flow.outside and not result.contradictions
    first = simulation_page(result).sections[0].texts[0]
    assert f"{flow.outside} of {flow.count} latencies of main" in first and "No observation" not in first
    assert all(task.bound_ns is not None and task.observed_ns <= task.bound_ns for task in result.tasks)
    assert any(task.observed_ns == task.bound_ns for task in result.tasks)


def test_a_wrong_analysis_is_contradicted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Faults injected into the analysis: half the sampling, and a response time without interference."""
    from dse.analysis.latency import contributors
    from dse.analysis.latency.rows import Row

    original = contributors._sampling_row

    def halved(*arguments: object) -> Row | None:
        row = original(*arguments)  # type: ignore[arg-type]
        return row and Row(row.category, row.contributor, 0, row.min_method, row.max_ns // 2, row.max_method)

    monkeypatch.setattr(contributors, "_sampling_row", halved)
    result = run_text(CHAIN, contention=False)
    assert len(result.contradictions) == 1 and "flow main: observed 6000000" in result.contradictions[0]
    path = tmp_path / "chain.yaml"
    path.write_text(CHAIN)
    assert run(["simulate", str(path), "--no-contention", "--json", str(tmp_path / "out.json")]) == 4
    assert json.loads((tmp_path / "out.json").read_text())["flows"]["main"]["contradiction"] is True
    monkeypatch.undo()
    assert run(["simulate", str(path), "--no-contention"]) == 0


def test_a_wrong_response_time_is_contradicted(monkeypatch: pytest.MonkeyPatch) -> None:
    from dse.analysis.scheduling.policies import preemptive

    monkeypatch.setattr(preemptive, "response_time_ns", lambda task, *_: task.worst_ns)
    text = CHAIN.replace("  control:", RIVAL + "  control:")
    assert any("thread" in item for item in run_text(text, runs=60).contradictions)


QUEUE = """
dse: 1
name: queue
devices:
  fast: {period: 10 ms, latency: 1 ms .. 1 ms}
  faster: {period: 10 ms, latency: 1 ms}
threads:
  sink: {dispatch_protocol: aperiodic, compute_execution_time: 4 ms}
connections: {a: {from: fast, to: sink}, b: {from: faster, to: sink}}
flows: {main: {path: [fast, sink]}}
processing: execution_time
"""


@pytest.mark.parametrize(("size", "worst", "lost"), [(None, 5, True), (1, 9, False)])
def test_queues_hold_what_they_have_room_for(size: int | None, worst: int, lost: bool) -> None:
    """Two arrivals at once: without a place to wait one is lost, with one it waits for the other's 4 ms."""
    text = QUEUE if size is None else QUEUE.replace("4 ms}", f"4 ms, queue_size: {size}}}")
    result = run_text(text, offsets="zero", execution="max", contention=False)
    # the connection that comes first in the file arrives first, so that here it is the second one that waits
    flows = run_text(text.replace("path: [fast, sink]", "path: [faster, sink]"), offsets="zero", contention=False).flows
    assert bool(result.lost) == lost and not result.contradictions
    assert max(result.flows[0].latencies) == 5 * MS
    assert max(flows[0].latencies, default=5 * MS) == worst * MS
    assert flows[0].bounds_ns[1] >= worst * MS


@pytest.mark.parametrize("size", ["", ", queue_size: 1"])
def test_endless_queues_are_beyond_the_bounds_and_say_so(size: str) -> None:
    """Three arrivals at once: the third waits for two jobs, more than the sizes admit, whether one is stated or not."""
    text = QUEUE.replace("4 ms}", f"3 ms{size}}}").replace("path: [fast, sink]", "path: [fastest, sink]")
    text = text.replace("threads:", "  fastest: {period: 10 ms, latency: 1 ms}\nthreads:")
    text = text.replace("b: {from: faster, to: sink}", "b: {from: faster, to: sink}, c: {from: fastest, to: sink}")
    lost = run_text(text, offsets="zero", execution="max", contention=False)
    assert lost.lost and not lost.flows[0].outside
    endless = run_text(text, offsets="zero", execution="max", contention=False, endless_queues=True)
    [flow] = endless.flows
    assert not endless.lost and set(flow.latencies) == {10 * MS}
    assert flow.outside and not flow.is_contradiction and "queue" in flow.excuse
    assert (lost.exit_code, endless.exit_code, endless.contradictions) == (0, 4, ())
    assert endless.outside == (f"{flow.outside} of {flow.count} latencies of {flow.name} ({flow.excuse})",)
    assert endless.to_dict()["outside"] == list(endless.outside)


def test_a_sporadic_thread_keeps_its_separation() -> None:
    text = QUEUE.replace("aperiodic,", "sporadic, period: 25 ms,")
    result = run_text(text, offsets="zero", contention=False, runs=1, duration="1 s")
    [flow] = result.flows
    assert flow.count <= 1000 // 25 and not flow.outside
    assert any("sooner than its minimum separation" in name or "no room" in name for name in result.lost)


LATE = """
dse: 1
name: late
processor_types: {cpu: {}}
processors: {p: {type: cpu}}
devices: {source: {period: 10 ms, latency: 0 ms}}
threads:
  hog: {processor: p, priority: 9, period: 1 s, compute_execution_time: 9 ms}
  sink: {processor: p, dispatch_protocol: sporadic, period: 10 ms, queue_size: 1, compute_execution_time: 2 ms}
connections: {a: {from: source, to: sink}}
flows: {main: {path: [source, sink]}}
processing: execution_time
"""


def test_separation_counts_from_the_dispatch() -> None:
    """The first job waits for its core until 9 ms and ends at 11 ms, when the second is dispatched.

    The third follows at 21 ms, though its message came at 20 ms, and so on: 11 ms for the first datum, 3 ms for each of
    the others.
    """
    result = run_text(LATE, offsets="zero", execution="max", duration="300 ms")
    assert set(result.flows[0].latencies) == {11 * MS, 3 * MS}
    assert result.flows[0].latencies[11 * MS] == 1 and not result.lost


INSTANT = """
dse: 1
name: instant
devices:
  steady: {period: 10 ms, latency: 1 ms}
  once: {period: 1 s, latency: 6 ms}
threads:
  sink: {dispatch_protocol: sporadic, period: 10 ms, queue_size: 1, compute_execution_time: 2 ms}
connections: {a: {from: steady, to: sink}, b: {from: once, to: sink}}
flows: {main: {path: [steady, sink]}}
processing: execution_time
"""


def test_what_is_released_leaves_its_place_to_what_arrives_then() -> None:
    """The message of 6 ms is dispatched at 11 ms, when the next one arrives and takes its place in the queue."""
    result = run_text(INSTANT, offsets="zero", execution="max", contention=False, duration="900 ms")
    assert not result.lost
    assert set(result.flows[0].latencies) == {3 * MS, 13 * MS}


HYBRID = """
dse: 1
name: hybrid
devices: {source: {period: 10 ms, latency: 1 ms}}
threads:
  node: {dispatch_protocol: hybrid, period: 8 ms, compute_execution_time: 2 ms, callback_execution_time: 1 ms .. 3 ms}
connections: {a: {from: source, to: node}}
flows: {main: {path: [source, node]}}
processing: execution_time
"""


def test_a_hybrid_thread_stores_and_publishes() -> None:
    """1 + callback 1 .. 3 + sampling up to 8 + 2."""
    [flow] = run_text(HYBRID, contention=False).flows
    assert flow.bounds_ns == (4 * MS, 14 * MS)
    assert (min(flow.latencies), max(flow.latencies)) == (4 * MS, 14 * MS - 1)


def test_messages_wait_for_each_other_on_a_bus_when_told_so() -> None:
    text = CHAIN.replace("devices:\n", "devices:\n  noise: {period: 30 ms}\n").replace(
        "  clean:", "  other: {from: noise, data_size: 1000 B, bus: b}\n  clean:"
    )
    alone, together = (
        run_text(text, offsets="zero", execution="max", contention=False, bus_contention=flag).flows[0]
        for flag in (False, True)
    )
    assert not alone.outside and max(together.latencies) > max(alone.latencies)
    assert "buses" in together.excuse and not together.is_contradiction


def test_what_triggers_nothing_waits_within_its_bound() -> None:
    """Under OSATE's rules that wait is in no bound, and the gap is named."""
    text = QUEUE.replace("a: {from: fast, to: sink}", "a: {from: fast, to: sink, port: data}")
    [flow] = run_text(text, contention=False).flows
    assert not flow.outside and not flow.excuse
    found = run_text(text.replace("dse: 1", "dse: 1\nprofile: osate-2.19"), contention=False)
    [flow] = found.flows
    assert flow.outside and "a does not dispatch sink" in flow.excuse and not flow.is_contradiction
    assert found.exit_code == 4


TAKEN = """
dse: 1
name: a device that nothing dispatches
bus_types: {can: {bandwidth: 500 kbit/s, frame: can}}
buses: {can0: {type: can}}
devices: {source: {period: 10 ms}, slow: {period: 70 ms}, sink: {compute_execution_time: 1 ms .. 2 ms}, screen: {}}
connections:
  a: {from: source, to: sink, port: data, data_size: 8 B, bus: can0, identifier: 2}
  b: {from: slow, to: sink, port: data, data_size: 8 B, bus: can0, identifier: 1}
  shown: {from: sink, to: screen, port: data, rate: 20 Hz}
flows: {main: {path: [source, a, sink]}, other: {path: [slow, b, sink]}, own: {path: [sink, shown, screen]}}
"""


def test_a_device_that_nothing_dispatches_takes_data_when_they_come() -> None:
    """8 bytes take 216 to 270 us, and wait for one other message; then 1 to 2 ms, without a period of the sink."""
    found = run_text(TAKEN)
    for flow in found.flows[:2]:
        assert flow.bounds_ns == (1_216_000, 2_540_000) and flow.latencies and not flow.excuse
        assert flow.bounds_ns[0] <= min(flow.latencies) < max(flow.latencies) <= flow.bounds_ns[1]
    assert max(found.flows[0].latencies) > 2_400_000  # a frame has begun
    assert found.flows[2].latencies and not found.outside and not found.contradictions


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
def test_what_lies_outside_the_bounds_of_the_question_is_exit_code_4(processing: str) -> None:
    """Low waits 3 ms for high: outside a bound of execution times, and within that of response times."""
    text = f"""{{dse: 1, name: x, processing: {processing},
        processor_types: {{t: {{}}}}, processors: {{p: {{type: t}}}}, devices: {{s: {{period: 10 ms}}}},
        threads: {{low: {{processor: p, compute_execution_time: 2 ms, priority: 1}},
                  high: {{processor: p, period: 10 ms, compute_execution_time: 3 ms, priority: 2}}}},
        connections: {{w: {{from: s, to: low}}}}, flows: {{f: {{path: [s, low]}}}}}}"""
    found = dse.simulate(dse.loads(text))
    assert found.contradictions == ()
    assert bool(found.outside) == (processing == "execution_time")
    assert found.exit_code == (4 if found.outside else 0)


def test_drift_is_allowed_for() -> None:
    [flow] = run_text(CHAIN, offsets="random", runs=20, drift_ppm=10_000, contention=False).flows
    assert flow.allowance_ns >= 20 * MS // 100 and not flow.outside


def test_overload_is_said() -> None:
    text = CHAIN.replace("compute_execution_time: 2 ms .. 3 ms", "compute_execution_time: 8 ms")
    result = run_text(text, contention=False, runs=4)
    assert "control alone needs more than one core" in result.flows[0].excuse and result.notes


@pytest.mark.parametrize("contention", [True, False])
@pytest.mark.parametrize("path", sorted(PROBLEMS.glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_problems(path: Path, contention: bool) -> None:
    problem = dse.load(path)
    if not problem.space.flows or not problem.space.baseline:
        pytest.skip("no flow or no baseline")
    try:
        result = simulate(problem, runs=8 if LONG else 3, contention=contention)
    except UsageError as error:
        pytest.skip(str(error))
    assert not result.contradictions
    assert result.to_dict()["format"] == "dse-simulation/1"
    assert list(result.frame()["flow"]) == [flow.name for flow in problem.space.flows]


def test_the_robot_reaches_its_bounds() -> None:
    """The reported software chain of Table 5.7: three samplings short of 57.503 ms by a nanosecond each at most."""
    problem = quick(dse.load(PROBLEMS / "inmark.yaml"))
    result = simulate(problem, contention=False, runs=40 if LONG else 10)
    for flow in result.flows:
        assert min(flow.latencies) == flow.bounds_ns[0]
        assert flow.bounds_ns[1] - 3 <= max(flow.latencies) <= flow.bounds_ns[1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"duration": "5"}, "duration '5'"),
        ({"duration": "0 s"}, "must be positive"),
        ({"duration": "1e9 s"}, "give a shorter duration"),
        ({"runs": 0}, "expected a whole number from 1"),
        ({"drift_ppm": -1}, "drift"),
        ({"design": ["nav.period = 1 ms"]}, "nothing is called"),
    ],
)
def test_wrong_calls(options: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        run_text(CHAIN, **options)


def test_the_command_prints_tables(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "chain.yaml"
    path.write_text(CHAIN)
    assert run(["simulate", str(path), "--runs", "8", "--all"]) == 0
    printed = capsys.readouterr().out
    for text in ("Latencies of main", "Response times", "WITHIN BOUNDS", "reduced reaction time"):
        assert text in printed
    assert run(["simulate", str(path), "--runs", "4", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"] > 0
    assert run(["analyse", str(path), "--response-times"]) == 0
    assert "Response times on p" in capsys.readouterr().out


@pytest.mark.parametrize("profile", ["osate-2.19", "osate-2.2"])
@pytest.mark.parametrize("port", ["event", "event_data", "data"])
def test_what_osate_leaves_unsampled_is_excused(profile: str, port: str) -> None:
    """Today OSATE counts no sampling of events by a periodic thread; the simulation does."""
    text = CHAIN.replace("from: filter, to: control, port: data", f"from: filter, to: control, port: {port}")
    [flow] = run_text(f"{text}profile: {profile}\n", contention=False).flows
    assert not flow.is_contradiction
    assert ("counts no sampling of clean" in flow.excuse) == (profile == "osate-2.19" and port != "data")


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
def test_what_is_said_of_shared_cores_fits_what_the_bounds_count(processing: str) -> None:
    text = f"""{{dse: 1, name: x, processing: {processing},
        processor_types: {{t: {{}}}}, processors: {{p: {{type: t}}}},
        threads: {{a: {{processor: p, period: 10 ms, compute_execution_time: 2 ms}},
                  b: {{processor: p, period: 20 ms, compute_execution_time: 4 ms}}}},
        connections: {{w: {{from: a, to: b}}}}, flows: {{f: {{path: [a, b]}}}}}}"""
    [note] = dse.simulate(dse.loads(text)).notes
    assert ("can be exceeded" in note) is (processing == "execution_time")
