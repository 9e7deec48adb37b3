"""Limits of each core in the second proof: threads are put on cores by a model of its own, or looked at row by row."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from math import ceil, floor, lcm
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from ortools.sat.python import cp_model

from dse.analysis.limits import Limit, keeps_cores
from dse.analysis.measures import Term
from dse.analysis.placement.bin_packing import PackedItem, Room
from dse.analysis.placement.partition import partition
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.space.model.trees import leaves as leaves_of
from dse.support.timelimit import look_at_the_clock
from dse.verification.diagrams import NO_DESIGN, Diagram, Node, changed, leaves, reached
from dse.verification.restricted_diagrams import Left

OPEN, ELSEWHERE = 0, -1
"""What stands for the core of a thread that has none yet, or runs on another processor."""


@dataclass(frozen=True)
class ThreadUse:
    """The share of a core that a thread uses, as a sum of integer diagrams; its core from 1; its possible cores.

    Whether an open core is `by_rule`, as first-fit puts it.
    """

    parts: tuple[Diagram, ...]
    core: Diagram
    may_have: frozenset[int]
    by_rule: bool


@dataclass(frozen=True)
class CoreTable:
    """A limit on every core: what threads use together on one is at most `room`, with as many cores as `count` says.

    Where it is not `exact` every design that keeps the limit is admitted, and some others.
    """

    limit: Limit
    threads: tuple[ThreadUse, ...]
    count: Diagram
    most: int
    room: int
    exact: bool


def core_table(
    limit: Limit,
    term: Callable[[Term], Diagram],
    diagram: Callable[[Callable[[View], Any], str], Diagram],
    mapped: Callable[[Diagram, Callable[[Any], Any]], Diagram],
    exact_below: int,
    coarse: int,
) -> CoreTable | None:
    """The table of a limit; None where every core keeps it as soon as the sum and each thread do.

    Parameters
    ----------
    term, diagram, mapped
        make the diagram of a summand (exact fractions) and of a formula, and change leaves.
    exact_below, coarse
        sums stay below the first for an exact table; else shares are rounded down to one of so many parts.
    """
    assert limit.cores is not None
    space, processor, each, name = limit.cores.space, limit.cores.processor, limit.cores.most, limit.requirement.text
    most = max([1, *leaves_of(space.processors[processor].cores)])
    if most < 2:
        return None
    numbers = {item.name: number for number, item in enumerate(space.components)}
    listed = {numbers[thread]: [term(item) for item in terms] for thread, terms in limit.alone.items()}
    everything = [part for parts in listed.values() for part in parts]
    scale = lcm(each.denominator, *(leaf.denominator for part in everything for leaf in leaves(part)))
    biggest = sum(max((leaf for leaf in leaves(part)), default=0) for part in everything)
    exact = biggest * scale < exact_below
    scale = scale if exact else coarse
    room = ceil(each * scale) - 1 if limit.cores.is_strict else floor(each * scale)

    def counted(part: Diagram) -> Diagram:
        return mapped(part, lambda leaf: 0 if leaf is NO_DESIGN else floor(leaf * scale))

    threads = tuple(
        ThreadUse(
            tuple(counted(part) for part in parts),
            mapped(
                diagram(partial(_core, space, processor, number), f"{name}: a core"),
                lambda leaf: ELSEWHERE if leaf is NO_DESIGN else leaf,
            ),
            _may_have(space, number, most),
            not _is_open(space, number),
        )
        for number, parts in listed.items()
    )
    count = mapped(diagram(partial(_count, space, processor), name), lambda leaf: 1 if leaf is NO_DESIGN else leaf)
    by_rule = any(item.by_rule and OPEN in leaves(item.core) for item in threads)
    return CoreTable(limit, threads, count, most, room, exact and not by_rule)


def _core(space: Space, processor: int, number: int, view: View) -> int:
    component = space.components[number]
    if at(component.processor, view) != processor:
        return ELSEWHERE
    if _count(space, processor, view) < 2:
        return 1
    core = at(component.core, view)
    return OPEN if core is None else int(core)


def _count(space: Space, processor: int, view: View) -> int:
    return max(1, int(at(space.processors[processor].cores, view)))


def _is_open(space: Space, number: int) -> bool:
    return any(item.component == number for item in space.open_cores)


def _may_have(space: Space, number: int, most: int) -> frozenset[int]:
    values = next((item.decision.values for item in space.open_cores if item.component == number), range(1, most + 1))
    return frozenset(values)


def fitting(
    table: CoreTable, value: Callable[[Diagram], npt.NDArray[np.int64]], view_of: Callable[[int], View], count: int
) -> npt.NDArray[np.bool_]:
    """Which of `count` rows of designs keep a limit on cores; `value` looks a diagram up in all of them.

    Rows that are alike in what counts are looked at once.
    """
    uses = [sum((value(part) for part in item.parts), np.zeros(count, dtype=np.int64)) for item in table.threads]
    cores = [value(item.core) for item in table.threads]
    available = value(table.count)
    whole = sum(
        (np.where(core == ELSEWHERE, 0, use) for use, core in zip(uses, cores, strict=True)),
        np.zeros(count, dtype=object),
    )
    is_free = np.logical_and.reduce(
        [
            (core == ELSEWHERE) | ((core == OPEN) & (len(item.may_have) == table.most and not item.by_rule))
            for core, item in zip(cores, table.threads, strict=True)
        ]
    )
    easy = is_free & (whole * 2 <= table.room * (available + 1))  # as first-fit proves (Lopez and others, 2004)
    found = np.ones(count, dtype=bool)
    hard = np.flatnonzero(~easy)
    if not len(hard):
        return found
    if not table.exact:
        found[hard] = [keeps_cores(table.limit, view_of(int(row))) for row in hard]
        return found
    alike = np.stack([*(use[hard] for use in uses), *(core[hard] for core in cores), available[hard]], axis=1)
    _, first, back = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    verdicts = np.array([keeps_cores(table.limit, view_of(int(hard[row]))) for row in first], dtype=bool)
    found[hard] = verdicts[back.reshape(-1)]
    return found


def may_fit(table: CoreTable, left: Sequence[Sequence[int]]) -> bool:
    """Whether threads may fit on the cores of a processor with the options that are `left`, by positions.

    False is a proof that they never do: not even those that always run there, each with the least that it may use.
    """
    count = max(reached(table.count, left))
    least: list[tuple[int, frozenset[int]]] = []
    for item in table.threads:
        stated = reached(item.core, left)
        if ELSEWHERE not in stated:
            cores = frozenset(stated - {OPEN}) | (item.may_have if OPEN in stated else frozenset())
            least.append((sum(min(reached(part, left)) for part in item.parts), cores))
    return may_pack(tuple(least), count, table.room)


@lru_cache(maxsize=1024)
def may_pack(threads: tuple[tuple[int, frozenset[int]], ...], count: int, room: int) -> bool:
    """Whether threads may fit on a number of cores, each with its use and its possible cores; False is a proof."""
    work = [PackedItem(Fraction(use), [core - 1 for core in sorted(cores) if core <= count]) for use, cores in threads]
    return partition(work, [Fraction(0)] * count, Room(Fraction(room))).status != "none"


def add_cores(model: cp_model.CpModel, table: CoreTable, value: Callable[[Diagram], Any]) -> None:
    """Put each thread on one core, so that no core carries more than there is room for."""

    def variable(diagram: Diagram) -> Any:
        found = value(diagram)
        return model.new_constant(found) if isinstance(found, int) else found

    available = variable(table.count)
    on_core: list[list[Any]] = [[] for _ in range(table.most)]
    for item in table.threads:
        most = sum(max((int(leaf) for leaf in leaves(part)), default=0) for part in item.parts)
        use = sum(variable(part) for part in item.parts)
        core, stated, is_open = (
            model.new_int_var(ELSEWHERE, table.most, ""),
            variable(item.core),
            model.new_bool_var(""),
        )
        model.add(stated == OPEN).only_enforce_if(is_open)
        model.add(stated != OPEN).only_enforce_if(is_open.negated())
        model.add(core == stated).only_enforce_if(is_open.negated())
        places = cp_model.Domain.from_values(sorted(core for core in item.may_have if core <= table.most))
        model.add_linear_expression_in_domain(core, places).only_enforce_if(is_open)
        model.add(core <= available).only_enforce_if(is_open)
        for number, shares in enumerate(on_core, start=1):
            here = model.new_bool_var("")
            model.add(core == number).only_enforce_if(here)
            model.add(core != number).only_enforce_if(here.negated())
            share = model.new_int_var(0, most, "")
            model.add(share >= use).only_enforce_if(here)
            shares.append(share)
    for shares in on_core:
        model.add(sum(shares) <= table.room)


# Threads that are too many for the cores of a processor, as rows that every design keeps.
#
# What threads use of a processor may keep every sum and still fit on its cores in no way. Then some of them do not fit
# even by themselves, at what they use or more: at least one of these is elsewhere or uses less. That is a row of
# diagrams, true of all designs, like the others of the smaller question. It is learnt from a solution of that question:
# threads are left out as long as the others do not fit, then each may use as little as still does not.


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
    """The shares of a core that a thread may use."""
    return {int(leaf) + _constant(item) for leaf in leaves(_part(item))}


def _is_so(part: Diagram, least: int) -> Diagram:
    """1 where a part is at least a given size, else 0."""
    return changed(part, lambda leaf: int(leaf >= least))
