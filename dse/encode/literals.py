"""Literals by their indices, negative ones negated (-index - 1), so that one index serves every copy of a model."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ortools.sat.python import cp_model


def literal_of(model: cp_model.CpModel, index: int) -> Any:
    """The solver's literal of an index in a model; below 0 its negation."""
    if index < 0:
        return model.get_int_var_from_proto_index(-index - 1).negated()
    return model.get_int_var_from_proto_index(index)


@dataclass(frozen=True)
class Chosen:
    """The literal of each option of each decision, and of the decision's being inactive, by index.

    `inactive` has None for a decision that is active in every design.
    """

    options: Sequence[Sequence[int]]
    inactive: Sequence[int | None]

    @classmethod
    def of_model(
        cls, options: Iterable[Iterable[cp_model.IntVar]], inactive: Iterable[cp_model.IntVar | None]
    ) -> Chosen:
        """The indices of the literals of a model."""
        return cls(
            [[literal.index for literal in literals] for literals in options],
            [None if literal is None else literal.index for literal in inactive],
        )

    def literal(self, decision: int, option: int) -> int:
        """The index of the literal of an option; below 0 of the decision's being inactive."""
        if option >= 0:
            return self.options[decision][option]
        index = self.inactive[decision]
        assert index is not None
        return index
