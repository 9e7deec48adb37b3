"""What is said to be enough is, and 1 ns less is not; what late threads are said to wait for adds up.

Executors of all kinds, accelerators, segments, sections that nothing interrupts, threads that others dispatch.
"""

from __future__ import annotations

import json
import random
from copy import deepcopy
from typing import Any

import pytest

import dse
from dse.analysis.diagnosis.lateness import Late, late_threads
from dse.analysis.diagnosis.shortening import Shorter
from dse.analysis.evaluate import Evaluator
from dse.analysis.views import View
from dse.questions.problem import load
from dse.report.words.lateness import late_words
from tests.helpers.effort import cases

MS = 10**6


def late_in(data: dict[str, Any]) -> dict[str, Late]:
    """The late threads of a problem with a single design."""
    space = load(data).space
    design = (0,) * len(space.decisions)
    return {item.thread: item for item in late_threads(space, Evaluator(space).evaluate(design).verdicts, View(design))}


def words_of(data: dict[str, Any]) -> list[str]:
    return [late_words(item) for item in late_in(data).values()]


def problem(**more: Any) -> dict[str, Any]:
    return {
        "dse": 1, "name": "cuts", "deadlines": "all", "overload": "allowed", "objectives": ["minimise price"],
        "processor_types": {"cpu": {"price": "1 EUR"}}, "processors": {"p": {"type": "cpu"}}, **more,
    }  # fmt: skip


def ms(value: float) -> str:
    return f"{round(value * MS)} ns"


