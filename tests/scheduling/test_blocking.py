"""What delays threads beside more urgent ones: non-preemptive sections, context switches, interrupts, throttling."""

from __future__ import annotations

import random

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.busy_window import periodic, response_time_ns
from dse.analysis.scheduling.responses import processor_responses
from dse.analysis.views import View
from dse.questions.problem import loads
from dse.report.words.contention import bound_words, overhead_words
from dse.simulation.engine import simulate_once
from dse.simulation.observing import Setting
from dse.simulation.plan import build_plan
from tests.helpers.effort import cases
from tests.helpers.support import space_of
from tests.helpers.thread_responses import responses
from tests.helpers.thread_systems import draw, every_choice, text_of

MS = 10**6
HEAD = (
    "dse: 1\nname: x\nprocessor_types: {{cpu: {{cores: 1{overheads}}}}}\nprocessors: {{p: {{type: cpu}}}}\nthreads:\n"
)


def responses_ms(threads: str, overheads: str = "") -> dict[str, float | None]:
    """The response time of each thread of one core, in ms; `overheads` are fields of its type."""
    lines = "\n".join(f"  {line.strip()}" for line in threads.strip().splitlines())
    space = space_of(HEAD.format(overheads=overheads) + lines + "\n")
    found = processor_responses(space, 0, View([0] * len(space.decisions)))
    return {item.name: None if item.response_ns is None else float(item.response_ns) / MS for item in found}


READY_AND_LOG = """
  ready: {processor: p, period: 10 ms, compute_execution_time: 2 ms}
  log: {processor: p, period: 40 ms, compute_execution_time: 6 ms, non_preemptive: 3 ms}
"""


def test_the_example_of_the_document() -> None:
    """docs/semantics.md, section 4.5."""
    assert responses_ms(READY_AND_LOG) == {"ready": 5, "log": 8}
    assert responses_ms(READY_AND_LOG, ", context_switch: 100 us") == {"ready": 5.2, "log": 8.4}


def test_interrupts_and_gaps_go_before_all() -> None:
    """log: 6 + 2 of ready + 1 of the tick in (0, 9]; throttled by 1 in 20: 10 ms, the next ready and tick at 10."""
    tick = ", interrupts: {tick: {compute_execution_time: 500 us .. 1 ms, period: 10 ms}}"
    assert responses_ms(READY_AND_LOG, tick) == {"ready": 6, "log": 9}
    throttled = ", throttling: {budget: 19 ms, period: 20 ms}"
    assert responses_ms(READY_AND_LOG, tick + throttled) == {"ready": 7, "log": 10}
    assert responses_ms(READY_AND_LOG, ", throttling: {budget: 20 ms, period: 20 ms}") == {"ready": 5, "log": 8}


def test_a_section_is_no_longer_than_its_job_and_blocks_only_what_is_more_urgent() -> None:
    threads = """
    a: {processor: p, period: 10 ms, compute_execution_time: 1 ms, non_preemptive: 1 s}
    b: {processor: p, period: 20 ms, compute_execution_time: 2 ms, non_preemptive: 1 s}
    c: {processor: p, period: 40 ms, compute_execution_time: 3 ms, non_preemptive: 2 ms}
    """
    assert responses_ms(threads) == {"a": 3, "b": 5, "c": 6}


def test_equals_and_the_timer_of_a_hybrid_thread() -> None:
    """A and b wait for each other as wholes; the callback of h is blocked by its own timer, and not delayed by it."""
    threads = """
    a: {processor: p, period: 20 ms, priority: 1, compute_execution_time: 1 ms, non_preemptive: 1 ms}
    b: {processor: p, period: 20 ms, priority: 1, compute_execution_time: 2 ms, non_preemptive: 2 ms}
    """
    assert responses_ms(threads) == {"a": 3, "b": 3}
    hybrid = """
  h: {processor: p, dispatch_protocol: hybrid, period: 20 ms, compute_execution_time: 4 ms,
       callback_execution_time: 1 ms, non_preemptive: 3 ms}
"""
    space = space_of(HEAD.format(overheads="") + hybrid + "connections: {w: {to: h, rate: 50 Hz, data_size: 1 B}}\n")
    found = processor_responses(space, 0, View([0] * len(space.decisions)))
    assert {item.name: item.response_ns for item in found} == {"h (callback)": 4 * MS, "h": 5 * MS}


