"""How many designs a space has at most."""

from __future__ import annotations

from math import prod

from dse.space.model.space import EMPTY, Space
from dse.space.model.trees import NOT_OFFERED, Choice, Tree


def space_size(space: Space) -> int:
    """The number of combinations of options: an upper bound on the number of designs.

    A decision that one other decision leaves unused counts once there; where several decide on its use, its options
    count everywhere. An optional slot counts its types: whether it is empty follows from what is bound to it. Rules,
    bindings and requirements are not considered.
    """
    owners: dict[int, list[int]] = {}
    alone: list[int] = []
    for index, decision in enumerate(space.decisions):
        others = _mentioned(decision.home) - {index}
        if len(others) == 1:
            owners.setdefault(others.pop(), []).append(index)
        else:
            alone.append(index)
    total = 1
    for index in alone:
        options = [number for number, text in enumerate(space.decisions[index].options) if text != EMPTY]
        chained = owners.pop(index, [])
        total *= sum(prod(_offered(space, follower, index, option) for follower in chained) for option in options)
    for followers in owners.values():
        total *= prod(len(space.decisions[index].options) for index in followers)
    return total


def _mentioned(tree: Tree) -> set[int]:
    if not isinstance(tree, Choice):
        return set()
    return {tree.decision}.union(*(_mentioned(branch) for branch in tree.branches))


def _offered(space: Space, follower: int, owner: int, option: int) -> int:
    """How many options `follower` has when `owner` takes `option`; 1 when it is inactive."""
    tree = space.decisions[follower].home
    while isinstance(tree, Choice) and tree.decision == owner:
        tree = tree.branches[option]
    if isinstance(tree, Choice):
        return sum(branch is not NOT_OFFERED for branch in tree.branches)
    return 0 if tree is NOT_OFFERED else 1
