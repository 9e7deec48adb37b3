"""Lessons of the second proof from refused solutions: why a thread is late in a design, or waits so long.

A set of threads is named that cannot share a core at these options, and each option that changes nothing of that is
added: every combination in the box is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import permutations, product
from typing import TypeAlias

from dse.analysis.limits import HOLDS, Limit, judge
from dse.analysis.memo import looked_at
from dse.analysis.placement.first_fit import core_of_each
from dse.analysis.scheduling.chained import chain_wait_ns
from dse.analysis.scheduling.responses import all_responses, counted_ns, subset_responses, waited_ns
from dse.analysis.terms import FlowChain
from dse.analysis.views import View
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Design, Space
from dse.space.model.trees import NotOffered, at
from dse.verification.scheduling.threads import place_of

MOST_COMBINATIONS = 400
"""A box of options grows as long as it has no more combinations than this."""

Groups: TypeAlias = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Lesson:
    """Not all at once: each decision has one of the options beside it, and the threads of each group share a core.

    Of each pair of `above` the first decision has an option that is no earlier than the second's.
    With `raised` (a thread, and a time in ns): else that thread waits so long at least. With `before` (two messages,
    by their connections): else the first goes before the second.
    """

    box: Mapping[int, frozenset[int]]
    groups: Groups
    raised: tuple[int, Fraction] | None = None
    above: tuple[tuple[int, int], ...] = ()
    before: tuple[int, int] | None = None


def late_lesson(space: Space, limit: Limit, design: Design) -> Lesson:
    """The lesson of a thread that breaks its limit in a design."""
    number = limit.requirement.metric.index or 0
    groups = least_groups(space, number, lambda given, view: _breaks(space, limit, given, view), design)

    def is_late(given: Sequence[int]) -> bool:
        view = View(given)
        return not judge(limit, view).holds if groups is None else _breaks(space, limit, groups, view)

    seen = options_seen(is_late, design)
    apart, above = ordered_pairs(space, groups, seen)
    return Lesson(late_box(space, is_late, design, seen, apart), groups or (), above=above)


def waiting_lesson(space: Space, number: int, waited: Fraction, design: Design) -> Lesson:
    """The lesson of a thread that waits for a given time (ns) in a design."""

    def waits(groups: Sequence[Sequence[int]] | None, view: View) -> bool:
        known = all_responses(space, view) if groups is None else subset_responses(space, groups, view)
        return waited_ns(space, number, view, counted_ns(known.get((number, "thread"), 0))) >= waited

    groups = least_groups(space, number, waits, design)
    seen = options_seen(lambda given: waits(groups, View(given)), design)
    apart, above = ordered_pairs(space, groups, seen)
    box = {item: frozenset((option,)) for item, option in seen.items() if item not in apart}
    return Lesson(box, groups or (), (number, waited), above)


def chain_lesson(space: Space, key: int, chain: FlowChain, waited: Fraction, design: Design) -> Lesson:
    """The lesson of threads that may be one chain and together wait for a given time (ns) in a design.

    Their waiting has the number `key`.
    """

    def waits(groups: Sequence[Sequence[int]] | None, view: View) -> bool:
        return chain_wait_ns(space, chain, View(view.design, groups)) >= waited

    groups = least_groups(space, chain.threads[-1], waits, design)

    def waits_there(given: Sequence[int]) -> bool:
        still = waits(groups, View(given))
        for thread in (item for group in groups or () for item in group):
            at(space.components[thread].processor, View(given))
        return still

    seen = options_seen(waits_there, design)
    apart, above = ordered_pairs(space, groups, seen)
    box = {item: frozenset((option,)) for item, option in seen.items() if item not in apart}
    return Lesson(box, groups or (), (key, waited), above)


def full_lesson(space: Space, limit: Limit, design: Design) -> Lesson:
    """The lesson of a processor whose threads do not fit on its cores in a design."""

    def is_full(given: Sequence[int]) -> bool:
        return not judge(limit, View(given)).holds

    return Lesson(late_box(space, is_full, design, options_seen(is_full, design)), ())


def least_groups(
    space: Space, number: int, breaks: Callable[[Sequence[Sequence[int]], View], bool], design: Design
) -> Groups | None:
    """Groups of threads of which none can be left out; None where first-fit decides who shares a core."""
    view = View(design)
    found: dict[tuple[int, int], list[int]] = {}
    for processor in range(len(space.processors)):
        for thread, core in core_of_each(space, processor, view).items():
            if place_of(space, thread, view) >= 0:
                found.setdefault((processor, core), []).append(thread)
    groups = [tuple(group) for group in found.values()]
    if not breaks(groups, view):
        return None
    for group in list(groups):
        fewer = [item for item in groups if item != group]
        if number not in group and breaks(fewer, view):
            groups = fewer
    for thread in [item for group in groups for item in group if item != number]:
        fewer = [left for group in groups if (left := tuple(item for item in group if item != thread))]
        if breaks(fewer, view):
            groups = fewer
    return tuple(groups)


def ordered_pairs(
    space: Space, groups: Groups | None, seen: Mapping[int, int]
) -> tuple[frozenset[int], tuple[tuple[int, int], ...]]:
    """The priorities among options that were looked at of which only the order counts, and that order."""
    apart: set[int] = set()
    above: list[tuple[int, int]] = []
    by_number = {item.component: item for item in space.open_priorities}
    few = any(slot.priority_levels is not None for slot in space.processors)
    for group in groups or () if not few else ():
        if any(number not in by_number for number in group):
            continue
        here = [by_number[number].index for number in group if by_number[number].index in seen]
        apart |= set(here)
        above += [(one, other) for one, other in permutations(here, 2) if seen[one] >= seen[other]]
    return frozenset(apart), tuple(above)


def _breaks(space: Space, limit: Limit, groups: Sequence[Sequence[int]], view: View) -> bool:
    """Whether the thread is late where only these threads are there."""
    known = subset_responses(space, groups, view)
    key = limit.requirement.metric.index or 0
    if (key, "thread") not in known:
        return False
    response = known[key, "thread"]
    return not HOLDS[limit.requirement.operator](Fraction(counted_ns(response)), limit.bound(view))


def late_box(
    space: Space,
    is_late: Callable[[Sequence[int]], bool],
    design: Design,
    seen: Mapping[int, int],
    apart: frozenset[int] = frozenset(),
) -> dict[int, frozenset[int]]:
    """Options of the decisions that were looked at, but for `apart`, of which every combination is late."""
    box = {decision: [option] for decision, option in seen.items() if decision not in apart}
    size = 1
    for decision in sorted(box, key=lambda item: len(space.decisions[item].options)):
        if decision in space.fixed:
            continue
        for option in range(len(space.decisions[decision].options)):
            grown = size // len(box[decision]) * (len(box[decision]) + 1)
            if option == seen[decision] or grown > MOST_COMBINATIONS:
                continue
            others = [[option] if item == decision else options for item, options in box.items()]
            changes = (dict(zip(box, chosen, strict=True)) for chosen in product(*others))
            if all(_is_late_at(is_late, design, item, apart) for item in changes):
                size = grown
                box[decision].append(option)
    return {decision: frozenset(options) for decision, options in box.items()}


def _is_late_at(
    is_late: Callable[[Sequence[int]], bool], design: Design, changes: Mapping[int, int], apart: frozenset[int]
) -> bool:
    """Whether the threads are late with some options changed, by decisions that were looked at only."""
    changed = tuple(changes.get(decision, option) for decision, option in enumerate(design))
    try:
        still, seen = looked_at(changed, lambda view: is_late(view.design))
        return still and seen.keys() <= changes.keys() | apart
    except (NotOffered, CyclicActivation):
        return False


def options_seen(holds: Callable[[Sequence[int]], bool], design: Design) -> dict[int, int]:
    """The options that are looked at to see that something holds in a design."""
    does_hold, seen = looked_at(design, lambda view: holds(view.design))
    assert does_hold, "it does not hold"
    return seen
