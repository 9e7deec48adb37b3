"""Pooled cores: every design is a solution of theirs, and fronts that they answer for are those of every design."""

from __future__ import annotations

from fractions import Fraction
from itertools import islice, product
from random import Random

import pytest
from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.encode.linear import set_domain
from dse.encode.model import EncodedSpace, encode
from dse.search import tuning
from dse.search.front import search_front
from dse.search.solver import bounding, pooled_cores
from dse.search.solver.call import Call
from dse.search.solver.pooled_cores import PoolMemory, Pools
from dse.search.solver.settings import BARE, RELAXED, SolverSettings, sound_solver
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished
from tests.benchmarks.cases import GRID_MS, SPEEDS, nearly_full
from tests.helpers.effort import cases
from tests.helpers.support import evaluated, space_of
from tests.helpers.thread_systems import KINDS, draw, front, text_of
from tests.helpers.tuned import tune

MOST_DESIGNS = 12
HURRIED = 1e-6
"""Work in which nothing is answered."""


def pools_of(encoded: EncodedSpace) -> Pools:
    """The pools of a space that has just learnt that its cores are full."""
    contention = encoded.contention
    assert contention is not None, "nothing is asked about response times"
    contention.without_rows = contention.without_rows or encoded.model.clone()
    for processor in range(len(contention.space.processors)):
        if processor not in contention.known:
            contention._add_rows(processor)
    return Pools(encoded, tuning.DEFAULT.pooled_cores)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(6, 7_000))
def test_every_design_is_a_solution_of_pools(kind: str, seed: int) -> None:
    hold_every_design(Evaluator(space_of(text_of(draw(seed, kind=kind)))), seed)


@pytest.mark.parametrize("seed", cases(10, 7_000))
def test_every_design_is_a_solution_where_threads_choose_their_processor(seed: int) -> None:
    """Of two, one of which may be left out; types have one to three cores, some threads may be on some of them only."""
    rng = Random(seed)
    lines = ["dse: 1", "name: two", "deadlines: all", "overload: allowed", "processor_types:"]
    lines += [f"  {name}: {{cores: {rng.randint(1, 3)}, price: {price} EUR}}" for name, price in (("s", 10), ("f", 30))]
    lines += ["processors: {a: {type: [s, f]}, b: {type: [s, f], optional: true}}"]
    lines += ["devices: {d: {period: 5 ms}}", "threads:"]
    for number in range(3):
        processor = rng.choice(("a", "[a, b]", "[a, b]"))
        work = rng.randint(1, 3)
        periods = ", ".join(f"{period} ms" for period in sorted(rng.sample((4, 5, 6, 8), rng.randint(1, 2))))
        core = rng.choice(("", "", ", core: [1, 2]")) if processor == "a" else ""
        times = f"{{s: {work} ms, f: {max(1, work - 1)} ms}}"
        place = f"processor: {processor}, period: [{periods}]{core}"
        lines.append(f"  t{number}: {{{place}, compute_execution_time: {times}}}")
    lines += ["connections: {c0: {from: d, to: t0}, c1: {from: t0, to: t1}, c2: {from: t1, to: t2}}"]
    lines += ["flows: {f: {path: [d, t0, t1, t2]}}", "objectives: [minimise price, minimise latency of f]"]
    hold_every_design(Evaluator(space_of("\n".join(lines))), seed)


def hold_every_design(evaluator: Evaluator, seed: int) -> None:
    """Designs are solutions with their options and their figures, whichever cores the threads are on."""
    encoded = encode(evaluator)
    pools, weights = pools_of(encoded), [1 for _ in encoded.objectives]
    for turn in range(seed % 4):  # kinds as coarse as they are at first, and finer ones
        for item in pools._classes:
            shares = [Fraction((place + turn) % 5, 2) for place in range(len(item.kinds.rows))]
            item.kinds.split(dict.fromkeys(item.kinds.kinds, shares.__getitem__))
    pools._build()
    contention = encoded.contention
    assert contention is not None
    designs = [design for design, found in evaluated(evaluator).items() if found.is_feasible]
    for design in Random(seed).sample(designs, min(MOST_DESIGNS, len(designs))):
        pools.follow(encoded, weights)
        model = pools.model.clone()
        for decision, option in enumerate(design):
            if option >= 0 and decision not in contention.moved:
                set_domain(model.proto.variables[encoded.options[decision][option].index], 1, 1)
        run = sound_solver()
        assert run.solve(model) == cp_model.OPTIMAL, design
        point = encoded.weigh(design)
        assert point is not None
        assert [run.value(objective.variable) for objective in encoded.objectives] == list(point)


