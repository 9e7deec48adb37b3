"""What has a core or a part of its time beside threads by themselves: executors, reservations, pieces, partitions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

from dse.records import dataclass
from dse.space.trees import Tree
from dse.units import Exact

if TYPE_CHECKING:
    from dse.space.types import Component

ExecutorKind: TypeAlias = Literal["fifo", "callback_group", "wait_set"]


@dataclass(frozen=True)
class Executor:
    """An OS thread for the jobs of `members`, threads by number in the order of the file, of which one runs at a time.

    Leaves of `kind` are `ExecutorKind`, those of `priority` None where none is stated. Where its group `is_open` some
    of the members may be in another executor (`Space.os_thread`). It runs on `processor`; `core` is the stated one.
    """

    name: str
    kind: Tree
    members: tuple[int, ...]
    priority: Tree = None
    is_open: bool = False
    processor: Tree = None
    core: Tree = None


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
    """The pieces of a thread's work, components by number in their order; the last one has the thread's name.

    `home` is the first of them that runs where the thread does, on no accelerator.
    """

    thread: str
    members: tuple[int, ...]
    home: int


def at_home(components: Sequence[Component], number: int) -> Component:
    """What has the processor and the process of a thread or device, wherever its last piece runs."""
    pieces = components[number].pieces
    return components[number if pieces is None else pieces.home]


@dataclass(frozen=True)
class Interference:
    """What takes each core of a processor from every thread: up to `worst_ns` at a time, `period_ns` apart at least."""

    name: str
    worst_ns: int
    period_ns: int
    is_throttling: bool = False


@dataclass(frozen=True)
class Partition:
    """A partition of a processor: `period_ns` is the major frame, `duration_ns` None where no window is known."""

    name: str
    period_ns: Exact
    offset_ns: Exact
    duration_ns: Exact | None
