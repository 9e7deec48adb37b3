"""Executors: one OS thread for the jobs of several threads (random systems with them are in the other files)."""

from __future__ import annotations

import random

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.busy_window import Stream, Task, periodic
from dse.analysis.scheduling.policies import executor_work
from dse.analysis.scheduling.policies.executors import Fellow
from dse.analysis.scheduling.responses import processor_responses
from dse.analysis.validity import canonical
from dse.analysis.views import View
from dse.examples.shipped import example_path
from dse.questions.problem import load, loads
from dse.search.front import SearchLimits, search_front
from dse.space.model.space import INACTIVE
from dse.spec.kinds import ExecutorKind
from dse.support.errors import ProblemError
from tests.helpers.effort import cases
from tests.helpers.support import brute_front, raw_designs, space_of
from tests.helpers.windows import queued_response_ns

MS = 10**6
FILE = """
dse: 1
name: node
deadlines: all
processor_types: {{cpu: {{cores: {cores}}}}}
processors: {{p: {{type: cpu}}}}
executors:
  node: {{kind: {kind}, processor: p{more}}}
threads:
  timer: {{executor: node, period: 10 ms, compute_execution_time: 1 ms}}
  callback: {{executor: node, period: 20 ms, compute_execution_time: 3 ms{inner}}}
  other: {{processor: p, period: 5 ms, compute_execution_time: 2 ms{other}}}
objectives: [minimise power]
"""


def responses_ms(kind: str, more: str = "", inner: str = "", other: str = ", priority: 9") -> dict[str, float | None]:
    space = space_of(FILE.format(kind=kind, more=more, inner=inner, other=other, cores=1))
    found = processor_responses(space, 0, View([0] * len(space.decisions)))
    return {item.name: None if item.response_ns is None else float(item.response_ns) / MS for item in found}


EQUAL = """
dse: 1
name: an executor and a thread of one priority
overload: allowed
processor_types: {A: {}}
processors: {p: {type: A}}
executors: {e0: {kind: callback_group, processor: p, core: 1, priority: 4}}
threads:
  t0: {executor: e0, period: 20 ms, compute_execution_time: 3 ms}
  t1: {executor: e0, dispatch_protocol: aperiodic, compute_execution_time: 1 ms .. 2 ms}
  t2: {executor: e0, dispatch_protocol: aperiodic, compute_execution_time: 2 ms}
  t3: {executor: e0, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  t4: {executor: e0, dispatch_protocol: aperiodic, compute_execution_time: 1 ms .. 3 ms}
  o0: {executor: e0, period: 20 ms, compute_execution_time: 2 ms}
  o1: {core: 1, priority: 4, processor: p, period: 5 ms, compute_execution_time: 1 ms}
  o2: {executor: e0, period: 5 ms, compute_execution_time: 1 ms}
connections: {c1: {from: t0, to: t1}, c2: {from: t1, to: t2}, c3: {from: t2, to: t3}, c4: {from: t3, to: t4}}
flows: {f: {path: [t0, t1, t2, t3, t4]}}
"""


def test_what_a_thread_of_equal_priority_has_waited_for_goes_first() -> None:
    """Jobs of the executor hold up o1, of which two go before o2: 6 ms are seen."""
    problem = dse.loads(EQUAL)
    seen = dse.simulate(problem, {}, runs=24, seed=329)
    assert not seen.contradictions
    assert max(item.observed_ns for item in seen.tasks if item.name == "o2") == 6 * 10**6
    assert {item.name: item.response_ns for item in dse.analyse(problem).responses["p"]}["o2"] is None


def test_the_example_of_the_document() -> None:
    """docs/semantics.md, section 4.6."""
    assert responses_ms("fifo") == {"other": 2, "timer": 8, "callback": 8}
    timer, callback = periodic("timer", 1, 10), periodic("callback", 3, 20)
    assert queued_response_ns("callback_group", timer, [Fellow(callback, False)], []) == 4
    assert queued_response_ns("fifo", callback, [Fellow(timer, True)], []) == 4


