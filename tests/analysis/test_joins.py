"""Joins of all: by hand, against every pattern of releases of tiny ones, the oracle, exhaustion and simulation."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import product
from typing import Literal

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import all_metrics, build_measure
from dse.analysis.scheduling.busy_window import Stream
from dse.analysis.scheduling.event_models import joined, looked_at
from dse.analysis.scheduling.fixed_point import solve
from dse.analysis.scheduling.resolve import resolve
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.views import View
from tests.helpers.effort import cases
from tests.helpers.joins import draw_join
from tests.helpers.support import brute_front
from tests.oracle.evaluator import designs, evaluate, load_text

MS = 10**6
METHODS: tuple[Literal["model", "exhaustion"], ...] = ("model", "exhaustion")
FUSION = """
dse: 1
name: fusion of three inputs
processor_types: {pc: {}}
processors: {pc: {type: pc}}
clocks: {ptp: {}}
devices:
  lidar: {period: 100 ms, latency: 0 ms .. 20 ms}
  cam_l: {period: 100 ms, latency: 0 ms .. 80 ms}
  cam_r: {period: 100 ms, latency: 0 ms .. 80 ms}
threads:
  fusion: {processor: pc, join: all, dispatch_protocol: aperiodic, compute_execution_time: 10 ms .. 30 ms}
connections:
  l: {from: lidar, to: fusion}
  a: {from: cam_l, to: fusion}
  b: {from: cam_r, to: fusion}
