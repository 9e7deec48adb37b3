"""Response times against the literature, against a simulation that shares no formula with them, and in the search."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction
from itertools import count, pairwise, takewhile

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling import busy_window
from dse.analysis.scheduling.busy_window import (
    Stream,
    Task,
    densest_releases_ns,
    load,
    most_jobs,
    periodic,
    response_time_ns,
)
from dse.analysis.scheduling.responses import UNBOUNDED_NS, processor_responses, response_of
from dse.analysis.views import View
from dse.encode.scheduling import waiting_forms
from dse.search.front import SearchLimits, search_front
from dse.simulation.engine import simulate_once
from dse.simulation.observing import Setting
from dse.simulation.plan import build_plan
from dse.space.model.space import INACTIVE, Space
from dse.space.question.reading import read_requirements
from dse.support.errors import ProblemError
from dse.support.units import Exact
from tests.helpers.effort import cases
from tests.helpers.support import brute_front, evaluated, space_of

MS = 10**6

# (execution, period) in order of priority, and the response times that the source gives.
PUBLISHED = {
    # A. Burns and A. Wellings, Real-Time Systems and Programming Languages, response time analysis, process set D
    "Burns and Wellings": ([(3, 7), (3, 12), (5, 20)], [3, 6, 20]),
    # J. P. Lehoczky, RTSS 1990, example 3: the fifth job is the worst
    "Lehoczky": ([(26, 70), (62, 100)], [26, 118]),
    # J. W. S. Liu, Real-Time Systems, 2000, section 6.5, time-demand analysis of four tasks (here in quarters)
    "Liu": ([(4, 12), (6, 20), (5, 28), (2, 36)], [4, 10, 19, 36]),
    # G. C. Buttazzo, Hard Real-Time Computing Systems, response time analysis, deadline monotonic order
    "Buttazzo": ([(1, 4), (1, 5), (2, 6), (1, 11)], [1, 2, 4, 10]),
    # test fp_fp_rta_basic of the crate response-time-analysis 0.3 (B. Brandenburg)
    "Brandenburg": ([(1, 4), (1, 5), (3, 9), (3, 18)], [1, 2, 7, 18]),
}


@pytest.mark.parametrize("source", PUBLISHED)
def test_published_response_times(source: str) -> None:
    figures, expected = PUBLISHED[source]
    tasks = [periodic(str(number), *figure) for number, figure in enumerate(figures)]
    assert [response_time_ns(task, tasks[:number]) for number, task in enumerate(tasks)] == expected


@pytest.mark.parametrize("source", PUBLISHED)
def test_published_response_times_are_observed_at_the_critical_instant(source: str) -> None:
    figures, expected = PUBLISHED[source]
    lines = [
        f"  t{rank}: {{processor: p, priority: {99 - rank}, period: {period} ms, compute_execution_time: {work} ms}}"
        for rank, (work, period) in enumerate(figures)
    ]
    space = space_of(ONE_CORE + "\n".join(lines) + "\n")
    assert [item.response_ns for item in processor_responses(space, 0, view_of(space))] == [
        value * MS for value in expected
    ]
    assert list(observed(space, 2000 * MS).values()) == [value * MS for value in expected]


ONE_CORE = "dse: 1\nname: x\nprocessor_types: {cpu: {}}\nprocessors: {p: {type: cpu}}\nthreads:\n"


def view_of(space: Space) -> View:
    return View([0] * len(space.decisions))


def observed(space: Space, duration_ns: int) -> dict[str, Exact]:
    """The longest responses when everything starts at once and always takes longest."""
    responses = processor_responses(space, 0, view_of(space))
    plan = build_plan(space, (0,) * len(space.decisions), cores={item.component: item.core for item in responses})
    seen = simulate_once(plan, Setting(duration_ns, duration_ns, execution="max")).responses
    return {item.name: seen[item.name] for item in responses}


@pytest.mark.parametrize("seed", range(60))
def test_periodic_threads_have_their_response_time_at_the_critical_instant(seed: int) -> None:
    """Exact, not just safe: also beyond the period, on several cores, with stated and rate-monotonic priorities."""
    rng = random.Random(seed)
    lines, load = [], 0.0
    cores = rng.randint(1, 2)
    priorities = rng.sample(range(9), 6)
    for number in range(rng.randint(2, 6)):
        period = rng.choice([4, 5, 6, 8, 10, 12, 15, 20, 30])
        work = rng.randint(1, period)
        if load + work / period > cores:
            continue
        load += work / period
        priority = f", priority: {priorities[number]}" if rng.random() < 0.4 else ""
        lines.append(f"  t{number}: {{processor: p, period: {period} ms, compute_execution_time: {work} ms{priority}}}")
    space = space_of(ONE_CORE.replace("{cpu: {}}", f"{{cpu: {{cores: {cores}}}}}") + "\n".join(lines) + "\n")
    responses = processor_responses(space, 0, view_of(space))
    overloaded = {item.core for item in responses if item.response_ns is None}
    seen = observed(space, 360 * MS)
    for item in responses:
        if item.core not in overloaded:
            assert seen[item.name] == item.response_ns, (item, lines)


EQUALS = """
  a: {processor: p, priority: 3, period: 10 ms, compute_execution_time: 2 ms}
  b: {processor: p, priority: 3, period: 15 ms, compute_execution_time: 4 ms}
  c: {processor: p, priority: 7, period: 30 ms, compute_execution_time: 3 ms}
  d: {processor: p, period: 60 ms, compute_execution_time: 1 ms}
