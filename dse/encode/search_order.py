"""Search in the order of the file: depth first, an option that comes first before the others."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
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
    return _one_by_one(model, ordered)


def strategy_of_places(model: cp_model.CpModel, places: Sequence[tuple[int, Sequence[int]]]) -> Any:
    """The strategy after that one: on which core a thread runs, the one that uses most first, and the first core first.

    `places` has for each thread its greatest use and a variable for each core. With the options fixed the cores are
    packed by first-fit decreasing, which fails seldom; else the solver leaves the first cores empty.
    """
    largest_first = sorted(places, key=lambda place: -place[0])
    return _one_by_one(
        model, [model.get_int_var_from_proto_index(index) for _, core in largest_first for index in core]
    )


def _one_by_one(model: cp_model.CpModel, literals: Sequence[Any]) -> Any:
    model.add_decision_strategy(literals, cp_model.CHOOSE_FIRST, cp_model.SELECT_MAX_VALUE)
    strategy = cp_model_helper.DecisionStrategyProto()
    strategy.copy_from(model.proto.search_strategy[0])
    model.proto.search_strategy.clear()
    return strategy


@contextmanager
def searched_by(model: cp_model.CpModel, strategies: Iterable[Any]) -> Iterator[None]:
    """Inside, fixed search follows one strategy after the other; the model is left without one.

    The strategies are those of `EncodedSpace.in_order`; none leaves the search to the solver.
    """
    for strategy in strategies:
        model.proto.search_strategy.append(strategy)
    try:
        yield
    finally:
        model.proto.search_strategy.clear()