flows: {lidar_path: {path: [lidar, fusion]}, cam_path: {path: [cam_l, fusion]}}
processing: execution_time
"""
ON_ONE_CLOCK = tuple((f"{name}: {{", f"{name}: {{clock: ptp, offset: 0 ms, ") for name in ("lidar", "cam_l", "cam_r"))


def changed(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


def ranges_ms(text: str) -> dict[str, tuple[float, float | None]]:
    """The least and the greatest latency of each flow of the only design, in ms; None without a bound."""
    found = {}
    for flow in dse.analyse(dse.loads(text)).flows:
        least, most = sum(row.min_ns for row in flow.rows), sum(row.max_ns for row in flow.rows)
        found[flow.name] = float(least) / 10**6, None if most >= UNBOUNDED_NS else float(most) / 10**6
    return found


def figure(text: str, name: str) -> Fraction:
    space = dse.loads(text).space
    view = View(Evaluator(space).evaluate((0,) * len(space.decisions)).design)
    return next(build_measure(space, item).value(view) for item in all_metrics(space) if item.name == name)


@pytest.mark.parametrize(
    ("changes", "lidar_ms"),
    [
        ((), (10, 210)),
        (ON_ONE_CLOCK, (10, 110)),
        (ON_ONE_CLOCK[:2], (10, 210)),
        ((*ON_ONE_CLOCK, ("clocks: {ptp: {}}", "clocks: {ptp: {synchronisation_error: 1 ms}}")), (10, 111)),
        ((*ON_ONE_CLOCK, ("cam_l: {clock: ptp, offset: 0 ms", "cam_l: {clock: ptp, offset: 30 ms")), (40, 140)),
        ((("join: all", "join: all, pairing: latest"),), (10, 20 + 180 + 30)),
        ((("join: all", "join: all, queue_size: 2"),), (10, 210)),  # room enough: 180 ms are less than 2 periods
        ((("join: all", "join: all, queue_size: 1"),), (10, 20 + 180 + 30)),
        ((*ON_ONE_CLOCK, ("join: all", "join: all, pairing: latest")), (10, 110)),
        ((("cam_r: {period: 100 ms", "cam_r: {period: 200 ms"),), (10, None)),
        ((("cam_r: {period: 100 ms", "cam_r: {period: 200 ms"), ("join: all", "join: all, queue_size: 3")),
         (10, 20 + 3 * 280 + 30)),
        ((("cam_r: {period: 100 ms", "cam_r: {period: 50 ms"),), (10, 210)),  # faster: its own queue grows
        ((("join: all", "join: any"),), (10, 50)),
    ],
)  # fmt: skip
def test_a_message_waits_for_the_others(
    changes: Sequence[tuple[str, str]], lidar_ms: tuple[float, float | None]
) -> None:
    assert ranges_ms(changed(FUSION, *changes))["lidar_path"] == lidar_ms


@pytest.mark.parametrize(
    ("changes", "lidar_ms"),
    [
        ((), (10, 210)),
        (ON_ONE_CLOCK, (10, 110)),
        ((("join: all", "join: all, queue_size: 2"),), (10, 210)),
        ((("join: all", "join: all, pairing: latest"),), (10, 20 + 180 + 40)),
        ((("threads:", "threads:\n  other: {processor: pc, period: 50 ms, compute_execution_time: 5 ms}"),), (10, 215)),
    ],
)
def test_a_job_that_is_released_late_waits_for_none_before_it(
    changes: Sequence[tuple[str, str]], lidar_ms: tuple[float, float]
) -> None:
    """The thread responds within 40 ms, but that job has been released up to 80 ms before the latest time."""
    text = changed(FUSION, ("processing: execution_time", "processing: response_time"), *changes)
    assert ranges_ms(text)["lidar_path"] == lidar_ms


@pytest.mark.parametrize(("urgency", "most_ms"), [(1, 20 + 160 + 68), (3, 20 + 160 + 38)])
def test_what_follows_a_join_counts_from_its_latest_release_too(urgency: int, most_ms: float) -> None:
    """A less urgent thread waits for the next job of the join too, which may be released 20 ms after a late one."""
    text = changed(
        FUSION,
        ("clocks: {ptp: {}}\n", ""),
        ("  fusion: {", "  fusion: {priority: 2, "),
        ("processing: execution_time", "processing: response_time"),
        (
            "connections:",
            f"  plan: {{priority: {urgency}, processor: pc, compute_execution_time: 8 ms}}\nconnections:",
        ),
        ("flows:", "  c: {from: fusion, to: plan}\nflows:"),
        ("[lidar, fusion]", "[lidar, fusion, plan]"),
    )
    assert ranges_ms(text)["lidar_path"] == (18, most_ms)
    assert not dse.simulate(dse.loads(text), {}, runs=40, seed=1).contradictions


def test_an_explanation_tells_no_wait_that_a_flow_does_not_count() -> None:
    text = changed(FUSION, ("processing: execution_time", "processing: response_time"))
    other = "  other: {processor: pc, period: 50 ms, compute_execution_time: 5 ms}\nconnections:"
    text = changed(text, ("connections:", other)) + "requirements: [latency of lidar_path <= 150 ms]\n"
    ((_, example),) = dse.explain(dse.loads(text)).conflicts[0].members
    ((waiting,),) = (item.waiting for item in example.delayed)
    assert (waiting.threads, waiting.waited_ns, [item.waited_ns for item in waiting.waits]) == (
        ("fusion",),
        5_000_000,
        [5_000_000],
    )


def test_the_faster_input_has_no_bound_where_nothing_is_dropped() -> None:
    text = changed(FUSION, ("cam_r: {period: 100 ms", "cam_r: {period: 50 ms"), ("[cam_l, fusion]", "[cam_r, fusion]"))
    assert ranges_ms(text) == {"lidar_path": (10, 210), "cam_path": (10, None)}
    (remark,) = (text for text in dse.analyse(dse.loads(text)).warnings if "without a bound" in text)
    assert "messages of b wait at fusion" in remark and "20 Hz" in remark and "10 Hz" in remark


def test_a_join_runs_at_the_rate_of_the_slowest() -> None:
    assert figure(FUSION, "utilisation of pc") == 300_000
    assert figure(FUSION.replace("join: all", "join: any"), "utilisation of pc") == 900_000
    slow = changed(FUSION, ("cam_r: {period: 100 ms", "cam_r: {period: 200 ms"))
    assert figure(slow, "utilisation of pc") == 150_000


def test_a_fork_that_is_joined_again_waits_for_the_longer_way() -> None:
    text = changed(
        FUSION,
        ("  fusion", "  long: {dispatch_protocol: aperiodic, compute_execution_time: 5 ms .. 40 ms}\n  fusion"),
        ("a: {from: cam_l", "s: {from: lidar, to: long}\n  a: {from: long"),
        ("  b: {from: cam_r, to: fusion}\n", ""),
        ("[cam_l, fusion]", "[lidar, long, fusion]"),
    )
    assert ranges_ms(text) == {"lidar_path": (10, 90), "cam_path": (15, 90)}


def test_a_sporadic_thread_says_that_it_drops() -> None:
    text = FUSION.replace(
        "join: all, dispatch_protocol: aperiodic", "join: any, dispatch_protocol: sporadic, period: 50 ms"
    )
    (remark,) = (text for text in dse.analyse(dse.loads(text)).warnings if "drops" in text)
    assert remark == "fusion drops messages: they come at 30 Hz, and it is sporadic, at most 20 Hz"
    joined = text.replace("join: any", "join: all")
    assert not any("drops" in text for text in dse.analyse(dse.loads(joined)).warnings)


HYBRID = """
dse: 1
name: odometry of two encoders
processor_types: {pc: {}}
processors: {pc: {type: pc}}
devices:
  left: {period: 20 ms, latency: 0 ms .. 1 ms}
  right: {period: 20 ms, latency: 0 ms .. 2 ms}