"""


def test_threads_of_one_stated_priority_delay_each_other() -> None:
    """a: 2 + 4 + 3; b: 4 + 2 + 3; only c goes before both, whichever has the shorter period or stands first."""
    found = processor_responses(space := space_of(ONE_CORE + EQUALS), 0, view_of(space))
    assert [(item.name, item.rank, item.response_ns) for item in found] == [
        ("c", 1, 3 * MS), ("a", 2, 9 * MS), ("b", 2, 9 * MS), ("d", 4, 10 * MS),
    ]  # fmt: skip


def threads_of_two_levels(seed: int, last: int | None = None, *, chained: bool = False) -> tuple[str, int]:
    """Two to five threads of two priorities, thread `last` just behind those of its own; and how many they are."""
    rng = random.Random(seed)
    count = rng.randint(2, 5)
    lines = []
    for number in range(count):
        kind = rng.choice(("periodic", "hybrid", "sporadic")) if chained and number else "periodic"
        fields = f"processor: p, dispatch_protocol: {kind}, period: {rng.choice((20, 24, 30, 40))} ms, queue_size: 3"
        fields += f", priority: {2 * rng.randint(1, 2) - (number == last)}"
        fields += f", compute_execution_time: 1 ms .. {rng.randint(1, 5)} ms"
        fields += ", callback_execution_time: 1 ms" if kind == "hybrid" else ""
        lines.append(f"  t{number}: {{{fields}}}\n")
    wires = [f"  w{number}: {{from: t{number - 1}, to: t{number}}}\n" for number in range(1, count)]
    return ONE_CORE + "".join(lines) + ("connections:\n" + "".join(wires) if chained else ""), count


@pytest.mark.parametrize("seed", range(40))
def test_a_thread_among_equals_is_as_late_as_the_last_of_them(seed: int) -> None:
    text, count = threads_of_two_levels(seed)
    found = {item.component: item.response_ns for item in processor_responses(space_of(text), 0, View([]))}
    for number in range(count):
        moved = processor_responses(space_of(threads_of_two_levels(seed, number)[0]), 0, View([]))
        assert found[number] == next(item.response_ns for item in moved if item.component == number)


@pytest.mark.parametrize("seed", range(20))
def test_equals_in_the_order_of_their_release_stay_within_the_response_time(seed: int) -> None:
    """As under SCHED_FIFO, with hybrid and triggered threads among them and any offsets."""
    space = space_of(threads_of_two_levels(seed, chained=True)[0])
    responses, rng = processor_responses(space, 0, View([])), random.Random(seed)
    bounds = {item.name: item.response_ns for item in responses}
    plan = build_plan(space, (), cores={item.component: item.core for item in responses})
    for run in range(10):
        offsets = {name: rng.randrange(40) * MS * (run > 0) for name in plan.timers}
        seen = simulate_once(plan, Setting(1000 * MS, 1000 * MS, offsets, execution="max"))
        for name, observed_ns in seen.responses.items():
            bound = bounds[name]
            assert bound is None or observed_ns <= bound, (name, offsets)


def brute_releases(task: Task, most: int) -> list[int]:
    """Earliest releases by counting: time t is the n-th release when a window closed at t admits n jobs."""
    found: list[int] = []
    for time in count():
        found += [time] * (most_jobs(task, time + 1) - len(found))
        if len(found) >= most:
            return found[:most]
    raise AssertionError


@pytest.mark.parametrize("seed", range(30))
def test_releases_fit_the_count_of_jobs(seed: int) -> None:
    rng = random.Random(seed)
    streams = tuple(Stream(rng.randint(3, 20), rng.randint(0, 40)) for _ in range(rng.randint(1, 3)))
    task = Task("t", 1, streams, rng.choice([None, rng.randint(1, 15)]))
    releases = [time for time, _ in zip(densest_releases_ns(task), range(12), strict=False)]
    if task.separation_ns is None:
        assert releases == brute_releases(task, 12)
    for window in range(1, 60):
        assert sum(1 for _ in takewhile(lambda time: time < window, releases)) <= most_jobs(task, window)  # noqa: B023


def literal_response_ns(task: Task, rivals: list[Task]) -> Exact | None:
    """For each job of the busy period the least window that holds all work released in it, looked for one by one."""
    if task.worst_ns == 0:
        return 0
    if sum(item.utilisation for item in [task, *(rival for rival in rivals if rival.worst_ns)]) > 1:
        return None
    worst: Exact = 0
    window = 1
    for jobs, released in enumerate(densest_releases_ns(task), start=1):
        if window <= released:
            break
        while window < jobs * task.worst_ns + sum(most_jobs(item, window) * item.worst_ns for item in rivals):
            window += 1
        worst = max(worst, window - released)
    return worst


@pytest.mark.parametrize("seed", range(300))
def test_response_times_are_those_of_the_literal_recurrence(seed: int) -> None:
    """Several streams, jitter beyond the period, separations and tasks without a stream included."""
    rng = random.Random(seed)
    tasks = []
    for name in range(rng.randint(1, 5)):
        streams = [
            Stream(rng.randint(3, 40), rng.choice((0, rng.randint(0, 60)))) for _ in range(rng.choice((0, 1, 1, 2)))
        ]
        separation = rng.choice((None, None, rng.randint(3, 40)))
        tasks.append(Task(str(name), rng.randint(0, 8), tuple(streams), separation))
    assert response_time_ns(tasks[0], tasks[1:]) == literal_response_ns(tasks[0], tasks[1:])


def test_jobs_that_repeat_are_not_looked_at_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Close to full load a busy period has any number of jobs; the one that responds last is within a hyperperiod."""
    monkeypatch.setattr(busy_window, "JOBS_BEFORE_REPETITION", 1)
    cut = 0
    for seed in range(300):
        rng = random.Random(seed)
        periods = rng.choice(([4, 6, 8, 12], [5, 7, 9], [10, 20, 40]))
        tasks = [
            Task(str(name), rng.randint(1, 5), (Stream(rng.choice(periods), rng.choice((0, 3, 17, 300))),))
            for name in range(rng.randint(1, 3))
        ]
        load = sum(task.utilisation for task in tasks)
        if Fraction(4, 5) < load < 1:
            found = response_time_ns(tasks[0], tasks[1:])
            assert found == literal_response_ns(tasks[0], tasks[1:]), seed
            cut += found is not None and found > 100
    assert cut >= 10
    second = 10**9
    nearly = periodic("nearly", second - 1, second, second)
    assert response_time_ns(nearly, []) == 2 * (second - 1)


