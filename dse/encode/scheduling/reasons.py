"""Why a thread is late in a design, as few conditions as will do: what the search learns from a refused solution.

Threads are taken away one after the other as long as those that are left make the thread late all the same. Where it is
late even without any jitter, it is so whenever these threads share a core with it, at these rates or higher ones, with
these execution times or longer ones; else the options are named on which their releases and times depend.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import permutations

from dse.analysis.limits import HOLDS, Limit, judge
from dse.analysis.memo import consulted, looked_at
from dse.analysis.messages.stages import counted_buses
from dse.analysis.placement.first_fit import core_of_each
from dse.analysis.rates import NS_PER_S, is_event_triggered, rate_hz
from dse.analysis.scheduling.busy_window import Stream, Task, response_time_ns
from dse.analysis.scheduling.priorities import number_of, order_ns
from dse.analysis.scheduling.responses import counted_ns, subset_responses, with_threads
from dse.analysis.scheduling.tasks import work_ns
from dse.analysis.terms import FlowChain
from dse.analysis.views import View
from dse.encode.linear import OpenTerm
from dse.encode.messages.reasons import value_conditions
from dse.encode.scheduling.threads import Places, Thread
from dse.space.architecture.chains import may_come_seldom, may_succeed
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import Exact


@dataclass(frozen=True)
class Reason:
    """Facts that cannot be true together: one literal of each of `conditions`, and each group on a core of its own.

    Groups are a processor and the numbers of threads on one core of it. Of each pair of `above` the first thread has a
    priority no lower than the second's.
    """

    conditions: tuple[tuple[int, ...], ...]
    together: tuple[tuple[int, tuple[int, ...]], ...]
    above: tuple[tuple[int, int], ...] = ()


@dataclass
class _Case:
    space: Space
    places: Places
    limit: Limit
    view: View
    number: int = field(init=False)

    def __post_init__(self) -> None:
        self.number = self.limit.requirement.metric.index or 0

    def is_late(self, response_ns: Exact | None) -> bool:
        """Whether a response time breaks the limit."""
        compare = HOLDS[self.limit.requirement.operator]
        return not compare(Fraction(counted_ns(response_ns)), self.limit.bound(self.view))


def reason_of(space: Space, places: Places, limit: Limit, view: View) -> Reason:
    """Conditions that together make the thread of a limit late; all of them hold in the design."""
    case = _Case(space, places, limit, view)
    groups = _groups(space, places, view)
    own = next((group for group in groups if case.number in group[1]), None)
    if own is not None:
        found = _without_jitter(case, own)
        if found is not None:
            return found
    kept = _least_groups(case, groups)
    if kept is None:  # late by itself
        return _by_options(case, lambda watching: limit.measure.value(watching), ())

    def responses(watching: View) -> object:
        return subset_responses(space, [threads for _, threads in kept], watching)

    return _by_options(case, responses, kept)


def reason_of_value(
    space: Space, places: Places, term: OpenTerm, view: View, has: int, exact: int
) -> tuple[Reason, int]:
    """Conditions under which a figure is at least so large: more than a solution `has`, and at most its `exact` value.

    Of a thread's waiting as little counts as shows that it is more: its executor, its core, all threads, as if no
    message waited, or all that there is. All that the figure hangs on are conditions where it may fall.
    """
    value = term.value
    if term.may_fall:
        return _seen(space, places, value, view, ()), exact
    has_buses = bool(counted_buses(space))
    if has_buses and (known := value_conditions(space, places.chosen, term, view, has, exact)) is not None:
        return Reason(tuple(known[0]), ()), known[1]
    groups = _groups(space, places, view)

    def with_only(given: Sequence[tuple[int, tuple[int, ...]]], design: Sequence[int]) -> int:
        return value(View(design, [threads for _, threads in given]))

    is_known = not has_buses and all(
        _is_known(places, processor, number) for processor, numbers in groups for number in numbers
    )
    least = exact
    for few in _few_groups(space, groups, term, view):
        found = with_only(few, view.design)
        if found > has:
            groups, least, is_known = few, found, True
            break
    if not is_known:
        found = with_only(groups, view.design)
        if found <= has or (found < least and not has_buses):
            return _seen(space, places, value, view, ()), exact
        least = found
    for group in list(groups):
        fewer = [item for item in groups if item != group]
        if with_only(fewer, view.design) >= least:
            groups = fewer
    for number in [item for _, threads in groups for item in threads]:
        fewer = [(slot, left) for slot, threads in groups if (left := tuple(n for n in threads if n != number))]
        if with_only(fewer, view.design) >= least:
            groups = fewer
    return _seen(space, places, lambda seen: with_only(groups, seen.design), view, groups), least


def reason_of_message(space: Space, places: Places, limit: Limit, view: View) -> Reason:
    """Conditions that together make the message of a limit late, with as few threads that wait as will do.

    All of them hold in the design.
    """

    def is_late(given: Sequence[tuple[int, tuple[int, ...]]], design: Sequence[int]) -> bool:
        seen = with_threads(space, [threads for _, threads in given], design)
        return not judge(limit, seen).holds

    groups = _groups(space, places, view)
    if not is_late(groups, view.design):
        return _seen(space, places, lambda seen: judge(limit, seen).holds, view, ())
    for group in list(groups):
        fewer = [item for item in groups if item != group]
        if is_late(fewer, view.design):
            groups = fewer
    for number in [item for _, threads in groups for item in threads]:
        fewer = [(slot, left) for slot, threads in groups if (left := tuple(n for n in threads if n != number))]
        if is_late(fewer, view.design):
            groups = fewer
    return _seen(space, places, lambda seen: is_late(groups, seen.design), view, groups)


def _few_groups(
    space: Space, groups: Sequence[tuple[int, tuple[int, ...]]], term: OpenTerm, view: View
) -> Iterator[list[tuple[int, tuple[int, ...]]]]:
    """Who shares an executor with the thread whose waiting a figure is, and then who shares its core.

    Of a thread in no executor the rows of its model count these. Of a chain who shares a core with a thread of it.
    """
    waiter = None if term.waits is None else term.waits[0]
    if isinstance(waiter, FlowChain):
        yield [group for group in groups if set(group[1]) & set(waiter.threads)]
        return
    number = waiter
    executor = None if number is None else at(space.components[number].executor, view)
    if executor is None:
        return
    for processor, threads in groups:
        if number in threads:
            yield [(processor, tuple(one for one in threads if at(space.components[one].executor, view) == executor))]
            yield [(processor, threads)]


def _seen(
    space: Space,
    places: Places,
    formula: Callable[[View], object],
    view: View,
    groups: Sequence[tuple[int, tuple[int, ...]]],
) -> Reason:
    """Every option that a formula consults."""

    def asks(seen: View) -> None:
        formula(seen)
        for _, threads in groups:
            for number in threads:
                at(space.components[number].processor, seen)

    return _named(space, places, looked_at(view.design, asks)[1], view, groups)


def _groups(space: Space, places: Places, view: View) -> list[tuple[int, tuple[int, ...]]]:
    """Who shares a core in the design.

    With whom a thread shares one by first-fit follows from everything: it is alone here.
    """
    found: dict[tuple[int, bool, int], list[int]] = {}
    for processor in range(len(space.processors)):
        for number, core in core_of_each(space, processor, view).items():
            is_known = _is_known(places, processor, number)
            place = core if is_known else number
            found.setdefault((processor, is_known, place), []).append(number)
    return [(processor, tuple(numbers)) for (processor, *_), numbers in found.items()]


def _is_known(places: Places, processor: int, number: int) -> bool:
    """Whether the cores of a processor that a thread may have are decisions, or stated."""
    return processor in places.threads[number].cores


def _least_groups(
    case: _Case, groups: Sequence[tuple[int, tuple[int, ...]]]
) -> list[tuple[int, tuple[int, ...]]] | None:
    """Groups from which no thread can be taken away without the thread's being in time; None where it never is late."""

    def late(given: Sequence[tuple[int, tuple[int, ...]]]) -> bool:
        known = subset_responses(case.space, [threads for _, threads in given], case.view)
        return (case.number, "thread") in known and case.is_late(known[case.number, "thread"])

    kept = [group for group in groups if case.number in group[1]]
    if not kept:
        return None
    if not late(kept):
        kept = list(groups)
        if not late(kept):
            return None
        for group in list(kept):
            fewer = [item for item in kept if item != group]
            if case.number not in group[1] and late(fewer):
                kept = fewer
    for number in [item for _, threads in kept for item in threads]:
        if number == case.number:
            continue
        fewer = [(processor, left) for processor, threads in kept if (left := tuple(n for n in threads if n != number))]
        if late(fewer):
            kept = fewer
    return kept