def drawn(rng: random.Random) -> dict[str, Any]:
    """A core with plain threads, some in an executor, some with pieces on an accelerator, some dispatched by others."""
    kinds = rng.sample(("plain", "executor", "segments", "served"), rng.randint(1, 3))
    data = problem()
    kind_of_e, serves = rng.choice(("fifo", "callback_group", "wait_set")), rng.choice(("fifo", "priority"))
    if {"segments", "served"} & {*kinds}:
        data["processor_types"]["gpu"] = {"serves": serves}
        data["processors"]["g"] = {"type": "gpu"}
    threads: dict[str, Any] = {}
    connections: dict[str, Any] = {}
    for number in range(rng.randint(2, 4)):
        name, kind, period = f"t{number}", rng.choice(kinds), rng.choice((8, 10, 12, 20, 30))
        longest = max(1, period * 4 // 10)
        found: dict[str, Any] = {"period": f"{period} ms", "deadline": f"{rng.randint(2, period)} ms"}
        in_turn = (kind == "executor" and kind_of_e != "callback_group") or (kind == "served" and serves == "fifo")
        if rng.random() < 0.6 and not in_turn:
            found["priority"] = rng.randint(1, 3)
        if kind == "segments":
            pieces = [
                {"compute_execution_time": ms(rng.randint(1, max(1, longest // 2)))} for _ in range(rng.randint(2, 4))
            ]
            for place, piece in enumerate(pieces):
                if place % 2:
                    piece["processor"] = "g"
            threads[name] = {"processor": "p", **found, "segments": pieces}
            continue
        if kind == "executor":
            found["executor"] = "e"
            data["executors"] = {"e": {"processor": "p", "kind": kind_of_e}}
        else:
            found["processor"] = "g" if kind == "served" else "p"
        found["compute_execution_time"] = ms(rng.randint(1, longest))
        if kind == "plain" and rng.random() < 0.5:
            found["non_preemptive"] = f"{rng.randint(1, 4)} ms"
        if threads and rng.random() < 0.25:
            del found["period"]
            found["dispatch_protocol"] = "aperiodic"
            connections[f"c{number}"] = {"from": rng.choice(list(threads)), "to": name}
        threads[name] = found
    return {**data, "threads": threads, **({"connections": connections} if connections else {})}


def cut(data: dict[str, Any], item: Shorter, by_ns: int) -> dict[str, Any]:
    """The problem with so much less of what is named."""
    changed = deepcopy(data)
    name, _, piece = item.name.partition(" (piece ")
    thread = changed["threads"][name]
    if piece:
        thread = thread["segments"][int(piece.rstrip(")")) - 1]
    if item.section:
        unit, had = "non_preemptive", thread["non_preemptive"]
        longest = min(_ns(had), _ns(thread["compute_execution_time"]))
        if by_ns == longest:
            del thread[unit]
        else:
            thread[unit] = f"{longest - by_ns} ns"
    else:
        thread["compute_execution_time"] = f"{_ns(thread['compute_execution_time']) - by_ns} ns"
    return changed


def _ns(text: str) -> int:
    number, unit = text.split()
    return int(number) * {"ms": MS, "ns": 1}[unit]


@pytest.mark.parametrize("seed", cases(300))
def test_cuts_are_enough_and_no_smaller_ones_are(seed: int) -> None:
    rng = random.Random(f"cuts {seed}")
    data = drawn(rng)
    for name, late in late_in(data).items():
        if late.late_ns is not None:
            assert late.limit_ns is not None
            assert late.ends_ns == late.late_ns + late.limit_ns, (json.dumps(data), late)
        assert late_words(late)
        for item in late.shorter[:4]:
            assert name not in late_in(cut(data, item, item.by_ns)), (json.dumps(data), name, item)
            if item.by_ns > 1:
                assert name in late_in(cut(data, item, item.by_ns - 1)), (json.dumps(data), name, item)


def pieces(*times: float, on: str = "g") -> list[dict[str, Any]]:
    """Segments on the core and, every second one, on the accelerator."""
    return [
        {"compute_execution_time": ms(time), **({"processor": on} if place % 2 else {})}
        for place, time in enumerate(times)
    ]


def gpu(serves: str, detection: float, sfm: dict[str, Any]) -> dict[str, Any]:
    """The conflict of the WATERS 2019 challenge: a short thread behind the kernel of a long one."""
    found = problem(
        threads={
            "Detection": {"processor": "p", "period": "200 ms", "core": 2, "segments": pieces(3, detection, 1)},
            "SFM": {"processor": "p", "core": 1, "segments": pieces(3, 8, 4), **sfm},
        }
    )
    found["processor_types"] = {"cpu": {"cores": 2, "price": "1 EUR"}, "gpu": {"serves": serves}}
    found["processors"]["g"] = {"type": "gpu"}
    return found


@pytest.mark.parametrize("serves", ["fifo", "priority"])
def test_a_kernel_that_is_too_long(serves: str) -> None:
    """3 + 116 + 8 + 4 = 131 ms of 33 ms; with 18 ms of the kernel it is 33 ms. Detection itself is only a victim."""
    data = gpu(serves, 116, {"period": "33 ms"})
    enough = "in time with 98 ms less of Detection (piece 2) each time"
    behind = (
        "behind 1 job of Detection (piece 2) (116 ms) on g: a job would end 131 ms after its release, at the least, "
        "and has to end before the next one, 33 ms after it"
    )
    assert words_of(data) == [
        f"Detection ends late without a bound on core 2 of p because SFM has none; {enough}",
        f"SFM ends late without a bound on core 1 of p: 15 ms of its own, {behind}; {enough}",
    ]
    assert late_in(gpu(serves, 18, {"period": "33 ms"})) == {}
    victim, late = dse.explain(data).to_dict()["give_up"]["late"]
    assert (victim["thread"], victim["endless"], victim["waits"]) == ("Detection", ["SFM"], [])
    assert (late["ends_ns"], late["apart_ns"], late["late_ns"]) == (131 * MS, 33 * MS, None)
    assert [item["response_ns"] for item in late["waits"]] == [3 * MS, 124 * MS, 4 * MS]
    assert late["waits"][1]["delays"] == [{"name": "Detection (piece 2)", "jobs": 1, "work_ns": 116 * MS}]
    assert late["shorter"] == [{"name": "Detection (piece 2)", "by_ns": 98 * MS, "section": False}]


def test_segments_with_a_bound() -> None:
    """3 + 18 + 8 + 4 = 33 ms of 30 ms."""
    [said] = words_of(gpu("fifo", 18, {"period": "40 ms", "deadline": "30 ms"}))
    assert said == (
        "SFM ends 3 ms late on core 1 of p: 15 ms of its own, behind 1 job of Detection (piece 2) (18 ms) on g; in "
        "time with 3 ms less of SFM (piece 2) each time, or 3 ms less of SFM (piece 3) each time, or 3 ms less of "
        "Detection (piece 2) each time"
    )


def test_segments_that_are_bounded_by_their_core_alone() -> None:
    """The example of the semantics (4.7): 4 + 20 + 3 ms and three pieces of the other, 4 ms; all on one core."""
    data = problem(
        threads={
            "x": {"processor": "p", "period": "33 ms", "segments": pieces(2, 8, 1)},
            "y": {"processor": "p", "period": "50 ms", "deadline": "30 ms", "segments": pieces(4, 12, 3)},
        }
    )
    data["processor_types"]["gpu"] = {"serves": "fifo"}
    data["processors"]["g"] = {"type": "gpu"}
    [said] = words_of(data)
    assert said.startswith(
        "y ends 1 ms late on core 1 of p: 19 ms of its own, behind 1 job of x (piece 2) (8 ms) on g; "
        "1 job of x (piece 1) (2 ms), 2 jobs of x (piece 3) (2 ms) on core 1 of p; in time with "
    )


@pytest.mark.parametrize("kind", ["fifo", "callback_group", "wait_set"])
def test_an_executor(kind: str) -> None:
    """2 + 9 = 11 ms of 10 ms."""
    data = problem(
        executors={"node": {"processor": "p", "kind": kind}},
        threads={
            "ctrl": {"executor": "node", "period": "10 ms", "compute_execution_time": "2 ms"},
            "map": {"executor": "node", "period": "100 ms", "compute_execution_time": "9 ms"},
        },
    )
    enough = "in time with 1 ms less of ctrl each time, or 1 ms less of map each time"
    assert words_of(data) == [
        f"ctrl ends 1 ms late on core 1 of p: 2 ms of its own, behind 1 job of map (9 ms); {enough}"
    ]


def test_an_earlier_job_of_its_own() -> None:
    """The second instance of C on a CAN bus (Davis and others 2007): 7 ms after the beginning, released at 3.5 ms."""
    data = problem(threads={})
    data["processor_types"], data["processors"] = (
        {"can": {"serves": "priority", "price": "1 EUR"}},
        {"p": {"type": "can"}},
    )
    for priority, (name, period, deadline) in enumerate((("A", 2500, 2500), ("B", 3500, 3250), ("C", 3500, 3250))):
        data["threads"][name] = {
            "processor": "p", "period": f"{period} us", "deadline": f"{deadline} us", "priority": 3 - priority,
            "compute_execution_time": "1 ms",
        }  # fmt: skip
    late = late_in(data)["C"]
    assert late_words(late).partition("; in time with ")[0] == (
        "C ends 0.25 ms late on p: 1 ms of its own, behind 1 earlier job of its own (1 ms), 3 jobs of A (3 ms), "
        "2 jobs of B (2 ms), of which 3.5 ms are over when it is released"
    )
    [wait] = late.waits
    assert wait.response_ns == 3.5 * MS
    assert (wait.earlier_jobs, wait.earlier_ns, wait.over_ns) == (1, MS, 3.5 * MS)
    assert {item.name: item.by_ns for item in late.shorter} == dict.fromkeys("CAB", 1)
    # any shorter, and a job of C begins before the next one of A comes: 2.5 ms


def test_a_section_of_a_less_urgent_thread() -> None:
    """The Mars Pathfinder: 25 + 25 + 75 ms of 87.5 ms; a section of 37.5 ms would be enough, whatever else."""
    times = {"bc_sched": (125, 25, 100), "bc_dist": (125, 25, 90), "meteo": (5000, 75, 10)}
    threads: dict[str, Any] = {
        name: {"processor": "p", "period": f"{period} ms", "compute_execution_time": f"{time} ms", "priority": priority}
        for name, (period, time, priority) in times.items()
    }
    threads["bc_dist"]["deadline"] = "87.5 ms"
    threads["meteo"]["non_preemptive"] = "75 ms"
    data = problem(threads=threads)
    [late] = late_in(data).values()
    assert late_words(late) == (
        "bc_dist ends 37.5 ms late on core 1 of p: 25 ms of its own, behind 1 job of bc_sched (25 ms), the 75 ms "
        "section of meteo that has begun; in time with 37.5 ms less of the section of meteo"
    )
    assert late.shorter == (Shorter("meteo", 37_500_000, section=True),)
    assert late.waits[0].blocked_by == "meteo"
    threads["meteo"]["non_preemptive"] = "37.5 ms"
    assert late_in(data) == {}


def test_what_is_late_by_itself() -> None:
    """12.437 ms of 12 ms."""
    data = problem(threads={"Planner": {"processor": "p", "period": "12 ms", "compute_execution_time": "12437 us"}})
    [said] = words_of(data)
    assert said == (
        "Planner ends late without a bound on core 1 of p: 12.437 ms of its own, more than its 12 ms even by itself; "
        "in time with 0.437 ms less of Planner each time"
    )


def test_no_bound_though_there_is_enough() -> None:
    """Jobs of b come when a has ended, up to 2 ms late, so that two may come at once, and so on: no overload."""
    chain = {"dispatch_protocol": "aperiodic", "processor": "p"}
    data = problem(
        threads={
            "a": {"processor": "p", "period": "100 ms", "compute_execution_time": "17.9 ms", "priority": 1},
            "b": {**chain, "compute_execution_time": "20.6 ms", "priority": 2, "deadline": "100 ms"},
            "c": {**chain, "compute_execution_time": "17.9 ms", "priority": 3, "deadline": "100 ms"},
        },
        connections={"ab": {"from": "a", "to": "b"}, "bc": {"from": "b", "to": "c"}},
    )
    for late in late_in(data).values():
        assert late.full is None
    assert all("more than there is" not in text for text in words_of(data))


def test_the_greatest_figures_are_told_first() -> None:
    """Six of eight threads that go before a ninth are named, and four cuts."""
    threads: dict[str, Any] = {
        f"t{number}": {
            "processor": "p",
            "period": "100 ms",
            "compute_execution_time": f"{number + 5} ms",
            "priority": 9,
        }
        for number in range(8)
    }
    threads["late"] = {"processor": "p", "period": "100 ms", "deadline": "66 ms", "compute_execution_time": "4 ms"}
    [said] = (late_words(item) for name, item in late_in(problem(threads=threads)).items() if name == "late")
    assert ", 2 jobs of 2 others (11 ms); in time with " in said
    assert said.count(" each time") == 4
    assert said.endswith(" each time (or of 2 more: --json)")