@pytest.mark.parametrize("seed", cases(100))
def test_a_load_is_on_the_side_of_a_full_core_where_its_exact_sum_is(seed: int) -> None:
    """Of hundreds of tasks whose shares make up a core, but for up to one step of the last of them."""
    rng = random.Random(seed)
    tasks, left, least = [], Fraction(1), 10 ** rng.randint(2, 12)
    for number in range(rng.randint(1, 300)):
        period = rng.randint(least, 10**12)
        worst = int(left * period / rng.randint(2, 40))
        tasks.append(Task(str(number), worst, (Stream(period),), rng.choice((None, period))))
        left -= Fraction(worst, period)
    for odd in (0, 1, -1):
        last = periodic("last", left.numerator * 10**15 + odd, left.denominator * 10**15)
        together = sum(task.utilisation for task in (*tasks, last))
        assert (together > 1, together == 1) == (odd > 0, odd == 0)
        assert (load([*tasks, last]) > 1, load([*tasks, last]) == 1) == (odd > 0, odd == 0)
    share = load(tasks)
    assert isinstance(share, float) or abs(share - 1) < Fraction(1, 10**8)
    assert abs(Fraction(share) - sum(task.utilisation for task in tasks)) < 1e-9


def test_release_jitter() -> None:
    """Audsley et al. 1993: w = C + sum ceil((w + J) / T) C; 3 + ceil((w + 6) / 10) * 4 has its fixed point at 11."""
    assert response_time_ns(periodic("low", 3, 100), [periodic("high", 4, 10, 6)]) == 11


