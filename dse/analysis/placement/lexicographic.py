"""The first cores, in the order of the file, on which the threads of a design meet all limits.

Thread after thread gets the first core where those that have one already are not late for sure, and not too many for a
limit of that core: with fewer threads no response time is longer, and no core fuller. Cores of different processors
have nothing to do with each other but for the jitter that threads pass on: so the first cores of each processor are the
first of all wherever the design as a whole meets its limits with them. Else all processors are gone through together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, floor, lcm
from typing import TypeAlias

from dse.analysis.limits import Limit, judge, on_processor, thread_values
from dse.analysis.placement.admission import Admission
from dse.analysis.placement.bin_packing import Room
from dse.analysis.placement.heuristics import by_unit, ordered
from dse.analysis.placement.priority_assignment import limits_of
from dse.analysis.scheduling.tasks import members
from dse.analysis.views import View
from dse.space.model.space import Design, OpenCore, OpenPriority, Space
from dse.space.model.trees import at, consulted

MOST_STEPS = 10_000
"""The greatest work of a search for the first cores: 1 for each try of a core, and what follows from it."""
ADMITTING, ENDING = 20, 2_500
"""The work of an admission test, and of a design that is whole and misses a limit."""
Place: TypeAlias = tuple[int, int]
"""A processor, and one of its cores, from 1."""
Options: TypeAlias = dict[int, int]


def first_placement(
    space: Space,
    design: Design,
    open_: Sequence[OpenCore],
    limits: Sequence[Limit],
    beside: Sequence[Limit] = (),
    orders: Sequence[OpenPriority] = (),
) -> tuple[Design | None, bool]:
    """The design with the first cores, in the order of the file, on which all limits hold, and whether that is sure.

    None where there are no such cores; it is not sure where looking for them was given up. `limits` are those on
    response times, `beside` others that the cores must keep.
    """
    view = View(design)
    question = _asked_of(space, view, open_)
    meets = Admission(space, view, limits_of(limits, view), orders)

    def ends(options: Options) -> Design | None:
        made = tuple(options.get(number, option) for number, option in enumerate(design))
        for candidate in ordered(space, made, orders, limits):
            end = View(candidate)
            if all(judge(limit, end).holds for limit in (*limits, *beside)):
                return candidate
        return None

    parts: Options = {}
    rooms = question.rooms(space, view, beside)  # of which each search fills those of its processor
    for processor in dict.fromkeys(question.where[item.component] for item in question.order):
        search = _Search(question, question.on(processor), rooms, meets)
        options = next(search.found(), None)
        if options is None:
            return None, search.left > 0
        parts |= options
    whole_design = ends(parts)
    if whole_design is not None:
        return whole_design, True
    search = _Search(question, question.order, question.rooms(space, view, beside), meets)
    for options in search.found():
        whole_design = ends(options)
        if whole_design is not None:
            return whole_design, True
        search.left -= ENDING
    return None, search.left > 0


@dataclass(frozen=True)
class _Asked:
    """The threads of a design that need a core, in the `order` of the file, and what is given.

    That is `where` threads run, by number, the `counts` of the processors' cores, and the threads that have a core
    already. The cores of a `bare` processor, which nothing tells apart, are begun in their order.
    """

    order: Sequence[OpenCore]
    where: Mapping[int, int]
    counts: Sequence[int]
    taken: Mapping[Place, Sequence[int]]
    bare: frozenset[int]

    def on(self, processor: int) -> list[OpenCore]:
        """The first cores of the threads of one processor."""
        return [item for item in self.order if self.where[item.component] == processor]

    def rooms(self, space: Space, view: View, beside: Sequence[Limit]) -> dict[int, list[_CoreRoom]]:
        """What the limits on the cores of each processor leave of them."""
        rooms: dict[int, list[_CoreRoom]] = {processor: [] for processor in range(len(self.counts))}
        for limit in beside:
            if limit.cores is not None:
                processor = limit.cores.processor
                loads = on_processor(space, processor, thread_values(limit, view), view)
                rooms[processor].append(_room_of(limit.cores.room, loads))
        for (processor, core), numbers in self.taken.items():
            for room in rooms[processor]:
                room.add(core, numbers)
        return rooms


def _asked_of(space: Space, view: View, open_: Sequence[OpenCore]) -> _Asked:
    units = by_unit(open_, space, view)
    where = {number: slot for slot in range(len(space.processors)) for number in members(space, slot, view)}
    taken: dict[Place, list[int]] = {}
    for number, processor in where.items():
        core = at(space.components[number].core, view) if space.unit(number, view) not in units else None
        if core is not None:
            taken.setdefault((processor, core), []).append(number)
    order = [item for item in open_ if item.component in where and _is_asked(item, view)]
    counts = [max(1, at(slot.cores, view)) for slot in space.processors]
    bare = []
    for processor, count in enumerate(counts):
        here = [item for item in order if where[item.component] == processor]
        whole = all(set(range(1, count + 1)) <= set(item.decision.values) for item in here)
        if whole and sum(len(item.threads) for item in here) == list(where.values()).count(processor):
            bare.append(processor)
    return _Asked(order, where, counts, taken, frozenset(bare))


def _is_asked(item: OpenCore, view: View) -> bool:
    """Whether the thread's core is a decision in the design."""
    return item.index in consulted(item.decision.home, view)[0]