threads:
  odometry: {processor: pc, join: all, dispatch_protocol: hybrid, period: 10 ms,
             callback_execution_time: 1 ms, compute_execution_time: 2 ms}
  ekf: {processor: pc, dispatch_protocol: aperiodic, compute_execution_time: 2 ms}
connections:
  l: {from: left, to: odometry}
  r: {from: right, to: odometry}
  o: {from: odometry, to: ekf}
flows: {f: {path: [left, odometry, ekf]}}
processing: execution_time
"""


def test_a_timer_goes_on_at_its_first_release_after_all_have_come() -> None:
    """Listing 4.3: the callbacks of both encoders accumulate, the timer publishes or waits another period."""
    assert ranges_ms(HYBRID) == {"f": (1 + 2 + 2, 1 + 1 + 22 + 10 + 2 + 2)}
    assert figure(HYBRID, "utilisation of pc") == 2 * 50_000 + 100_000 + 100_000  # callbacks, 2 ms and 2 ms at 50 Hz
    fast = HYBRID.replace("left: {period: 20 ms", "left: {period: 5 ms")
    assert ranges_ms(fast) == ranges_ms(HYBRID)


SLOW_INPUTS = """
dse: 1
name: odometry of two slow encoders
processing: response_time
processor_types: {pc: {cores: 2}}
processors: {pc: {type: pc}}
devices:
  left: {period: 100 ms, latency: 0 ms .. 2 ms}
  right: {period: 100 ms, latency: 0 ms .. 2 ms}
threads:
  odometry: {processor: pc, core: 1, dispatch_protocol: hybrid, period: 10 ms, join: all,
             callback_execution_time: 1 ms, compute_execution_time: 1 ms .. 2 ms}
  after: {processor: pc, core: 2, dispatch_protocol: aperiodic, compute_execution_time: 10 ms .. 33 ms}
connections:
  l: {from: left, to: odometry}
  r: {from: right, to: odometry}
  o: {from: odometry, to: after}
