"""Rules between decisions as clauses."""

from __future__ import annotations

from typing import Any

from dse.analysis.validity import atom_truth, is_broken
from dse.encode.linear import Board
from dse.space.criteria import ResolvedCondition, Rule
from dse.spec.expressions import And, Not, Or


def add_rule(board: Board, rule: Rule) -> None:
    """Forbid the cases in which the rule is broken; large rules go through a literal for each part."""
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
