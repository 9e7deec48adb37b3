"""Threads with segments: pieces on their own processor and on accelerators, against every design judged by hand."""

from __future__ import annotations

import random

import pytest
from effort import cases
from support import space_of
from thread_segments import LATE, Judge, best_of, draw, every_choice, figures_of, text_of

from dse.analysis.evaluate import Evaluator
from dse.analysis.scheduling import all_responses
from dse.analysis.views import View
from dse.api.problem import loads
from dse.pareto.front import Budget, search_front
from dse.simulation.engine import Setting, simulate_once
from dse.simulation.plan import build_plan
from dse.space.types import Design, Space

MS = 10**6


def design_of(space: Space, choice: dict[str, object]) -> Design:
    names = {f"g{number}.type": name for number, name in enumerate(choice["types"])}  # type: ignore[var-annotated,arg-type]
    names |= {f"t{number}.period": f"{period} ms" for number, period in enumerate(choice["periods"])}  # type: ignore[arg-type]
    names |= {f"t{number}.core": str(core) for number, core in enumerate(choice["cores"])}  # type: ignore[arg-type]
    return tuple(
        item.options.index(names[item.name]) if names.get(item.name) in item.options else 0 for item in space.decisions
    )


@pytest.mark.parametrize("seed", cases(60))
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


@pytest.mark.parametrize("seed", cases(40, 1000))
def test_the_front_is_that_of_every_design(seed: int) -> None:
    system = draw(seed)
    points = {found for choice in every_choice(system) if (found := figures_of(system, choice)) is not None}
    search = search_front(Evaluator(loads(text_of(system)).space), Budget(workers=1))
    assert search.is_complete
    assert sorted((price // 100, min(latency // MS, LATE)) for price, latency in search.points) == best_of(points)


@pytest.mark.parametrize("seed", cases(20, 2000))
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
