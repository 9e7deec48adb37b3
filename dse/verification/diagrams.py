"""Formulas of the analysis as decision diagrams over the options of a space.

A formula is evaluated on partial designs: where it asks for an open decision, the diagram branches. Equal parts are
shared. This is done apart from `dse.analysis.views.tabulate`, from which the search takes its coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, TypeAlias

from dse.analysis.views import PartialView, Undecided, View
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Space
from dse.space.model.trees import NotOffered
from dse.support.timelimit import look_at_the_clock

MOST_LEAVES = 100_000
CLEARLY_MORE = 8
"""A formula whose decisions on one way have so many times more combinations than it may have leaves has too many."""


class TooLarge(Exception):
    """A formula depends on too many combinations of options, or its figures are too large to add; says which.

    The second proof is then left open, and says so.
    """


class _NoDesign:
    """The leaf of designs that are none: an option that is not offered, a cycle of event-triggered threads."""

    def __repr__(self) -> str:
        return "NO_DESIGN"


NO_DESIGN = _NoDesign()


@dataclass(frozen=True, eq=False)
class Node:
    """`branches[k]` is what follows when `decision` takes the k-th of its allowed options.

    An ordered decision diagram; leaves are values or `NO_DESIGN`.
    """

    decision: int
    branches: tuple[Any, ...]

    @cached_property
    def looked_at(self) -> list[int]:
        """The decisions that it looks at, in their order.

        Ascending indices.
        """
        return sorted(scope(self))

    @cached_property
    def remainders(self) -> dict[Any, Any]:
        """The known remainders of the node for some of the options (`dse.verification.restricted_diagrams`)."""
        return {}


Diagram: TypeAlias = Any  # a Node, or a leaf


class Diagrams:
    """Makes diagrams over a space; nodes with the same branches are the same object.

    Reduced diagrams: no two nodes are equal, and none has equal branches only.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self.allowed: list[list[int]] = [
            [space.fixed[index]] if index in space.fixed else list(range(len(decision.options)))
            for index, decision in enumerate(space.decisions)
        ]
        self._nodes: dict[tuple[int, tuple[Any, ...]], Node] = {}

    def diagram(self, formula: Callable[[View], Any], name: str, most: int = MOST_LEAVES) -> Diagram:
        """The diagram of a formula.

        Raises
        ------
        TooLarge
            when it has more than `most` leaves.
        OutOfTime
            when the time limit in force is over.
        """
        left = [most]

        def grow(partial: Mapping[int, int]) -> Diagram:
            look_at_the_clock()
            try:
                value = formula(PartialView(partial))
            except Undecided as question:
                decision = question.decision
            except (NotOffered, CyclicActivation):
                return self._leaf(left, NO_DESIGN, name)
            else:
                return self._leaf(left, value, name)
            branches = tuple(grow({**partial, decision: option}) for option in self.allowed[decision])
            return self.node(decision, branches)

        return grow({})

    def has_more_leaves(self, formula: Callable[[View], Any], most: int) -> bool:
        """Whether the diagram of a formula has more than `most` leaves, before equal parts of it are shared.

        It is said to have where the decisions on one way to a leaf have `CLEARLY_MORE` times as many combinations.
        """
        combinations, partial = 1, dict[int, int]()
        while combinations <= CLEARLY_MORE * most:
            try:
                formula(PartialView(partial))
                break
            except Undecided as question:
                partial[question.decision] = self.allowed[question.decision][0]
                combinations *= len(self.allowed[question.decision])
            except (NotOffered, CyclicActivation):
                break
        else:
            return True
        try:
            self.diagram(formula, "", most)
        except TooLarge:
            return True
        return False

    def _leaf(self, left: list[int], value: Any, name: str) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise TooLarge(f"{name} depends on too many combinations of options to tabulate")
        return value

    def node(self, decision: int, branches: tuple[Any, ...]) -> Diagram:
        """The node with these branches, or their common value."""
        key = tuple(id(item) if isinstance(item, Node) else (type(item).__name__, item) for item in branches)
        if len(set(key)) == 1:
            return branches[0]
        return self._nodes.setdefault((decision, key), Node(decision, branches))

    def mapped(self, diagram: Diagram, change: Callable[[Any], Any]) -> Diagram:
        """The diagram with its leaves changed.

        Shared nodes stay shared.
        """
        return changed(diagram, change, self.node)


def changed(
    diagram: Diagram, change: Callable[[Any], Any], node: Callable[[int, tuple[Any, ...]], Diagram] = Node
) -> Diagram:
    """A diagram with its leaves changed; `node` makes its nodes.

    Recursive over shared nodes, each visited once.
    """
    seen: dict[int, Any] = {}

    def walk(item: Diagram) -> Diagram:
        if not isinstance(item, Node):
            return change(item)
        if id(item) not in seen:
            seen[id(item)] = node(item.decision, tuple(walk(branch) for branch in item.branches))
        return seen[id(item)]

    return walk(diagram)


def scope(diagram: Diagram) -> frozenset[int]:
    """The decisions that a diagram looks at.

    Indices of decisions.
    """
    return frozenset(node.decision for node in nodes(diagram))


def nodes(diagram: Diagram) -> Iterator[Node]:
    """Every node once."""
    seen: set[int] = set()
    stack = [diagram]
    while stack:
        item = stack.pop()
        if isinstance(item, Node) and id(item) not in seen:
            seen.add(id(item))
            yield item
            stack.extend(item.branches)


def leaves(diagram: Diagram) -> list[Any]:
    """The leaves that are designs; may repeat.

    Leaves `NO_DESIGN` are left out.
    """
    if not isinstance(diagram, Node):
        return [] if diagram is NO_DESIGN else [diagram]
    return [
        item
        for node in nodes(diagram)
        for item in node.branches
        if not isinstance(item, Node) and item is not NO_DESIGN
    ]


def reached(diagram: Diagram, left: Sequence[Sequence[int]] | Mapping[int, Sequence[int]]) -> set[Any]:
    """The leaves that some of the options that are `left` lead to: their positions, for each decision.

    `left` has for each decision the positions of its options that may be chosen.
    """
    seen: set[Node] = set()
    values: set[Any] = set()
    stack = [diagram]
    while stack:
        item = stack.pop()
        if not isinstance(item, Node):
            values.add(item)
        elif item not in seen:
            seen.add(item)
            stack += [item.branches[position] for position in left[item.decision]]
    return values


def as_fraction(value: Any) -> Any:
    """Numbers as exact fractions; `NO_DESIGN` as it is."""
    return value if value is NO_DESIGN else Fraction(value)
