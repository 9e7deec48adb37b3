"""Search in the order of the file: depth first, an option that comes first before the others."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from ortools.sat.python import cp_model, cp_model_helper


def strategy_in_order(
    model: cp_model.CpModel,
    options: Sequence[Sequence[cp_model.IntVar]],
    inactive: Sequence[cp_model.IntVar | None],
    moved: Collection[int],
    attained: Sequence[int],
) -> Any:
    """The strategy of which the first solution is the first design in the order of the file, for `searched_by`.

    It has the literals of the decisions that are open but for those `moved`, for whoever settles a design gives it the
    first cores. The last option of a decision follows from the others: the solver looks through the list before each
    of its decisions. At the end is which of several sums is the greatest (`attained`).
    """
    ordered: list[Any] = []
    for index, literals in enumerate(options):
        if len(literals) > 1 and index not in moved:
            unused = inactive[index]
            ordered += literals[:-1] if unused is None else [unused, *literals[:-1]]
    ordered += map(model.get_int_var_from_proto_index, attained)
    model.add_decision_strategy(ordered, cp_model.CHOOSE_FIRST, cp_model.SELECT_MAX_VALUE)
    found = cp_model_helper.DecisionStrategyProto()
    found.copy_from(model.proto.search_strategy[0])
    model.proto.search_strategy.clear()
    return found


@contextmanager
def searched_by(model: cp_model.CpModel, strategy: Any) -> Iterator[None]:
    """Inside, fixed search follows a strategy; the model is left without one."""
    model.proto.search_strategy.append(strategy)
    try:
        yield
    finally:
        model.proto.search_strategy.clear()
