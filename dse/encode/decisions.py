"""The decisions as literals: one option of each that is active, what is active, and what no design may do."""

from __future__ import annotations

from typing import Any

from dse.analysis.validity import Predicate, Rulebook, has_conditional_home
from dse.analysis.views import View
from dse.encode.linear import Board
from dse.space.trees import Choice
from dse.space.types import EMPTY
from dse.timelimit import in_time


def add_decisions(board: Board) -> None:
    """Each decision takes exactly one of its options, or is inactive: sum(x[d, o]) + inactive[d] = 1."""
    for index, decision in enumerate(in_time(board.space.decisions)):
        conditional = has_conditional_home(decision, index)
        if len(decision.options) == 1 and not conditional:
            board.options.append([board.true])
            board.inactive.append(None)
            continue
        literals = [board.model.new_bool_var(f"{decision.name}={option}") for option in decision.options]
        inactive = board.model.new_bool_var(f"{decision.name} inactive") if conditional else None
        board.exactly_one([*literals, inactive] if inactive is not None else literals)
        for option, literal in enumerate(literals):
            if index in board.space.fixed and board.space.fixed[index] != option:
                board.model.add_bool_and([literal.negated()])
        board.options.append(literals)
        board.inactive.append(inactive)


def add_activity(board: Board) -> None:
    """A decision is inactive exactly when the walk through its home tree does not meet it."""
    for index, decision in enumerate(in_time(board.space.decisions)):
        inactive = board.inactive[index]
        if inactive is None:
            continue

        def meets(view: View, index: int = index, tree: Any = decision.home) -> bool:
            while isinstance(tree, Choice):
                if tree.decision == index:
                    return True
                tree = tree.branches[view[tree.decision]]
            return False

        for literal, met in board.table(meets):
            board.model.add_implication(literal, inactive.negated() if met else inactive)


def add_validity(board: Board, rulebook: Rulebook) -> None:
    """Structural predicates forbid the cases in which they fail; a filled optional slot has at least one user."""
    for predicate in in_time(rulebook.predicates):

        def fails(view: View, predicate: Predicate = predicate) -> bool:
            return not predicate.holds(view)

        if not board.forbid_where(fails):
            board.forbid([board.holds(fails)])
    for cover in rulebook.covers:
        empty = board.options[cover.slot.type_decision][cover.slot.types.index(EMPTY)]
        board.model.add_bool_or([empty, *(board.holds(uses) for uses in cover.users)])