def least_latency_ms(threads: int, cores: int, load: float, seed: int) -> dict[int, float]:
    """For each price the least latency of `nearly_full`, by every choice of periods, partitions and response times."""
    text = nearly_full(threads, cores, load, seed)
    space = space_of(text)
    found = {}
    for name, (price, _) in SPEEDS.items():
        lines = [line for line in text.split("\n") if line.startswith("  t")]
        works = [float(line.split(f"{name}: ")[1].split(" .. ")[1].split(" us")[0]) / 1000 for line in lines]
        starts = [GRID_MS.index(int(line.split("period: [")[1].split(" ms")[0])) for line in lines]
        choices = sorted(product(*(GRID_MS[start : start + 4] for start in starts)), key=sum)
        best = next((sum(one) for one in choices if fits(list(zip(one, works, strict=True)), cores)), None)
        if best is not None:
            found[price] = best + sum(works)
    assert len(space.processors) == 1
    return found


def fits(threads: list[tuple[int, float]], cores: int) -> bool:
    """Whether threads (period and work) are in time on some cores, each put where it fits, or elsewhere."""

    def place(number: int, on: list[list[tuple[int, float]]]) -> bool:
        if number == len(ordered):
            return True
        for core in range(len(on)):
            if core and not on[core - 1]:
                break  # equal cores
            on[core].append(ordered[number])
            if ends_in_time(on[core]) and place(number + 1, on):
                return True
            on[core].pop()
        return False

    if sum(work / period for period, work in threads) > cores:
        return False
    ordered = sorted(threads)
    return place(0, [[] for _ in range(cores)])