def test_a_busy_period_that_begins_with_blocking_and_fills_its_core_has_no_end() -> None:
    half = periodic("a", 5, 10)
    assert response_time_ns(half, [periodic("b", 5, 10)]) == 10
    assert response_time_ns(half, [periodic("b", 5, 10)], 1) is None


@pytest.mark.parametrize("kind", ["blocked", "grouped", "joined", "reserved", "late"])
@pytest.mark.parametrize("seed", cases(20, 4_000))
def test_no_run_of_the_simulation_is_longer(kind: str, seed: int) -> None:
    """Sections anywhere in their jobs, throttling and reservations by the budget itself, queues of executors."""
    system, rng = draw(seed, kind=kind), random.Random(seed)
    space = loads(text_of(system)).space
    evaluator = Evaluator(space)
    choice = rng.choice(list(every_choice(system)))
    names = {"c.type": choice["type"]}
    for number, period in enumerate(choice["periods"]):
        thread = choice["threads"][number]
        names[f"t{number}.executor"] = thread["executor"]["name"] if thread["executor"] else ""
        names[f"t{number}.dispatch_protocol"] = "aperiodic" if period is None else "periodic"
        if thread["executor"]:
            names[f"{thread['executor']['name']}.kind"] = choice["kinds"][thread["executor"]["name"]]
        names[f"t{number}.period"] = f"{period} ms"
        names[f"{(thread['reservation'] or thread['executor'] or thread)['name']}.core"] = str(choice["cores"][number])
        if thread["reservation"]:
            one = thread["reservation"]["name"]
            names[f"{one}.budget"] = f"{choice['budgets'][one]} ms"
        assert thread["name"] == f"t{number}"
    design = tuple(
        item.options.index(chosen) if (chosen := names.get(item.name)) in item.options else 0
        for item in space.decisions
    )
    expected = responses(system, choice)
    whole = evaluator.evaluate(design).design
    numbers = {item.name: number for number, item in enumerate(space.components)}
    cores = {numbers[f"t{number}"]: core for number, core in enumerate(choice["cores"])}
    plan = build_plan(space, whole, cores=cores, endless_queues=True)
    for run in range(8):
        offsets = {name: rng.randrange(int(period)) for name, period in plan.timers.items()} if run else {}
        setting = Setting(600 * MS, 600 * MS, offsets, execution="max" if run % 2 else "random", seed=run)
        seen = simulate_once(plan, setting).responses
        for number, bound in enumerate(expected):
            assert seen.get(f"t{number}", 0) <= bound * MS


