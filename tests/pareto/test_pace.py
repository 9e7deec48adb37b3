"""Checkpoints cost a small share of the time, whatever the size of the result and however slow its writing is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

import dse
from dse.analysis.measures import Measure
from dse.analysis.views import View
from dse.api.solve import Watcher, solve_asked
from dse.pareto import pace
from dse.pareto.front import Budget
from dse.pareto.pace import CHECKPOINT_S, Pace
from dse.results.solve import Result

INMARK = Path(__file__).parents[2] / "problems" / "inmark.yaml"


class Clock:
    """Time that passes when it is told to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr(pace.time, "monotonic", lambda: self.now)

    def passing(self, seconds: float) -> Callable[[], None]:
        def checkpoint() -> None:
            self.now += seconds

        return checkpoint


@pytest.mark.parametrize("cost_s", [0.0001, 0.001, 0.01, 0.1])
@pytest.mark.parametrize("again", [0.0, 0.2, 1.0])
@pytest.mark.parametrize("step_s", [0.01, 0.3])
def test_checkpoints_cost_little(cost_s: float, again: float, step_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each call finds a point; a checkpoint costs so much for each new one, and a share of it for each it had."""
    clock = Clock(monkeypatch)
    begun, spent, written, times = clock.now, 0.0, 0, 0
    ours = Pace(begun)
    first_s = cost_s * CHECKPOINT_S / 4 / step_s + cost_s
    for size in range(1, 3000):
        clock.now += step_s
        if ours.is_due(size):
            cost = cost_s * (size - written + again * written)
            ours.spend(size, clock.passing(cost))
            spent, written, times = spent + cost, size, times + 1
            assert spent <= 0.05 * (clock.now - begun) + first_s
    if cost_s / step_s < pace.SHARE / 4 and again < 1:  # what is found costs less than there is to spend
        assert times > 3


def test_the_clock_starts_when_the_writing_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    ours = Pace(clock.now)
    clock.now += CHECKPOINT_S
    assert ours.is_due(5)
    ours.spend(5, clock.passing(3 * CHECKPOINT_S))
    clock.now += CHECKPOINT_S / 2
    assert not ours.is_due(5)
    for _ in range(70):
        clock.now += CHECKPOINT_S
        assert not ours.is_due(5)
    clock.now += 120 * CHECKPOINT_S
    assert ours.is_due(5)
    assert not ours.is_due(50)


def test_a_checkpoint_computes_only_what_is_new(monkeypatch: pytest.MonkeyPatch) -> None:
    """However often the result is made, figures of a design are computed once, or shared with one that agrees."""
    monkeypatch.setattr(pace, "CHECKPOINT_S", 0.0)
    monkeypatch.setattr(pace, "SHARE", 1e9)
    seen: Counter[tuple[str, tuple[int, ...]]] = Counter()
    integer = Measure.integer

    def counting(self: Measure, view: View) -> int:
        if self.metric.kind == "power":  # of every design in a result, and of nothing else here
            seen[self.metric.name, tuple(view.design)] += 1
        return integer(self, view)

    monkeypatch.setattr(Measure, "integer", counting)
    states: list[Result] = []
    asked = dse.load(INMARK)
    result = solve_asked(asked, Budget(), Watcher(checkpoint=states.append))
    assert len(states) > 5 and len(states[-1].front) > 3
    assert 0 < len(seen) <= len({point.design for state in [*states, result] for point in state.front})
    assert len(result.front) > 3
    assert set(seen.values()) == {1}
