"""Threads with segments: pieces on their own processor and on accelerators, against every design judged by hand."""

from __future__ import annotations

import json
import random
from copy import deepcopy
from functools import cache
from itertools import count
from typing import Any, Literal

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling.responses import all_responses
from dse.analysis.views import View
from dse.encode.model import EncodedSpace
from dse.encode.scheduling import waiting_forms
from dse.encode.scheduling.contention import Contention
from dse.encode.scheduling.reasons import Reason
from dse.questions.problem import loads
from dse.questions.verbs.export import export
from dse.search.front import SearchLimits, search_front
from dse.simulation.engine import simulate_once
from dse.simulation.observing import Setting
from dse.simulation.plan import build_plan
from dse.space.model.space import Design, Space
from dse.support.errors import UsageError
from dse.verification import tables
from dse.verification.model import SecondModel
from tests.helpers.effort import cases
from tests.helpers.support import space_of
from tests.helpers.thread_segments import LATE, Judge, best_of, draw, every_choice, figures_of, text_of

MS = 10**6


def design_of(space: Space, choice: dict[str, Any]) -> Design:
    names = {f"g{number}.type": name for number, name in enumerate(choice["types"])}
    names |= {f"t{number}.period": f"{period} ms" for number, period in enumerate(choice["periods"])}
    names |= {f"t{number}.core": str(core) for number, core in enumerate(choice["cores"])}
    return tuple(
        item.options.index(names[item.name]) if names.get(item.name) in item.options else 0 for item in space.decisions
    )


@pytest.mark.parametrize("seed", cases(20))
def test_every_response_time_is_the_bound(seed: int) -> None:
    system = draw(seed)
    space = space_of(text_of(system))
    numbers = {item.name: number for number, item in enumerate(space.components)}
    choices = list(every_choice(system))
    for choice in random.Random(seed).sample(choices, min(len(choices), 12)):
        found = all_responses(space, View(design_of(space, choice)))
        judge = Judge(system, choice)
        for number in range(len(system["threads"])):
            known, expected = found[numbers[f"t{number}"], "thread"], judge.response(number)
            assert (known is None and expected >= LATE) or known == expected * MS, (number, choice)