def _by_options(
    case: _Case, formula: Callable[[View], object], groups: Sequence[tuple[int, tuple[int, ...]]]
) -> Reason:
    """Every option that the formula and the limit consult."""

    def asks(seen: View) -> None:
        formula(seen)
        case.limit.bound(seen)
        for _, threads in groups:
            for number in threads:
                at(case.space.components[number].processor, seen)

    return _named(case.space, case.places, consulted(case.view, asks)[1], case.view, groups)


def _named(
    space: Space,
    places: Places,
    asked: Mapping[int, int],
    view: View,
    groups: Sequence[tuple[int, tuple[int, ...]]],
) -> Reason:
    """These options; of priorities that are numbers only who goes first in the groups, unless levels are few.

    Beside an executor or a reservation, whose place is not that of its threads, the numbers themselves count.
    """
    above: list[tuple[int, int]] = []
    numbered: set[int] = set()
    for processor, threads in groups:
        decided = {
            number: decision
            for number in threads
            if places.threads[number].numbers
            and (decision := space.decision_index(f"{space.components[number].name}.priority")) is not None
        }
        if not decided or space.processors[processor].priority_levels is not None:
            continue
        if any(
            item.executor is not None or item.reservation is not None
            for item in map(space.components.__getitem__, threads)
        ):
            continue
        numbered |= set(decided.values())
        for first, second in permutations(threads, 2):
            if first in decided or second in decided:
                ranks = [number_of(space.components[number], view) for number in (first, second)]
                if ranks[0] is not None and ranks[1] is not None and ranks[0] >= ranks[1]:
                    above.append((first, second))
    conditions = tuple(
        (places.chosen(decision, option),) for decision, option in asked.items() if decision not in numbered
    )
    together = [group for group in groups if all(_is_known(places, group[0], number) for number in group[1])]
    return Reason(conditions, tuple(together), tuple(above))


