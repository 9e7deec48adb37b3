"""Results of a costly formula, remembered by the decisions that it consulted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from threading import Lock
from typing import Any, Generic, TypeVar

from dse.analysis.views import View
from dse.space.model.space import Space

T = TypeVar("T")
KEPT_SPACES = 8
TRIED = 32
"""After so many values it shows whether a formula is asked for the same ones again."""


DEMANDS = frozenset(("requirements", "rules", "objectives", "references", "baseline", "fixed", "assumptions"))
"""What is asked of designs; no formula looks at it, but for limits on cores (`_limits_on_cores`)."""
FIGURES = tuple(item.name for item in fields(Space) if item.name not in DEMANDS)


def _same_figures(space: Space, other: Space) -> bool:
    """Whether two spaces differ at most in demands that no formula looks at."""
    if _limits_on_cores(space) != _limits_on_cores(other):
        return False
    pairs = ((getattr(space, name), getattr(other, name)) for name in FIGURES)
    return all(one is two or (isinstance(one, str) and one == two) for one, two in pairs)


def _limits_on_cores(space: Space) -> list[tuple[int | None, str, object]]:
    """The limits of requirements on cores, by which threads without a core get one."""
    return [
        (item.metric.index, item.operator, item.limit.value)
        for item in space.requirements
        if item.metric.kind == "utilisation"
    ]


class _Watching(View):
    """A view that records every decision that is read: the path in the memory under which a value is stored."""

    __slots__ = ("asked",)

    def __init__(self, view: View) -> None:
        self.design = view
        self.groups = view.groups
        self.memo = {}
        self.asked: dict[Any, Any] = {}

    def __getitem__(self, decision: int) -> int:
        option = self.design[decision]
        self.asked[decision] = option
        return int(option)

    def apart(self) -> _Watching:
        """Another view that notes what is asked of it here as well."""
        return _Watching(self)


class _Noting(Sequence[int]):
    """A design that remembers which decisions are looked at.

    A sequence of options; reading an entry notes its index.
    """

    def __init__(self, design: Sequence[int]) -> None:
        self.design = design
        self.seen: dict[int, int] = {}

    def __getitem__(self, decision: int) -> int:  # type: ignore[override]
        self.seen[decision] = self.design[decision]
        return self.design[decision]

    def __len__(self) -> int:
        return len(self.design)


def consulted(view: View, formula: Callable[[View], T]) -> tuple[T, dict[int, int]]:
    """The value of a formula, and the options of the decisions that it consults, by decision, as it asks for them."""
    watching = _Watching(view)
    return formula(watching), watching.asked


def looked_at(design: Sequence[int], formula: Callable[[View], T]) -> tuple[T, dict[int, int]]:
    """The value of a formula of a whole design, and the options that are looked at, by decision, the first one first.

    Unlike with `consulted` the formula has a whole design before it: what designs share is found in memory.
    """
    noting = _Noting(design)
    return formula(View(noting)), noting.seen


class _Node(Generic[T]):
    """After the same answers a formula asks for the same decision next, or is done."""

    __slots__ = ("branches", "decision", "value")

    def __init__(self) -> None:
        self.decision: Any = None
        self.branches: dict[Any, _Node[T]] = {}
        self.value: T | None = None


class _Tree(Generic[T]):
    """The values of one formula that are remembered; `recalled` counts the times when one was used again."""

    __slots__ = ("recalled", "root", "values")

    def __init__(self) -> None:
        self.root: _Node[T] = _Node()
        self.values = self.recalled = 0


class Recall(Generic[T]):
    """Remembers a formula's values, for the last few spaces; designs that agree where it looks share one.

    With `most` no more than these values of a formula are kept at a time, and a formula that is hardly ever asked for
    the same value again is left to itself.
    """

    def __init__(self, most: int | None = None) -> None:
        self.most = most
        self._trees: dict[int, tuple[Space, dict[Any, _Tree[T]]]] = {}
        self._admitting = Lock()

    def recall(self, space: Space, key: Any, view: View, formula: Callable[[Space, Any, View], T]) -> T:
        """``formula(space, key, view)``, from memory where it has been asked before.

        The stored value is found by walking the tree of decisions that the formula consulted before; only these options
        must agree. With a limited memory a formula that is rarely recalled is computed directly.
        """
        trees = (self._trees.get(id(space)) or self._admitted(space))[1]
        tree = trees.get(key)
        if tree is None:
            tree = trees[key] = _Tree()
        if self.most is not None and tree.values >= TRIED and tree.recalled < tree.values:
            return formula(space, key, view)
        node = tree.root
        while node.decision is not None:
            branch = node.branches.get(view[node.decision])
            if branch is None:
                break
            node = branch
        if node.value is None:
            watching = _Watching(view)
            value = formula(space, key, watching)
            if self.most is not None and tree.values and not tree.values % self.most:
                tree.root = _Node()
            self._plant(tree.root, watching.asked, value)
            tree.values += 1
            return value
        tree.recalled += 1
        return node.value

    def _admitted(self, space: Space) -> tuple[Space, dict[Any, _Tree[T]]]:
        """A space that was not asked about before: one that differs in its demands only has the same values.

        Several solvers work in threads, each of which may be the first to ask.
        """
        with self._admitting:
            shared = next((tree for other, tree in self._trees.values() if _same_figures(space, other)), {})
            if len(self._trees) >= KEPT_SPACES:
                self._trees.pop(next(iter(self._trees)), None)
            self._trees[id(space)] = entry = space, shared
            return entry

    @staticmethod
    def _plant(node: _Node[T], leaves: dict[Any, Any], value: T) -> None:
        for decision, option in leaves.items():
            node.decision = decision
            node = node.branches.setdefault(option, _Node())
        node.value = value
