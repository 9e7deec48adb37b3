"""Callbacks of one chain in an executor: by hand, against runs that are played, and in fronts."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any, Literal, cast

import pytest

import dse
from dse.analysis.diagnosis.timelines import worst_busy_period
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.busy_window import TaskKey
from dse.analysis.scheduling.policies.successions import Chains, Succession
from dse.analysis.scheduling.resolve import stage_of
from dse.analysis.scheduling.responses import all_responses, processor_responses, solution_of
from dse.analysis.scheduling.waits import Waits
from dse.analysis.views import View
from dse.space.model.space import Space
from tests.helpers import chained_callbacks
from tests.helpers.effort import cases
from tests.helpers.support import brute_front, space_of

MS = 10**6
METHODS: tuple[Literal["model", "exhaustion"], ...] = ("model", "exhaustion")
KINDS = ("fifo", "callback_group", "wait_set")
FILE = """
dse: 1
name: one chain in one executor
processing: response_time
deadlines: none
processor_types: {{cpu: {{price: 1 EUR}}}}
processors: {{pc: {{type: cpu}}}}
executors: {{e: {{processor: pc, kind: {kind}}}}}
devices: {{d: {{period: 100 ms}}}}
threads:
  a: {{executor: e, period: 100 ms, compute_execution_time: 18 ms{a}}}
  b: {{executor: e, dispatch_protocol: aperiodic, compute_execution_time: 21 ms{b}}}
  c: {{executor: e, dispatch_protocol: aperiodic, compute_execution_time: 18 ms{c}}}
  d4: {{executor: e, dispatch_protocol: aperiodic, compute_execution_time: 7 ms{d}}}
{more}
connections: {{ab: {{from: a, to: b}}, bc: {{from: b, to: c}}, cd: {{from: c, to: d4{wire}}}}}
objectives: [minimise price]
"""


def file_of(kind: str, *, more: str = "", wire: str = "", **fields: str) -> str:
    """Fields of the threads a, b, c and d4, of the last connection, and more threads."""
    given = {name: f", {fields[name]}" if name in fields else "" for name in "abcd"}
    return FILE.format(kind=kind, more=more, wire=wire, **given)


def known_ms(space: Space) -> dict[str, float | None]:
    """The response times of the first design."""
    known = all_responses(space, View([0] * len(space.decisions)))
    return {
        space.components[key[0]].stated_as: None if time is None else float(time) / MS
        for key, time in known.items()
        if isinstance(key[1], str)  # no chains, no lags
    }


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [(1, 2, 3, 4), (4, 3, 2, 1), (2, 2, 2, 2), (1, 3, 2, 4)])
def test_the_chain_of_the_document_takes_its_own_time(kind: str, order: tuple[int, ...]) -> None:
    """docs/semantics.md, section 4.6: 18, 21, 18 and 7 ms, whatever the priorities are."""
    given = {name: f"priority: {number}" for name, number in zip("abcd", order, strict=True)}
    space = space_of(file_of(kind, **given if kind == "callback_group" else {}))
    assert known_ms(space) == {"a": 18, "b": 21, "c": 18, "d4": 7}


def test_in_a_fifo_a_callback_waits_for_one_job_of_each_chain() -> None:
    """The second example there, with what a report says each waits for."""
    space = space_of(file_of("fifo", more="  t: {executor: e, period: 50 ms, compute_execution_time: 5 ms}"))
    assert known_ms(space) == {"a": 23, "b": 26, "c": 23, "d4": 12, "t": 26}
    found = processor_responses(space, 0, View(()))
    said = {item.name: [(one.name, one.jobs) for one in item.delays] for item in found}
    assert said == {"a": [("t", 1)], "b": [("t", 1)], "c": [("t", 1)], "d4": [("t", 1)], "t": [("b", 1)]}
    busy = worst_busy_period(1, found)
    assert busy is not None and (busy.name, busy.end_ns) == ("t", 26 * MS)


@pytest.mark.parametrize("kind", KINDS)
def test_a_chain_that_ends_after_it_begins_again_is_one_of_strangers(kind: str) -> None:
    """18 + 21 + 18 + 44 ms end a ms too late, and with 43 ms just in time."""
    late = known_ms(space_of(file_of(kind).replace("7 ms", "44 ms")))
    assert late["a"] is None or late["a"] > 18
    assert known_ms(space_of(file_of(kind).replace("7 ms", "43 ms"))) == {"a": 18, "b": 21, "c": 18, "d4": 43}


@pytest.mark.parametrize(
    ("thread", "fields"),
    [("b", {"b": "period: 90 ms"}), ("d4", {"wire": ", rate: 10 Hz"}), ("b", {"a": "communication: let"})],
)
def test_what_is_no_chain(thread: str, fields: dict[str, Any]) -> None:
    """Jobs that are held back, messages at a rate of their own, and what is sent at the deadline."""
    text = file_of("fifo", **fields)
    if "b" in fields:
        text = text.replace(
            "executor: e, dispatch_protocol: aperiodic, compute_execution_time: 21",
            "executor: e, dispatch_protocol: sporadic, compute_execution_time: 21",
        )
    space = space_of(text)
    view = View([0] * len(space.decisions))
    numbers = {item.name: number for number, item in enumerate(space.components)}
    assert [name for name in ("b", "c", "d4") if stage_of(space, (numbers[name], "thread"), view).follows is None] == [
        thread
    ]
    assert known_ms(space)[thread] != {"b": 21, "d4": 7}[thread]


def test_a_message_that_takes_long_is_part_of_the_chain() -> None:
    """18 + 21 + 18 + 7 ms and 36 of a message over a bus are a period; with 37 the last one may wait for another."""
    for latency, is_chain in ((36, True), (37, False)):
        buses = (
            f"bus_types: {{slow: {{virtual: true, latency: {latency} ms}}}}\nbuses: {{net: {{type: slow}}}}\ndevices:"
        )
        text = file_of("fifo", wire=", bus: net, data_size: 1 B").replace("devices:", buses)
        assert (known_ms(space_of(text))["d4"] == 7) is is_chain


URGENT = """
dse: 1
name: more urgent work piles up behind a callback of the chain
processing: response_time
processor_types: {P: {}}
processors: {p: {type: P}, q: {type: P}}
executors: {e: {kind: callback_group, processor: p}}
threads:
  u: {executor: e, period: 15 ms, compute_execution_time: 5 ms, deadline: 1 s}
  b: {executor: e, period: 131 ms, compute_execution_time: 1 ms, deadline: 1 s}
  x: {processor: q, compute_execution_time: 99 ms}
  c: {executor: e, compute_execution_time: 21 ms, deadline: 1 s}