@pytest.mark.parametrize("seed", cases(15, 1000))
def test_the_front_is_that_of_every_design(seed: int) -> None:
    problem, best = best_by_hand(seed)
    search = search_front(Evaluator(problem.space), SearchLimits(workers=1))
    assert search.is_complete
    assert best_of({(price // 100, min(latency // MS, LATE)) for price, latency in search.points}) == best


@pytest.mark.parametrize("seed", cases(10, 2000))
def test_no_run_is_longer_than_the_bound(seed: int) -> None:
    """Cores as in the choice; offsets and execution times as they come."""
    system = draw(seed)
    space = space_of(text_of(system))
    evaluator = Evaluator(space)
    rng = random.Random(seed)
    choice = rng.choice(list(every_choice(system)))
    whole = evaluator.evaluate(design_of(space, choice)).design
    cores = {
        number: choice["cores"][int(item.stated_as[1:])] if item.executor is None else 1
        for number, item in enumerate(space.components)
        if item.section == "threads"
    }
    judge = Judge(system, choice)
    plan = build_plan(space, whole, cores=cores, endless_queues=True)
    for run in range(6):
        offsets = {name: rng.randrange(int(period)) for name, period in plan.timers.items()} if run else {}
        setting = Setting(600 * MS, 600 * MS, offsets, execution="max" if run % 2 else "random", seed=run)
        seen = simulate_once(plan, setting).responses
        for number in range(len(system["threads"])):
            assert seen.get(f"t{number}", 0) <= judge.response(number) * MS


DOCUMENT = """
dse: 1
name: pieces
processor_types: {cpu: {}, gpu: {serves: SERVES}}
processors: {p: {type: cpu}, g: {type: gpu}}
threads:
  one: {processor: p, period: 33 ms, segments: [
        {compute_execution_time: 2 ms}, {processor: g, compute_execution_time: 8 ms}, {compute_execution_time: 1 ms}]}
  two: {processor: p, period: 50 ms, segments: [
        {compute_execution_time: 4 ms}, {processor: g, compute_execution_time: 12 ms}, {compute_execution_time: 3 ms}]}
objectives: [minimise price]
"""


def ends_ms(text: str) -> dict[str, float | None]:
    space = space_of(text)
    found = all_responses(space, View([0] * len(space.decisions)))
    return {space.components[key[0]].name: None if end is None else float(end) / MS for key, end in found.items()}


def test_the_example_of_the_document() -> None:
    """docs/semantics.md, section 4.7."""
    found = ends_ms(DOCUMENT.replace("SERVES", "fifo"))
    assert found == {
        "one (piece 1)": 2, "one (piece 2)": 22, "one": 23, "two (piece 1)": 7, "two (piece 2)": 27, "two": 31,
    }  # fmt: skip


BEHIND = """
dse: 1
name: behind an earlier piece
processing: response_time
overload: allowed
processor_types: {cpu: {}, gpu: {serves: SERVES}}
processors: {p: {type: cpu}, g: {type: gpu}}
threads:
  one: {processor: p, priority: 1, period: 40 ms, segments: [PIECES]}
  other: {processor: HERE, period: 4 ms, compute_execution_time: 2 ms, priority: OTHER}
objectives: [minimise price]
"""
SERVED = "{compute_execution_time: 1 ms}, {processor: g, compute_execution_time: 8 ms}, {processor: g, LAST}"
BETWEEN = "{compute_execution_time: 8 ms}, {processor: g, compute_execution_time: 1 us}, {LAST}"


@pytest.mark.parametrize(
    ("serves", "here", "other", "end_ms"),
    [("fifo", "g", 2, 19), ("priority", "g", 2, 21), ("priority", "g", 1, None), ("fifo", "p", 1, None)],
)
def test_what_waited_for_a_piece_goes_before_the_next(serves: str, here: str, other: int, end_ms: int | None) -> None:
    """While the 8 ms run jobs of the other come: a run shows that the last piece waits for more than one of them.

    The first two are those of the document.
    """
    pieces = (SERVED if here == "g" else BETWEEN).replace("LAST", "compute_execution_time: 2 ms")
    text = BEHIND.replace("SERVES", serves).replace("PIECES", pieces).replace("HERE", here).replace("OTHER", str(other))
    end = ends_ms(text)["one"]
    assert end is not None and end_ms in (None, end)
    simulation = dse.simulate(loads(text), runs=12, execution="max")
    [seen_ns] = [item.observed_ns for item in simulation.tasks if item.name == "one"]
    assert 13 * MS < seen_ns <= end * MS
    assert simulation.contradictions == ()


def test_pieces_alone_never_wait_for_each_other() -> None:
    """Twice the CPU and twice the GPU within one period: what they take together, though each uses 4 of 10 ms."""
    pieces = ", ".join(
        f"{{{place}compute_execution_time: 2 ms}}" for place in ("", "processor: g, ", "", "processor: g, ")
    )
    text = DOCUMENT.replace("SERVES", "priority").partition("threads:")[0]
    text += f"threads: {{one: {{processor: p, period: 10 ms, segments: [{pieces}]}}}}\nobjectives: [minimise price]\n"
    assert ends_ms(text) == {"one (piece 1)": 2, "one (piece 2)": 4, "one (piece 3)": 6, "one": 8}
    assert set(ends_ms(text.replace("period: 10 ms", "period: 7 ms")).values()) == {None}


def test_a_job_that_may_end_after_the_next_release_has_no_bound() -> None:
    late = DOCUMENT.replace("SERVES", "fifo").replace("33 ms", "22 ms")
    found = ends_ms(late)
    assert found["one"] is None and found["one (piece 1)"] is None and found["two"] is None


def test_what_knows_no_segments_says_so() -> None:
    problem = loads(text_of(draw(3)))
    with pytest.raises(UsageError, match="knows no segments"):
        problem.ask(profile="osate-2.19")
    pieces = loads(DOCUMENT.replace("SERVES", "fifo"))
    result = dse.solve(pieces)
    with pytest.raises(UsageError, match="AADL cannot say all of this design: one has segments"):
        export(result, 1, "aadl")
    assert dse.verify(result, problem=pieces).exit_code == 0


def test_the_times_of_segments_have_margins() -> None:
    """Each is an input of its own: the GPU's 8 ms may grow by 33 - 23 ms, until the first thread's deadline."""
    shorter = DOCUMENT.replace("SERVES", "fifo").replace(", {compute_execution_time: 3 ms}]", "]")
    found = dse.sensitivity(loads(shorter + "deadlines: all\n"), front=False)
    above = {item.path.removeprefix("threads.one.segments"): item.above for item in found.margins}
    longer = {place: item.last for place, item in above.items() if place.startswith("[") and item is not None}
    assert {place[:3] for place in longer} == {"[0]", "[1]", "[2]"}
    assert longer["[1].compute_execution_time"] == 18 * MS


WAITS_ONLY_FOR_THE_ACCELERATOR = """
dse: 1
name: late whatever its core
deadlines: none
processor_types:
  cpu: {cores: 4, price: 30 EUR}
  gpu: {serves: fifo, price: 5 EUR}
processors: {p: {type: cpu}, g: {type: gpu}}
threads:
  a: {processor: p, core: any, period: 6 ms, compute_execution_time: 3 ms}
  b: {processor: p, core: any, period: 20 ms, compute_execution_time: 1 ms}
  c: {processor: p, core: any, period: 30 ms, compute_execution_time: 1 ms}
  long: {processor: p, core: 1, period: 40 ms, segments: [{compute_execution_time: 1 ms},
    {processor: g, compute_execution_time: 8 ms}, {compute_execution_time: 1 ms}]}
  short: {processor: p, core: first_fit, period: 20 ms, segments: [{compute_execution_time: 1 ms},
    {processor: g, compute_execution_time: 1 ms}, {compute_execution_time: 1 ms}]}
requirements: [response time of short <= 10 ms]
objectives: [minimise utilisation of p]
"""


def test_what_is_late_on_any_core_is_refuted_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thread placed by first-fit waits for another on the accelerator: where the others run does not matter."""
    learnt: list[Reason] = []
    forbid = Contention._forbid

    def noted(self: Contention, late: Any, reason: Reason) -> None:
        learnt.append(reason)
        forbid(self, late, reason)

    monkeypatch.setattr(Contention, "_forbid", noted)
    search = search_front(Evaluator(loads(WAITS_ONLY_FOR_THE_ACCELERATOR).space), SearchLimits())
    assert search.is_complete
    assert not search.points
    assert len(learnt) < 4


def test_how_far_segments_must_move_is_learnt_for_many_designs_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """No figure of a response time is made exact for one combination of options at a time."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    made = []
    sharpen = EncodedSpace.sharpen

    def noted(self: EncodedSpace, design: Design, value: Any) -> bool:
        made.append(design)
        return sharpen(self, design, value)

    monkeypatch.setattr(EncodedSpace, "sharpen", noted)
    found = dse.explain(WAITS_ONLY_FOR_THE_ACCELERATOR)
    assert (found.status, found.complete, made) == ("infeasible", True, [])
    [moved] = found.relaxations
    assert moved.closest == 11 * MS  # its own pieces, and that of the other on the accelerator


@pytest.mark.parametrize("seed", cases(8, 5000))
def test_a_limit_on_pieces_with_too_many_cases_is_learnt_by_the_second_proof(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no table holds how late pieces end, the analysis judges designs; the cheapest one is the same."""
    monkeypatch.setattr(tables, "FEW_CASES", 1)
    system = draw(seed)
    points = {found for choice in every_choice(system) if (found := figures_of(system, choice)) is not None}
    limits = sorted({latency for _, latency in points if latency < LATE})
    for limit in limits[:1]:
        text = text_of(system, ("minimise price",)) + f"requirements:\n  - latency of f <= {limit} ms\n"
        evaluator = Evaluator(loads(text).space)
        model = SecondModel(tables.build_tables(evaluator))
        cheapest = min(price for price, latency in points if latency <= limit)
        assert model.in_region([100 * cheapest]).answer == "none"
        assert model.in_region([100 * cheapest + 1]).answer == "design"


def best_by_hand(seed: int) -> tuple[dse.Problem, list[tuple[int, int]]]:
    """A drawn system, and the front (EUR, ms) of all its designs."""
    system = draw(seed)
    points = {found for choice in every_choice(system) if (found := figures_of(system, choice)) is not None}
    return loads(text_of(system)), best_of(points)


@cache
def with_designs(seed: int) -> tuple[dse.Problem, list[tuple[int, int]]]:
    """The first drawn system from a seed on in which some design meets its deadlines."""
    return next(found for number in count(10 * seed) if (found := best_by_hand(number))[1])


@pytest.mark.parametrize("seed", cases(6, 6000))
def test_the_search_learns_what_pieces_wait_for(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no table holds it: one variable for all figures that hang on when the last piece ends."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 1)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    problem, best = with_designs(seed)
    search = search_front(Evaluator(problem.space), SearchLimits(workers=1))
    assert search.is_complete
    assert best_of({(price // 100, min(latency // MS, LATE)) for price, latency in search.points}) == best


@pytest.mark.parametrize("seed", cases(6, 6000))
def test_the_second_proof_learns_what_pieces_wait_for(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside each point of the front nothing is better, and it is there itself."""
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)  # no response time is tabulated
    problem, best = with_designs(seed)
    model = SecondModel(tables.build_tables(Evaluator(problem.space)))
    for price, latency in best:
        below = None if latency >= LATE else latency * MS + 1
        assert model.in_region([100 * price + 1, below]).answer == "design"
        assert model.in_region([100 * price, below]).answer == "none"
        if below is not None:
            assert model.in_region([100 * price + 1, below - 1]).answer == "none"


def robust_by_hand(seed: int) -> tuple[dse.Problem, list[tuple[int, int]]] | None:
    """A drawn system of which a piece may take 1 ms more, and its robust front (EUR, ms); None without one."""
    system = draw(seed)
    pieces = [
        (number, place)
        for number, thread in enumerate(system["threads"])
        for place, item in enumerate(thread["pieces"])
        if thread["kind"] == "segments" and item["place"] is None and item["best"]["a"] < item["a"]
    ]
    if not pieces:
        return None
    number, place = random.Random(seed).choice(pieces)
    longer = deepcopy(system)
    piece = longer["threads"][number]["pieces"][place]
    longest = piece["a"]
    piece |= {"a": longest + 1, "b": longest + 1}
    figures = {
        (found, figures_of(longer, choice))
        for choice in every_choice(system)
        if (found := figures_of(system, choice)) is not None
    }
    worst = sorted({late[1] for _, late in figures if late is not None and late[1] < LATE})
    if not worst:
        return None
    limit = worst[len(worst) // 2]
    path = f"threads.t{number}.segments[{place}].compute_execution_time.max"
    text = text_of(system) + f"requirements: [latency of f <= {limit} ms]\n"
    text += f"uncertainty: {{'{path}': {{range: {longest} ms .. {longest + 1} ms}}}}\n"
    return loads(text), best_of({found for found, late in figures if late is not None and late[1] <= limit})


@pytest.mark.parametrize("seed", cases(4, 8002))
def test_robust_fronts_of_pieces_are_proved_without_tables(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Limits at other figures than the nominal ones are learnt, too; a front without its last point is refused."""
    monkeypatch.setattr(tables, "FEW_DECISIONS", -1)
    monkeypatch.setattr(tables, "FEW_CASES", 1)
    problem, best = next(found for number in count(10 * seed) if (found := robust_by_hand(number)) is not None)
    result = dse.solve_robust(problem, workers=1)
    seen = [(item.objectives["price"] // 100, item.objectives["latency of f"] // MS) for item in result.robust.front]
    assert sorted(seen) == best
    told = json.loads(result.to_json())
    last = told["front"].pop()
    told["refuted"].insert(0, {name: value + 1 for name, value in last["objectives"].items()})
    methods: tuple[Literal["model", "exhaustion"], ...] = ("model", "exhaustion")
    for method in methods:
        assert dse.verify(result, problem=problem, method=method).status == "verified", method
        assert dse.verify(told, problem=problem, method=method).status == "rejected", method


LAST_ON_THE_ACCELERATOR = """
dse: 1
name: the last piece is served
overload: allowed
processor_types: {cpu: {}, gpu: {serves: fifo}}
processors: {p: {type: cpu}, g: {type: gpu}}
bus_types: {can: {bandwidth: 1 Mbit/s}, dds: {virtual: true, transmission_time: {cpu: {fixed: 1 ms}}}}
buses: {wire: {type: can}, middleware: {type: dds, bus: wire}}
devices: {valve: {}}
threads:
  one: {processor: p, process: node, period: 40 ms, segments: [
        {processor: g, compute_execution_time: 1 ms}, {compute_execution_time: 1 ms},
        {processor: g, compute_execution_time: 1 ms}]}
  two: {processor: p, process: node, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections:
  inside: {from: one, to: two, data_size: 100 B, bus: middleware}
  back: {from: two, to: one, data_size: 100 B, bus: middleware, port: data}
  outside: {from: one, to: valve, data_size: 10 B, bus: middleware}
flows: {f: {path: [one, two]}, g: {path: [one, outside, valve]}}
objectives: [minimise price]
"""


def test_a_thread_sends_from_its_own_processor_and_process_wherever_its_last_piece_runs() -> None:
    """docs/semantics.md, section 3.3: no bus inside a process, and middleware runs where the thread does."""
    space = space_of(LAST_ON_THE_ACCELERATOR)
    evaluator = Evaluator(space)
    design = evaluator.evaluate((0,) * len(space.decisions)).design
    found = evaluator.metric_values(design)
    assert (found["latency of f"], found["latency of g"]) == (4 * MS, 4 * MS)
    assert found["load of wire"] == 10 * 25
    plan = build_plan(space, design, cores={}, endless_queues=True)
    run = simulate_once(plan, Setting(200 * MS, 200 * MS, {}, execution="max", seed=0))
    assert [max(times) for times in run.latencies] == [4 * MS, 4 * MS]
