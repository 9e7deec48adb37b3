"""The worst place of an uncertain design is its own, whatever was looked at before."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

from dse.questions.robust.worst_case import Box


class Function:
    """Stands for the figures of a design: both sides of its one comparison are a number of its own."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.inputs = SimpleNamespace(nominal=())

    def exact(self, values: Any) -> list[Fraction]:
        return [Fraction(self.number)] * 2


def test_a_design_does_not_get_the_figures_of_one_that_is_gone() -> None:
    """They were remembered by the function's address, which the next one may have."""
    box, bound = Box(()), cast(Any, SimpleNamespace(value=0, limit=1))
    for number in range(20):
        found = box._sides(cast(Any, Function(number)), bound, ())  # no reference to the function is left
        assert found == (number, number)
