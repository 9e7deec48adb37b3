"""Diagrams of integers restricted to some of the options of decisions.

Regions of one front ask this of the same diagrams again and again, mostly with the same options left: what was found
stays with the diagram.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TypeAlias

from dse.verification.diagrams import Diagram, Node, reached

Left: TypeAlias = Sequence[Sequence[int]]
"""For each decision the positions of the options that are left."""


class Remainder:
    """A diagram that looks at several decisions, with the options that are left of these.

    Least and greatest leaves are computed once for each set of options.
    """

    def __init__(self, diagram: Node, left: Mapping[int, Sequence[int]]) -> None:
        self.diagram = diagram
        self.left = left
        self.least = self._least(left)
        """The least leaf that these options lead to."""
        self._with: dict[int, list[int]] = {}
        self._differences: dict[tuple[int, int, int], int] = {}

    @cached_property
    def greatest(self) -> int:
        """The greatest leaf that they lead to."""
        return max(int(leaf) for leaf in reached(self.diagram, self.left))

    def least_with(self, decision: int) -> list[int]:
        """The least leaf with each of the options that are left of a decision, in their order."""
        if decision not in self._with:
            self._with[decision] = [self._least({**self.left, decision: (option,)}) for option in self.left[decision]]
        return self._with[decision]

    def difference(self, decision: int, one: int, other: int) -> int:
        """The most by which the leaf with one option is above that with another, whatever else is chosen.

        May be more where the decisions do not follow each other in one order on all ways through the diagram.
        """
        key = (decision, one, other)
        if key not in self._differences:
            self._differences[key] = self._difference(decision, one, other)
        return self._differences[key]

    def _least(self, left: Mapping[int, Sequence[int]]) -> int:
        known: dict[Node, int] = {}

        def walk(item: Diagram) -> int:
            if not isinstance(item, Node):
                return int(item)
            if item not in known:
                known[item] = min([walk(item.branches[option]) for option in left[item.decision]])
            return known[item]

        return walk(self.diagram)

    def _difference(self, decision: int, one: int, other: int) -> int:
        known: dict[tuple[Node | int, Node | int], int] = {}

        def walk(first: Diagram, second: Diagram) -> int:
            first, second = _at(first, decision, one), _at(second, decision, other)
            if not isinstance(first, Node) and not isinstance(second, Node):
                return int(first) - int(second)
            pair = (first, second)
            if pair not in known:
                split = first.decision if isinstance(first, Node) else second.decision
                known[pair] = max(
                    [walk(_at(first, split, option), _at(second, split, option)) for option in self.left[split]]
                )
            return known[pair]

        return walk(self.diagram, self.diagram)


def remainder(diagram: Node, left: Left) -> Remainder:
    """The remainder of a diagram with some options; one object for equal options."""
    looked_at = diagram.looked_at
    where = tuple([tuple(left[decision]) for decision in looked_at])
    known = diagram.remainders.get(where)
    if known is None:
        known = diagram.remainders[where] = Remainder(diagram, dict(zip(looked_at, where, strict=True)))
    return known


def is_deep(diagram: Diagram) -> bool:
    """Whether a diagram looks at several decisions."""
    return isinstance(diagram, Node) and any(isinstance(branch, Node) for branch in diagram.branches)


def _at(diagram: Diagram, decision: int, option: int) -> Diagram:
    """The diagram below the top node, for an option of its decision."""
    while isinstance(diagram, Node) and diagram.decision == decision:
        diagram = diagram.branches[option]
    return diagram
