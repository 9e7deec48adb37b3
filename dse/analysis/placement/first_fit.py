"""The core of each thread: as the user states, the others first-fit by decreasing utilisation."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction

from dse.analysis.placement.bin_packing import WHOLE, Room
from dse.analysis.placement.partition import Spread, even_spread, given_cores, spread
from dse.analysis.scheduling.tasks import members, utilisation
from dse.analysis.views import View
from dse.space.model.space import Space


def core_of_each(space: Space, processor: int, view: View) -> dict[int, int]:
    """The core, from 1, of each thread that runs on a processor, by the thread's number in `Space.components`.

    Threads whose core is stated or decided run there. The others are put on cores such that none is used beyond what
    the space's requirements allow, else beyond all of it: each, those that use most first, on the first core with room
    (first-fit by decreasing utilisation), by a complete search where that is in vain. Where there is no such partition,
    each is put on the first core with room, else on the one that is used least.
    """
    units = {number: space.unit(number, view) for number in members(space, processor, view)}
    stated = given_cores(space, processor, units.values(), view)  # then they do not hang on what the threads use
    if stated is not None:
        return {number: stated[unit] for number, unit in units.items()}
    return dict(placement(space, processor, view).cores)


def placement(space: Space, processor: int, view: View) -> Spread:
    """The threads of a processor on its cores as `core_of_each` has them; its status is about what requirements allow.

    It tells whether a partition was found that keeps all of them, proved absent, or left undecided.
    """
    here = members(space, processor, view)
    used = _used(space, here, view)
    assignment = spread(space, processor, used, view, core_room(space, processor))
    if assignment.status != "found":
        assignment = replace(spread(space, processor, used, view, WHOLE), status=assignment.status)
    return replace(assignment, cores={number: assignment.cores[space.unit(number, view)] for number in here})


def even_core_of_each(space: Space, processor: int, view: View) -> dict[int, int]:
    """A core for each thread of a processor with the fullest core used little, as limited effort finds it.

    Component indices to core numbers from 1; threads of one executor or reservation share a core.
    """
    here = members(space, processor, view)
    assignment = even_spread(space, processor, _used(space, here, view), view)
    return {number: assignment.cores[space.unit(number, view)] for number in here}


def _used(space: Space, here: Iterable[int], view: View) -> dict[int, Fraction]:
    """What threads use of a core, together with those that always share it."""
    used: dict[int, Fraction] = {}
    for number in here:
        unit = space.unit(number, view)
        used[unit] = used.get(unit, Fraction(0)) + utilisation(space, number, view)
    return used


def core_room(space: Space, processor: int) -> Room:
    """The share of each core of a processor that the requirements let threads use, at most the whole core.

    The strictest upper limit on the utilisation of a core; `WHOLE` where none is stated.
    """
    limits = [
        Room(item.limit.value, item.operator == "<")
        for item in space.requirements
        if (item.metric.kind, item.metric.index) == ("utilisation", processor) and item.is_upper
    ]
    return min([*limits, WHOLE], key=lambda room: (room.share, not room.is_strict))
