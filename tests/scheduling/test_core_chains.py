"""Chains on a core (docs/semantics.md, section 4.9): examples, runs that no bound is below, parts, and fronts."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import pytest
import yaml

import dse
from dse.analysis.latency.contributors import flow_rows
from dse.analysis.scheduling.chained import chain_of, least_cut
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses, solution_of
from dse.analysis.scheduling.waits import Waits
from dse.analysis.views import View
from dse.space.model.space import Space
from tests.helpers.chain_examples import (
    AGAIN,
    AWAY,
    BESIDE,
    EARLY,
    FORK,
    FOUR,
    HEAD,
    IN_TURN,
    JOIN,
    MEETING,
    PILED,
    SELDOM,
    THROUGH,
    TURNS,
    TWO_WAYS,
)
from tests.helpers.core_chains import draw, played, problem_of, some_groups
from tests.helpers.effort import cases
from tests.helpers.support import space_of


def latencies(space: Space, view: View) -> dict[str, Fraction]:
    """The greatest latency of each flow in ns."""
    return {flow.name: Fraction(sum(row.max_ns for row in flow_rows(space, flow, view))) for flow in space.flows}


@pytest.mark.parametrize(
    ("text", "latency_ms"),
    [
        (EARLY, 28),  # b responds within 15 ms, where it comes 5 ms after a job that was as late as can be
        (FOUR.replace("TIMER", "0 ms"), 4),
        (FOUR.replace("TIMER", "2 ms"), 6),  # and not 12: the timer counts once
        (AWAY, 16),  # what came while a ran has piled up for c; 15 can be seen
        (SELDOM.replace("PATH", "x"), 7),  # b comes up to 16 ms late, and once all the same while x waits
        (SELDOM.replace("PATH", "a"), 17),
        (FORK, 5),  # c is beside the chain and goes before b
        (MEETING, 8),  # b comes behind jobs of a only: 3 + 5 ms, and 3 + 5 + 3 + 5 ms until the second one ends
        (THROUGH, 12),  # one job of c is on its way behind a when t is released
        (TWO_WAYS, 18),  # b and two of c are on their way: c comes behind that b, too
        (PILED, 24),  # a job of t that is released later meets more jobs of k; 14 can be seen
        (BESIDE, 4),  # c comes once behind b, which is less urgent than a, though it comes behind a, too
        (JOIN, 36),  # y comes up to 35 ms after a was released
    ],
)
def test_examples(text: str, latency_ms: int) -> None:
    space = space_of(HEAD + text)
    assert latencies(space, View(())) == {"f": latency_ms * 10**6}
    simulation = dse.simulate(HEAD + text, runs=40)
    assert simulation.exit_code == 0


def test_a_limit_that_the_sum_of_response_times_breaks() -> None:
    """Four threads of 1 ms, one after the other, take 4 ms."""
    text = HEAD + FOUR.replace("TIMER", "0 ms") + "requirements: [latency of f <= 4 ms]"
    assert dse.solve(text).status == "complete"


def systems(seed: int) -> tuple[random.Random, Any, Space]:
    """A drawn system, on one to three cores."""
    rng = random.Random(f"chains on cores {seed}")
    drawn = draw(rng, rng.randint(1, 3), rng.choice((0.4, 0.6, 0.8)), by_rate=rng.random() < 0.5)
    return rng, drawn, space_of(yaml.safe_dump(problem_of(drawn), sort_keys=False))


@pytest.mark.parametrize("seed", cases(400))
def test_no_run_takes_longer_than_its_bound(seed: int) -> None:
    rng, drawn, space = systems(seed)
    bounds = latencies(space, View(()))
    for number in range(12):
        for name, taken in played(drawn, rng, longest=number % 2 == 0).items():
            assert taken * 10**5 <= bounds[name], (name, taken, bounds[name])


@pytest.mark.parametrize("seed", cases(400, 10_000))
def test_no_bound_of_a_part_is_above_that_of_the_whole(seed: int) -> None:
    """What the search learns of some threads of a core holds of more."""
    rng, _, space = systems(seed)
    whole, ends = latencies(space, View(())), all_responses(space, View(()))
    cores: dict[int, list[int]] = {}
    for number, component in enumerate(space.components):
        cores.setdefault(component.core, []).append(number)
    for _ in range(6):
        part = View((), some_groups(rng, list(cores.values())))
        for name, bound in latencies(space, part).items():
            assert bound <= whole[name] or whole[name] >= UNBOUNDED_NS
        for key, end in all_responses(space, part).items():
            known = (
                ends[key] if key[-1] in ("thread", "lag") and (isinstance(key[1], str) or key[0] == key[1]) else None
            )
            assert known is None or (end is not None and end <= known)


@pytest.mark.parametrize(
    ("text", "latency_ms"),
    [
        (AGAIN, 8),  # 1 + 2 + 1 ms, and k once before each of its threads
        (TURNS, 47),  # u, or what is behind y: never both, never what is behind s as well
        (IN_TURN, 147),  # a later job waits at its first thread: 125 + 22 ms
    ],
)
def test_threads_behind_less_urgent_ones(text: str, latency_ms: int) -> None:
    point = dse.solve(dse.loads(HEAD + text)).front[0]
    assert point.objectives["latency of f"] == latency_ms * 10**6


@pytest.mark.parametrize("seed", cases(400, 20_000))
def test_what_threads_of_a_flow_wait_for_adds_up_to_its_latency(seed: int) -> None:
    """Parts of the least cut: own work, others once each, and blocking; what is sent is in the latency alone.

    A row is no less than the longest execution time, so that a latency may be more than its parts.
    """
    _, _, space = systems(seed)
    view = View(())
    whole, solution = latencies(space, view), solution_of(space, view)
    waits = Waits(space, solution.system, solution.ends)
    for flow in (flow for flow in space.flows if whole[flow.name] < UNBOUNDED_NS):
        rows = flow_rows(space, flow, view)
        total = sum((Fraction(row.max_ns) for row in rows if row.category != "thread"), Fraction(0))
        steps = [step for step in flow.steps if step.kind == "component"]
        for part in (part for chain in dict.fromkeys(map(chain_of, steps)) for part in least_cut(space, chain, view)):
            found = waits.of_part(part)
            assert found
            assert all(item.earlier_ns >= 0 and item.blocked_ns >= 0 for item in found)
            total += sum(item.response_ns for item in found)
        assert total == whole[flow.name]


EARLY = """
threads:
  a: {processor: p, period: 20 ms, compute_execution_time: 1 ms .. 16 ms}
  b: {processor: q, dispatch_protocol: aperiodic, compute_execution_time: 8 ms, priority: 1}
  u: {processor: q, period: 20 ms, compute_execution_time: 4 ms, priority: 2}
  j: {processor: z, dispatch_protocol: aperiodic, compute_execution_time: 0 ms}
  k: {processor: z, period: 20 ms, compute_execution_time: 0 ms}