def test_a_callback_never_waits_for_more_than_one_job_of_its_own_timer() -> None:
    """Behind one that has begun, also beside another thread of its number: 1 (low) + 2 (other) + 0.6 of its own."""
    space = space_of("""
dse: 1
name: a hybrid thread and another of one number, one less urgent
processor_types: {A: {}}
processors: {p: {type: A}}
executors: {e: {kind: callback_group, processor: p, core: 1}}
threads:
  low: {executor: e, period: 5 ms, compute_execution_time: 1 ms}
  other: {executor: e, priority: 2, period: 10 ms, compute_execution_time: 2 ms}
  h: {executor: e, priority: 2, dispatch_protocol: hybrid, period: 20 ms, callback_execution_time: 600 us,
      compute_execution_time: 100 us}
connections: {c: {from: low, to: h}}
objectives: [minimise response time of h]
""")
    found = processor_responses(space, 0, View([0] * len(space.decisions)))
    assert {item.name: item.response_ns for item in found}["h (callback)"] == 3_600_000


def test_an_executor_goes_by_its_fastest_thread_or_its_number() -> None:
    """The node at 10 ms goes after `other` at 5 ms; with a number of its own before it, and without jobs between."""
    assert responses_ms("fifo", other="")["other"] == 2
    assert responses_ms("fifo", more=", priority: 10") == {"timer": 4, "callback": 4, "other": 6}
    assert responses_ms("fifo", other=", deadline: 30 ms")["other"] == 2


