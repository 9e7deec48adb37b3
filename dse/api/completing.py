"""A whole design from the decisions that a caller makes, and today's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from dse.errors import UsageError
from dse.space.trees import NotOffered
from dse.space.types import EMPTY, Design, Space


def complete_design(space: Space, choices: Mapping[int, int]) -> Design:
    """A design from choices: what has one option is made, what rules settle too; the others must be given.

    What does not matter in the design may be left out.

    Raises
    ------
    UsageError
        naming the decisions that are still open.
    """
    from dse.analysis.views import View, is_met
    from dse.api.settling import settled

    made = [0 if len(item.options) == 1 else choices.get(index, -1) for index, item in enumerate(space.decisions)]
    design = _with_slots(space, settled(space, made))
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
    """The design with cores for the decisions `waiting`: such that limits are met, where quick ways find that."""
    from dse.analysis.packing import placed

    return placed(space, design, waiting)


def baseline_design(space: Space) -> Design | None:
    """Today's design; None when the problem states none, or only a part of it."""
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
        for slot, found in users:
            if made[slot.type_decision] >= 0:
                continue
            empty = slot.types.index(EMPTY)
            view = View([max(option, 0) for option in design])
            used = any(uses(view) for _, uses in found)
            types = [option for option in range(len(slot.types)) if option != empty]
            design[slot.type_decision] = empty if not used else types[0] if len(types) == 1 else -1
    return design