@dataclass
class _CoreRoom:
    """A limit on each core of a processor: of `loads`, by thread, at most `most` on one; all in one unit."""

    most: int
    loads: Mapping[int, int]
    used: dict[int, int] = field(default_factory=dict)

    def add(self, core: int, numbers: Sequence[int], sign: int = 1) -> None:
        """Put threads on a core, or take them away."""
        self.used[core] = self.used.get(core, 0) + sign * self.load(numbers)

    def fits(self, core: int, numbers: Sequence[int]) -> bool:
        """Whether a core may carry these as well."""
        return self.used.get(core, 0) + self.load(numbers) <= self.most

    def load(self, numbers: Sequence[int]) -> int:
        """What threads use together."""
        return sum(self.loads.get(number, 0) for number in numbers)

    def can_end(self, count: int, waiting: int, least: int) -> bool:
        """Whether the cores that one of `least` fits on have room for all that is waiting."""
        rooms = (self.most - self.used.get(core, 0) for core in range(1, count + 1))
        return waiting <= sum(room for room in rooms if room >= least)


def _room_of(room: Room, loads: Mapping[int, Fraction]) -> _CoreRoom:
    scale = lcm(*(load.denominator for load in loads.values()))
    most = room.share * scale
    return _CoreRoom(
        ceil(most) - 1 if room.is_strict else floor(most), {number: int(load * scale) for number, load in loads.items()}
    )


class _Search:
    """Cores for the threads of `order`, some of those that are asked for, beside those that have one.

    `left` is the work that may still be done: none when looking was given up.
    """

    def __init__(
        self,
        question: _Asked,
        order: Sequence[OpenCore],
        rooms: Mapping[int, Sequence[_CoreRoom]],
        meets: Callable[[Sequence[int]], bool],
    ) -> None:
        self.asked, self.order, self.rooms, self.meets = question, order, rooms, meets
        self.taken = {place: list(numbers) for place, numbers in question.taken.items()}
        self.left = MOST_STEPS

    def found(self) -> Iterator[Options]:
        """The options of their cores by decision, in lexicographic order."""
        waiting = [self._waiting(position) for position in range(len(self.order))]
        yield from self._from(0, {}, waiting)

    def _waiting(self, position: int) -> list[tuple[int, int]]:
        """Of each limit on the cores of a thread's processor what comes after it uses, and the least of that."""
        processor = self.asked.where[self.order[position].component]
        later = [item.threads for item in self.order[position + 1 :] if self.asked.where[item.component] == processor]
        waiting = []
        for room in self.rooms[processor]:
            loads = [room.load(numbers) for numbers in later]
            waiting.append((sum(loads), min(loads, default=0)))
        return waiting

    def _from(self, position: int, chosen: Options, waiting: Sequence[Sequence[tuple[int, int]]]) -> Iterator[Options]:
        if position == len(self.order):
            yield dict(chosen)
            return
        item = self.order[position]
        processor = self.asked.where[item.component]
        count, rooms = self.asked.counts[processor], self.rooms[processor]
        was_empty = False
        for option, core in enumerate(item.decision.values):
            here = self.taken.setdefault((processor, core), [])
            if core > count or (was_empty and not here) or self.left <= 0:
                continue
            self.left -= 1
            was_empty = was_empty or (not here and processor in self.asked.bare)
            if not all(room.fits(core, item.threads) for room in rooms):
                continue
            here += item.threads
            for room in rooms:
                room.add(core, item.threads)
            ends = (room.can_end(count, *rest) for room, rest in zip(rooms, waiting[position], strict=True))
            if all(ends) and self._admits(here):
                chosen[item.index] = option
                yield from self._from(position + 1, chosen, waiting)
            for room in rooms:
                room.add(core, item.threads, -1)
            del here[-len(item.threads) :]

    def _admits(self, numbers: Sequence[int]) -> bool:
        self.left -= ADMITTING
        return self.meets(numbers)
