"""What is looked for from a bound on ends, also where there is nothing at all."""

from __future__ import annotations

from typing import Any, cast

from dse.encode.linear import EXACT_LIMIT
from dse.search.solver.bounding import lowest
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import NoSuchDesign


class Empty:
    """A part without any design, of which nobody knows a design to be better than."""

    def __init__(self) -> None:
        self.least = 0
        self.work = 0.0
        self.asked: list[int] = []

    def raise_least(self, bound: int) -> int:
        self.least = max(self.least, bound)
        return self.least

    def most(self, best: object) -> int | None:
        return None

    def out_of_time(self) -> bool:
        return False

    def run(self, settings: object, work: float, best: object, most: int) -> NoSuchDesign:
        self.asked.append(most)
        return NoSuchDesign()


def test_where_there_is_nothing_the_steps_end_at_the_largest_sum() -> None:
    """They went on doubling until the solver refused the number."""
    empty = Empty()
    assert isinstance(lowest(cast(Strategy, cast(Any, empty)), 1.0), NoSuchDesign)
    assert empty.asked[-1] == EXACT_LIMIT
    assert empty.asked == sorted(set(empty.asked)) and len(empty.asked) < 100