def test_an_executor_chooses_when_it_gets_the_core() -> None:
    """A section holds the core until 1 ms; what came at 0.2 ms has not begun when the more urgent one comes at 0.5."""
    threads = """
  fast: {executor: e, period: 20 ms, compute_execution_time: 1 ms}
  slow: {executor: e, period: 80 ms, compute_execution_time: 3 ms}
  log: {processor: p, period: 80 ms, compute_execution_time: 1 ms, non_preemptive: 1 ms}
executors: {e: {kind: callback_group, processor: p}}
"""
    space = space_of(HEAD.format(overheads="") + threads)
    found = processor_responses(space, 0, View([0] * len(space.decisions)))
    assert {item.name: item.response_ns for item in found} == {"fast": 4 * MS, "slow": 5 * MS, "log": 5 * MS}
    plan = build_plan(space, (0,) * len(space.decisions), cores={0: 1, 1: 1, 2: 1})
    offsets = {"fast": MS // 2, "slow": MS // 5}
    seen = simulate_once(plan, Setting(80 * MS, 80 * MS, offsets, execution="max")).responses
    assert (seen["fast"], seen["slow"]) == (1.5 * MS, 4.8 * MS)


def test_what_makes_response_times_safe_bounds_is_said() -> None:
    periodic_only = space_of(HEAD.format(overheads="") + READY_AND_LOG)
    assert bound_words(periodic_only) == ""
    threads = """
  tick: {executor: e, period: 20 ms, compute_execution_time: 1 ms}
  react: {processor: p, dispatch_protocol: [aperiodic, periodic], period: 20 ms, compute_execution_time: 1 ms}
executors: {e: {kind: [fifo, wait_set], processor: p}}
devices: {d: {period: 20 ms}}
connections: {c: {from: d, to: react}}
"""
    space = space_of(HEAD.format(overheads="") + threads)
    assert [item.name for item in space.decisions] == ["p.type", "react.dispatch_protocol", "e.kind"]
    said = "They are safe bounds, which need not be reached, on cores where"
    assert bound_words(space) == f"{said} events dispatch react; a wait set runs tick."
    assert bound_words(space, (0, 0, 0)) == f"{said} events dispatch react."
    assert bound_words(space, (0, 1, 1)) == f"{said} a wait set runs tick."
    assert bound_words(space, (0, 1, 0)) == ""


def test_the_simulation_comes_as_close_to_blocking_as_a_nanosecond() -> None:
    space = space_of(HEAD.format(overheads="") + READY_AND_LOG)
    plan = build_plan(space, (0,) * len(space.decisions), cores={0: 1, 1: 1})
    seen = simulate_once(plan, Setting(200 * MS, 200 * MS, {"ready": 1}, execution="max")).responses
    assert seen["ready"] == 5 * MS - 1


def test_the_simulation_plays_switches_interrupts_and_throttling() -> None:
    """With everything released at once, and a budget that ends while log runs: 8.4 + 1 of the tick + a gap of 6."""
    overheads = ", context_switch: 100 us, interrupts: {tick: {compute_execution_time: 1 ms, period: 40 ms}}"
    overheads += ", throttling: {budget: 8 ms, period: 14 ms}"
    space = space_of(HEAD.format(overheads=overheads) + READY_AND_LOG)
    plan = build_plan(space, (0,) * len(space.decisions), cores={0: 1, 1: 1})
    seen = simulate_once(plan, Setting(40 * MS, 40 * MS, execution="max")).responses
    assert seen["log"] > 8 * MS + MS + 5 * MS
    assert seen["p core 1 tick"] == MS


def test_analyse_says_what_was_counted() -> None:
    text = HEAD.format(overheads=", context_switch: 100 us") + READY_AND_LOG
    found = dse.analyse(text, response_times=True).to_dict()
    assert found["overheads"] == {
        "blocking": ["log"], "context switches": ["p"], "interrupts": [], "throttling": [],
    }  # fmt: skip
    [ready, _] = found["response_times"]["p"]
    assert (ready["execution_ns"], ready["switching_ns"], ready["blocking_ns"]) == ([2 * MS] * 2, 200_000, 3 * MS)


def test_only_overheads_of_the_chosen_types_are_said_to_count() -> None:
    text = (
        "dse: 1\nname: x\nprocessor_types:\n  plain: {context_switch: 10 us}\n"
        "  full: {interrupts: {tick: {compute_execution_time: 50 us, period: 1 ms}}}\n"
        "processors: {p: {type: [plain, full]}}\nthreads:\n"
        "  a: {processor: p, period: 10 ms, compute_execution_time: 1 ms}\n"
    )
    problem = dse.loads(text)
    for name, expected in (("plain", "context switches (p); not blocking"), ("full", "interrupts (p); not blocking")):
        analysis = dse.analyse(problem, {"p.type": name}, response_times=True)
        assert overhead_words(analysis.space, analysis.design).startswith(f"Response times count {expected}")
        assert [kind for kind, names in analysis.to_dict()["overheads"].items() if names] == [expected.split(" (")[0]]
    assert "context switches (p), interrupts (p)" in overhead_words(problem.space)
