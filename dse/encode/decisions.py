"""The decisions as literals: one option of each that is active, what is active, and what no design may do."""

from __future__ import annotations

from typing import Any

from dse.analysis.validity import Predicate, Rulebook, atom_truth, has_conditional_home, is_broken
from dse.analysis.views import View
from dse.encode.linear import Board, Form
from dse.space.model.criteria import ResolvedCondition, Rule
from dse.space.model.space import EMPTY
from dse.space.model.trees import Choice
from dse.spec.language.expressions import And, Not, Or
from dse.support.timelimit import in_time


def add_decisions(board: Board) -> None:
    """Each decision takes exactly one of its options, or is inactive: sum(x[d, o]) + inactive[d] = 1.

    Literals are stored in ``board.options`` and ``board.inactive``; a decision with one option that is always active
    has no variable. Options that the caller fixed away are false.
    """
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
    """A decision is inactive exactly when the walk through its home tree does not meet it.

    One implication for each case of the walk, in both directions.
    """
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
    """Structural predicates forbid the cases in which they fail; a filled optional slot has at least one user.

    Small predicates become clauses, larger ones a literal for each case, those that are sums a linear row.
    """
    for predicate in in_time(rulebook.predicates):
        if predicate.terms:
            form = Form()
            for term in predicate.terms:
                form.add(board.form(board.table(term)))
            board.demand(board.expression(form) <= 0, ())
            continue

        def fails(view: View, predicate: Predicate = predicate) -> bool:
            return not predicate.holds(view)

        if not board.forbid_where(fails):
            board.forbid([board.holds(fails)])
    for cover in rulebook.covers:
        empty = board.options[cover.slot.type_decision][cover.slot.types.index(EMPTY)]
        board.model.add_bool_or([empty, *(board.holds(uses) for uses in cover.users)])


# Rules between decisions as clauses.


def add_rule(board: Board, rule: Rule) -> None:
    """Forbid the cases in which the rule is broken; large rules go through a literal for each part.

    Three-valued logic as in `dse.analysis.validity`: an unknown condition breaks no rule.
    """
    if board.forbid_where(lambda view: is_broken(rule, view)):
        return
    true, false = _kleene(board, rule.condition)
    board.forbid([true if rule.verb == "forbid" else false])


def _kleene(board: Board, condition: ResolvedCondition) -> tuple[Any, Any]:
    """The literals "certainly true" and "certainly false" of a condition in Kleene's logic."""
    if isinstance(condition, Not):
        true, false = _kleene(board, condition.operand)
        return false, true
    if isinstance(condition, And | Or):
        parts = [_kleene(board, item) for item in condition.operands]
        trues, falses = [part[0] for part in parts], [part[1] for part in parts]
        if isinstance(condition, And):
            return board.all_of(trues), board.any_of(falses)
        return board.any_of(trues), board.all_of(falses)
    table = board.table(lambda view: atom_truth(condition, view))
    return (
        board.any_of(literal for literal, value in table if value is True),
        board.any_of(literal for literal, value in table if value is False),
    )
