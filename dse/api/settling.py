"""What rules leave no choice about, in a design that is stated in part."""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.validity import is_broken
from dse.analysis.views import PartialView, Undecided
from dse.space.criteria import Rule
from dse.space.types import Space


def settled(space: Space, made: Sequence[int]) -> list[int]:
    """The options of a design (-1: open), with those decisions made of which the rules leave one option.

    A rule is looked at where it asks for one open decision only; what it settles may settle others in turn. Each is
    looked at for the first open decision that it asks for: with any other made, it would still ask for that one.
    """
    design = list(made)
    waiting = [index for index, option in enumerate(design) if option < 0] if space.rules else []
    rules = [rule for rule in space.rules if _asks(rule, {}) is not None]
    while True:
        known = {index: option for index, option in enumerate(design) if option >= 0}
        asking: dict[int, list[Rule]] = {}
        for rule in rules:
            first = _asks(rule, known)
            if first is not None:
                asking.setdefault(first, []).append(rule)
            elif is_broken(rule, PartialView(known)):
                return design  # whatever else is chosen
        found = {
            index: options[0]
            for index in waiting
            if len(options := _left(space, asking.get(index, ()), known, index)) == 1
        }
        if not found:
            return design
        for index, option in found.items():
            design[index] = option
        waiting = [index for index in waiting if index not in found]


def _asks(rule: Rule, known: dict[int, int]) -> int | None:
    """The first decision that a rule asks for and that is not known; None where it needs no more."""
    try:
        is_broken(rule, PartialView(known))
    except Undecided as asked:
        return asked.decision
    return None


def _left(space: Space, rules: Sequence[Rule], known: dict[int, int], index: int) -> list[int]:
    """The options of a decision that break no rule beside what is known."""
    count = len(space.decisions[index].options)
    return [option for option in range(count) if not any(_breaks(rule, {**known, index: option}) for rule in rules)]


def _breaks(rule: Rule, known: dict[int, int]) -> bool:
    try:
        return is_broken(rule, PartialView(known))
    except Undecided:
        return False
