"""A portfolio finds out what costs the least, and costs little more itself; attempts here are simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import pytest

from dse.search import tuning
from dse.search.solver.portfolio import Portfolio
from dse.search.solver_answer import Answer, NoSuchDesign, Unfinished

NEVER = float("inf")


class Simulated:
    """Attempts with known costs, and what was spent on them."""

    def __init__(self) -> None:
        self.work = 0.0
        self.won: list[int] = []
        self.costs: Sequence[float] = ()

    def attempts(self, costs: Sequence[float]) -> list[Callable[[float], Answer]]:
        self.costs = costs
        return [partial(self.attempt, position) for position in range(len(costs))]

    def attempt(self, position: int, limit: float) -> Answer:
        self.work += min(limit, self.costs[position])
        if self.costs[position] > limit:
            return Unfinished()
        self.won.append(position)
        return NoSuchDesign()

    def ask(self, asked: Portfolio, costs: Sequence[float]) -> None:
        answer = asked.answer(self.attempts(costs), lambda: self.work, lambda: False)
        assert isinstance(answer, NoSuchDesign)


@pytest.mark.parametrize("costs", [(0.2, 0.01, 0.1), (0.01, 0.3, 0.3), (0.3, NEVER, 0.02), (NEVER, NEVER, 1.0)])
def test_many_questions_cost_little_more_than_with_the_best_settings(costs: tuple[float, ...]) -> None:
    asked, simulated = Portfolio([0.0, 0.01, 0.02], tuning.Portfolio()), Simulated()
    for _ in range(300):
        simulated.ask(asked, costs)
    assert simulated.won[-1] == costs.index(min(costs))
    assert simulated.work <= 300 * min(costs) * 1.15 + 10 * min(costs) + 1


def test_each_question_is_answered_however_long_it_takes() -> None:
    """By the only attempt that can, at a cost that is a multiple of the least."""
    for able in range(3):
        asked, simulated = Portfolio([0.0, 0.0, 0.0], tuning.Portfolio()), Simulated()
        simulated.ask(asked, [50.0 if position == able else NEVER for position in range(3)])
        assert simulated.won == [able]
        assert simulated.work <= 50 * 3 * 4


def test_questions_that_cost_nothing_tell_nothing() -> None:
    asked, simulated = Portfolio([0.0, 0.0], tuning.Portfolio()), Simulated()
    for _ in range(100):
        simulated.ask(asked, (tuning.Portfolio.trivial / 2, tuning.Portfolio.trivial / 2))
    assert set(simulated.won) == {0}
    assert asked.costs == [0.0, 0.0]


def test_the_end_of_time_is_an_unfinished_answer() -> None:
    simulated = Simulated()
    answer = Portfolio([0.0], tuning.Portfolio()).answer(
        simulated.attempts([NEVER]), lambda: simulated.work, lambda: simulated.work > 3
    )
    assert isinstance(answer, Unfinished)


def test_what_fails_before_the_answer_costs_that_too() -> None:
    """Where the first attempt fails at every question, the one that answers comes first, although it is dearer."""
    asked, simulated = Portfolio([0.04, 0.25], tuning.Portfolio()), Simulated()
    for _ in range(50):
        simulated.ask(asked, (NEVER, 0.9))
    assert simulated.won[-1] == 1
    assert simulated.work <= 50 * 0.9 * 1.15 + 2
