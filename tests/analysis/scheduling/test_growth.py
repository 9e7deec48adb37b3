"""Growth that is followed in one step, against the same rounds one by one.

Messages take a moment, for what is released at once in an executor grows no further than what releases it.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

import dse
from dse.analysis.scheduling import fixed_point
from dse.analysis.scheduling.growth import Line, Reach
from dse.analysis.scheduling.responses import all_responses
from dse.analysis.views import View
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.inputs import InputSpace
from tests.helpers.effort import LONG, cases

QUEUE = """
dse: 1
name: a queue that is 93 % full
processor_types: {A: {cores: 1}}
processors: {p: {type: A}}
executors: {e: {processor: p, kind: KIND, core: 1}}
devices: {s: {period: 5 ms}}
threads:
  t0: {executor: e, compute_execution_time: 3 ms, period: 6 ms}
  t1: {executor: e, compute_execution_time: TIME, dispatch_protocol: periodic, period: 20 ms}
  t2: {executor: e, compute_execution_time: 2 ms, dispatch_protocol: aperiodic}
connections: {w0: {from: s, to: t0}, w1: {from: t0, to: t1}, w2: {from: t0, to: t2, latency: 1 ns}}
flows: {f: {path: [s, t0, t2], latency: 100 ms}}
requirements: [response time of t2 <= 20 ms]
objectives: [minimise latency of f]
processing: response_time
"""


def responses(text: str) -> dict[Any, Any]:
    """All response times of threads of the single design of a problem."""
    space = dse.loads(text).space
    known = all_responses(space, View((0,) * len(space.decisions)))
    return {key: time for key, time in known.items() if isinstance(key[1], str)}  # no chains


def one_by_one(text: str, monkeypatch: pytest.MonkeyPatch) -> tuple[dict[Any, Any], int]:
    """The same without following anything, and after how many rounds."""
    rounds = [0]
    with monkeypatch.context() as patch:
        patch.setattr(fixed_point.Rounds, "follow", lambda *_: 0)
        patch.setattr(fixed_point, "MOST_ROUNDS", 10**9)
        following = fixed_point.Rounds.next

        def counted(work: fixed_point.Rounds) -> bool:
            rounds[0] += 1
            return following(work)

        patch.setattr(fixed_point.Rounds, "next", counted)
        return responses(text), rounds[0]


@pytest.mark.parametrize(
    ("time_ns", "end_ns"),
    # by hand: the second job of t2 comes ever closer to the first, until both wait for all others: 3 + t1 + 2 + 2
    [(2_000_000, 7_000_000), (2_000_001, 9_000_001), (2_001_000, 9_001_000), (2_030_000, 9_030_000)],
)
def test_growth_by_a_nanosecond_a_round_ends_where_it_ends(time_ns: int, end_ns: int) -> None:
    found = responses(QUEUE.replace("KIND", "fifo").replace("TIME", f"{time_ns} ns"))
    assert set(found.values()) == {end_ns}


def test_two_million_rounds_are_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fixed_point, "MOST_ROUNDS", 100)
    assert None not in responses(QUEUE.replace("KIND", "fifo").replace("TIME", "2000001 ns")).values()


def drawn(seed: int) -> str:
    """One or two nearly full executors, whose threads trigger each other."""
    rng = random.Random(seed)
    hosts = rng.choice((1, 1, 1, 2))
    kinds = ("fifo", "fifo", "callback_group", "wait_set")
    executors = [f"e{i}: {{processor: p{i}, kind: {rng.choice(kinds)}, core: 1}}" for i in range(hosts)]
    count = rng.choice((2, 3, 3, 4)) * hosts
    room, left = [rng.uniform(0.85, 0.99) for _ in range(hosts)], [count // hosts] * hosts
    threads, wires = [], ["w0: {from: s, to: t0}"]
    periods: list[int] = []
    for number in range(count):
        host, source = number % hosts, None
        if number and rng.random() < 0.6:
            source = rng.randrange(number)
        periods.append(rng.choice((5, 6, 8, 10, 12, 15, 20)) if source is None else periods[source])
        share = room[host] if left[host] == 1 else room[host] * rng.uniform(0.2, 0.6)
        room[host], left[host] = room[host] - share, left[host] - 1
        time = max(10, int(share * periods[number] * 1000)) // 100 * 100 + rng.choice((0, 1, 2, 10, 30))
        dispatch = "aperiodic" if source is not None else f"periodic, period: {periods[number]} ms"
        if source is not None:
            wires.append(f"w{number}: {{from: t{source}, to: t{number}, latency: 1 ns}}")
        threads.append(
            f"t{number}: {{executor: e{host}, compute_execution_time: {time} us, dispatch_protocol: {dispatch}}}"
        )
    return "\n".join([
        "dse: 1\nname: drawn\nprocessor_types: {A: {cores: 1}}\ndevices: {s: {period: 5 ms}}",
        f"processors: {{{', '.join(f'p{i}: {{type: A}}' for i in range(hosts))}}}",
        f"executors: {{{', '.join(executors)}}}",
        f"threads: {{{', '.join(threads)}}}",
        f"connections: {{{', '.join(wires)}}}",
        "objectives: [minimise response time of t0]\nprocessing: response_time",
    ])  # fmt: skip


SLOW = (520, 1348, 2896, 3176, *((212, 3704, 4047, 5549) if LONG else ()))
"""Draws that take 52 to 1,704 rounds, three of the longest where there is time; one in 400 takes more than 64."""


@pytest.mark.parametrize("seed", [*SLOW, *cases(300, 3000)])
def test_what_is_followed_is_what_rounds_find(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    text = drawn(seed)
    found, rounds = one_by_one(text, monkeypatch)
    assert responses(text) == found
    assert seed not in SLOW or rounds > 50


def test_figures_that_remember_how_they_were_made_take_the_same_steps() -> None:
    problem = dse.loads(QUEUE.replace("KIND", "fifo").replace("TIME", "2001.3 us"))
    inputs = InputSpace(problem)
    function = DesignFunction(inputs, (0,) * len(problem.space.decisions))
    (moved,) = (item for item in inputs.variables if item.path == "threads.t1.compute_execution_time")
    values = list(inputs.nominal)
    values[moved.index] += Fraction(1, 4)  # ns: as many rounds are taken at once
    program = function.programs[0]
    steps = program.run(values)
    assert program.holds(steps)
    assert [steps[number] for number in program.outputs] == function.analysed(values)
    assert 9_001_300 + Fraction(1, 4) in function.analysed(values)


def formula(rng: random.Random) -> Callable[[list[Any]], Any]:
    """Some sums, extremes, roundings and loops of numbers, as the analysis makes them."""
    kind, step, add = rng.randrange(5), rng.randrange(2, 9), rng.randrange(-5, 20)

    def computed(numbers: list[Any]) -> Any:
        one, other, third = numbers
        if kind == 0:
            return max(one, other + add) - third // step
        if kind == 1:
            return min(one * step, third) + -(-(other + add) // step) * step
        if kind == 2:
            time = step + one - one
            while (needed := add + 3 * -(-(time + other) // 11)) > time:
                time = needed
            return time + third
        if kind == 3:
            return (Fraction(1) * one / step if one else 0) + (other if other <= third else add - third)
        return sorted([one, other, third, add])[1]

    return computed


@pytest.mark.parametrize("seed", cases(1000))
def test_a_line_is_what_the_formula_gives_at_each_place_within_reach(seed: int) -> None:
    rng = random.Random(seed)
    reach = Reach()
    starts, slopes = [rng.randrange(0, 60) for _ in range(3)], [rng.choice((0, 0, 1, 2, 5, -1)) for _ in range(3)]
    lines = [Line(at, slope, reach) for at, slope in zip(starts, slopes, strict=True)]
    compute = formula(rng)
    found = compute(list(lines))
    found = found if isinstance(found, Line) else Line(found, 0, reach)
    until = 40 if reach.until is None else min(40, reach.until)
    for part in range(1, 80):
        place = until * Fraction(part, 80)
        if place:
            there = [at + slope * place for at, slope in zip(starts, slopes, strict=True)]
            assert compute(there) == found.at + found.slope * place