connections: {ab: {from: a, to: b}, bj: {from: b, to: j}, kj: {from: k, to: j}}
flows: {f: {path: [a, b]}}
"""


@pytest.mark.parametrize(
    ("old", "new", "takes_ms"),
    [
        ("", "", 12),
        ("16 ms}", "16 ms, response_time: 16 ms}", 12),  # b is still behind its source
        ("[a, b]", "[b]", 15),
        ("[a, b]", "[a, b, j]", 12),
        ("0 ms}\n  k", "0 ms, join: all}\n  k", 12),
        ("0 ms}\n  k: {processor: z, period: 20 ms", "0 ms, join: all}\n  k: {processor: z, period: 20 ms", 12),
        ("[a, b]", "[{element: a, latency: 16 ms}, b]", 15),
        ("p, period: 20 ms", "p, period: 20 ms, offset: 0 ms", 15),
    ],
)
def test_which_flows_count_lags(old: str, new: str, takes_ms: int) -> None:
    """Of two jobs of b that come 5 ms apart the second responds within 15 ms, and ends within 16 + 12 ms of a's."""
    space = space_of(HEAD + EARLY.replace(old, new))
    rows = {row.contributor: row.max_ns for row in flow_rows(space, space.flows[0], View(()))}
    assert rows["b"] == takes_ms * 10**6


def test_what_comes_to_a_join_counts_response_times() -> None:
    text = EARLY.replace("0 ms}\n  k", "0 ms, join: all}\n  k").replace("[a, b]", "[a, b, bj, j]")
    space = space_of(HEAD + text)
    rows = {row.contributor: row.max_ns for row in flow_rows(space, space.flows[0], View(()))}
    assert rows["b"] == 15 * 10**6