def test_a_task_without_work_or_bound() -> None:
    assert response_time_ns(periodic("a", 0, 10), [periodic("b", 5, 10)]) == 0
    assert response_time_ns(periodic("a", 6, 10), [periodic("b", 5, 10)]) is None
    assert response_time_ns(periodic("a", 5, 10), [periodic("b", 5, 10)]) == 10
    assert response_time_ns(Task("a", 5, ()), [periodic("b", 5, 10)]) == 10


PIPELINE = """
dse: 1
name: pipeline
processor_types: {cpu: {}}
processors: {one: {type: cpu}, two: {type: cpu}}
threads:
  source: {processor: one, period: 10 ms, compute_execution_time: 1 ms .. 2 ms}
  busy: {processor: one, priority: 1, period: 20 ms, compute_execution_time: 4 ms}
  sink: {processor: two, dispatch_protocol: aperiodic, compute_execution_time: 3 ms}
  slow: {processor: two, period: 50 ms, compute_execution_time: 5 ms, deadline: 30 ms}
connections:
  wire: {from: source, to: sink, latency: 1 ms .. 3 ms}
flows: {main: {path: [source, sink]}}
"""


def test_jitter_is_inherited_from_processing_and_transmission() -> None:
    """4 for busy; source 4 + 2 = 6, jitter 6 - 1; sink jitter 5 + 2 = 7; slow 5 + 2 * 3 = 11 as ceil(18 / 10) = 2."""
    space = space_of(PIPELINE)
    view = view_of(space)
    assert [item.response_ns for item in processor_responses(space, 0, view)] == [4 * MS, 6 * MS]
    sink, slow = processor_responses(space, 1, view)
    assert sink.task.streams == (Stream(10 * MS, 7 * MS),)
    # the second job comes 3 ms after the first at the earliest, as the first one ends
    assert (sink.response_ns, slow.response_ns, slow.meets_deadline) == (3 * MS, 11 * MS, True)


def test_response_times_as_processing_of_a_flow() -> None:
    space = space_of(PIPELINE.replace("name: pipeline", "name: pipeline\nprocessing: response_time"))
    [latency] = read_requirements(space, "latency of main <= 1 s")
    evaluator = Evaluator(replace(space, requirements=(latency,)))
    [verdict] = evaluator.evaluate((0,) * len(space.decisions)).verdicts
    assert verdict.value == (6 + 3 + 3) * MS


def test_feedback_of_jitter_without_end_has_no_bound() -> None:
    """Each delays what releases the other: what keeps growing has no bound, and counts as a very long time."""
    text = """
dse: 1
name: loop
processor_types: {cpu: {}}
processors: {one: {type: cpu}, two: {type: cpu}}
threads:
  a1: {processor: one, period: 10 ms, priority: 1, compute_execution_time: 0 ms .. 5 ms}
  b1: {processor: two, period: 10 ms, priority: 1, compute_execution_time: 0 ms .. 5 ms}
  a2: {processor: two, priority: 2, compute_execution_time: 5 ms}
  b2: {processor: one, priority: 2, compute_execution_time: 5 ms}
connections: {a: {from: a1, to: a2}, b: {from: b1, to: b2}}
"""
    space = space_of(text)
    found = response_of(space, 0, "thread", view_of(space))
    assert found is not None and found.response_ns is None
    [requirement] = read_requirements(space, "response time of a1 <= 1 h")
    [verdict] = Evaluator(replace(space, requirements=(requirement,))).evaluate((0,) * len(space.decisions)).verdicts
    assert (verdict.holds, verdict.value) == (False, UNBOUNDED_NS)


DECISIONS = """
dse: 1
name: decisions
deadlines: all
processing: response_time
processor_types: {cpu: {cores: [1, 2], price: [5 EUR, 9 EUR]}, fast: {price: 20 EUR}}
processors: {p: {type: [cpu, fast]}}
threads:
  a: {processor: p, period: [5 ms, 7 ms], compute_execution_time: {cpu: 1 ms .. 3 ms, fast: 1 ms}}
  b: {processor: p, period: 12 ms, compute_execution_time: 3 ms, priority: [1, 9], core: [1, 2]}
  c: {processor: p, dispatch_protocol: [aperiodic, periodic], period: [20 ms, 24 ms], compute_execution_time: 4 ms,
      deadline: 15 ms}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}}
flows: {f: {path: [a, b, c]}}
requirements: [response time of a <= 6 ms]
objectives: [minimise latency of f, minimise price, minimise response time of c, minimise utilisation of p]
"""


