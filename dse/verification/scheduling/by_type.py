"""A hard question of the second proof, asked for each combination of the types of processors by itself.

With these given, the model follows one branch of each diagram, and sums of execution times are plain sums, of which a
linear relaxation says most (decision record 10).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from itertools import product
from typing import Generic, TypeVar

from dse.verification.tables import Tables

MOST_AS_A_WHOLE = 4
"""A question about waiting that so many attempts do not answer is asked by type, ..."""
MOST_PARTS = 16
"""... where there are no more combinations of types."""

Model = TypeVar("Model")


class ByType(Generic[Model]):
    """The models with types of processors given, besides those that are `given` already; made when first needed.

    Parameters
    ----------
    make
        the model in which decisions have these options.
    """

    def __init__(self, tables: Tables, given: Mapping[int, int], make: Callable[[Mapping[int, int]], Model]) -> None:
        self._tables, self._given, self._make = tables, given, make
        self._models: dict[int, Model] = {}

    @cached_property
    def combinations(self) -> list[dict[int, int]]:
        """The options of all types that are not given; none where there is nothing to choose, or too much."""
        open_ = [slot.type_decision for slot in self._tables.space.processors if slot.type_decision not in self._given]
        options = product(*(self._tables.allowed[decision] for decision in open_))
        found = [dict(zip(open_, chosen, strict=True)) for chosen in options]
        return found if 1 < len(found) <= MOST_PARTS else []

    def __iter__(self) -> Iterator[Model]:
        for number, combination in enumerate(self.combinations):
            if number not in self._models:
                self._models[number] = self._make({**self._given, **combination})
            yield self._models[number]