@pytest.mark.parametrize("seed", cases(1500))
def test_jobs_after_a_hyperperiod_respond_no_later(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearly full executors, with jitter over several periods, what preempts them, and less urgent work before."""
    rng = random.Random(seed)
    periods = rng.choice(((40, 60, 80, 120), (30, 50, 60, 100), (12, 18, 24), (70, 110, 20)))
    parts = [rng.random() + 0.1 for _ in range(rng.randint(2, 5) + rng.choice((0, 0, 1, 2)))]
    full = rng.choice((0.8, 0.95, 0.99, 1.0)) / sum(parts)

    def drawn(part: float) -> Task:
        period = rng.choice(periods)
        streams = [Stream(period, rng.choice((0, 0, rng.randint(0, 3 * period))))]
        if rng.random() < 0.15:
            streams.append(Stream(rng.choice(periods), rng.randint(0, 20)))
        separation = rng.choice(periods) if rng.random() < 0.05 else None
        return Task("x", max(1, int(full * part * period)), tuple(streams), separation)

    task, *others = (drawn(part) for part in parts)
    inside = rng.randint(1, len(others))
    kinds: tuple[ExecutorKind, ...] = ("fifo", "callback_group", "wait_set")
    asked = (
        rng.choice(kinds),
        task,
        [Fellow(item, rng.random() < 0.6) for item in others[:inside]],
        others[inside:],
        rng.choice((0, 0, rng.randint(1, 30))),
    )
    monkeypatch.setattr(executor_work, "STEPS_BEFORE_REPETITION", 1)
    found = queued_response_ns(*asked)
    monkeypatch.setattr(executor_work, "STEPS_BEFORE_REPETITION", 10**9)
    assert queued_response_ns(*asked) == found


def test_priorities_in_a_callback_group() -> None:
    """The callback first: 3 + 2 * 2; the timer then waits for it as a whole, whether it has begun or not."""
    assert responses_ms("callback_group", inner=", priority: 1") == {"other": 2, "timer": 8, "callback": 8}
    timer, slow, quick = periodic("timer", 2, 20), periodic("slow", 5, 40), periodic("quick", 1, 4)
    assert queued_response_ns("callback_group", quick, [Fellow(timer, False), Fellow(slow, False)], []) == 6
    # the timer starts at 6, when slow has run and quick for the first and second time; a quick one at 8 waits
    assert queued_response_ns("callback_group", timer, [Fellow(quick, True), Fellow(slow, False)], []) == 9


def test_later_jobs_of_a_busy_period_count() -> None:
    """A full core: C starts at 4, and what comes at 5 waits for it (compare Davis and others, Real-Time Systems 35)."""
    a, b, c = periodic("A", 2, 5), periodic("B", 2, 7), periodic("C", 2, 7)
    one = queued_response_ns("callback_group", a, [Fellow(b, False), Fellow(c, False)], [])
    two = queued_response_ns("callback_group", b, [Fellow(a, True), Fellow(c, False)], [])
    three = queued_response_ns("callback_group", c, [Fellow(a, True), Fellow(b, True)], [])
    assert (one, two, three) == (4, 6, 7)


def test_fifo_under_jitter_and_without_bound() -> None:
    late = Task("late", 2, (Stream(10, 5),))
    assert queued_response_ns("fifo", periodic("a", 1, 20), [Fellow(late, False)], []) == 3
    assert queued_response_ns("fifo", periodic("a", 5, 10), [Fellow(periodic("b", 6, 10), False)], []) is None
    assert queued_response_ns("callback_group", periodic("a", 5, 10), [Fellow(periodic("b", 6, 10), False)], []) == 11
    assert queued_response_ns("wait_set", periodic("a", 5, 10), [Fellow(periodic("b", 2, 10), False)], []) == 7


@pytest.mark.parametrize(("kind", "timer"), [("callback_group", 4), ("fifo", None), ("wait_set", None)])
def test_a_callback_without_a_bound_delays_its_group_by_one_job(kind: str, timer: float | None) -> None:
    """An overloaded core releases `callback` however it likes: a job of 3 ms may have begun before the timer's 1 ms."""
    text = FILE.replace("{{cores: {cores}}}", "{{cores: 2}}").replace("callback: {{executor: node, period: 20 ms",
        "callback: {{executor: node")  # fmt: skip
    text = text.replace("other: {{processor: p,", "other: {{processor: p, core: 2,").replace(
        ", processor: p{more}", ", core: 1, processor: p"
    )
    text = text.format(kind=kind, inner="", other="").replace("deadlines: all", "overload: allowed\ndeadlines: none")
    text = text.replace("objectives:", "  late: {processor: p, core: 2, period: 20 ms, compute_execution_time: 19 ms}\n"
        "connections: {w: {from: late, to: callback}}\nobjectives:")  # fmt: skip
    space = space_of(text)
    found = {item.name: item.response_ns for item in processor_responses(space, 0, View([0] * len(space.decisions)))}
    assert found["callback"] is None and found["timer"] == (None if timer is None else timer * MS)
    simulated = dse.simulate(loads(text), runs=2)
    assert not simulated.contradictions


@pytest.mark.parametrize("kind", ["fifo", "callback_group", "wait_set"])
def test_threads_of_an_executor_share_a_core(kind: str) -> None:
    problem = loads(FILE.format(kind=kind, more="", inner="", other="", cores=2))
    assert [item.name for item in problem.space.decisions if item.is_open] == ["node.core", "other.core"]
    apart = dse.solve(problem, require=["node.core != other.core"])
    [design] = apart.front
    found = dse.analyse(problem, design.decisions, response_times=True).responses["p"]
    assert {item.executor: item.core for item in found} == {"node": 1, "": 2}
    full = FILE.replace("1 ms}}", "6 ms}}").replace("3 ms{inner}", "9 ms{inner}").replace("deadlines: all", "")
    whole = dse.solve(loads(full.format(kind=kind, more="", inner="", other="", cores=2)))
    assert whole.status == "infeasible", "6 / 10 and 9 / 20 do not fit on one core, although they do on two"


def test_what_the_shipped_example_says() -> None:
    """The timer of 2.8 ms waits for 1.9 ms and 1.6 ms of the others: 6.3 ms; behind what has begun alone 4.7 ms."""
    problem = load(example_path("ekf_node"))
    found = dse.analyse(problem).responses["computer"]
    assert [float(item.response_ns or 0) / MS for item in found] == [6.3, 6.3, 6.3, 9.7]
    grouped = dse.analyse(problem, {"ekf_fusion.kind": "callback_group"}).responses["computer"]
    assert [float(item.response_ns or 0) / MS for item in grouped][:1] == [4.7]
    result = dse.solve(problem)
    assert (result.status, len(result.front)) == ("complete", 6)
    assert {point.decisions["ekf_fusion.kind"] for point in result.front} == {"callback_group"}
    assert not dse.simulate(problem, runs=8).contradictions


def test_a_core_of_an_executor_can_be_stated_listed_and_ruled() -> None:
    text = FILE.format(kind="fifo", more=", core: [1, 2]", inner="", other=", core: 1", cores=2)
    [point] = dse.solve(loads(text + "rules: [node.core == 2]\n")).front
    assert point.decisions["node.core"] == "2"
    with pytest.raises(ProblemError, match="core 3 does not exist"):
        loads(text.replace("[1, 2]", "3"))


GROUPS = FILE.replace(
    "executors:", "executors:\n  second: {{kind: [fifo, wait_set], processor: p, priority: 3}}"
).replace("callback: {{executor: node", "callback: {{executor: [node, second]")


def test_which_group_a_callback_is_in_is_a_decision() -> None:
    """A timer that has 3 ms shares its OS thread with no callback of 3 ms; what shares one has its core."""
    text = GROUPS.format(kind="fifo", more="", inner="", other="", cores=2).replace("1 ms}", "1 ms, deadline: 3 ms}")
    problem = loads(text)
    names = [item.name for item in problem.space.decisions if item.is_open]
    assert names == ["callback.executor", "second.kind", "node.core", "second.core", "other.core"]
    result = dse.solve(problem)
    assert [point.decisions["callback.executor"] for point in result.front] == ["second"]
    assert dse.solve(problem, require=["callback.executor == node"]).status == "infeasible"
    relaxed = loads(text.replace(", deadline: 3 ms", ", deadline: 4 ms"))
    [point] = dse.solve(relaxed, require=["callback.executor == node", "node.core == 2"]).front
    found = dse.analyse(relaxed, point.decisions, response_times=True).responses["p"]
    assert {item.name: (item.executor, item.core) for item in found if item.executor} == {
        "timer": ("node", 2),
        "callback": ("node", 2),
    }
    assert not dse.simulate(relaxed, point.decisions, runs=4).contradictions
    assert "callback: {executor: second" in dse.export(result, 1, "problem").replace('"', "")


def test_an_executor_without_threads_decides_nothing() -> None:
    """Neither its kind nor its core: 2 x 2 cores where the callback is beside the timer, 2 x 2 x 2 x 2 where it is not.

    What a rule says of it does not apply then.
    """
    problem = loads(GROUPS.format(kind="fifo", more="", inner="", other="", cores=2))
    designs = {canonical(problem.space, design) for design in raw_designs(problem.space)}
    where, kind, core = ([item.name for item in problem.space.decisions].index(name)
                         for name in ("callback.executor", "second.kind", "second.core"))  # fmt: skip
    beside = [design for design in designs if design[where] == 0]
    assert (len(designs), len(beside)) == (20, 4)
    assert {(design[kind], design[core]) for design in beside} == {(INACTIVE, INACTIVE)}
    [point] = dse.solve(problem, fix=["callback.executor = node"], require=["second.kind != fifo"]).front
    assert "second.kind" not in point.decisions
    assert dse.solve(problem, fix=["callback.executor = node"], require=["second.core == 2"]).front


def test_groups_on_several_computers_against_every_design() -> None:
    text = """
dse: 1
name: groups of two computers
deadlines: all
processing: response_time
processor_types: {cpu: {cores: 2, price: 10 EUR}, one: {cores: 1, price: 4 EUR}}
processors: {p: {type: [cpu, one]}, q: {type: one, optional: true}}
executors:
  left: {kind: callback_group, processor: p}
  right: {kind: [fifo, wait_set], processor: [p, q], priority: 3}
devices: {s: {period: 5 ms}}
threads:
  a: {executor: left, period: 20 ms, compute_execution_time: 2 ms}
  b: {executor: [left, right], period: [40 ms, 20 ms], compute_execution_time: 10 ms}
  c: {executor: [right, left], period: 20 ms, compute_execution_time: {cpu: 1 ms, one: 4 ms}}
connections: {w: {from: s, to: b}, v: {from: b, to: c}}
flows: {f: {path: [s, b, c]}}
objectives: [minimise price, minimise latency of f]
rules: ["b.executor == left implies c.executor == right"]
"""
    evaluator = Evaluator(loads(text).space)
    search = search_front(evaluator, SearchLimits(workers=2))
    assert search.is_complete and set(search.points) == set(brute_front(evaluator))


def test_a_design_that_leaves_an_executor_empty_is_exported() -> None:
    """Fixed where it stands, the thread would leave an executor that no thread might run in, which is refused."""
    text = GROUPS.format(kind="fifo", more=", core: 1", inner="", other="", cores=1)
    alone = text.replace("timer: {executor: node", "timer: {executor: [second, node]")
    result = dse.solve(loads(alone), fix=["timer.executor = node", "callback.executor = node"])
    exported = dse.export(result, 1)
    [back] = dse.solve(loads(exported)).front
    assert (back.decisions["timer.executor"], back.decisions["callback.executor"]) == ("node", "node")


@pytest.mark.parametrize("home", ["executor: node", "reservation: node"])
def test_a_number_beside_an_executor_or_a_reservation_is_part_of_a_reason(home: str) -> None:
    """A thread is late where another goes first, not wherever they share a core."""
    text = f"""
dse: 1
name: numbers
deadlines: none
processor_types: {{cpu: {{cores: 1}}}}
processors: {{p: {{type: cpu}}}}
executors: {{node: {{kind: callback_group, processor: p, priority: 2}}}}
threads:
  first: {{period: 20 ms, compute_execution_time: 1 ms, processor: p, priority: [1, 3]}}
  late: {{period: 40 ms, compute_execution_time: 5 ms, {home}}}
objectives: [minimise price]
requirements: [response time of late <= 5500 us]
"""
    if home.startswith("reservation"):
        text = text.replace("executors", "reservations").replace(
            "kind: callback_group", "budget: 5 ms, period: 5500 us"
        )
        text = text.replace("late <= 5500 us", "late <= 6 ms")
    [point] = dse.solve(loads(text)).front
    assert point.decisions == {"first.priority": "1"}


def test_lines_behind_what_leaves_next_to_nothing_have_no_bound() -> None:
    """A job of 10 ms and one of 5 where 1 ns of each ms is left: more steps than are taken, and no error."""
    nearly_all = periodic("nearly all", 999_999, 1_000_000)
    one, other = periodic("one", 10_000_000, 10**15), periodic("other", 5_000_000, 10**15)
    assert (
        queued_response_ns("fifo", one, [Fellow(other, False, line=(1, "thread"))], [nearly_all], is_in_line=True)
        is None
    )


BESIDE_NOTHING = """
dse: 1
name: a thread beside one that takes no time
processing: response_time
overload: allowed
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
devices: {s: {period: 10 ms, latency: 0 ms .. 25 ms}}
executors: {e: {kind: KIND, processor: c}}
threads:
  work: {executor: e, compute_execution_time: 4 ms, dispatch_protocol: aperiodic, queue_size: 9}
  idle: {executor: e, compute_execution_time: TIME, period: 10 ms}
connections: {w: {from: s, to: work}}
flows: {f: {path: [s, work]}}
objectives: [minimise latency of f]
"""
"""Three jobs of work may come at once: up to 25 ms late, every 10 ms."""


@pytest.mark.parametrize("kind", ["fifo", "callback_group", "wait_set"])
@pytest.mark.parametrize(("time", "expected"), [("0 ms", 12_000_000), ("1 ns", 12_000_001)])
def test_earlier_jobs_count_beside_a_thread_that_takes_no_time(kind: str, time: str, expected: int) -> None:
    problem = loads(BESIDE_NOTHING.replace("KIND", kind).replace("TIME", time))
    found = {item.name: item.response_ns for item in dse.analyse(problem).responses["c"]}
    assert (found["work"], found["idle"]) == (expected, 0 if time == "0 ms" else found["idle"])
    lines = BESIDE_NOTHING.replace("KIND", kind).splitlines()
    without = "\n".join(line for line in lines if "  idle:" not in line)
    [single] = dse.analyse(loads(without)).responses["c"]
    assert single.response_ns == 12_000_000
    seen = dse.simulate(problem, runs=10)
    assert not seen.contradictions


def test_what_takes_no_time_responds_at_once_whatever_else_has_no_bound() -> None:
    """Late has no bound, and what it releases may come any number of times at once; a job of nothing is over then."""
    text = """
dse: 1
name: nothing to wait for
processing: response_time
overload: allowed
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
executors: {e: {kind: callback_group, processor: c}}
threads:
  late: {processor: c, priority: 9, compute_execution_time: 11 ms, period: 10 ms}
  marker: {executor: e, compute_execution_time: 0 ms}
  other: {processor: c, priority: 10, compute_execution_time: 1 ms, period: 10 ms}
connections: {w: {from: late, to: marker}}
objectives: [minimise price]
"""
    found = {item.name: item.response_ns for item in dse.analyse(loads(text)).responses["c"]}
    assert found == {"other": 1_000_000, "late": None, "marker": 0}
