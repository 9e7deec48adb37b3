"""A whole design from the decisions that a caller makes, and today's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from dse.analysis.validity import is_broken
from dse.analysis.views import PartialView, Undecided
from dse.space.model.criteria import Rule
from dse.space.model.space import EMPTY, Design, Space
from dse.space.model.trees import NotOffered
from dse.support.errors import UsageError


def complete_design(space: Space, choices: Mapping[int, int]) -> Design:
    """A design from choices: what has one option is made, what rules settle too; the others must be given.

    What does not matter in the design may be left out.

    Raises
    ------
    UsageError
        naming the decisions that are still open.
    """
    from dse.analysis.views import View, is_met

    made = [0 if len(item.options) == 1 else choices.get(index, -1) for index, item in enumerate(space.decisions)]
    design = _with_slots(space, _settled(space, made))
    waiting = [item.index for item in (*space.open_cores, *space.open_priorities)
               if item.index < len(design) and design[item.index] < 0]  # fmt: skip
    known = View([max(option, 0) for option in design])
    missing = [
        item.name
        for index, item in enumerate(space.decisions)
        if design[index] < 0 and index not in waiting and is_met(item, index, known)
    ]
    if missing:
        raise UsageError(
            f"the design leaves open: {', '.join(missing)} "
            f'(give them with --design "{missing[0]} = …" or --design RESULT.json#ID, or state a baseline)'
        )
    whole = tuple(max(option, 0) for option in design)
    return _with_cores(space, whole, waiting) if waiting else whole


def _with_cores(space: Space, design: Design, waiting: Sequence[int]) -> Design:
    """The design with cores for the decisions `waiting`: such that limits are met, where quick ways find that.

    One with an option that is not offered beside the others stays as it is: whoever judges it says so.
    """
    from dse.analysis.placement.heuristics import placed

    try:
        return placed(space, design, waiting)
    except NotOffered:
        return design


def baseline_design(space: Space) -> Design | None:
    """Today's design; None when the problem states none, or only a part of it.

    A tuple of option numbers, one for each decision of the space, with inactive decisions at 0 (`canonical`). A
    baseline whose choices exclude each other, or that leaves a decision open, is None, too.
    """
    if not space.baseline:
        return None
    from dse.analysis.validity import canonical

    try:
        return canonical(space, complete_design(space, space.baseline))
    except (UsageError, NotOffered):
        return None


def _with_slots(space: Space, made: Sequence[int]) -> list[int]:
    """Optional slots that are left open: empty when nothing is bound to them, else of their only type."""
    from dse.analysis.validity import slot_users
    from dse.analysis.views import View

    design = list(made)
    users = [(slot, uses) for slot, uses in slot_users(space) if slot.optional]
    for _ in range(len(users) + 1):  # a virtual bus that turns out to be used makes the bus that carries it used
        for slot, numbers in users:
            if made[slot.type_decision] >= 0:
                continue
            empty = slot.types.index(EMPTY)
            view = View([max(option, 0) for option in design])
            used = any(uses(view) for _, uses in numbers)
            types = [option for option in range(len(slot.types)) if option != empty]
            design[slot.type_decision] = empty if not used else types[0] if len(types) == 1 else -1
    return design


# What rules leave no choice about, in a design that is stated in part.


def _settled(space: Space, made: Sequence[int]) -> list[int]:
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
        settled = {
            index: options[0]
            for index in waiting
            if len(options := _left(space, asking.get(index, ()), known, index)) == 1
        }
        if not settled:
            return design
        for index, option in settled.items():
            design[index] = option
        waiting = [index for index in waiting if index not in settled]


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
