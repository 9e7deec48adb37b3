"""Why no order of the threads on a core has all of them in time, as few conditions as will do.

Audsley's test decides that (`dse.analysis.placement.priority_assignment`), with releases that are as regular as they
can be. Threads are taken away one after the other as long as those that are left have no order all the same. Timers
without anything beside them have none either at higher rates and with longer execution times; else the options are
named that were looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from dse.analysis.limits import HOLDS, Limit
from dse.analysis.memo import consulted, looked_at
from dse.analysis.placement.priority_assignment import best_options, groups_of, is_decisive, limits_of
from dse.analysis.rates import is_event_triggered, rate_hz
from dse.analysis.scheduling.busy_window import Stream, Task, response_time_ns
from dse.analysis.scheduling.responses import counted_ns
from dse.analysis.scheduling.tasks import work_ns
from dse.analysis.views import View
from dse.encode.scheduling.reasons import Reason
from dse.encode.scheduling.threads import Places
from dse.space.model.space import Design, OpenPriority, Space
from dse.space.model.trees import at


def order_reasons(
    space: Space, places: Places, limits: Sequence[Limit], design: Design, orders: Sequence[OpenPriority]
) -> Iterator[tuple[Reason, tuple[int, ...]]]:
    """For each core on which no order will do the conditions that make it so, and the threads whose limits count."""
    view = View(design)
    free = {item.component: item for item in orders}
    for whole in groups_of(space, view):
        processor = places.processor_of(whole[0], view)
        if not free.keys() & set(whole) or any(processor not in places.threads[number].cores for number in whole):
            continue

        def fails(group: Sequence[int], seen: Sequence[int] = design) -> bool:
            latest = limits_of(_of(limits, group), View(seen))
            return best_options(space, group, free, latest, seen) is None

        if not is_decisive(space, whole, free, view) or not fails(whole):
            continue
        case = _Timers(space, places, limits, view)
        group = case.least(whole)
        if group:
            yield Reason(tuple(case.conditions(group)), ((processor, tuple(sorted(group))),)), group
            continue
        group = tuple(whole)
        for number in whole:
            fewer = tuple(item for item in group if item != number)
            if fewer and fails(fewer):
                group = fewer

        def asks(seen: View, group: Sequence[int] = group) -> None:
            fails(group, seen.design)
            for number in group:
                at(space.components[number].processor, seen)

        conditions = tuple((places.chosen(*chosen),) for chosen in looked_at(design, asks)[1].items())
        yield Reason(conditions, ((processor, tuple(sorted(group))),)), group


def _of(limits: Sequence[Limit], group: Sequence[int]) -> list[Limit]:
    return [limit for limit in limits if limit.requirement.metric.index in group]


class _Timers:
    """The threads of a core that timers release, with nothing that delays them but each other."""

    def __init__(self, space: Space, places: Places, limits: Sequence[Limit], view: View) -> None:
        self.space, self.places, self.limits, self.view = space, places, limits, view

    def least(self, whole: Sequence[int]) -> tuple[int, ...]:
        """As few of the threads as have no order; none where those that are this simple have one."""
        tasks = {number: task for number in whole if (task := self._task(number)) is not None}
        bounds = limits_of(_of(self.limits, list(tasks)), self.view)
        group = tuple(number for number in tasks if number in bounds)
        if not _fail(group, tasks, bounds):
            return ()
        for number in group:
            fewer = tuple(item for item in group if item != number)
            if _fail(fewer, tasks, bounds):
                group = fewer
        return group

    def _task(self, number: int) -> Task | None:
        thread, component = self.places.threads[number], self.space.components[number]
        if thread.is_odd or is_event_triggered(component, self.view) or at(component.execution_ns, self.view) is None:
            return None
        period: int = at(component.period_ns, self.view)
        return Task("", work_ns(self.space, number, self.view), (Stream(period),))

    def conditions(self, group: Sequence[int]) -> Iterator[tuple[int, ...]]:
        """Literals of these rates or higher ones, these times or longer ones, and of what else limits depend on."""
        for number in group:
            thread = self.places.threads[number]
            rate = rate_hz(self.space, ("activation", number), self.view)
            worst = work_ns(self.space, number, self.view)
            yield tuple(index for index, own in thread.modes if own is not None and own >= rate)
            yield tuple(index for index, own in thread.worst if own >= worst)

        def asks(seen: View) -> None:
            for limit in _of(self.limits, group):
                component = self.space.components[limit.requirement.metric.index or 0]
                if component.deadline_ns is not None or limit.requirement.metric.key != "deadline":
                    limit.bound(seen)

        for decision, option in consulted(self.view, asks)[1].items():
            yield (self.places.chosen(decision, option),)


def _fail(
    group: Sequence[int], tasks: Mapping[int, Task], bounds: Mapping[int, Sequence[tuple[str, Fraction]]]
) -> bool:
    """Whether no order has all of these in time: none is in time as the lowest of those that are left."""
    left = sorted(group, key=lambda number: min(bound for _, bound in bounds[number]))
    while left:
        for number in reversed(left):
            found = response_time_ns(tasks[number], [tasks[other] for other in left if other != number])
            response = Fraction(counted_ns(found))
            if all(HOLDS[operator](response, bound) for operator, bound in bounds[number]):
                left.remove(number)
                break
        else:
            return True
    return False
