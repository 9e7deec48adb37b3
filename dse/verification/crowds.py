"""Threads that are too many for the cores of a processor, as rows that every design keeps.

What threads use of a processor may keep every sum and still fit on its cores in no way. Then some of them do not fit
even by themselves, at what they use or more: at least one of these is elsewhere or uses less. That is a row of
diagrams, true of all designs, like the others of the smaller question. It is learnt from a solution of that question:
threads are left out as long as the others do not fit, then each may use as little as still does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from dse.timelimit import look_at_the_clock
from dse.verification.cores import ELSEWHERE, OPEN, CoreTable, ThreadUse, may_pack
from dse.verification.diagrams import Diagram, Node, changed, leaves, reached
from dse.verification.remainders import Left

Crowd: TypeAlias = tuple[tuple[Diagram, ...], int]
"""The parts of a row and what their sum is at most."""


def crowd(table: CoreTable, chosen: Left, every: Left) -> Crowd | None:
    """The row that a choice breaks whose threads do not fit on the cores of a processor; None where nothing shows that.

    `chosen` has one position for each decision, `every` all that it may have.
    """
    threads = [item for item in table.threads if _part(item) is not None]
    uses = {number: _use(item, chosen) for number, item in enumerate(threads)}
    uses = {number: use for number, use in uses.items() if use > 0}
    (count,) = reached(table.count, chosen)
    cores = {number: _cores(threads[number], every) for number in uses}

    def fits(least: Mapping[int, int]) -> bool:
        look_at_the_clock()
        return may_pack(tuple((use, cores[number]) for number, use in least.items()), count, table.room)

    if fits(uses):
        return None
    for number in sorted(uses, key=lambda number: uses[number]):
        fewer = {other: use for other, use in uses.items() if other != number}
        if not fits(fewer):
            uses = fewer
    for number in sorted(uses, key=lambda number: -uses[number]):
        for use in sorted((use for use in _offered(threads[number]) if 0 < use < uses[number]), reverse=True):
            if fits({**uses, number: use}):
                break
            uses[number] = use
    parts = [_is_so(_part(threads[number]), use - _constant(threads[number])) for number, use in uses.items()]
    is_no_more = changed(table.count, lambda leaf: int(leaf <= count))
    return (*parts, is_no_more), len(parts)


def _cores(item: ThreadUse, every: Left) -> frozenset[int]:
    """The cores that a thread may have, whatever is chosen."""
    stated = reached(item.core, every)
    return frozenset(stated - {OPEN, ELSEWHERE}) | (item.may_have if OPEN in stated else frozenset())


def _part(item: ThreadUse) -> Diagram:
    """The part of what a thread uses that decisions tell, 0 where there is none; None where there are several."""
    found = [part for part in item.parts if isinstance(part, Node)]
    return None if len(found) > 1 else found[0] if found else 0


def _constant(item: ThreadUse) -> int:
    return sum(int(part) for part in item.parts if not isinstance(part, Node))


def _use(item: ThreadUse, chosen: Left) -> int:
    (core,) = reached(item.core, chosen)
    if core == ELSEWHERE:
        return 0
    (use,) = reached(_part(item), chosen)
    return int(use) + _constant(item)


def _offered(item: ThreadUse) -> set[int]:
    """What a thread may use."""
    return {int(leaf) + _constant(item) for leaf in leaves(_part(item))}


def _is_so(part: Diagram, least: int) -> Diagram:
    """1 where a part is at least so much, else 0."""
    return changed(part, lambda leaf: int(leaf >= least))