def test_the_search_is_exact() -> None:
    """Requirement, deadlines, objective and processing time: the front is that of looking at every design."""
    space = space_of(DECISIONS)
    evaluator = Evaluator(space)
    search = search_front(evaluator, SearchLimits())
    expected = brute_front(evaluator)
    assert search.is_complete and search.points == expected and len(expected) > 1


@pytest.mark.parametrize("objectives", ["as they are", "maximised"])
def test_the_search_is_exact_where_response_times_are_sharpened_on_the_way(
    objectives: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    text = DECISIONS if objectives == "as they are" else DECISIONS.replace("minimise resp", "maximise resp")
    evaluator = Evaluator(space_of(text))
    search = search_front(evaluator, SearchLimits(workers=2))
    assert search.is_complete and search.points == brute_front(evaluator)


@pytest.mark.parametrize("seed", cases(6))
def test_the_search_is_exact_on_random_threads(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Random threads, cores, priorities and chains; requirements about half of which decide something."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    evaluator = Evaluator(space_of(random_threads(random.Random(seed))))
    search = search_front(evaluator, SearchLimits(seed=seed))
    assert search.is_complete and search.points == brute_front(evaluator)


def random_threads(rng: random.Random) -> str:
    """Three or four threads on one or two processors; some are triggered by the one before."""
    lines = []
    names = "abcd"[: rng.choice((3, 4))]
    for number, name in enumerate(names):
        fields = {"processor": rng.choice(("p", "q", "[p, q]")), "period": f"[{rng.randint(4, 9)} ms, 12 ms]"}
        fields["compute_execution_time"] = f"{rng.randint(0, 1)} ms .. {rng.randint(1, 3)} ms"
        if number and rng.random() < 0.5:
            fields["dispatch_protocol"] = rng.choice(("aperiodic", "[periodic, aperiodic]", "sporadic"))
        if rng.random() < 0.4:
            fields["priority"] = str(rng.randint(1, 3))
        if rng.random() < 0.3:
            fields["deadline"] = f"{rng.randint(5, 20)} ms"
        lines.append(f"  {name}: {{{', '.join(f'{key}: {value}' for key, value in fields.items())}}}")
    wires = [f"{one}{two}: {{from: {one}, to: {two}}}" for one, two in pairwise(names)]
    limits = [f"response time of {rng.choice(names)} <= {rng.randint(4, 12)} ms" for _ in range(rng.randint(0, 2))]
    if rng.random() < 0.3:
        limits.append(f"response time of {rng.choice(names)} >= {rng.randint(2, 5)} ms")
    return "\n".join(
        [
            f"dse: 1\nname: random\ndeadlines: {'all' if rng.random() < 0.5 else 'none'}",
            "processing: response_time",
            f"processor_types: {{cpu: {{cores: {rng.choice(('1', '2', '[1, 2]'))}, price: 5 EUR}}}}",
            "processors: {p: {type: cpu}, q: {type: cpu, optional: true}}",
            "threads:",
            *lines,
            f"connections: {{{', '.join(wires)}}}",
            f"flows: {{f: {{path: [{', '.join(names)}]}}}}",
            f"requirements: [{', '.join(limits)}]",
            f"objectives: [minimise {rng.choice(('latency', 'jitter'))} of f, minimise price]",
        ]
    )


def test_a_core_that_the_processor_lacks_is_no_design() -> None:
    space = space_of(DECISIONS)
    core, cores = space.decision_index("b.core"), space.decision_index("p.cores")
    assert core is not None and cores is not None
    said = "the core of b is one that its processor has"
    for design, evaluation in evaluated(Evaluator(space)).items():
        lacks = design[core] == 1 and design[cores] in (0, INACTIVE)
        assert (said in evaluation.breaches) == lacks


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (("core: [1, 2]", "core: 3"), "core 3 does not exist: there are 2 at most"),
        (("a <= 6 ms", "q <= 6 ms"), 'no thread or connection is called "q"'),
        (("a <= 6 ms", "a <= 6 EUR"), "no unit of response time of a"),
        (("{processor: p, period: 12 ms", "{period: 12 ms"), "a core needs a `processor`"),
    ],
)
def test_mistakes(edit: tuple[str, str], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        space_of(DECISIONS.replace(*edit))