connections: {bx: {from: b, to: x}, xc: {from: x, to: c}}
objectives: [minimise price]
"""


def test_a_less_urgent_callback_of_the_chain_holds_up_what_goes_before_the_next_one() -> None:
    """It ends when b comes: u has come twice in its 21 ms, and once more by the end of these two: 3 * 5 + 1."""
    known = known_ms(space_of(URGENT.replace("131 ms", "200 ms")))
    assert (known["b"], known["c"]) == (16, 26)
    known = known_ms(space_of(URGENT))  # 99 ms between them are too many: each is a stranger to the other
    assert (known["b"], known["c"]) == (37, 27)


def test_two_that_one_releases_wait_for_each_other() -> None:
    """And are no line, so that one waits for all of the other's chain."""
    text = file_of("fifo").replace("bc: {from: b, to: c}", "bc: {from: a, to: c}")
    assert known_ms(space_of(text)) == {"a": 18, "b": 21 + 18 + 7, "c": 18 + 21, "d4": 7 + 21}


@pytest.mark.parametrize("seed", cases(600))
def test_no_run_takes_longer_than_its_bound(seed: int) -> None:
    """And what a job waits for adds up to its bound."""
    rng = random.Random(seed)
    core = chained_callbacks.draw(rng)
    space = space_of(chained_callbacks.text_of(core))
    view = View(())
    ends = all_responses(space, view)
    known = {cast(TaskKey, key): time for key, time in ends.items() if isinstance(key[1], str)}  # no chains
    bounds = {space.components[number].name: time for (number, _), time in known.items()}
    for _ in range(3):
        for name, taken in chained_callbacks.played(core, rng).items():
            bound = bounds[name]
            assert bound is None or taken * MS <= bound, (name, taken, bound, chained_callbacks.text_of(core))
    waits = Waits(space, solution_of(space, view).system, ends)
    for key, time in known.items():
        if time is not None:
            (wait,) = waits.of_thread(key) or ()
            assert wait.response_ns == time


def test_played_runs_come_close_to_bounds() -> None:
    """Else the test above would say little."""
    reached = compared = 0
    for seed in range(60):
        rng = random.Random(seed)
        core = chained_callbacks.draw(rng)
        space = space_of(chained_callbacks.text_of(core))
        known = all_responses(space, View(()))
        runs = [chained_callbacks.played(core, rng) for _ in range(8)]
        for key, time in known.items():
            if time is not None and isinstance(key[1], str):  # no chains, no lags
                longest = max(run.get(space.components[key[0]].name, 0) for run in runs)
                compared, reached = compared + 1, reached + (longest * MS == time)
    assert reached > compared / 3 > 30


@pytest.mark.parametrize("seed", cases(400, 5_000))
def test_bounds_are_no_longer_than_those_of_strangers(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    core = chained_callbacks.draw(random.Random(seed))
    space = space_of(chained_callbacks.text_of(core))
    found = known_ms(space)

    monkeypatch.setattr(Succession, "chains", lambda self, executor: Chains(self.events, ()))
    for name, time in known_ms(space).items():
        mine = found[name]
        assert time is None or (mine is not None and mine <= time)


@pytest.mark.parametrize("seed", cases(40, 9_000))
@pytest.mark.parametrize("limit_ms", [None, 9])
def test_fronts_of_open_kinds_and_cores(limit_ms: int | None, seed: int) -> None:
    """Solved, by looking at every design, and proved again by both methods; without a limit and with a narrow one."""
    core = replace(chained_callbacks.draw(random.Random(seed)), is_open=True)
    by_name = {item.name: item for item in core.callbacks}
    path = [core.callbacks[-1]]
    while path[0].before is not None:
        path.insert(0, by_name[path[0].before])
    flow = f"flows: {{chain: {{path: [{', '.join(item.name for item in path)}]}}}}\n"
    limit = "" if limit_ms is None else f"requirements: [latency of chain <= {limit_ms} ms]\n"
    asked = f"objectives: [minimise latency of chain, minimise response time of {core.callbacks[0].name}]"
    problem = dse.loads(chained_callbacks.text_of(core, more=flow + limit + asked))
    result = dse.solve(problem, workers=1)
    assert result.status in ("complete", "infeasible")
    expected = brute_front(Evaluator(problem.space))
    assert {tuple(point.objectives.values()) for point in result.front} == set(expected)
    for method in METHODS:
        proved = dse.verify(result, problem=problem, method=method)
        assert (proved.status, proved.findings, proved.left_open) == ("verified", (), ())
