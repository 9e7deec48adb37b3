"""What else runs on a core beside threads by themselves: executors, reservations, and pieces of threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from dse.space.trees import Tree

ExecutorKind: TypeAlias = Literal["fifo", "callback_group", "wait_set"]


@dataclass(frozen=True)
class Executor:
    """An OS thread for the jobs of `members`, threads by number in the order of the file, of which one runs at a time.

    Leaves of `kind` are `ExecutorKind`, those of `priority` None where none is stated.
    """

    name: str
    kind: Tree
    members: tuple[int, ...]
    priority: Tree = None


@dataclass(frozen=True)
class Reservation:
    """A share of a core for `members`, threads by number in the order of the file: `budget_ns` of each `period_ns`.

    Leaves of `priority`, that of the reservation among what else its core runs, are None where none is stated.
    """

    name: str
    members: tuple[int, ...]
    budget_ns: Tree
    period_ns: Tree
    priority: Tree = None


@dataclass(frozen=True)
class Pieces:
    """The pieces of a thread's work, components by number in their order; the last one has the thread's name."""

    thread: str
    members: tuple[int, ...]
