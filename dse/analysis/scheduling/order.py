"""The order of the tasks of each core: which of them may delay which, and what decides a response time.

Nothing says which of several threads with the same priority goes first, so each counts as interference to each of the
others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce

from dse.analysis.placement.first_fit import core_of_each
from dse.analysis.rates import is_event_triggered, passes_rates_on
from dse.analysis.scheduling.busy_window import TaskKey
from dse.analysis.scheduling.overheads import section_ns
from dse.analysis.scheduling.priorities import inner_levels, levels_of, number_of, reserved_levels
from dse.analysis.scheduling.tasks import alone_ns, task_keys
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import picked


@dataclass(frozen=True, slots=True)
class Turn:
    """A task in the order of its core: `rank` of the tasks before it always go first, up to `reach` of all may.

    Others may keep the core for `blocked_ns`, the longest section of the
    `blockers`. In an `executor` the tasks of a smaller `level` go first. The `pieces` of
    one thread never wait for each other. Of those of an executor with a `number` as priority that with the larger one
    has its turn first in a round. In a `reservation` up to `inner_reach` of all may go before it; what else may
    delays the reservation, as `blocked_ns` does.
    """

    key: TaskKey
    rank: int
    reach: int
    blocked_ns: int = 0
    executor: int | None = None
    level: int = 0
    pieces: tuple[int, ...] = ()
    reservation: int | None = None
    inner_reach: int = 0
    blockers: tuple[tuple[TaskKey, int], ...] = ()
    number: int | None = None

    def rivals(self, order: Sequence[Turn]) -> list[int]:
        """The positions of what may delay the task where it runs, which is not a callback's own timer.

        In an executor that may do so as well. Of a task in a reservation those are in there, of others none is in one:
        reservations delay these as a whole (`reservations`).
        """
        key, pieces, reservation = self.key, self.pieces, self.reservation
        timer = key[0] if key[1] == "callback" and self.executor is None else None
        return [
            position
            for position, turn in enumerate(order[: self.reach if reservation is None else self.inner_reach])
            if turn.reservation == reservation
            and (number := turn.key[0]) != timer
            and number not in pieces
            and turn.key != key
        ]

    def goes_first_inside(self, other: Turn) -> bool:
        """Whether another task of the executor goes first where both wait; not a callback's own timer."""
        return other.level <= self.level and not (self.key[1] == "callback" and other.key[0] == self.key[0])

    def siblings(self, order: Sequence[Turn]) -> list[int]:
        """The positions of the other pieces of its thread."""
        return [at for at, turn in enumerate(order) if turn.key[0] in self.pieces and turn.key != self.key]

    def shares_turn(self, order: Sequence[Turn]) -> bool:
        """Whether something may delay a piece that another piece of its thread, or an earlier job of it, may delay."""
        if self.executor is None:
            return any(position >= self.rank for position in self.rivals(order))
        first = min([self.level, *(order[at].level for at in self.siblings(order))])
        return any(first <= order[position].level <= self.level for position in self.rivals(order))

    def outside(self, order: Sequence[Turn]) -> Iterator[int]:
        """The positions of what is in no reservation and may delay that of the task."""
        return (position for position, turn in enumerate(order[: self.reach]) if turn.reservation is None)

    def reservations(self, order: Sequence[Turn]) -> list[int]:
        """The reservations that may delay the task, or the one that it is in."""
        found = dict.fromkeys(turn.reservation for turn in order[: self.reach])
        return [item for item in found if item is not None and item != self.reservation]


class Schedule:
    """The cores of a design's processors, each planned when it is asked for."""

    def __init__(self, space: Space, view: View) -> None:
        self.space, self.view = space, view

    def cores(self, processor: int) -> list[list[Turn]]:
        """The tasks of each core, by priority; kept with the view."""
        found: list[list[Turn]] | None = self.view.memo.get(("turns", processor))
        if found is None:
            found = self.view.memo["turns", processor] = _cores_of(self.space, processor, self.view)
        return found

    def place(self, key: TaskKey) -> tuple[int, int, Turn] | None:
        """Processor, core and turn of a task; None where it runs on none."""
        processor = at(self.space.components[key[0]].processor, self.view)
        for core, turns in enumerate(self.cores(processor) if processor is not None else ()):
            for turn in turns:
                if turn.key == key:
                    return processor, core, turn
        return None

    def all_cores(self) -> list[tuple[int, int, list[Turn]]]:
        """Processor, core and the order of the tasks there, in the order of the file."""
        processors = range(len(self.space.processors))
        return [(number, core, turns) for number in processors for core, turns in enumerate(self.cores(number))]

    def needed(self, wanted: Sequence[TaskKey]) -> list[tuple[int, int, list[Turn]]]:
        """The cores that decide the response times of `wanted`, with the tasks there that may delay or release them.

        Processor, core, and so much of the order of the tasks there.
        """
        depth: dict[tuple[int, int], int] = {}
        todo = list(wanted)
        while todo:
            place = self.place(todo.pop())
            if place is None:
                continue
            processor, core, turn = place
            known = depth.get((processor, core), 0)
            for other in self.cores(processor)[core][known : turn.reach]:
                todo += upstream(self.space, other.key, self.view, frozenset())
            depth[processor, core] = max(known, turn.reach)
        return [(*place, self.cores(place[0])[place[1]][:count]) for place, count in depth.items()]


