"""What the pieces of a thread delay that has no bound: its jobs follow each other more closely than its releases."""

from __future__ import annotations

import random
from collections.abc import Mapping

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses
from dse.analysis.views import View
from dse.search.front import SearchLimits, search_front
from dse.simulation.engine import simulate_once
from dse.simulation.observing import Setting
from dse.simulation.plan import build_plan
from dse.verification import tables
from tests.helpers.effort import cases
from tests.helpers.support import brute_front, space_of
from tests.oracle.evaluator import evaluated
from tests.oracle.problem import load_text

MS = 10**6


def ends_ms(text: str) -> dict[str, float | None]:
    space = space_of(text)
    found = all_responses(space, View([0] * len(space.decisions)))
    return {space.components[key[0]].name: None if end is None else float(end) / MS for key, end in found.items()}


def seen_ms(text: str, offsets_ms: Mapping[str, float], seed: int = 0) -> dict[str, float]:
    """The longest response times of a run in which all jobs take as long as they may."""
    space = space_of(text)
    cores = dict.fromkeys(range(len(space.components)), 1)
    plan = build_plan(space, (0,) * len(space.decisions), cores=cores, endless_queues=True)
    offsets = {name: int(time * MS) for name, time in offsets_ms.items()}
    seen = simulate_once(plan, Setting(400 * MS, 400 * MS, offsets, execution="max", seed=seed)).responses
    return {name: float(time) / MS for name, time in seen.items()}


SERVED = """
dse: 1
name: a first piece on an accelerator
processor_types: {cpu: {}, gpu: {serves: ORDER}}
processors: {c: {type: cpu}, d: {type: cpu}, e: {type: cpu}, g: {type: gpu}}
threads:
  often: {processor: c, period: 10 ms, segments: [
           {processor: g, compute_execution_time: TIME}, {compute_execution_time: 1 ms}]}
  twice: {processor: d, priority: 2, period: 400 ms, segments: [{processor: g, compute_execution_time: 12 ms},
          {compute_execution_time: 1 us}, {processor: g, compute_execution_time: 12 ms}]}
  once: {processor: d, priority: 2, period: 400 ms, segments: [{processor: g, compute_execution_time: 12 ms},
         {compute_execution_time: 1 us}]}
  short: {processor: e, priority: 3, period: 400 ms, segments: [{processor: g, compute_execution_time: 1 ms},
          {compute_execution_time: 1 us}]}
objectives: [minimise price]
"""
OFFSETS = {"twice (piece 1)": 0, "once (piece 1)": 0.001, "often (piece 1)": 0.002, "short (piece 1)": 12.01}


def test_a_first_piece_of_which_several_wait_for_an_accelerator() -> None:
    """In the order of arrival a piece waits for one piece of each other thread, but for any number of a late one's.

    The first two of `often` come while the one of `once` waits, and then the last one of `twice`: 1 + 12 + 5 + 12 ms,
    with one piece of each, is less than a run shows.
    """
    text = SERVED.replace("ORDER", "fifo").replace("TIME", "5 ms")
    assert seen_ms(text, OFFSETS)["short (piece 1)"] > 1 + 12 + 5 + 12
    assert set(ends_ms(text).values()) == {None}


def test_a_less_urgent_piece_of_a_late_thread_delays_by_one_job() -> None:
    """Where an accelerator serves by priority one of them may have begun, however often they come."""
    text = SERVED.replace("ORDER", "priority").replace("TIME", "14 ms").replace("c, period: 10 ms", "c, period: 20 ms")
    found = ends_ms(text)
    assert (found["often"], found["short (piece 1)"]) == (None, 1 + 14)
    assert seen_ms(text, {"often (piece 1)": 0, "short (piece 1)": 0.001})["short (piece 1)"] > 14


CORE = """
dse: 1
name: a first piece on a core
processor_types: {cpu: {}, gpu: {serves: fifo}}
processors: {c: {type: cpu}, d: {type: cpu}, g: {type: gpu}}
threads:
  late: {processor: c, period: 10 ms, segments: [
          {compute_execution_time: 4 ms}, {processor: g, compute_execution_time: 5 ms}]}
  other: {processor: d, period: 100 ms, segments: [
           {compute_execution_time: 3 ms}, {processor: g, compute_execution_time: TIME}]}
  less: {processor: c, period: 50 ms, compute_execution_time: 6 ms}
objectives: [minimise price]
"""


def begins_ms(taken: int) -> list[int]:
    """When first pieces of `late` begin, which is one thread: the accelerator is `taken` up to a time."""
    end, found = 0, []
    for number in range(6):
        found.append(max(10 * number, end))
        end = max(found[-1] + 4, taken) + 5
    return found


def test_a_first_piece_on_a_core_that_begins_late() -> None:
    """Two jobs of it go before work that would meet one: the second begins less than a period after the first."""
    in_time, late = (CORE.replace("TIME", f"{time} ms") for time in (1, 12))
    assert ends_ms(in_time)["less"] == 4 + 6
    taken = {time for begin in begins_ms(3 + 12) for time in range(begin, begin + 4)}
    free = [time for time in range(20, 60) if time not in taken]
    assert free[6 - 1] + 1 - 20 == 14 > 4 + 6  # released at 20 ms it ends at 34
    assert (ends_ms(late)["late (piece 1)"], ends_ms(late)["less"]) == (None, None)
    assert ends_ms(late.replace("less: {", "less: {priority: 1, "))["less"] == 6


