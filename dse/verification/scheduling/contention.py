"""Limits on response times in the second proof: what a refused solution teaches the second model.

Such a limit depends on whatever shares a core, so that no diagram holds it. The model does without at first, and the
analysis judges each of its solutions. Where threads are late, other cores are tried (they change nothing else); where
that is in vain, a set of threads is named that cannot share a core at these options, and each option that changes
nothing of that is added: every combination in the box is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import permutations, product
from typing import TypeAlias

from dse.analysis.evaluate import Evaluation, Evaluator
from dse.analysis.limits import HOLDS, Limit, judge
from dse.analysis.memo import looked_at
from dse.analysis.placement.first_fit import core_of_each
from dse.analysis.placement.heuristics import placements
from dse.analysis.placement.priority_assignment import best_options, groups_of, is_decisive, limits_of
from dse.analysis.scheduling.chained import chain_wait_ns
from dse.analysis.scheduling.responses import all_responses, counted_ns, subset_responses, waited_ns
from dse.analysis.terms import FlowChain
from dse.analysis.views import View
from dse.space.architecture.joins import may_join
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Component, Design, OpenPriority, Space
from dse.space.model.trees import NotOffered, at, leaves
from dse.space.question.open_cores import decided_cores

MOST_COMBINATIONS = 400
"""A box of options grows as long as it has no more combinations than this."""

Groups: TypeAlias = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Lesson:
    """Not all at once: each decision has one of the options beside it, and the threads of each group share a core.

    Of each pair of `above` the first decision has an option that is no earlier than the second's.
    With `raised` (a thread, and a time in ns): else that thread waits so long at least. With `before` (the key of a
    message that waits, and another message): else the other one goes before it.
    """

    box: Mapping[int, frozenset[int]]
    groups: Groups
    raised: tuple[int, Fraction] | None = None
    above: tuple[tuple[int, int], ...] = ()
    before: tuple[int, int] | None = None


def is_late_limit(limit: Limit) -> bool:
    """Whether a limit is an upper one on a response time for which threads wait."""
    return limit.requirement.is_deadline and any(term.ends is not None for term in limit.measure.terms)


def is_simple(component: Component) -> bool:
    """Whether the jobs of a thread can be counted: it is an OS thread with jobs of one kind."""
    is_hybrid = "hybrid" in set(leaves(component.protocol)) and (
        component.callback_ns is not None or may_join(component)
    )
    return component.processor is not None and component.is_lone and not is_hybrid


def has_number(component: Component) -> bool:
    """Whether a thread has a priority number, stated or decided."""
    return any(isinstance(leaf, int) for leaf in leaves(component.priority))


def place_of(space: Space, number: int, view: View) -> int:
    """A number for the core that a thread runs on: the same for two threads only where they share one.

    Negative where it runs on none, or where first-fit decides.
    """
    component = space.components[number]
    processor, core = at(component.processor, view), at(component.core, view)
    if processor is None:
        return -1 - number
    if core is None:
        if at(space.processors[processor].cores, view) > 1:
            return -1 - number
        core = 1
    most = max(count for slot in space.processors for count in leaves(slot.cores))
    return int(processor * (most + 1) + core)


def on_other_cores(
    evaluator: Evaluator, late: Sequence[Limit], refused: Evaluation, held: int | None = None
) -> Evaluation | None:
    """The design with cores on which the analysis accepts it, with the same objectives; None where none is found.

    The option of the decision `held` stays.
    """
    space = evaluator.space
    kept = {*space.fixed, held}
    open_ = [item for item in decided_cores(space) if item.index not in kept]
    orders = [item for item in _free_orders(space) if item.index != held]
    design = tuple(max(option, 0) for option in refused.design)
    if space.has_open_groups:
        return None
    beside = [limit for limit in evaluator.limits if limit.cores is not None]
    for other in placements(space, design, open_, late, orders, beside) if open_ or orders else ():
        found = evaluator.evaluate(other)
        if found.is_feasible and found.objectives == refused.objectives:
            return found
    return None


def _free_orders(space: Space) -> list[OpenPriority]:
    """The threads for which the best order is asked, as far as it is open."""
    there = [item for item in space.open_priorities if item.index < len(space.decisions)]
    return [item for item in there if item.index not in space.fixed]


def lessons_of(space: Space, late: Sequence[Limit], design: Design, limits: Sequence[Limit] = ()) -> list[Lesson]:
    """The lessons of the late threads of a design: in any order, with these `limits`, or in this one."""
    view = View(design)
    found = list(_without_order(space, limits, design))
    return found or [_lesson(space, limit, design) for limit in late if not judge(limit, view).holds]


def _without_order(space: Space, limits: Sequence[Limit], design: Design) -> Iterator[Lesson]:
    """The threads of each core for which there is no order with all of them in time."""
    view = View(design)
    free = {item.component: item for item in _free_orders(space)}

    def fails(group: Sequence[int], given: Sequence[int]) -> bool:
        counted = [limit for limit in limits if limit.requirement.metric.index in group]
        return best_options(space, group, free, limits_of(counted, View(given)), given) is None

    for whole in groups_of(space, view) if free else ():
        alone = any(place_of(space, number, view) < 0 for number in whole)
        if alone or not is_decisive(space, whole, free, view) or not fails(whole, design):
            continue
        group = tuple(whole)
        for number in whole:
            fewer = tuple(item for item in group if item != number)
            if fewer and fails(fewer, design):
                group = fewer

        def is_late(given: Sequence[int], group: Sequence[int] = group) -> bool:
            return fails(group, given)

        yield Lesson(_box(space, is_late, design, _seen(is_late, design)), (group,))


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


def waiting_lesson(space: Space, number: int, waited: Fraction, design: Design) -> Lesson:
    """The lesson of a thread that waits for a given time (ns) in a design."""

    def waits(groups: Sequence[Sequence[int]] | None, view: View) -> bool:
        known = all_responses(space, view) if groups is None else subset_responses(space, groups, view)
        return waited_ns(space, number, view, counted_ns(known.get((number, "thread"), 0))) >= waited

    groups = least_groups(space, number, waits, design)
    seen = _seen(lambda given: waits(groups, View(given)), design)
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

    seen = _seen(waits_there, design)
    apart, above = ordered_pairs(space, groups, seen)
    box = {item: frozenset((option,)) for item, option in seen.items() if item not in apart}
    return Lesson(box, groups or (), (key, waited), above)


def _lesson(space: Space, limit: Limit, design: Design) -> Lesson:
    number = limit.requirement.metric.index or 0
    groups = least_groups(space, number, lambda given, view: _breaks(space, limit, given, view), design)

    def is_late(given: Sequence[int]) -> bool:
        view = View(given)
        return not judge(limit, view).holds if groups is None else _breaks(space, limit, groups, view)

    seen = _seen(is_late, design)
    apart, above = ordered_pairs(space, groups, seen)
    return Lesson(_box(space, is_late, design, seen, apart), groups or (), above=above)


def full_lesson(space: Space, limit: Limit, design: Design) -> Lesson:
    """The lesson of a processor whose threads do not fit on its cores in a design."""

    def is_full(given: Sequence[int]) -> bool:
        return not judge(limit, View(given)).holds

    return Lesson(_box(space, is_full, design, _seen(is_full, design)), ())


def _seen(holds: Callable[[Sequence[int]], bool], design: Design) -> dict[int, int]:
    """The options that are looked at to see that something holds in a design."""
    does_hold, seen = looked_at(design, lambda view: holds(view.design))
    assert does_hold, "it does not hold"
    return seen


def _breaks(space: Space, limit: Limit, groups: Sequence[Sequence[int]], view: View) -> bool:
    """Whether the thread is late where only these threads are there."""
    known = subset_responses(space, groups, view)
    key = limit.requirement.metric.index or 0
    if (key, "thread") not in known:
        return False
    response = known[key, "thread"]
    return not HOLDS[limit.requirement.operator](Fraction(counted_ns(response)), limit.bound(view))


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


def _box(
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
