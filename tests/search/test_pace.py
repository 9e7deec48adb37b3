"""Checkpoints cost a small share of the time, whatever the size of the result and however slow its writing is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

import dse
from dse.analysis.measures import Measure
from dse.analysis.views import View
from dse.answers.result import Result
from dse.questions.verbs.solve import Watcher, solve_asked
from dse.search import workers
from dse.search.front import SearchLimits
from dse.search.workers import CHECKPOINT_S, Pace

INMARK = Path(__file__).parents[2] / "problems" / "inmark.yaml"


class Clock:
    """Time that passes when it is told to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr(workers.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(workers.time, "thread_time", lambda: self.now)

    def passing(self, seconds: float) -> Callable[[], None]:
        def checkpoint() -> None:
            self.now += seconds

        return checkpoint


@pytest.mark.parametrize("fixed_s", [0.0, 0.02, 0.5])
@pytest.mark.parametrize("cost_s", [0.00001, 0.0003, 0.003])
@pytest.mark.parametrize("step_s", [0.01, 0.3])
def test_checkpoints_cost_little(fixed_s: float, cost_s: float, step_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each call finds a point; a checkpoint costs something, and so much for each point that there is."""
    clock = Clock(monkeypatch)
    begun, spent, made = clock.now, 0.0, list[tuple[float, float]]()
    ours = Pace(begun)
    for size in range(1, 3000):
        clock.now += step_s
        before = clock.now
        ours.keep(size, clock.passing(fixed_s + cost_s * size))
        if clock.now > before:
            spent += clock.now - before
            made.append((before - begun, clock.now - before))
            at_first = sum(cost for _, cost in made[:2])  # what there is to learn from
            assert spent <= 0.05 * (clock.now - begun) + at_first
    ends = [at for at, _ in made] + [3000 * step_s + spent]
    if cost_s / step_s < workers.SHARE / 10 and fixed_s < 0.1:  # what is found costs less than there is to spend
        assert all(later < 1.5 * at + 4 for at, later in pairwise(ends))  # little is lost with a run


def test_the_clock_starts_when_the_writing_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    ours = Pace(clock.now)
    clock.now += CHECKPOINT_S
    assert ours.is_due(5)
    ours.spend(5, clock.passing(3 * CHECKPOINT_S))
    clock.now += CHECKPOINT_S / 2
    assert not ours.is_due(5)
    for _ in range(7):
        clock.now += CHECKPOINT_S
        assert not ours.is_due(5)
    clock.now += 5 * CHECKPOINT_S
    assert ours.is_due(50)
    ours.spend(50, clock.passing(3 * CHECKPOINT_S))
    affordable = ours.started + 9 * CHECKPOINT_S / workers.SHARE  # both, and one more that costs as much
    while clock.now < affordable - CHECKPOINT_S:
        assert not ours.is_due(50)
        clock.now += CHECKPOINT_S
    clock.now = affordable + CHECKPOINT_S
    assert ours.is_due(50)


def test_waiting_counts_where_it_is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    monkeypatch.setattr(workers.time, "thread_time", lambda: 0.0)  # a slow disk, or other work
    ours = Pace(clock.now)
    ours.spend(5, clock.passing(workers.WAIT_S))
    assert not ours.spent_s
    ours.spend(5, clock.passing(1.0))
    assert ours.spent_s == pytest.approx(1.0 - workers.WAIT_S)


def test_a_checkpoint_computes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of a design are computed once, for the answer; what is kept while the search goes on has none."""
    monkeypatch.setattr(workers, "CHECKPOINT_S", 0.0)
    monkeypatch.setattr(workers, "SHARE", 1e9)
    seen: Counter[tuple[str, tuple[int, ...]]] = Counter()
    integer = Measure.integer

    def counting(self: Measure, view: View) -> int:
        if self.metric.kind == "power":  # of every design in a result, and of nothing else here
            seen[self.metric.name, tuple(view.design)] += 1
        return integer(self, view)

    monkeypatch.setattr(Measure, "integer", counting)
    states: list[Result] = []
    asked = dse.load(INMARK).ask(processing="execution_time")
    result = solve_asked(asked, SearchLimits(), Watcher(checkpoint=states.append))
    assert len(states) > 5 and len(states[-1].front) > 3
    assert all(state.under_way and not point.metrics for state in states for point in state.front)
    assert 0 < len(seen) <= len({point.design for point in result.front})
    assert len(result.front) > 3 and not result.under_way
    assert set(seen.values()) == {1}
