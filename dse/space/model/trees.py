"""Values that depend on decisions.

A figure of the architecture is either a plain value or a `Choice`: a node that a decision answers, with one subtree for
each option. Reading a figure (`at`) walks from the root to a leaf and so consults exactly the decisions that matter:
the search's tables are built by watching which ones those are (see `dse.analysis.views`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol, TypeAlias


class DesignView(Protocol):
    """The view of a design that a formula reads: the chosen option of each decision.

    `Design` tuples, `View` objects and mappings from decision to option all serve.
    """

    def __getitem__(self, decision: int, /) -> int: ...


class _NotOffered:
    """Leaf of an option that the chosen type does not offer."""

    def __repr__(self) -> str:
        return "NOT_OFFERED"


NOT_OFFERED: Final = _NotOffered()


class NotOffered(Exception):
    """A formula asked for a figure that the chosen type does not offer: the design is not valid.

    Caught by the evaluator, which reports the design as invalid, and by the encoder, which excludes it.
    """


@dataclass(frozen=True, slots=True)
class Choice:
    """`branches[k]` is the subtree when `decision` takes its option k.

    Trees of choices with figures as leaves are how the space states values that depend on decisions.
    """

    decision: int
    branches: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class PerProcessorType:
    """A leaf of a virtual bus: one subtree per type of the processor that runs it.

    Resolved for each connection, when it is known on which processor the middleware runs.
    """

    by_type: Mapping[str, Any]


@dataclass(frozen=True)
class PerCore:
    """A leaf of a thread while the space is built: one subtree for each core of its processor.

    Replaced by a choice over the core decision before the space is complete.
    """

    by_core: tuple[Any, ...]


class _FromBandwidth:
    """Leaf of a transmission time that follows from the bandwidth: size / bandwidth."""

    def __repr__(self) -> str:
        return "FROM_BANDWIDTH"


FROM_BANDWIDTH: Final = _FromBandwidth()


Tree: TypeAlias = Any  # a Choice, or a leaf of any type


def at(tree: Tree, design: DesignView) -> Any:
    """The leaf of `tree` in `design`.

    Raises
    ------
    NotOffered
        when the leaf is an option that is not offered there.
    """
    while isinstance(tree, Choice):
        tree = tree.branches[design[tree.decision]]
    if tree is NOT_OFFERED:
        raise NotOffered
    return tree


def graft(tree: Tree, make: Callable[[Any], Tree]) -> Tree:
    """`tree` with every leaf replaced by the subtree that `make` gives for it.

    Equal leaves of all branches are merged into one, so that a figure does not seem to depend on a decision. Options
    that are not offered stay.
    """
    if isinstance(tree, Choice):
        branches = tuple(graft(branch, make) for branch in tree.branches)
        first = branches[0]
        if not isinstance(first, Choice) and all(branch is first for branch in branches):
            return first
        return Choice(tree.decision, branches)
    if tree is NOT_OFFERED:
        return NOT_OFFERED
    return make(tree)


def leaves(tree: Tree, made: Mapping[int, int] | None = None) -> Iterator[Any]:
    """Every leaf that some design reaches, left to right, without those that are not offered; may repeat.

    A decision that the walk meets twice takes the same option both times; `made` holds those taken so far.
    """
    if isinstance(tree, Choice):
        taken = made or {}
        if tree.decision in taken:
            yield from leaves(tree.branches[taken[tree.decision]], taken)
        else:
            for option, branch in enumerate(tree.branches):
                yield from leaves(branch, {**taken, tree.decision: option})
    elif tree is not NOT_OFFERED:
        yield tree


def is_given(tree: Tree, design: DesignView) -> bool:
    """Whether the leaf is not None; which of several that are given it is asks for no decision.

    Avoids consulting decisions that cannot change the answer, so that a formula depends on fewer decisions.
    """
    while isinstance(tree, Choice):
        if not any(isinstance(branch, Choice) for branch in tree.branches):
            kinds = {branch is not None for branch in tree.branches if branch is not NOT_OFFERED}
            if len(kinds) == 1:
                return kinds.pop()
        tree = tree.branches[design[tree.decision]]
    return tree is not None


def consulted(tree: Tree, design: DesignView) -> tuple[list[int], Any]:
    """The decisions on the way to the leaf in `design`, and the leaf.

    Decision indices from the root to the leaf, in this order.
    """
    met = []
    while isinstance(tree, Choice):
        met.append(tree.decision)
        tree = tree.branches[design[tree.decision]]
    return met, tree