def upstream(space: Space, key: TaskKey, view: View, seen: frozenset[int]) -> list[TaskKey]:
    """The tasks whose response times are jitter of the task's releases."""
    number, part = key
    component = space.components[number]
    found: list[TaskKey] = []
    if component.pieces is not None:  # they stand and fall together
        found += [(item, "thread") for item in component.pieces.members if item != number]
    if number in seen or (part == "thread" and not passes_rates_on(component, view)):
        return found
    if part == "thread" and not is_event_triggered(component, view) and at(component.callback_ns, view) is not None:
        found.append((number, "callback"))  # a hybrid thread that needs all its inputs, which that stores
    for connection in (space.connections[wire] for wire in component.triggers):
        if connection.sender is None:
            continue
        found.append((connection.sender, "thread"))
        if at(space.components[connection.sender].processor, view) is None:
            found += upstream(space, found[-1], view, seen | {number})
    return found


def _cores_of(space: Space, processor: int, view: View) -> list[list[Turn]]:
    """The tasks of each core, by priority."""
    placed = core_of_each(space, processor, view)
    cores = range(1, max(1, at(space.processors[processor].cores, view)) + 1)
    return [turns_of(space, [number for number, found in placed.items() if found == core], view) for core in cores]


def turns_of(space: Space, numbers: Sequence[int], view: View) -> list[Turn]:
    """The tasks of one core in their order (`dse.analysis.scheduling.priorities`)."""
    units: dict[int, list[int]] = {}
    for number in numbers:
        units.setdefault(space.unit(number, view), []).append(number)
    turns: list[Turn] = []
    for level in levels_of(space, numbers, view):
        parts = [(unit, [key for number in units[unit] for key in task_keys(space, number, view)]) for unit in level]
        before, reach = len(turns), len(turns) + sum(len(keys) for _, keys in parts)
        for unit, keys in parts:
            if space.components[unit].reservation is not None:
                turns += _reserved(space, units[unit], len(turns), (before, reach), view)
            else:
                turns += _of_unit(space, units[unit], keys, (before, reach), view, alone=len(level) == 1)
    return _blocked(space, turns, view)


def _of_unit(
    space: Space, numbers: Sequence[int], keys: Sequence[TaskKey], level: tuple[int, int], view: View, *, alone: bool
) -> Iterator[Turn]:
    """The tasks of an OS thread, `level` in the order of its core; one that is `alone` there has two for a hybrid."""
    before, reach = level
    component = space.components[numbers[0]]
    if component.executor is not None:
        inner = _inner(space, numbers, view)
        executor = at(component.executor, view)
        for key in keys:
            number = number_of(space.components[key[0]], view)
            yield Turn(key, before, reach, 0, executor, inner[key], _pieces(space, key), number=number)
    elif component.pieces is not None:
        yield from (Turn(key, before, reach, pieces=_pieces(space, key)) for key in keys)
    else:
        ends = range(before + 1, reach + 1) if alone else [reach] * len(keys)
        yield from (Turn(key, before + own, end) for own, (key, end) in enumerate(zip(keys, ends, strict=True)))


def _pieces(space: Space, key: TaskKey) -> tuple[int, ...]:
    found = space.components[key[0]].pieces
    return () if found is None else found.members


def _reserved(space: Space, numbers: Sequence[int], first: int, level: tuple[int, int], view: View) -> Iterator[Turn]:
    """The tasks of a reservation, by their order in there, from the position `first` on."""
    firsts: dict[int, list[int]] = {}
    for number in numbers:
        firsts.setdefault(space.os_thread(number, view)[0], []).append(number)
    end, reservation = first, space.components[numbers[0]].reservation
    for inner in reserved_levels(space, numbers, view):
        parts = [(firsts[one], [key for item in firsts[one] for key in task_keys(space, item, view)]) for one in inner]
        begin, end = end, end + sum(len(keys) for _, keys in parts)
        for members, keys in parts:
            for turn in _of_unit(space, members, keys, (begin, end), view, alone=len(inner) == 1):
                rank = level[0] + turn.rank - first
                yield replace(turn, rank=rank, reach=level[1], reservation=reservation, inner_reach=turn.reach)


def _inner(space: Space, numbers: Sequence[int], view: View) -> dict[TaskKey, int]:
    """The level of each task of an executor among its own, the most urgent first."""
    found: dict[TaskKey, int] = {}
    for level in inner_levels(space, numbers, view):
        first = len(found)
        for key in (key for number in level for key in task_keys(space, number, view)):
            found[key] = first if len(level) > 1 else len(found)
    return found


def _blocked(space: Space, turns: list[Turn], view: View) -> list[Turn]:
    """The turns with their blocking: for how long a task of lower priority may keep the core."""
    if all(space.components[turn.key[0]].section_ns is None for turn in turns):
        return turns
    sections = _sections_of(space, turns, view)
    found = []
    for turn in turns:
        rivals = set(turn.rivals(turns) if turn.reservation is None else turn.outside(turns))
        blockers = tuple(
            (turns[position].key, section)
            for position, section in enumerate(sections)
            if position not in rivals and turns[position].key != turn.key and section
        )
        blocked = reduce(partial(picked, "max"), (section for _, section in blockers), 0)
        found.append(replace(turn, blocked_ns=blocked, blockers=blockers))
    return found


def _sections_of(space: Space, turns: Sequence[Turn], view: View) -> list[int]:
    """For how long each task of a core may keep it to itself."""
    return [
        section_ns(space, turn.key[0], alone_ns(space.components[turn.key[0]], turn.key[1], view)[1], view)
        for turn in turns
    ]
