"""Threads that join a core one after the other against the response times of them all at once."""

from __future__ import annotations

import random
import re
from fractions import Fraction
from itertools import permutations

import pytest

from dse.analysis.limits import HOLDS
from dse.analysis.placement.admission import Admission
from dse.analysis.placement.heuristics import core_limits
from dse.analysis.placement.priority_assignment import Latest, limits_of
from dse.analysis.scheduling.responses import counted_ns, subset_responses
from dse.analysis.scheduling.tasks import members
from dse.analysis.views import View
from dse.questions.problem import loads
from dse.space.model.space import Space
from tests.helpers.effort import cases
from tests.helpers.thread_systems import draw, text_of

MANY = """
dse: 1
name: many
deadlines: all
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
devices: {d: {period: 30 ms}}
threads:
%s
connections: {%s}
flows: {f: {path: [t0]}}
objectives: [minimise latency of f]
"""
PERIODS_MS = (4, 5, 6, 8, 10, 12, 15, 20, 30)


def are_in_time(space: Space, numbers: list[int], view: View, latest: Latest) -> bool:
    known = subset_responses(space, [numbers], View(view.design))
    return all(
        HOLDS[operator](Fraction(counted_ns(known.get((number, "thread"), 0))), bound)
        for number in numbers
        for operator, bound in latest.get(number, ())
    )


def asked(space: Space, rng: random.Random) -> set[bool]:
    """What is said of threads that join in a random order, as long as they are admitted; and of fewer, in another."""
    design = tuple(rng.randrange(len(item.options)) for item in space.decisions)
    view = View(design)
    latest = limits_of(core_limits(space), view)
    admits = Admission(space, view, latest)
    said = set()
    for processor in range(len(space.processors)):
        order = members(space, processor, view)
        for _ in range(3):
            rng.shuffle(order)
            for count in range(1, len(order) + 1):
                found = admits(order[:count])
                assert found == are_in_time(space, order[:count], view, latest), order[:count]
                said.add(found)
                if not found and rng.random() < 0.8:
                    break
    return said


@pytest.mark.parametrize("kind", ["plain", "chained", "stated", "blocked", "ordered", "grouped", "reserved", "mixed"])
@pytest.mark.parametrize("seed", cases(20))
def test_small_systems_of_every_kind(kind: str, seed: int) -> None:
    space = loads(text_of(draw(seed, kind=kind))).space
    rng = random.Random(seed)
    for _ in range(5):
        asked(space, rng)


@pytest.mark.parametrize("seed", cases(40))
def test_many_threads_with_numbers_deadlines_and_periods(seed: int) -> None:
    """Some released by others, without work, with the same number, or with a deadline beyond their period."""
    rng = random.Random(seed)
    lines, wires = [], []
    for number in range(12):
        period = rng.choice(PERIODS_MS)
        fields = [f"processor: c, compute_execution_time: {max(0, rng.randint(-200, 1500))} us"]
        if rng.random() < 0.3:
            wires.append(
                f"w{number}: {{from: {rng.choice(['d', *range(number)])}, to: t{number}, latency: 0 ms .. 2 ms}}"
            )
            fields.append("dispatch_protocol: aperiodic")
        else:
            fields.append(f"period: {period} ms")
        if rng.random() < 0.3:
            fields.append(f"priority: {rng.randint(1, 3)}")
        if rng.random() < 0.4:
            fields.append(f"deadline: {rng.randint(1, period + (8 if rng.random() < 0.2 else 0))} ms")
        lines.append(f"  t{number}: {{{', '.join(fields)}}}")
    text = MANY % ("\n".join(lines), re.sub(r"from: (\d+)", r"from: t\1", ", ".join(wires)))
    space = loads(text.replace("deadlines: all", f"deadlines: {rng.choice(['all', 'stated'])}")).space
    said = set()
    for _ in range(4):
        said |= asked(space, rng)
    assert True in said


def test_threads_that_timers_release_are_not_left_to_the_analysis(monkeypatch: pytest.MonkeyPatch) -> None:
    """Any two are in time; of all three the last one ends at 19 ms, two jobs of the first before it."""
    monkeypatch.setattr("dse.analysis.placement.admission.subset_responses", None)
    line = "  t%d: {processor: c, period: %d ms, compute_execution_time: %d us}"
    space = loads(MANY % ("\n".join(line % row for row in [(0, 10, 5000), (1, 14, 4000), (2, 14, 5000)]), "")).space
    view = View(())
    admits = Admission(space, view, limits_of(core_limits(space), view))
    first, second, third = members(space, 0, view)
    assert admits([first]) and admits([first, second]) and admits([second, first])
    assert admits([third, second]) and admits([first, third])
    assert not admits([first, second, third])


ZERO = """
dse: 1
name: no work
deadlines: all
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
devices: {d: {period: 10 ms}}
threads:
  n: {processor: c, dispatch_protocol: aperiodic, compute_execution_time: 3 ms}
  z: {processor: c, period: 50 ms, compute_execution_time: 0 ms, deadline: 2 ms}
connections: {w: {from: d, to: n, latency: 0 ms .. 2 ms}}
flows: {f: {path: [d, n]}}
objectives: [minimise latency of f]
"""
LATER = """
dse: 1
name: jitter of a thread that nobody asked about
deadlines: stated
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
threads:
  h: {processor: c, period: 50 ms, compute_execution_time: 6 ms, priority: 5}
  p: {processor: c, period: 10 ms, compute_execution_time: 1 ms}
  n: {processor: c, dispatch_protocol: aperiodic, compute_execution_time: 2 ms}
  l: {processor: c, period: 50 ms, compute_execution_time: 1 ms, deadline: 11 ms}
connections: {w: {from: p, to: n}}
flows: {f: {path: [p, n]}}
objectives: [minimise latency of f]
"""
FRACTION = """
dse: 1
name: half a nanosecond
processor_types: {cpu: {}}
bus_types: {wire: {transmission_time: {fixed: 0 ns .. 2000000.5 ns}}}
processors: {c: {type: cpu}}
buses: {b: {type: wire}}
devices: {d: {period: 3 ms}}
threads:
  n: {processor: c, dispatch_protocol: aperiodic, compute_execution_time: 2 ms}
  z: {processor: c, period: 50 ms, compute_execution_time: 1 ms}
connections: {w: {from: d, to: n, data_size: 1 B, bus: b}}
flows: {f: {path: [d, n]}}
requirements: ["response time of n < 3000001 ns"]
objectives: [minimise latency of f]
"""


@pytest.mark.parametrize("text", [ZERO, LATER, FRACTION], ids=["no work", "later jitter", "half a nanosecond"])
def test_in_every_order_the_answer_is_that_of_the_analysis(text: str) -> None:
    space = loads(text).space
    view = View(tuple(0 for _ in space.decisions))
    latest = limits_of(core_limits(space), view)
    for order in permutations(members(space, 0, view)):
        admits = Admission(space, view, latest)
        for count in range(1, len(order) + 1):
            among = list(order[:count])
            assert admits(among) == are_in_time(space, among, view, latest), among