def test_a_budget_behind_a_late_thread_has_no_bound() -> None:
    """Nor has what it is for."""
    text = CORE.replace("less: {processor: c", "less: {reservation: r")
    text = text.replace("objectives", "reservations: {r: {processor: c, budget: 20 ms, period: 50 ms}}\nobjectives")
    assert ends_ms(text.replace("TIME", "1 ms"))["less"] is not None
    assert ends_ms(text.replace("TIME", "12 ms"))["less"] is None


def drawn(seed: int) -> str:
    """A thread that comes often and begins on an accelerator, beside some that come seldom and stay there for long."""
    rng = random.Random(f"late {seed}")
    order = rng.choice(("fifo", "fifo", "priority"))
    lines = [f"dse: 1\nname: late\nprocessor_types: {{cpu: {{}}, gpu: {{serves: {order}}}}}"]
    lines += ["processors: {c: {type: cpu}, d: {type: cpu}, g: {type: gpu}}", "threads:"]
    for number in range(4):
        period, most = rng.choice((8, 10, 12)) if not number else rng.choice((60, 80, 100, 120)), 9 if number else 6
        count = rng.randint(1, 3) if number else 1
        pieces = [f"{{processor: g, compute_execution_time: {rng.randint(1, most)} ms}}" for _ in range(count)]
        pieces.insert(rng.randint(1, count), "{compute_execution_time: 1 ms}")
        fields = f"processor: {'d' if number else 'c'}, period: {period} ms, segments: [{', '.join(pieces)}]"
        lines.append(f"  t{number}: {{{fields}}}")
    return "\n".join([*lines, "objectives: [minimise price]"]) + "\n"


@pytest.mark.parametrize("seed", cases(20))
def test_no_run_is_longer_than_the_bound(seed: int) -> None:
    text, rng = drawn(seed), random.Random(seed)
    ends = ends_ms(text)
    for run in range(20):
        offsets = {f"t{number} (piece 1)": rng.randrange(30) for number in range(4)}
        for name, seen in seen_ms(text, offsets, run).items():
            end = ends[name]
            assert end is None or seen <= end, (name, run)


@pytest.mark.parametrize("seed", cases(40, 1_000))
def test_the_bounds_are_those_of_the_oracle(seed: int) -> None:
    text = drawn(seed)
    ((_, figures),) = evaluated(load_text(text.replace("dse: 1", "dse: 1\ndeadlines: all")))
    responses = {name: float(end) / MS for name, end in figures["responses"].items()}
    found = ends_ms(text)
    assert responses == {name: UNBOUNDED_NS / MS if found[name] is None else found[name] for name in responses}
    assert len(responses) == 4


def asked(seed: int) -> str:
    """Threads with segments of which some may be late, beside one that is not to be, on cores that are decisions."""
    rng = random.Random(f"asked {seed}")
    order = rng.choice(("fifo", "priority"))
    kinds = f"fast: {{serves: {order}, price: 30 EUR}}, slow: {{serves: {order}, price: 10 EUR}}"
    lines = ["dse: 1", "name: asked", "processing: response_time", "overload: allowed"]
    lines += [f"processor_types: {{cpu: {{cores: 2}}, {kinds}}}"]
    lines += ["processors: {c: {type: cpu}, g: {type: [fast, slow]}}", "threads:"]
    for number in range(3):
        period = rng.choice((8, 10, 15)) if number < 2 else rng.choice((20, 30))
        own = f"{{compute_execution_time: {rng.randint(1, 3)} ms}}"
        fast = rng.randint(1, 4)
        times = f"{{fast: {fast} ms, slow: {fast + rng.randint(1, 4)} ms}}"
        away = f"{{processor: g, compute_execution_time: {times}}}"
        pieces = rng.choice(([own, away], [own, away], [away, own], [own, away, own]))
        deadline = f", deadline: {period} ms" if rng.random() < 0.2 else ""
        fields = f"processor: c, core: any, period: {period} ms{deadline}, segments: [{', '.join(pieces)}]"
        lines.append(f"  t{number}: {{{fields}}}")
    timing = f"period: 20 ms, deadline: {rng.choice((6, 12, 20))} ms, compute_execution_time: 3 ms"
    lines.append(f"  w: {{processor: c, core: any, {timing}}}")
    return "\n".join([*lines, "flows: {f: {path: [w]}}", "objectives: [minimise price, minimise latency of f]"]) + "\n"


@pytest.mark.parametrize("seed", cases(15))
def test_the_front_is_that_of_every_design_and_proved_again(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)  # no response time is tabulated
    problem = dse.loads(asked(seed))
    evaluator = Evaluator(problem.space)
    search = search_front(evaluator, SearchLimits(workers=1))
    assert search.is_complete
    assert set(search.points) == set(brute_front(evaluator))
    assert dse.verify(dse.solve(problem), problem=problem).exit_code == 0