# --- without jitter ------------------------------------------------------------------------------------------------


def _without_jitter(case: _Case, own: tuple[int, tuple[int, ...]]) -> Reason | None:
    """The reason where rivals' jobs are counted by their rates alone; None where the thread would not be late then."""
    processor, numbers = own
    places, space, view = case.places, case.space, case.view
    thread = places.threads[case.number]
    modes = [index for index, rate in thread.modes if rate is not None]
    component = space.components[case.number]
    if thread.is_odd or thread.rates is None or not modes or is_event_triggered(component, view):
        return None
    own_order = None if thread.is_numbered else order_ns(space, case.number, view)
    if (own_order is None and not thread.is_numbered) or at(component.execution_ns, view) is None:
        return None
    rivals = dict(_rivals(case, thread, numbers))
    worst = work_ns(space, case.number, view)
    single = Task("", worst, ())

    def ends(chosen: Iterable[int]) -> Exact | None:
        return response_time_ns(single, [rivals[number] for number in chosen])

    kept = sorted(rivals, key=lambda number: (rivals[number].utilisation, number))
    if not case.is_late(ends(kept)):
        return None
    for number in list(kept):
        fewer = [item for item in kept if item != number]
        if case.is_late(ends(fewer)):
            kept = fewer
    end = ends(kept)
    conditions = [_late_modes(case, thread, own_order, end), _at_least(thread.worst, worst), *_bound_options(case)]
    for number in kept:
        other = places.threads[number]
        speed = rate_hz(space, ("activation", number), view)
        conditions.append(_no_later(other, speed, None if other.is_numbered else order_ns(space, number, view)))
        conditions.append(_at_least(other.worst, rivals[number].worst_ns))
    above = tuple((number, case.number) for number in kept if thread.numbers or places.threads[number].numbers)
    return Reason(tuple(conditions), ((processor, (case.number, *sorted(kept))),), above)


