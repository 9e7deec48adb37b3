"""Lessons of the second proof from cores on which no order has all threads in time.

Audsley's test decides that (`dse.analysis.placement.priority_assignment`). Threads are taken away one after the other
as long as those that are left have no order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dse.analysis.limits import Limit
from dse.analysis.placement.priority_assignment import best_options, groups_of, is_decisive, limits_of
from dse.analysis.views import View
from dse.space.model.space import Design, OpenPriority, Space
from dse.verification.scheduling.reasons import Lesson, late_box, options_seen
from dse.verification.scheduling.threads import place_of


def free_orders(space: Space) -> list[OpenPriority]:
    """The threads for which the best order is asked, as far as it is open."""
    there = [item for item in space.open_priorities if item.index < len(space.decisions)]
    return [item for item in there if item.index not in space.fixed]


def order_lessons(space: Space, limits: Sequence[Limit], design: Design) -> Iterator[Lesson]:
    """The lesson of each core for whose threads there is no order with all of them in time."""
    view = View(design)
    free = {item.component: item for item in free_orders(space)}

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

        yield Lesson(late_box(space, is_late, design, options_seen(is_late, design)), (group,))