flows: {f: {path: [left, odometry, after]}}
"""


def test_a_timer_that_waits_for_its_inputs_releases_what_follows_as_often_as_they_come() -> None:
    """A thread of 33 ms behind a timer of 10 ms whose inputs come every 100 ms."""
    system = solve(resolve(dse.loads(SLOW_INPUTS).space, View(())))
    tasks = {key: system.windows.events.task((key, "thread")) for key in (2, 3)}
    assert tasks[2] is not None
    assert (tasks[2].streams, tasks[2].separation_ns) == ((Stream(100 * MS, 13 * MS),), 10 * MS)
    assert tasks[3] is not None
    assert tasks[3].streams == (Stream(100 * MS, 16 * MS),)
    assert system.ends[3, "thread"] == 33 * MS
    assert figure(SLOW_INPUTS, "latency of f") == 2 * MS + 2 * MS + 103 * MS + 10 * MS + 4 * MS + 33 * MS


def test_a_hybrid_join_looks_at_no_room_and_no_order() -> None:
    text = changed(
        SLOW_INPUTS,
        ("join: all,", "join: all, pairing: fifo,"),
        ("left, to: odometry}", "left, to: odometry, queue_size: 3}"),
    )
    remark = (
        "l.queue_size, odometry.pairing: not counted, for the timer of the hybrid thread odometry takes all "
        "messages that have come since it published last"
    )
    assert remark in dse.check(dse.loads(text)).remarks
    assert not any("not counted, for" in item for item in dse.check(dse.loads(SLOW_INPUTS)).remarks)


def pairing_remarks(text: str) -> list[str]:
    """The remarks of `check` on joins that pair messages in the order of their arrival."""
    return [item for item in dse.check(dse.loads(text)).remarks if "in the order of arrival" in item]


def test_drift_is_remarked_on_between_clocks_and_unknown_offsets_on_one() -> None:
    begin = "fusion pairs messages in the order of arrival, and lidar, cam_l, cam_r run on "
    (drift,) = pairing_remarks(FUSION)
    assert drift.startswith(f"{begin}clocks of their own: ")
    on_one_clock = [(old, new.replace("offset: 0 ms, ", "")) for old, new in ON_ONE_CLOCK]
    assert pairing_remarks(changed(FUSION, *on_one_clock)) == [
        f"{begin}one clock with unknown offsets; stating each `offset` may shorten the wait for inputs"
    ]
    assert not pairing_remarks(changed(FUSION, *ON_ONE_CLOCK))


def test_the_period_of_the_timer_alone_does_not_bound_the_jitter_of_jobs() -> None:
    """Of inputs of different rates: one of 100 waits for one of 99 up to 98, then that one waits for it."""
    arrivals = [range(0, 11_000, 100), range(98, 11_000, 99)]
    jobs = published(arrivals, range(11_000), is_early=True)
    assert jobs[98] - jobs[0] == 98 * 99
    (stream,) = looked_at([(Stream(100),), (Stream(99),)], [True, True], 1)
    assert stream == Stream(100, 100)
    (stream,) = looked_at([(Stream(100),), (Stream(30),)], [True, True], 1)
    assert stream == Stream(100, 31)


# --- against every pattern --------------------------------------------------------------------------------------------


def played(arrivals: Sequence[Sequence[int]], room: int | None) -> Iterator[tuple[int, int, int, int]]:
    """For each message that is taken, or lives on in one: its input and number, when it came, when a job took it."""
    events = sorted((time, which, number) for which, times in enumerate(arrivals) for number, time in enumerate(times))
    held: list[deque[list[tuple[int, int]]]] = [deque() for _ in arrivals]
    for time, which, number in events:
        held[which].append([(number, time)])
        if room is not None and len(held[which]) > room:
            dropped = held[which].popleft()
            held[which][0] += dropped
        if all(held):
            for other, queue in enumerate(held):
                yield from ((other, number, came, time) for number, came in queue.popleft())


def patterns(period: int, jitter: int, count: int, least: int = 0) -> Iterator[list[int]]:
    """Every way in which messages may come, one in each period and in their order."""
    for late in product(range(jitter + 1), repeat=count):
        times = [least + number * period + more for number, more in enumerate(late)]
        if times == sorted(times):
            yield times


def phases(periods: Sequence[int]) -> Iterator[tuple[int, int]]:
    """How much later than the system the timers begin: within a period."""
    yield from ((0, later) for later in range(periods[1] + 1))
    yield from ((later, 0) for later in range(1, periods[0] + 1))


@pytest.mark.parametrize("room", [None, 1, 2])
@pytest.mark.parametrize(
    ("periods", "jitters"), [((3, 3), (1, 2)), ((2, 2), (0, 3)), ((2, 4), (1, 1)), ((3, 4), (0, 2))]
)
def test_no_pattern_of_messages_waits_longer(
    periods: tuple[int, int], jitters: tuple[int, int], room: int | None
) -> None:
    """And in order the longest wait is reached."""
    lidar, camera = (
        f"{{period: {time} ms, latency: 0 ms .. {late}" for time, late in zip(periods, jitters, strict=True)
    )
    text = changed(
        FUSION,
        ("lidar: {period: 100 ms, latency: 0 ms .. 20", f"lidar: {lidar}"),
        ("cam_l: {period: 100 ms, latency: 0 ms .. 80", f"cam_l: {camera}"),
        ("  b: {from: cam_r, to: fusion}\n", ""),
        ("join: all", "join: all" if room is None else f"join: all, queue_size: {room}"),
        ("10 ms .. 30 ms", "0 ms"),
    )  # fmt: skip
    bounds = list(ranges_ms(text).values())
    seen = [0, 0]
    for later in phases(periods):
        ways = [list(patterns(*given)) for given in zip(periods, jitters, (4, 4), later, strict=True)]
        for one, other in product(*ways):
            begun = max(one[0], other[0])
            for which, number, came, taken in played((one, other), room):
                if room is None or came > begun:  # what waits for a system that starts is another matter
                    seen[which] = max(seen[which], taken - number * periods[which] - later[which])
    for most, (_, bound) in zip(seen, bounds, strict=True):
        assert bound is None or most <= bound
        if room is None and bound is not None and periods[0] == periods[1]:
            assert most == bound


@pytest.mark.parametrize("room", [None, 1, 2])
@pytest.mark.parametrize(("periods", "jitters"), [((3, 3), (1, 2)), ((2, 4), (1, 1)), ((2, 3), (0, 2))])
def test_no_pattern_releases_more_jobs(periods: tuple[int, int], jitters: tuple[int, int], room: int | None) -> None:
    ways = [(Stream(period, jitter),) for period, jitter in zip(periods, jitters, strict=True)]
    streams = joined(ways, [room, room])
    assert streams is not None
    for later in phases(periods):
        drawn = [list(patterns(*given)) for given in zip(periods, jitters, (4, 4), later, strict=True)]
        for one, other in product(*drawn):
            jobs = sorted({taken for *_, taken in played((one, other), room)})
            for first, begin in enumerate(jobs):
                for last in range(first, len(jobs)):
                    window = jobs[last] - begin + 1  # half-open, just behind the last
                    most = sum(-(-(window + item.jitter_ns) // item.period_ns) for item in streams)
                    assert last - first + 1 <= most


def published(arrivals: Sequence[Sequence[int]], ticks: Iterable[int], *, is_early: bool) -> list[int]:
    """When a timer finds a message of each input, which it takes; if `is_early` also one that comes just then."""
    taken, found = [0] * len(arrivals), list[int]()
    for tick in ticks:
        there = [sum(time < tick or (is_early and time == tick) for time in times) for times in arrivals]
        if all(now > before for now, before in zip(there, taken, strict=True)):
            taken = there
            found.append(tick)
    return found


@pytest.mark.parametrize("period", [1, 2, 3, 5])
@pytest.mark.parametrize(
    ("periods", "jitters"), [((3, 3), (1, 2)), ((2, 4), (1, 1)), ((2, 3), (0, 2)), ((4, 5), (0, 0)), ((3, 5), (1, 1))]
)
def test_no_pattern_publishes_more_often(periods: tuple[int, int], jitters: tuple[int, int], period: int) -> None:
    """Of a hybrid thread that waits for all of its inputs, steady ones or not."""
    ways = [(Stream(period, jitter),) for period, jitter in zip(periods, jitters, strict=True)]
    known = [looked_at(ways, [is_steady] * 2, period) for is_steady in (False, True)]
    closest = dict[int, int]()  # the shortest time of so many jobs
    for later in phases(periods):
        drawn = [list(patterns(*given)) for given in zip(periods, jitters, (4, 4), later, strict=True)]
        for one, other in product(*drawn):
            last = min(one[-1], other[-1])
            for phase, is_early in product(range(period), (False, True)):
                jobs = published((one, other), range(phase, last + 1, period), is_early=is_early)
                for count in range(2, len(jobs) + 1):
                    spans = (jobs[place + count - 1] - jobs[place] for place in range(len(jobs) - count + 1))
                    closest[count] = min(closest.get(count, 10**9), *spans, 10**9)
    assert closest
    for count, span in closest.items():
        assert span >= (count - 1) * period
        for streams in known:
            assert count <= sum(-(-(span + 1 + item.jitter_ns) // item.period_ns) for item in streams)


# --- drawn ------------------------------------------------------------------------------------------------------------

KEYS = {"latency": "max", "min latency": "min", "jitter": "jitter", "run jitter": "run", "reaction time": "reaction"}
KEYS["data age"] = "age"


@pytest.mark.parametrize("seed", cases(60))
def test_figures_are_those_of_the_oracle(seed: int) -> None:
    text = draw_join(seed, options=True)
    problem, space = load_text(text), dse.loads(text).space
    evaluator = Evaluator(space)
    for design in designs(problem):
        figures = evaluate(problem, design)
        options = [item.options.index(design[item.name]) if design.get(item.name) else 0 for item in space.decisions]
        view = View(evaluator.evaluate(tuple(options)).design)
        for metric in all_metrics(space):
            name, value = metric.name.rpartition(" of ")[2], build_measure(space, metric).value(view)
            if metric.kind in KEYS:
                expected = figures["flows"][name][KEYS[metric.kind]]
                assert value == expected or min(value, expected) >= UNBOUNDED_NS, (design, metric.name, text)
            elif metric.kind == "utilisation":
                assert value == figures["utilisation"][name] * 10**6, (design, metric.name, text)


@pytest.mark.parametrize("seed", cases(30, 1_000))
def test_fronts_are_those_of_all_designs(seed: int) -> None:
    """And proved again by looking at every design, and by the second model."""
    problem = dse.loads(draw_join(seed, options=True))
    result = dse.solve(problem, workers=1)
    assert result.status in ("complete", "infeasible")
    found = {tuple(point.objectives.values()) for point in result.front}
    assert found == set(brute_front(Evaluator(problem.space))), draw_join(seed, options=True)
    for method in METHODS:
        proved = dse.verify(result, problem=problem, method=method)
        assert (proved.status, proved.findings, proved.left_open) == ("verified", (), ()), seed


@pytest.mark.parametrize("seed", cases(60, 2_000))
def test_no_run_takes_longer(seed: int) -> None:
    text = draw_join(seed)
    problem = dse.loads(text)
    for contention in (True,) if "response_time" in text else (False,):
        found = dse.simulate(
            problem,
            {},
            runs=4,
            contention=contention,
            seed=seed,
            drift_ppm=500 * (seed % 2),
            endless_queues=seed % 3 == 0,
        )
        assert not found.contradictions, (text, found.contradictions)