def _rivals(case: _Case, thread: Thread, numbers: Iterable[int]) -> Iterator[tuple[int, Task]]:
    """What delays the thread of a limit, as far as its jobs are counted by its rate."""
    for number in numbers:
        other = case.places.threads[number]
        if number == case.number or other.is_odd or other.rates is None:
            continue
        if may_succeed(case.space, case.number, number):  # in a chain they need not wait for each other
            continue
        if may_come_seldom(case.space, number, (case.number,)):
            continue
        speed = rate_hz(case.space, ("activation", number), case.view)
        work = work_ns(case.space, number, case.view)
        if speed and work and _goes_first(case, other, thread):
            separation = -(-NS_PER_S * speed.denominator // speed.numerator)
            yield number, Task("", work, (Stream(separation),))


def _no_later(other: Thread, speed: Fraction, latest: Fraction | None) -> tuple[int, ...]:
    """The literals of a thread's rates from `speed` on, where its turn is no later than it is."""
    if latest is None:
        return tuple(index for index, rate in other.rates or () if rate >= speed)
    turns = other.turns or ()
    return tuple(index for index, order, rate in turns if rate >= speed and order is not None and order <= latest)


def _goes_first(case: _Case, other: Thread, thread: Thread) -> bool:
    """Whether another thread delays this one; also with an earlier turn of that one, and a later one of this."""
    numbers = [number_of(case.space.components[item.number], case.view) for item in (other, thread)]
    if numbers != [None, None]:
        return numbers[0] is not None and (numbers[1] is None or numbers[0] >= numbers[1])
    if other.turns is None:
        return False
    orders = [order_ns(case.space, item.number, case.view) for item in (other, thread)]
    if orders[0] is None or orders[1] is None:
        return False
    return (orders[0], other.number) < (orders[1], thread.number)


def _at_least(table: Sequence[tuple[int, int]], value: int) -> tuple[int, ...]:
    return tuple(index for index, item in table if item >= value)


def _is_period(case: _Case) -> bool:
    """Whether the limit is the period of a timer."""
    component = case.space.components[case.number]
    return component.deadline_ns is None and case.limit.requirement.metric.key == "deadline"


def _bound_options(case: _Case) -> list[tuple[int, ...]]:
    """The options that a limit depends on which is not the period."""
    if _is_period(case):
        return []
    _, asked = consulted(case.view, case.limit.bound)
    return [(case.places.chosen(decision, option),) for decision, option in asked.items()]


def _late_modes(case: _Case, thread: Thread, order: Fraction | None, end: Exact | None) -> tuple[int, ...]:
    """The modes of the thread, of this turn or a later one, whose limit the end of the job breaks."""
    found = []
    is_period = _is_period(case)
    modes = thread.timers or [(index, None, rate) for index, rate in thread.modes]
    for index, turn, own in modes:
        if own is None or (order is not None and (turn is None or turn < order)):
            continue
        late = True
        if is_period:
            late = end is None or not HOLDS[case.limit.requirement.operator](Fraction(end), NS_PER_S / own)
        if late:
            found.append(index)
    return tuple(found)