def ends_in_time(threads: list[tuple[int, float]]) -> bool:
    """Whether the last of threads, which are ordered by their periods, ends before its next release."""
    period, work = threads[-1]
    response, following = 0.0, work
    while response != following and following <= period + 1e-9:
        response = following
        following = work + sum(-(-round(response * 1000) // (other * 1000)) * time for other, time in threads[:-1])
    return following <= period + 1e-9


@pytest.fixture
def asked_at_once(monkeypatch: pytest.MonkeyPatch) -> list[Answer]:
    """Nothing else answers: what pools say is noted."""
    once, said = Strategy.once, []

    def hurried(
        self: Strategy, settings: SolverSettings, work: float, best: Found | None, most: int | None
    ) -> tuple[Answer | None, Found | None]:
        return (Unfinished(best=best), best) if work <= HURRIED else once(self, settings, work, best, most)

    def noted(solver: Call, memory: PoolMemory, best: Found | None) -> Answer:
        answer = pooled_cores.pooled(solver, memory, best)
        said.append(answer)
        return answer

    monkeypatch.setattr(Strategy, "once", hurried)
    tune(
        monkeypatch,
        lowest_first={"at_once": HURRIED},
        subspaces={"first_work": HURRIED, "brief": (BARE, HURRIED), "sharing_ways": (RELAXED,)},
    )
    monkeypatch.setattr(bounding, "pooled", noted)
    return said


@pytest.mark.parametrize(("threads", "cores", "load"), [(6, 2, 0.8), (7, 3, 0.8), (5, 1, 0.7)])
@pytest.mark.parametrize("few", [0, tuning.PooledCores.few_kinds])
@pytest.mark.parametrize("seed", cases(3, 1))
def test_the_least_latencies_are_those_of_looking_at_every_partition(
    threads: int,
    cores: int,
    load: float,
    seed: int,
    few: int,
    asked_at_once: list[Answer],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With kinds of cores that are there from the start, and with one that is split as solutions need it."""
    tune(monkeypatch, pooled_cores={"few_kinds": few})
    expected = least_latency_ms(threads, cores, load, seed)
    evaluator = Evaluator(space_of(nearly_full(threads, cores, load, seed)))
    found = {point[0] // 100: point[1] / 1e6 for point in search_front(evaluator).points}
    for price, latency in expected.items():
        beaten = any(other < price and expected[other] <= latency for other in expected)
        assert beaten or found[price] == pytest.approx(latency)
    assert asked_at_once


@pytest.mark.parametrize("kind", ["plain", "chained", "stated", "blocked", "ordered", "best", "unequal"])
@pytest.mark.parametrize("seed", cases(4, 7_100))
def test_fronts_are_those_of_looking_at_every_design(kind: str, seed: int, asked_at_once: list[Answer]) -> None:
    system = draw(seed, kind=kind)
    search = search_front(Evaluator(space_of(text_of(system))))
    assert search.is_complete
    assert set(search.points) == front(system)


def test_a_kind_of_cores_is_split_where_a_solution_keeps_none_of_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Until then it stands for all cores; afterwards each of the finer kinds keeps one of the rows."""
    tune(monkeypatch, pooled_cores={"few_kinds": 0})
    evaluator = Evaluator(space_of(nearly_full(8, 2, 0.8, 1)))
    [item] = pools_of(encode(evaluator))._classes
    [coarse] = item.kinds.kinds
    listed = next(listed for listed in item.kinds.choices if len(listed) > 1)
    assert not item.kinds.split({coarse: lambda place: Fraction(1)})
    assert item.kinds.split({coarse: lambda place: Fraction(2 if place in listed else 1)})
    assert len(item.kinds.kinds) == len(listed)
    assert all(kind & set(listed) for kind in item.kinds.kinds)


def test_pools_forget_what_was_fixed_when_the_model_was_kept() -> None:
    """An option that an earlier question had fixed is open again in the next one."""
    encoded = encode(Evaluator(space_of(nearly_full(6, 2, 0.8, 1))))
    fixed = encoded.model.proto.variables[encoded.options[0][0].index]
    before = list(fixed.domain)
    set_domain(fixed, 0, 0)
    pools = pools_of(encoded)
    set_domain(fixed, *before)
    pools.follow(encoded, [1 for _ in encoded.objectives])
    assert list(pools.model.proto.variables[encoded.options[0][0].index].domain) == before
    assert all(
        list(mine.domain) == list(asked.domain)
        for mine, asked in islice(
            zip(pools.model.proto.variables, encoded.model.proto.variables, strict=False), pools._shared
        )
    )


def test_pools_answer_where_cores_are_full(asked_at_once: list[Answer]) -> None:
    """With a proved optimum, with a proof that there is nothing better, or with a bound."""
    for seed in range(1, 7):
        search_front(Evaluator(space_of(nearly_full(8, 2, 0.8, seed))))
    assert {Found, NoSuchDesign} <= {type(answer) for answer in asked_at_once}


def test_what_presolve_loses_is_found_without(asked_at_once: list[Answer], monkeypatch: pytest.MonkeyPatch) -> None:
    """What a solver with presolve says is never taken for a proof, not even that there is nothing."""
    evaluator = Evaluator(space_of(nearly_full(8, 2, 0.8, 1)))
    expected = search_front(evaluator).points.keys()
    asked_at_once.clear()
    monkeypatch.setattr(pooled_cores, "_sketched", lambda *_: None)
    assert search_front(evaluator).points.keys() == expected
    assert asked_at_once


def test_where_nothing_is_left_below_a_bound_pools_say_so(
    asked_at_once: list[Answer], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where the time ends between a proof and the next question, which is then asked of pools first."""
    said: list[bool] = []

    def closed(solver: Call, memory: PoolMemory, best: Found | None) -> Answer:
        top, known = solver.most(best), solver.least
        if top is not None and solver.encoded.contention is not None and solver.encoded.contention.without_rows:
            solver.least = top + 1
            answer = pooled_cores.pooled(solver, memory, best)
            solver.least = known
            said.append(answer is best or isinstance(answer, NoSuchDesign))
        return pooled_cores.pooled(solver, memory, best)

    monkeypatch.setattr(bounding, "pooled", closed)
    for seed in range(1, 4):
        search_front(Evaluator(space_of(nearly_full(8, 2, 0.8, seed))))
    assert said and all(said) and not asked_at_once
